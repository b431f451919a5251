//! Large beds from tiles: one settled stretch that repeats itself along x, laid as often as the bed is long.
//!
//! A tile is settled in a box without ends ([`super::period`]), so that its two ends fit each other grain by grain. Laid side by side,
//! tiles are in balance as they are: positions, and what every contact remembers, are those of the tile. Only at the ends of the bed
//! do grains that would reach over a wall have to be left out, and what they held moves up a little.
//!
//! The number of a grain says which tile it is of and which grain in it: `tile x grains of a tile + place`. So a tile can be laid
//! anew in front of a bed whose other tiles have been driven over ([`super::patch`]).

use super::contact::{Roll, Slip};
use super::engine::{CpuEngine, GrainEngine as _, Setup};
use super::error::DemError;
use super::grains::{DemState, R, Row, X0};
use super::settle::{BedReport, Progress, Recipe, Settle, prepare_with, settle};
use super::surface::Surface;
use super::wall::Wall;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// A settled stretch of soil that fits itself at both ends.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tile {
    /// Its length along x (m).
    pub length: f64,
    /// Its grains, x from -length/2 to length/2, velocities zero.
    pub rows: Vec<Row>,
    /// Its contacts that remember something.
    pub pairs: Vec<TilePair>,
    /// Its contacts with walls, by place and number of the wall in the bed.
    pub walls: Vec<(u32, u32, Slip, Roll)>,
}

/// A contact of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TilePair {
    /// Place of the grain that memories are relative to.
    pub one: u32,
    /// Place of its partner.
    pub two: u32,
    /// The partner is of the next tile.
    pub across: bool,
    /// History.
    pub slip: Slip,
    /// History of rolling.
    pub roll: Roll,
}

/// Time that a bed of tiles settles for at least (s): what is left out at its ends is a matter of one grain's fall.
const LEAST_TIME: f64 = 0.02;

impl Tile {
    /// What an engine in a periodic box has settled; `walls`: number in the bed of each of its walls.
    fn of(engine: &CpuEngine, length: f64, walls: &[u32]) -> Self {
        let state = engine.state();
        let count = state.rows.len() as u32;
        let mut rows = state.rows.clone();
        for r in &mut rows {
            for c in 0..3 {
                (r[4 + c], r[8 + c]) = (0.0, 0.0);
            }
        }
        let mut pairs = Vec::new();
        let mut of_walls = Vec::new();
        for s in &state.slabs {
            for (p, (&one, &two)) in s.owner.iter().zip(&s.other).enumerate() {
                if s.slip[p][3] != 0.0 {
                    let roll = s.roll.get(p).copied().unwrap_or_default();
                    pairs.push(TilePair { one, two: two % count, across: two >= count, slip: s.slip[p], roll });
                }
            }
            let touching = s.walls.iter().filter(|w| w.slip[3] != 0.0);
            of_walls.extend(touching.map(|w| (w.grain, walls[w.wall as usize], w.slip, w.roll)));
        }
        Self { length, rows, pairs, walls: of_walls }
    }

    /// Rows and numbers of tile `number`, its middle at `x` (m), without the grains that reach beyond these ends.
    pub fn lay(&self, number: u32, x: f64, ends: [f64; 2]) -> impl Iterator<Item = (Row, u32)> + '_ {
        let first = number * self.rows.len() as u32;
        self.rows.iter().zip(first..).filter_map(move |(r, id)| {
            let mut row = *r;
            row[0] += x;
            row.copy_within(0..3, X0);
            (row[0] - row[R] >= ends[0] && row[0] + row[R] <= ends[1]).then_some((row, id))
        })
    }

    /// Gives contacts that have no memory yet what those of the tile remember, where a grain is of tile `fresh` or a later one.
    pub fn remember(&self, state: &mut DemState, fresh: u32) {
        let count = self.rows.len() as u32;
        let known: HashMap<(u32, u32, bool), &TilePair> =
            self.pairs.iter().map(|p| ((p.one, p.two, p.across), p)).collect();
        let walls: HashMap<(u32, u32), (Slip, Roll)> =
            self.walls.iter().map(|&(grain, wall, slip, roll)| ((grain, wall), (slip, roll))).collect();
        let DemState { ids, slabs, .. } = state;
        let at = |place: u32| (ids[place as usize] / count, ids[place as usize] % count);
        for s in slabs {
            for p in 0..s.other.len() {
                if s.slip[p][3] != 0.0 {
                    continue;
                }
                let ((m, a), (n, b)) = (at(s.owner[p]), at(s.other[p]));
                if m.max(n) < fresh {
                    continue;
                }
                let found = match n.wrapping_sub(m) {
                    0 => known.get(&(a, b, false)).map(|k| (k, 1.0)).or(known.get(&(b, a, false)).map(|k| (k, -1.0))),
                    1 => known.get(&(a, b, true)).map(|k| (k, 1.0)),
                    u32::MAX => known.get(&(b, a, true)).map(|k| (k, -1.0)),
                    _ => None,
                };
                if let Some((k, sign)) = found {
                    let u = k.slip;
                    s.slip[p] = Slip([sign * u[0], sign * u[1], sign * u[2], u[3]]);
                    if let Some(roll) = s.roll.get_mut(p) {
                        *roll = k.roll.map(|x| sign * x);
                    }
                }
            }
            for w in s.walls.iter_mut().filter(|w| w.slip[3] == 0.0 && at(w.grain).0 >= fresh) {
                if let Some(&(slip, roll)) = walls.get(&(at(w.grain).1, w.wall)) {
                    (w.slip, w.roll) = (slip, roll);
                }
            }
        }
    }
}

