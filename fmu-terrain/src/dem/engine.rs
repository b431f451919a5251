//! The engine: what a bed is made of, and how a step goes.
//!
//! A step: rebuild the lists if some grain has moved too far; move the bodies to this step's time; all contacts, slab by
//! slab; sum what the grains did to bodies and walls, in slab order; integrate (semi-implicit Euler), slab by slab. Two
//! parallel phases, two barriers. See [`super::slab`] for why no thread count changes a bit.

use super::batch::BatchKernel;
use super::body::Body;
use super::contact::Options;
use super::diagnostics::{Show, Touched};
use super::error::DemError;
use super::grains::{DemState, Grain, INV_I, INV_M, R, Row, V, W, X0};
use super::kernel::{Partner, World, contacts};
use super::law::{Form, LawKind, Tangential, dispatch_law};
use super::limits;
use super::material::{Material, PairOverride, PairTable};
use super::rebuild::rebuild;
use super::slab::{Scratch, Slab};
use super::team::Team;
use super::vec3::Vec3;
use super::wall::Wall;
use std::sync::Arc;
use terramech_simd::{ISA_VARIABLE, Isa};

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
    /// Skin of the pair lists as a fraction of the mean radius; 0.05 to 0.2. Larger: fewer rebuilds, longer lists.
    pub skin: f64,
    /// Largest overlap expected, as a fraction of the smaller radius: decides the critical step.
    pub expected_overlap: f64,
    /// Critical step = this x sqrt(m*/k_n) at that overlap. See [`limits`].
    pub step_factor: f64,
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
            clamp_normal: false,
            rolling_damping: 1.0,
            adhesion_time: 0.0,
            adhesion_overlap: 0.0,
            walls: Vec::new(),
            skin: 0.1,
            expected_overlap: 0.05,
            step_factor: limits::STEP_FACTOR,
        }
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
    /// Sets the factor on all adhesion, 0 to 1.
    fn scale_adhesion(&mut self, factor: f64);
    /// Shows every contact at the present instant to `observer`, in canonical order, and changes nothing. Forces are
    /// those of the present positions with the histories as they are.
    fn observe(&self, bodies: &[Body], observer: &mut dyn FnMut(usize, Partner, &Touched));
    /// Work and energy book-keeping: adds work done by bodies is in the state; this opens the account anew.
    fn open_energy_account(&mut self);
}

/// The engine for one process: slabs over threads.
pub struct CpuEngine {
    setup: Setup,
    pairs: PairTable,
    rolling: bool,
    isa: Isa,
    batch: Option<BatchKernel>,
    state: DemState,
    scratch: Vec<Scratch>,
    team: Arc<Team>,
}

/// Advice when grains end up where they should not.
const HINT: &str = "the step or the speeds are too large, or the material is too soft";

impl CpuEngine {
    /// A bed of these grains.
    ///
    /// # Errors
    /// A setup outside its ranges, a step above the critical one, grains that overlap or lie outside the walls.
    pub fn new(setup: Setup, grains: &[Grain], threads: usize) -> Result<Self, DemError> {
        limits::check(&setup, grains)?;
        let state = DemState {
            rows: grains.iter().map(Grain::row).collect(),
            ids: (0..grains.len() as u32).collect(),
            force: vec![[0.0; 3]; grains.len()],
            stale: true,
            adhesion_scale: 1.0,
            wall_force: vec![[0.0; 3]; setup.walls.len()],
            ..DemState::default()
        };
        let mut engine = Self::with_state(setup, state, threads)?;
        engine.rebuild("the grains were placed so")?;
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
        state.stale |= rolling && state.slabs.iter().any(|s| s.roll.len() != s.other.len());
        let isa = Isa::chosen().map_err(|why| {
            let given = std::env::var(ISA_VARIABLE).unwrap_or_default();
            DemError::parameter(ISA_VARIABLE, given, why)
        })?;
        let batch = BatchKernel::of(&setup, &pairs, isa);
        let team = Arc::new(Team::new(threads)?);
        Ok(Self { pairs, rolling, isa, batch, setup, state, scratch: Vec::new(), team })
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
        self.batch = BatchKernel::of(&self.setup, &self.pairs, isa);
        Ok(())
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
        self.setup = setup;
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
        self.rebuild(HINT)
    }

