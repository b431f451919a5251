//! Universal joint: a point in common and two axes that stay perpendicular. 4 rows.

use crate::mbs::{BodyId, Model, Primitive};
use terramech_mechanics::Vec3;

impl Model {
    /// A cross joint at `p_w` (m): the cross's arm along `da_w` turns in `a`, the one along `db_w` in `b`.
    pub fn universal(&mut self, name: &str, a: BodyId, b: BodyId, p_w: &Vec3, da_w: &Vec3, db_w: &Vec3) {
        let j = self.joint(name);
        let (na, nb) = (self.unit(j, "first axis", da_w), self.unit(j, "second axis", db_w));
        if na.dot(&nb).abs() > 1e-3 {
            self.fault(j, format!("its axes {da_w:?} and {db_w:?} must be perpendicular"));
        }
        let (p_ap, p_bp) = (self.local_point(a, p_w), self.local_point(b, p_w));
        self.constrain(j, Primitive::Coincident { p_ap, p_bp }, a, b);
        let (u_a, c_b) = (self.local_direction(a, &na), self.local_direction(b, &nb));
        self.constrain(j, Primitive::Perpendicular { u_a, c_b }, a, b);
    }
}
