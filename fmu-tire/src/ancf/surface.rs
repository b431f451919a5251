//! The contact surface: what meets the ground, in the shells' coordinates.
//!
//! Every node is a vertex; the tops of lugs follow. A vertex lies at `r + z d` of its node. That is linear in the coordinates, so a force `f` on
//! it is `f` on the position and `z f` on the director, exactly, and no power is lost between surface and shells. Lugs have no mass and no
//! stiffness of their own: their mass belongs to the tread's layers.

use super::AncfError;
use super::mesh::{NODE, ShellMesh};
use super::spec::Lugs;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// A vertex of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// The node it moves with.
    pub node: u32,
    /// Distance from the node along its director, m.
    pub offset: f64,
}

/// The surface.
#[derive(Debug, Clone)]
pub struct Surface {
    nodes: usize,
    tops: Vec<Vertex>,
    /// Triangles, wound outward: two per element (of a lug's elements its top), then a strip between the beads that closes the surface, then
    /// the walls of lugs.
    pub triangles: Vec<[u32; 3]>,
    /// Reference area that belongs to each vertex, m2.
    pub areas: Vec<f64>,
}

/// Which lug stands on an element.
pub(super) struct LugPlan<'a> {
    lugs: &'a Lugs,
    pitch: usize,
    across: usize,
    /// Elements from the bead to the tread.
    wall: usize,
}

impl<'a> LugPlan<'a> {
    /// `wall`: elements from the bead to the tread, on one side.
    ///
    /// # Errors
    /// [`AncfError::Input`] if the lugs do not fit the mesh.
    pub(super) fn new(lugs: &'a Lugs, around: usize, across: usize, wall: usize) -> Result<Self, AncfError> {
        let mut faults = Vec::new();
        if !(lugs.height > 0.0 && lugs.height <= 0.2) {
            faults.push(format!("'lugs.height' is {}; allowed: positive, at most 0.2 m", lugs.height));
        }
        let count = lugs.count as usize;
        if count == 0 || !around.is_multiple_of(count) {
            faults.push(format!("'lugs.count' is {count}; allowed: a divisor of 'divisions' ({around})"));
        } else if !(1..around / count).contains(&(lugs.elements as usize)) {
            faults.push(format!(
                "'lugs.elements' is {}; allowed: at least 1, less than 'divisions'/'lugs.count' = {}",
                lugs.elements,
                around / count
            ));
        }
        if faults.is_empty() {
            Ok(Self { lugs, pitch: around / count, across, wall })
        } else {
            Err(AncfError::Input(faults))
        }
    }

    /// The lug on element (i, j), i around and j across.
    fn lug(&self, i: usize, j: usize) -> Option<(usize, usize)> {
        if j < self.wall || j >= self.across - self.wall {
            return None;
        }
        let side = usize::from(self.lugs.staggered && j >= self.across / 2);
        let i = i + side * (self.pitch / 2);
        let around = self.pitch * self.lugs.count as usize;
        (i % self.pitch < self.lugs.elements as usize).then_some((i % around / self.pitch, side))
    }
}

impl Surface {
    /// Of a tire's mesh, elements in the order (i, j).
    pub(super) fn new(mesh: &ShellMesh, around: usize, across: usize, lugs: Option<&LugPlan<'_>>) -> Self {
        let nodes = mesh.node_count();
        let (mut tops, mut known) = (Vec::new(), BTreeMap::new());
        let mut areas = vec![0.0; nodes];
        let mut triangles = Vec::with_capacity(2 * around * (across + 1));
        // Edges of each lug, as its top runs along them: walls stand where no other element of the lug runs back.
        let mut edges = BTreeMap::new();
        for (e, shell) in mesh.shells().iter().enumerate() {
            let lug = lugs.and_then(|plan| plan.lug(e / across, e % across).map(|id| (id, plan.lugs.height)));
            let corners = shell.nodes.map(|node| match lug {
                None => node,
                Some((id, offset)) => *known.entry((id, node)).or_insert_with(|| {
                    tops.push(Vertex { node, offset });
                    areas.push(0.0);
                    (nodes + tops.len() - 1) as u32
                }),
            });
            corners.iter().for_each(|&v| areas[v as usize] += 0.25 * mesh.kind(e).area);
            triangles.push([corners[0], corners[1], corners[2]]);
            triangles.push([corners[0], corners[2], corners[3]]);
            if let Some((id, _)) = lug {
                for k in 0..4 {
                    let (a, b) = (k, (k + 1) % 4);
                    edges.insert((id, shell.nodes[a], shell.nodes[b]), (corners[a], corners[b]));
                }
            }
        }
        let node = |i: usize, j: usize| ((i % around) * (across + 1) + j) as u32;
        for i in 0..around {
            let nodes = [node(i + 1, across), node(i, across), node(i, 0), node(i + 1, 0)];
            triangles.push([nodes[0], nodes[1], nodes[2]]);
            triangles.push([nodes[0], nodes[2], nodes[3]]);
        }
        for (&(id, a, b), &(top_a, top_b)) in &edges {
            if !edges.contains_key(&(id, b, a)) {
                triangles.push([a, b, top_b]);
                triangles.push([a, top_b, top_a]);
            }
        }
        Self { nodes, tops, triangles, areas }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.nodes + self.tops.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A vertex.
    #[inline]
    pub fn vertex(&self, k: usize) -> Vertex {
        if k < self.nodes { Vertex { node: k as u32, offset: 0.0 } } else { self.tops[k - self.nodes] }
    }

    /// Position (or velocity) of a vertex from the coordinates (or their rates).
    #[inline]
    pub fn at(&self, k: usize, x: &[f64]) -> Vector3<f64> {
        let Vertex { node, offset } = self.vertex(k);
        let x = &x[NODE * node as usize..][..NODE];
        if offset == 0.0 {
            // Also where a director is no number: a vertex without a lug does not know it.
            Vector3::new(x[0], x[1], x[2])
        } else {
            Vector3::new(x[0] + offset * x[3], x[1] + offset * x[4], x[2] + offset * x[5])
        }
    }

    /// All of them, x0, y0, z0, x1, ...
    pub fn all<'a>(&'a self, x: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        (0..self.len()).flat_map(|k| <[f64; 3]>::from(self.at(k, x)))
    }

    /// Adds a force on a vertex to the forces on the coordinates.
    #[inline]
    pub fn add(&self, k: usize, f: &[f64; 3], force: &mut [f64]) {
        let Vertex { node, offset } = self.vertex(k);
        let to = &mut force[NODE * node as usize..][..NODE];
        for c in 0..3 {
            to[c] += f[c];
            to[3 + c] += offset * f[c];
        }
    }
}
