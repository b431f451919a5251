//! A bed spread over the members of a team: processes of a cluster, or threads of one for tests.
//!
//! The bed is cut along x, between slabs. Each member holds the grains of its slabs with their lists, as an engine by itself; behind its last slab stand copies of the first layer of the
//! next member's grains, its *ghosts*, where an engine alone has the halo. A contact is computed by the member of the slab that lists it, the one before the cut. In a step
//!
//! 1. each member tells the one before it where the grains are that it looks at,
//! 2. computes its contacts and moves its grains on, but for those of the first slab,
//! 3. tells the one behind it what its last slab does to the ghosts there, and moves its first slab on,
//! 4. member 0, the *lead*, gets what grains do to bodies, and sums it in the order of the slabs.
//!
//! Slabs, lists, sums and their order are those of an engine alone (`rebuild.rs`, `step.rs`): the same bits for any number of members, this engine against the shared one included.
//! Lists are made anew by all members in the same step. What the places of grains decide about slabs (`making.rs`) is told to all; grains and their memories go to the member where their
//! slab is then. Now and then cuts move to where the work is (`balance.rs`).

mod balance;
mod edge;
pub(super) mod making;
mod settling;
mod state;
mod threads;

pub use settling::{is_made_together, prepare_together};
pub use threads::team_of_threads;

use super::error::DemError;
use super::grains::Row;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::{Mutex, PoisonError};
use terramech_simd::Force;

/// A message to or from a member.
pub type Message = (usize, Vec<u8>);

/// What the members of a team do together. All call the same in the same order.
pub trait Links: Send {
    /// This member.
    fn index(&self) -> usize;

    /// How many there are.
    fn size(&self) -> usize;

    /// Hands over all of `out` and takes a message from each member of `from`, in that order.
    ///
    /// # Errors
    /// The team is broken.
    fn round(&mut self, out: Vec<Message>, from: &[usize]) -> Result<Vec<Vec<u8>>, DemError>;

    /// Whether it holds for any member.
    ///
    /// # Errors
    /// The team is broken.
    fn any(&mut self, mine: bool) -> Result<bool, DemError> {
        // Each learns what twice as many know in every round: asked at every step, by thousands of members.
        let (index, size) = (self.index(), self.size());
        let (mut found, mut known) = (mine, 1);
        while known < size {
            let (to, from) = ((index + known) % size, (index + size - known) % size);
            let came = self.round(vec![(to, vec![u8::from(found)])], &[from])?;
            found |= came.first().is_some_and(|m| m[..] == [1]);
            known *= 2;
        }
        Ok(found)
    }

    /// What all members have, in their order.
    ///
    /// # Errors
    /// The team is broken.
    fn all(&mut self, mine: Vec<u8>) -> Result<Vec<Vec<u8>>, DemError> {
        let (index, size) = (self.index(), self.size());
        // Known so far: of this member, of the one before it, and so on; twice as many after every round.
        let mut known = vec![mine];
        while known.len() < size {
            let more = known.len().min(size - known.len());
            let (to, from) = ((index + known.len()) % size, (index + size - known.len()) % size);
            let came = self.round(vec![(to, pack(&known[..more].to_vec())?)], &[from])?;
            let theirs: Vec<Vec<u8>> = unpack(came.first().map_or(&[], |m| m))?;
            known.extend(theirs);
        }
        known.reverse();
        // The last is this member's now.
        known.rotate_left((size - 1 - index) % size);
        Ok(known)
    }
}

/// What a member knows of the others.
pub struct Spread {
    /// In a lock that is never waited for: the engine is looked at from several threads, its links are not.
    links: Mutex<Box<dyn Links>>,
    index: usize,
    size: usize,
    /// The members before and behind the cuts, where there are any.
    before: Option<usize>,
    behind: Option<usize>,
    /// From where to where along x the grains of each member reach until the next rebuild (m).
    reach: Vec<[f64; 2]>,
    /// Whether cuts have not come to where they shall be.
    goes_on: bool,
    /// Wall times of sweeps.
    took: balance::Took,
    /// Thickness of the thickest slab (m).
    thickest: f64,
    /// How many of the first grains the member before looks at.
    front: usize,
    /// Copies of the grains that the last slab looks at behind the cut, and their numbers.
    pub(super) ghosts: Vec<Row>,
    ghost_ids: Vec<u32>,
    /// Speed of the slab behind (m/s), and whether it sleeps.
    pub(super) speed: f64,
    pub(super) asleep: bool,
    /// What the slab before does to the first grains.
    pub(super) pushed: Vec<Force>,
}

