//! Cuts move to where the work is.
//!
//! Every few rebuilds members compare what they have to do: grains that are awake, and a little for those that sleep, by the time that a member's sweeps have taken lately (a wheel, a processor
//! that is slower). Where one has more than some percent above the mean, slabs are shared out anew, and those that change hands go with their grains and lists as they are. Nothing is listed or
//! sorted anew, so that it changes no bit wherever cuts come to lie: they may follow from what a run has measured.

use super::making::shift;
use super::{Message, Spread, pack, unpack};
use crate::dem::error::DemError;
use crate::dem::grains::{DemState, Row};
use crate::dem::slab::{Near, Slab};
use crate::dem::vec3::Vec3;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::ops::Range;

/// Rebuilds between two looks.
pub(super) const LOOK: u64 = 16;
/// A member may have so much more than the mean: about what one slab of thirty is.
const MOST: f64 = 1.04;
/// By so much the time of a grain may differ from the mean, whatever was measured.
const UNEVEN: f64 = 1.25;
/// Sweeps whose times are known.
const LATELY: usize = 64;
/// A cut moves by at most so many slabs at a rebuild, and goes on at the next: who can have nothing to do with a body in a step is known from where the members' grains are when it
/// begins.
pub(super) const FARTHEST: usize = 8;
/// Work of a grain that sleeps, of one that is awake.
const ASLEEP: f64 = 0.02;

/// Slabs on their way, places counted from their first grain.
#[derive(Serialize, Deserialize)]
struct Part {
    rows: Vec<Row>,
    ids: Vec<u32>,
    force: Vec<Vec3>,
    slabs: Vec<Slab>,
    /// Greatest speed of a grain of each slab (m/s): by it the slab before knows what may have come near.
    speeds: Vec<f64>,
}

/// First slab of each member, one more than there are members: about the same work for each.
fn shares(work: &[f64], size: usize) -> Vec<usize> {
    let total: f64 = work.iter().sum();
    let mut first = vec![0; size + 1];
    let (mut sum, mut member) = (0.0, 0);
    for (k, w) in work.iter().enumerate() {
        // The member in whose share the middle of it lies.
        let at = (((sum + 0.5 * w) * size as f64 / total) as usize).min(size - 1);
        while member < at {
            member += 1;
            first[member] = k;
        }
        sum += w;
    }
    first[member + 1..].fill(work.len());
    first
}

/// Makes the grains of each member's slabs the time they take, in units of the mean time of a grain that is computed: those of members where nearly all sleep count little in it.
fn weigh(work: &mut [Vec<f64>], took: &[f64]) {
    let sums = work.iter().map(|m| m.iter().sum::<f64>());
    let each: Vec<f64> = sums.zip(took).map(|(sum, took)| took / sum).collect();
    let known = |e: f64| e.is_finite() && e > 0.0;
    let (mut mean, mut all) = (0.0, 0.0);
    for (each, took) in each.iter().zip(took).filter(|(e, _)| known(**e)) {
        mean += took * each;
        all += took;
    }
    mean /= all;
    for (slabs, each) in work.iter_mut().zip(&each).filter(|(_, e)| known(**e)) {
        let weight = (each / mean).clamp(1.0 / UNEVEN, UNEVEN);
        slabs.iter_mut().for_each(|w| *w *= weight);
    }
}

/// What the last sweeps have taken (s).
#[derive(Default)]
pub(super) struct Took(VecDeque<f64>);

impl Took {
    /// A sweep took so long.
    pub fn add(&mut self, time: f64) {
        if self.0.len() == LATELY {
            self.0.pop_front();
        }
        self.0.push_back(time);
    }

    /// The median, which a few that something else on the machine has held up do not change; 0 of too few.
    fn median(&self) -> f64 {
        if self.0.len() < LATELY / 2 {
            return 0.0;
        }
        let mut sorted: Vec<f64> = self.0.iter().copied().collect();
        sorted.sort_unstable_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    }
}

impl Spread {
    /// Shares slabs out anew where it pays. `near` is of each slab.
    pub(in crate::dem) fn balance(&mut self, state: &mut DemState, near: &mut Vec<Near>) -> Result<(), DemError> {
        if self.size == 1 || !(state.rebuilds.is_multiple_of(LOOK) || std::mem::take(&mut self.goes_on)) {
            return Ok(());
        }
        let of = |s: &Slab| f64::from(s.last - s.first) * if s.asleep { ASLEEP } else { 1.0 };
        let mine: Vec<f64> = state.slabs.iter().map(of).collect();
        let (mut all, took): (Vec<Vec<f64>>, Vec<f64>) = self.share(&(mine, self.took.median()))?.into_iter().unzip();
        weigh(&mut all, &took);
        let sums: Vec<f64> = all.iter().map(|m| m.iter().sum()).collect();
        let most = sums.iter().fold(0.0_f64, |m, s| m.max(*s));
        if most <= MOST * sums.iter().sum::<f64>() / self.size as f64 {
            return Ok(());
        }
        let mut first = vec![0];
        all.iter().for_each(|m| first.push(first[first.len() - 1] + m.len()));
        let mut then = shares(&all.concat(), self.size);
        for (to, from) in then.iter_mut().zip(&first) {
            let near = (*to).clamp(from.saturating_sub(FARTHEST), from + FARTHEST);
            self.goes_on |= near != *to;
            *to = near;
        }
        if then == first {
            return Ok(());
        }
        self.hand_over(state, near, &first, &then)?;
        // What was measured was of other slabs.
        self.took = Took::default();
        self.find_neighbours(state)?;
        self.see(state)
    }

