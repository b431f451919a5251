//! Loads on nodes from outside the shells.

use super::mesh::NODE;

/// A stiffness that a vertex of the surface feels.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Block {
    /// The node that the vertex moves with.
    pub node: u32,
    /// Distance of the vertex from it along the director, m.
    pub offset: f64,
    /// 3 x 3, N/m.
    pub stiffness: [[f64; 3]; 3],
}

/// A load on the nodes of a mesh.
pub trait External {
    /// Adds the force (6 per node: N, N m) at `scale` times full load. `time` in s.
    fn add_force(&self, scale: f64, time: f64, q: &[f64], v: &[f64], force: &mut [f64]);

    /// Appends `stiffness x (-df/dq) + velocity x (-df/dv)` as blocks; whatever is left out costs iterations, not accuracy.
    fn add_tangent(&self, scale: f64, stiffness: f64, velocity: f64, q: &[f64], v: &[f64], blocks: &mut Vec<Block>) {
        let _ = (scale, stiffness, velocity, q, v, blocks);
    }
}

/// No load.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unloaded;

impl External for Unloaded {
    fn add_force(&self, _: f64, _: f64, _: &[f64], _: &[f64], _: &mut [f64]) {}
}

/// Forces of fixed direction: (node, force N).
#[derive(Debug, Clone, Default)]
pub struct DeadForces(pub Vec<(u32, [f64; 3])>);

impl External for DeadForces {
    fn add_force(&self, scale: f64, _: f64, _: &[f64], _: &[f64], force: &mut [f64]) {
        for (node, f) in &self.0 {
            (0..3).for_each(|k| force[NODE * *node as usize + k] += scale * f[k]);
        }
    }
}

/// Moments on directors, fixed in space: (node, moment N m). A director `d` turned by a moment `m` feels `m x d / d.d`.
#[derive(Debug, Clone, Default)]
pub struct DirectorMoments(pub Vec<(u32, [f64; 3])>);

impl External for DirectorMoments {
    fn add_force(&self, scale: f64, _: f64, q: &[f64], _: &[f64], force: &mut [f64]) {
        for (node, m) in &self.0 {
            let first = NODE * *node as usize + 3;
            let d: [f64; 3] = std::array::from_fn(|k| q[first + k]);
            let turn = super::strain::cross(m, &d);
            let square = super::strain::dot(&d, &d);
            (0..3).for_each(|k| force[first + k] += scale * turn[k] / square);
        }
    }
}
