//! Lists made anew by all members: what is kept, where slabs are cut, and which grains and memories go where.
//!
//! As [`super::super::rebuild`](mod@crate::dem::rebuild) does it, block by block. A block within one member is made there and nowhere else. A block that lies across a cut is made by its members together: they count
//! its grains by layers, cut it into the same slabs, say which member each is of, and exchange the grains that have come to be another's. Contacts there are given their memories by
//! the numbers of the grains; those of contacts across a cut are told to all members of the block, since nobody else knows where the other grain has gone.

use super::{Spread, pack, unpack};
use crate::dem::error::DemError;
use crate::dem::grains::{DemState, R, Row, X0};
use crate::dem::grid::{Grid, Moments, sort_rows};
use crate::dem::memories::Memories;
use crate::dem::rebuild::{
    Block, Kept, Making, blocks, calm, deep_error, entered, is_listed, make, pieces, reconsider, survey, whole,
};
use crate::dem::search::Search;
use crate::dem::slab::{Piece, Slab};
use crate::dem::vec3::Vec3;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// What all know of a slab.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Meta {
    layers: [u32; 2],
    grains: u32,
    kept: bool,
    asleep: bool,
}

/// What a member has found in its grains.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Found {
    low: Vec3,
    high: Vec3,
    largest: f64,
    count: u64,
}

/// A grain on its way: number, row, force.
type Moving = (u32, Row, Vec3);

/// Grains and memories on their way.
#[derive(Default, Serialize, Deserialize)]
struct Parcel {
    grains: Vec<Moving>,
    pairs: Vec<Pair>,
    walls: Vec<Pair>,
    bodies: Vec<(u32, Vec<crate::dem::slab::BodyPair>)>,
}

/// A memory of two grains, or of a grain and a wall.
type Pair = ((u32, u32), ([f64; 4], [f64; 3]));

/// Where slabs of all members lie.
struct Map {
    /// As slabs without lists, places counted over all members.
    slabs: Vec<Slab>,
    kept: Vec<bool>,
    /// The member of each.
    member: Vec<usize>,
    /// First slab of each member, one more than there are members.
    first: Vec<usize>,
    /// First grain of each member, likewise.
    grain: Vec<u32>,
}

impl Map {
    fn of(all: &[Vec<Meta>], counts: &[u32]) -> Self {
        let mut map = Self { slabs: Vec::new(), kept: Vec::new(), member: Vec::new(), first: vec![0], grain: vec![0] };
        for (m, (metas, count)) in all.iter().zip(counts).enumerate() {
            let mut at = map.grain[m];
            for meta in metas {
                let (first, last) = (at, at + meta.grains);
                let Meta { layers, asleep, .. } = *meta;
                map.slabs.push(Slab { first, last, halo: last, layers, asleep, ..Slab::default() });
                map.kept.push(meta.kept);
                map.member.push(m);
                at = last;
            }
            map.first.push(map.slabs.len());
            map.grain.push(map.grain[m] + count);
        }
        map
    }
}

