//! MacPherson strut: lower control arm, upright, and a strut that slides in it.
//!
//! Joints of each side: spindle-upright revolute; arm-chassis revolute; arm-upright spherical; strut-chassis spherical; strut-upright
//! prismatic along the strut; tie rod as a distance.

use super::double_wishbone::{arm_axes, check_plane};
use super::elements::{MassSpec, ShockSpec, SpringSpec, StopsSpec};
use super::side::{elements, sides};
use super::{AxleContext, Corner, Template};
use crate::mbs::Model;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::Quat;

/// Specification of a MacPherson axle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MacPherson {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// Spindle without wheel; axes of the chassis.
    pub spindle: MassSpec,
    /// Upright; axes of the chassis.
    pub upright: MassSpec,
    /// Lower control arm; axes (u, v, w) of the arm.
    pub lower_arm: MassSpec,
    /// Upper part of the strut; axes of the chassis.
    pub strut: MassSpec,
    /// Inertia of the axle shaft (kg m2), above 0.
    pub axle_inertia: f64,
    /// Hardpoints (m) of the left side, from the suspension's origin.
    pub points: MacPhersonPoints,
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
pub struct MacPhersonPoints {
    /// Wheel centre: spindle's centre of mass.
    pub spindle: [f64; 3],
    /// Upright's centre of mass.
    pub upright_com: [f64; 3],
    /// Lower arm, front chassis point.
    pub lower_front: [f64; 3],
    /// Lower arm, back chassis point.
    pub lower_back: [f64; 3],
    /// Lower arm, ball joint of the upright.
    pub lower_outer: [f64; 3],
    /// Lower arm's centre of mass.
    pub lower_com: [f64; 3],
    /// Strut on the chassis.
    pub strut_top: [f64; 3],
    /// Lower end of the strut, in the upright.
    pub strut_bottom: [f64; 3],
    /// Centre of mass of the strut's upper part.
    pub strut_com: [f64; 3],
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

impl Template for MacPherson {
    fn check(&self, path: &str, f: &mut Faults) {
        let bodies = [
            ("spindle", &self.spindle),
            ("upright", &self.upright),
            ("lower_arm", &self.lower_arm),
            ("strut", &self.strut),
        ];
        elements!(self).check(path, &bodies, f);
        let h = &self.points;
        check_plane(&format!("{path}.points.lower_*"), h.lower_front, h.lower_back, h.lower_outer, f);
    }

    fn build(&self, m: &mut Model, c: &AxleContext) -> [Corner; 2] {
        let h = &self.points;
        sides(m, c, |s| {
            let upright = s.body("upright", &self.upright, h.upright_com);
            let axes = arm_axes(&s.at(h.lower_front), &s.at(h.lower_back), &s.at(h.lower_outer));
            let lower = s.turned("lower arm", &self.lower_arm, h.lower_com, axes);
            let strut = s.body("strut", &self.strut, h.strut_com);
            s.chassis_hinge("lower arm hinge", lower, h.lower_front, h.lower_back);
            s.ball("lower ball joint", lower, upright, h.lower_outer);
            s.chassis_ball("strut mount", strut, h.strut_top);
            s.slide("strut slide", upright, strut, h.strut_bottom, h.strut_top);
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
