//! The surface of a bed.
//!
//! *Height* is defined on square cells two mean diameters wide over the box: a cell's height is that of the highest point
//! of any grain whose centre lies in it, a cell without grains is at 0 (the floor). The height of the bed is the mean
//! over all cells; the height at a point that of its cell. A wheel rests on the tops of grains, so tops, not
//! centres, are what sinkage is measured from; a lone grain thrown up raises the mean by one cell's share only.

use super::grains::{DemState, R};
use super::vec3::{Vec3, norm, scale};

/// Heights over a box centred on the origin, or as far from it along x as it has moved.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    n: [usize; 2],
    low: [f64; 2],
    cell: [f64; 2],
    height: Vec<f64>,
}

impl Surface {
    /// The surface of a bed in a box of `length` along x and `width` along y (m).
    pub fn of(state: &DemState, length: f64, width: f64) -> Self {
        let rows = &state.rows;
        let mean = rows.iter().map(|r| r[R]).sum::<f64>() / rows.len().max(1) as f64;
        let along = |extent: f64| ((extent / (4.0 * mean)).floor() as usize).clamp(1, 1 << 12);
        let n = [along(length), along(width)];
        let cell = [length / n[0] as f64, width / n[1] as f64];
        let mut s = Self { n, low: [state.moved() - 0.5 * length, -0.5 * width], cell, height: vec![0.0; n[0] * n[1]] };
        for r in rows {
            if let Some(c) = s.cell_of(r[0], r[1]) {
                s.height[c] = s.height[c].max(r[2] + r[R]);
            }
        }
        s
    }

    fn cell_of(&self, x: f64, y: f64) -> Option<usize> {
        let along = |v: f64, k: usize| {
            let c = (v - self.low[k]) / self.cell[k];
            (c >= 0.0 && c <= self.n[k] as f64).then(|| (c as usize).min(self.n[k] - 1))
        };
        Some(along(x, 0)? * self.n[1] + along(y, 1)?)
    }

    /// Mean over all cells (m).
    pub fn mean(&self) -> f64 {
        self.height.iter().sum::<f64>() / self.height.len() as f64
    }

    /// Height at a point (m); none outside the box.
    pub fn at(&self, x: f64, y: f64) -> Option<f64> {
        self.cell_of(x, y).map(|c| self.height[c])
    }

    /// Upward unit normal at a point from the heights of neighbouring cells; none outside the box.
    pub fn normal(&self, x: f64, y: f64) -> Option<Vec3> {
        let c = self.cell_of(x, y)?;
        let (i, j) = (c / self.n[1], c % self.n[1]);
        let slope = |before: usize, after: usize, cells: usize, size: f64| {
            if cells == 0 { 0.0 } else { (self.height[after] - self.height[before]) / (cells as f64 * size) }
        };
        let (i0, i1) = (i.saturating_sub(1), (i + 1).min(self.n[0] - 1));
        let (j0, j1) = (j.saturating_sub(1), (j + 1).min(self.n[1] - 1));
        let sx = slope(i0 * self.n[1] + j, i1 * self.n[1] + j, i1 - i0, self.cell[0]);
        let sy = slope(i * self.n[1] + j0, i * self.n[1] + j1, j1 - j0, self.cell[1]);
        let up = [-sx, -sy, 1.0];
        Some(scale(1.0 / norm(up), up))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dem::grains::Grain;

    #[test]
    fn a_ramp_of_grains_has_its_height_and_normal() {
        let grains: Vec<_> = (0..400)
            .map(|i| {
                let (x, y) = ((f64::from(i % 20) - 9.5) * 0.02, (f64::from(i / 20) - 9.5) * 0.02);
                Grain::at([x, y, 0.2 + 0.1 * x], 0.01, 2500.0).row()
            })
            .collect();
        let state = DemState { rows: grains, ..DemState::default() };
        let s = Surface::of(&state, 0.4, 0.4);
        assert!((s.mean() - 0.211).abs() < 1e-12, "{}", s.mean());
        let n = s.normal(0.01, 0.01).unwrap();
        assert!((n[0] / n[2] + 0.1).abs() < 1e-12 && n[1] == 0.0);
        assert!(s.at(0.3, 0.0).is_none());
    }
}
