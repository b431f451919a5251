//! Grains as rows of 16 reals, and the whole state of a bed.
//!
//! One row is two cache lines, and begins where one does: all that a contact reads of a grain comes in one piece, and the
//! vector kernels load and transpose rows without gathers. Rows lie in *canonical order*: by cell of the neighbour grid, x slowest,
//! then by grain number. The order follows from the state alone (positions at the last rebuild), never from threads.

use super::contact::Slip;
use super::grid::Grid;
use super::slab::{Slab, bytes};
use super::tile::Tile;
use super::vec3::{Vec3, dot};
use serde::{Deserialize, Serialize};

/// A grain: position (0-2), radius (3), velocity (4-6), 1/mass (7), angular velocity (8-10), material (11), position
/// at the last rebuild (12-14), 1/moment of inertia (15). A fixed grain has 1/mass = 0.
pub use terramech_simd::Row;

/// Radius (m).
pub const R: usize = 3;
/// First component of the velocity (m/s).
pub const V: usize = 4;
/// 1/mass (1/kg), 0 for a fixed grain.
pub const INV_M: usize = 7;
/// First component of the angular velocity (rad/s).
pub const W: usize = 8;
/// Material, an index as a real.
pub const MATERIAL: usize = 11;
/// First component of the position at the last rebuild (m).
pub const X0: usize = 12;
/// 1/moment of inertia (1/(kg m2)), 0 for a fixed grain.
pub const INV_I: usize = 15;

/// Three neighbouring entries of a row as a vector.
#[inline(always)]
pub fn vec_at(row: &Row, at: usize) -> Vec3 {
    [row[at], row[at + 1], row[at + 2]]
}

/// Kinetic energy of a free grain (J).
pub fn kinetic_energy(row: &Row) -> f64 {
    let (v, w) = (vec_at(row, V), vec_at(row, W));
    0.5 * dot(v, v) / row[INV_M] + 0.5 * dot(w, w) / row[INV_I]
}

/// A grain to be placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grain {
    /// Position of the centre (m).
    pub position: Vec3,
    /// Velocity (m/s).
    pub velocity: Vec3,
    /// Angular velocity (rad/s).
    pub angular_velocity: Vec3,
    /// Radius (m).
    pub radius: f64,
    /// Density (kg/m3).
    pub density: f64,
    /// Material index.
    pub material: usize,
    /// Held in place.
    pub fixed: bool,
}

impl Grain {
    /// A grain at rest, of material 0.
    pub fn at(position: Vec3, radius: f64, density: f64) -> Self {
        let zero = [0.0; 3];
        Self { position, velocity: zero, angular_velocity: zero, radius, density, material: 0, fixed: false }
    }

    /// Its row.
    pub fn row(&self) -> Row {
        let mass = self.density * 4.0 / 3.0 * std::f64::consts::PI * self.radius.powi(3);
        let inv_m = if self.fixed { 0.0 } else { 1.0 / mass };
        let [x, v, w] = [self.position, self.velocity, self.angular_velocity];
        let inv_i = inv_m * 2.5 / (self.radius * self.radius);
        Row([
            x[0],
            x[1],
            x[2],
            self.radius,
            v[0],
            v[1],
            v[2],
            inv_m,
            w[0],
            w[1],
            w[2],
            self.material as f64,
            x[0],
            x[1],
            x[2],
            inv_i,
        ])
    }
}

/// The whole state of a bed: plain data. A copy of it continues bit for bit.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct DemState {
    /// Steps done since the bed was made.
    pub steps: u64,
    /// Simulated time (s) (a sum over steps, since the step may change between settling and running).
    pub time: f64,
    /// Grains in canonical order.
    pub rows: Vec<Row>,
    /// Grain numbers in canonical order; 0 .. number of grains ever placed.
    pub ids: Vec<u32>,
    /// Net contact force on each grain at the end of the last communication step (N), canonical order.
    pub force: Vec<Vec3>,
    /// The neighbour grid of the last rebuild.
    pub grid: Grid,
    /// Regions with their pair lists and histories.
    pub slabs: Vec<Slab>,
    /// The lists must be rebuilt before the next step.
    pub stale: bool,
    /// Rebuilds done.
    pub rebuilds: u64,
    /// Factor on all adhesion, 0 to 1.
    pub adhesion_scale: f64,
    /// The longest offset that an overlap counted from when adhesion was let in ([`super::offset`]); 0: there is none (m).
    pub longest_offset: f64,
    /// Force on each wall at the last step (N).
    pub wall_force: Vec<Vec3>,
    /// Work done by bodies on grains since the start (J).
    pub body_work: f64,
    /// Energy (kinetic, potential, elastic) and body work when the account was opened (J).
    pub energy_account: Option<[f64; 2]>,
    /// What the bed was laid with, if it was ([`super::tile`]).
    pub tile: Option<Box<Tile>>,
    /// How many tiles the box has moved on ([`super::patch`]).
    pub tiles_moved: u32,
}

