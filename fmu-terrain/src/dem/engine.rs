//! The engine: what a bed is made of, and how a step goes.
//!
//! `step.rs` says how a step goes, [`super::slab`] why no thread count changes a bit.

use super::batch::{BatchKernel, only_material};
use super::body::Body;
use super::contact::Options;
use super::diagnostics::Touched;
use super::error::DemError;
use super::grains::{DemState, Grain, R, Row, V};
use super::kernel::Partner;
use super::law::{Form, LawKind, Tangential};
use super::limits;
use super::material::{Material, PairOverride, PairTable};
use super::patch::walls;
use super::rebuild::{Making, rebuild};
use super::slab::{Near, Scratch};
use super::sleep::Sleep;
use super::spread::{self, Spread};
use super::team::Team;
use super::vec3::Vec3;
use super::wall::Wall;
use std::sync::Arc;
use terramech_simd::contact::Precision;
use terramech_simd::{ISA_VARIABLE, Isa, prefer_large_pages};

/// What a bed is made of and how it is computed: constant during a run, not part of the state.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Step h (s).
    pub step: f64,
    /// Gravity (m/s2).
    pub gravity: Vec3,
    /// Materials of grains, walls and bodies.
    pub materials: Vec<Material>,
    /// Explicit pairs.
    pub overrides: Vec<PairOverride>,
    /// Force law.
    pub law: LawKind,
    /// Where stiffness and damping come from.
    pub form: Form,
    /// How the tangential displacement is followed.
    pub tangential: Tangential,
    /// What grain-grain contacts are computed with, where a batch kernel covers law and form; the others, walls and bodies are always
    /// computed in double precision.
    pub precision: Precision,
    /// Whether the normal force before adhesion is clamped at zero.
    pub clamp_normal: bool,
    /// Damping ratio of rolling and spinning resistance (1); 1 is critical: a grain comes to rest without rocking. Ai et
    /// al. take 0.3, with which rocking takes seconds to die where rolling friction is small.
    pub rolling_damping: f64,
    /// Time in which adhesion of a new contact grows to its full value (s); 0 = at once.
    pub adhesion_time: f64,
    /// Overlap at which adhesion is fully grown (m); 0 = at once.
    pub adhesion_overlap: f64,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Skin of the pair lists as a fraction of the mean radius; 0.05 to 0.2. Larger: fewer rebuilds, longer lists; measured
    /// best on a bed that a wheel drives through: 0.15.
    pub skin: f64,
    /// Largest overlap expected, as a fraction of the smaller radius: decides the critical step.
    pub expected_overlap: f64,
    /// Critical step = this x sqrt(m*/k_n) at that overlap. See [`limits`].
    pub step_factor: f64,
    /// What may sleep; none: nothing.
    pub sleep: Option<Sleep>,
    /// Length after which the bed repeats itself along x (m), from half of it on both sides of the origin ([`super::period`]).
    pub period: Option<f64>,
    /// Distance of a driven body from the foremost tile (m) at which the box, a bed of tiles, moves on ([`super::patch`]); none: never.
    pub follow: Option<f64>,
}

impl Default for Setup {
    /// One default material, Hertz-Mindlin from properties with history, no walls, h 4e-5 s.
    fn default() -> Self {
        Self {
            step: 4e-5,
            gravity: [0.0, 0.0, -9.81],
            materials: vec![Material::default()],
            overrides: Vec::new(),
            law: LawKind::default(),
            form: Form::default(),
            tangential: Tangential::default(),
            precision: Precision::default(),
            clamp_normal: false,
            rolling_damping: 1.0,
            adhesion_time: 0.0,
            adhesion_overlap: 0.0,
            walls: Vec::new(),
            skin: 0.15,
            expected_overlap: 0.05,
            step_factor: limits::STEP_FACTOR,
            sleep: None,
            period: None,
            follow: None,
        }
    }
}

impl Setup {
    /// The same with this factor on all friction: sliding, rolling, spinning.
    pub fn with_friction(&self, factor: f64) -> Self {
        let mut setup = self.clone();
        let of_materials = setup
            .materials
            .iter_mut()
            .flat_map(|m| [&mut m.friction, &mut m.rolling_friction, &mut m.spinning_friction]);
        let of_pairs = setup
            .overrides
            .iter_mut()
            .flat_map(|o| [&mut o.friction, &mut o.rolling_friction, &mut o.spinning_friction]);
        of_materials.chain(of_pairs.flatten()).for_each(|x| *x *= factor);
        setup
    }
}

