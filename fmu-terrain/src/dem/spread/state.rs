//! The whole bed taken apart over the members, and put together again: the same state, bit for bit, as of an engine alone.

use super::making::shift;
use super::{Links, Spread, pack, unpack};
use crate::dem::engine::{CpuEngine, Setup};
use crate::dem::error::DemError;
use crate::dem::grains::DemState;

impl DemState {
    /// Adds the part of the next member.
    pub(super) fn append(&mut self, part: Self) {
        let base = self.rows.len() as u32;
        self.rows.extend(part.rows);
        self.ids.extend(part.ids);
        self.force.extend(part.force);
        self.stale |= part.stale;
        self.slabs.extend(part.slabs.into_iter().map(|mut slab| {
            let to = slab.first + base;
            shift(&mut slab, to);
            slab
        }));
    }

    /// The whole of the parts of all members, in their order; `None` of none.
    pub fn joined(parts: impl IntoIterator<Item = Self>) -> Option<Self> {
        parts.into_iter().reduce(|mut whole, part| {
            whole.append(part);
            whole
        })
    }

    /// The part of member `index` of `size`: slabs in a row with their grains; what it looks at behind them goes to `spread`.
    fn part(&self, spread: &mut Spread) -> Self {
        let (index, size) = (spread.index, spread.size);
        let count = self.rows.len();
        let share = |k: usize| count * k / size;
        if self.slabs.is_empty() {
            // Just placed: who has which is decided when lists are made.
            return self.cut(share(index)..share(index + 1), 0..0);
        }
        let begins = |k: usize| self.slabs.partition_point(|s| (s.first as usize) < share(k));
        let (from, to) = (begins(index), if index + 1 == size { self.slabs.len() } else { begins(index + 1) });
        let place = |k: usize| self.slabs.get(k).map_or(count, |s| s.first as usize);
        let mut part = self.cut(place(from)..place(to), from..to);
        part.slabs.iter_mut().for_each(|s| shift(s, s.first - place(from) as u32));
        let ghosts = part.slabs.last().map_or(0, |s| (s.halo - s.last) as usize);
        let seen = place(to)..place(to) + ghosts;
        (spread.ghosts, spread.ghost_ids) = (self.rows[seen.clone()].to_vec(), self.ids[seen].to_vec());
        part
    }

    fn cut(&self, rows: std::ops::Range<usize>, slabs: std::ops::Range<usize>) -> Self {
        Self {
            rows: self.rows[rows.clone()].to_vec(),
            ids: self.ids[rows.clone()].to_vec(),
            force: self.force[rows].to_vec(),
            slabs: self.slabs[slabs].to_vec(),
            grid: self.grid.clone(),
            wall_force: self.wall_force.clone(),
            tile: self.tile.clone(),
            ..*self
        }
    }
}

impl CpuEngine {
    /// A member's engine of a bed in this state, which all members hand over whole.
    ///
    /// # Errors
    /// As [`CpuEngine::with_state`]; a setup that cannot be spread.
    pub fn spread(setup: Setup, state: &DemState, links: Box<dyn Links>, threads: usize) -> Result<Self, DemError> {
        if setup.period.is_some() || setup.follow.is_some() {
            let what = if setup.follow.is_some() { "a box that follows" } else { "a bed that repeats itself" };
            return Err(DemError::parameter("team", links.size(), format!("one member for {what}")));
        }
        let mut spread = Spread::new(links);
        let fresh = state.slabs.is_empty();
        let part = state.part(&mut spread);
        let mut engine = Self::with_state(setup, part, threads)?;
        engine.know_whole(state);
        let state = &engine.state;
        if !fresh {
            spread.find_neighbours(state)?;
        }
        engine.spread = Some(Box::new(spread));
        if fresh {
            engine.rebuild("the grains were placed so", None)?;
        }
        Ok(engine)
    }

    /// Which members of its team may meet a body that stays in `zone` (m, along x) for so many inner steps; none without a team.
    pub fn may_meet(&self, zone: [f64; 2], steps: u32) -> Vec<bool> {
        self.spread.as_ref().map_or(Vec::new(), |spread| spread.may_meet(zone, steps))
    }

    /// All members, or the first of their errors.
    ///
    /// # Errors
    /// That of any member; the team is broken.
    pub fn agree(&mut self, mine: Result<(), DemError>) -> Result<(), DemError> {
        match &mut self.spread {
            None => mine,
            Some(spread) => spread.agree(mine),
        }
    }

    /// The whole state, on the lead; on the others none. All members call it.
    ///
    /// # Errors
    /// The team is broken.
    pub fn gather(&mut self) -> Result<Option<DemState>, DemError> {
        let Some(spread) = &mut self.spread else { return Ok(Some(self.state.clone())) };
        if !spread.is_lead() {
            let mine = pack(&self.state)?;
            spread.links().round(vec![(0, mine)], &[])?;
            return Ok(None);
        }
        let others: Vec<usize> = (1..spread.size).collect();
        let mut whole = self.state.clone();
        for bytes in spread.links().round(Vec::new(), &others)? {
            whole.append(unpack(&bytes)?);
        }
        Ok(Some(whole))
    }
}
