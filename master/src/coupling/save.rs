//! The state of the coupled system as data.

use serde::{Deserialize, Serialize};

use super::{Failure, Moment, System};

/// The state of one unit.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitState {
    /// Name of the component.
    pub name: String,
    /// GUID of its model.
    pub guid: String,
    /// `fmi2SerializeFMUstate`.
    pub bytes: Vec<u8>,
}

/// What the coupling itself remembers from step to step. Reals as their bits.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CouplingState {
    tracks: Vec<[u64; 7]>,
    energies: Vec<[u64; 2]>,
}

impl System {
    /// Whether all units communicate at this base step: only then is everything that a run needs in the units' states.
    pub fn all_due(&self, tick: u64) -> bool {
        (0..self.members.len()).all(|u| self.is_due(u, tick))
    }

    /// The whole state at a communication point of all units, after [`System::read`]. Changes nothing.
    ///
    /// # Errors
    /// A unit that cannot be saved.
    pub fn save(&mut self, tick: u64) -> Result<(Vec<UnitState>, CouplingState), Failure> {
        let mut units = self.save_here(tick)?;
        if self.job.is_some() {
            self.take_states(&mut units)?;
        }
        let units = units.into_iter().map(|(_, unit)| unit).collect();
        let coupling = CouplingState {
            tracks: self.links.tracks().map(|t| t.to_numbers().map(f64::to_bits)).collect(),
            energies: self.bonds.sums().map(|e| [e.residual.to_bits(), e.passed.to_bits()]).collect(),
        };
        Ok((units, coupling))
    }

    /// The states of the units on this rank, by index.
    pub(super) fn save_here(&mut self, tick: u64) -> Result<Vec<(usize, UnitState)>, Failure> {
        let mut units = Vec::with_capacity(self.members.len());
        let time = self.plan.clock.time(tick);
        for index in 0..self.members.len() {
            let prefix = self.state_prefix(index, tick);
            let Some(member) = self.members[index].as_deref_mut() else { continue };
            if let Some(prefix) = prefix {
                let told = member.instance.set_pieces(Some(&prefix));
                told.map_err(|e| Failure::unit(e, Moment::At(time), "saving its state"))?;
            }
            let bytes = member.instance.save().map_err(|e| Failure::unit(e, Moment::At(time), "saving its state"))?;
            let name = self.plan.components[index].name.clone();
            let guid = self.plan.model(index).guid.clone();
            units.push((index, UnitState { name, guid, bytes }));
        }
        Ok(units)
    }

    /// Puts fresh units into a saved state, instead of [`System::initialise`].
    ///
    /// # Errors
    /// A unit that does not take its state.
    pub fn restore(&mut self, units: &[UnitState], coupling: &CouplingState) -> Result<(), Failure> {
        let restored = self.restore_here(units);
        self.agree(restored)?;
        self.read_all = true;
        for (track, bits) in self.links.tracks().zip(&coupling.tracks) {
            track.take_numbers(bits.map(f64::from_bits));
        }
        for (energy, bits) in self.bonds.sums().zip(&coupling.energies) {
            (energy.residual, energy.passed) = (f64::from_bits(bits[0]), f64::from_bits(bits[1]));
        }
        Ok(())
    }

    fn restore_here(&mut self, units: &[UnitState]) -> Result<(), Failure> {
        let prefix = self.restored_prefix();
        for (member, unit) in self.members.iter_mut().zip(units) {
            let Some(member) = member.as_deref_mut() else { continue };
            let instance = &mut member.instance;
            let restored = instance.set_pieces(prefix.as_deref()).and_then(|()| instance.restore(&unit.bytes));
            // What is saved from here on has a place of its own, or none.
            let restored = restored.and_then(|()| instance.set_pieces(None));
            restored.map_err(|e| Failure::unit(e, Moment::Initialising, "its saved state"))?;
        }
        Ok(())
    }
}
