//! Static equilibrium by dynamic relaxation.

use super::{MbsError, System};

/// How a search for equilibrium ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equilibrium {
    /// Steps taken.
    pub steps: usize,
    /// Largest acceleration left (m/s2).
    pub acceleration: f64,
}

impl System {
    /// Lets the system come to rest under its own forces: steps of `h` s, velocities drained at `drain` (1/s) besides the dampers,
    /// until no acceleration exceeds `tolerance` (m/s2) for 50 steps, or `most` steps. The clock stands still.
    ///
    /// # Errors
    /// As [`System::step`].
    pub fn relax(
        &mut self,
        h: f64,
        drain: f64,
        tolerance: f64,
        most: usize,
        law: super::integrator::ForceLaw,
    ) -> Result<Equilibrium, MbsError> {
        let time = self.time;
        let keep = 1.0 / (1.0 + drain * h);
        let (mut calm, mut acceleration) = (0, f64::INFINITY);
        for steps in 1..=most {
            self.step(h, law)?;
            acceleration = 0.0;
            for i in 1..self.motions.len() {
                let a = self.mean_acceleration(super::BodyId(i), h);
                acceleration = a[..3].iter().fold(acceleration, |m, x| m.max(x.abs()));
            }
            let speed = self.motions.iter().flat_map(|m| &m.u[..3]).fold(0.0_f64, |m, x| m.max(x.abs()));
            for m in &mut self.motions {
                m.u.iter_mut().for_each(|x| *x *= keep);
            }
            self.shaft_speeds.iter_mut().for_each(|x| *x *= keep);
            calm = if acceleration.max(speed * drain) <= tolerance { calm + 1 } else { 0 };
            if calm >= 50 {
                self.stop();
                self.time = time;
                return Ok(Equilibrium { steps, acceleration });
            }
        }
        self.stop();
        self.time = time;
        Ok(Equilibrium { steps: most, acceleration })
    }
}
