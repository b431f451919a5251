//! Element work of a mesh, eight elements of one type at a time.

use super::kernel::{self, Loads};
use super::mesh::{NODE, ShellMesh};
use super::strain::COORDS;
use terramech_simd::{Kernel, Lanes, WIDTH};

/// Up to eight elements of one type.
#[derive(Debug, Clone, Copy)]
pub(super) struct Batch {
    pub kind: u32,
    /// Padded by repeating the last element; only the first `count` lanes are read back.
    pub elements: [u32; WIDTH],
    pub count: u32,
}

/// The element work of [`ShellMesh::forces`].
pub(super) struct BatchForces<'a> {
    pub mesh: &'a ShellMesh,
    pub batches: &'a [Batch],
    pub loads: &'a Loads,
    pub q: &'a [f64],
    pub v: &'a [f64],
    pub a: &'a [f64],
    pub buffer: &'a mut [[f64; WIDTH]],
}

impl Kernel for BatchForces<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (batch, target) in self.batches.iter().zip(self.buffer.chunks_exact_mut(2 * COORDS)) {
            let mut nodes = [[0; 4]; WIDTH];
            for lane in 0..WIDTH {
                nodes[lane] = self.mesh.shells[batch.elements[lane] as usize].nodes;
            }
            let (f, m) = kernel::force::<L>(
                &self.mesh.kinds[batch.kind as usize],
                self.loads,
                &gather_lanes(self.q, &nodes),
                &gather_lanes(self.v, &nodes),
                &gather_lanes(self.a, &nodes),
            );
            for c in 0..COORDS {
                f[c].store(&mut target[c]);
                m[c].store(&mut target[COORDS + c]);
            }
        }
    }
}

/// The element work of [`ShellMesh::momentum`].
pub(super) struct Momentum<'a> {
    pub mesh: &'a ShellMesh,
    pub q: &'a [f64],
    pub v: &'a [f64],
    pub about: &'a [f64; 3],
}

impl Kernel for Momentum<'_> {
    type Output = [[f64; 3]; 3];

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let mut sums = [[L::splat(0.0); 3]; 3];
        for batch in &self.mesh.batches {
            let mut nodes = [[0; 4]; WIDTH];
            let mut share = [0.0; WIDTH];
            for lane in 0..WIDTH {
                nodes[lane] = self.mesh.shells[batch.elements[lane] as usize].nodes;
                share[lane] = if lane < batch.count as usize { 1.0 } else { 0.0 };
            }
            let share = L::load(&share);
            let (mut x, u) = (gather_lanes::<L>(self.q, &nodes), gather_lanes::<L>(self.v, &nodes));
            for corner in 0..4 {
                for k in 0..3 {
                    x[NODE * corner + k] = x[NODE * corner + k] - L::splat(self.about[k]);
                }
            }
            let mass = &self.mesh.kinds[batch.kind as usize].mass;
            for i in 0..8 {
                let (mut p, mut first) = ([L::splat(0.0); 3], [L::splat(0.0); 3]);
                for j in 0..8 {
                    let m = L::splat(mass[i][j]);
                    for k in 0..3 {
                        p[k] = m.fma(u[3 * j + k], p[k]);
                        first[k] = m.fma(x[3 * j + k], first[k]);
                    }
                }
                let turn = super::strain::cross(&[x[3 * i], x[3 * i + 1], x[3 * i + 2]], &p);
                for k in 0..3 {
                    sums[1][k] = share.fma(turn[k], sums[1][k]);
                    if i % 2 == 0 {
                        sums[0][k] = share.fma(p[k], sums[0][k]);
                        sums[2][k] = share.fma(first[k], sums[2][k]);
                    }
                }
            }
        }
        let mut out = [[0.0; 3]; 3];
        for r in 0..3 {
            for k in 0..3 {
                let mut lanes = [0.0; WIDTH];
                sums[r][k].store(&mut lanes);
                for x in lanes {
                    out[r][k] += x;
                }
            }
        }
        out
    }
}

#[inline(always)]
fn gather_lanes<L: Lanes>(q: &[f64], nodes: &[[u32; 4]; WIDTH]) -> [L; COORDS] {
    let mut lanes = [[0.0; WIDTH]; COORDS];
    for lane in 0..WIDTH {
        for corner in 0..4 {
            let first = NODE * nodes[lane][corner] as usize;
            let source = &q[first..first + NODE];
            for k in 0..NODE {
                lanes[NODE * corner + k][lane] = source[k];
            }
        }
    }
    let mut out = [L::splat(0.0); COORDS];
    for c in 0..COORDS {
        out[c] = L::load(&lanes[c]);
    }
    out
}
