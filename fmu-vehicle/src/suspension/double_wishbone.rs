//! Double wishbone: upper and lower control arm, upright, spindle, tie rod.
//!
//! Joints of each side: spindle-upright revolute; each arm-chassis revolute about the line through its two chassis points; each
//! arm-upright spherical; tie rod as a distance. Spring and shock between chassis and lower arm. Body axes: those of the arms lie
//! in the arm (u along the hinge, w normal to the plane of its three points), upright and spindle have the chassis's.

use super::elements::{MassSpec, ShockSpec, SpringSpec, StopsSpec, spring_and_shock};
use super::{AxleContext, Corner, SIDES, Template, at};
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

impl Template for DoubleWishbone {
    fn check(&self, path: &str, f: &mut Faults) {
        self.spindle.check(&format!("{path}.spindle"), f);
        self.upright.check(&format!("{path}.upright"), f);
        self.upper_arm.check(&format!("{path}.upper_arm"), f);
        self.lower_arm.check(&format!("{path}.lower_arm"), f);
        f.positive(&format!("{path}.axle_inertia"), self.axle_inertia);
        f.within(&format!("{path}.camber"), self.camber, -0.3, 0.3);
        f.within(&format!("{path}.toe"), self.toe, -0.3, 0.3);
        let p = &self.points;
        for (name, front, back, outer) in [
            ("upper", p.upper_front, p.upper_back, p.upper_outer),
            ("lower", p.lower_front, p.lower_back, p.lower_outer),
        ] {
            let (a, b, c) = (Vec3::from(front), Vec3::from(back), Vec3::from(outer));
            let area = (b - c).cross(&(a - c)).norm();
            f.check(
                area > 1e-6,
                &format!("{path}.points.{name}_*"),
                format!("front {front:?}, back {back:?}, outer {outer:?}"),
                "three points that span a plane",
            );
        }
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
            let wheel = rotation::exp(&Vec3::new(0.0, 0.0, -side * self.toe))
                * rotation::exp(&Vec3::new(-side * self.camber, 0.0, 0.0));
            let center = p(h.spindle);
            let spindle = self.spindle.add(m, &name("spindle"), center, wheel);
            let upright = self.upright.add(m, &name("upright"), p(h.upright_com), Quat::identity());
            let (uf, ub, uu) = (p(h.upper_front), p(h.upper_back), p(h.upper_outer));
            let (lf, lb, lu) = (p(h.lower_front), p(h.lower_back), p(h.lower_outer));
            let upper = self.upper_arm.add(m, &name("upper arm"), p(h.upper_com), arm_axes(&uf, &ub, &uu));
            let lower = self.lower_arm.add(m, &name("lower arm"), p(h.lower_com), arm_axes(&lf, &lb, &lu));
            m.revolute(&name("wheel bearing"), upright, spindle, &center, &(wheel * Vec3::y()));
            m.revolute(&name("upper arm hinge"), c.chassis, upper, &((uf + ub) / 2.0), &(uf - ub));
            m.revolute(&name("lower arm hinge"), c.chassis, lower, &((lf + lb) / 2.0), &(lf - lb));
            m.spherical(&name("upper ball joint"), upper, upright, &uu);
            m.spherical(&name("lower ball joint"), lower, upright, &lu);
            m.distance(&name("tie rod"), c.tie_rod, upright, &p(h.tie_rod_chassis), &p(h.tie_rod_upright));
            let (spring, shock) = spring_and_shock(
                m,
                &name("suspension"),
                (c.chassis, lower),
                (p(h.spring_chassis), p(h.spring_arm)),
                (p(h.shock_chassis), p(h.shock_arm)),
                (&self.spring, self.stops.as_ref(), &self.shock),
            );
            Corner { spindle, upright, center, axle_inertia: self.axle_inertia, spring, shock }
        })
    }
}
