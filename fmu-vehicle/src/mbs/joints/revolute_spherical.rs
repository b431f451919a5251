//! Revolute-spherical joint: a massless link, hinged at one end, with a ball joint at the other. 2 rows.

use crate::mbs::{BodyId, Model, Primitive};
use terramech_mechanics::Vec3;

impl Model {
    /// A link hinged to `a` at `pa_w` about `axis_w`, with a ball joint to `b` at `pb_w` (m).
    pub fn revolute_spherical(&mut self, name: &str, a: BodyId, b: BodyId, pa_w: &Vec3, axis_w: &Vec3, pb_w: &Vec3) {
        let j = self.joint(name);
        let n = self.unit(j, "axis", axis_w);
        let length = (pa_w - pb_w).norm();
        if length < 1e-6 {
            self.fault(j, format!("its two ends coincide at {pa_w:?}"));
            return;
        }
        let (p_ap, p_bp) = (self.local_point(a, pa_w), self.local_point(b, pb_w));
        self.constrain(j, Primitive::Distance { p_ap, p_bp, length }, a, b);
        // The ball stays in the plane the link sweeps; the design position tells which.
        let offset = n.dot(&(pb_w - pa_w));
        let n_a = self.local_direction(a, &n);
        self.constrain(j, Primitive::Offset { n_a, p_ap, p_bp, offset, drive: None }, a, b);
    }
}