/// An engine that moves grains: this one, or later one that spreads over processes or runs on a GPU.
///
/// # Protocol
/// `advance` any number of times; between two calls the state may be read or replaced. After an error the state is
/// that of the failed step and must be replaced before going on.
pub trait GrainEngine: Send {
    /// The setup.
    fn setup(&self) -> &Setup;
    /// Advances by `steps` steps. `bodies` start at their communication point (t = 0) and end wherever they are after
    /// the last step; their impulses are added to.
    ///
    /// # Errors
    /// Values that are not finite, grains outside or deep inside each other.
    fn advance(&mut self, steps: u32, bodies: &mut [Body]) -> Result<(), DemError>;
    /// The state, whole.
    fn state(&self) -> &DemState;
    /// Takes a state back.
    fn restore(&mut self, state: DemState);
    /// Changes the setup; contacts keep what they remember.
    ///
    /// # Errors
    /// Values outside their ranges, a step above the critical one.
    fn take_setup(&mut self, setup: Setup) -> Result<(), DemError>;
    /// Sets the factor on all adhesion, 0 to 1.
    fn scale_adhesion(&mut self, factor: f64);
    /// Lets all adhesion act at once without a grain moving: the overlap of every contact counts from an offset at which it carries
    /// its adhesion beside what it carries now ([`super::offset`]).
    ///
    /// # Errors
    /// An engine that has no such offsets; adhesion that presses two grains together by more than half the lesser radius.
    fn offset_overlaps(&mut self) -> Result<(), DemError> {
        Err(DemError::parameter("onset of adhesion", "offset", "growth: this engine has no reference overlaps"))
    }
    /// Changes gravity (m/s2): to shake a bed as seen from its box.
    fn set_gravity(&mut self, gravity: Vec3);
    /// Shows every contact at the present instant to `observer`, in canonical order, and changes nothing. Forces are
    /// those of the present positions with the histories as they are.
    fn observe(&self, bodies: &[Body], observer: &mut dyn FnMut(usize, Partner, &Touched));
    /// Work and energy book-keeping: adds work done by bodies is in the state; this opens the account anew.
    fn open_energy_account(&mut self);
}

/// The engine for one process: slabs over threads.
pub struct CpuEngine {
    pub(super) setup: Setup,
    pub(super) pairs: PairTable,
    pub(super) rolling: bool,
    isa: Isa,
    pub(super) batch: Option<BatchKernel>,
    whole: Whole,
    pub(super) state: DemState,
    /// Of each region of a step.
    pub(super) scratch: Vec<Scratch>,
    /// Of each slab.
    pub(super) near: Vec<Near>,
    /// The skin of the lists (m).
    pub(super) skin: f64,
    pub(super) team: Arc<Team>,
    /// Where the walls are now.
    pub(super) walls: Vec<Wall>,
    /// The other members, where the bed is spread over several.
    pub(super) spread: Option<Box<Spread>>,
}

/// Advice when grains end up where they should not.
pub(super) const HINT: &str = "the step or the speeds are too large, or the material is too soft";

/// Margin of the pairs that are looked at ([`Near`]), as a fraction of the skin.
const MARGIN: f64 = 0.25;

/// Slabs are kept at a rebuild whose grains have moved no further than this fraction of the skin; at half of it lists no longer
/// hold. Those in between would soon ask for a rebuild of their own.
pub(super) const KEEP: f64 = 0.25;

/// What is to be known of all grains, those of other members included.
#[derive(Clone, Copy, Debug)]
struct Whole {
    /// Greatest radius (m).
    largest: f64,
    /// Mean radius over that.
    mean: f64,
    /// Their material, if it is one.
    only: Option<usize>,
}

impl Whole {
    /// The mean radius is summed in integers: the same bits in whatever order the grains lie, since an engine that goes on from a saved state finds them in another one than the engine
    /// that made them.
    fn of(rows: &[Row]) -> Self {
        const ONE: f64 = (1_u64 << 32) as f64;
        let largest = rows.iter().fold(f64::MIN_POSITIVE, |m, r| m.max(r[R]));
        let sum: u64 = rows.iter().map(|r| (r[R] / largest * ONE) as u64).sum();
        Self { largest, mean: sum as f64 / ONE / rows.len().max(1) as f64, only: only_material(rows) }
    }

    /// The skin (m).
    fn skin(&self, setup: &Setup) -> f64 {
        setup.skin * self.largest * self.mean
    }
}

impl CpuEngine {
    /// A bed of these grains.
    ///
    /// # Errors
    /// A setup outside its ranges, a step above the critical one, grains that overlap or lie outside the walls.
    pub fn new(setup: Setup, grains: &[Grain], threads: usize) -> Result<Self, DemError> {
        limits::check(&setup, grains)?;
        let state = DemState::of(grains, setup.walls.len());
        let mut engine = Self::with_state(setup, state, threads)?;
        engine.rebuild("the grains were placed so", None)?;
        Ok(engine)
    }

