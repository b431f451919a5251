//! Rack: a slider whose displacement is prescribed. 6 rows.

use crate::mbs::primitive::DriveId;
use crate::mbs::{BodyId, Model, Primitive};
use terramech_mechanics::Vec3;

impl Model {
    /// A rack `b` sliding on `a` through `p_w` (m) along `axis_w`, its displacement (m) prescribed.
    pub fn rack(&mut self, name: &str, a: BodyId, b: BodyId, p_w: &Vec3, axis_w: &Vec3) -> DriveId {
        self.prismatic(name, a, b, p_w, axis_w);
        let j = self.last_joint();
        let n = self.unit(j, "axis", axis_w);
        let drive = self.drive();
        let (p_ap, p_bp) = (self.local_point(a, p_w), self.local_point(b, p_w));
        let n_a = self.local_direction(a, &n);
        self.constrain(j, Primitive::Offset { n_a, p_ap, p_bp, offset: 0.0, drive: Some(drive) }, a, b);
        drive
    }
}
