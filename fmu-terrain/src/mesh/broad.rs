//! The facets near a grain: a uniform grid of facet boxes.

use super::body::MeshBody;
use crate::dem::vec3::{Vec3, dot, sub};

/// A grid of cells over a body, each with the facets whose boxes touch it. Filled anew by [`Self::refit`] (a counting
/// sort over the facets: far cheaper than the grains' own neighbour search), and valid for the positions of that moment:
/// ask for a reach that is larger by what grains and mesh may move until the next refit.
#[derive(Clone, Debug, Default)]
pub struct FacetGrid {
    low: Vec3,
    high: Vec3,
    per_length: f64,
    n: [usize; 3],
    /// Facets of cell k: `facets[start[k]..start[k + 1]]`, ascending.
    start: Vec<u32>,
    facets: Vec<u32>,
    /// A sphere around each facet: middle of its box, and radius. Sorts out most of a cell before any facet is looked at.
    spheres: Vec<[f64; 4]>,
}

impl FacetGrid {
    /// Sorts the facets of `body` as it lies now, and makes this the position that [`MeshBody::drift`] reckons from.
    pub fn refit(&mut self, body: &mut MeshBody) {
        let m = body.triangles().len();
        self.spheres.clear();
        let (mut low, mut high, mut size) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], 0.0);
        for t in 0..m as u32 {
            let corners = body.corners(t);
            let (a, b) = facet_box(corners);
            let middle: Vec3 = std::array::from_fn(|k| 0.5 * (a[k] + b[k]));
            let radius2 = corners.iter().map(|&p| sub(p, middle)).map(|d| dot(d, d)).fold(0.0, f64::max);
            self.spheres.push([middle[0], middle[1], middle[2], radius2.sqrt()]);
            let mut longest = 0.0f64;
            for k in 0..3 {
                low[k] = low[k].min(a[k]);
                high[k] = high[k].max(b[k]);
                longest = longest.max(b[k] - a[k]);
            }
            size += longest / m as f64;
        }
        (self.low, self.high) = (low, high);
        // Cells as large as a facet's box, unless that needs many more cells than facets.
        let most = 16 * m + 64;
        let mut size = size.max(f64::MIN_POSITIVE);
        loop {
            self.per_length = 1.0 / size;
            self.n = std::array::from_fn(|k| (((high[k] - low[k]) / size) as usize).min(1 << 20) + 1);
            if self.n.iter().product::<usize>() <= most {
                break;
            }
            size *= 1.25;
        }
        let cells = self.n.iter().product::<usize>();
        self.start.clear();
        self.start.resize(cells + 2, 0);
        // Two passes, count and place; the counts are shifted by two so that placing turns them into starts.
        for t in 0..m as u32 {
            let (a, b) = facet_box(body.corners(t));
            self.over(a, b, |grid, cell| grid.start[cell + 2] += 1);
        }
        for k in 2..self.start.len() {
            self.start[k] += self.start[k - 1];
        }
        self.facets.clear();
        self.facets.resize(self.start[cells + 1] as usize, 0);
        for t in 0..m as u32 {
            let (a, b) = facet_box(body.corners(t));
            self.over(a, b, |grid, cell| {
                grid.facets[grid.start[cell + 1] as usize] = t;
                grid.start[cell + 1] += 1;
            });
        }
        body.mark();
    }

    fn cell(&self, p: Vec3, k: usize) -> usize {
        // The cast takes negative numbers and NaN to 0.
        (((p[k] - self.low[k]) * self.per_length) as usize).min(self.n[k] - 1)
    }

    /// Calls `f` for every cell that the box from `a` to `b` touches, in ascending order.
    fn over(&mut self, a: Vec3, b: Vec3, mut f: impl FnMut(&mut Self, usize)) {
        let from: [usize; 3] = std::array::from_fn(|k| self.cell(a, k));
        let to: [usize; 3] = std::array::from_fn(|k| self.cell(b, k));
        for i in from[0]..=to[0] {
            for j in from[1]..=to[1] {
                for k in from[2]..=to[2] {
                    f(self, (i * self.n[1] + j) * self.n[2] + k);
                }
            }
        }
    }

    /// The box around the body at the last refit: smallest and largest corner. Most grains of a bed are rejected by it.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (self.low, self.high)
    }

    /// Edge length of a cell (m): about the size of a facet.
    pub fn cell_size(&self) -> f64 {
        1.0 / self.per_length
    }

    /// Whether a grain at `c` may be within `reach` of the body's box.
    #[inline]
    pub fn may_reach(&self, c: Vec3, reach: f64) -> bool {
        (0..3).all(|k| c[k] + reach >= self.low[k] && c[k] - reach <= self.high[k])
    }

    /// Appends to `out`, ascending and once each, the facets whose bounding spheres are within `reach` (m) of `c`: all that
    /// are within `reach`, and some that are not. Where the body has moved since the last refit, add its
    /// [`MeshBody::drift`] to the reach.
    #[inline]
    pub fn near(&self, c: Vec3, reach: f64, out: &mut Vec<u32>) {
        if !self.may_reach(c, reach) || self.start.is_empty() {
            return;
        }
        let first = out.len();
        let from: [usize; 3] = std::array::from_fn(|k| self.cell(c.map(|x| x - reach), k));
        let to: [usize; 3] = std::array::from_fn(|k| self.cell(c.map(|x| x + reach), k));
        for i in from[0]..=to[0] {
            for j in from[1]..=to[1] {
                // A column of cells along z is one range of facets.
                let row = (i * self.n[1] + j) * self.n[2];
                let range = self.start[row + from[2]] as usize..self.start[row + to[2] + 1] as usize;
                for &t in &self.facets[range] {
                    let [x, y, z, radius] = self.spheres[t as usize];
                    let d = sub(c, [x, y, z]);
                    let far = reach + radius;
                    if dot(d, d) <= far * far {
                        out.push(t);
                    }
                }
            }
        }
        if out.len() == first {
            return;
        }
        out[first..].sort_unstable();
        let mut kept = first + 1;
        for k in first + 1..out.len() {
            if out[k] != out[kept - 1] {
                out[kept] = out[k];
                kept += 1;
            }
        }
        out.truncate(kept);
    }
}

fn facet_box(corners: [Vec3; 3]) -> (Vec3, Vec3) {
    let [a, b, c] = corners;
    (std::array::from_fn(|k| a[k].min(b[k]).min(c[k])), std::array::from_fn(|k| a[k].max(b[k]).max(c[k])))
}
