//! One unit after the other, each with the newest values of those before it.

use super::{Advance, Algorithm, Failure, System};

/// Gauss-Seidel: sequential and explicit. A unit takes what those before it have reached at the end of this step, and what those
/// after it had at its beginning. It is stable at larger steps than Jacobi, and no two units work at the same time.
#[derive(Clone, Debug)]
pub struct GaussSeidel {
    order: Vec<usize>,
}

impl GaussSeidel {
    /// In this order of components.
    pub fn new(order: Vec<usize>) -> Self {
        Self { order }
    }
}

impl Algorithm for GaussSeidel {
    fn advance(&mut self, system: &mut System, tick: u64) -> Result<Advance, Failure> {
        for &unit in &self.order {
            if !system.is_due(unit, tick) || !system.fits(unit, tick) {
                continue;
            }
            system.carry_to(unit, tick)?;
            system.begin_bonds(unit, tick)?;
            system.step_one(unit, tick)?;
            if system.ended().is_some() {
                return Ok(Advance::Ended(None));
            }
        }
        Ok(Advance::To(tick + 1))
    }
}
