//! Rebuild: sort the grains anew, cut slabs, list the pairs, and carry the histories over.
//!
//! A list holds all pairs closer than touching plus the skin, and stays valid until some grain has moved half the skin
//! since the last rebuild. Histories are found by the old places of the two grains; where a pair's order has turned
//! round, its history changes sign, since both displacement and rotation are relative to the first grain. A rebuild
//! changes no force but for the order of sums.
//!
//! Most of a bed hardly moves while a wheel drives through it. So slabs are *kept* whose grains are all still near where their
//! lists were made, and those that sleep ([`super::sleep`]): their grains keep their places in memory. The grid stays, and only
//! *blocks* are made anew: the other slabs, and kept ones beside them, whose lists reach into what changes. A grain that comes into
//! the layers of a kept slab ends its keeping. Everything is sorted and listed by the places that grains had when their lists
//! were made (`X0`): from there none has moved more than half the skin, whenever that was.

use super::error::DemError;
use super::grains::{DemState, R, Row, X0};
use super::grid::{Grid, Sorted, sort};
use super::period;
use super::search::Search;
use super::slab::{Piece, Slab, cut};
use super::team::Team;
use super::vec3::Vec3;
use super::wall::Wall;
use std::borrow::Cow;
use std::ops::Range;

/// Largest overlap taken for sound, as a fraction of the smaller radius.
pub const DEEPEST: f64 = 0.5;

/// Grains that one task checks or sorts at a time.
const CHUNK: usize = 2048;

/// A stretch of the bed that is made anew.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Block {
    /// Its slabs as they were.
    pub slabs: Range<usize>,
    /// Its grains.
    pub rows: Range<usize>,
    /// Its layers of cells.
    pub layers: Range<usize>,
}

/// What lists are made with.
pub struct Making<'a> {
    /// Skin (m).
    pub skin: f64,
    /// Walls.
    pub walls: &'a [Wall],
    /// Whether memories of rolling are kept.
    pub rolling: bool,
    /// Length after which the bed repeats itself along x ([`super::period`]).
    pub period: Option<f64>,
    /// Slabs none of whose grains has moved further than this since its lists were made are kept (m); none: only those that sleep.
    pub keep: Option<f64>,
    /// Greatest length of a slab (m): what sleeps is whole slabs.
    pub longest: f64,
    /// Threads.
    pub team: &'a Team,
    /// Advice when something is wrong.
    pub hint: &'static str,
}

impl Making<'_> {
    /// Most layers of a slab.
    pub(super) fn most(&self, grid: &Grid) -> usize {
        ((self.longest / grid.size) as usize).max(1)
    }
}

/// Rebuilds that keep slabs, before one that makes a new grid and all slabs anew.
const WHOLE: u64 = 64;

/// Rebuilds the lists of `state`. For each slab there is now: which one it was, if nothing of it has changed.
///
/// # Errors
/// A value that is not finite, a grain outside the walls, or grains deep inside each other.
pub fn rebuild(state: &mut DemState, making: &Making) -> Result<Vec<Option<usize>>, DemError> {
    let kept = kept(state, making);
    let survey = survey(state, making, &kept)?;
    let blocks = if kept.contains(&true) {
        blocks(&state.slabs, &kept, state.grid.n[0])
    } else {
        let size = 2.0 * survey.largest + making.skin;
        state.grid = match making.period {
            Some(length) => Grid::periodic(survey.low, survey.high, size, length),
            None => Grid::around(&state.rows, survey.low, survey.high, size),
        };
        vec![Block { slabs: 0..state.slabs.len(), rows: 0..state.rows.len(), layers: 0..state.grid.n[0] }]
    };
    let mut old = std::mem::take(&mut state.slabs);
    let mut slabs = Vec::with_capacity(old.len() + 8);
    let mut origin = Vec::with_capacity(old.len() + 8);
    let mut next = 0;
    for block in &blocks {
        slabs.extend(old[next..block.slabs.start].iter_mut().map(std::mem::take));
        origin.extend((next..block.slabs.start).map(Some));
        next = block.slabs.end;
        make(state, block, &mut old[block.slabs.clone()], &kept, (&mut slabs, &mut origin), making)?;
    }
    origin.extend((next..old.len()).map(Some));
    slabs.extend(old[next..].iter_mut().map(std::mem::take));
    state.slabs = slabs;
    state.stale = false;
    state.rebuilds += 1;
    Ok(origin)
}

