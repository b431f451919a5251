//! Pitman arm steering: a driven arm and an idler carry the link between them, as a parallelogram.
//!
//! Arm-chassis: revolute with prescribed angle. Arm-link: universal. Idler: revolute-spherical (a massless arm) from chassis to link.

use super::{SteeringBuilt, SteeringTemplate};
use crate::mbs::{BodyId, Model};
use crate::suspension::elements::MassSpec;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{Vec3, rotation};

/// Specification of a Pitman arm steering; points and directions in its own frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PitmanArm {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// Origin of the steering's frame in the chassis (m).
    pub origin: [f64; 3],
    /// Orientation of the steering's frame in the chassis: unit quaternion (w, x, y, z).
    pub orientation: [f64; 4],
    /// Link; axes of the steering's frame.
    pub link: MassSpec,
    /// Link's centre of mass (m).
    pub link_com: [f64; 3],
    /// Pitman arm; axes of the steering's frame.
    pub arm: MassSpec,
    /// Arm's centre of mass (m).
    pub arm_com: [f64; 3],
    /// Hinge of the arm on the chassis (m).
    pub arm_point: [f64; 3],
    /// Axis of that hinge.
    pub arm_axis: [f64; 3],
    /// Angle of the arm (rad, right-handed about `arm_axis`) at steering input +1, full left.
    pub full_left_angle: f64,
    /// Cross joint of arm and link (m).
    pub universal_point: [f64; 3],
    /// The cross's axis in the arm.
    pub universal_axis_arm: [f64; 3],
    /// The cross's axis in the link.
    pub universal_axis_link: [f64; 3],
    /// Hinge of the idler on the chassis (m).
    pub idler_chassis: [f64; 3],
    /// Ball joint of the idler on the link (m).
    pub idler_link: [f64; 3],
    /// Axis of the idler's hinge.
    pub idler_axis: [f64; 3],
}

impl SteeringTemplate for PitmanArm {
    fn check(&self, path: &str, f: &mut Faults) {
        self.link.check(&format!("{path}.link"), f);
        self.arm.check(&format!("{path}.arm"), f);
        if let Err(e) = rotation::from_wxyz(self.orientation) {
            f.add(format!("'{path}.orientation': {e}"));
        }
        f.within(&format!("{path}.full_left_angle"), self.full_left_angle, -1.5, 1.5);
    }

    fn build(&self, m: &mut Model, name: &str, chassis: BodyId) -> SteeringBuilt {
        let q = rotation::from_wxyz(self.orientation).unwrap_or_default();
        let p = |x: [f64; 3]| Vec3::from(self.origin) + q * Vec3::from(x);
        let d = |x: [f64; 3]| q * Vec3::from(x);
        let part = |s: &str| format!("{name} {s}");
        let arm = self.arm.add(m, &part("Pitman arm"), p(self.arm_com), q);
        let link = self.link.add(m, &part("link"), p(self.link_com), q);
        m.hub(arm);
        m.hub(link);
        let drive = m.revolute_motor(&part("Pitman arm hinge"), chassis, arm, &p(self.arm_point), &d(self.arm_axis));
        let (da, dl) = (d(self.universal_axis_arm), d(self.universal_axis_link));
        m.universal(&part("Pitman arm cross"), arm, link, &p(self.universal_point), &da, &dl);
        let axis = d(self.idler_axis);
        m.revolute_spherical(&part("idler"), chassis, link, &p(self.idler_chassis), &axis, &p(self.idler_link));
        SteeringBuilt { link, drive, full: self.full_left_angle }
    }
}
