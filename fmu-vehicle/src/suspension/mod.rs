//! Suspension templates: one file each. A template adds the bodies, joints and force elements of one axle to a model.
//!
//! To add one: a file with its specification (serde, schemars) that implements [`Template`] with the means of `side.rs`, a variant of [`Suspension`]
//! and a line in [`Suspension::template`].

mod double_wishbone;
pub mod elements;
mod macpherson;
mod multi_link;
mod reduced_double_wishbone;
mod semi_trailing_arm;
mod side;
mod solid_axle;

pub use double_wishbone::{DoubleWishbone, DoubleWishbonePoints};
pub use macpherson::{MacPherson, MacPhersonPoints};
pub use multi_link::{MultiLink, MultiLinkPoints};
pub use reduced_double_wishbone::{ReducedDoubleWishbone, ReducedDoubleWishbonePoints};
pub use semi_trailing_arm::{SemiTrailingArm, SemiTrailingArmPoints};
pub use solid_axle::{Knuckles, SolidAxle, SolidAxlePoints};

use crate::mbs::{BodyId, Model};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::Vec3;

/// A suspension, by the name of its template.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Suspension {
    /// Two control arms, upright, tie rod; spring and shock on the lower arm.
    DoubleWishbone(DoubleWishbone),
    /// Double wishbone with massless arms.
    ReducedDoubleWishbone(ReducedDoubleWishbone),
    /// Strut, lower arm, tie rod.
    MacPherson(MacPherson),
    /// Four rods and a tie rod.
    MultiLink(MultiLink),
    /// One arm with an oblique hinge.
    SemiTrailingArm(SemiTrailingArm),
    /// One tube on four links, with knuckles where it steers.
    SolidAxle(SolidAxle),
}

impl Suspension {
    /// The template behind the name.
    pub fn template(&self) -> (&'static str, &dyn Template) {
        match self {
            Self::DoubleWishbone(s) => ("double_wishbone", s),
            Self::ReducedDoubleWishbone(s) => ("reduced_double_wishbone", s),
            Self::MacPherson(s) => ("mac_pherson", s),
            Self::MultiLink(s) => ("multi_link", s),
            Self::SemiTrailingArm(s) => ("semi_trailing_arm", s),
            Self::SolidAxle(s) => ("solid_axle", s),
        }
    }
}

/// What a template needs to know of the vehicle. Everything is at the design position, where the chassis frame is the inertial one.
pub struct AxleContext {
    /// Name in messages, "axle 1".
    pub name: String,
    /// Origin of the template's points in the chassis frame (m).
    pub origin: Vec3,
    /// The chassis.
    pub chassis: BodyId,
    /// What the inner ends of the tie rods are fixed to: chassis or steering link.
    pub tie_rod: BodyId,
}

/// One wheel's end of a suspension.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// The turning part: carries the wheel.
    pub spindle: BodyId,
    /// The part the spindle turns in: takes the brake's reaction.
    pub upright: BodyId,
    /// Wheel centre at the design position (m).
    pub center: Vec3,
    /// Inertia of the axle shaft (kg m2).
    pub axle_inertia: f64,
    /// Index of the main spring among the model's spring-dampers.
    pub spring: usize,
    /// Index of the shock absorber.
    pub shock: usize,
}

/// A suspension template.
pub trait Template {
    /// Collects what is wrong with its numbers; `path` is the JSON path of the template.
    fn check(&self, path: &str, faults: &mut Faults);
    /// Adds an axle, left corner first.
    fn build(&self, model: &mut Model, c: &AxleContext) -> [Corner; 2];
}
