//! A terrain over several processes: the lead is the unit that its environment knows; the other members do what it asks.
//!
//! The lead makes the bed and takes its bodies as a unit alone does. When it is about to step it hands its whole state and the inputs of its bodies to the members, each takes its part
//! of the grains, and from then on they step together ([`crate::dem::spread`](mod@crate::dem::spread)). Before each step the lead tells what of its inputs has changed, and sends meshes
//! to those who may meet them. What somebody wants to see of the
//! whole bed is gathered when it is asked for. A saved state is that of the whole, so that it goes on with any number of members, or with none.

use crate::dem::DemError;
use crate::dem::DemState;
use crate::dem::spread::{Links, Message};
use crate::dem::vec3::Vec3;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use terramech_fmi2::{Team, UnitError, Value, state};

/// Values of variables, by value reference.
pub type Changes = Vec<(u32, Value)>;

/// What the lead asks the others for.
#[derive(Serialize, Deserialize)]
pub enum Order {
    /// To make the bed of this specification (JSON) with the lead.
    Make {
        /// As [`Order::Open`]'s unit holds it.
        specification: String,
    },
    /// To become this saved unit, with these values of its variables, and to tell how that went.
    Open {
        /// As [`terramech_fmi2::Unit::save`] gives it.
        unit: Vec<u8>,
        /// By value reference.
        values: Vec<(u32, Value)>,
        /// Prefix of files that hold parts of the unit.
        pieces: Option<PathBuf>,
    },
    /// To take their part of the bed.
    Part,
    /// To step so often with this inner step (s), after these values have changed.
    Step {
        /// Inner steps.
        count: u32,
        /// Length of one (s).
        step: f64,
        /// By value reference.
        values: Vec<(u32, Value)>,
        /// Of which bodies the centre is given.
        centres: Vec<bool>,
        /// Of each body that is a deforming mesh: the boxes it is in at each inner step, all that a member which it does not reach has to know of it.
        boxes: Vec<Vec<[Vec3; 2]>>,
        /// By member: the bodies, as bits, whose meshes it is sent behind this.
        meshes: Vec<u32>,
    },
    /// To sum energies.
    Heat,
    /// To give their part of the state.
    Gather,
    /// To write their part of the state as a file with this prefix, and to tell of it.
    Keep {
        /// As [`terramech_fmi2::Unit::keep_pieces`] is told.
        prefix: PathBuf,
    },
    /// To write their grains as a file with this prefix, and to tell how that went.
    Show {
        /// As in [`terramech_fmi2::Pieces`].
        prefix: PathBuf,
        /// Value reference.
        position: u32,
        /// Value references and names.
        fields: Vec<(u32, String)>,
    },
    /// To end.
    End,
}

/// The members that a member passes orders on to: its number with one more bit below its lowest.
fn below(index: usize, size: usize) -> impl Iterator<Item = usize> {
    let bits = if index == 0 { usize::BITS } else { index.trailing_zeros() };
    (0..bits).map(move |bit| index | 1 << bit).take_while(move |m| *m < size)
}

/// A team that the unit and its engine use in turn.
#[derive(Clone)]
pub struct Crew {
    team: Arc<Mutex<Box<dyn Team>>>,
    index: usize,
    size: usize,
}

impl Crew {
    /// Of a team.
    pub fn new(team: Box<dyn Team>) -> Self {
        let (index, size) = (team.index(), team.size());
        Self { team: Arc::new(Mutex::new(team)), index, size }
    }

    /// Whether this member is the lead.
    pub fn is_lead(&self) -> bool {
        self.index == 0
    }

    /// Asks all others. Orders go down a tree: with many members no one has to tell all.
    ///
    /// # Errors
    /// The team is broken.
    pub fn ask(&self, order: &Order) -> Result<(), UnitError> {
        self.pass_on(&state::to_bytes(order)?)
    }

    /// Tells those below this member in the tree.
    fn pass_on(&self, bytes: &[u8]) -> Result<(), UnitError> {
        let out: Vec<Message> = below(self.index, self.size).map(|m| (m, bytes.to_vec())).collect();
        self.team.lock().unwrap_or_else(PoisonError::into_inner).round(&out, &[]).map(drop)
    }

    /// Tells the lead how something went, and what came of it.
    ///
    /// # Errors
    /// The team is broken.
    pub fn answer<T: Serialize>(&self, result: &Result<T, UnitError>) -> Result<(), UnitError> {
        let told = state::to_bytes(&result.as_ref().map_err(ToString::to_string))?;
        self.team.lock().unwrap_or_else(PoisonError::into_inner).round(&[(0, told)], &[]).map(drop)
    }

