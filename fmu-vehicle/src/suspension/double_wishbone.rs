//! Double wishbone: upper and lower control arm, upright, spindle, tie rod.
//!
//! Joints of each side: spindle-upright revolute; each arm-chassis revolute about the line through its two chassis points; each
//! arm-upright spherical; tie rod as a distance. Spring and shock between chassis and lower arm. Body axes: those of the arms lie
//! in the arm (u along the hinge, w normal to the plane of its three points), upright and spindle have the chassis's.

use super::elements::{MassSpec, ShockSpec, SpringSpec, StopsSpec};
use super::side::{elements, sides};
use super::{AxleContext, Corner, Template};
use crate::mbs::Model;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{Mat3, Quat, Vec3, rotation};

/// Specification of a double wishbone axle; points are of the left side, the right is its mirror image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DoubleWishbone {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// Spindle without wheel; axes of the chassis.
    pub spindle: MassSpec,
    /// Upright; axes of the chassis.
    pub upright: MassSpec,
    /// Upper control arm; axes (u, v, w) of the arm.
    pub upper_arm: MassSpec,
    /// Lower control arm; axes (u, v, w) of the arm.
    pub lower_arm: MassSpec,
    /// Inertia of the axle shaft (kg m2), above 0.
    pub axle_inertia: f64,
    /// Camber of the wheel at the design position (rad, top outboard positive).
    #[serde(default)]
    pub camber: f64,
    /// Toe at the design position (rad, inward positive).
    #[serde(default)]
    pub toe: f64,
    /// Hardpoints (m) from the suspension's origin.
    pub points: DoubleWishbonePoints,
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
pub struct DoubleWishbonePoints {
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
    /// Upper arm's centre of mass.
    pub upper_com: [f64; 3],
    /// Lower arm, front chassis point.
    pub lower_front: [f64; 3],
    /// Lower arm, back chassis point.
    pub lower_back: [f64; 3],
    /// Lower arm, ball joint of the upright.
    pub lower_outer: [f64; 3],
    /// Lower arm's centre of mass.
    pub lower_com: [f64; 3],
    /// Shock on the chassis.
    pub shock_chassis: [f64; 3],
    /// Shock on the lower arm.
    pub shock_arm: [f64; 3],
    /// Spring on the chassis.
    pub spring_chassis: [f64; 3],
    /// Spring on the lower arm.
    pub spring_arm: [f64; 3],
    /// Tie rod's inner end, on chassis or steering link.
    pub tie_rod_chassis: [f64; 3],
    /// Tie rod's outer end, on the upright.
    pub tie_rod_upright: [f64; 3],
}

/// Axes of a control arm from its points: (u along the hinge, v, w normal to the plane).
pub(crate) fn arm_axes(front: &Vec3, back: &Vec3, outer: &Vec3) -> Quat {
    let u = (front - back).normalize();
    let w = (back - outer).cross(&(front - outer)).normalize();
    let r = Mat3::from_columns(&[u, w.cross(&u), w]);
    Quat::from_matrix(&r)
}

/// Three points of an arm must span a plane.
pub(crate) fn check_plane(path: &str, front: [f64; 3], back: [f64; 3], outer: [f64; 3], f: &mut Faults) {
    let (a, b, c) = (Vec3::from(front), Vec3::from(back), Vec3::from(outer));
    f.check(
        (b - c).cross(&(a - c)).norm() > 1e-6,
        path,
        format!("front {front:?}, back {back:?}, outer {outer:?}"),
        "three points that span a plane",
    );
}

impl Template for DoubleWishbone {
    fn check(&self, path: &str, f: &mut Faults) {
        let bodies = [
            ("spindle", &self.spindle),
            ("upright", &self.upright),
            ("upper_arm", &self.upper_arm),
            ("lower_arm", &self.lower_arm),
        ];
        elements!(self).check(path, &bodies, f);
        f.within(&format!("{path}.camber"), self.camber, -0.3, 0.3);
        f.within(&format!("{path}.toe"), self.toe, -0.3, 0.3);
        let h = &self.points;
        check_plane(&format!("{path}.points.upper_*"), h.upper_front, h.upper_back, h.upper_outer, f);
        check_plane(&format!("{path}.points.lower_*"), h.lower_front, h.lower_back, h.lower_outer, f);
    }

    fn build(&self, m: &mut Model, c: &AxleContext) -> [Corner; 2] {
        let h = &self.points;
        sides(m, c, |s| {
            let upright = s.body("upright", &self.upright, h.upright_com);
            let axes = arm_axes(&s.at(h.upper_front), &s.at(h.upper_back), &s.at(h.upper_outer));
            let upper = s.turned("upper arm", &self.upper_arm, h.upper_com, axes);
            let axes = arm_axes(&s.at(h.lower_front), &s.at(h.lower_back), &s.at(h.lower_outer));
            let lower = s.turned("lower arm", &self.lower_arm, h.lower_com, axes);
            s.chassis_hinge("upper arm hinge", upper, h.upper_front, h.upper_back);
            s.chassis_hinge("lower arm hinge", lower, h.lower_front, h.lower_back);
            s.ball("upper ball joint", upper, upright, h.upper_outer);
            s.ball("lower ball joint", lower, upright, h.lower_outer);
            s.tie_rod("tie rod", upright, h.tie_rod_chassis, h.tie_rod_upright);
            let wheel = rotation::exp(&Vec3::new(0.0, 0.0, -s.sign * self.toe))
                * rotation::exp(&Vec3::new(-s.sign * self.camber, 0.0, 0.0));
            s.corner(
                (&self.spindle, h.spindle, wheel),
                (upright, lower),
                &elements!(self),
                [h.spring_chassis, h.spring_arm],
                [h.shock_chassis, h.shock_arm],
            )
        })
    }
}
