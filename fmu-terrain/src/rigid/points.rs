//! Bodies as points that carry area: vertices of a mesh, or points on the tread of a cylinder.

use super::contact::Point;
use terramech_mechanics::{RigidState, Vec3};

/// A body's points between two communication points.
#[derive(Clone, Debug)]
pub enum PointBody {
    /// Each vertex moves on by its own velocity.
    Free {
        /// Positions at the communication point (m).
        position: Vec<Vec3>,
        /// Velocities (m/s).
        velocity: Vec<Vec3>,
        /// Areas times outward normals (m2), at the communication point.
        area: Vec<Vec3>,
        /// The point the wrench is about, and its velocity.
        centre: [Vec3; 2],
    },
    /// Moves rigidly.
    Rigid {
        /// Positions in the body (m).
        position: Vec<Vec3>,
        /// Areas times outward normals in the body (m2).
        area: Vec<Vec3>,
        /// State at the communication point.
        state: RigidState,
    },
}

impl PointBody {
    /// Number of points.
    pub fn len(&self) -> usize {
        match self {
            Self::Free { position, .. } | Self::Rigid { position, .. } => position.len(),
        }
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Calls `f` with every point, `t` s after the communication point; returns the centre of the wrench.
    pub fn each(&self, t: f64, mut f: impl FnMut(usize, Point)) -> Vec3 {
        match self {
            Self::Free { position, velocity, area, centre } => {
                for (k, ((x, v), a)) in position.iter().zip(velocity).zip(area).enumerate() {
                    f(k, Point { position: x + v * t, velocity: *v, area: *a });
                }
                centre[0] + centre[1] * t
            }
            Self::Rigid { position, area, state } => {
                let now = state.advanced(t);
                let r = now.orientation.to_rotation_matrix();
                for (k, (x, a)) in position.iter().zip(area).enumerate() {
                    let arm = r * x;
                    let velocity = now.velocity + now.angular_velocity.cross(&arm);
                    f(k, Point { position: now.position + arm, velocity, area: r * a });
                }
                now.position
            }
        }
    }
}

/// A third of each facet's area vector (m2) for each of its vertices. For a closed mesh they sum to zero.
pub fn vertex_areas(vertices: &[Vec3], triangles: impl Iterator<Item = [usize; 3]>) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); vertices.len()];
    for t in triangles {
        let [a, b, c] = t.map(|k| vertices[k]);
        let share = (b - a).cross(&(c - a)) / 6.0;
        t.iter().for_each(|k| out[*k] += share);
    }
    out
}

/// Points around the tread of a cylinder (axis along y, about the origin) and their area vectors: `around` by `across` points
/// in the middle of equal patches.
pub fn cylinder(radius: f64, width: f64, around: usize, across: usize) -> (Vec<Vec3>, Vec<Vec3>) {
    let patch = std::f64::consts::TAU * radius / around as f64 * width / across as f64;
    let places = |k: usize| {
        let a = std::f64::consts::TAU * k as f64 / around as f64;
        let n = Vec3::new(a.cos(), 0.0, a.sin());
        (0..across).map(move |j| {
            let y = width * ((j as f64 + 0.5) / across as f64 - 0.5);
            (n * radius + Vec3::y() * y, n * patch)
        })
    };
    (0..around).flat_map(places).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_of_a_closed_mesh_sum_to_zero_and_a_cylinders_to_its_tread() {
        let mesh = terramech_mechanics::cylinder::Cylinder::smooth(0.3, 0.2, 32).mesh().unwrap();
        let x: Vec<Vec3> = mesh.vertices.iter().map(|p| Vec3::from(*p)).collect();
        let a = vertex_areas(&x, mesh.triangles.iter().map(|t| t.map(|k| k as usize)));
        assert!(a.iter().sum::<Vec3>().norm() < 1e-15);
        let (p, a) = cylinder(0.3, 0.2, 360, 5);
        assert_eq!(p.len(), 1800);
        let tread: f64 = a.iter().map(|a| a.norm()).sum();
        assert!((tread - std::f64::consts::TAU * 0.06).abs() < 1e-12);
        assert!(p.iter().zip(&a).all(|(p, a)| p.dot(a) > 0.0 && p.y.abs() < 0.1));
    }

    #[test]
    fn points_of_a_rigid_body_move_with_it() {
        let state = RigidState {
            position: Vec3::new(1.0, 0.0, 0.5),
            velocity: Vec3::new(2.0, 0.0, 0.0),
            angular_velocity: Vec3::new(0.0, 4.0, 0.0),
            ..RigidState::default()
        };
        let b = PointBody::Rigid { position: vec![Vec3::new(0.0, 0.0, -0.5)], area: vec![-Vec3::z()], state };
        let centre = b.each(0.0, |_, p| assert!(p.velocity.norm() < 1e-15, "it rolls: {:?}", p.velocity));
        assert_eq!(centre, state.position);
        let turned = std::f64::consts::FRAC_PI_2 / 4.0;
        b.each(turned, |_, p| assert!((p.area + Vec3::x()).norm() < 1e-12, "{:?}", p.area));
    }
}
