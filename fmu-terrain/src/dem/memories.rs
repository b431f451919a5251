//! What contacts remember, by the numbers of the grains: for lists that are made anew from grains which have changed their places, or the process they are in.

use super::contact::{Roll, Slip};
use super::slab::{BodyPair, Slab};
use std::collections::HashMap;

/// Memories of contacts.
#[derive(Default)]
pub(super) struct Memories {
    /// Of two grains, relative to the first.
    pub pairs: HashMap<(u32, u32), (Slip, Roll)>,
    /// Of a grain and a wall.
    pub walls: HashMap<(u32, u32), (Slip, Roll)>,
    /// Of a grain and bodies, in the order of its touches.
    pub bodies: HashMap<u32, Vec<BodyPair>>,
}

impl Memories {
    /// Of slabs; `ids` are the numbers of the grains by place, those of the last slab's halo included.
    pub fn of<'s>(slabs: impl IntoIterator<Item = &'s Slab>, ids: &[u32]) -> Self {
        let mut all = Self::default();
        let id = |place: u32| ids[place as usize];
        for s in slabs {
            for (p, (&i, &j)) in s.owner.iter().zip(&s.other).enumerate() {
                if s.slip[p][3] != 0.0 {
                    all.pairs.insert((id(i), id(j)), (s.slip[p], s.roll.get(p).copied().unwrap_or_default()));
                }
            }
            for w in s.walls.iter().filter(|w| w.slip[3] != 0.0) {
                all.walls.insert((id(w.grain), w.wall), (w.slip, w.roll));
            }
            for b in &s.bodies {
                all.bodies.entry(id(b.grain)).or_default().push(*b);
            }
        }
        all
    }

    /// Gives the contacts of a slab made anew what they remembered; of walls those that have stayed.
    pub fn give(&self, s: &mut Slab, ids: &[u32], wall_stays: impl Fn(u32) -> bool) {
        let id = |place: u32| ids[place as usize];
        for p in 0..s.other.len() {
            let (i, j) = (id(s.owner[p]), id(s.other[p]));
            let found = self.pairs.get(&(i, j)).map(|m| (m, 1.0));
            let Some(((u, rho), sign)) = found.or_else(|| self.pairs.get(&(j, i)).map(|m| (m, -1.0))) else {
                continue;
            };
            s.slip[p] = Slip([sign * u[0], sign * u[1], sign * u[2], u[3]]);
            if let Some(roll) = s.roll.get_mut(p) {
                *roll = rho.map(|x| sign * x);
            }
        }
        for w in s.walls.iter_mut().filter(|w| wall_stays(w.wall)) {
            if let Some(&(slip, roll)) = self.walls.get(&(id(w.grain), w.wall)) {
                (w.slip, w.roll) = (slip, roll);
            }
        }
        for place in s.first..s.last {
            let known = self.bodies.get(&id(place)).into_iter().flatten();
            s.bodies.extend(known.map(|b| BodyPair { grain: place, ..*b }));
        }
        // Stable: the touches of one grain keep their order.
        s.bodies.sort_by_key(|b| (b.body, b.grain));
    }
}
