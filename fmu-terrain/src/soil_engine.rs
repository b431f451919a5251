//! What a granular unit asks of its engine: the one place where the models `terrain_dem_p` and `terrain_dem_c` differ.

use crate::config::Terrain;
use crate::dem::{
    self, BedReport, Body, CpuEngine, DemError, DemState, Grain, GrainEngine, limits, prepare, prepare_with,
};
use crate::dem_c::{ConeEngine, ConeSetup, ConeState};
use serde::Serialize;
use serde::de::DeserializeOwned;
use terramech_mechanics::cone::Method;

/// Told of progress: phase, fraction done; `false` asks to stop.
pub type Progress<'a> = &'a mut dyn FnMut(&str, f64) -> bool;

/// What an iterative engine says of its last steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolverReport {
    /// Iterations of the last inner step.
    pub iterations: u32,
    /// Residual there (m/s).
    pub residual: f64,
    /// Inner steps so far whose solve ended above the tolerance.
    pub unconverged: u64,
    /// Where the worst contact of the last inner step is (m).
    pub worst: [f64; 3],
}

/// What is odd about the soil's adhesion, if anything: a pressure in the wrong unit is off by a thousand or a million.
pub fn odd_adhesion(spec: &Terrain) -> Option<String> {
    let (setup, grains) = (spec.setup(&[]), spec.lightest());
    let (grain, a) = (grains.first()?, setup.materials.first()?.adhesion);
    let r = grain.radius;
    let r_eff = 0.5 * r;
    let pull = a.constant + a.dmt * r_eff.sqrt() + a.perko * r_eff + std::f64::consts::PI * r * r * a.pressure;
    let weight = grain.density * 4.0 / 3.0 * std::f64::consts::PI * r.powi(3) * dem::vec3::norm(setup.gravity);
    let ratio = pull / weight;
    // None at all is usual, and so is a tenth of a weight to what a hundred thousand grains weigh.
    if ratio == 0.0 || (0.1..=1e5).contains(&ratio) {
        return None;
    }
    let why = if ratio < 0.1 { "too little to hold a grain" } else { "more than any soil has" };
    Some(format!(
        "soil.adhesion makes a contact of the least grains hold {pull:.3e} N, {ratio:.2e} of a grain's weight: {why}; a constant is in N, dmt in \
         N/m^0.5, perko in N/m, a pressure in Pa"
    ))
}

/// An engine that a unit runs. Specifications are those of [`Terrain`]; `surfaces` are friction, restitution, Young's modulus and
/// Poisson's ratio of the bodies.
pub trait SoilEngine: GrainEngine + Sized {
    /// What is saved beside the grains.
    type Own: Serialize + DeserializeOwned + Clone + Default;
    /// Its name in files of beds.
    const NAME: &'static str;