/// Which slabs are kept: those that sleep, and those that have hardly moved, but for those that a grain has come into.
fn kept(state: &mut DemState, making: &Making) -> Vec<bool> {
    let mut kept = calm(state, making, whole(state, making));
    let entered = |open: &[usize]| Ok(open.iter().flat_map(|&k| entered(state, k)).collect());
    // It cannot fail: nobody else is asked.
    let _ = reconsider(&state.slabs, &mut kept, entered);
    for (slab, kept) in state.slabs.iter_mut().zip(&kept) {
        slab.asleep &= *kept;
    }
    kept
}

/// Whether a new grid is made and all slabs anew.
pub(super) fn whole(state: &DemState, making: &Making) -> bool {
    state.rebuilds.is_multiple_of(WHOLE)
        || making.period.is_some()
        || making.rolling && state.slabs.iter().any(|s| s.roll.len() != s.other.len())
}

/// Which slabs sleep or have hardly moved.
pub(super) fn calm(state: &DemState, making: &Making, whole: bool) -> Vec<bool> {
    let limit = making.keep.filter(|_| !whole).map_or(-1.0, |d| d * d);
    let calm = |r: &Row| (r[0] - r[X0]).powi(2) + (r[1] - r[X0 + 1]).powi(2) + (r[2] - r[X0 + 2]).powi(2) <= limit;
    // No number compares with NaN: what is not finite is not calm.
    making.team.map(&state.slabs, |_, s| s.asleep || state.rows[s.grains()].iter().all(calm))
}

/// Layers outside of a slab in which grains of it are now, each once.
pub(super) fn entered(state: &DemState, k: usize) -> Vec<u32> {
    let slab = &state.slabs[k];
    let layer = |r: &Row| state.grid.place(&r[..3])[0] as u32;
    let outside = |layer: &u32| *layer < slab.layers[0] || *layer >= slab.layers[1];
    let mut layers: Vec<u32> = state.rows[slab.grains()].iter().map(layer).filter(outside).collect();
    layers.sort_unstable();
    layers.dedup();
    layers
}

/// Slabs are no longer kept whose layers a grain of a slab that is not kept has come into; nor are those that a grain of theirs
/// has come into, and so on. `entered` tells the layers that grains of some slabs have come into.
pub(super) fn reconsider(
    slabs: &[Slab],
    kept: &mut [bool],
    mut entered: impl FnMut(&[usize]) -> Result<Vec<u32>, DemError>,
) -> Result<(), DemError> {
    if kept.iter().zip(slabs).all(|(kept, s)| *kept || s.asleep) {
        // Asked for by something else than motion.
        kept.iter_mut().zip(slabs).for_each(|(kept, s)| *kept = s.asleep);
    }
    if !kept.contains(&true) {
        return Ok(());
    }
    let mut open: Vec<usize> = (0..slabs.len()).filter(|&k| !kept[k]).collect();
    while !open.is_empty() {
        let layers = entered(&open)?;
        open.clear();
        for layer in layers {
            let at = slabs.partition_point(|s| s.layers[1] <= layer);
            if slabs.get(at).is_some_and(|s| kept[at] && s.layers[0] <= layer) {
                kept[at] = false;
                open.push(at);
            }
        }
    }
    Ok(())
}

/// The stretches of slabs that are not kept or beside one that is not.
pub(super) fn blocks(slabs: &[Slab], kept: &[bool], layers: usize) -> Vec<Block> {
    let moved = |k: usize| kept.get(k).is_some_and(|kept| !kept);
    let anew = |k: usize| moved(k) || moved(k + 1) || k.checked_sub(1).is_some_and(moved);
    let mut blocks: Vec<Block> = Vec::new();
    for (k, s) in slabs.iter().enumerate().filter(|(k, _)| anew(*k)) {
        let open = blocks.last_mut().filter(|b| b.slabs.end == k);
        // Beyond the outermost slab there may be layers without grains.
        let end = if k + 1 == slabs.len() { layers } else { s.layers[1] as usize };
        if let Some(block) = open {
            (block.slabs.end, block.rows.end, block.layers.end) = (k + 1, s.last as usize, end);
        } else {
            let start = if k == 0 { 0 } else { s.layers[0] as usize };
            blocks.push(Block { slabs: k..k + 1, rows: s.grains(), layers: start..end });
        }
    }
    blocks
}

