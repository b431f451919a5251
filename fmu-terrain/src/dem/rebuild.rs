//! Rebuild: sort the grains anew, cut slabs, list the pairs, and carry the histories over.
//!
//! A list holds all pairs closer than touching plus the skin, and stays valid until some grain has moved half the skin
//! since the last rebuild. Histories are found by the old places of the two grains; where a pair's order has turned
//! round, its history changes sign, since both displacement and rotation are relative to the first grain. A rebuild
//! changes no force but for the order of sums.

use super::contact::{Roll, Slip};
use super::error::DemError;
use super::grains::{DemState, INV_M, R, Row, X0};
use super::grid::{Grid, Sorted, sort};
use super::slab::{Slab, WallPair, cut};
use super::team::Team;
use super::vec3::Vec3;
use super::wall::Wall;
use std::ops::Range;

/// Where list making looks.
struct Search<'a> {
    rows: &'a [Row],
    grid: &'a Grid,
    sorted: &'a Sorted,
    skin: f64,
    walls: &'a [Wall],
    rolling: bool,
    old: &'a [Slab],
}

/// Two grains that overlap by more than is sound: places and overlap.
type Deep = Option<(u32, u32, f64)>;

/// Largest overlap taken for sound, as a fraction of the smaller radius.
pub const DEEPEST: f64 = 0.5;

/// Grains that one task checks or sorts at a time.
const CHUNK: usize = 2048;

/// Rebuilds the lists of `state`; `skin` (m) is absolute.
///
/// # Errors
/// A value that is not finite, a grain outside the walls, or grains deep inside each other.
pub fn rebuild(
    state: &mut DemState,
    skin: f64,
    walls: &[Wall],
    rolling: bool,
    team: &Team,
    hint: &'static str,
) -> Result<(), DemError> {
    let survey = survey(state, walls, team, hint)?;
    let grid = Grid::around(&state.rows, survey.low, survey.high, 2.0 * survey.largest + skin);
    let sorted = sort(&grid, &state.rows, &state.ids, team);

    let touching = bodies_by_id(state);
    permute(state, &sorted.order);
    let layers: Vec<u32> = (0..=grid.n[0]).map(|x| sorted.start[x * grid.layer()]).collect();
    let ranges = cut(&layers);
    let old = std::mem::take(&mut state.slabs);
    let search = Search { rows: &state.rows, grid: &grid, sorted: &sorted, skin, walls, rolling, old: &old };
    let made = team.map(&ranges, |_, &range| search.slab(range));
    let mut slabs = Vec::with_capacity(made.len());
    for (slab, deep) in made {
        if let Some((i, j, overlap)) = deep {
            let smaller = state.rows[i as usize][R].min(state.rows[j as usize][R]);
            return Err(DemError::Interpenetration {
                a: state.ids[i as usize],
                b: state.ids[j as usize],
                overlap,
                allowed: DEEPEST * smaller,
                time: state.time,
                hint,
            });
        }
        slabs.push(slab);
    }
    carry_bodies(touching, state, &grid, &sorted, &mut slabs);
    state.slabs = slabs;
    state.grid = grid;
    state.stale = false;
    state.rebuilds += 1;
    Ok(())
}

/// What a look at all grains finds.
struct Survey {
    low: Vec3,
    high: Vec3,
    largest: f64,
}

/// Checks all grains, and makes their positions those that lists are made at.
fn survey(state: &mut DemState, walls: &[Wall], team: &Team, hint: &'static str) -> Result<Survey, DemError> {
    let chunks: Vec<_> = state.rows.chunks_mut(CHUNK).collect();
    let parts = team.map_each(chunks, |chunk: &mut [Row]| {
        let mut part = Survey { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3], largest: 0.0 };
        let mut wrong = None;
        for (k, r) in chunk.iter_mut().enumerate() {
            r.copy_within(0..3, X0);
            for c in 0..3 {
                part.low[c] = part.low[c].min(r[c]);
                part.high[c] = part.high[c].max(r[c]);
            }
            part.largest = part.largest.max(r[R]);
            // A sum is finite only if its terms are, or cancel: rows are no place for infinities of both signs.
            let finite = r.iter().sum::<f64>().is_finite() || r.iter().all(|x| x.is_finite());
            // Its centre behind a wall: nothing that a sound step does.
            if !finite || walls.iter().any(|w| w.distance(r) < 0.0) {
                wrong = wrong.or(Some(k));
            }
        }
        (part, wrong)
    });
    let mut all = Survey { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3], largest: 0.0 };
    for (n, (part, wrong)) in parts.into_iter().enumerate() {
        if let Some(k) = wrong {
            let (row, id) = (&state.rows[n * CHUNK + k], state.ids[n * CHUNK + k]);
            if !row.iter().all(|x| x.is_finite()) {
                return Err(DemError::NotFinite { id, time: state.time });
            }
            return Err(DemError::Escaped { id, x: row[0], y: row[1], z: row[2], time: state.time, hint });
        }
        for c in 0..3 {
            all.low[c] = all.low[c].min(part.low[c]);
            all.high[c] = all.high[c].max(part.high[c]);
        }
        all.largest = all.largest.max(part.largest);
    }
    Ok(all)
}

