//! Support: a point of a body at a prescribed height over the ground plane, free along it. 1 row. Test rigs and the search for equilibrium use it.

use crate::mbs::primitive::DriveId;
use crate::mbs::{BodyId, GROUND, Model, Primitive};
use terramech_mechanics::Vec3;

impl Model {
    /// Holds the height (m) of the point of `body` that is at `p_w` in the design position; the drive is added to the design height.
    pub fn support(&mut self, name: &str, body: BodyId, p_w: &Vec3) -> DriveId {
        let j = self.joint(name);
        let drive = self.drive();
        let p_bp = self.local_point(body, p_w);
        let row = Primitive::Offset { n_a: Vec3::z(), p_ap: Vec3::zeros(), p_bp, offset: p_w.z, drive: Some(drive) };
        self.constrain(j, row, GROUND, body);
        drive
    }
}