    /// Memory held for state and scratch (bytes).
    pub fn memory(&self) -> usize {
        self.state.memory() + self.scratch.iter().map(Scratch::memory).sum::<usize>()
    }

    fn rebuild(&mut self, hint: &'static str) -> Result<(), DemError> {
        let skin = self.skin();
        rebuild(&mut self.state, skin, &self.setup.walls, self.rolling, &self.team, hint)
    }

    /// The skin (m).
    pub fn skin(&self) -> f64 {
        let rows = &self.state.rows;
        let mean = rows.iter().map(|r| r[R]).sum::<f64>() / rows.len().max(1) as f64;
        self.setup.skin * mean
    }

    fn options(&self) -> Options {
        let s = &self.setup;
        let inverse = |x: f64| if x > 0.0 { 1.0 / x } else { f64::INFINITY };
        Options {
            h: s.step,
            tangential: s.tangential,
            least_normal: if s.clamp_normal { 0.0 } else { f64::NEG_INFINITY },
            adhesion: self.pairs.any_adhesion(),
            adhesion_scale: self.state.adhesion_scale,
            adhesion_growth: (s.step * inverse(s.adhesion_time)).min(1.0),
            adhesion_per_overlap: inverse(s.adhesion_overlap),
            rolling_damping: s.rolling_damping,
        }
    }

    fn step(&mut self, t: f64, skin: f64, bodies: &mut [Body], last: bool) -> Result<(), DemError> {
        if self.state.stale {
            self.rebuild(HINT)?;
        }
        for b in &mut *bodies {
            b.shape.move_to(t);
            b.force = [0.0; 3];
        }
        let options = self.options();
        let state = &mut self.state;
        self.scratch.resize_with(state.slabs.len(), Scratch::default);
        let world = World {
            rows: &state.rows,
            pairs: &self.pairs,
            walls: &self.setup.walls,
            bodies: &*bodies,
            batch: self.batch.as_ref(),
            options,
        };
        run_contacts(&self.setup, self.rolling, &world, &self.team, &mut state.slabs, &mut self.scratch);

        state.wall_force.fill([0.0; 3]);
        for s in &self.scratch {
            for (sum, f) in state.wall_force.iter_mut().zip(&s.wall_force) {
                *sum = super::vec3::add(*sum, *f);
            }
            for load in &s.body_loads {
                state.body_work += bodies[load.body as usize].apply(load, options.h);
            }
        }
        self.integrate(options.h, 0.5 * skin, last);
        self.state.steps += 1;
        self.state.time += options.h;
        Ok(())
    }

