//! Four-wheel drive with shafts: central, front and rear differential, all open, each with a lock.

use super::{DrivelineBuilt, DrivelineTemplate, axle_shafts};
use crate::mbs::Model;
use crate::suspension::Corner;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::Vec3;

/// Specification of a four-wheel drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FourWheelShafts {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// The two driven axles, front first, counted from 1.
    pub axles: [usize; 2],
    /// Inertia (kg m2) of the shaft from the gearbox.
    pub driveshaft_inertia: f64,
    /// Inertia (kg m2) of the shaft to the front.
    pub front_shaft_inertia: f64,
    /// Inertia (kg m2) of the shaft to the rear.
    pub rear_shaft_inertia: f64,
    /// Inertia (kg m2) of the front differential's box.
    pub front_box_inertia: f64,
    /// Inertia (kg m2) of the rear differential's box.
    pub rear_box_inertia: f64,
    /// Speed of the box over that of the shaft, front.
    pub front_gear: f64,
    /// Speed of the box over that of the shaft, rear.
    pub rear_gear: f64,
    /// Torque limit (N m) of the axle differentials' locks when locked.
    pub axle_lock_torque: f64,
    /// Torque limit (N m) of the central differential's lock when locked.
    pub central_lock_torque: f64,
    /// Axle differentials locked.
    #[serde(default)]
    pub axle_locked: bool,
    /// Central differential locked.
    #[serde(default)]
    pub central_locked: bool,
}

impl DrivelineTemplate for FourWheelShafts {
    fn check(&self, path: &str, axles: usize, f: &mut Faults) {
        let [a, b] = self.axles;
        f.check(
            a >= 1 && b >= 1 && a <= axles && b <= axles && a != b,
            &format!("{path}.axles"),
            format!("{:?}", self.axles),
            &format!("two different axles from 1 to {axles}"),
        );
        for (name, x) in [
            ("driveshaft_inertia", self.driveshaft_inertia),
            ("front_shaft_inertia", self.front_shaft_inertia),
            ("rear_shaft_inertia", self.rear_shaft_inertia),
            ("front_box_inertia", self.front_box_inertia),
            ("rear_box_inertia", self.rear_box_inertia),
            ("front_gear", self.front_gear),
            ("rear_gear", self.rear_gear),
        ] {
            f.positive(&format!("{path}.{name}"), x);
        }
        f.not_negative(&format!("{path}.axle_lock_torque"), self.axle_lock_torque);
        f.not_negative(&format!("{path}.central_lock_torque"), self.central_lock_torque);
    }

    fn driven(&self) -> Vec<usize> {
        self.axles.to_vec()
    }

    fn build(&self, m: &mut Model, corners: &[[Corner; 2]], gearbox_inertia: f64) -> DrivelineBuilt {
        let front = axle_shafts(m, "front", &corners[self.axles[0] - 1]);
        let rear = axle_shafts(m, "rear", &corners[self.axles[1] - 1]);
        let s = &mut m.shafts;
        let drive = s.shaft("driveshaft", self.driveshaft_inertia + gearbox_inertia);
        let to_front = s.shaft("front driveshaft", self.front_shaft_inertia);
        let to_rear = s.shaft("rear driveshaft", self.rear_shaft_inertia);
        let front_box = s.shaft("front differential box", self.front_box_inertia);
        let rear_box = s.shaft("rear differential box", self.rear_box_inertia);
        s.differential("central differential", drive, [to_front, to_rear], -1.0);
        s.gear("front conical gear", to_front, front_box, self.front_gear, Vec3::x(), Vec3::y());
        s.gear("rear conical gear", to_rear, rear_box, self.rear_gear, Vec3::x(), Vec3::y());
        s.differential("front differential", front_box, front, -1.0);
        s.differential("rear differential", rear_box, rear, -1.0);
        let mut locks = Vec::new();
        if self.central_locked {
            locks.push((m.clutch(to_front, to_rear), self.central_lock_torque));
        }
        if self.axle_locked {
            locks.push((m.clutch(front[0], front[1]), self.axle_lock_torque));
            locks.push((m.clutch(rear[0], rear[1]), self.axle_lock_torque));
        }
        DrivelineBuilt::Shafts { input: drive, locks }
    }
}
