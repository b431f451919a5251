//! Two-wheel drive with shafts: one conical gear, one open differential with a lock.

use super::{DrivelineBuilt, DrivelineTemplate, axle_shafts};
use crate::mbs::Model;
use crate::suspension::Corner;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::Vec3;

/// Specification of a two-wheel drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TwoWheelShafts {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// The driven axle, counted from 1.
    pub axle: usize,
    /// Inertia (kg m2) of the shaft from the gearbox.
    pub driveshaft_inertia: f64,
    /// Inertia (kg m2) of the differential's box.
    pub box_inertia: f64,
    /// Speed of the box over that of the shaft.
    pub gear: f64,
    /// Torque limit (N m) of the lock when locked.
    #[serde(default)]
    pub lock_torque: f64,
    /// Differential locked.
    #[serde(default)]
    pub locked: bool,
}

impl DrivelineTemplate for TwoWheelShafts {
    fn check(&self, path: &str, axles: usize, f: &mut Faults) {
        f.check(
            self.axle >= 1 && self.axle <= axles,
            &format!("{path}.axle"),
            self.axle,
            &format!("an axle from 1 to {axles}"),
        );
        f.positive(&format!("{path}.driveshaft_inertia"), self.driveshaft_inertia);
        f.positive(&format!("{path}.box_inertia"), self.box_inertia);
        f.positive(&format!("{path}.gear"), self.gear);
        f.not_negative(&format!("{path}.lock_torque"), self.lock_torque);
    }

    fn driven(&self) -> Vec<usize> {
        vec![self.axle]
    }

    fn build(&self, m: &mut Model, corners: &[[Corner; 2]], gearbox_inertia: f64) -> DrivelineBuilt {
        let out = axle_shafts(m, "driven", &corners[self.axle - 1]);
        let s = &mut m.shafts;
        let drive = s.shaft("driveshaft", self.driveshaft_inertia + gearbox_inertia);
        let carrier = s.shaft("differential box", self.box_inertia);
        s.gear("conical gear", drive, carrier, self.gear, Vec3::x(), Vec3::y());
        s.differential("differential", carrier, out, -1.0);
        let locks = if self.locked { vec![(m.clutch(out[0], out[1]), self.lock_torque)] } else { vec![] };
        DrivelineBuilt::Shafts { input: drive, locks }
    }
}
