//! A triangle mesh as a height field: the highest facet over a point.

use serde::{Deserialize, Serialize};
use terramech_mechanics::{TriangleMesh, Vec3};

/// The facets of a mesh that face up, in a grid over x and y.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Facets {
    mesh: TriangleMesh,
    /// Normals of the vertices, where they are blended.
    normals: Vec<[f64; 3]>,
    low: [f64; 2],
    cell: f64,
    count: [usize; 2],
    /// First entry of each cell in `list`, and the end.
    start: Vec<u32>,
    list: Vec<u32>,
}

/// Facets steeper than this (vertical part of the unit normal) are walls: they have no height.
const WALL: f64 = 1e-3;

impl Facets {
    /// Sorts a mesh into a grid. Facets may be wound either way; their upper side counts.
    ///
    /// # Errors
    /// A mesh with faulty vertices or indices, or without a facet that is not vertical.
    pub fn new(mesh: TriangleMesh, smooth: bool) -> Result<Self, String> {
        let count = mesh.vertices.len() as u32;
        if let Some(p) = mesh.vertices.iter().find(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(format!("vertex {p:?} is not finite"));
        }
        if let Some(t) = mesh.triangles.iter().find(|t| t.iter().any(|k| *k >= count)) {
            return Err(format!("triangle {t:?} names a vertex that is not there; there are {count}"));
        }
        let flat: Vec<u32> =
            (0..mesh.triangles.len() as u32).filter(|t| normal(&mesh, *t).is_some_and(|n| n.z > WALL)).collect();
        if flat.is_empty() {
            return Err("has no facet with an upper side".into());
        }
        let boxes: Vec<[[f64; 2]; 2]> = flat
            .iter()
            .map(|t| {
                let [a, b, c] = mesh.corners(*t as usize);
                [a.inf(&b).inf(&c), a.sup(&b).sup(&c)].map(|p| [p.x, p.y])
            })
            .collect();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for [a, b] in &boxes {
            for k in 0..2 {
                low[k] = low[k].min(a[k]);
                high[k] = high[k].max(b[k]);
            }
        }
        // About one facet a cell, and never more cells than some facets' worth.
        let area = (high[0] - low[0]).max(1e-6) * (high[1] - low[1]).max(1e-6);
        let cell = (area / flat.len() as f64).sqrt().max((high[0] - low[0]).max(high[1] - low[1]) / 4096.0).max(1e-6);
        let cells = [0, 1].map(|k| ((high[k] - low[k]) / cell) as usize + 1);
        let mut f = Self {
            normals: if smooth { vertex_normals(&mesh) } else { Vec::new() },
            mesh,
            low,
            cell,
            count: cells,
            start: vec![0; cells[0] * cells[1] + 1],
            list: Vec::new(),
        };
        let mut entries: Vec<(u32, u32)> = Vec::new();
        for (t, [a, b]) in flat.iter().zip(&boxes) {
            let (from, to) = (f.place(a[0], a[1]), f.place(b[0], b[1]));
            for i in from[0]..=to[0] {
                for j in from[1]..=to[1] {
                    entries.push(((i * f.count[1] + j) as u32, *t));
                }
            }
        }
        entries.sort_unstable();
        for (c, t) in entries {
            f.start[c as usize + 1] += 1;
            f.list.push(t);
        }
        for k in 1..f.start.len() {
            f.start[k] += f.start[k - 1];
        }
        Ok(f)
    }

    /// The cell of a point, the nearest one outside.
    fn place(&self, x: f64, y: f64) -> [usize; 2] {
        // The cast takes what is negative to 0.
        [(x, 0), (y, 1)].map(|(p, k)| (((p - self.low[k]) / self.cell) as usize).min(self.count[k] - 1))
    }

