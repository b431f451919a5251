//! Making a bed together: each member does what a process alone would do to the whole bed ([`crate::dem::prepare_with`]), with the state of the whole before its eyes, and so
//! decides as it would.

use super::{Links, unpack};
use crate::dem::body::Body;
use crate::dem::diagnostics::Touched;
use crate::dem::engine::{CpuEngine, GrainEngine, Setup};
use crate::dem::error::DemError;
use crate::dem::grains::{DemState, Grain};
use crate::dem::kernel::Partner;
use crate::dem::material::PairTable;
use crate::dem::settle::{BedReport, Onset, Recipe, prepare_with};
use crate::dem::vec3::Vec3;
use crate::dem::{Compaction, settle::Progress};
use std::cell::OnceCell;

/// A member's engine that shows the whole bed. The state is gathered when somebody looks at it, which all members do in the same places.
struct Together {
    engine: CpuEngine,
    whole: OnceCell<DemState>,
}

impl GrainEngine for Together {
    fn setup(&self) -> &Setup {
        self.engine.setup()
    }
    fn advance(&mut self, steps: u32, bodies: &mut [Body]) -> Result<(), DemError> {
        self.whole.take();
        self.engine.advance(steps, bodies)
    }
    fn state(&self) -> &DemState {
        // A team that is broken shows its own part; the next step tells.
        self.whole.get_or_init(|| self.engine.whole_everywhere().unwrap_or_else(|_| self.engine.state().clone()))
    }
    fn restore(&mut self, state: DemState) {
        self.whole.take();
        self.engine.restore(state);
    }
    fn take_setup(&mut self, setup: Setup) -> Result<(), DemError> {
        self.whole.take();
        self.engine.take_setup(setup)
    }
    fn scale_adhesion(&mut self, factor: f64) {
        self.whole.take();
        self.engine.scale_adhesion(factor);
    }
    fn set_gravity(&mut self, gravity: Vec3) {
        self.engine.set_gravity(gravity);
    }
    fn observe(&self, bodies: &[Body], observer: &mut dyn FnMut(usize, Partner, &Touched)) {
        self.engine.observe(bodies, observer);
    }
    fn open_energy_account(&mut self) {
        self.whole.take();
        self.engine.open_energy_account();
    }
}

/// Whether a bed can be made together: what is pressed, laid of tiles or given its cohesion at once is made by one process.
pub fn is_made_together(setup: &Setup, recipe: &Recipe) -> bool {
    let pressed = recipe.compaction.iter().any(|c| matches!(c, Compaction::Press { .. }));
    let whole = recipe.tile.is_some() || setup.period.is_some() || setup.follow.is_some();
    !pressed && !whole && matches!(recipe.cohesion, Onset::Growth(_))
}

/// As [`crate::dem::prepare`], by all members of a team: `links` gives each engine its own. All get the whole state.
///
/// # Errors
/// As [`crate::dem::prepare`].
pub fn prepare_together(
    setup: &Setup,
    recipe: &Recipe,
    threads: usize,
    links: &dyn Fn() -> Box<dyn Links>,
    progress: Progress,
) -> Result<(DemState, BedReport), DemError> {
    let adheres = PairTable::new(&setup.materials, &setup.overrides).any_adhesion();
    let new = |grains: &[Grain]| {
        crate::dem::limits::check(setup, grains)?;
        let state = DemState::of(grains, setup.walls.len());
        let engine = CpuEngine::spread(setup.clone(), &state, links(), threads)?;
        Ok(Together { engine, whole: OnceCell::new() })
    };
    let mut ask = links();
    let mut go_on = |phase: &str, done: f64| {
        let stop = !progress(phase, done);
        // Where one is asked to stop all do.
        ask.any(stop).is_ok_and(|stop| !stop)
    };
    let (engine, report) = prepare_with(new, adheres, recipe, &mut go_on)?;
    Ok((engine.state().clone(), report))
}

impl CpuEngine {
    /// The whole state, on all members. All call it, between steps.
    fn whole_everywhere(&self) -> Result<DemState, DemError> {
        let Some(spread) = &self.spread else { return Ok(self.state.clone()) };
        let parts = spread.all_of(&self.state)?;
        let mut whole: Option<DemState> = None;
        for bytes in &parts {
            let part: DemState = unpack(bytes)?;
            match &mut whole {
                None => whole = Some(part),
                Some(whole) => whole.append(part),
            }
        }
        whole.ok_or_else(|| DemError::Team("no members".into()))
    }
}
