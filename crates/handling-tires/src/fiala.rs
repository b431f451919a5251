//! Fiala tire.
//!
//! `mu = mu_max - (mu_max - mu_min) min(1, sqrt(kappa^2 + tan^2 alpha))`, scaled by the ground's friction. Along: linear up to
//! `kappa_c = mu F_z / (2 C_x)`, then `mu F_z - (mu F_z)^2 / (4 C_x kappa)`. Across, with `H = 1 - C_y |tan alpha| / (3 mu F_z)`: `mu F_z (1 - H^3)` and the
//! aligning moment `mu F_z b (1 - H) H^3`. (E. Fiala 1954; the form of ADAMS/Tire and Project Chrono.)

use crate::contact::curve;
use crate::{Contact, TireForces};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_mechanics::Vec3;

/// Parameters of a Fiala tire.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fiala {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// Mass (kg).
    pub mass: f64,
    /// Moments of inertia (kg m2).
    pub inertia: [f64; 3],
    /// Undeformed radius (m).
    pub radius: f64,
    /// Width (m).
    pub width: f64,
    /// Vertical damping (N s/m).
    pub vertical_damping: f64,
    /// Vertical stiffness (N/m), without a curve.
    pub vertical_stiffness: f64,
    /// Points (deflection m, load N), rising from 0; replaces the stiffness.
    #[serde(default)]
    pub vertical_curve: Vec<[f64; 2]>,
    /// Rolling resistance: moment / (load x loaded radius).
    pub rolling_resistance: f64,
    /// Longitudinal slip stiffness C_x (N).
    pub longitudinal_stiffness: f64,
    /// Cornering stiffness C_y (N/rad).
    pub cornering_stiffness: f64,
    /// Friction at full slip.
    pub friction_min: f64,
    /// Friction without slip.
    pub friction_max: f64,
    /// Friction of the ground the two were measured on.
    pub reference_friction: f64,
    /// Relaxation length along (m).
    pub relaxation_x: f64,
    /// Relaxation length across (m).
    pub relaxation_y: f64,
}

impl Fiala {
    /// The HMMWV's tire.
    ///
    /// # Panics
    /// Never: the data come with the library.
    pub fn hmmwv() -> Self {
        serde_json::from_str(include_str!("../data/hmmwv_fiala.json")).expect("shipped data")
    }

    /// Faults as (field, what is allowed).
    pub fn faults(&self) -> Vec<(&'static str, f64, &'static str)> {
        let positive = [
            ("mass", self.mass),
            ("radius", self.radius),
            ("width", self.width),
            ("vertical_stiffness", self.vertical_stiffness),
            ("longitudinal_stiffness", self.longitudinal_stiffness),
            ("cornering_stiffness", self.cornering_stiffness),
            ("friction_min", self.friction_min),
            ("friction_max", self.friction_max),
            ("reference_friction", self.reference_friction),
            ("relaxation_x", self.relaxation_x),
            ("relaxation_y", self.relaxation_y),
        ];
        let mut out: Vec<_> = positive
            .into_iter()
            .filter(|(_, x)| !(x.is_finite() && *x > 0.0))
            .map(|(n, x)| (n, x, "a finite number above 0"))
            .collect();
        let rising = self.vertical_curve.windows(2).all(|w| w[1][0] > w[0][0]);
        if !self.vertical_curve.is_empty() && (!rising || self.vertical_curve.len() < 2) {
            out.push(("vertical_curve", self.vertical_curve.len() as f64, "at least two points, deflection rising"));
        }
        out
    }

    pub(crate) fn load(&self, c: &Contact) -> f64 {
        let spring = if self.vertical_curve.len() >= 2 {
            curve(&self.vertical_curve, c.depth)
        } else {
            self.vertical_stiffness * c.depth
        };
        (spring + self.vertical_damping * c.depth_rate).max(0.0)
    }

    pub(crate) fn forces(&self, c: &Contact, load: f64, (kappa, tan_alpha): (f64, f64)) -> TireForces {
        let s = (kappa * kappa + tan_alpha * tan_alpha).sqrt().min(1.0);
        let mu =
            (self.friction_max - (self.friction_max - self.friction_min) * s) * c.friction / self.reference_friction;
        let limit = mu * load;
        let cx = self.longitudinal_stiffness;
        let fx = if kappa.abs() < limit / (2.0 * cx) {
            cx * kappa
        } else {
            kappa.signum() * (limit - limit * limit / (4.0 * cx * kappa.abs()))
        };
        let h = 1.0 - self.cornering_stiffness * tan_alpha.abs() / (3.0 * limit);
        let (fy, mz) = if h > 0.0 {
            let h3 = h * h * h;
            (limit * (1.0 - h3), limit * self.width * (1.0 - h) * h3)
        } else {
            (limit, 0.0)
        };
        // Rolling resistance fades in with the speed, so that a standing wheel is not turned by it.
        let rolling = -self.rolling_resistance * load * c.loaded_radius * (c.omega / 0.5).tanh();
        TireForces {
            force: Vec3::new(fx, -fy * tan_alpha.signum(), load),
            moment: Vec3::new(0.0, rolling, mz * tan_alpha.signum()),
        }
    }
}