    /// How something went for all others, and what came of it, by member.
    ///
    /// # Errors
    /// What a member has told, or that the team is broken.
    pub fn answers<T: DeserializeOwned>(&self) -> Result<Vec<T>, UnitError> {
        let others: Vec<usize> = (1..self.size).collect();
        let came = self.team.lock().unwrap_or_else(PoisonError::into_inner).round(&[], &others)?;
        let mut all = Vec::with_capacity(others.len());
        for (member, bytes) in others.into_iter().zip(came) {
            match state::from_bytes::<Result<T, String>>(&bytes)? {
                Ok(told) => all.push(told),
                Err(text) => {
                    return Err(UnitError::environment(format!("member {member} of the terrain's team: {text}")));
                }
            }
        }
        Ok(all)
    }

    /// Sends members the values of meshes, by member.
    ///
    /// # Errors
    /// The team is broken.
    pub fn send(&self, values: Vec<(usize, Changes)>) -> Result<(), UnitError> {
        let out: Result<Vec<Message>, UnitError> =
            values.into_iter().map(|(to, values)| Ok((to, state::to_bytes(&values)?))).collect();
        self.team.lock().unwrap_or_else(PoisonError::into_inner).round(&out?, &[]).map(drop)
    }

    /// Takes what the lead sends.
    ///
    /// # Errors
    /// The team is broken.
    pub fn take(&self) -> Result<Changes, UnitError> {
        let came = self.team.lock().unwrap_or_else(PoisonError::into_inner).round(&[], &[0])?;
        state::from_bytes(came.first().map_or(&[], |bytes| bytes))
    }

    /// What the lead asks for next.
    ///
    /// # Errors
    /// The team is broken.
    pub fn hear(&self) -> Result<Order, UnitError> {
        // The member above: this one's number without its lowest bit.
        let above = self.index & (self.index - 1);
        let came = self.team.lock().unwrap_or_else(PoisonError::into_inner).round(&[], &[above])?;
        let bytes = came.first().map_or(&[][..], |bytes| bytes);
        self.pass_on(bytes)?;
        state::from_bytes(bytes)
    }
}

impl Team for Crew {
    fn index(&self) -> usize {
        self.index
    }

    fn size(&self) -> usize {
        self.size
    }

    fn round(&mut self, out: &[Message], from: &[usize]) -> Result<Vec<Vec<u8>>, UnitError> {
        self.team.lock().unwrap_or_else(PoisonError::into_inner).round(out, from)
    }
}

impl Links for Crew {
    fn index(&self) -> usize {
        self.index
    }

    fn size(&self) -> usize {
        self.size
    }

    fn round(&mut self, out: Vec<Message>, from: &[usize]) -> Result<Vec<Vec<u8>>, DemError> {
        let mut team = self.team.lock().unwrap_or_else(PoisonError::into_inner);
        team.round(&out, from).map_err(|e| DemError::Team(e.to_string()))
    }
}

/// What a lead remembers of its team.
#[derive(Default)]
pub struct Lead {
    /// The members, if it has any.
    pub crew: Option<Crew>,
    /// Whether they have their parts.
    pub open: bool,
    /// Values that they all know.
    pub known: BTreeMap<u32, Value>,
    /// The whole state where nothing has stepped since.
    pub whole: Option<DemState>,
}

impl Lead {
    /// The members, once they have their parts.
    pub fn members(&self) -> Option<&Crew> {
        self.crew.as_ref().filter(|crew| self.open && crew.is_lead())
    }
}

impl Drop for Lead {
    /// Whatever ends the lead ends the others.
    fn drop(&mut self) {
        if let Some(crew) = self.crew.as_ref().filter(|c| c.is_lead()) {
            // Those who have gone need not be told.
            let _ = crew.ask(&Order::End);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::below;

    #[test]
    fn every_member_is_told_once_by_the_one_above() {
        for size in 1..40 {
            let mut told = vec![0; size];
            told[0] = 1;
            for member in 0..size {
                assert_eq!(told[member], 1, "{member} of {size}: orders go to higher numbers only");
                for m in below(member, size) {
                    assert_eq!(m & (m - 1), member);
                    told[m] += 1;
                }
            }
            assert_eq!(told, vec![1; size]);
        }
    }
}
