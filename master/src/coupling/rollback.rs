//! What iterating algorithms ask of the system: keeping states, going back, setting guessed inputs.

use std::sync::Arc;

use super::extrapolate::Track;
use super::system::read;
use super::{Failure, Moment, System};
use crate::loading::{CallError, Instance};

impl System {
    fn each(
        &mut self,
        tick: u64,
        about: &str,
        mut call: impl FnMut(&mut Instance) -> Result<(), CallError>,
    ) -> Result<(), Failure> {
        let time = self.plan.clock.time(tick);
        for member in self.members.iter_mut().flatten() {
            call(&mut member.instance).map_err(|e| Failure::unit(e, Moment::At(time), about))?;
        }
        Ok(())
    }

    /// All units keep their state.
    pub(super) fn keep(&mut self, tick: u64) -> Result<(), Failure> {
        self.each(tick, "keeping its state", Instance::keep)
    }

    /// All units go back to the state they kept.
    pub(super) fn go_back(&mut self, tick: u64) -> Result<(), Failure> {
        self.each(tick, "going back", Instance::go_back)
    }

    /// Back to the kept state, as if nothing had been computed since; also after a unit has failed.
    pub(super) fn rewind(&mut self, tick: u64) -> Result<(), Failure> {
        for member in self.members.iter_mut().flatten() {
            member.instance.revive();
        }
        self.go_back(tick)?;
        self.links.tracks().for_each(Track::forget);
        self.bonds.forget();
        self.forget_end();
        Ok(())
    }

    /// Shifts all Real outputs as they were read, by this part of their size (or by itself where they are zero).
    pub(super) fn push_outputs(&mut self, part: f64) {
        for (k, x) in self.links.outputs.iter_mut().flat_map(|o| &mut o.reals.values).enumerate() {
            // Alternating, so that no symmetry of the system hides a mode.
            let sign = if k % 2 == 0 { 1.0 } else { -0.7 };
            *x += sign * part * if *x == 0.0 { 1.0 } else { *x };
        }
    }

    /// All inputs as the outputs were read, then all units: a Jacobi step, whatever the algorithm.
    pub(super) fn plain_step(&mut self, tick: u64) -> Result<(), Failure> {
        for unit in 0..self.members.len() {
            self.carry_to(unit, tick)?;
        }
        self.step(tick)
    }

    /// Values of all Real inputs that follow from the outputs read last.
    pub(super) fn input_values(&self) -> Vec<f64> {
        self.links.real_inputs()
    }

    /// Sets all Real inputs.
    pub(super) fn set_inputs(&mut self, values: &[f64], tick: u64) -> Result<(), Failure> {
        let time = self.plan.clock.time(tick);
        for unit in 0..self.members.len() {
            self.sets.clear();
            self.links.put_reals(unit, values, &mut self.sets);
            if let Some(member) = self.members[unit].as_deref_mut() {
                let set = member.instance.set(&self.sets);
                set.map_err(|e| Failure::unit(e, Moment::At(time), "inputs of an iteration"))?;
            }
        }
        Ok(())
    }

    /// Reads all outputs after a step from base step `tick`, with the inputs of its end.
    pub(super) fn read_ends(&mut self, tick: u64) -> Result<(), Failure> {
        self.resolve(tick + 1)?;
        let plan = Arc::clone(&self.plan);
        let time = plan.clock.time(tick + 1);
        for unit in 0..self.members.len() {
            if !self.links.outputs[unit].is_empty() {
                read(&plan, unit, self.members[unit].as_deref_mut(), &mut self.links.outputs[unit], time)?;
            }
        }
        Ok(())
    }

    /// Tells the power bonds what is held over the step that comes.
    pub(super) fn begin_bonds_with(&mut self, values: &[f64], tick: u64) -> Result<(), Failure> {
        if self.bonds.is_empty() {
            return Ok(());
        }
        for unit in 0..self.members.len() {
            self.begin_bonds(unit, tick)?;
        }
        let held: Vec<(usize, f64)> = self.links.real_connections().zip(values.iter().copied()).collect();
        self.bonds.hold(&self.plan, &held);
        Ok(())
    }

    /// The failure of an iteration: names the connection that changes most.
    pub(super) fn not_converged(&self, tick: u64, iterations: u32, tolerance: f64, change: &[f64]) -> Failure {
        let worst = change.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap_or((0, &f64::NAN));
        let connection = self.links.real_connections().nth(worst.0).map(|c| &self.plan.connections[c]);
        let name = connection.map(|c| format!("{} -> {}", self.plan.port_name(&c.from), self.plan.port_name(&c.to)));
        Failure::NotConverged {
            time: self.plan.clock.time(tick),
            iterations,
            worst: name.unwrap_or_default(),
            change: worst.1.abs(),
            tolerance,
        }
    }
}
