//! Coupling algorithms: in which order units are read, set and stepped.

use super::{Ecco, Failure, GaussSeidel, Iterated, System};
use crate::check::plan::Plan;
use crate::description::algorithm::Scheme;

/// Where a step has led.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Advance {
    /// All units that were due have reached their next communication point; this is the next base step.
    To(u64),
    /// A unit ended the run by itself; see [`System::ended`]. Where it and all others have reached this base step, their outputs there can be read.
    Ended(Option<u64>),
}

/// A coupling algorithm.
///
/// # Protocol
/// Before each call the caller has read all outputs that are due at `tick` ([`System::read`]) and shown them to the observers. The algorithm sets
/// inputs and steps units until the system stands at a later base step, which it returns. It may read, save and restore units in between.
/// After an error the system takes no further step; what was read stays readable.
pub trait Algorithm {
    /// From base step `tick` to a later one.
    ///
    /// # Errors
    /// The failure of a unit.
    fn advance(&mut self, system: &mut System, tick: u64) -> Result<Advance, Failure>;

    /// What it remembers from step to step, for a checkpoint.
    fn save(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Takes back what [`Algorithm::save`] gave.
    fn restore(&mut self, _saved: &[f64]) {}
}

/// The algorithm that a plan asks for.
pub fn algorithm_of(plan: &Plan) -> Box<dyn Algorithm> {
    match plan.algorithm.scheme {
        Scheme::Jacobi => Box::new(Jacobi),
        Scheme::GaussSeidel => Box::new(GaussSeidel::new(plan.algorithm.order.clone())),
        Scheme::Iterated => Box::new(Iterated::new(plan)),
        Scheme::Ecco => Box::new(Ecco::new(plan)),
    }
}

/// All outputs first, then all inputs, then all units side by side: explicit, first order, and the only algorithm in which no
/// unit waits for another.
#[derive(Clone, Copy, Debug, Default)]
pub struct Jacobi;

impl Algorithm for Jacobi {
    fn advance(&mut self, system: &mut System, tick: u64) -> Result<Advance, Failure> {
        if system.job().is_some() {
            return Ok(system.advance_on_ranks(tick));
        }
        if !system.carry_and_step(tick)? {
            system.carry(tick)?;
            system.step(tick)?;
        }
        Ok(system.advanced(tick))
    }
}