    /// Longest inner step (s), checked as far as it can be without a bed.
    ///
    /// # Errors
    /// Values outside their ranges, a step above the critical one.
    fn longest_step(spec: &Terrain, surfaces: &[[f64; 4]]) -> Result<f64, DemError>;
    /// Makes the bed.
    ///
    /// # Errors
    /// As [`dem::prepare`].
    fn make(spec: &Terrain, threads: usize, progress: Progress) -> Result<(Self, BedReport), DemError>;
    /// Goes on from a state: its own, or, with the default of `own`, that of another engine.
    ///
    /// # Errors
    /// Values outside their ranges.
    fn open(
        spec: &Terrain,
        surfaces: &[[f64; 4]],
        state: DemState,
        own: Self::Own,
        threads: usize,
    ) -> Result<Self, DemError>;
    /// A member's engine of a bed in this state, which all members hand over whole.
    ///
    /// # Errors
    /// This engine cannot be spread; as [`SoilEngine::open`].
    fn spread(
        _spec: &Terrain,
        _surfaces: &[[f64; 4]],
        _state: &DemState,
        links: Box<dyn dem::spread::Links>,
        _threads: usize,
    ) -> Result<Self, DemError> {
        Err(DemError::parameter("team", links.size(), "one member for this kind of ground"))
    }
    /// Makes the bed by all members of a team together; all get it whole. None: one makes it alone.
    ///
    /// # Errors
    /// As [`SoilEngine::make`].
    fn make_together(
        _spec: &Terrain,
        _threads: usize,
        _links: &dyn Fn() -> Box<dyn dem::spread::Links>,
        _progress: Progress,
    ) -> Result<Option<(Self, BedReport)>, DemError> {
        Ok(None)
    }
    /// The whole state; of a team on the lead, where all members call it.
    ///
    /// # Errors
    /// The team is broken.
    fn whole(&mut self) -> Result<Option<DemState>, DemError> {
        Ok(Some(self.state().clone()))
    }
    /// Which members of its team may meet a body that stays in `zone` (m, along x) for so many inner steps.
    fn may_meet(&self, _zone: [f64; 2], _steps: u32) -> Vec<bool> {
        Vec::new()
    }
    /// All members of its team, or the first of their errors: what one of them alone has found wrong in a step.
    ///
    /// # Errors
    /// That of any member.
    fn agree(&mut self, mine: Result<(), DemError>) -> Result<(), DemError> {
        mine
    }
    /// What is saved beside the grains.
    fn own(&self) -> Self::Own;
    /// Takes the surfaces of the bodies.
    ///
    /// # Errors
    /// As [`SoilEngine::longest_step`].
    fn take_surfaces(&mut self, spec: &Terrain, surfaces: &[[f64; 4]]) -> Result<(), DemError>;
    /// Sets the inner step (s).
    ///
    /// # Errors
    /// A step above the critical one.
    fn change_step(&mut self, step: f64) -> Result<(), DemError>;
    /// Energy turned into heat since the bed was made (J).
    fn heat(&self, bodies: &[Body]) -> f64;
    /// Work of the bodies on the grains since the bed was made (J).
    fn body_work(&self) -> f64;
    /// What the solver did, if there is one.
    fn solver(&self) -> Option<SolverReport>;
}

impl SoilEngine for CpuEngine {
    type Own = ();
    const NAME: &'static str = "dem_p";

    fn longest_step(spec: &Terrain, surfaces: &[[f64; 4]]) -> Result<f64, DemError> {
        let setup = spec.setup(surfaces);
        limits::check(&setup, &spec.lightest())?;
        Ok(setup.step)
    }

    fn make(spec: &Terrain, threads: usize, progress: Progress) -> Result<(Self, BedReport), DemError> {
        prepare(spec.setup(&[]), &spec.recipe(), threads, progress)
    }

    fn open(spec: &Terrain, surfaces: &[[f64; 4]], state: DemState, (): (), threads: usize) -> Result<Self, DemError> {
        let setup = spec.setup(surfaces);
        limits::check_rows(&setup, &state.rows)?;
        Self::with_state(setup, state, threads)
    }

    fn spread(
        spec: &Terrain,
        surfaces: &[[f64; 4]],
        state: &DemState,
        links: Box<dyn dem::spread::Links>,
        threads: usize,
    ) -> Result<Self, DemError> {
        let setup = spec.setup(surfaces);
        limits::check_rows(&setup, &state.rows)?;
        Self::spread(setup, state, links, threads)
    }

    fn make_together(
        spec: &Terrain,
        threads: usize,
        links: &dyn Fn() -> Box<dyn dem::spread::Links>,
        progress: Progress,
    ) -> Result<Option<(Self, BedReport)>, DemError> {
        let (setup, recipe) = (spec.setup(&[]), spec.recipe());
        if !dem::spread::is_made_together(&setup, &recipe) {
            return Ok(None);
        }
        let (state, report) = dem::spread::prepare_together(&setup, &recipe, threads, links, progress)?;
        Ok(Some((Self::with_state(setup, state, threads)?, report)))
    }

    fn whole(&mut self) -> Result<Option<DemState>, DemError> {
        self.gather()
    }