impl Spread {
    /// A member that has no grains yet.
    pub fn new(links: Box<dyn Links>) -> Self {
        Self {
            index: links.index(),
            size: links.size(),
            links: Mutex::new(links),
            before: None,
            behind: None,
            reach: Vec::new(),
            goes_on: false,
            took: balance::Took::default(),
            thickest: 0.0,
            front: 0,
            ghosts: Vec::new(),
            ghost_ids: Vec::new(),
            speed: 0.0,
            asleep: true,
            pushed: Vec::new(),
        }
    }

    /// Whether this is the member that sums and tells.
    pub fn is_lead(&self) -> bool {
        self.index == 0
    }

    /// Which members may meet a body that stays in `zone` (m, along x) for `steps` inner steps, whatever lists and cuts do meanwhile.
    pub(super) fn may_meet(&self, zone: [f64; 2], steps: u32) -> Vec<bool> {
        // Lists may be made and cuts move at every step; where all lists are made anew a cut comes to lie within a slab or two of where it was.
        let margin = (f64::from(steps) * balance::FARTHEST as f64 + 4.0) * self.thickest;
        // Who has no grains may be given some.
        let near =
            |reach: &[f64; 2]| reach[0] > reach[1] || zone[0] - margin <= reach[1] && zone[1] + margin >= reach[0];
        if self.reach.len() == self.size { self.reach.iter().map(near).collect() } else { vec![true; self.size] }
    }

    /// A sweep took so long (s).
    pub(super) fn took(&mut self, time: f64) {
        self.took.add(time);
    }

    /// The team.
    pub(super) fn links(&mut self) -> &mut dyn Links {
        self.links.get_mut().unwrap_or_else(PoisonError::into_inner).as_mut()
    }

    /// All members, or the first of their errors.
    fn agree(&mut self, mine: Result<(), DemError>) -> Result<(), DemError> {
        if !self.links().any(mine.is_err())? {
            return Ok(());
        }
        let told: Vec<Option<String>> = self.share(&mine.as_ref().err().map(ToString::to_string))?;
        mine?;
        Err(DemError::Elsewhere(told.into_iter().flatten().next().unwrap_or_default()))
    }

    /// What all members have, as bytes. It is asked between steps, when nobody else uses the links.
    fn all_of<T: Serialize>(&self, mine: &T) -> Result<Vec<Vec<u8>>, DemError> {
        self.links.lock().unwrap_or_else(PoisonError::into_inner).all(pack(mine)?)
    }

    /// Lists of all members one behind the other. It is asked between steps, when nobody else uses the links.
    pub(super) fn all_parts<const N: usize>(&self, mine: [Vec<f64>; N]) -> Result<[Vec<f64>; N], DemError> {
        let all = self.all_of(&mine.to_vec())?;
        let mut lists: [Vec<f64>; N] = std::array::from_fn(|_| Vec::new());
        for bytes in &all {
            let parts: Vec<Vec<f64>> = unpack(bytes)?;
            lists.iter_mut().zip(parts).for_each(|(list, part)| list.extend(part));
        }
        Ok(lists)
    }

    /// What all members have, as data.
    fn share<T: Serialize + DeserializeOwned>(&mut self, mine: &T) -> Result<Vec<T>, DemError> {
        self.links().all(pack(mine)?)?.iter().map(|bytes| unpack(bytes)).collect()
    }
}

fn pack<T: Serialize>(value: &T) -> Result<Vec<u8>, DemError> {
    terramech_fmi2::state::to_bytes(value).map_err(|e| DemError::Team(e.to_string()))
}

fn unpack<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, DemError> {
    terramech_fmi2::state::from_bytes(bytes).map_err(|e| DemError::Team(e.to_string()))
}
