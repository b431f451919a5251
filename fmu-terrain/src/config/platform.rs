//! A rigid platform before the box: a run-up that ends where the soil begins.

use super::Bed;
use crate::rigid::config::Penalty;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;

/// Rigid platform outside the box, along its side at -x, as wide as the box and as high as the settled bed: a body that leaves it meets the soil without
/// a step in height. It carries bodies, not grains, which the side wall of the box holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Platform {
    /// Length along x (m).
    pub length: f64,
    /// Coulomb friction (1); the lesser of platform and body holds.
    pub friction: f64,
    /// How bodies are pushed out of it.
    pub contact: Penalty,
}

impl Default for Platform {
    fn default() -> Self {
        Self { length: 8.0, friction: 0.9, contact: Penalty::default() }
    }
}

impl Platform {
    /// Whether a point lies on it.
    pub fn carries(&self, bed: &Bed, x: f64, y: f64) -> bool {
        let edge = -0.5 * bed.length;
        x <= edge && x >= edge - self.length && y.abs() <= 0.5 * bed.width
    }

    pub(super) fn check(&self, f: &mut Faults) {
        f.positive("bed.platform.length", self.length);
        f.within("bed.platform.friction", self.friction, 0.0, 10.0);
        self.contact.check("bed.platform.contact", f);
    }
}
