//! A mesh body: its vertices now, and how they move between communication points.

use super::topology::Topology;
use crate::dem::body::facet_spin;
use crate::dem::vec3::{Vec3, add, add_scaled, cross, dot, sub};
use terramech_mechanics::{RigidState, TriangleMesh};

/// What is wrong with the mesh of a body, or with a value given to it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// The mesh has faults.
    #[error("{0}")]
    Faulty(String),
    /// An array has the wrong length.
    #[error("{array} has {given} values, allowed: {allowed}")]
    Length {
        /// Name of the array.
        array: &'static str,
        /// Its length.
        given: usize,
        /// What is allowed.
        allowed: String,
    },
    /// A value is not finite.
    #[error("{array}[{index}] is {value}: must be finite")]
    NotFinite {
        /// Name of the array.
        array: &'static str,
        /// Index of the value, counted from 0.
        index: usize,
        /// The value.
        value: f64,
    },
    /// A vertex index is negative or too large.
    #[error("triangle[{index}] is {value}, allowed 0 to {most}")]
    Index {
        /// Index in the array, counted from 0.
        index: usize,
        /// The value.
        value: i64,
        /// Largest allowed.
        most: i64,
    },
}

/// How the vertices move from the communication point on.
#[derive(Clone, Debug)]
enum Motion {
    /// Each by its own velocity: x0 + v t.
    Free { x0: Vec<Vec3> },
    /// As one rigid body: points in the body frame, and the state at the communication point.
    Rigid { p_b: Vec<Vec3>, state: RigidState },
}

/// A triangle mesh that grains touch: a kinematic surface, wound outward.
///
/// A closed mesh has an inside: a grain whose centre got in, by less than its radius, is pushed out through the nearest
/// facet. An open mesh (a plate) is two-sided: grains may touch it from both sides, and one whose centre passes through
/// is on the other side.
#[derive(Clone, Debug)]
pub struct MeshBody {
    topology: Topology,
    motion: Motion,
    x: Vec<Vec3>,
    v: Vec<Vec3>,
    /// Vertices at the last refit of the facet grid.
    x_ref: Vec<Vec3>,
    center: Vec3,
}

impl MeshBody {
    /// A mesh whose vertices move each on its own; at rest until [`Self::set_vertices`].
    ///
    /// # Errors
    /// [`MeshError::Faulty`] with all faults of the mesh.
    pub fn deforming(mesh: &TriangleMesh) -> Result<Self, MeshError> {
        let topology = Topology::new(mesh)?;
        let x = mesh.vertices.clone();
        let mut body = Self {
            topology,
            v: vec![[0.0; 3]; x.len()],
            x_ref: x.clone(),
            motion: Motion::Free { x0: x.clone() },
            x,
            center: [0.0; 3],
        };
        body.center = body.mean();
        Ok(body)
    }

    /// A rigid mesh; its vertices are in the body frame, and `state` places it.
    ///
    /// # Errors
    /// [`MeshError::Faulty`] with all faults of the mesh.
    pub fn rigid(mesh: &TriangleMesh, state: RigidState) -> Result<Self, MeshError> {
        let mut body = Self::deforming(mesh)?;
        body.motion = Motion::Rigid { p_b: mesh.vertices.clone(), state };
        body.move_to(0.0);
        body.mark();
        Ok(body)
    }

    /// New positions (3N) in m and velocities (3N) in m/s of the vertices of a deforming mesh, at a communication point.
    ///
    /// # Errors
    /// Wrong lengths or values that are not finite; the body is then as it was. [`MeshError::Faulty`] on a rigid body.
    pub fn set_vertices(&mut self, position: &[f64], velocity: &[f64]) -> Result<(), MeshError> {
        let n = self.x.len();
        for (array, values) in [("position", position), ("velocity", velocity)] {
            if values.len() != 3 * n {
                let allowed = format!("{} (3 for each of {n} vertices)", 3 * n);
                return Err(MeshError::Length { array, given: values.len(), allowed });
            }
            check_finite(array, values)?;
        }
        let Motion::Free { x0 } = &mut self.motion else {
            return Err(MeshError::Faulty("a rigid body takes a state, not vertices".into()));
        };
        for k in 0..n {
            x0[k] = [position[3 * k], position[3 * k + 1], position[3 * k + 2]];
            self.v[k] = [velocity[3 * k], velocity[3 * k + 1], velocity[3 * k + 2]];
        }
        self.move_to(0.0);
        Ok(())
    }

