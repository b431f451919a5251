//! Slabs: pieces of the bed along x, thick enough to be worked on by themselves, thin enough to stay in the cache meanwhile.
//!
//! A slab is a contiguous range of grains, whole layers of cells thick. It owns the half list of its grains' pairs: pair
//! (i, j) with i < j in canonical order belongs to the slab of i, and j is in this slab or in the first layer of the next,
//! its *halo*. Forces are summed into a buffer per slab, over grains and halo; the integration of a slab adds its own
//! buffer and the previous slab's halo, in this order. So no two tasks write the same memory, nothing is atomic, and the
//! sums are the same for any number of threads. How many slabs there are follows from the grains alone.

use super::contact::{Roll, Slip};
use super::grains::Row;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use terramech_simd::Force;
use terramech_simd::contact::Active;

/// Grains in a slab, about: enough that a task outweighs its overhead, few enough that its rows and lists stay in the
/// second-level cache.
pub const GRAINS_PER_SLAB: usize = 1024;

/// A grain near a wall.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WallPair {
    /// Place of the grain.
    pub grain: u32,
    /// Number of the wall.
    pub wall: u32,
    /// History.
    pub slip: Slip,
    /// History of rolling.
    pub roll: Roll,
}

/// A grain that touches a body: one entry per touch, in the order in which the shape gave them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyPair {
    /// Number of the body.
    pub body: u32,
    /// Place of the grain.
    pub grain: u32,
    /// Normal of the touch: what tells one from another, since a touch may wander over facets.
    pub normal: super::vec3::Vec3,
    /// History.
    pub slip: Slip,
    /// History of rolling.
    pub roll: Roll,
}

/// A region: part of the state.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Slab {
    /// Place of its first grain.
    pub first: u32,
    /// Place after its last grain.
    pub last: u32,
    /// Place after the last grain of the halo.
    pub halo: u32,
    /// First layer of cells, and the one after its last.
    pub layers: [u32; 2],
    /// It sleeps: its grains do not move ([`super::sleep`]).
    pub asleep: bool,
    /// Least and greatest x that its grains reach until the next rebuild (m).
    pub extent: [f64; 2],
    /// Pairs of grain `first + k`: `other[start[k]..start[k + 1]]`.
    pub start: Vec<u32>,
    /// Places of the partners, ascending for each grain.
    pub other: Vec<u32>,
    /// Place of the grain whose pair it is, for each pair: what `start` says, as the batch kernels read it.
    pub owner: Vec<u32>,
    /// Histories of the pairs.
    pub slip: Vec<Slip>,
    /// Histories of rolling; empty where nothing resists it.
    pub roll: Vec<Roll>,
    /// Grains near walls, ascending by grain, then wall.
    pub walls: Vec<WallPair>,
    /// Grains touching bodies, ascending by body, then grain.
    pub bodies: Vec<BodyPair>,
}

impl Slab {
    /// Its grains.
    pub fn grains(&self) -> std::ops::Range<usize> {
        self.first as usize..self.last as usize
    }

    /// Memory held (bytes).
    pub fn memory(&self) -> usize {
        bytes(&self.start)
            + bytes(&self.other)
            + bytes(&self.owner)
            + bytes(&self.slip)
            + bytes(&self.roll)
            + bytes(&self.walls)
            + bytes(&self.bodies)
    }

    /// Place in the list of pair (i, j), i < j both places of grains, if it is listed.
    pub fn pair(&self, i: u32, j: u32) -> Option<usize> {
        let k = (i - self.first) as usize;
        let (a, b) = (self.start[k] as usize, self.start[k + 1] as usize);
        Some(a + self.other[a..b].iter().position(|&o| o == j)?)
    }
}

pub(super) fn bytes<T>(v: &Vec<T>) -> usize {
    v.capacity() * size_of::<T>()
}

/// Where a slab is: its first grain, the one after its last, the one after its halo; its layers of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// First grain.
    pub first: u32,
    /// After the last grain.
    pub last: u32,
    /// After the last grain of the halo.
    pub halo: u32,
    /// First layer, and the one after the last.
    pub layers: [u32; 2],
}

