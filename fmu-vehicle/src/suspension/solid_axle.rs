//! Solid axle: both wheels turn in one tube, which hangs on two lower and two upper links.
//!
//! Joints: spindle-tube revolute on both sides; four links as distances, the upper ones slanted so that they hold the tube sideways.

use super::elements::{MassSpec, ShockSpec, SpringSpec, StopsSpec, spring_and_shock};
use super::{AxleContext, Corner, SIDES, Template, at};
use crate::mbs::Model;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{Quat, Vec3};

/// Specification of a solid axle without steering.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidAxle {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// Spindle without wheel; axes of the chassis.
    pub spindle: MassSpec,
    /// Axle tube with differential; axes of the chassis, centre of mass in the middle plane.
    pub axle: MassSpec,
    /// Inertia of the axle shaft (kg m2), above 0.
    pub axle_inertia: f64,
    /// Hardpoints (m) of the left side, from the suspension's origin.
    pub points: SolidAxlePoints,
    /// Main spring, between `spring_chassis` and `spring_axle`.
    pub spring: SpringSpec,
    /// Stops of the spring's length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stops: Option<StopsSpec>,
    /// Shock absorber, between `shock_chassis` and `shock_axle`.
    pub shock: ShockSpec,
}

/// Hardpoints (m) of the left side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidAxlePoints {
    /// Wheel centre: spindle's centre of mass.
    pub spindle: [f64; 3],
    /// Tube's centre of mass; its y counts as 0.
    pub axle_com: [f64; 3],
    /// Upper link on the chassis.
    pub upper_chassis: [f64; 3],
    /// Upper link on the tube.
    pub upper_axle: [f64; 3],
    /// Lower link on the chassis.
    pub lower_chassis: [f64; 3],
    /// Lower link on the tube.
    pub lower_axle: [f64; 3],
    /// Spring on the chassis.
    pub spring_chassis: [f64; 3],
    /// Spring on the tube.
    pub spring_axle: [f64; 3],
    /// Shock on the chassis.
    pub shock_chassis: [f64; 3],
    /// Shock on the tube.
    pub shock_axle: [f64; 3],
}

impl Template for SolidAxle {
    fn check(&self, path: &str, f: &mut Faults) {
        self.spindle.check(&format!("{path}.spindle"), f);
        self.axle.check(&format!("{path}.axle"), f);
        f.positive(&format!("{path}.axle_inertia"), self.axle_inertia);
        self.spring.check(&format!("{path}.spring"), f);
        if let Some(s) = &self.stops {
            s.check(&format!("{path}.stops"), f);
        }
        self.shock.check(&format!("{path}.shock"), f);
    }

    fn build(&self, m: &mut Model, c: &AxleContext) -> [Corner; 2] {
        let h = &self.points;
        let middle = at(c, 1.0, [h.axle_com[0], 0.0, h.axle_com[2]]);
        let axle = self.axle.add(m, &format!("{} tube", c.name), middle, Quat::identity());
        SIDES.map(|(side_name, side)| {
            let name = |part: &str| format!("{} {side_name} {part}", c.name);
            let p = |x: [f64; 3]| at(c, side, x);
            let center = p(h.spindle);
            let spindle = self.spindle.add(m, &name("spindle"), center, Quat::identity());
            m.revolute(&name("wheel bearing"), axle, spindle, &center, &Vec3::y());
            m.distance(&name("upper link"), c.chassis, axle, &p(h.upper_chassis), &p(h.upper_axle));
            m.distance(&name("lower link"), c.chassis, axle, &p(h.lower_chassis), &p(h.lower_axle));
            let (spring, shock) = spring_and_shock(
                m,
                &name("suspension"),
                (c.chassis, axle),
                (p(h.spring_chassis), p(h.spring_axle)),
                (p(h.shock_chassis), p(h.shock_axle)),
                (&self.spring, self.stops.as_ref(), &self.shock),
            );
            Corner { spindle, upright: axle, center, axle_inertia: self.axle_inertia, spring, shock }
        })
    }
}
