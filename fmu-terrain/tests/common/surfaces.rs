//! Meshes for tests of contact: sheets, folds, pseudo-random numbers.
#![allow(dead_code)]

use fmu_terrain::dem::vec3::Vec3;
use terramech_mechanics::TriangleMesh;

/// A fixed pseudo-random sequence.
pub struct Noise(pub u64);

impl Noise {
    /// Between -1 and 1.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Each between -1 and 1.
    pub fn vector(&mut self) -> Vec3 {
        [self.next(), self.next(), self.next()]
    }
}

/// A sheet over (s, t) in -1..1, as `n` x `m` quads of two triangles with alternating diagonals.
pub fn sheet(n: u32, m: u32, place: impl Fn(f64, f64) -> Vec3) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for i in 0..=n {
        for j in 0..=m {
            let at = |k: u32, n: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
            mesh.vertices.push(place(at(i, n), at(j, m)));
        }
    }
    let at = |i: u32, j: u32| i * (m + 1) + j;
    for i in 0..n {
        for j in 0..m {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if (i + j) % 2 == 0 {
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                mesh.triangles.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    mesh
}

/// Two half plates that meet at x = 0 under the angle `fold` (rad), raised on both sides for a positive one.
pub fn folded(fold: f64) -> TriangleMesh {
    let (sin, cos) = (0.5 * fold).sin_cos();
    sheet(4, 4, |s, t| [0.04 * s * cos, 0.02 * t, 0.04 * s.abs() * sin])
}
