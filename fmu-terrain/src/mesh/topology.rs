//! How the facets of a mesh hang together: built once, as long as the triangles stay the same.

use super::body::MeshError;
use std::collections::BTreeMap;
use terramech_mechanics::TriangleMesh;

/// Edges and corners that facets share.
///
/// Vertices at the same place when the mesh is first given are one corner here (a mesh file may repeat them along a
/// seam): otherwise a grain on the seam would touch twice. Forces still go to the vertices of the facet itself.
#[derive(Clone, Debug, Default)]
pub struct Topology {
    /// Vertices of each facet.
    pub triangles: Vec<[u32; 3]>,
    /// Number of the edge at each side of each facet; side k runs from corner k to corner k + 1.
    pub edges: Vec<[u32; 3]>,
    /// The facets at each edge; a boundary edge names its only facet twice.
    pub edge_facets: Vec<[u32; 2]>,
    /// Every edge has two facets: the mesh bounds a volume and has an inside.
    pub closed: bool,
    corner_start: Vec<u32>,
    corner_facets: Vec<u32>,
    corner_of: Vec<u32>,
}

impl Topology {
    /// Checks the mesh and finds what its facets share.
    ///
    /// # Errors
    /// [`MeshError::Faulty`] with every fault of the mesh (an open mesh is none; one wound inward is).
    pub fn new(mesh: &TriangleMesh) -> Result<Self, MeshError> {
        let mut by_place: BTreeMap<[u64; 3], u32> = BTreeMap::new();
        // + 0.0 makes one of -0.0 and 0.0.
        let corner_of: Vec<u32> = (0u32..)
            .zip(&mesh.vertices)
            .map(|(k, p)| *by_place.entry(p.map(|x| (x + 0.0).to_bits())).or_insert(k))
            .collect();
        let report = mesh.check();
        if !report.is_sound() {
            return Err(MeshError::Faulty(report.to_string()));
        }
        let welded = TriangleMesh {
            vertices: mesh.vertices.clone(),
            triangles: mesh.triangles.iter().map(|t| t.map(|v| corner_of[v as usize])).collect(),
        };
        let report = welded.check();
        if !report.is_sound() {
            return Err(MeshError::Faulty(report.to_string()));
        }
        let mut numbers: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut edge_facets: Vec<[u32; 2]> = Vec::new();
        let mut edges = Vec::with_capacity(welded.triangles.len());
        let mut corner_count = vec![0u32; mesh.vertices.len() + 1];
        for (t, tri) in (0u32..).zip(&welded.triangles) {
            edges.push(std::array::from_fn(|k| {
                let (p, q) = (tri[k], tri[(k + 1) % 3]);
                let next = edge_facets.len() as u32;
                let number = *numbers.entry([p.min(q), p.max(q)]).or_insert(next);
                if number == next {
                    edge_facets.push([t, t]);
                } else {
                    edge_facets[number as usize][1] = t;
                }
                number
            }));
            tri.iter().for_each(|&v| corner_count[v as usize + 1] += 1);
        }
        for k in 1..corner_count.len() {
            corner_count[k] += corner_count[k - 1];
        }
        let mut corner_facets = vec![0u32; 3 * welded.triangles.len()];
        let mut next = corner_count.clone();
        for (t, tri) in (0u32..).zip(&welded.triangles) {
            for &v in tri {
                corner_facets[next[v as usize] as usize] = t;
                next[v as usize] += 1;
            }
        }
        Ok(Self {
            triangles: mesh.triangles.clone(),
            edges,
            edge_facets,
            closed: report.is_closed(),
            corner_start: corner_count,
            corner_facets,
            corner_of,
        })
    }

    /// The facets around vertex `v`, ascending.
    pub fn around(&self, v: u32) -> &[u32] {
        let c = self.corner_of[v as usize] as usize;
        &self.corner_facets[self.corner_start[c] as usize..self.corner_start[c + 1] as usize]
    }

    /// The number of the corner at which vertex `v` lies.
    pub fn corner(&self, v: u32) -> u32 {
        self.corner_of[v as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terramech_mechanics::cylinder::Cylinder;

    #[test]
    fn a_closed_wheel() {
        let mesh = Cylinder::smooth(0.1, 0.05, 24).mesh().unwrap();
        let t = Topology::new(&mesh).unwrap();
        assert!(t.closed && t.edge_facets.len() * 2 == mesh.triangles.len() * 3);
        for v in 0..mesh.vertices.len() as u32 {
            assert!(t.around(v).iter().all(|&f| t.triangles[f as usize].contains(&v)));
            assert!(t.around(v).len() >= 4);
        }
    }

    #[test]
    fn a_seam_of_repeated_vertices_is_closed_all_the_same() {
        let mut mesh = Cylinder::smooth(0.1, 0.05, 24).mesh().unwrap();
        let split: Vec<[f64; 3]> = mesh.triangles.iter().flat_map(|t| t.map(|v| mesh.vertices[v as usize])).collect();
        mesh.triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        mesh.vertices = split;
        assert!(Topology::new(&mesh).unwrap().closed);
    }
}
