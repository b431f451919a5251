//! Tells a coupling that rings: the energy that passes through a power bond grows on and on, and a good part of it is made by the coupling.
//!
//! Growth alone is no fault (a wheel that sets off), nor is a residual alone (a coarse step); both together over hundreds of steps are the
//! picture of an unstable coupling. It is stopped before numbers overflow, with the stable step where the units can tell it.

use crate::coupling::{Energy, Failure, System, stability};

/// Base steps of a window.
const WINDOW: u64 = 50;
/// So many windows in a row.
const WINDOWS: u64 = 12;
/// Growth of what passes, from window to window.
const GROWTH: f64 = 1.3;
/// Part of it that the coupling makes.
const PART: f64 = 0.05;

/// What a bond has done lately.
#[derive(Clone, Copy, Debug, Default)]
struct Course {
    at: Energy,
    passed: f64,
    growing: u64,
}

/// All bonds of a run.
#[derive(Debug, Default)]
pub struct Ringing {
    courses: Vec<Course>,
    /// The base step to look again.
    next: u64,
}

impl Ringing {
    /// Looks at the bonds at a base step.
    ///
    /// # Errors
    /// [`Failure::Rings`].
    pub fn look(&mut self, system: &mut System, tick: u64) -> Result<(), Failure> {
        if tick < self.next {
            return Ok(());
        }
        self.next = tick + WINDOW;
        let mut rings = None;
        for (k, (name, energy)) in system.energies().enumerate() {
            if self.courses.len() <= k {
                self.courses.push(Course::default());
            }
            let course = &mut self.courses[k];
            let (passed, made) = (energy.passed - course.at.passed, energy.residual - course.at.residual);
            let grows = passed > GROWTH * course.passed && course.passed > 0.0 && made > PART * passed;
            course.growing = if grows { course.growing + 1 } else { 0 };
            (course.at, course.passed) = (energy, passed);
            if course.growing >= WINDOWS {
                rings = Some((name.to_owned(), 100.0 * made / passed));
            }
        }
        let Some((bond, part)) = rings else { return Ok(()) };
        let plan = std::sync::Arc::clone(system.plan());
        let able = system.job().is_none()
            && (0..plan.components.len()).all(|c| plan.model(c).co_simulation.can_get_and_set_fmu_state);
        let limit = able.then(|| stability(system, tick).ok()).flatten().map(|l| l.to_string());
        Err(Failure::Rings { time: plan.clock.time(tick), bond, steps: WINDOW * WINDOWS, part, limit })
    }
}