    /// Height and upward unit normal of the highest facet over the point, if there is one.
    pub fn at(&self, x: f64, y: f64) -> Option<(f64, Vec3)> {
        let [i, j] = self.place(x, y);
        let c = i * self.count[1] + j;
        let mut best: Option<(f64, u32, [f64; 3])> = None;
        for &t in &self.list[self.start[c] as usize..self.start[c + 1] as usize] {
            let [p, q, r] = self.mesh.corners(t as usize);
            let area = (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
            let u = ((q.x - x) * (r.y - y) - (q.y - y) * (r.x - x)) / area;
            let v = ((r.x - x) * (p.y - y) - (r.y - y) * (p.x - x)) / area;
            let w = 1.0 - u - v;
            // A point on an edge belongs to both sides: without the allowance round-off would leave cracks.
            if u >= -1e-9 && v >= -1e-9 && w >= -1e-9 {
                let z = u * p.z + v * q.z + w * r.z;
                if best.is_none_or(|b| z > b.0) {
                    best = Some((z, t, [u, v, w]));
                }
            }
        }
        let (z, t, b) = best?;
        let own = normal(&self.mesh, t)?;
        if self.normals.is_empty() {
            return Some((z, own));
        }
        let k = self.mesh.triangles[t as usize];
        let n: Vec3 = (0..3).map(|i| Vec3::from(self.normals[k[i] as usize]) * b[i]).sum();
        Some((z, if n.z > WALL { n.normalize() } else { own }))
    }

    /// Lowest and highest vertex.
    pub fn range(&self) -> [f64; 2] {
        self.mesh.bounds().map_or([0.0; 2], |[a, b]| [a.z, b.z])
    }
}

/// Unit normal of a facet, its upper side; `None` without area.
fn normal(mesh: &TriangleMesh, t: u32) -> Option<Vec3> {
    let [a, b, c] = mesh.corners(t as usize);
    let n = (b - a).cross(&(c - a));
    let size = n.norm();
    (size > 0.0).then(|| if n.z < 0.0 { -n / size } else { n / size })
}

/// Means of the facets' normals by area.
fn vertex_normals(mesh: &TriangleMesh) -> Vec<[f64; 3]> {
    let mut sums = vec![Vec3::zeros(); mesh.vertices.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(t);
        let n = (b - a).cross(&(c - a));
        let up = if n.z < 0.0 { -n } else { n };
        corners.iter().for_each(|k| sums[*k as usize] += up);
    }
    sums.iter().map(|n| n.try_normalize(0.0).unwrap_or(Vec3::z()).into()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// z = 0.1 x over 0..4 by 0..2 in 40 x 20 quads, one diagonal wound the other way round.
    fn ramp() -> TriangleMesh {
        let mut m = TriangleMesh::default();
        for i in 0..=40 {
            for j in 0..=20 {
                m.vertices.push([0.1 * f64::from(i), 0.1 * f64::from(j), 0.01 * f64::from(i)]);
            }
        }
        for i in 0..40 {
            for j in 0..20 {
                let k = i * 21 + j;
                m.triangles.push([k, k + 21, k + 22]);
                m.triangles.push([k, k + 1, k + 22]);
            }
        }
        m
    }

    #[test]
    fn heights_and_normals_everywhere_and_nothing_outside() {
        for smooth in [false, true] {
            let f = Facets::new(ramp(), smooth).unwrap();
            for k in 0..2000 {
                let (x, y) = (4.0 * (f64::from(k) * 0.618).fract(), 2.0 * (f64::from(k) * 0.327).fract());
                let (z, n) = f.at(x, y).unwrap_or_else(|| panic!("a crack at {x}, {y}"));
                assert!((z - 0.1 * x).abs() < 1e-12);
                assert!((n - Vec3::new(-0.1, 0.0, 1.0).normalize()).norm() < 1e-12);
            }
            assert!(f.at(4.2, 1.0).is_none() && f.at(1.0, -0.1).is_none());
            assert!(f.at(0.5, 0.5).is_some() && f.at(4.0, 2.0).is_some(), "nodes and corners");
        }
    }

    #[test]
    fn the_highest_facet_counts_and_walls_have_no_height() {
        let mut m = ramp();
        let n = m.vertices.len() as u32;
        m.vertices.extend([[1.0, 0.5, 2.0], [2.0, 0.5, 2.0], [1.5, 1.5, 2.0], [1.5, 1.0, 3.0]]);
        m.triangles.extend([[n, n + 1, n + 2], [n, n + 1, n + 3]]);
        let f = Facets::new(m, false).unwrap();
        assert_eq!(f.at(1.5, 1.4).unwrap().0, 2.0);
        let wall =
            TriangleMesh { vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], triangles: vec![[0, 1, 2]] };
        assert!(Facets::new(wall, false).unwrap_err().contains("upper side"));
    }
}
