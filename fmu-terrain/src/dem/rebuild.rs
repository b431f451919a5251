//! Rebuild: sort the grains anew, cut slabs, list the pairs, and carry the histories over.
//!
//! A list holds all pairs closer than touching plus the skin, and stays valid until some grain has moved half the skin
//! since the last rebuild. Histories are found by the old places of the two grains; where a pair's order has turned
//! round, its history changes sign, since both displacement and rotation are relative to the first grain. A rebuild
//! changes no force but for the order of sums.

use super::error::DemError;
use super::grains::{DemState, R, Row, X0};
use super::grid::{Grid, Sorted, sort};
use super::slab::{Slab, WallPair, cut};
use super::team::Team;
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
    check(state, walls, hint)?;
    let largest = state.rows.iter().fold(0.0_f64, |m, r| m.max(r[R]));
    let grid = Grid::around(&state.rows, 2.0 * largest + skin);
    let sorted = sort(&grid, &state.rows, &state.ids);

    state.rows = reorder(&state.rows, &sorted.order);
    state.ids = reorder(&state.ids, &sorted.order);
    state.force = reorder(&state.force, &sorted.order);
    for r in &mut state.rows {
        r.copy_within(0..3, X0);
    }

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
    carry_bodies(&old, &mut slabs, &sorted.order);
    state.slabs = slabs;
    state.grid = grid;
    state.stale = false;
    state.rebuilds += 1;
    Ok(())
}

fn reorder<T: Copy>(from: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|&i| from[i as usize]).collect()
}

fn check(state: &DemState, walls: &[Wall], hint: &'static str) -> Result<(), DemError> {
    for (row, &id) in state.rows.iter().zip(&state.ids) {
        if !row.iter().all(|x| x.is_finite()) {
            return Err(DemError::NotFinite { id, time: state.time });
        }
        // Its centre behind a wall: nothing that a sound step does.
        if walls.iter().any(|w| w.distance(row) < 0.0) {
            return Err(DemError::Escaped { id, x: row[0], y: row[1], z: row[2], time: state.time, hint });
        }
    }
    Ok(())
}

/// Touching pairs with bodies move to the slabs and places where their grains are now.
fn carry_bodies(old: &[Slab], slabs: &mut [Slab], order: &[u32]) {
    if old.iter().all(|s| s.bodies.is_empty()) {
        return;
    }
    let mut place = vec![0_u32; order.len()];
    for (new, &old) in order.iter().enumerate() {
        place[old as usize] = new as u32;
    }
    for pair in old.iter().flat_map(|s| &s.bodies) {
        let grain = place[pair.grain as usize];
        let k = slabs.partition_point(|s| s.last <= grain);
        slabs[k].bodies.push(super::slab::BodyPair { grain, ..*pair });
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
        slab.other.reserve(5 * count);
        slab.owner.reserve(5 * count);
        slab.slip.reserve(5 * count);
        let mut deep = None;
        for i in first..last {
            let row = &self.rows[i as usize];
            self.partners(i, row, &mut slab, &mut deep);
            slab.start.push(slab.other.len() as u32);
            for (k, wall) in self.walls.iter().enumerate() {
                if wall.distance(row) < row[R] + self.skin {
                    let (slip, roll) = self.wall_history(i, k as u32).unwrap_or_default();
                    slab.walls.push(WallPair { grain: i, wall: k as u32, slip, roll });
                }
            }
        }
        slab.other.shrink_to_fit();
        slab.owner.shrink_to_fit();
        slab.slip.shrink_to_fit();
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

    /// Lists the partners of grain `i` that come after it.
    fn partners(&self, i: u32, row: &Row, slab: &mut Slab, deep: &mut Deep) {
        let before = slab.other.len();
        for range in self.ranges(i, row) {
            for j in range {
                let other = &self.rows[j];
                let d = [row[0] - other[0], row[1] - other[1], row[2] - other[2]];
                let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                let touch = row[R] + other[R];
                let reach = touch + self.skin;
                if d2 < reach * reach {
                    slab.other.push(j as u32);
                    let smaller = row[R].min(other[R]);
                    let least = touch - DEEPEST * smaller;
                    // Two fixed grains may lie as they like: they exert nothing on each other.
                    if d2 < least * least && deep.is_none() && row[7] + other[7] > 0.0 {
                        *deep = Some((i, j as u32, touch - d2.sqrt()));
                    }
                }
            }
        }
        slab.owner.resize(slab.other.len(), i);
        for p in before..slab.other.len() {
            let (slip, roll) = self.pair_history(i, slab.other[p]).unwrap_or_default();
            slab.slip.push(slip);
            if self.rolling {
                slab.roll.push(roll);
            }
        }
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

    fn old_slab(&self, old: u32) -> Option<&Slab> {
        self.old.get(self.old.partition_point(|s| s.last <= old))
    }

    fn pair_history(&self, i: u32, j: u32) -> Option<(super::contact::Slip, super::contact::Roll)> {
        let (oi, oj) = (self.sorted.order[i as usize], self.sorted.order[j as usize]);
        if oi < oj {
            self.old_slab(oi)?.history(oi, oj)
        } else {
            let (slip, roll) = self.old_slab(oj)?.history(oj, oi)?;
            Some(([-slip[0], -slip[1], -slip[2], slip[3]], roll.map(|x| -x)))
        }
    }

    fn wall_history(&self, i: u32, wall: u32) -> Option<(super::contact::Slip, super::contact::Roll)> {
        let old = self.sorted.order[i as usize];
        let walls = &self.old_slab(old)?.walls;
        let at = walls.binary_search_by_key(&(old, wall), |w| (w.grain, w.wall)).ok()?;
        Some((walls[at].slip, walls[at].roll))
    }
}
