//! Where the energy of a system comes from and goes to: work of its own forces, added up step by step.
//!
//! Powers are taken where a step evaluates its forces, at its start and at its end with the predicted velocities, each counting for
//! half the step. What a step makes or loses by itself is what is left over of the balance: some 1e-4 of the energy that passes.

use super::Loads;

/// Work on the system since it was made (J).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Of springs and stops: minus the energy that they store.
    pub springs: f64,
    /// Of shock absorbers: never more than 0 but by metal-to-metal contact, which is a spring's.
    pub shocks: f64,
    /// Of friction elements (brakes): at most 0.
    pub friction: f64,
    /// Of prescribed motions (steering).
    pub drives: f64,
}

impl Work {
    /// Adds the powers (W) of springs and shocks over a time (s).
    pub(crate) fn add(&mut self, [springs, shocks]: [f64; 2], time: f64) {
        self.springs += time * springs;
        self.shocks += time * shocks;
    }

    /// As plain numbers.
    pub fn to_array(self) -> [f64; 4] {
        [self.springs, self.shocks, self.friction, self.drives]
    }

    /// From what [`Work::to_array`] gave.
    pub fn from_array([springs, shocks, friction, drives]: [f64; 4]) -> Self {
        Self { springs, shocks, friction, drives }
    }
}

impl Loads {
    /// Power (W) of what acts on one body that moves with `u`.
    #[inline]
    pub fn power(&self, body: super::BodyId, u: &[[f64; 6]]) -> f64 {
        self.bodies[body.0].iter().zip(&u[body.0]).map(|(f, u)| f * u).sum()
    }
}
