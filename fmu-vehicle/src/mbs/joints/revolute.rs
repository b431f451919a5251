//! Revolute joint: a point and an axis in common. 5 rows; with a motor 6.

use super::frame;
use crate::mbs::primitive::DriveId;
use crate::mbs::{BodyId, Model, Primitive};
use terramech_mechanics::Vec3;

impl Model {
    /// A hinge of `a` and `b` at `p_w` (m) about `axis_w`.
    pub fn revolute(&mut self, name: &str, a: BodyId, b: BodyId, p_w: &Vec3, axis_w: &Vec3) {
        let j = self.joint(name);
        self.hinge(j, a, b, p_w, axis_w);
    }

    /// A hinge whose angle (of `b` against `a`, right-handed about `axis_w`, 0 at the design position) is prescribed.
    pub fn revolute_motor(&mut self, name: &str, a: BodyId, b: BodyId, p_w: &Vec3, axis_w: &Vec3) -> DriveId {
        let j = self.joint(name);
        let n = self.hinge(j, a, b, p_w, axis_w);
        let drive = self.drive();
        let (u, w) = frame(&n);
        let row = Primitive::DrivenAngle {
            u_a: self.local_direction(a, &u),
            w_a: self.local_direction(a, &w),
            c_b: self.local_direction(b, &u),
            drive,
        };
        self.constrain(j, row, a, b);
        drive
    }

    fn hinge(&mut self, j: usize, a: BodyId, b: BodyId, p_w: &Vec3, axis_w: &Vec3) -> Vec3 {
        let n = self.unit(j, "axis", axis_w);
        let (p_ap, p_bp) = (self.local_point(a, p_w), self.local_point(b, p_w));
        self.constrain(j, Primitive::Coincident { p_ap, p_bp }, a, b);
        let (u, w) = frame(&n);
        let c_b = self.local_direction(b, &n);
        for d in [u, w] {
            let u_a = self.local_direction(a, &d);
            self.constrain(j, Primitive::Perpendicular { u_a, c_b }, a, b);
        }
        n
    }
}
