//! How an obstacle moves.

use super::{MassOf, Solid};
use crate::dem::body::{BodyTouch, Shape};
use crate::dem::contact::Slip;
use crate::dem::error::DemError;
use crate::dem::vec3::{Vec3, norm};
use crate::mesh::{MeshBody, MeshShape};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use terramech_mechanics::RigidState;

/// What changes of an obstacle: plain data, saved whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeState {
    /// Centre of mass, orientation and their rates.
    pub state: RigidState,
    /// It lies still until something touches it.
    pub asleep: bool,
    /// Force (N) and moment about the centre (N m) on it at the last inner step, weight aside.
    pub load: [Vec3; 2],
    /// Memories of its contacts with walls and driven bodies, by partner and point.
    pub slips: BTreeMap<(u32, u32), Slip>,
}

/// An obstacle.
pub struct FreeBody {
    solid: Solid,
    mass: f64,
    inertia: Matrix3<f64>,
    mesh: Option<MeshShape>,
    skin: Vec<(Vec3, f64)>,
    /// What changes.
    pub now: FreeState,
}

impl FreeBody {
    /// A solid at a state.
    ///
    /// # Errors
    /// Sizes or a mass that are not finite and above 0; a faulty mesh.
    pub fn new(solid: Solid, mass: MassOf, state: RigidState, asleep: bool) -> Result<Self, DemError> {
        let (kilograms, inertia) = solid.mass(mass);
        let size = solid.reach();
        for (what, x) in [("size of an obstacle", size), ("mass of an obstacle", kilograms)] {
            if !(x.is_finite() && x > 0.0) {
                return Err(DemError::parameter(what, x, "a finite number greater than 0"));
            }
        }
        let fault = |e: crate::mesh::MeshError| DemError::parameter("mesh of an obstacle", "faulty", e.to_string());
        let mesh = match &solid {
            Solid::Mesh(mesh) => Some(MeshShape::new(MeshBody::rigid(mesh, state).map_err(fault)?)),
            _ => None,
        };
        let inertia = Matrix3::from_fn(|r, c| inertia[r][c]);
        let now = FreeState { state, asleep, load: [[0.0; 3]; 2], slips: BTreeMap::new() };
        let skin = solid.skin();
        Ok(Self { solid, mass: kilograms, inertia, mesh, skin, now })
    }

    /// Its shape.
    pub fn solid(&self) -> &Solid {
        &self.solid
    }

    /// Small spheres on its surface, in which it meets other obstacles: centre in its own frame and radius (m).
    pub fn skin(&self) -> &[(Vec3, f64)] {
        &self.skin
    }

    /// Mass (kg).
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Takes a saved state.
    pub fn restore(&mut self, saved: FreeState) {
        self.now = saved;
        self.place_mesh();
    }

    fn place_mesh(&mut self) {
        if let Some(mesh) = &mut self.mesh {
            // A rigid body takes any state.
            let _ = mesh.update(|b| b.set_state(self.now.state));
        }
    }

    /// Moves on by a step of `h` (s) under force and moment about the centre, weight added here (semi-implicit Euler;
    /// orientation by the exponential map). Asleep, it stays.
    pub fn advance(&mut self, force: Vec3, moment: Vec3, gravity: Vec3, h: f64) {
        self.now.load = [force, moment];
        if self.now.asleep {
            return;
        }
        let s = &mut self.now.state;
        let r = s.orientation.to_rotation_matrix().into_inner();
        let inertia = r * self.inertia * r.transpose();
        s.velocity += h * (Vector3::from(force) / self.mass + Vector3::from(gravity));
        let gyroscopic = s.angular_velocity.cross(&(inertia * s.angular_velocity));
        if let Some(inverse) = inertia.try_inverse() {
            s.angular_velocity += h * (inverse * (Vector3::from(moment) - gyroscopic));
        }
        self.now.state = self.now.state.advanced(h);
        self.place_mesh();
    }

    /// A point of the obstacle's frame, in the inertial frame.
    pub fn to_world(&self, p: Vec3) -> Vec3 {
        self.now.state.to_world(&p.into()).into()
    }

    /// Velocity of the point of the obstacle that is at `p` now (m/s).
    pub fn velocity_at(&self, p: Vec3) -> Vec3 {
        self.now.state.velocity_at(&p.into()).into()
    }

    /// A direction of the inertial frame, in the obstacle's.
    pub fn to_body_direction(&self, d: Vec3) -> Vec3 {
        (self.now.state.orientation.inverse() * Vector3::from(d)).into()
    }

    /// Lowest point below the centre (m): how high the centre lies above what it rests on.
    pub fn depth(&self) -> f64 {
        let [low, _] = self.bounds();
        self.now.state.position[2] - low[2]
    }
}

impl Shape for FreeBody {
    // The engine moves it.
    fn move_to(&mut self, _: f64) {}

    fn bounds(&self) -> [Vec3; 2] {
        if let Some(mesh) = &self.mesh {
            return mesh.bounds();
        }
        let s = &self.now.state;
        let r = s.orientation.to_rotation_matrix().into_inner();
        let half = |k: usize| match &self.solid {
            Solid::Cylinder(radius, length) => {
                let a: f64 = r[(k, 1)];
                0.5 * length * a.abs() + radius * (1.0 - a * a).max(0.0).sqrt()
            }
            Solid::Box(edges) => (0..3).map(|c| 0.5 * edges[c] * f64::abs(r[(k, c)])).sum(),
            other => other.reach(),
        };
        let half = [half(0), half(1), half(2)];
        [0, 1].map(|side| std::array::from_fn(|c| s.position[c] + if side == 0 { -half[c] } else { half[c] }))
    }

    fn touches(&self, centre: Vec3, radius: f64, out: &mut Vec<BodyTouch>) {
        let from = out.len();
        if let Some(mesh) = &self.mesh {
            mesh.touches(centre, radius, out);
        } else {
            let s = &self.now.state;
            let p = s.to_body(&centre.into());
            if norm(p.into()) >= self.solid.reach() + radius {
                return;
            }
            let Some((distance, n)) = self.solid.nearest(p.into()) else { return };
            if distance >= radius {
                return;
            }
            let normal: Vec3 = (s.orientation * Vector3::from(n)).into();
            let point: Vec3 = std::array::from_fn(|c| centre[c] - distance * normal[c]);
            out.push(BodyTouch {
                overlap: radius - distance,
                weight: 1.0,
                share: 1.0,
                normal,
                point,
                velocity: s.velocity_at(&point.into()).into(),
                angular_velocity: s.angular_velocity.into(),
                vertices: [u32::MAX; 3],
                weights: [0.0; 3],
            });
        }
        // No vertex of it is anybody's.
        out[from..].iter_mut().for_each(|t| t.vertices = [u32::MAX; 3]);
    }

    fn centre(&self) -> Vec3 {
        self.now.state.position.into()
    }

    fn as_free(&mut self) -> Option<&mut FreeBody> {
        Some(self)
    }
}
