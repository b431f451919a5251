//! Spherical joint: a point in common. 3 rows.

use crate::mbs::{BodyId, Model, Primitive};
use terramech_mechanics::Vec3;

impl Model {
    /// A ball joint of `a` and `b` at `p_w` (m).
    pub fn spherical(&mut self, name: &str, a: BodyId, b: BodyId, p_w: &Vec3) {
        let j = self.joint(name);
        let (p_ap, p_bp) = (self.local_point(a, p_w), self.local_point(b, p_w));
        self.constrain(j, Primitive::Coincident { p_ap, p_bp }, a, b);
    }
}