    fn integrate(&mut self, h: f64, reach: f64, keep_force: bool) {
        let gravity = self.setup.gravity;
        let state = &mut self.state;
        // Own force first, then the previous slab's halo: the canonical order of sums.
        let (forces, mut moved): (Vec<_>, Vec<_>) =
            self.scratch.iter_mut().map(|s| (std::mem::take(&mut s.force), false)).unzip();
        let mut parts = Vec::with_capacity(state.slabs.len());
        let (mut rows, mut kept) = (&mut state.rows[..], &mut state.force[..]);
        for s in &state.slabs {
            let (part, rest) = rows.split_at_mut(s.grains().len());
            let (force, rest_force) = kept.split_at_mut(part.len());
            parts.push((part, force));
            (rows, kept) = (rest, rest_force);
        }
        let forces_ref = &forces;
        self.team.each(&mut parts, &mut moved, |k, (rows, kept), moved| {
            let halo = match k.checked_sub(1) {
                Some(before) => &forces_ref[before][..],
                None => &[],
            };
            // The previous slab's buffer: its own grains, then its halo, which are this slab's first grains.
            let own_before = if k > 0 { state.slabs[k - 1].grains().len() } else { 0 };
            let halo = if halo.is_empty() { halo } else { &halo[own_before..] };
            *moved = integrate_slab(rows, &forces_ref[k], halo, h, gravity, reach);
            if keep_force {
                for (i, f) in kept.iter_mut().enumerate() {
                    let (a, b) = (&forces_ref[k][i], halo.get(i).copied().unwrap_or_default());
                    *f = [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
                }
            }
        });
        state.stale = moved.contains(&true);
        for (s, force) in self.scratch.iter_mut().zip(forces) {
            s.force = force;
        }
    }

    /// Kinetic, potential (in gravity) and elastic energy (J).
    pub fn energy(&self, bodies: &[Body]) -> f64 {
        let g = self.setup.gravity;
        let potential: f64 = self
            .state
            .rows
            .iter()
            .filter(|r| r[INV_M] > 0.0)
            .map(|r| -(g[0] * r[0] + g[1] * r[1] + g[2] * r[2]) / r[INV_M])
            .sum();
        let mut elastic = 0.0;
        self.observe(bodies, &mut |_, _, c| elastic += c.energy);
        self.state.kinetic_energy() + potential + elastic
    }

    /// Energy turned into heat since the account was opened (J): work of the bodies less the change of kinetic,
    /// potential and elastic energy. It holds the integrator's own error too, and 0 before an account is open.
    pub fn dissipated(&self, bodies: &[Body]) -> f64 {
        match self.state.energy_account {
            Some([energy, work]) => (self.state.body_work - work) - (self.energy(bodies) - energy),
            None => 0.0,
        }
    }
}

fn run_contacts(setup: &Setup, rolling: bool, world: &World, team: &Team, slabs: &mut [Slab], scratch: &mut [Scratch]) {
    dispatch_law!(setup.law, setup.form, law => {
        if rolling {
            team.each(slabs, scratch, |_, slab, scratch| contacts::<_, true>(law, world, slab, scratch, &mut ()));
        } else {
            team.each(slabs, scratch, |_, slab, scratch| contacts::<_, false>(law, world, slab, scratch, &mut ()));
        }
    });
}

/// Moves the grains of a slab; whether one of them is further than `reach` from where the lists were made.
fn integrate_slab(rows: &mut [Row], own: &[[f64; 8]], halo: &[[f64; 8]], h: f64, g: Vec3, reach: f64) -> bool {
    let reach2 = reach * reach;
    let mut moved = false;
    for (i, row) in rows.iter_mut().enumerate() {
        let mut f = own[i];
        if let Some(more) = halo.get(i) {
            for c in 0..8 {
                f[c] += more[c];
            }
        }
        if row[INV_M] == 0.0 {
            continue;
        }
        let mut d2 = 0.0;
        for c in 0..3 {
            row[V + c] += h * (f[c] * row[INV_M] + g[c]);
            row[c] += h * row[V + c];
            row[W + c] += h * (f[4 + c] * row[INV_I]);
            let d = row[c] - row[X0 + c];
            d2 += d * d;
        }
        // NaN counts as moved: the rebuild then names the grain.
        moved |= d2 > reach2 || d2.is_nan();
    }
    moved
}

impl GrainEngine for CpuEngine {
    fn setup(&self) -> &Setup {
        &self.setup
    }

    fn advance(&mut self, steps: u32, bodies: &mut [Body]) -> Result<(), DemError> {
        let skin = self.skin();
        let team = Arc::clone(&self.team);
        let h = self.setup.step;
        team.enter(|| (0..steps).try_for_each(|k| self.step(f64::from(k) * h, skin, bodies, k + 1 == steps)))
    }

    fn state(&self) -> &DemState {
        &self.state
    }

    fn restore(&mut self, state: DemState) {
        self.state = state;
    }

    fn scale_adhesion(&mut self, factor: f64) {
        self.state.adhesion_scale = factor;
    }

    fn observe(&self, bodies: &[Body], observer: &mut dyn FnMut(usize, Partner, &Touched)) {
        let mut options = self.options();
        (options.h, options.adhesion_growth) = (0.0, 0.0);
        let state = &self.state;
        // No batch kernel: it shows its contacts to nobody.
        let (rows, walls) = (&state.rows, &self.setup.walls);
        let world = World { rows, pairs: &self.pairs, walls, bodies, batch: None, options };
        let mut show = Show { world: &world, setup: &self.setup, to: observer };
        for slab in &state.slabs {
            let mut slab = slab.clone();
            let mut scratch = Scratch::default();
            dispatch_law!(self.setup.law, self.setup.form, law => {
                if self.rolling {
                    contacts::<_, true>(law, &world, &mut slab, &mut scratch, &mut show);
                } else {
                    contacts::<_, false>(law, &world, &mut slab, &mut scratch, &mut show);
                }
            });
        }
    }

    fn open_energy_account(&mut self) {
        self.state.energy_account = Some([self.energy(&[]), self.state.body_work]);
    }
}
