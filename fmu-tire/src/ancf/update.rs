//! Solves with a kept factor whose contacts have changed since: a correction of low rank.
//!
//! A node that touches or leaves the ground changes a 3 x 3 block that is as stiff as its own inertia `m/(beta h^2)`, and Newton on the kept
//! factor then diverges; nothing else changes as fast. With `K = K0 + U C U'`,
//! `x = y - Z (1 + C U'Z)^-1 C U'y`, `y = K0^-1 b`, `Z = K0^-1 U`. The columns of `Z` are kept with the factor: a wheel that rolls in the
//! factor's frame meets the same few nodes again and again. `C` need not be symmetric.

use super::assembly::Assembly;
use super::mesh::NODE;
use nalgebra::{DMatrix, DVector, Matrix3};
use std::collections::BTreeMap;

/// A block counts as changed beyond this share of the largest one.
const CHANGED: f64 = 0.05;
/// With more changed nodes, a new factor is cheaper.
const MOST: usize = 64;

/// Blocks in the kept factor, and what is known of its inverse.
#[derive(Debug, Clone, Default)]
pub struct Update {
    base: BTreeMap<u32, Matrix3<f64>>,
    columns: BTreeMap<u32, [Vec<f64>; 3]>,
}

impl Update {
    /// A new factor, that holds these blocks (by block of the free system).
    pub fn reset(&mut self, base: BTreeMap<u32, Matrix3<f64>>) {
        self.base = base;
        self.columns.clear();
    }

    /// Solves in place with the kept factor corrected to hold the blocks `now` (in the factor's frame). Returns whether the correction
    /// was possible; if not, the solution is that of the factor alone.
    pub fn solve(&mut self, assembly: &mut Assembly, now: &BTreeMap<u32, Matrix3<f64>>, x: &mut [f64]) -> bool {
        let largest = self.base.values().chain(now.values()).map(Matrix3::amax).fold(0.0, f64::max);
        let zero = Matrix3::zeros();
        let mut changed: Vec<(u32, Matrix3<f64>)> = Vec::new();
        for block in self.base.keys().chain(now.keys().filter(|k| !self.base.contains_key(k))) {
            let delta = now.get(block).unwrap_or(&zero) - self.base.get(block).unwrap_or(&zero);
            if delta.amax() > CHANGED * largest {
                changed.push((*block, delta));
            }
        }
        assembly.solve(x);
        if changed.is_empty() || changed.len() > MOST {
            return changed.is_empty();
        }
        changed.sort_unstable_by_key(|c| c.0);
        for (block, _) in &changed {
            self.columns.entry(*block).or_insert_with(|| {
                std::array::from_fn(|k| {
                    let mut column = vec![0.0; x.len()];
                    column[NODE * *block as usize + k] = 1.0;
                    assembly.solve(&mut column);
                    column
                })
            });
        }
        let m = 3 * changed.len();
        let (mut matrix, mut right) = (DMatrix::<f64>::identity(m, m), DVector::<f64>::zeros(m));
        for (i, (row, delta)) in changed.iter().enumerate() {
            let first = NODE * *row as usize;
            let own = delta * nalgebra::Vector3::from_column_slice(&x[first..first + 3]);
            right.fixed_rows_mut::<3>(3 * i).copy_from(&own);
            for (j, (column, _)) in changed.iter().enumerate() {
                let z = &self.columns[column];
                let g = Matrix3::from_fn(|r, c| z[c][first + r]);
                let mut target = matrix.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                target += delta * g;
            }
        }
        let Some(w) = matrix.lu().solve(&right) else {
            return false;
        };
        for (i, (block, _)) in changed.iter().enumerate() {
            for k in 0..3 {
                let factor = w[3 * i + k];
                x.iter_mut().zip(&self.columns[block][k]).for_each(|(x, z)| *x -= factor * z);
            }
        }
        true
    }
}