    fn may_meet(&self, zone: [f64; 2], steps: u32) -> Vec<bool> {
        Self::may_meet(self, zone, steps)
    }

    fn agree(&mut self, mine: Result<(), DemError>) -> Result<(), DemError> {
        Self::agree(self, mine)
    }

    fn own(&self) {}

    fn take_surfaces(&mut self, spec: &Terrain, surfaces: &[[f64; 4]]) -> Result<(), DemError> {
        self.set_setup(spec.setup(surfaces))
    }

    fn change_step(&mut self, step: f64) -> Result<(), DemError> {
        self.set_step(step)
    }

    fn heat(&self, bodies: &[Body]) -> f64 {
        self.dissipated(bodies)
    }

    fn body_work(&self) -> f64 {
        body_work(self.state())
    }

    fn solver(&self) -> Option<SolverReport> {
        None
    }
}

/// Work of the bodies since the account of energy was opened (J).
fn body_work(state: &DemState) -> f64 {
    state.energy_account.map_or(0.0, |[_, before]| state.body_work - before)
}

/// The setup of the complementarity engine.
fn cone_setup(spec: &Terrain, surfaces: &[[f64; 4]]) -> (dem::Setup, ConeSetup) {
    use crate::config::Solver;
    let c = spec.dem_c.unwrap_or_default();
    let setup = spec.setup(surfaces);
    let cone = ConeSetup {
        method: match c.solver {
            Solver::Relaxation => Method::Relaxation,
            Solver::Nesterov => Method::Nesterov,
            Solver::BarzilaiBorwein => Method::BarzilaiBorwein,
            Solver::GaussSeidel => Method::GaussSeidel,
        },
        tolerance: c.tolerance,
        iterations: c.iterations,
        recovery_time: c.recovery_time,
        recovery_speed: c.recovery_speed,
        obstacle_step: setup.step,
        elastic: c.contacts == crate::config::Contacts::Elastic,
    };
    (dem::Setup { step: c.step, ..setup }, cone)
}

impl SoilEngine for ConeEngine {
    type Own = ConeState;
    const NAME: &'static str = "dem_c";

    fn longest_step(spec: &Terrain, surfaces: &[[f64; 4]]) -> Result<f64, DemError> {
        Ok(cone_setup(spec, surfaces).0.step)
    }

    fn make(spec: &Terrain, threads: usize, progress: Progress) -> Result<(Self, BedReport), DemError> {
        let (setup, cone) = cone_setup(spec, &[]);
        let adheres = dem::material::PairTable::new(&setup.materials, &setup.overrides).any_adhesion();
        let new = |grains: &[Grain]| Self::new(setup.clone(), cone, grains, threads);
        prepare_with(new, adheres, &spec.recipe(), progress)
    }

    fn open(
        spec: &Terrain,
        surfaces: &[[f64; 4]],
        state: DemState,
        own: ConeState,
        threads: usize,
    ) -> Result<Self, DemError> {
        let (setup, cone) = cone_setup(spec, surfaces);
        Self::with_state(setup, cone, state, own, threads)
    }

    fn own(&self) -> ConeState {
        self.cone_state()
    }

    fn take_surfaces(&mut self, spec: &Terrain, surfaces: &[[f64; 4]]) -> Result<(), DemError> {
        self.set_setup(cone_setup(spec, surfaces).0);
        Ok(())
    }

    fn change_step(&mut self, step: f64) -> Result<(), DemError> {
        self.set_step(step);
        Ok(())
    }

    fn heat(&self, _: &[Body]) -> f64 {
        self.dissipated()
    }

    fn body_work(&self) -> f64 {
        body_work(self.state())
    }

    fn solver(&self) -> Option<SolverReport> {
        let r = self.report();
        Some(SolverReport {
            iterations: r.outcome.iterations,
            residual: r.outcome.residual,
            unconverged: self.cone_state().unconverged,
            worst: r.worst,
        })
    }
}
