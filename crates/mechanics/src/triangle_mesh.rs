//! Triangle meshes and their checks.

use crate::Vec3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// A surface of triangles. Counter-clockwise seen from outside: normals by the right-hand rule point outward.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TriangleMesh {
    /// Vertex positions (m).
    pub vertices: Vec<[f64; 3]>,
    /// Vertex indices of each triangle, counted from 0.
    pub triangles: Vec<[u32; 3]>,
}

/// One thing that is wrong with a mesh. Indices count from 0.
#[derive(Debug, Clone, PartialEq)]
pub enum MeshFault {
    /// There is no triangle.
    Empty,
    /// A coordinate is NaN or infinite.
    NotFinite {
        /// Index of the vertex.
        vertex: u32,
        /// Its position as given.
        position: [f64; 3],
    },
    /// A triangle names a vertex that does not exist.
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: u32,
        /// The vertex index given.
        vertex: u32,
        /// Number of vertices.
        count: u32,
    },
    /// A triangle has no area: a repeated vertex, or three vertices on a line.
    ZeroArea {
        /// Index of the triangle.
        triangle: u32,
        /// Its vertices.
        vertices: [u32; 3],
    },
    /// Two triangles run along an edge in the same direction: one of them is wound the other way round.
    InconsistentWinding {
        /// The edge, from vertex to vertex.
        edge: [u32; 2],
        /// The two triangles.
        triangles: [u32; 2],
    },
    /// More than two triangles share an edge.
    NonManifoldEdge {
        /// The edge, lower vertex first.
        edge: [u32; 2],
        /// How many triangles share it.
        count: u32,
    },
    /// A closed mesh is wound inward: its volume is negative.
    Inward {
        /// The signed volume (m3).
        volume: f64,
    },
}

impl fmt::Display for MeshFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "the mesh has no triangle"),
            Self::NotFinite { vertex, position } => {
                write!(f, "vertex {vertex}: position {position:?} is not finite")
            }
            Self::IndexOutOfRange { triangle, vertex, count } => {
                write!(f, "triangle {triangle}: vertex index {vertex}, allowed 0 to {}", i64::from(*count) - 1)
            }
            Self::ZeroArea { triangle, vertices } => write!(f, "triangle {triangle} {vertices:?} has no area"),
            Self::InconsistentWinding { edge: [a, b], triangles: [s, t] } => {
                write!(f, "triangles {s} and {t} both run from vertex {a} to {b}: one is wound the other way round")
            }
            Self::NonManifoldEdge { edge: [a, b], count } => {
                write!(f, "edge {a}-{b} is shared by {count} triangles, allowed 2")
            }
            Self::Inward { volume } => {
                write!(f, "the mesh is wound inward (signed volume {volume} m3): swap two vertices of every triangle")
            }
        }
    }
}

/// What [`TriangleMesh::check`] found: all faults at once, and the rim of an open mesh (which is no fault by itself).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshReport {
    /// Everything that is wrong, in order of triangles and edges.
    pub faults: Vec<MeshFault>,
    /// Edges that belong to one triangle only, in its direction, ascending.
    pub boundary_edges: Vec<[u32; 2]>,
    /// Where the ends of the first of them are (m).
    pub first_boundary: Option<[[f64; 3]; 2]>,
}

impl MeshReport {
    /// No fault.
    pub fn is_sound(&self) -> bool {
        self.faults.is_empty()
    }

    /// No fault and no boundary edge: the mesh bounds a volume, outward.
    pub fn is_closed(&self) -> bool {
        self.is_sound() && self.boundary_edges.is_empty()
    }
}

impl fmt::Display for MeshReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const SHOWN: usize = 20;
        for fault in self.faults.iter().take(SHOWN) {
            writeln!(f, "{fault}")?;
        }
        if self.faults.len() > SHOWN {
            writeln!(f, "and {} more faults", self.faults.len() - SHOWN)?;
        }
        if !self.boundary_edges.is_empty() {
            let [a, b] = self.boundary_edges[0];
            write!(
                f,
                "the mesh has a hole: {} boundary edges, which belong to one triangle only; the first is from vertex {} to vertex {} \
                 (counted from 1, as in an OBJ file)",
                self.boundary_edges.len(),
                a + 1,
                b + 1
            )?;
            match self.first_boundary {
                Some([p, q]) => writeln!(f, ", from {p:?} to {q:?} m")?,
                None => writeln!(f)?,
            }
        }
        Ok(())
    }
}

/// A triangle counts as without area if the sine of its smallest angle is below this: about 1e-10 of its longest edge
/// high. Its normal would be round-off.
const ZERO_AREA: f64 = 1e-10;

impl TriangleMesh {
    /// Vertex `k` as a vector. Panics if `k` is out of range, as indexing does.
    pub fn vertex(&self, k: u32) -> Vec3 {
        self.vertices[k as usize].into()
    }

    /// The three corners of triangle `t`.
    pub fn corners(&self, t: usize) -> [Vec3; 3] {
        self.triangles[t].map(|k| self.vertex(k))
    }

