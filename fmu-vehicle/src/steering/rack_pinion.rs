//! Rack and pinion steering: the link slides along the chassis's y axis by a prescribed displacement.

use super::{SteeringBuilt, SteeringTemplate};
use crate::mbs::{BodyId, Model};
use crate::suspension::elements::MassSpec;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{Quat, Vec3};

/// Specification of a rack and pinion steering.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RackPinion {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// Rack; axes of the chassis.
    pub rack: MassSpec,
    /// Rack's centre of mass in the chassis (m).
    pub rack_com: [f64; 3],
    /// Angle of the pinion (rad) at steering input +1, full left; positive.
    pub full_angle: f64,
    /// Radius of the pinion (m), above 0.
    pub pinion_radius: f64,
    /// Whether the rack moves to the left (+1: tie rods ahead of the axle) or to the right (-1: behind it) for a turn to the left.
    pub direction: f64,
}

impl SteeringTemplate for RackPinion {
    fn check(&self, path: &str, f: &mut Faults) {
        self.rack.check(&format!("{path}.rack"), f);
        f.positive(&format!("{path}.full_angle"), self.full_angle);
        f.positive(&format!("{path}.pinion_radius"), self.pinion_radius);
        f.check(self.direction.abs() == 1.0, &format!("{path}.direction"), self.direction, "1 or -1");
    }

    fn build(&self, m: &mut Model, name: &str, chassis: BodyId) -> SteeringBuilt {
        let p: Vec3 = self.rack_com.into();
        let link = self.rack.add(m, &format!("{name} rack"), p, Quat::identity());
        m.hub(link);
        let drive = m.rack(&format!("{name} rack slide"), chassis, link, &p, &Vec3::y());
        SteeringBuilt { link, drive, full: self.direction * self.full_angle * self.pinion_radius }
    }
}
