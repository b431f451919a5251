//! Listing the pairs of a slab, with the memories they had.

use super::contact::{Roll, Slip};
use super::grains::{INV_M, R, Row, X0};
use super::grid::{Grid, Sorted};
use super::rebuild::DEEPEST;
use super::slab::{Piece, Slab, WallPair};
use super::wall::Wall;
use std::ops::Range;

/// Where list making looks.
pub(super) struct Search<'a> {
    /// All grains, in their new order; behind them the images of the first layer, where the bed repeats itself.
    pub rows: &'a [Row],
    /// How many grains there are.
    pub count: usize,
    /// The grid.
    pub grid: &'a Grid,
    /// Cells of the block that is made anew.
    pub sorted: &'a Sorted,
    /// Skin (m).
    pub skin: f64,
    /// Walls.
    pub walls: &'a [Wall],
    /// Whether memories of rolling are kept.
    pub rolling: bool,
    /// The block's slabs as they were; empty where no memory is there.
    pub old: &'a [Slab],
}

/// Two grains that overlap by more than is sound: places and overlap.
pub(super) type Deep = Option<(u32, u32, f64)>;

impl Search<'_> {
    /// The lists of a piece.
    pub fn slab(&self, piece: &Piece) -> (Slab, Deep) {
        let Piece { first, last, halo, layers } = *piece;
        let count = (last - first) as usize;
        let mut slab = Slab { first, last, halo, layers, extent: self.extent(first, last), ..Slab::default() };
        slab.start.reserve(count + 1);
        slab.start.push(0);
        slab.other.reserve(4 * count);
        slab.owner.reserve(4 * count);
        let mut deep = None;
        for i in first..last {
            let row = &self.rows[i as usize];
            self.partners(i, row, &mut slab, &mut deep);
            slab.owner.resize(slab.other.len(), i);
            slab.start.push(slab.other.len() as u32);
        }
        slab.other.shrink_to_fit();
        slab.owner.shrink_to_fit();
        self.histories(&mut slab);
        self.near_walls(&mut slab);
        (slab, deep)
    }

    fn extent(&self, first: u32, last: u32) -> [f64; 2] {
        let rows = &self.rows[first as usize..last as usize];
        rows.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], r| {
            // Half the skin is what a grain may move; one step may take it further before that is noticed.
            let reach = r[R] + self.skin;
            [low.min(r[X0] - reach), high.max(r[X0] + reach)]
        })
    }

    /// Lists the partners of grain `i` that come after it. Without a branch on each candidate, which no processor foresees.
    fn partners(&self, i: u32, row: &Row, slab: &mut Slab, deep: &mut Deep) {
        let ranges = self.ranges(i, row);
        let candidates: usize = ranges.iter().map(Range::len).sum();
        let before = slab.other.len();
        slab.other.resize(before + candidates, 0);
        let list = &mut slab.other[before..];
        let mut count = 0;
        let mut sound = true;
        let moves = row[INV_M] > 0.0;
        for range in ranges {
            for (j, other) in range.clone().zip(&self.rows[range]) {
                let d = [row[X0] - other[X0], row[X0 + 1] - other[X0 + 1], row[X0 + 2] - other[X0 + 2]];
                let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                let touch = row[R] + other[R];
                let reach = touch + self.skin;
                // Two fixed grains may lie as they like: they exert nothing on each other.
                let near = (d2 < reach * reach) & (moves | (other[INV_M] > 0.0));
                list[count] = j as u32;
                count += usize::from(near);
                let least = touch - DEEPEST * row[R].min(other[R]);
                sound &= !(near & (d2 < least * least));
            }
        }
        slab.other.truncate(before + count);
        if !sound && deep.is_none() {
            *deep = slab.other[before..].iter().find_map(|&j| {
                let other = &self.rows[j as usize];
                let d = [row[X0] - other[X0], row[X0 + 1] - other[X0 + 1], row[X0 + 2] - other[X0 + 2]];
                let overlap = row[R] + other[R] - (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
                (overlap > DEEPEST * row[R].min(other[R])).then_some((i, j, overlap))
            });
        }
    }

    /// Takes the memories of the pairs over.
    fn histories(&self, slab: &mut Slab) {
        slab.slip = vec![Slip::default(); slab.other.len()];
        if self.rolling {
            slab.roll = vec![Roll::default(); slab.other.len()];
        }
        if self.old.is_empty() {
            return;
        }
        // The slab where the last one was found: the next is in it nearly always.
        let mut hint = 0;
        for (p, (&i, &j)) in slab.owner.iter().zip(&slab.other).enumerate() {
            let Some((old, q, sign)) = self.old_pair(i, j, &mut hint) else { continue };
            if old.slip[q][3] == 0.0 {
                continue;
            }
            let s = &old.slip[q];
            slab.slip[p] = Slip([sign * s[0], sign * s[1], sign * s[2], s[3]]);
            if let (Some(to), Some(from)) = (slab.roll.get_mut(p), old.roll.get(q)) {
                *to = from.map(|x| sign * x);
            }
        }
    }

    /// Where a pair was, if it was listed: slab, place in its list, and -1 where the order of the two has turned round, since
    /// memories are relative to the first grain.
    fn old_pair(&self, i: u32, j: u32, hint: &mut usize) -> Option<(&Slab, usize, f64)> {
        if self.rows.len() == self.count {
            let (oi, oj) = (self.sorted.old_place(i), self.sorted.old_place(j));
            let (one, two) = (oi.min(oj), oi.max(oj));
            let old = self.old_slab(one, hint)?;
            return Some((old, old.pair(one, two)?, if oi < oj { 1.0 } else { -1.0 }));
        }
        // Two that meet across the end may have met within it, and the other way round.
        let count = self.count as u32;
        let (oi, oj) = (self.sorted.old_place(i), self.sorted.old_place(j % count));
        [(oi, oj, 1.0), (oj, oi, -1.0), (oi, count + oj, 1.0), (oj, count + oi, -1.0)]
            .into_iter()
            .filter(|(one, two, _)| one < two)
            .find_map(|(one, two, sign)| {
                let old = self.old_slab(one, hint)?;
                Some((*hint, old.pair(one, two)?, sign))
            })
            .and_then(|(k, q, sign)| Some((self.old.get(k)?, q, sign)))
    }

    /// Lists the grains near walls.
    fn near_walls(&self, slab: &mut Slab) {
        let rows = &self.rows[slab.first as usize..slab.last as usize];
        let mut hint = 0;
        let mut near: Vec<(u32, u32)> = Vec::new();
        for (k, wall) in (0_u32..).zip(self.walls) {
            let grains = (slab.first..).zip(rows);
            near.extend(grains.filter(|(_, r)| wall.distance(r) < r[R] + self.skin).map(|(i, _)| (i, k)));
        }
        near.sort_unstable();
        let pair = |(grain, wall)| {
            let (slip, roll) = self.wall_history(grain, wall, &mut hint).unwrap_or_default();
            WallPair { grain, wall, slip, roll }
        };
        slab.walls = near.into_iter().map(pair).collect();
    }

    /// Ranges of grains after `i` that may be near it, ascending.
    fn ranges(&self, i: u32, row: &Row) -> [Range<usize>; 5] {
        let [cx, cy, cz] = self.grid.place(&row[X0..X0 + 3]);
        let n = self.grid.n;
        let (z0, z1) = (cz.saturating_sub(1), (cz + 1).min(n[2] - 1));
        let column = |x: usize, y: usize, from: usize, to: usize| {
            let (from, to) = (self.grid.index([x, y, from]), self.grid.index([x, y, to]));
            self.sorted.first_of(from)..self.sorted.first_of(to + 1)
        };
        let mut ranges: [Range<usize>; 5] = Default::default();
        ranges[0] = i as usize + 1..column(cx, cy, cz, z1).end;
        if cy + 1 < n[1] {
            ranges[1] = column(cx, cy + 1, z0, z1);
        }
        let across = cx + 1 == n[0] && self.rows.len() > self.count;
        if cx + 1 < n[0] || across {
            let (next, images) = if across { (0, self.count) } else { (cx + 1, 0) };
            for (k, range) in ranges[2..].iter_mut().enumerate() {
                if let Some(y) = (cy + k).checked_sub(1).filter(|&y| y < n[1]) {
                    let found = column(next, y, z0, z1);
                    *range = found.start + images..found.end + images;
                }
            }
        }
        ranges
    }

    fn old_slab(&self, old: u32, hint: &mut usize) -> Option<&Slab> {
        let holds = |s: &&Slab| s.first <= old && old < s.last;
        self.old.get(*hint).filter(holds).or_else(|| {
            *hint = self.old.partition_point(|s| s.last <= old);
            self.old.get(*hint)
        })
    }

    fn wall_history(&self, i: u32, wall: u32, hint: &mut usize) -> Option<(Slip, Roll)> {
        let old = self.sorted.old_place(i);
        let walls = &self.old_slab(old, hint)?.walls;
        let at = walls.binary_search_by_key(&(old, wall), |w| (w.grain, w.wall)).ok()?;
        Some((walls[at].slip, walls[at].roll))
    }
}