    /// Goes on from a saved state.
    ///
    /// # Errors
    /// The system refuses the threads; `TERRAMECH_ISA` names no instruction path of this processor.
    pub fn with_state(setup: Setup, state: DemState, threads: usize) -> Result<Self, DemError> {
        let pairs = PairTable::new(&setup.materials, &setup.overrides);
        let rolling = pairs.any_rolling();
        let mut state = state;
        if setup.sleep.is_none() {
            state.wake();
        }
        if rolling && state.slabs.iter().any(|s| s.roll.len() != s.other.len()) {
            // All lists need room for what rolls.
            state.wake();
            state.stale = true;
        }
        let isa = Isa::chosen().map_err(|why| {
            let given = std::env::var(ISA_VARIABLE).unwrap_or_default();
            DemError::parameter(ISA_VARIABLE, given, why)
        })?;
        let whole = Whole::of(&state.rows);
        let batch = BatchKernel::of(&setup, &pairs, whole.only, isa);
        prefer_large_pages(&state.rows);
        let team = Arc::new(Team::new(threads)?);
        let skin = whole.skin(&setup);
        let walls = walls(&setup.walls, state.moved());
        Ok(Self {
            pairs,
            rolling,
            isa,
            batch,
            whole,
            setup,
            state,
            scratch: Vec::new(),
            near: Vec::new(),
            skin,
            team,
            walls,
            spread: None,
        })
    }

    /// Goes by the whole bed in this state, of which the engine has a part.
    pub(super) fn know_whole(&mut self, whole: &DemState) {
        self.whole = Whole::of(&whole.rows);
        self.skin = self.whole.skin(&self.setup);
        if self.batch.is_some() {
            self.batch = BatchKernel::of(&self.setup, &self.pairs, self.whole.only, self.isa);
        }
    }

    /// Does something in the threads of this engine.
    pub(super) fn inside<T: Send>(&mut self, work: impl FnOnce(&mut Self) -> T + Send) -> T {
        let team = Arc::clone(&self.team);
        team.enter(|| work(self))
    }

    /// The instruction path that contacts are computed on.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// Computes contacts on another instruction path. Results differ by round-off.
    ///
    /// # Errors
    /// This processor lacks it.
    pub fn set_isa(&mut self, isa: Isa) -> Result<(), DemError> {
        if !isa.runs_here() {
            return Err(DemError::parameter("instruction path", isa.name(), format!("{} here", Isa::widest())));
        }
        self.isa = isa;
        self.batch = BatchKernel::of(&self.setup, &self.pairs, self.whole.only, isa);
        Ok(())
    }

    /// Computes grain-grain contacts one at a time from now on, as every law and form without a batch kernel does: what the batch
    /// kernels are tested against.
    pub fn use_reference_kernel(&mut self) {
        self.batch = None;
    }

    /// Whether any pair of materials adheres.
    pub fn has_adhesion(&self) -> bool {
        self.pairs.any_adhesion()
    }

    /// Changes the step; lists and histories stay.
    ///
    /// # Errors
    /// A step above the critical one.
    pub fn set_step(&mut self, step: f64) -> Result<(), DemError> {
        if step > self.setup.step {
            limits::check_rows(&Setup { step, ..self.setup.clone() }, &self.state.rows)?;
        }
        self.setup.step = step;
        Ok(())
    }

    /// Changes the setup; lists and histories stay. For materials of bodies, which are known later than the bed's.
    ///
    /// # Errors
    /// Values outside their ranges, a step above the critical one; the engine is then as it was.
    pub fn set_setup(&mut self, setup: Setup) -> Result<(), DemError> {
        limits::check_rows(&setup, &self.state.rows)?;
        self.pairs = PairTable::new(&setup.materials, &setup.overrides);
        self.rolling = self.pairs.any_rolling();
        self.state.stale |= self.rolling && self.state.slabs.iter().any(|s| s.roll.len() != s.other.len());
        if self.state.stale || setup.sleep.is_none() {
            self.state.wake();
        }
        self.setup = setup;
        self.walls = walls(&self.setup.walls, self.state.moved());
        self.skin = self.whole.skin(&self.setup);
        if self.batch.is_some() {
            self.batch = BatchKernel::of(&self.setup, &self.pairs, self.whole.only, self.isa);
        }
        Ok(())
    }

    /// Computes on this many threads from now on: changes no bit.
    ///
    /// # Errors
    /// The system refuses them.
    pub fn set_threads(&mut self, threads: usize) -> Result<(), DemError> {
        self.team = Arc::new(Team::new(threads)?);
        Ok(())
    }

