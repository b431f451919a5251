//! Solid axle: both wheels turn in one tube, which hangs on two lower and two upper links.
//!
//! Joints: spindle-tube revolute on both sides, or spindle-knuckle and knuckle-tube (kingpin) where it steers; four links as distances, the upper
//! ones slanted so that they hold the tube sideways; tie rod and drag link as distances.

use super::elements::{MassSpec, ShockSpec, SpringSpec, StopsSpec};
use super::side::{elements, sides};
use super::{AxleContext, Corner, Template};
use crate::mbs::Model;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{Quat, Vec3};

/// Specification of a solid axle.
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
    /// Knuckles and rods of an axle that steers; null: its wheels turn in the tube.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub knuckles: Option<Knuckles>,
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

/// What steers a solid axle: knuckles that turn on kingpins in the tube, a tie rod from knuckle to knuckle, and a drag link from the steering to
/// the left one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Knuckles {
    /// Knuckle; axes of the chassis.
    pub knuckle: MassSpec,
    /// Knuckle's centre of mass (m).
    pub knuckle_com: [f64; 3],
    /// Upper point of the kingpin (m).
    pub kingpin_upper: [f64; 3],
    /// Lower point of the kingpin (m).
    pub kingpin_lower: [f64; 3],
    /// End of the tie rod on the knuckle (m); the other end is its mirror image.
    pub tie_rod: [f64; 3],
    /// Drag link's end on the steering link, or on the chassis where nothing steers (m).
    pub drag_link_chassis: [f64; 3],
    /// Drag link's end on the left knuckle (m).
    pub drag_link_knuckle: [f64; 3],
}

impl Template for SolidAxle {
    fn check(&self, path: &str, f: &mut Faults) {
        let mut bodies = vec![("spindle", &self.spindle), ("axle", &self.axle)];
        if let Some(k) = &self.knuckles {
            bodies.push(("knuckles.knuckle", &k.knuckle));
            let pin = Vec3::from(k.kingpin_upper) - Vec3::from(k.kingpin_lower);
            f.check(
                pin.norm() > 1e-3,
                &format!("{path}.knuckles.kingpin_*"),
                format!("upper {:?}, lower {:?}", k.kingpin_upper, k.kingpin_lower),
                "two points apart",
            );
        }
        elements!(self).check(path, &bodies, f);
    }

    fn build(&self, m: &mut Model, c: &AxleContext) -> [Corner; 2] {
        let h = &self.points;
        let middle = c.origin + Vec3::new(h.axle_com[0], 0.0, h.axle_com[2]);
        let axle = self.axle.add(m, &format!("{} tube", c.name), middle, Quat::identity());
        let corners = sides(m, c, |s| {
            s.rod("upper link", axle, h.upper_chassis, h.upper_axle);
            s.rod("lower link", axle, h.lower_chassis, h.lower_axle);
            let upright = match &self.knuckles {
                None => axle,
                Some(k) => {
                    let knuckle = s.body("knuckle", &k.knuckle, k.knuckle_com);
                    s.hinge("kingpin", axle, knuckle, k.kingpin_upper, k.kingpin_lower);
                    if s.sign > 0.0 {
                        s.tie_rod("drag link", knuckle, k.drag_link_chassis, k.drag_link_knuckle);
                    }
                    knuckle
                }
            };
            s.corner(
                (&self.spindle, h.spindle, Quat::identity()),
                (upright, axle),
                &elements!(self),
                [h.spring_chassis, h.spring_axle],
                [h.shock_chassis, h.shock_axle],
            )
        });
        if let Some(k) = &self.knuckles {
            let end = |side: f64| c.origin + Vec3::new(k.tie_rod[0], side * k.tie_rod[1], k.tie_rod[2]);
            let [left, right] = &corners;
            m.distance(&format!("{} tie rod", c.name), left.upright, right.upright, &end(1.0), &end(-1.0));
        }
        corners
    }
}