    /// Looks for every fault. Later checks skip triangles that earlier ones refused, so that one mistake is told once.
    pub fn check(&self) -> MeshReport {
        let mut faults = Vec::new();
        if self.triangles.is_empty() {
            faults.push(MeshFault::Empty);
        }
        for (k, p) in self.vertices.iter().enumerate() {
            if !p.iter().all(|x| x.is_finite()) {
                faults.push(MeshFault::NotFinite { vertex: k as u32, position: *p });
            }
        }
        let count = self.vertices.len() as u32;
        let mut edges: BTreeMap<[u32; 2], Vec<(u32, bool)>> = BTreeMap::new();
        let mut all_in_range = true;
        for (t, tri) in self.triangles.iter().enumerate() {
            let triangle = t as u32;
            if let Some(&vertex) = tri.iter().find(|&&k| k >= count) {
                faults.push(MeshFault::IndexOutOfRange { triangle, vertex, count });
                all_in_range = false;
                continue;
            }
            let [a, b, c] = self.corners(t);
            let longest = (b - a).norm_squared().max((c - a).norm_squared()).max((c - b).norm_squared());
            let twice_area = (b - a).cross(&(c - a)).norm();
            // NaN passes here: it has been told above.
            if twice_area <= ZERO_AREA * longest {
                faults.push(MeshFault::ZeroArea { triangle, vertices: *tri });
            }
            for s in 0..3 {
                let (p, q) = (tri[s], tri[(s + 1) % 3]);
                if p != q {
                    edges.entry([p.min(q), p.max(q)]).or_default().push((triangle, p < q));
                }
            }
        }
        let mut boundary_edges = Vec::new();
        for (&[p, q], users) in &edges {
            match users[..] {
                [(_, forward)] => boundary_edges.push(if forward { [p, q] } else { [q, p] }),
                [(s, a), (t, b)] if a == b => {
                    let edge = if a { [p, q] } else { [q, p] };
                    faults.push(MeshFault::InconsistentWinding { edge, triangles: [s, t] });
                }
                [_, _] => {}
                _ => faults.push(MeshFault::NonManifoldEdge { edge: [p, q], count: users.len() as u32 }),
            }
        }
        if faults.is_empty() && all_in_range && boundary_edges.is_empty() {
            let volume = self.signed_volume();
            if volume < 0.0 {
                faults.push(MeshFault::Inward { volume });
            }
        }
        boundary_edges.sort_unstable();
        let first_boundary = boundary_edges.first().map(|e| e.map(|k| self.vertices[k as usize]));
        MeshReport { faults, boundary_edges, first_boundary }
    }

    /// Volume enclosed by a closed mesh (m3), positive if it is wound outward.
    pub fn signed_volume(&self) -> f64 {
        // About the first vertex: far from the origin the products would cancel.
        let Some(o) = self.vertices.first().map(|p| Vec3::from(*p)) else { return 0.0 };
        (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t);
                (a - o).dot(&(b - o).cross(&(c - o))) / 6.0
            })
            .sum()
    }

    /// Smallest and largest corner of the box around all vertices, or `None` without vertices.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        let mut points = self.vertices.iter().map(|p| Vec3::from(*p));
        let first = points.next()?;
        Some(points.fold([first, first], |[lo, hi], p| [lo.inf(&p), hi.sup(&p)]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> TriangleMesh {
        TriangleMesh {
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        }
    }

    #[test]
    fn a_sound_closed_mesh() {
        let report = tetrahedron().check();
        assert!(report.is_closed(), "{report}");
        assert!((tetrahedron().signed_volume() - 1.0 / 6.0).abs() < 1e-15);
    }

    #[test]
    fn all_faults_at_once() {
        let mut mesh = tetrahedron();
        mesh.vertices.push([f64::NAN, 0.0, 0.0]);
        mesh.triangles.push([0, 1, 9]);
        mesh.triangles.push([1, 1, 2]);
        let text = mesh.check().to_string();
        for part in ["vertex 4", "vertex index 9, allowed 0 to 4", "triangle 5 [1, 1, 2] has no area"] {
            assert!(text.contains(part), "{part} missing in:\n{text}");
        }
    }

    #[test]
    fn winding_boundary_and_manifold() {
        let mut mesh = tetrahedron();
        mesh.triangles[3].swap(0, 1);
        assert!(mesh.check().faults.iter().all(|f| matches!(f, MeshFault::InconsistentWinding { .. })));
        assert_eq!(mesh.check().faults.len(), 3);
        let mut mesh = tetrahedron();
        mesh.triangles.pop();
        assert_eq!(mesh.check().boundary_edges, vec![[1, 3], [2, 1], [3, 2]]);
        let text = mesh.check().to_string();
        assert!(text.contains("vertex 2 to vertex 4") && text.contains("[0.0, 0.0, 1.0]"), "{text}");
        assert!(mesh.check().is_sound() && !mesh.check().is_closed());
        let mut mesh = tetrahedron();
        mesh.vertices.push([5.0; 3]);
        mesh.triangles.push([0, 1, 4]);
        assert!(mesh.check().faults.contains(&MeshFault::NonManifoldEdge { edge: [0, 1], count: 3 }));
        let mut mesh = tetrahedron();
        mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert!(matches!(mesh.check().faults[..], [MeshFault::Inward { .. }]));
    }
}