/// As [`crate::dem::rebuild::rebuild`], of all members together.
pub(in crate::dem) fn rebuild(
    state: &mut DemState,
    making: &Making,
    spread: &mut Spread,
) -> Result<Vec<Option<usize>>, DemError> {
    let me = spread.index;
    let anew = spread.links().any(whole(state, making))?;
    let calm = calm(state, making, anew);
    let metas: Vec<Meta> = state
        .slabs
        .iter()
        .zip(calm)
        .map(|(s, kept)| Meta { layers: s.layers, grains: s.last - s.first, kept, asleep: s.asleep })
        .collect();
    let all: Vec<(Vec<Meta>, u32)> = spread.share(&(metas, state.rows.len() as u32))?;
    let (metas, counts): (Vec<Vec<Meta>>, Vec<u32>) = all.into_iter().unzip();
    let mut map = Map::of(&metas, &counts);
    let mine = map.first[me]..map.first[me + 1];
    reconsider(&map.slabs, &mut map.kept, |open| {
        let here = open.iter().filter(|k| mine.contains(k));
        let layers: Vec<u32> = here.flat_map(|k| entered(state, k - mine.start)).collect();
        Ok(spread.share(&layers)?.concat())
    })?;
    for (slab, kept) in map.slabs.iter_mut().zip(&map.kept) {
        slab.asleep &= *kept;
    }
    let kept = map.kept[mine.clone()].to_vec();
    for (slab, kept) in state.slabs.iter_mut().zip(&kept) {
        slab.asleep &= *kept;
    }

    let surveyed = survey(state, making, &kept);
    let found = surveyed.as_ref().ok().map(|s| Found {
        low: s.low,
        high: s.high,
        largest: s.largest,
        count: state.rows.len() as u64,
    });
    spread.agree(surveyed.map(drop))?;
    let stretches = if map.kept.contains(&true) {
        blocks(&map.slabs, &map.kept, state.grid.n[0])
    } else {
        let found: Vec<Found> = spread.share(&found)?.into_iter().flatten().collect();
        state.grid = grid(state, &found, making, spread)?;
        let rows = 0..map.grain[map.grain.len() - 1] as usize;
        vec![Block { slabs: 0..map.slabs.len(), rows, layers: 0..state.grid.n[0] }]
    };

    let mut old = std::mem::take(&mut state.slabs);
    let mut made = Made { slabs: Vec::with_capacity(old.len() + 8), origin: Vec::with_capacity(old.len() + 8) };
    let mut next = 0;
    let mut result = Ok(());
    for block in &stretches {
        let members = members(&map, block, spread.size);
        if !members.contains(&me) {
            continue;
        }
        // My part of it.
        let slabs = block.slabs.start.max(mine.start) - mine.start..block.slabs.end.min(mine.end) - mine.start;
        made.keep(&mut old, next..slabs.start);
        next = slabs.end;
        if members.len() == 1 {
            let rows = rows_of(&old[slabs.clone()], state);
            let local = Block { slabs: slabs.clone(), rows, layers: block.layers.clone() };
            let target = (&mut made.slabs, &mut made.origin);
            result = result.and(make(state, &local, &mut old[slabs], &kept, target, making));
        } else {
            let before = state.rows.len();
            let across = Across { block, members, map: &map, slabs, making };
            result = result.and(across.make(state, &mut old, &mut made, spread));
            // What stands behind it has moved with its grains.
            let by = (state.rows.len() as u32).wrapping_sub(before as u32);
            old[next..].iter_mut().for_each(|s| shift(s, s.first.wrapping_add(by)));
        }
    }
    made.keep(&mut old, next..mine.len());
    state.slabs = made.slabs;
    // Lists made across a cut count from the block's first grain.
    let mut at = 0;
    for slab in &mut state.slabs {
        shift(slab, at);
        at = slab.last;
    }
    state.stale = false;
    state.rebuilds += 1;
    spread.agree(result)?;
    spread.find_neighbours(state)?;
    Ok(made.origin)
}

/// The grains of slabs in a row; where there are no slabs yet, all.
fn rows_of(slabs: &[Slab], state: &DemState) -> Range<usize> {
    match (slabs.first(), slabs.last()) {
        (Some(first), Some(last)) => first.first as usize..last.last as usize,
        _ => 0..state.rows.len(),
    }
}

/// New slabs, and which they were.
struct Made {
    slabs: Vec<Slab>,
    origin: Vec<Option<usize>>,
}

impl Made {
    /// Slabs that nothing changes.
    fn keep(&mut self, old: &mut [Slab], range: Range<usize>) {
        self.origin.extend(range.clone().map(Some));
        self.slabs.extend(old[range].iter_mut().map(std::mem::take));
    }
}

