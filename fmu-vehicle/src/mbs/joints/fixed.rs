//! Fixed joint: two bodies as one. 6 rows.

use crate::mbs::{BodyId, Model, Primitive};
use terramech_mechanics::Vec3;

impl Model {
    /// Fixes `b` to `a`; the rows act at `p_w` (m).
    pub fn fixed(&mut self, name: &str, a: BodyId, b: BodyId, p_w: &Vec3) {
        let j = self.joint(name);
        let (p_ap, p_bp) = (self.local_point(a, p_w), self.local_point(b, p_w));
        self.constrain(j, Primitive::Coincident { p_ap, p_bp }, a, b);
        self.no_turning(j, a, b, &Vec3::x(), &Vec3::y(), &Vec3::z());
    }
}
