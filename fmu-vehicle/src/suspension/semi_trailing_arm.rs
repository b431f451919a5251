//! Semi-trailing arm: the wheel turns in one arm, hinged to the chassis about an oblique line.
//!
//! Joints of each side: spindle-arm revolute; arm-chassis revolute.

use super::elements::{MassSpec, ShockSpec, SpringSpec, StopsSpec, spring_and_shock};
use super::{AxleContext, Corner, SIDES, Template, at};
use crate::mbs::Model;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{Quat, Vec3};

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
        self.spindle.check(&format!("{path}.spindle"), f);
        self.arm.check(&format!("{path}.arm"), f);
        f.positive(&format!("{path}.axle_inertia"), self.axle_inertia);
        self.spring.check(&format!("{path}.spring"), f);
        if let Some(s) = &self.stops {
            s.check(&format!("{path}.stops"), f);
        }
        self.shock.check(&format!("{path}.shock"), f);
    }

    fn build(&self, m: &mut Model, c: &AxleContext) -> [Corner; 2] {
        SIDES.map(|(side_name, side)| {
            let name = |part: &str| format!("{} {side_name} {part}", c.name);
            let p = |x: [f64; 3]| at(c, side, x);
            let h = &self.points;
            let center = p(h.spindle);
            let spindle = self.spindle.add(m, &name("spindle"), center, Quat::identity());
            let arm = self.arm.add(m, &name("arm"), p(h.arm_com), Quat::identity());
            let (inner, outer) = (p(h.inner), p(h.outer));
            m.revolute(&name("wheel bearing"), arm, spindle, &center, &Vec3::y());
            m.revolute(&name("arm hinge"), c.chassis, arm, &((inner + outer) / 2.0), &(outer - inner));
            let (spring, shock) = spring_and_shock(
                m,
                &name("suspension"),
                (c.chassis, arm),
                (p(h.spring_chassis), p(h.spring_arm)),
                (p(h.shock_chassis), p(h.shock_arm)),
                (&self.spring, self.stops.as_ref(), &self.shock),
            );
            Corner { spindle, upright: arm, center, axle_inertia: self.axle_inertia, spring, shock }
        })
    }
}
