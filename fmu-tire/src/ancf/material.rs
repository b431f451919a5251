//! Orthotropic elasticity from engineering constants.

use nalgebra::{Matrix3, Matrix6};

/// An orthotropic material in its own axes 1 (fibre), 2 (in plane), 3 (normal).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orthotropic {
    /// Density, kg/m3.
    pub density: f64,
    /// Young's moduli E1, E2, E3, Pa.
    pub young: [f64; 3],
    /// Poisson's ratios nu12, nu13, nu23 (contraction along the second axis under tension along the first).
    pub poisson: [f64; 3],
    /// Shear moduli G12, G13, G23, Pa.
    pub shear: [f64; 3],
}

impl Orthotropic {
    /// An isotropic material.
    pub fn isotropic(density: f64, young: f64, poisson: f64) -> Self {
        let shear = young / (2.0 * (1.0 + poisson));
        Self { density, young: [young; 3], poisson: [poisson; 3], shear: [shear; 3] }
    }

    /// What forbids this material: empty if its elastic energy is positive for every strain and its density is positive.
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        let mut positive = |name: &str, value: f64, unit: &str| {
            if !(value > 0.0 && value.is_finite()) {
                faults.push(format!("{name} = {value} {unit}: must be positive"));
            }
        };
        positive("density", self.density, "kg/m3");
        for k in 0..3 {
            positive(["E1", "E2", "E3"][k], self.young[k], "Pa");
            positive(["G12", "G13", "G23"][k], self.shear[k], "Pa");
        }
        if self.poisson.iter().any(|nu| !nu.is_finite()) {
            faults.push(format!("Poisson's ratios {:?}: must be finite", self.poisson));
        } else if faults.is_empty() && self.compliance().cholesky().is_none() {
            let [n12, n13, n23] = self.poisson;
            let [e1, e2, e3] = self.young;
            faults.push(format!(
                "not positive definite: needs nu12^2 < E1/E2 ({:.4} < {:.4}), nu13^2 < E1/E3 ({:.4} < {:.4}), nu23^2 < E2/E3 \
                 ({:.4} < {:.4}) and 1 - nu12^2 E2/E1 - nu13^2 E3/E1 - nu23^2 E3/E2 - 2 nu12 nu13 nu23 E3/E1 > 0",
                n12 * n12,
                e1 / e2,
                n13 * n13,
                e1 / e3,
                n23 * n23,
                e2 / e3
            ));
        }
        faults
    }

    /// Compliance of the three normal strains, 1/Pa.
    fn compliance(&self) -> Matrix3<f64> {
        let [e1, e2, e3] = self.young;
        let [n12, n13, n23] = self.poisson;
        let (a, b, c) = (-n12 / e1, -n13 / e1, -n23 / e2);
        Matrix3::new(1.0 / e1, a, b, a, 1.0 / e2, c, b, c, 1.0 / e3)
    }

    /// Stiffness in material axes, Pa, for strains in the order 11, 22, 12, 33, 13, 23 with engineering shear.
    ///
    /// Not a number if the material has [`faults`](Self::faults).
    pub fn stiffness(&self) -> Matrix6<f64> {
        let normal = self.compliance().try_inverse().unwrap_or(Matrix3::from_element(f64::NAN));
        let mut c = Matrix6::zeros();
        const PLACE: [usize; 3] = [0, 1, 3];
        for i in 0..3 {
            for j in 0..3 {
                c[(PLACE[i], PLACE[j])] = 0.5 * (normal[(i, j)] + normal[(j, i)]);
            }
        }
        for (k, place) in [2, 4, 5].into_iter().enumerate() {
            c[(place, place)] = self.shear[k];
        }
        c
    }
}
