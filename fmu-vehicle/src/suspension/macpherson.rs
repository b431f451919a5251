//! MacPherson strut: lower control arm, upright, and a strut that slides in it.
//!
//! Joints of each side: spindle-upright revolute; arm-chassis revolute; arm-upright spherical; strut-chassis spherical; strut-upright
//! prismatic along the strut; tie rod as a distance.

use super::double_wishbone::arm_axes;
use super::elements::{MassSpec, ShockSpec, SpringSpec, StopsSpec, spring_and_shock};
use super::{AxleContext, Corner, SIDES, Template, at};
use crate::mbs::Model;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{Quat, Vec3};

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
        self.spindle.check(&format!("{path}.spindle"), f);
        self.upright.check(&format!("{path}.upright"), f);
        self.lower_arm.check(&format!("{path}.lower_arm"), f);
        self.strut.check(&format!("{path}.strut"), f);
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
            let upright = self.upright.add(m, &name("upright"), p(h.upright_com), Quat::identity());
            let (lf, lb, lu) = (p(h.lower_front), p(h.lower_back), p(h.lower_outer));
            let lower = self.lower_arm.add(m, &name("lower arm"), p(h.lower_com), arm_axes(&lf, &lb, &lu));
            let strut = self.strut.add(m, &name("strut"), p(h.strut_com), Quat::identity());
            m.revolute(&name("wheel bearing"), upright, spindle, &center, &Vec3::y());
            m.revolute(&name("lower arm hinge"), c.chassis, lower, &((lf + lb) / 2.0), &(lf - lb));
            m.spherical(&name("lower ball joint"), lower, upright, &lu);
            let (top, bottom) = (p(h.strut_top), p(h.strut_bottom));
            m.spherical(&name("strut mount"), c.chassis, strut, &top);
            m.prismatic(&name("strut slide"), upright, strut, &bottom, &(top - bottom));
            m.distance(&name("tie rod"), c.tie_rod, upright, &p(h.tie_rod_chassis), &p(h.tie_rod_upright));
            let (spring, shock) = spring_and_shock(
                m,
                &name("suspension"),
                (c.chassis, upright),
                (p(h.spring_chassis), p(h.spring_upright)),
                (p(h.shock_chassis), p(h.shock_upright)),
                (&self.spring, self.stops.as_ref(), &self.shock),
            );
            Corner { spindle, upright, center, axle_inertia: self.axle_inertia, spring, shock }
        })
    }
}