/// Makes a block anew; its slabs are added to `slabs`.
pub(super) fn make(
    state: &mut DemState,
    block: &Block,
    old: &mut [Slab],
    kept: &[bool],
    (slabs, origin): (&mut Vec<Slab>, &mut Vec<Option<usize>>),
    making: &Making,
) -> Result<(), DemError> {
    let begin = block.slabs.start;
    let kept = &kept[block.slabs.clone()];
    let grid = state.grid.clone();
    let team = making.team;
    let sorted = sort(&grid, state, block.rows.clone(), block.layers.clone(), team);
    let touching = bodies_by_id(state, old, kept);
    permute(state, &sorted, block.rows.clone());
    let from = block.layers.start;
    let layers: Vec<u32> = (from..=block.layers.end).map(|x| sorted.first_of(x * grid.layer()) as u32).collect();
    let standing = old.iter().enumerate().filter(|(k, _)| kept[*k]);
    let mut pieces = pieces(standing, &layers, block.layers.clone(), making.most(&grid));

    let mut images = Vec::new();
    if let (Some(length), Some((last, _))) = (making.period, pieces.last_mut()) {
        // Behind the end comes the beginning again.
        images = period::images(&state.rows, layers[1], length);
        last.halo += layers[1];
    }

    let listed = |n: usize| is_listed(&pieces, n);
    let to_list: Vec<usize> = (0..pieces.len()).filter(|&n| listed(n)).collect();
    let made = {
        let Making { skin, walls, rolling, .. } = *making;
        let rows = if images.is_empty() {
            Cow::Borrowed(&state.rows[..])
        } else {
            Cow::Owned([&state.rows[..], &images].concat())
        };
        let search =
            Search { rows: &rows, count: state.rows.len(), grid: &grid, sorted: &sorted, skin, walls, rolling, old };
        team.map(&to_list, |_, &n| search.slab(&pieces[n].0))
    };
    let mut made = made.into_iter();
    let from = slabs.len();
    for (n, (_, kept)) in pieces.iter().enumerate() {
        if !listed(n) {
            slabs.extend(kept.map(|k| std::mem::take(&mut old[k])));
            origin.push(kept.map(|k| begin + k));
            continue;
        }
        origin.push(None);
        let Some((mut slab, deep)) = made.next() else { continue };
        if let Some((i, j, overlap)) = deep {
            let [i, j] = [i, j].map(|k| k as usize % state.rows.len());
            let smaller = state.rows[i][R].min(state.rows[j][R]);
            let ids = [state.ids[i], state.ids[j]];
            return Err(deep_error(ids, overlap, smaller, state.time, making.hint));
        }
        if let Some(k) = *kept {
            slab.asleep = old[k].asleep;
            slab.bodies = std::mem::take(&mut old[k].bodies);
        }
        slabs.push(slab);
    }
    carry_bodies(touching, state, &grid, &sorted, &mut slabs[from..]);
    Ok(())
}

/// A piece of a block, and which of the block's slabs it was if that is kept.
pub(super) type Kept = (Piece, Option<usize>);

/// What a block is cut into: kept slabs stay as long as they are; what lies between them is cut anew. `start`: first grain of each of its layers, one more than
/// there are.
pub(super) fn pieces<'s>(
    kept: impl Iterator<Item = (usize, &'s Slab)>,
    start: &[u32],
    layers: Range<usize>,
    most: usize,
) -> Vec<Kept> {
    let (from, mut at) = (layers.start, layers.start);
    let mut pieces: Vec<Kept> = Vec::new();
    for (k, s) in kept {
        pieces.extend(cut(start, from, at..s.layers[0] as usize, most).into_iter().map(|p| (p, None)));
        at = s.layers[1] as usize;
        let halo = start[(at + 1 - from).min(start.len() - 1)];
        pieces.push((Piece { first: s.first, last: s.last, halo, layers: s.layers }, Some(k)));
    }
    pieces.extend(cut(start, from, at..layers.end, most).into_iter().map(|p| (p, None)));
    pieces
}

