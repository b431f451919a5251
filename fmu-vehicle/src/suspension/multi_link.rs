//! Multi-link: the upright hangs on four rods and the tie rod, each with its own points.
//!
//! Joints of each side: spindle-upright revolute; five rods as distances.

use super::elements::{MassSpec, ShockSpec, SpringSpec, StopsSpec, spring_and_shock};
use super::{AxleContext, Corner, SIDES, Template, at};
use crate::mbs::Model;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{Quat, Vec3};

/// Specification of a multi-link axle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MultiLink {
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
    pub points: MultiLinkPoints,
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
pub struct MultiLinkPoints {
    /// Wheel centre: spindle's centre of mass.
    pub spindle: [f64; 3],
    /// Upright's centre of mass.
    pub upright_com: [f64; 3],
    /// Upper front rod, on the chassis.
    pub upper_front_chassis: [f64; 3],
    /// Upper front rod, on the upright.
    pub upper_front_upright: [f64; 3],
    /// Upper back rod, on the chassis.
    pub upper_back_chassis: [f64; 3],
    /// Upper back rod, on the upright.
    pub upper_back_upright: [f64; 3],
    /// Lateral rod, on the chassis.
    pub lateral_chassis: [f64; 3],
    /// Lateral rod, on the upright.
    pub lateral_upright: [f64; 3],
    /// Trailing rod, on the chassis.
    pub trailing_chassis: [f64; 3],
    /// Trailing rod, on the upright.
    pub trailing_upright: [f64; 3],
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

impl Template for MultiLink {
    fn check(&self, path: &str, f: &mut Faults) {
        self.spindle.check(&format!("{path}.spindle"), f);
        self.upright.check(&format!("{path}.upright"), f);
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
            m.revolute(&name("wheel bearing"), upright, spindle, &center, &Vec3::y());
            for (part, inner, outer) in [
                ("upper front rod", h.upper_front_chassis, h.upper_front_upright),
                ("upper back rod", h.upper_back_chassis, h.upper_back_upright),
                ("lateral rod", h.lateral_chassis, h.lateral_upright),
                ("trailing rod", h.trailing_chassis, h.trailing_upright),
            ] {
                m.distance(&name(part), c.chassis, upright, &p(inner), &p(outer));
            }
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
