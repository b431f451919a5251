//! Rebuild: sort the grains anew, cut slabs, list the pairs, and carry the histories over.
//!
//! A list holds all pairs closer than touching plus the skin, and stays valid until some grain has moved half the skin
//! since the last rebuild. Histories are found by the old places of the two grains; where a pair's order has turned
//! round, its history changes sign, since both displacement and rotation are relative to the first grain. A rebuild
//! changes no force but for the order of sums.
//!
//! While slabs sleep ([`super::sleep`]), the grid stays and only *blocks* are made anew: the slabs that are awake, and those
//! that sleep beside them, whose lists reach into what moves. A grain that comes into the layers of a sleeping slab wakes it. So
//! what sleeps keeps its place in memory, and costs nothing.

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
struct Block {
    /// Its slabs as they were.
    slabs: Range<usize>,
    rows: Range<usize>,
    layers: Range<usize>,
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
    /// Greatest length of a slab (m): what sleeps is whole slabs.
    pub longest: f64,
    /// Threads.
    pub team: &'a Team,
    /// Advice when something is wrong.
    pub hint: &'static str,
}

/// Rebuilds the lists of `state`.
///
/// # Errors
/// A value that is not finite, a grain outside the walls, or grains deep inside each other.
pub fn rebuild(state: &mut DemState, making: &Making) -> Result<(), DemError> {
    if state.slabs.iter().any(|s| s.asleep) {
        wake_entered(state);
    }
    let partly = state.slabs.iter().any(|s| s.asleep);
    let survey = survey(state, making)?;
    let blocks = if partly {
        blocks(&state.slabs, state.grid.n[0])
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
    let mut next = 0;
    for block in &blocks {
        slabs.extend(old[next..block.slabs.start].iter_mut().map(std::mem::take));
        next = block.slabs.end;
        make(state, block, &mut old[block.slabs.clone()], &mut slabs, making)?;
    }
    slabs.extend(old[next..].iter_mut().map(std::mem::take));
    state.slabs = slabs;
    state.stale = false;
    state.rebuilds += 1;
    Ok(())
}

/// Wakes the sleeping slabs whose layers a grain that is awake has come into.
fn wake_entered(state: &mut DemState) {
    let mut entered = Vec::new();
    let asleep = |layer: u32| {
        let k = state.slabs.partition_point(|s| s.layers[1] <= layer);
        state.slabs.get(k).filter(|s| s.asleep && s.layers[0] <= layer).map(|_| k)
    };
    for slab in state.slabs.iter().filter(|s| !s.asleep) {
        for row in &state.rows[slab.grains()] {
            let layer = state.grid.place(&row[..3])[0] as u32;
            if layer < slab.layers[0] || layer >= slab.layers[1] {
                entered.extend(asleep(layer));
            }
        }
    }
    entered.into_iter().for_each(|k| state.slabs[k].asleep = false);
}

/// The stretches of slabs that are awake or beside one that is.
fn blocks(slabs: &[Slab], layers: usize) -> Vec<Block> {
    let awake = |k: usize| slabs.get(k).is_some_and(|s| !s.asleep);
    let anew = |k: usize| awake(k) || awake(k + 1) || k.checked_sub(1).is_some_and(awake);
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
fn make(
    state: &mut DemState,
    block: &Block,
    old: &mut [Slab],
    slabs: &mut Vec<Slab>,
    making: &Making,
) -> Result<(), DemError> {
    let grid = state.grid.clone();
    let team = making.team;
    let sorted = sort(&grid, state, block.rows.clone(), block.layers.clone(), team);
    let touching = bodies_by_id(state, old);
    permute(state, &sorted, block.rows.clone());
    let from = block.layers.start;
    let layers: Vec<u32> = (from..=block.layers.end).map(|x| sorted.first_of(x * grid.layer()) as u32).collect();
    let most = ((making.longest / grid.size) as usize).max(1);
    // Sleeping slabs keep their extent; what lies between them is cut anew.
    let mut pieces: Vec<(Piece, Option<usize>)> = Vec::new();
    let mut at = from;
    for (k, s) in old.iter().enumerate().filter(|(_, s)| s.asleep) {
        pieces.extend(cut(&layers, from, at..s.layers[0] as usize, most).into_iter().map(|p| (p, None)));
        at = s.layers[1] as usize;
        let halo = layers[(at + 1 - from).min(layers.len() - 1)];
        pieces.push((Piece { first: s.first, last: s.last, halo, layers: s.layers }, Some(k)));
    }
    pieces.extend(cut(&layers, from, at..block.layers.end, most).into_iter().map(|p| (p, None)));

    let mut images = Vec::new();
    if let (Some(length), Some((last, _))) = (making.period, pieces.last_mut()) {
        // Behind the end comes the beginning again.
        images = period::images(&state.rows, layers[1], length);
        last.halo += layers[1];
    }

    // A sleeping slab before one that sleeps, too, looks at nothing that moves.
    let listed = |n: usize| pieces[n].1.is_none() || pieces.get(n + 1).is_some_and(|next| next.1.is_none());
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
    let begin = slabs.len();
    for (n, (_, kept)) in pieces.iter().enumerate() {
        if !listed(n) {
            slabs.extend(kept.map(|k| std::mem::take(&mut old[k])));
            continue;
        }
        let Some((mut slab, deep)) = made.next() else { continue };
        if let Some((i, j, overlap)) = deep {
            let [i, j] = [i, j].map(|k| k as usize % state.rows.len());
            let smaller = state.rows[i][R].min(state.rows[j][R]);
            return Err(DemError::Interpenetration {
                a: state.ids[i],
                b: state.ids[j],
                overlap,
                allowed: DEEPEST * smaller,
                time: state.time,
                hint: making.hint,
            });
        }
        if let Some(k) = *kept {
            slab.asleep = true;
            slab.bodies = std::mem::take(&mut old[k].bodies);
        }
        slabs.push(slab);
    }
    carry_bodies(touching, state, &grid, &sorted, &mut slabs[begin..]);
    Ok(())
}

/// What a look at all grains finds.
struct Survey {
    low: Vec3,
    high: Vec3,
    largest: f64,
}

/// Ranges of grains that are awake: all where nothing sleeps.
fn awake(slabs: &[Slab], count: usize) -> Vec<Range<usize>> {
    if slabs.iter().all(|s| !s.asleep) {
        return std::iter::once(0..count).collect();
    }
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for s in slabs.iter().filter(|s| !s.asleep) {
        match ranges.last_mut().filter(|r| r.end == s.first as usize) {
            Some(range) => range.end = s.last as usize,
            None => ranges.push(s.grains()),
        }
    }
    ranges
}

/// Checks all grains that are awake, and makes their positions those that lists are made at.
fn survey(state: &mut DemState, making: &Making) -> Result<Survey, DemError> {
    let Making { walls, team, hint, period, .. } = *making;
    let mut chunks = Vec::new();
    let (mut rest, mut at) = (&mut state.rows[..], 0);
    for range in awake(&state.slabs, rest.len()) {
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

/// The touching pairs of slabs that are awake with bodies, before the grains change places.
fn bodies_by_id(state: &DemState, old: &[Slab]) -> Vec<Touching> {
    let pairs = old.iter().filter(|s| !s.asleep).flat_map(|s| &s.bodies);
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
