//! A communication step that follows the energy the coupling creates.

use super::{Advance, Algorithm, Energy, Failure, System};
use crate::check::plan::Plan;

/// Of the step that the controller would take, this part.
const SAFETY: f64 = 0.8;
/// The step changes at most by these factors.
const RATES: (f64, f64) = (0.2, 1.5);
/// Gains of the controller, integral and proportional.
const GAINS: (f64, f64) = (0.3, 0.4);

/// Energy-conservation-based co-simulation: Jacobi steps, each as long as the energy residual of the power bonds allows (S. Sadjina, L. T. Kyllingstad,
/// S. Skjong, E. Pedersen, "Energy conservation and power bonds in co-simulations: non-iterative adaptive step size control and error
/// estimation", Engineering with Computers 33 (2017), section 4). No step is repeated.
///
/// The error of a step is the root mean square, over the bonds, of its residual against `tolerance` times the energy that passed in it, or that
/// passes in such a time on average where that is more (so that a velocity going through zero does not stop the run). A proportional-integral
/// controller makes the next step from this error and the one before. Steps are whole numbers of base steps, at most `longest`, and end where values are
/// recorded with a period of their own.
#[derive(Debug)]
pub struct Ecco {
    tolerance: f64,
    longest: f64,
    /// The step the controller asks for (base steps).
    wish: f64,
    /// Error of the step before the last one; 0 where there is none.
    before: f64,
    /// Base steps of the last step; 0 before the first one.
    last: u64,
    /// The bonds at its beginning.
    energies: Vec<Energy>,
}

impl Ecco {
    /// With the plan's tolerance and longest step.
    pub fn new(plan: &Plan) -> Self {
        Self {
            tolerance: plan.algorithm.tolerance,
            longest: plan.algorithm.longest as f64,
            wish: 1.0,
            before: 0.0,
            last: 0,
            energies: Vec::new(),
        }
    }

    /// The error of the last step, in tolerances.
    fn error(&self, now: &[Energy], tick: u64) -> f64 {
        let part = self.last as f64 / tick.max(1) as f64;
        let mut sum = 0.0;
        for (now, then) in now.iter().zip(&self.energies) {
            let scale = (now.passed - then.passed).max(now.passed * part);
            let residual = (now.residual - then.residual).abs();
            if residual > 0.0 {
                sum += (residual / (self.tolerance * scale.max(f64::MIN_POSITIVE))).powi(2);
            }
        }
        (sum / now.len().max(1) as f64).sqrt().min(1e30)
    }

    /// The next wish, from the error of the last step.
    fn control(&mut self, error: f64) {
        let rate = if error > 0.0 {
            let before = if self.before > 0.0 { self.before } else { error };
            SAFETY * error.powf(-GAINS.0 - GAINS.1) * before.powf(GAINS.1)
        } else {
            RATES.1
        };
        self.before = error;
        // From the step that was really taken: one cut short by a recording says nothing about longer ones.
        let from = if rate < 1.0 { self.wish.min(self.last as f64) } else { self.wish };
        self.wish = (from * rate.clamp(RATES.0, RATES.1)).clamp(1.0, self.longest);
    }
}

impl Algorithm for Ecco {
    fn advance(&mut self, system: &mut System, tick: u64) -> Result<Advance, Failure> {
        let now: Vec<Energy> = system.energies().map(|(_, energy)| energy).collect();
        if self.last > 0 {
            let error = self.error(&now, tick);
            self.control(error);
        }
        let step = (self.wish as u64).clamp(1, system.until_pause(tick).max(1));
        (self.last, self.energies) = (step, now);
        system.set_stride(step);
        system.carry(tick)?;
        system.step(tick)?;
        Ok(system.advanced(tick))
    }

    fn save(&self) -> Vec<f64> {
        let own = [self.wish, self.before, self.last as f64];
        own.into_iter().chain(self.energies.iter().flat_map(|e| [e.residual, e.passed])).collect()
    }

    fn restore(&mut self, saved: &[f64]) {
        let Some((&[wish, before, last], energies)) = saved.split_first_chunk() else { return };
        (self.wish, self.before, self.last) = (wish.clamp(1.0, self.longest), before, last as u64);
        self.energies = energies.chunks_exact(2).map(|e| Energy { residual: e[0], passed: e[1] }).collect();
    }
}
