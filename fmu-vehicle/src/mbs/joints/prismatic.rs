//! Prismatic joint: sliding along an axis without turning. 5 rows.

use super::frame;
use crate::mbs::{BodyId, Model, Primitive};
use terramech_mechanics::Vec3;

impl Model {
    /// A slider of `b` on `a` through `p_w` (m) along `axis_w`.
    pub fn prismatic(&mut self, name: &str, a: BodyId, b: BodyId, p_w: &Vec3, axis_w: &Vec3) {
        let j = self.joint(name);
        let n = self.unit(j, "axis", axis_w);
        let (u, w) = frame(&n);
        let (p_ap, p_bp) = (self.local_point(a, p_w), self.local_point(b, p_w));
        for d in [u, w] {
            let n_a = self.local_direction(a, &d);
            self.constrain(j, Primitive::Offset { n_a, p_ap, p_bp, offset: 0.0, drive: None }, a, b);
        }
        self.no_turning(j, a, b, &u, &w, &n);
    }

    /// Three rows that hold the relative orientation.
    pub(super) fn no_turning(&mut self, j: usize, a: BodyId, b: BodyId, u: &Vec3, w: &Vec3, n: &Vec3) {
        for (d, e) in [(u, w), (w, n), (n, u)] {
            let (u_a, c_b) = (self.local_direction(a, d), self.local_direction(b, e));
            self.constrain(j, Primitive::Perpendicular { u_a, c_b }, a, b);
        }
    }
}
