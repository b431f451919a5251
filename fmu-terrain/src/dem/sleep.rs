//! Sleep: slabs far from every body, and calm, are left as they are.
//!
//! A slab that sleeps neither moves nor costs anything: its contacts are not computed, its grains are not sorted. To its neighbours
//! it is a heap of fixed grains. It falls asleep at a rebuild, when no body is nearer than a quarter more than the distance and its
//! grains have come to rest; their velocities, which are about nothing by then, are set to zero. It wakes in the very step in which
//! a body is nearer than the distance, when a grain comes into it, or when its neighbour flows. Contacts remember what they held, so
//! what wakes is in balance as it was.
//!
//! All of this follows from the state and the bodies, so no number of threads and no checkpoint changes a bit. What it does to the
//! forces on a wheel is measured by `fmu-terrain/tests/sleep.rs` and told in `docs/benchmarks/dem.md`. Distances are along x: slabs are
//! pieces of the bed along x. While no body is there, everything is awake; obstacles that sleep keep nothing awake.

use super::body::Body;
use super::grains::{DemState, INV_M, R, Row, V, W, kinetic_energy};
use super::slab::Slab;
use serde::{Deserialize, Serialize};

/// What may sleep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sleep {
    /// Distance along x from every body (m).
    pub distance: f64,
    /// Mean kinetic energy of the grains over m g r below which a slab is calm (1): 1e-4 is 5 mm/s for r 12 mm.
    pub energy: f64,
}

/// A slab sleeps only beyond this many times the distance: one at the limit would wake and sleep with every quiver of a body.
const BEYOND: f64 = 1.25;
/// A neighbour with this many times the limit's energy flows.
const FLOWS: f64 = 100.0;
/// A grain counts with at most this many times the limit's energy where a slab is judged calm: a few that roll about
/// between others, without being pressed, keep no slab awake.
const MOST: f64 = 20.0;
/// Steps between two looks for slabs that might sleep while nothing asks for a rebuild.
pub(super) const LOOK: u64 = 256;

/// Where bodies are along x: least and greatest (m).
pub(super) fn zones(bodies: &mut [Body]) -> Vec<[f64; 2]> {
    let mut zones = Vec::new();
    for body in bodies {
        if body.shape.as_free().is_some_and(|free| free.now.asleep) {
            continue;
        }
        let [low, high] = body.shape.bounds();
        if (0..3).all(|c| low[c] <= high[c]) {
            zones.push([low[0], high[0]]);
        }
    }
    zones
}

/// Distance of a slab from the nearest body (m); infinite without bodies.
fn distance(slab: &Slab, zones: &[[f64; 2]]) -> f64 {
    let gap = |z: &[f64; 2]| (z[0] - slab.extent[1]).max(slab.extent[0] - z[1]).max(0.0);
    zones.iter().map(gap).fold(f64::INFINITY, f64::min)
}

/// Wakes what a body has come near to.
pub(super) fn wake(state: &mut DemState, sleep: &Sleep, zones: &[[f64; 2]]) {
    for slab in state.slabs.iter_mut().filter(|s| s.asleep) {
        slab.asleep = distance(slab, zones) >= sleep.distance;
    }
}

/// Whether some slab that is awake might sleep now.
pub(super) fn drowsy(state: &DemState, sleep: &Sleep, zones: &[[f64; 2]], gravity: f64) -> bool {
    let far = |s: &&Slab| !s.asleep && distance(s, zones) >= BEYOND * sleep.distance;
    !zones.is_empty()
        && state.slabs.iter().filter(far).any(|s| energy(&state.rows[s.grains()], sleep, gravity)[0] <= 1.0)
}

/// How calm each slab is: see `energy`; what sleeps is at rest. Nothing while no body is there.
pub(super) fn energies(state: &DemState, sleep: &Sleep, zones: &[[f64; 2]], gravity: f64) -> Vec<[f64; 2]> {
    if zones.is_empty() {
        return Vec::new();
    }
    let of = |s: &Slab| if s.asleep { [0.0; 2] } else { energy(&state.rows[s.grains()], sleep, gravity) };
    state.slabs.iter().map(of).collect()
}

/// Lets slabs sleep and wake right after a rebuild, when their grains are where the lists were made. `beside`: the second of the [`energies`] before the first
/// slab and behind the last.
pub(super) fn settle(state: &mut DemState, sleep: &Sleep, zones: &[[f64; 2]], energies: &[[f64; 2]], beside: [f64; 2]) {
    if zones.is_empty() {
        return;
    }
    for k in 0..state.slabs.len() {
        let before = k.checked_sub(1).map_or(beside[0], |n| energies[n][1]);
        let behind = energies.get(k + 1).map_or(beside[1], |e| e[1]);
        let beside = behind > FLOWS || before > FLOWS;
        let slab = &mut state.slabs[k];
        if slab.asleep {
            slab.asleep = !beside;
        } else if !beside && energies[k][0] <= 1.0 && distance(slab, zones) >= BEYOND * sleep.distance {
            slab.asleep = true;
            for row in &mut state.rows[slab.grains()] {
                (0..3).for_each(|c| (row[V + c], row[W + c]) = (0.0, 0.0));
            }
        }
    }
}

/// Mean kinetic energy of grains over the limit, each counted with at most [`MOST`], and with at most a hundred times that.
fn energy(rows: &[Row], sleep: &Sleep, gravity: f64) -> [f64; 2] {
    let (mut sums, mut count) = ([0.0; 2], 0_u32);
    for r in rows.iter().filter(|r| r[INV_M] > 0.0) {
        let e = kinetic_energy(r) * r[INV_M] / (sleep.energy * gravity * r[R]);
        sums[0] += e.min(MOST);
        sums[1] += e.min(100.0 * MOST);
        count += 1;
    }
    sums.map(|s| s / f64::from(count.max(1)))
}
