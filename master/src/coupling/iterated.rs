//! Steps that are repeated until inputs and outputs agree.

use super::{Advance, Algorithm, Failure, System};
use crate::check::plan::Plan;

/// Fixed-point iteration with rollback: all units keep their state, step with guessed inputs, and go back until the inputs that
/// follow from their outputs are those they were given.
///
/// A Real input is held over the step at the mean of its values at both ends, which makes the coupling second order and, for a spring,
/// free of created energy; other types and arrays stay at their value at the beginning. Guesses are improved by Aitken's
/// dynamic relaxation (U. Kuettler, W. A. Wall, "Fixed-point fluid-structure interaction solvers with dynamic relaxation",
/// Computational Mechanics 43 (2008), equations 36 to 38), each input scaled by its largest value so far.
#[derive(Debug)]
pub struct Iterated {
    tolerance: f64,
    most: u32,
    /// Largest magnitude of each input so far.
    scale: Vec<f64>,
    /// Iterations done in all, and steps.
    count: (u64, u64),
}

impl Iterated {
    /// With the plan's tolerance and limit.
    pub fn new(plan: &Plan) -> Self {
        Self { tolerance: plan.algorithm.tolerance, most: plan.algorithm.iterations, scale: Vec::new(), count: (0, 0) }
    }

    /// Iterations in all, and steps.
    pub fn count(&self) -> (u64, u64) {
        self.count
    }
}

impl Algorithm for Iterated {
    fn save(&self) -> Vec<f64> {
        self.scale.clone()
    }

    fn restore(&mut self, saved: &[f64]) {
        self.scale = saved.to_vec();
    }

    fn advance(&mut self, system: &mut System, tick: u64) -> Result<Advance, Failure> {
        system.carry(tick)?;
        let begin = system.input_values();
        self.scale.resize(begin.len(), 0.0);
        system.keep(tick)?;
        let mut guess = begin.clone();
        let mut before: Option<Vec<f64>> = None;
        let mut relaxation = 1.0;
        for iteration in 1..=self.most {
            if iteration > 1 {
                system.go_back(tick)?;
            }
            system.set_inputs(&guess, tick)?;
            system.begin_bonds_with(&guess, tick)?;
            system.step(tick)?;
            if system.ended().is_some() {
                return Ok(Advance::Ended(None));
            }
            system.read_ends(tick)?;
            let end = system.input_values();
            let next: Vec<f64> = begin.iter().zip(&end).map(|(a, b)| 0.5 * (a + b)).collect();
            for (scale, value) in self.scale.iter_mut().zip(&next) {
                *scale = scale.max(value.abs());
            }
            let change: Vec<f64> = next
                .iter()
                .zip(&guess)
                .zip(&self.scale)
                .map(|((n, g), s)| if *s > 0.0 { (n - g) / s } else { 0.0 })
                .collect();
            let largest = change.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
            self.count.0 += 1;
            if largest <= self.tolerance {
                self.count.1 += 1;
                return Ok(Advance::To(tick + 1));
            }
            if let Some(before) = &before {
                let (mut up, mut down) = (0.0, 0.0);
                for (old, new) in before.iter().zip(&change) {
                    up += old * (new - old);
                    down += (new - old) * (new - old);
                }
                if down > 0.0 {
                    relaxation = (-relaxation * up / down).clamp(-2.0, 2.0);
                }
            }
            for ((g, c), s) in guess.iter_mut().zip(&change).zip(&self.scale) {
                *g += relaxation * c * s;
            }
            before = Some(change);
        }
        Err(system.not_converged(tick, self.most, self.tolerance, before.as_deref().unwrap_or_default()))
    }
}