    /// A new state of a rigid body, at a communication point.
    ///
    /// # Errors
    /// [`MeshError::Faulty`] on a deforming body.
    pub fn set_state(&mut self, new: RigidState) -> Result<(), MeshError> {
        let Motion::Rigid { state, .. } = &mut self.motion else {
            return Err(MeshError::Faulty("a deforming body takes vertices, not a state".into()));
        };
        *state = new;
        self.move_to(0.0);
        Ok(())
    }

    /// Moves the vertices to `tau` s after the last communication point: x0 + v tau, or by the exponential map.
    pub fn move_to(&mut self, tau: f64) {
        match &self.motion {
            Motion::Free { x0 } => {
                for ((x, x0), v) in self.x.iter_mut().zip(x0).zip(&self.v) {
                    *x = add_scaled(*x0, tau, *v);
                }
                self.center = self.mean();
            }
            Motion::Rigid { p_b, state } => {
                let now = state.advanced(tau);
                let r = now.orientation.to_rotation_matrix();
                let (p, v, w): (Vec3, Vec3, Vec3) =
                    (now.position.into(), now.velocity.into(), now.angular_velocity.into());
                for k in 0..p_b.len() {
                    let arm: Vec3 = (r * nalgebra::Vector3::from(p_b[k])).into();
                    self.x[k] = add(p, arm);
                    self.v[k] = add(v, cross(w, arm));
                }
                self.center = p;
            }
        }
    }

    /// Where the vertices of a deforming body will be `tau` s after the last communication point (m); none of a rigid one.
    pub fn vertices_at(&self, tau: f64) -> Option<impl Iterator<Item = Vec3>> {
        match &self.motion {
            Motion::Free { x0 } => Some(x0.iter().zip(&self.v).map(move |(x0, v)| add_scaled(*x0, tau, *v))),
            Motion::Rigid { .. } => None,
        }
    }

    fn mean(&self) -> Vec3 {
        let sum = self.x.iter().fold([0.0; 3], |s, &x| add(s, x));
        sum.map(|s| s / self.x.len() as f64)
    }

    /// The point about which the body's wrench is reckoned: the origin of a rigid body, the mean of the vertices of a
    /// deforming one.
    pub fn center(&self) -> Vec3 {
        self.center
    }

    /// Positions of the vertices now, in m.
    pub fn positions(&self) -> &[Vec3] {
        &self.x
    }

    /// Velocities of the vertices now, in m/s.
    pub fn velocities(&self) -> &[Vec3] {
        &self.v
    }

    /// Vertices of each facet.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.topology.triangles
    }

    /// Whether the mesh bounds a volume.
    pub fn is_closed(&self) -> bool {
        self.topology.closed
    }

    pub(super) fn topology(&self) -> &Topology {
        &self.topology
    }

    /// The corners of facet `t` now.
    #[inline]
    pub fn corners(&self, t: u32) -> [Vec3; 3] {
        self.topology.triangles[t as usize].map(|v| self.x[v as usize])
    }

    /// Velocity of the point with barycentric weights `b` on facet `t`. Exact for a rigid body too: its velocities are
    /// linear in space.
    #[inline]
    pub fn velocity_at(&self, t: u32, b: [f64; 3]) -> Vec3 {
        let [p, q, r] = self.topology.triangles[t as usize].map(|v| self.v[v as usize]);
        std::array::from_fn(|k| b[0] * p[k] + b[1] * q[k] + b[2] * r[k])
    }

    /// Angular velocity of facet `t`: the body's, or the rotation that the facet's vertices have in common, in the sense
    /// that the power of a couple is the power of the vertex forces that carry it.
    pub fn spin_at(&self, t: u32) -> Vec3 {
        match &self.motion {
            Motion::Rigid { state, .. } => state.angular_velocity.into(),
            Motion::Free { .. } => {
                facet_spin(self.corners(t), self.topology.triangles[t as usize].map(|v| self.v[v as usize]))
            }
        }
    }

    /// How far any vertex is from where it was at the last [`super::FacetGrid::refit`], in m.
    pub fn drift(&self) -> f64 {
        let d2 = |k: usize| {
            let d = sub(self.x[k], self.x_ref[k]);
            dot(d, d)
        };
        (0..self.x.len()).map(d2).fold(0.0, f64::max).sqrt()
    }

    pub(super) fn mark(&mut self) {
        self.x_ref.copy_from_slice(&self.x);
    }
}

