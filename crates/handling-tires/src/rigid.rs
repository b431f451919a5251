//! Rigid contact: a stiff spring and damper, Coulomb friction regularised by the slip.

use crate::{Contact, TireForces};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_mechanics::Vec3;

/// Parameters of a rigid tire.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Rigid {
    /// Radius (m).
    pub radius: f64,
    /// Mass (kg).
    pub mass: f64,
    /// Moments of inertia (kg m2).
    pub inertia: [f64; 3],
    /// Contact stiffness (N/m).
    pub stiffness: f64,
    /// Contact damping (N s/m).
    pub damping: f64,
    /// Friction of the tire; the lower of tire and ground counts.
    pub friction: f64,
    /// Slip at which friction is fully mobilised.
    pub full_slip: f64,
    /// Relaxation length (m).
    pub relaxation: f64,
}

impl Default for Rigid {
    /// The rigid tire of the HMMWV (Project Chrono, HMMWV_RigidTire.json), contact stiffness 200 kN/m.
    fn default() -> Self {
        Self {
            radius: 0.467,
            mass: 37.6,
            inertia: [3.84, 6.69, 3.84],
            stiffness: 2e5,
            damping: 4e3,
            friction: 0.9,
            full_slip: 0.05,
            relaxation: 0.1,
        }
    }
}

impl Rigid {
    pub(crate) fn load(&self, c: &Contact) -> f64 {
        (self.stiffness * c.depth + self.damping * c.depth_rate).max(0.0)
    }

    pub(crate) fn forces(&self, c: &Contact, load: f64, (kappa, tan_alpha): (f64, f64)) -> TireForces {
        let s = (kappa * kappa + tan_alpha * tan_alpha).sqrt();
        let limit = self.friction.min(c.friction) * load;
        // Smooth up to the limit, direction of the slip.
        let share = if s > 0.0 { (s / self.full_slip).tanh() / s } else { 0.0 };
        TireForces { force: Vec3::new(limit * share * kappa, -limit * share * tan_alpha, load), moment: Vec3::zeros() }
    }
}
