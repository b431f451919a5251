//! Steering templates: one file each.

mod pitman_arm;
mod rack_pinion;

pub use pitman_arm::PitmanArm;
pub use rack_pinion::RackPinion;

use crate::mbs::primitive::DriveId;
use crate::mbs::{BodyId, Model};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;

/// A steering, by the name of its template.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[allow(clippy::large_enum_variant)] // one or two in a vehicle, read once
pub enum Steering {
    /// Pitman arm, link and idler.
    PitmanArm(PitmanArm),
    /// Rack and pinion.
    RackPinion(RackPinion),
}

/// What the rest of the vehicle uses of a steering.
#[derive(Clone, Copy, Debug)]
pub struct SteeringBuilt {
    /// The part that the tie rods' inner ends are fixed to.
    pub link: BodyId,
    /// The prescribed motion.
    pub drive: DriveId,
    /// Its value (rad or m) at steering input +1, full left.
    pub full: f64,
}

/// A steering template.
pub trait SteeringTemplate {
    /// Collects what is wrong with its numbers.
    fn check(&self, path: &str, faults: &mut Faults);
    /// Adds it to a model; the chassis frame is the inertial one.
    fn build(&self, model: &mut Model, name: &str, chassis: BodyId) -> SteeringBuilt;
}

impl Steering {
    /// The template behind the name.
    pub fn template(&self) -> (&'static str, &dyn SteeringTemplate) {
        match self {
            Self::PitmanArm(s) => ("pitman_arm", s),
            Self::RackPinion(s) => ("rack_pinion", s),
        }
    }
}
