//! Where grains are placed: on a jittered grid, densest packed, or at random with a least distance.
//!
//! | way | volume fraction at spacing 1 | what it is for |
//! |---|---|---|
//! | grid | 0.52 | the default: random enough once poured, and cheap |
//! | hexagonal closest | 0.74 | the densest bed, or a regular one |
//! | Poisson disk | about 0.3 | no direction at all; falls furthest |

use super::error::DemError;
use super::rng::Rng;
use super::sample::Sample;
use super::vec3::{Vec3, dot, norm, sub};
use serde::{Deserialize, Serialize};

/// How grains are placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Placing {
    /// One in each cell of a grid, at random within the cell.
    #[default]
    Grid,
    /// Hexagonal closest packing, layer over layer; jittered by what the spacing leaves.
    Hcp,
    /// At random, no two centres closer than the spacing (Bridson 2007, in three dimensions), the lowest ones kept.
    PoissonDisk,
}

/// Centres of `count` spheres of at most `greatest` radius (m), `pitch` apart, from the floor up; none for the grid, whose places
/// depend on each grain's own radius.
pub(super) fn places(s: &Sample, how: Placing, count: usize, greatest: f64, pitch: f64) -> Result<Vec<Vec3>, DemError> {
    match how {
        Placing::Grid => Ok(Vec::new()),
        Placing::Hcp => Ok(hcp(s, count, greatest, pitch)),
        Placing::PoissonDisk => poisson(s, count, greatest, pitch),
    }
}

fn hcp(s: &Sample, count: usize, greatest: f64, pitch: f64) -> Vec<Vec3> {
    let (row, layer) = (pitch * 0.75_f64.sqrt(), pitch * (2.0_f64 / 3.0).sqrt());
    // Two neighbours each jittered by less than half the play still do not touch.
    let play = 0.5 * (pitch - 2.0 * greatest) / 3.0_f64.sqrt();
    let low = [-0.5 * s.length + greatest + play, -0.5 * s.width + greatest + play];
    let high = [0.5 * s.length - greatest - play, 0.5 * s.width - greatest - play];
    let mut out = Vec::with_capacity(count);
    for k in 0.. {
        let before = out.len();
        let shift_y = if k % 2 == 0 { 0.0 } else { row / 3.0 };
        for j in 0.. {
            let y = low[1] + shift_y + row * f64::from(j);
            if y > high[1] {
                break;
            }
            let shift_x = 0.5 * pitch * f64::from((j + k) % 2);
            for i in 0.. {
                let x = low[0] + shift_x + pitch * f64::from(i);
                if x > high[0] {
                    break;
                }
                if out.len() == count {
                    return out;
                }
                let mut rng = Rng::new(s.seed ^ 0x4c50, out.len() as u64);
                let z = greatest + play + layer * f64::from(k);
                out.push([x, y, z].map(|c| c + play * rng.between(-1.0, 1.0)));
            }
        }
        if out.len() == before && k > 1 {
            // A box too narrow for a shifted row: the row that fits, over and over.
            let z = greatest + play + layer * f64::from(k);
            out.push([low[0].min(0.0), low[1].min(0.0), z]);
        }
    }
    out
}

fn poisson(s: &Sample, count: usize, greatest: f64, pitch: f64) -> Result<Vec<Vec3>, DemError> {
    let low = [-0.5 * s.length + greatest, -0.5 * s.width + greatest, greatest];
    let extent = [s.length - 2.0 * greatest, s.width - 2.0 * greatest];
    // Usual number of points in a volume; more height where it comes out short.
    let area = (extent[0] + pitch) * (extent[1] + pitch);
    let mut height = count as f64 * pitch.powi(3) / (0.6 * area) + 2.0 * pitch;
    for _ in 0..8 {
        let mut points = darts(s.seed, low, [extent[0], extent[1], height], pitch);
        if points.len() >= count {
            points.sort_by(|a, b| a[2].total_cmp(&b[2]).then(a[0].total_cmp(&b[0])));
            points.truncate(count);
            return Ok(points);
        }
        height *= 1.3;
    }
    Err(DemError::parameter("count", count, "fewer grains, or another way of placing them: the box is too narrow"))
}

/// Points in a box, none closer than `pitch` to another, until no more are found.
fn darts(seed: u64, low: Vec3, extent: Vec3, pitch: f64) -> Vec<Vec3> {
    const TRIES: usize = 20;
    let cell = pitch / 3.0_f64.sqrt();
    let n = extent.map(|e| (e.max(0.0) / cell) as usize + 1);
    let place = |p: Vec3| -> [usize; 3] { std::array::from_fn(|c| (((p[c] - low[c]) / cell) as usize).min(n[c] - 1)) };
    let index = |[x, y, z]: [usize; 3]| (x * n[1] + y) * n[2] + z;
    let mut taken = vec![u32::MAX; n[0] * n[1] * n[2]];
    let mut rng = Rng::new(seed ^ 0x5044, 0);
    let first: Vec3 = std::array::from_fn(|c| low[c] + if c == 2 { 0.0 } else { extent[c] * rng.unit() });
    let mut points = vec![first];
    taken[index(place(first))] = 0;
    let mut active = vec![0_u32];
    while !active.is_empty() {
        let k = ((rng.unit() * active.len() as f64) as usize).min(active.len() - 1);
        let from = points[active[k] as usize];
        let found = (0..TRIES).find_map(|_| {
            // A direction from the cube that lies in the ball, a distance from one to two pitches, uniform in volume.
            let d = loop {
                let d = [rng.between(-1.0, 1.0), rng.between(-1.0, 1.0), rng.between(-1.0, 1.0)];
                if (1e-6..=1.0).contains(&dot(d, d)) {
                    break d;
                }
            };
            let far = pitch * (1.0 + 7.0 * rng.unit()).cbrt() / norm(d);
            let p: Vec3 = std::array::from_fn(|c| from[c] + far * d[c]);
            let inside = (0..3).all(|c| p[c] >= low[c] && p[c] <= low[c] + extent[c].max(0.0));
            (inside && free(p, place(p), n, pitch, &taken, &points, &index)).then_some(p)
        });
        match found {
            Some(p) => {
                taken[index(place(p))] = points.len() as u32;
                active.push(points.len() as u32);
                points.push(p);
            }
            None => {
                active.swap_remove(k);
            }
        }
    }
    points
}

fn free(
    p: Vec3,
    at: [usize; 3],
    n: [usize; 3],
    pitch: f64,
    taken: &[u32],
    points: &[Vec3],
    index: &impl Fn([usize; 3]) -> usize,
) -> bool {
    let range = |c: usize| at[c].saturating_sub(2)..=(at[c] + 2).min(n[c] - 1);
    range(0).all(|x| {
        range(1).all(|y| {
            range(2).all(|z| {
                let k = taken[index([x, y, z])];
                k == u32::MAX || {
                    let d = sub(p, points[k as usize]);
                    dot(d, d) >= pitch * pitch
                }
            })
        })
    })
}