/// Whether a wall closes an end of the box.
pub(super) fn is_end(wall: &Wall) -> bool {
    wall.normal[0].abs() > 0.5
}

/// As [`super::prepare`], for a bed of tiles of about `length` (m): as many as fit the box best. A number of grains is brought to that
/// of whole tiles.
///
/// # Errors
/// As [`super::prepare`]; a tile too short for its grains, or longer than the box.
pub fn prepare_tiled(
    setup: Setup,
    recipe: &Recipe,
    length: f64,
    threads: usize,
    progress: Progress,
) -> Result<(CpuEngine, BedReport), DemError> {
    let s = &recipe.sample;
    let greatest = recipe.others.iter().map(|o| o.radii.range().1).fold(s.radii.range().1, f64::max);
    let least = super::period::LEAST * greatest;
    if !(length >= least && length <= s.length) {
        let allowed = format!("{least} m (six greatest diameters) to the length of the box, {} m", s.length);
        return Err(DemError::parameter("length of a tile", length, allowed));
    }
    let tiles = (s.length / length).round().max(1.0);
    let length = s.length / tiles;
    let kept: Vec<u32> = (0_u32..).zip(&setup.walls).filter(|(_, w)| !is_end(w)).map(|(k, _)| k).collect();
    let walls = kept.iter().map(|&k| setup.walls[k as usize]).collect();
    let box_of_tile = Setup { walls, period: Some(length), sleep: None, follow: None, ..setup.clone() };
    let fill = match s.fill {
        super::Fill::Count(n) => super::Fill::Count((n as f64 / tiles).round().max(1.0) as usize),
        depth @ super::Fill::Depth(_) => depth,
    };
    let mut of_tile = recipe.clone();
    (of_tile.sample.length, of_tile.sample.fill) = (length, fill);
    let adheres = super::material::PairTable::new(&setup.materials, &setup.overrides).any_adhesion();
    let new = |grains: &[super::Grain]| CpuEngine::new(box_of_tile.clone(), grains, threads);
    let (engine, made) = prepare_with(new, adheres, &of_tile, progress)?;
    let tile = Tile::of(&engine, length, &kept);

    let ends = [-0.5 * s.length, 0.5 * s.length];
    let (mut rows, mut ids) = (Vec::new(), Vec::new());
    for k in 0..tiles as u32 {
        let x = ends[0] + (f64::from(k) + 0.5) * length;
        for (row, id) in tile.lay(k, x, ends) {
            rows.push(row);
            ids.push(id);
        }
    }
    let mut state = DemState::of(&[], setup.walls.len());
    state.force = vec![[0.0; 3]; rows.len()];
    (state.rows, state.ids, state.adhesion_scale) = (rows, ids, engine.state().adhesion_scale);
    state.longest_offset = engine.state().longest_offset;
    (state.time, state.steps) = (engine.state().time, engine.state().steps);
    drop(engine);
    state.tile = Some(Box::new(tile));
    let mut engine = CpuEngine::with_state(setup, state, threads)?;
    engine.rebuild_now()?;
    engine.remember_tiles(0);
    let until = Settle { least_time: LEAST_TIME.min(recipe.settle.least_time), ..recipe.settle };
    let done = settle(&mut engine, &until, "settling the tiles", progress)?;
    engine.open_energy_account();
    let height = Surface::of(engine.state(), s.length, s.width).mean();
    let grains = engine.state().rows.len();
    let report = BedReport { grains, height, time: made.time + done.time, energy: done.energy, ..made };
    Ok((engine, report))
}