/// Brings rows, numbers and forces into a new order, cycle by cycle in place: most grains stay where they are.
fn permute(state: &mut DemState, order: &[u32]) {
    let mut done = vec![false; order.len()];
    for start in 0..order.len() {
        if done[start] || order[start] as usize == start {
            continue;
        }
        let held = (state.rows[start], state.ids[start], state.force[start]);
        let mut to = start;
        loop {
            done[to] = true;
            let from = order[to] as usize;
            if from == start {
                break;
            }
            state.rows[to] = state.rows[from];
            state.ids[to] = state.ids[from];
            state.force[to] = state.force[from];
            to = from;
        }
        (state.rows[to], state.ids[to], state.force[to]) = held;
    }
}

/// A touching pair with a body, its grain by number and place in space.
type Touching = (u32, Vec3, super::slab::BodyPair);

/// The touching pairs with bodies, before the grains change places.
fn bodies_by_id(state: &DemState) -> Vec<Touching> {
    let pairs = state.slabs.iter().flat_map(|s| &s.bodies);
    pairs
        .map(|p| {
            let row = &state.rows[p.grain as usize];
            (state.ids[p.grain as usize], [row[0], row[1], row[2]], *p)
        })
        .collect()
}

/// Touching pairs with bodies move to the slabs and places where their grains are now.
fn carry_bodies(touching: Vec<Touching>, state: &DemState, grid: &Grid, sorted: &Sorted, slabs: &mut [Slab]) {
    if touching.is_empty() {
        return;
    }
    for (id, at, pair) in touching {
        let cell = grid.index(grid.place(&at));
        let (from, to) = (sorted.start[cell] as usize, sorted.start[cell + 1] as usize);
        let Some(k) = state.ids[from..to].iter().position(|&i| i == id) else { continue };
        let grain = (from + k) as u32;
        let k = slabs.partition_point(|s| s.last <= grain);
        slabs[k].bodies.push(super::slab::BodyPair { grain, ..pair });
    }
    for s in slabs {
        // Stable: the touches of one grain keep their order.
        s.bodies.sort_by_key(|p| (p.body, p.grain));
    }
}

impl Search<'_> {
    fn slab(&self, [first, last, halo]: [u32; 3]) -> (Slab, Deep) {
        let count = (last - first) as usize;
        let mut slab = Slab { first, last, halo, extent: self.extent(first, last), ..Slab::default() };
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
            [low.min(r[0] - reach), high.max(r[0] + reach)]
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
                let d = [row[0] - other[0], row[1] - other[1], row[2] - other[2]];
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
                let d = [row[0] - other[0], row[1] - other[1], row[2] - other[2]];
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
            let (oi, oj) = (self.sorted.order[i as usize], self.sorted.order[j as usize]);
            let (one, two) = (oi.min(oj), oi.max(oj));
            let Some(old) = self.old_slab(one, &mut hint) else { continue };
            let Some(q) = old.pair(one, two) else { continue };
            if old.slip[q][3] == 0.0 {
                continue;
            }
            // Turned round where the order of the two has: both memories are relative to the first grain.
            let sign = if oi < oj { 1.0 } else { -1.0 };
            let s = &old.slip[q];
            slab.slip[p] = Slip([sign * s[0], sign * s[1], sign * s[2], s[3]]);
            if let (Some(to), Some(from)) = (slab.roll.get_mut(p), old.roll.get(q)) {
                *to = from.map(|x| sign * x);
            }
        }
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
        let [cx, cy, cz] = self.grid.place(&row[..3]);
        let n = self.grid.n;
        let (z0, z1) = (cz.saturating_sub(1), (cz + 1).min(n[2] - 1));
        let start = &self.sorted.start;
        let column = |x: usize, y: usize, from: usize, to: usize| {
            start[self.grid.index([x, y, from])] as usize..start[self.grid.index([x, y, to]) + 1] as usize
        };
        let mut ranges: [Range<usize>; 5] = Default::default();
        ranges[0] = i as usize + 1..column(cx, cy, cz, z1).end;
        if cy + 1 < n[1] {
            ranges[1] = column(cx, cy + 1, z0, z1);
        }
        if cx + 1 < n[0] {
            for (k, range) in ranges[2..].iter_mut().enumerate() {
                if let Some(y) = (cy + k).checked_sub(1).filter(|&y| y < n[1]) {
                    *range = column(cx + 1, y, z0, z1);
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
        let old = self.sorted.order[i as usize];
        let walls = &self.old_slab(old, hint)?.walls;
        let at = walls.binary_search_by_key(&(old, wall), |w| (w.grain, w.wall)).ok()?;
        Some((walls[at].slip, walls[at].roll))
    }
}