/// A mesh from the arrays of an interface: positions (3N), vertex indices (3M) counted from 0.
///
/// # Errors
/// Lengths that are no multiple of 3, indices out of range, positions that are not finite.
pub fn mesh_from_arrays(position: &[f64], triangle: &[i32]) -> Result<TriangleMesh, MeshError> {
    for (array, given) in [("position", position.len()), ("triangle", triangle.len())] {
        if given == 0 || given % 3 != 0 {
            return Err(MeshError::Length { array, given, allowed: "a multiple of 3, at least 3".into() });
        }
    }
    check_finite("position", position)?;
    let most = (position.len() / 3 - 1) as i64;
    if let Some(index) = triangle.iter().position(|&v| !(0..=most).contains(&i64::from(v))) {
        return Err(MeshError::Index { index, value: i64::from(triangle[index]), most });
    }
    Ok(TriangleMesh {
        vertices: position.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect(),
        triangles: triangle.chunks_exact(3).map(|t| [t[0] as u32, t[1] as u32, t[2] as u32]).collect(),
    })
}

fn check_finite(array: &'static str, values: &[f64]) -> Result<(), MeshError> {
    match values.iter().position(|x| !x.is_finite()) {
        Some(index) => Err(MeshError::NotFinite { array, index, value: values[index] }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dem::vec3::norm;
    use terramech_mechanics::cylinder::Cylinder;

    #[test]
    fn rigid_motion_and_free_motion_agree_at_first_order() {
        let mesh = Cylinder::smooth(0.1, 0.05, 24).mesh().unwrap();
        let state = RigidState {
            position: [1.0, 2.0, 3.0].into(),
            velocity: [0.3, 0.0, -0.1].into(),
            angular_velocity: [0.0, 5.0, 1.0].into(),
            ..RigidState::default()
        };
        let mut rigid = MeshBody::rigid(&mesh, state).unwrap();
        let mut free = MeshBody::deforming(&mesh).unwrap();
        free.set_vertices(&rigid.positions().concat(), &rigid.velocities().concat()).unwrap();
        let before: Vec<Vec3> = free.vertices_at(1e-4).unwrap().collect();
        assert!(rigid.vertices_at(1e-4).is_none());
        rigid.move_to(1e-4);
        free.move_to(1e-4);
        assert_eq!(before, free.positions());
        for (a, b) in rigid.positions().iter().zip(free.positions()) {
            assert!(norm(sub(*a, *b)) < 0.5 * 26.0 * 0.11 * 1e-8);
        }
        assert!(rigid.drift() > 0.3e-4 && rigid.drift() < 1e-4);
        assert!(norm(sub(rigid.center(), [1.0 + 0.3e-4, 2.0, 3.0 - 0.1e-4])) < 1e-15);
    }

    #[test]
    fn values_from_outside_are_checked() {
        assert!(mesh_from_arrays(&[0.0; 9], &[0, 1, 3]).unwrap_err().to_string().contains("triangle[2] is 3"));
        assert!(mesh_from_arrays(&[0.0; 9], &[0, 1]).unwrap_err().to_string().contains("2 values"));
        assert!(mesh_from_arrays(&[f64::NAN; 9], &[0, 1, 2]).unwrap_err().to_string().contains("position[0] is NaN"));
        let mesh = Cylinder::smooth(0.1, 0.05, 24).mesh().unwrap();
        let mut body = MeshBody::deforming(&mesh).unwrap();
        assert!(body.set_vertices(&[0.0; 3], &[0.0; 3]).unwrap_err().to_string().contains("position has 3 values"));
        assert!(body.set_state(RigidState::default()).is_err());
    }
}
