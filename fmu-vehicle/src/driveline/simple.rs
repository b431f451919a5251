//! Simplified kinematic driveline: the torque is split by fractions; no shafts, no inertia. For the map powertrain only.

use super::{DrivelineBuilt, DrivelineTemplate, SimpleRuntime};
use crate::mbs::Model;
use crate::suspension::Corner;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;

/// Specification of a simple driveline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SimpleDriveline {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// The driven axles.
    pub axles: Vec<SimpleAxle>,
}

/// One driven axle of a simple driveline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SimpleAxle {
    /// Axle, counted from 1.
    pub axle: usize,
    /// Share of the torque, 0 to 1; all shares add up to 1.
    pub torque_fraction: f64,
    /// Speed of the wheels over that of the driveshaft, above 0.
    pub gear: f64,
    /// Greatest ratio of the torques of the slower and the faster wheel, 1 (open) or more.
    pub max_bias: f64,
}

impl DrivelineTemplate for SimpleDriveline {
    fn check(&self, path: &str, axles: usize, f: &mut Faults) {
        f.check(!self.axles.is_empty(), &format!("{path}.axles"), "empty", "at least one axle");
        let sum: f64 = self.axles.iter().map(|a| a.torque_fraction).sum();
        f.check((sum - 1.0).abs() < 1e-9, &format!("{path}.axles[*].torque_fraction"), sum, "shares that add up to 1");
        for (k, a) in self.axles.iter().enumerate() {
            let p = format!("{path}.axles[{k}]");
            f.check(
                a.axle >= 1 && a.axle <= axles,
                &format!("{p}.axle"),
                a.axle,
                &format!("an axle from 1 to {axles}"),
            );
            f.within(&format!("{p}.torque_fraction"), a.torque_fraction, 0.0, 1.0);
            f.positive(&format!("{p}.gear"), a.gear);
            f.within(&format!("{p}.max_bias"), a.max_bias, 1.0, 1e3);
        }
    }

    fn driven(&self) -> Vec<usize> {
        // No axle shafts of its own: the corners' shaft inertia stays with the spindles.
        Vec::new()
    }

    fn build(&self, _: &mut Model, corners: &[[Corner; 2]], _: f64) -> DrivelineBuilt {
        let axles = self
            .axles
            .iter()
            .map(|a| {
                let c = &corners[a.axle - 1];
                (a.torque_fraction, a.gear, a.max_bias, [c[0].spindle, c[1].spindle])
            })
            .collect();
        DrivelineBuilt::Simple(SimpleRuntime { axles })
    }
}
