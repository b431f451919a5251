//! A bed that repeats itself along x.
//!
//! With [`Setup::period`](super::Setup::period) L the box has no ends: what leaves at L/2 comes in at -L/2, and grains of the last layer of
//! cells touch the *images* of the first layer, one length further on. Images stand behind the grains in the lists: place N + p is the
//! image of place p. What acts on an image acts on its grain. It is what beds are settled in that are laid like tiles
//! ([`super::tile`]); there are no bodies in them, and nothing sleeps.

use super::grains::{R, Row, X0};
use super::grid::Grid;
use super::slab::Slab;
use super::vec3::Vec3;
use std::borrow::Cow;

/// Brings a grain back between the ends.
pub(super) fn wrap(row: &mut Row, length: f64) {
    // Not more than one length away: a grain that is has no place at all, and is told of as escaped or not finite.
    if row[0] >= 0.5 * length {
        row[0] -= length;
    } else if row[0] < -0.5 * length {
        row[0] += length;
    }
}

/// The first `count` grains, one length further on.
pub(super) fn images(rows: &[Row], count: u32, length: f64) -> Vec<Row> {
    rows[..count as usize]
        .iter()
        .map(|r| {
            let mut image = *r;
            image[0] += length;
            image[X0] += length;
            image
        })
        .collect()
}

/// The grains of a slab and its halo, images or ghosts included.
pub(super) fn rows_of<'a>(rows: &'a [Row], slab: &Slab, period: Option<f64>, ghosts: &[Row]) -> Cow<'a, [Row]> {
    let (first, halo) = (slab.first as usize, slab.halo as usize);
    match period {
        Some(length) if halo > rows.len() => {
            Cow::Owned([&rows[first..], &images(rows, (halo - rows.len()) as u32, length)[..]].concat())
        }
        None if halo > rows.len() => {
            Cow::Owned([&rows[first..], &ghosts[..(halo - rows.len()).min(ghosts.len())]].concat())
        }
        _ => Cow::Borrowed(&rows[first..halo]),
    }
}

impl Grid {
    /// A grid whose layers along x fill the length exactly, from -length/2 on; cells of at least `size` along x.
    pub(super) fn periodic(low: Vec3, high: Vec3, size: f64, length: f64) -> Self {
        let layers = ((length / size) as usize).max(1);
        let along = |k: usize| (((high[k] - low[k]) / size) as usize).min(1 << 12) + 1;
        let cell = length / layers as f64;
        // Cubes: as high and wide as they are long.
        let across = |k: usize| (along(k) as f64 * size / cell).ceil() as usize;
        Self { origin: [-0.5 * length, low[1], low[2]], size: cell, n: [layers, across(1), across(2)] }
    }
}

/// Least length in grains' radii: a layer has other layers on both sides.
pub const LEAST: f64 = 12.0;

/// Greatest radius (m).
pub(super) fn greatest(rows: &[Row]) -> f64 {
    rows.iter().fold(0.0, |m, r| m.max(r[R]))
}