    /// Rebuilds lists now instead of when it is due: changes nothing but the order of sums.
    ///
    /// # Errors
    /// As [`GrainEngine::advance`].
    pub fn rebuild_now(&mut self) -> Result<(), DemError> {
        self.rebuild(HINT, None)
    }

    /// Memory held for state and scratch (bytes).
    pub fn memory(&self) -> usize {
        let near: usize = self.near.iter().map(|n| n.active.memory()).sum();
        self.state.memory() + self.scratch.iter().map(Scratch::memory).sum::<usize>() + near
    }

    /// Rebuilds lists; those of slabs whose grains have moved no further than `keep` stay.
    pub(super) fn rebuild(&mut self, hint: &'static str, keep: Option<f64>) -> Result<(), DemError> {
        let (walls, period) = (&self.walls[..], self.setup.period);
        // A quarter of the distance: the nearest slab that may sleep then does.
        let longest = self.setup.sleep.map_or(f64::INFINITY, |s| 0.25 * s.distance);
        let rolling = self.rolling;
        // Pairs whose overlap counts from an offset hold on beyond touching.
        let skin = self.skin + self.state.longest_offset;
        let making = Making { skin, walls, rolling, period, keep, longest, team: &self.team, hint };
        let mut old = std::mem::take(&mut self.near);
        let origin = match &mut self.spread {
            None => rebuild(&mut self.state, &making)?,
            Some(spread) => spread::making::rebuild(&mut self.state, &making, spread)?,
        };
        let near = |k: Option<usize>| k.and_then(|k| old.get_mut(k)).map(std::mem::take).unwrap_or_default();
        self.near = origin.into_iter().map(near).collect();
        // A slab that is kept before one that is listed anew looks at how fast that was in the last step.
        for (near, slab) in self.near.iter_mut().zip(&self.state.slabs).filter(|(near, _)| near.slack < 0.0) {
            let speed = |r: &Row| r[V].powi(2) + r[V + 1].powi(2) + r[V + 2].powi(2);
            near.speed = self.state.rows[slab.grains()].iter().map(speed).fold(0.0, f64::max).sqrt();
        }
        match &mut self.spread {
            None => Ok(()),
            Some(spread) => spread.balance(&mut self.state, &mut self.near),
        }
    }

    pub(super) fn options(&self) -> Options {
        let s = &self.setup;
        let inverse = |x: f64| if x > 0.0 { 1.0 / x } else { f64::INFINITY };
        Options {
            h: s.step,
            tangential: s.tangential,
            least_normal: if s.clamp_normal { 0.0 } else { f64::NEG_INFINITY },
            adhesion: self.pairs.any_adhesion(),
            offsets: self.state.longest_offset > 0.0,
            adhesion_scale: self.state.adhesion_scale,
            adhesion_growth: (s.step * inverse(s.adhesion_time)).min(1.0),
            adhesion_per_overlap: inverse(s.adhesion_overlap),
            rolling_damping: s.rolling_damping,
            margin: MARGIN * self.skin,
        }
    }
}

impl GrainEngine for CpuEngine {
    fn setup(&self) -> &Setup {
        &self.setup
    }

    fn advance(&mut self, steps: u32, bodies: &mut [Body]) -> Result<(), DemError> {
        let h = self.setup.step;
        let mut all =
            |engine: &mut Self| (0..steps).try_for_each(|k| engine.step(f64::from(k) * h, bodies, k + 1 == steps));
        // Members talk to each other from the caller's thread.
        if self.spread.is_none() {
            return self.inside(all);
        }
        all(self)?;
        // For whoever looks at contacts across the cut now.
        self.look_behind()
    }

    fn state(&self) -> &DemState {
        &self.state
    }

    fn restore(&mut self, state: DemState) {
        self.near.clear();
        self.walls = walls(&self.setup.walls, state.moved());
        if self.spread.is_none() {
            self.know_whole(&state);
        }
        self.state = state;
    }

    fn take_setup(&mut self, setup: Setup) -> Result<(), DemError> {
        self.set_setup(setup)
    }

    fn scale_adhesion(&mut self, factor: f64) {
        self.state.adhesion_scale = factor;
    }

    fn offset_overlaps(&mut self) -> Result<(), DemError> {
        self.offset_all()
    }

    fn set_gravity(&mut self, gravity: Vec3) {
        self.setup.gravity = gravity;
    }

    fn observe(&self, bodies: &[Body], observer: &mut dyn FnMut(usize, Partner, &Touched)) {
        self.show_contacts(bodies, observer);
    }

    fn open_energy_account(&mut self) {
        self.state.energy_account = Some([self.energy(&[]), self.state.body_work]);
    }
}