/// Moves a slab and its lists to where its first grain is now.
pub(super) fn shift(slab: &mut Slab, to: u32) {
    let by = to.wrapping_sub(slab.first);
    if by == 0 {
        return;
    }
    let places = [&mut slab.first, &mut slab.last, &mut slab.halo].into_iter();
    let lists = slab.other.iter_mut().chain(&mut slab.owner);
    let touching = slab.walls.iter_mut().map(|w| &mut w.grain).chain(slab.bodies.iter_mut().map(|b| &mut b.grain));
    places.chain(lists).chain(touching).for_each(|p| *p = p.wrapping_add(by));
}

/// The new grid, over the grains of all.
fn grid(state: &DemState, found: &[Found], making: &Making, spread: &mut Spread) -> Result<Grid, DemError> {
    let mut all = Found { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3], largest: 0.0, count: 0 };
    for f in found {
        for c in 0..3 {
            all.low[c] = all.low[c].min(f.low[c]);
            all.high[c] = all.high[c].max(f.high[c]);
        }
        all.largest = all.largest.max(f.largest);
        all.count += f.count;
    }
    let size = 2.0 * all.largest + making.skin;
    if let Some(grid) = Grid::fitting(all.count as usize, all.low, all.high, size) {
        return Ok(grid);
    }
    let mut moments = Moments::default();
    spread.share(&Moments::of(&state.rows))?.iter().for_each(|m| moments.add(m));
    Ok(Grid::without_outliers(&moments, all.low, all.high, size))
}

/// The members that a block lies on, in a row.
fn members(map: &Map, block: &Block, size: usize) -> Range<usize> {
    match (map.member.get(block.slabs.start), block.slabs.end.checked_sub(1).and_then(|k| map.member.get(k))) {
        // Grains that have just been placed are in no slab.
        _ if block.slabs.len() == map.slabs.len() => 0..size,
        (Some(first), Some(last)) => *first..last + 1,
        _ => 0..size,
    }
}

/// A block across a cut.
struct Across<'a> {
    block: &'a Block,
    members: Range<usize>,
    map: &'a Map,
    /// My slabs of it, as they were.
    slabs: Range<usize>,
    making: &'a Making<'a>,
}