    /// Slabs go from those who have them (`first`) to those who shall (`then`).
    fn hand_over(
        &mut self,
        state: &mut DemState,
        near: &mut Vec<Near>,
        first: &[usize],
        then: &[usize],
    ) -> Result<(), DemError> {
        let me = self.index;
        let common = |a: Range<usize>, b: Range<usize>| a.start.max(b.start)..a.end.min(b.end);
        let (had, gets) = (|m: usize| first[m]..first[m + 1], |m: usize| then[m]..then[m + 1]);
        let mut out: Vec<Message> = Vec::new();
        let mut from = Vec::new();
        for other in (0..self.size).filter(|m| *m != me) {
            let goes = common(had(me), gets(other));
            if !goes.is_empty() {
                let part = take(state, near, goes.start - first[me]..goes.end - first[me]);
                out.push((other, pack(&part)?));
            }
            if !common(had(other), gets(me)).is_empty() {
                from.push(other);
            }
        }
        let came = self.links().round(out, &from)?;
        let stays = common(had(me), gets(me));
        let local = if stays.is_empty() { 0..0 } else { stays.start - first[me]..stays.end - first[me] };
        let mine = take(state, near, local.clone());
        let mut parts = vec![(me, mine)];
        for (m, bytes) in from.into_iter().zip(came) {
            parts.push((m, unpack(&bytes)?));
        }
        parts.sort_by_key(|(m, _)| *m);
        let mut old = std::mem::take(near);
        (state.rows, state.ids, state.force, state.slabs) = Default::default();
        for (m, part) in parts {
            let base = state.rows.len() as u32;
            state.rows.extend(part.rows);
            state.ids.extend(part.ids);
            state.force.extend(part.force);
            for (k, (mut slab, speed)) in part.slabs.into_iter().zip(part.speeds).enumerate() {
                let to = slab.first + base;
                shift(&mut slab, to);
                state.slabs.push(slab);
                let known = (m == me).then(|| old.get_mut(local.start + k)).flatten();
                near.push(known.map(std::mem::take).unwrap_or_else(|| Near { speed, ..Near::default() }));
            }
        }
        Ok(())
    }

    /// Copies of the grains behind the cut, wherever it is now.
    fn see(&mut self, state: &DemState) -> Result<(), DemError> {
        let mut out = Vec::new();
        if let Some(before) = self.before {
            let seen: (&[Row], &[u32]) = (&state.rows[..self.front], &state.ids[..self.front]);
            out.push((before, pack(&seen)?));
        }
        let from: Vec<usize> = self.behind.into_iter().collect();
        let came = self.links().round(out, &from)?;
        if let Some(bytes) = came.first() {
            (self.ghosts, self.ghost_ids) = unpack(bytes)?;
        }
        Ok(())
    }
}

/// A copy of some slabs and their grains.
fn take(state: &DemState, near: &[Near], slabs: Range<usize>) -> Part {
    let speeds = slabs.clone().map(|k| near.get(k).map_or(0.0, |n| n.speed)).collect();
    let slabs = &state.slabs[slabs];
    let (from, to) = match (slabs.first(), slabs.last()) {
        (Some(first), Some(last)) => (first.first as usize, last.last as usize),
        _ => (0, 0),
    };
    let mut slabs = slabs.to_vec();
    for s in &mut slabs {
        let to = s.first - from as u32;
        shift(s, to);
    }
    let [rows, ids, force] = [from..to, from..to, from..to];
    Part {
        rows: state.rows[rows].to_vec(),
        ids: state.ids[ids].to_vec(),
        force: state.force[force].to_vec(),
        slabs,
        speeds,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_weighed_by_what_it_took() {
        let weighed = |took: [f64; 3]| {
            let mut work = [vec![2.0, 2.0], vec![4.0], vec![]];
            weigh(&mut work, &took);
            work
        };
        let [a, b, c] = weighed([1.1, 0.9, 0.0]);
        assert!((a[0] / b[0] - 0.5 * 1.1 / 0.9).abs() < 1e-12 && a[0] == a[1] && c.is_empty());
        // However different, no more than by a quarter; who has measured nothing counts as the mean.
        let [a, b, _] = weighed([9.0, 1.0, 1.0]);
        assert!((2.0..2.5).contains(&a[0]) && b == [3.2], "{a:?} {b:?}");
        assert_eq!(weighed([0.0, 1.0, 0.0]), [vec![2.0, 2.0], vec![4.0], vec![]]);
        assert_eq!(weighed([0.0; 3]), [vec![2.0, 2.0], vec![4.0], vec![]]);
    }

    #[test]
    fn sweeps_that_were_held_up_do_not_count() {
        let mut took = Took::default();
        (0..LATELY / 2 - 1).for_each(|_| took.add(1.0));
        assert_eq!(took.median(), 0.0);
        (0..LATELY).for_each(|k| took.add(if k % 3 == 0 { 1000.0 } else { 1.0 }));
        assert_eq!(took.median(), 1.0);
        (0..LATELY).for_each(|_| took.add(2.0));
        assert_eq!(took.median(), 2.0);
    }

    #[test]
    fn shares_hold_about_the_same_work() {
        assert_eq!(shares(&[1.0; 6], 3), [0, 2, 4, 6]);
        assert_eq!(shares(&[1.0, 1.0, 8.0, 1.0, 1.0], 2), [0, 2, 5]);
        // More members than slabs: some have none.
        assert_eq!(shares(&[1.0, 1.0], 4), [0, 0, 1, 1, 2]);
        assert_eq!(shares(&[0.0, 0.0, 5.0], 2), [0, 2, 3]);
    }
}
