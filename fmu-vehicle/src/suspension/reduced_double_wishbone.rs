//! Reduced double wishbone: the control arms are massless, each a pair of rods. One moving part less each side and arm.
//!
//! Joints of each side: spindle-upright revolute; four rods and the tie rod as distances.

use super::elements::{MassSpec, ShockSpec, SpringSpec, StopsSpec};
use super::side::{elements, sides};
use super::{AxleContext, Corner, Template};
use crate::mbs::Model;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::Quat;

/// Specification of a reduced double wishbone axle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReducedDoubleWishbone {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// Spindle without wheel; axes of the chassis.
    pub spindle: MassSpec,
    /// Upright; axes of the chassis.
    pub upright: MassSpec,
    /// Inertia of the axle shaft (kg m2), above 0.
    pub axle_inertia: f64,
    /// Hardpoints (m) of the left side, from the suspension's origin.
    pub points: ReducedDoubleWishbonePoints,
    /// Main spring, between `spring_chassis` and `spring_upright`.
    pub spring: SpringSpec,
    /// Stops of the spring's length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stops: Option<StopsSpec>,
    /// Shock absorber, between `shock_chassis` and `shock_upright`.
    pub shock: ShockSpec,
}

/// Hardpoints (m) of the left side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReducedDoubleWishbonePoints {
    /// Wheel centre: spindle's centre of mass.
    pub spindle: [f64; 3],
    /// Upright's centre of mass.
    pub upright_com: [f64; 3],
    /// Upper arm, front chassis point.
    pub upper_front: [f64; 3],
    /// Upper arm, back chassis point.
    pub upper_back: [f64; 3],
    /// Upper arm, ball joint of the upright.
    pub upper_outer: [f64; 3],
    /// Lower arm, front chassis point.
    pub lower_front: [f64; 3],
    /// Lower arm, back chassis point.
    pub lower_back: [f64; 3],
    /// Lower arm, ball joint of the upright.
    pub lower_outer: [f64; 3],
    /// Spring on the chassis.
    pub spring_chassis: [f64; 3],
    /// Spring on the upright.
    pub spring_upright: [f64; 3],
    /// Shock on the chassis.
    pub shock_chassis: [f64; 3],
    /// Shock on the upright.
    pub shock_upright: [f64; 3],
    /// Tie rod's inner end, on chassis or steering link.
    pub tie_rod_chassis: [f64; 3],
    /// Tie rod's outer end, on the upright.
    pub tie_rod_upright: [f64; 3],
}

impl Template for ReducedDoubleWishbone {
    fn check(&self, path: &str, f: &mut Faults) {
        elements!(self).check(path, &[("spindle", &self.spindle), ("upright", &self.upright)], f);
    }

    fn build(&self, m: &mut Model, c: &AxleContext) -> [Corner; 2] {
        let h = &self.points;
        sides(m, c, |s| {
            let upright = s.body("upright", &self.upright, h.upright_com);
            s.rod("upper front rod", upright, h.upper_front, h.upper_outer);
            s.rod("upper back rod", upright, h.upper_back, h.upper_outer);
            s.rod("lower front rod", upright, h.lower_front, h.lower_outer);
            s.rod("lower back rod", upright, h.lower_back, h.lower_outer);
            s.tie_rod("tie rod", upright, h.tie_rod_chassis, h.tie_rod_upright);
            s.corner(
                (&self.spindle, h.spindle, Quat::identity()),
                (upright, upright),
                &elements!(self),
                [h.spring_chassis, h.spring_upright],
                [h.shock_chassis, h.shock_upright],
            )
        })
    }
}