impl Across<'_> {
    fn make(
        &self,
        state: &mut DemState,
        old: &mut [Slab],
        made: &mut Made,
        spread: &mut Spread,
    ) -> Result<(), DemError> {
        let me = spread.index;
        let rows = rows_of(&old[self.slabs.clone()], state);
        let others: Vec<usize> = self.members.clone().filter(|m| *m != me).collect();
        let start = self.count(state, rows.clone(), &others, spread)?;
        let standing = self.block.slabs.clone().filter(|&k| self.map.kept[k]);
        let standing = standing.map(|k| (k, &self.map.slabs[k]));
        let most = self.making.most(&state.grid);
        let mut pieces = pieces(standing, &start, self.block.layers.clone(), most);
        let member = self.owners(&pieces);

        let parcels = self.parcels(state, old, rows.clone(), &pieces, &member, spread);
        let (grains, memories) = self.exchange(parcels, &others, spread)?;
        let range = member.partition_point(|m| *m < me)..member.partition_point(|m| *m <= me);
        // From here on places are counted from my first grain of the block.
        let base = pieces.get(range.start).map_or(0, |p| p.0.first);
        self.settle_in(state, rows.clone(), grains);
        let count = range.clone().map(|n| (pieces[n].0.last - pieces[n].0.first) as usize).sum::<usize>();
        let block = rows.start..rows.start + count;
        self.look(state, &pieces, &member, block.clone(), spread)?;
        for (piece, _) in &mut pieces {
            for place in [&mut piece.first, &mut piece.last, &mut piece.halo] {
                *place = place.wrapping_sub(base);
            }
        }
        self.list(state, block, (&pieces, range), old, &memories, made, spread)
    }

    /// First grain of each layer of the block, one more than there are layers; places counted over all members.
    fn count(
        &self,
        state: &DemState,
        rows: Range<usize>,
        others: &[usize],
        spread: &mut Spread,
    ) -> Result<Vec<u32>, DemError> {
        let mut counts = vec![0_u32; self.block.layers.len()];
        state.rows[rows].iter().for_each(|r| counts[self.layer(&state.grid, r) - self.block.layers.start] += 1);
        let mine = pack(&counts)?;
        let out = others.iter().map(|m| (*m, mine.clone())).collect();
        for bytes in spread.links().round(out, others)? {
            let theirs: Vec<u32> = unpack(&bytes)?;
            counts.iter_mut().zip(theirs).for_each(|(sum, n)| *sum += n);
        }
        let mut start = vec![self.block.rows.start as u32];
        counts.iter().for_each(|n| start.push(start[start.len() - 1] + n));
        Ok(start)
    }

    /// Layer of a grain where lists are made.
    fn layer(&self, grid: &Grid, row: &Row) -> usize {
        grid.place(&row[X0..X0 + 3])[0].clamp(self.block.layers.start, self.block.layers.end - 1)
    }

    /// The member that each piece will be of. Where grains have just been placed, so that all have the same number of grains; where all is made anew, so that all have as many as they had
    /// ([`super::balance`] moves cuts); else where its first layer was.
    fn owners(&self, pieces: &[Kept]) -> Vec<usize> {
        let anew = self.members.len() == self.map.first.len() - 1 && !self.map.kept.contains(&true);
        let all = self.block.rows.len().max(1);
        let of = |(piece, _): &Kept| {
            if anew {
                let middle = (piece.first + piece.last) / 2;
                return if self.map.slabs.is_empty() {
                    (middle as usize * self.members.len() / all).min(self.members.len() - 1)
                } else {
                    // The last of those that begin here: the others have no grains.
                    self.map.grain[1..self.map.grain.len() - 1].partition_point(|first| *first <= middle)
                };
            }
            let slabs = &self.map.slabs[self.block.slabs.clone()];
            let behind = slabs.partition_point(|s| s.layers[0] <= piece.layers[0]);
            self.map.member[self.block.slabs.start + behind.max(1) - 1]
        };
        pieces.iter().map(of).collect()
    }

    /// What goes to each member of the block, mine included, by member from the first on.
    fn parcels(
        &self,
        state: &DemState,
        old: &[Slab],
        rows: Range<usize>,
        pieces: &[Kept],
        member: &[usize],
        spread: &Spread,
    ) -> Vec<Parcel> {
        let me = spread.index;
        let mut parcels: Vec<Parcel> = self.members.clone().map(|_| Parcel::default()).collect();
        let at = |m: usize| m - self.members.start;
        let goes: Vec<usize> = state.rows[rows.clone()]
            .iter()
            .map(|r| {
                let layer = self.layer(&state.grid, r) as u32;
                let n = pieces.partition_point(|(p, _)| p.layers[1] <= layer);
                member.get(n).copied().unwrap_or(me)
            })
            .collect();
        for (k, &to) in rows.clone().zip(&goes) {
            parcels[at(to)].grains.push((state.ids[k], state.rows[k], state.force[k]));
        }
        let ids = [&state.ids[..], &spread.ghost_ids].concat();
        let home = |place: u32| {
            let place = place as usize;
            rows.contains(&place).then(|| goes[place - rows.start])
        };
        // Of slabs that stay as they are nobody asks.
        let stays = |k: usize| {
            let k = k + self.map.first[me];
            pieces.iter().position(|p| p.1 == Some(k)).is_some_and(|n| !is_listed(pieces, n))
        };
        for s in self.slabs.clone().filter(|k| !stays(*k)).map(|k| &old[k]) {
            for (p, (&i, &j)) in s.owner.iter().zip(&s.other).enumerate() {
                if s.slip[p][3] == 0.0 {
                    continue;
                }
                let pair =
                    ((ids[i as usize], ids[j as usize]), (s.slip[p].0, s.roll.get(p).copied().unwrap_or_default()));
                match (home(i), home(j)) {
                    (Some(a), Some(b)) => {
                        parcels[at(a)].pairs.push(pair);
                        if a != b {
                            parcels[at(b)].pairs.push(pair);
                        }
                    }
                    _ => parcels.iter_mut().for_each(|parcel| parcel.pairs.push(pair)),
                }
            }
            for w in s.walls.iter().filter(|w| w.slip[3] != 0.0) {
                let to = home(w.grain).unwrap_or(me);
                parcels[at(to)].walls.push(((ids[w.grain as usize], w.wall), (w.slip.0, w.roll)));
            }
            let mut from = 0;
            while from < s.bodies.len() {
                let grain = s.bodies[from].grain;
                let touches = s.bodies[from..].iter().take_while(|b| b.grain == grain).count();
                let to = home(grain).unwrap_or(me);
                let known = s.bodies[from..from + touches].to_vec();
                parcels[at(to)].bodies.push((ids[grain as usize], known));
                from += touches;
            }
        }
        parcels
    }

    /// Parcels go and come; gives the grains of all that are mine now, and what their contacts remember.
    fn exchange(
        &self,
        mut parcels: Vec<Parcel>,
        others: &[usize],
        spread: &mut Spread,
    ) -> Result<(Vec<Moving>, Memories), DemError> {
        let me = spread.index;
        let mut all = vec![std::mem::take(&mut parcels[me - self.members.start])];
        let out = others.iter().map(|&m| Ok((m, pack(&parcels[m - self.members.start])?)));
        let out = out.collect::<Result<Vec<_>, DemError>>()?;
        for bytes in spread.links().round(out, others)? {
            all.push(unpack(&bytes)?);
        }
        let mut grains = Vec::new();
        let mut memories = Memories::default();
        for parcel in all {
            grains.extend(parcel.grains);
            let slip = |(slip, roll)| (crate::dem::contact::Slip(slip), roll);
            memories.pairs.extend(parcel.pairs.into_iter().map(|(key, m)| (key, slip(m))));
            memories.walls.extend(parcel.walls.into_iter().map(|(key, m)| (key, slip(m))));
            for (id, known) in parcel.bodies {
                memories.bodies.entry(id).or_default().extend(known);
            }
        }
        Ok((grains, memories))
    }

    /// Puts the block's grains into the place of those that I had of it, in canonical order.
    fn settle_in(&self, state: &mut DemState, rows: Range<usize>, grains: Vec<Moving>) {
        let (new, ids): (Vec<Row>, Vec<u32>) = grains.iter().map(|g| (g.1, g.0)).unzip();
        let sorted = sort_rows(&state.grid, (&new, &ids), 0..new.len(), self.block.layers.clone(), self.making.team);
        let order = sorted.order.iter().map(|&k| k as usize);
        state.rows.splice(rows.clone(), order.clone().map(|k| new[k]));
        state.ids.splice(rows.clone(), order.clone().map(|k| ids[k]));
        state.force.splice(rows, order.map(|k| grains[k].2));
    }

    /// Ghosts of the last slab where the block goes on with another member: the first layer there.
    fn look(
        &self,
        state: &DemState,
        pieces: &[Kept],
        member: &[usize],
        rows: Range<usize>,
        spread: &mut Spread,
    ) -> Result<(), DemError> {
        let me = spread.index;
        let (from, to) = (member.partition_point(|m| *m < me), member.partition_point(|m| *m <= me));
        let halo = |piece: &Piece| (piece.halo - piece.last) as usize;
        let mut out = Vec::new();
        if from < to
            && let Some((before, _)) = from.checked_sub(1).map(|n| &pieces[n])
        {
            let shown = rows.start..rows.start + halo(before);
            let shown: (&[Row], &[u32]) = (&state.rows[shown.clone()], &state.ids[shown]);
            out.push((member[from - 1], pack(&shown)?));
        }
        let behind: Vec<usize> = member.get(to).copied().filter(|_| from < to).into_iter().collect();
        let came = spread.links().round(out, &behind)?;
        if let Some(bytes) = came.first() {
            (spread.ghosts, spread.ghost_ids) = unpack(bytes)?;
        }
        Ok(())
    }

    /// Lists my pieces.
    #[expect(clippy::too_many_arguments, reason = "one job, cut out of `make` for its length")]
    fn list(
        &self,
        state: &DemState,
        block: Range<usize>,
        (pieces, range): (&[Kept], Range<usize>),
        old: &mut [Slab],
        memories: &Memories,
        made: &mut Made,
        spread: &Spread,
    ) -> Result<(), DemError> {
        let me = spread.index;
        // Behind my last grain of the block are ghosts, where it goes on with another member. Ghosts behind the block's end are none of its cells: what is kept there looks at them,
        // and nothing that is listed.
        let goes_on = range.end < pieces.len();
        let ghosts: (&[Row], &[u32]) = if goes_on { (&spread.ghosts, &spread.ghost_ids) } else { (&[], &[]) };
        let rows = [&state.rows[block.clone()], ghosts.0].concat();
        let ids = [&state.ids[block], ghosts.1].concat();
        let (grid, team) = (&state.grid, self.making.team);
        let sorted = sort_rows(grid, (&rows, &ids), 0..rows.len(), self.block.layers.clone(), team);
        let Making { skin, walls, rolling, .. } = *self.making;
        let search = Search { rows: &rows, count: rows.len(), grid, sorted: &sorted, skin, walls, rolling, old: &[] };
        let listed: Vec<usize> = range.clone().filter(|&n| is_listed(pieces, n)).collect();
        let mut lists = team.map(&listed, |_, &n| search.slab(&pieces[n].0)).into_iter();
        for n in range {
            let mine = |k: usize| k - self.map.first[me];
            if !is_listed(pieces, n) {
                if let Some(k) = pieces[n].1.map(mine) {
                    made.slabs.push(std::mem::take(&mut old[k]));
                    made.origin.push(Some(k));
                }
                continue;
            }
            let Some((mut slab, deep)) = lists.next() else { continue };
            if let Some((i, j, overlap)) = deep {
                let [i, j] = [i, j].map(|k| k as usize);
                let smaller = rows[i][R].min(rows[j][R]);
                return Err(deep_error([ids[i], ids[j]], overlap, smaller, state.time, self.making.hint));
            }
            slab.asleep = pieces[n].1.is_some_and(|k| self.map.slabs[k].asleep);
            memories.give(&mut slab, &ids, |_| true);
            made.slabs.push(slab);
            made.origin.push(None);
        }
        Ok(())
    }
}

impl Spread {
    /// Who is before and behind now.
    pub(super) fn find_neighbours(&mut self, state: &DemState) -> Result<(), DemError> {
        let halo = state.slabs.last().map_or(0, |s| s.halo - s.last);
        let reach = state
            .slabs
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], s| [low.min(s.extent[0]), high.max(s.extent[1])]);
        let thickest = state.slabs.iter().map(|s| s.extent[1] - s.extent[0]).fold(0.0, f64::max);
        let all: Vec<(u32, u32, [f64; 2], f64)> = self.share(&(state.slabs.len() as u32, halo, reach, thickest))?;
        let me = self.index;
        self.before = (0..me).rev().find(|&m| all[m].0 > 0).filter(|_| all[me].0 > 0);
        self.behind = (me + 1..all.len()).find(|&m| all[m].0 > 0).filter(|_| all[me].0 > 0);
        self.front = self.before.map_or(0, |m| all[m].1 as usize);
        self.reach = all.iter().map(|m| m.2).collect();
        self.thickest = all.iter().map(|m| m.3).fold(0.0, f64::max);
        if self.behind.is_none() {
            self.ghosts.clear();
            self.ghost_ids.clear();
        }
        Ok(())
    }
}
