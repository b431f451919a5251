//! Distance joint: a massless rod with ball joints at its ends. 1 row.

use crate::mbs::{BodyId, Model, Primitive};
use terramech_mechanics::Vec3;

impl Model {
    /// A rod from `pa_w` on `a` to `pb_w` on `b` (m), of the length they have at the design position.
    pub fn distance(&mut self, name: &str, a: BodyId, b: BodyId, pa_w: &Vec3, pb_w: &Vec3) {
        self.distance_of(name, a, b, pa_w, pb_w, (pa_w - pb_w).norm());
    }

    /// As [`Self::distance`] with a length (m) of its own: an adjusted tie rod, found at assembly.
    pub fn distance_of(&mut self, name: &str, a: BodyId, b: BodyId, pa_w: &Vec3, pb_w: &Vec3, length: f64) {
        let j = self.joint(name);
        if !(length.is_finite() && length > 1e-6) || (pa_w - pb_w).norm() < 1e-9 {
            self.fault(
                j,
                format!("a rod of length {length} m between {pa_w:?} and {pb_w:?}; it needs two different points"),
            );
            return;
        }
        let (p_ap, p_bp) = (self.local_point(a, pa_w), self.local_point(b, pb_w));
        self.constrain(j, Primitive::Distance { p_ap, p_bp, length }, a, b);
    }
}
