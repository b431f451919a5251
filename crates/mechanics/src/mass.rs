//! Mass, centre and inertia of the solid that a closed triangle mesh bounds.

use crate::{Mat3, TriangleMesh, Vec3};

/// Mass properties of a rigid body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// Mass (kg).
    pub mass: f64,
    /// `p_BC`, the centre of mass in the mesh's frame (m).
    pub center: Vec3,
    /// `I_BC_B`, the inertia about the centre of mass, axes of the mesh's frame (kg m2).
    pub inertia: Mat3,
}

impl MassProperties {
    /// The inertia about another point `p_BP` of the mesh's frame (kg m2) (Steiner).
    pub fn inertia_about(&self, p_bp: &Vec3) -> Mat3 {
        let d = self.center - p_bp;
        self.inertia + self.mass * (d.norm_squared() * Mat3::identity() - d * d.transpose())
    }
}

/// Why a mesh has no mass properties.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MassError {
    /// The mesh is faulty or open; the report says how.
    #[error("mass properties need a closed mesh without faults:\n{0}")]
    NotClosed(crate::MeshReport),
    /// The density is not a positive number.
    #[error("density {0} kg/m3: must be finite and above 0")]
    Density(f64),
}

impl TriangleMesh {
    /// Mass properties of the solid of uniform `density` (kg/m3), exact for the faceted solid: the volume integrals
    /// of 1, x and x x' over the signed tetrahedra between each triangle and a fixed point.
    ///
    /// # Errors
    /// [`MassError`] if the mesh is not closed and sound or the density not positive.
    pub fn mass_properties(&self, density: f64) -> Result<MassProperties, MassError> {
        if !(density > 0.0 && density.is_finite()) {
            return Err(MassError::Density(density));
        }
        let report = self.check();
        if !report.is_closed() {
            return Err(MassError::NotClosed(report));
        }
        let o = self.vertex(self.triangles[0][0]);
        let (mut volume, mut first, mut second) = (0.0, Vec3::zeros(), Mat3::zeros());
        for t in 0..self.triangles.len() {
            let [a, b, c] = self.corners(t).map(|p| p - o);
            let v = a.dot(&b.cross(&c)) / 6.0;
            let s = a + b + c;
            volume += v;
            first += v * s / 4.0;
            // Integral of x x' over a tetrahedron with one corner at the origin.
            second += v / 20.0 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
        }
        let d = first / volume;
        let covariance = density * (second - volume * d * d.transpose());
        Ok(MassProperties {
            mass: density * volume,
            center: o + d,
            inertia: covariance.trace() * Mat3::identity() - covariance,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cylinder::Cylinder;

    #[test]
    fn cylinder_as_a_prism() {
        let (r, b, n) = (0.3, 0.2, 48);
        let mut mesh = Cylinder::smooth(r, b, n).mesh().unwrap();
        for p in &mut mesh.vertices {
            *p = [p[0] + 1.0, p[1] - 2.0, p[2] + 3.0];
        }
        let m = mesh.mass_properties(1000.0).unwrap();
        // A regular n-gon: area n/2 r^2 sin(2 pi/n), polar second moment area r^2 (2 + cos(2 pi/n))/6.
        let turn = std::f64::consts::TAU / f64::from(n);
        let area = f64::from(n) / 2.0 * r * r * turn.sin();
        let mass = 1000.0 * area * b;
        let yy = mass * r * r * (2.0 + turn.cos()) / 6.0;
        assert!((m.mass / mass - 1.0).abs() < 1e-12);
        assert!((m.center - Vec3::new(1.0, -2.0, 3.0)).norm() < 1e-12);
        assert!((m.inertia[(1, 1)] / yy - 1.0).abs() < 1e-12);
        assert!((m.inertia[(0, 0)] / (yy / 2.0 + mass * b * b / 12.0) - 1.0).abs() < 1e-12);
        assert!(m.inertia[(0, 1)].abs() + m.inertia[(1, 2)].abs() < 1e-12 * yy);
        let about = m.inertia_about(&Vec3::new(1.0, 0.0, 3.0));
        assert!((about[(0, 0)] - m.inertia[(0, 0)] - 4.0 * mass).abs() < 1e-9 * mass);
    }

    #[test]
    fn an_open_mesh_is_refused() {
        let mut mesh = Cylinder::smooth(0.3, 0.2, 12).mesh().unwrap();
        mesh.triangles.pop();
        assert!(mesh.mass_properties(1.0).unwrap_err().to_string().contains("3 boundary edges"));
        assert!(matches!(mesh.mass_properties(-1.0), Err(MassError::Density(_))));
    }
}