impl DemState {
    /// Grains as placed, within this many walls; lists are still to be made.
    pub fn of(grains: &[Grain], walls: usize) -> Self {
        Self {
            rows: grains.iter().map(Grain::row).collect(),
            ids: (0..grains.len() as u32).collect(),
            force: vec![[0.0; 3]; grains.len()],
            stale: true,
            adhesion_scale: 1.0,
            wall_force: vec![[0.0; 3]; walls],
            ..Self::default()
        }
    }

    /// Translational and rotational kinetic energy (J); fixed grains count nothing.
    pub fn kinetic_energy(&self) -> f64 {
        self.rows.iter().filter(|r| r[INV_M] > 0.0).map(kinetic_energy).sum()
    }

    /// Mass of all grains that are not fixed (kg).
    pub fn mass(&self) -> f64 {
        self.rows.iter().filter(|r| r[INV_M] > 0.0).map(|r| 1.0 / r[INV_M]).sum()
    }

    /// Contacts between grains.
    pub fn grain_contacts(&self) -> usize {
        self.slabs.iter().map(|s| s.slip.iter().filter(|h| h[3] != 0.0).count()).sum()
    }

    /// Contacts of grains with walls and bodies.
    pub fn boundary_contacts(&self) -> usize {
        self.slabs.iter().map(|s| s.walls.iter().filter(|w| w.slip[3] != 0.0).count() + s.bodies.len()).sum()
    }

    /// Wakes all slabs ([`super::sleep`]).
    pub fn wake(&mut self) {
        self.slabs.iter_mut().for_each(|s| s.asleep = false);
    }

    /// Share of the grains that sleep (1).
    pub fn asleep(&self) -> f64 {
        let count: usize = self.slabs.iter().filter(|s| s.asleep).map(|s| s.grains().len()).sum();
        count as f64 / self.rows.len().max(1) as f64
    }

    /// Forgets the histories of all contacts: for a state that another engine left, to which they mean something else.
    pub fn forget_contacts(&mut self) {
        self.wake();
        for s in &mut self.slabs {
            s.slip.fill(Slip::default());
            s.roll.fill([0.0; 3]);
            s.walls.iter_mut().for_each(|w| (w.slip, w.roll) = (Slip::default(), [0.0; 3]));
            s.bodies.clear();
        }
        self.longest_offset = 0.0;
    }

    /// Memory held (bytes).
    pub fn memory(&self) -> usize {
        bytes(&self.rows) + bytes(&self.ids) + bytes(&self.force) + self.slabs.iter().map(Slab::memory).sum::<usize>()
    }

    /// Indices of the rows, ordered by grain number: the order that does not change over a run.
    pub fn by_id(&self) -> Vec<u32> {
        let mut order: Vec<u32> = (0..self.ids.len() as u32).collect();
        order.sort_unstable_by_key(|&i| self.ids[i as usize]);
        order
    }

    /// FNV-1a over everything that the next steps depend on: equal states have equal hashes.
    pub fn hash(&self) -> u64 {
        let mut h = Fnv(0xcbf2_9ce4_8422_2325);
        h.word(self.steps);
        for (row, &id) in self.rows.iter().zip(&self.ids) {
            h.word(u64::from(id));
            row.iter().for_each(|x| h.word(x.to_bits()));
        }
        for s in &self.slabs {
            h.word(u64::from(s.first));
            if s.asleep {
                h.word(1);
            }
            s.other.iter().for_each(|&j| h.word(u64::from(j)));
            s.slip.iter().flat_map(|s| s.0).for_each(|x: f64| h.word(x.to_bits()));
            s.roll.iter().flatten().for_each(|x| h.word(x.to_bits()));
            for w in &s.walls {
                h.word(u64::from(w.grain));
                w.slip.iter().chain(&w.roll).for_each(|x| h.word(x.to_bits()));
            }
            for b in &s.bodies {
                h.word(u64::from(b.grain));
                b.slip.iter().chain(&b.roll).for_each(|x| h.word(x.to_bits()));
            }
        }
        h.0
    }
}

struct Fnv(u64);

impl Fnv {
    fn word(&mut self, w: u64) {
        for byte in w.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}