/// Cuts the layers `stretch` of constant x into slabs. `start`: first grain of each layer from `first` on, one more than there are
/// layers; they may go on behind the stretch, where the halo of its last slab is. No slab has more than `most` layers.
pub fn cut(start: &[u32], first: usize, stretch: Range<usize>, most: usize) -> Vec<Piece> {
    let grain = |layer: usize| start[(layer - first).min(start.len() - 1)];
    let mut slabs = Vec::new();
    let mut from = stretch.start;
    while from < stretch.end {
        let mut to = from + 1;
        while to < stretch.end && to - from < most && (grain(to) - grain(from)) < GRAINS_PER_SLAB as u32 {
            to += 1;
        }
        if grain(to) > grain(from) {
            let layers = [from as u32, to as u32];
            slabs.push(Piece { first: grain(from), last: grain(to), halo: grain(to + 1), layers });
        }
        from = to;
    }
    slabs
}

/// The pairs of a slab that a batch kernel looks at: scratch memory, made anew when it no longer holds all that may touch.
///
/// What is in it changes no bit: pairs that do not touch add nothing, and the others keep their order.
#[derive(Debug)]
pub struct Near {
    /// The pairs closer than touching and a margin when they were selected.
    pub active: Active,
    /// How much closer than that any pair may still come (m); below 0, they are selected anew.
    pub slack: f64,
    /// Greatest speed of a grain of the slab (m/s).
    pub speed: f64,
}

impl Default for Near {
    fn default() -> Self {
        Self { active: Active::default(), slack: -1.0, speed: 0.0 }
    }
}

/// Scratch memory of a region of slabs: no value here outlives a step.
#[derive(Default)]
pub struct Scratch {
    /// Force and moment on the grains of the slab at hand and its halo.
    pub force: Vec<Force>,
    /// What the slab before does to its halo: the first grains of the slab at hand.
    pub before: Vec<Force>,
    /// The same of the region's first slab, where there is more than one: it is integrated last.
    pub start: Vec<Force>,
    /// Force on each wall, slab after slab.
    pub wall_force: Vec<super::vec3::Vec3>,
    /// What grains do to bodies, slab after slab, in each ascending by body, then grain.
    pub body_loads: Vec<super::body::BodyLoad>,
    /// Body pairs of the slab at hand.
    pub body_pairs: Vec<BodyPair>,
    /// Grains of the last slab and copies of those that it looks at behind the end of the rows.
    pub joined: Vec<Row>,
    /// Some grain has moved so far that lists must be rebuilt.
    pub moved: bool,
}

impl Scratch {
    /// Memory held (bytes).
    pub fn memory(&self) -> usize {
        bytes(&self.force)
            + bytes(&self.before)
            + bytes(&self.start)
            + bytes(&self.wall_force)
            + bytes(&self.body_loads)
            + bytes(&self.body_pairs)
            + bytes(&self.joined)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(start: &[u32]) -> Vec<[u32; 3]> {
        cut(start, 0, 0..start.len() - 1, usize::MAX).iter().map(|p| [p.first, p.last, p.halo]).collect()
    }

    #[test]
    fn slabs_are_whole_layers_and_halos_the_next_layer() {
        let layers: Vec<u32> = (0..=8).map(|k| k * 400).collect();
        assert_eq!(places(&layers), [[0, 1200, 1600], [1200, 2400, 2800], [2400, 3200, 3200]]);
        // A stretch in the middle: its last slab looks at the layer behind it.
        let middle = cut(&layers, 10, 12..15, 8);
        assert_eq!(middle, [Piece { first: 800, last: 2000, halo: 2400, layers: [12, 15] }]);
        assert_eq!(cut(&layers, 10, 12..15, 2).iter().map(|p| p.layers).collect::<Vec<_>>(), [[12, 14], [14, 15]]);
    }

    #[test]
    fn empty_layers_make_no_slab() {
        assert_eq!(places(&[0, 0, 5, 5]), [[0, 5, 5]]);
        let far = places(&[0, 2000, 2000, 4000]);
        assert_eq!(far, [[0, 2000, 2000], [2000, 4000, 4000]]);
    }
}
