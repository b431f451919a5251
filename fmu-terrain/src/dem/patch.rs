//! A moving patch: soil that has been driven over is taken away behind, and laid anew in front.
//!
//! The box is a bed of tiles ([`super::tile`]). When a body that is driven comes nearer to the foremost tile than the buffer, the whole box
//! moves on by one tile: the grains of the hindmost tile's length are taken away, and two tiles are laid in front, one in the place of
//! the foremost, whose end has slumped against the wall. Both are as the tile was settled. The box stays where it is when a body
//! is over what would be taken away. It moves along +x only.
//!
//! Kinetic, potential and elastic energy of what is taken away and laid are kept out of the account of dissipated energy.

use super::body::Body;
use super::engine::CpuEngine;
use super::error::DemError;
use super::grains::{DemState, R};
use super::memories::Memories;
use super::tile::{Tile, is_end};
use super::vec3::Vec3;
use super::wall::Wall;

impl DemState {
    /// How far the box has moved along x (m).
    pub fn moved(&self) -> f64 {
        self.tile.as_ref().map_or(0.0, |t| f64::from(self.tiles_moved) * t.length)
    }
}

/// The walls of a setup, ends moved on by `x` (m).
pub(super) fn walls(of: &[Wall], x: f64) -> Vec<Wall> {
    let moved = |w: &Wall| {
        let mut w = *w;
        w.point[0] += if is_end(&w) { x } else { 0.0 };
        w
    };
    of.iter().map(moved).collect()
}

impl CpuEngine {
    /// Moves the box on where a body that is driven is near its front; whether it did.
    pub(super) fn follow(&mut self, bodies: &mut [Body]) -> Result<bool, DemError> {
        let (Some(buffer), Some(tile)) = (self.setup.follow, &self.state.tile) else { return Ok(false) };
        let length = tile.length;
        let Some([back, front]) = self.ends() else { return Ok(false) };
        let mut reach = [f64::INFINITY, f64::NEG_INFINITY];
        for body in &mut *bodies {
            if body.shape.as_free().is_some() {
                continue;
            }
            let [low, high] = body.shape.bounds();
            if (0..3).all(|c| low[c] <= high[c]) {
                reach = [reach[0].min(low[0]), reach[1].max(high[0])];
            }
        }
        let near = reach[1] > front - length - buffer;
        if !near || !reach[0].is_finite() || reach[0] < back + 1.5 * length {
            return Ok(false);
        }
        self.move_on(bodies, [back + length, front + length])?;
        Ok(true)
    }

    /// Where the walls at the ends are (m).
    pub(super) fn ends(&self) -> Option<[f64; 2]> {
        let end = |side: f64| self.walls.iter().find(|w| w.normal[0] * side > 0.5).map(|w| w.point[0]);
        Some([end(1.0)?, end(-1.0)?])
    }

    /// See [`Tile::remember`].
    pub(super) fn remember_tiles(&mut self, fresh: u32) {
        if let Some(tile) = self.state.tile.take() {
            tile.remember(&mut self.state, fresh);
            self.state.tile = Some(tile);
        }
    }

    fn move_on(&mut self, bodies: &[Body], ends: [f64; 2]) -> Result<(), DemError> {
        let before = self.state.energy_account.map(|_| self.energy(bodies));
        let memories = Memories::of(&self.state.slabs, &self.state.ids);
        let state = &mut self.state;
        let Some(tile) = state.tile.take() else { return Ok(()) };
        let Tile { length, rows: grains, .. } = &*tile;
        let (count, greatest) = (grains.len() as u32, super::period::greatest(grains));
        // The foremost tile, and where its place begins.
        let tiles = ((ends[1] - ends[0]) / length).round() as u32;
        let foremost = state.tiles_moved + tiles - 1;
        let begin = ends[1] - 2.0 * length;
        let stays = |row: &super::grains::Row, id: u32| {
            row[0] - row[R] >= ends[0] && id / count < foremost && row[0] + row[R] < begin + 2.0 * greatest
        };
        let mut place = 0;
        let keep: Vec<bool> = state.rows.iter().zip(&state.ids).map(|(r, id)| stays(r, *id)).collect();
        let mut kept = || {
            place += 1;
            keep[place - 1]
        };
        state.rows.retain(|_| kept());
        let mut with = keep.iter();
        state.ids.retain(|_| with.next().is_some_and(|k| *k));
        let mut with = keep.iter();
        state.force.retain(|_| with.next().is_some_and(|k| *k));
        for (number, x) in [(foremost, begin + 0.5 * length), (foremost + 1, begin + 1.5 * length)] {
            for (row, id) in tile.lay(number, x, ends) {
                state.rows.push(row);
                state.ids.push(id);
                state.force.push([0.0; 3] as Vec3);
            }
        }
        state.tiles_moved += 1;
        state.tile = Some(tile);
        state.slabs.clear();
        self.walls = walls(&self.setup.walls, self.state.moved());
        self.rebuild("soil has come into the place where new soil is laid: take a larger buffer", None)?;
        let walls = std::mem::take(&mut self.walls);
        // The ends have moved away from what they touched.
        let stays = |wall: u32| !is_end(&walls[wall as usize]);
        let DemState { ids, slabs, .. } = &mut self.state;
        slabs.iter_mut().for_each(|s| memories.give(s, ids, stays));
        self.walls = walls;
        self.remember_tiles(foremost);
        if let (Some(before), Some([energy, _])) = (before, self.state.energy_account) {
            let change = self.energy(bodies) - before;
            if let Some(account) = &mut self.state.energy_account {
                account[0] = energy + change;
            }
        }
        Ok(())
    }
}