/// Whether a piece's pairs are listed anew: a kept slab before one that is kept, too, looks at nothing that changes.
pub(super) fn is_listed(pieces: &[Kept], n: usize) -> bool {
    pieces[n].1.is_none() || pieces.get(n + 1).is_some_and(|next| next.1.is_none())
}

/// Two grains, by number, that overlap by more than is sound; `smaller`: the smaller radius (m).
pub(super) fn deep_error([a, b]: [u32; 2], overlap: f64, smaller: f64, time: f64, hint: &'static str) -> DemError {
    DemError::Interpenetration { a, b, overlap, allowed: DEEPEST * smaller, time, hint }
}

/// What a look at all grains finds.
pub(super) struct Survey {
    /// Least and greatest coordinates of centres (m).
    pub low: Vec3,
    pub high: Vec3,
    /// Greatest radius (m).
    pub largest: f64,
}

/// Ranges of grains in slabs that are not kept.
fn changing(slabs: &[Slab], kept: &[bool], count: usize) -> Vec<Range<usize>> {
    if !kept.contains(&true) {
        return std::iter::once(0..count).collect();
    }
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for (s, _) in slabs.iter().zip(kept).filter(|(_, kept)| !**kept) {
        match ranges.last_mut().filter(|r| r.end == s.first as usize) {
            Some(range) => range.end = s.last as usize,
            None => ranges.push(s.grains()),
        }
    }
    ranges
}

/// Checks the grains of slabs that are not kept, and makes their positions those that lists are made at.
pub(super) fn survey(state: &mut DemState, making: &Making, kept: &[bool]) -> Result<Survey, DemError> {
    let Making { walls, team, hint, period, .. } = *making;
    let mut chunks = Vec::new();
    let (mut rest, mut at) = (&mut state.rows[..], 0);
    for range in changing(&state.slabs, kept, rest.len()) {
        let (here, behind) = std::mem::take(&mut rest)[range.start - at..].split_at_mut(range.len());
        chunks.extend((range.start..).step_by(CHUNK).zip(here.chunks_mut(CHUNK)));
        (rest, at) = (behind, range.end);
    }
    let parts = team.map_each(chunks, |(first, chunk): (usize, &mut [Row])| {
        let mut part = Survey { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3], largest: 0.0 };
        let mut wrong = None;
        for (k, r) in chunk.iter_mut().enumerate() {
            if let Some(length) = period {
                period::wrap(r, length);
            }
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
                wrong = wrong.or(Some(first + k));
            }
        }
        (part, wrong)
    });
    let mut all = Survey { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3], largest: 0.0 };
    for (part, wrong) in parts {
        if let Some(k) = wrong {
            let (row, id) = (&state.rows[k], state.ids[k]);
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

/// Brings rows, numbers and forces of a block into a new order, cycle by cycle in place: most grains stay where they are.
fn permute(state: &mut DemState, sorted: &Sorted, block: Range<usize>) {
    let order = &sorted.order;
    let (rows, ids, force) = (&mut state.rows[block.clone()], &mut state.ids[block.clone()], &mut state.force[block]);
    let mut done = vec![false; order.len()];
    for start in 0..order.len() {
        if done[start] || order[start] as usize == start {
            continue;
        }
        let held = (rows[start], ids[start], force[start]);
        let mut to = start;
        loop {
            done[to] = true;
            let from = order[to] as usize;
            if from == start {
                break;
            }
            (rows[to], ids[to], force[to]) = (rows[from], ids[from], force[from]);
            to = from;
        }
        (rows[to], ids[to], force[to]) = held;
    }
}

/// A touching pair with a body, its grain by number and place in space.
type Touching = (u32, Vec3, super::slab::BodyPair);

/// The touching pairs of slabs that are not kept with bodies, before the grains change places.
fn bodies_by_id(state: &DemState, old: &[Slab], kept: &[bool]) -> Vec<Touching> {
    let pairs = old.iter().zip(kept).filter(|(_, kept)| !**kept).flat_map(|(s, _)| &s.bodies);
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
        let (from, to) = (sorted.first_of(cell), sorted.first_of(cell + 1));
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
