//! Semi-trailing arm: the wheel turns in one arm, hinged to the chassis about an oblique line.
//!
//! Joints of each side: spindle-arm revolute; arm-chassis revolute.

use super::elements::{MassSpec, ShockSpec, SpringSpec, StopsSpec};
use super::side::{elements, sides};
use super::{AxleContext, Corner, Template};
use crate::mbs::Model;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::Quat;

/// Specification of a semi-trailing arm axle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SemiTrailingArm {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// Spindle without wheel; axes of the chassis.
    pub spindle: MassSpec,
    /// Semi-trailing arm; axes of the chassis.
    pub arm: MassSpec,
    /// Inertia of the axle shaft (kg m2), above 0.
    pub axle_inertia: f64,
    /// Hardpoints (m) of the left side, from the suspension's origin.
    pub points: SemiTrailingArmPoints,
    /// Main spring, between `spring_chassis` and `spring_arm`.
    pub spring: SpringSpec,
    /// Stops of the spring's length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stops: Option<StopsSpec>,
    /// Shock absorber, between `shock_chassis` and `shock_arm`.
    pub shock: ShockSpec,
}

/// Hardpoints (m) of the left side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SemiTrailingArmPoints {
    /// Wheel centre: spindle's centre of mass.
    pub spindle: [f64; 3],
    /// Arm's centre of mass.
    pub arm_com: [f64; 3],
    /// Inner point of the hinge line on the chassis.
    pub inner: [f64; 3],
    /// Outer point of the hinge line on the chassis.
    pub outer: [f64; 3],
    /// Spring on the chassis.
    pub spring_chassis: [f64; 3],
    /// Spring on the arm.
    pub spring_arm: [f64; 3],
    /// Shock on the chassis.
    pub shock_chassis: [f64; 3],
    /// Shock on the arm.
    pub shock_arm: [f64; 3],
}

impl Template for SemiTrailingArm {
    fn check(&self, path: &str, f: &mut Faults) {
        elements!(self).check(path, &[("spindle", &self.spindle), ("arm", &self.arm)], f);
    }

    fn build(&self, m: &mut Model, c: &AxleContext) -> [Corner; 2] {
        let h = &self.points;
        sides(m, c, |s| {
            let arm = s.body("arm", &self.arm, h.arm_com);
            s.chassis_hinge("arm hinge", arm, h.outer, h.inner);
            s.corner(
                (&self.spindle, h.spindle, Quat::identity()),
                (arm, arm),
                &elements!(self),
                [h.spring_chassis, h.spring_arm],
                [h.shock_chassis, h.shock_arm],
            )
        })
    }
}
