//! Plane walls: the box around the bed, or single planes.

use super::grains::Row;
use super::vec3::Vec3;
use serde::{Deserialize, Serialize};

/// A fixed plane: grains are on the side its normal points to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wall {
    /// A point of the plane (m).
    pub point: Vec3,
    /// Unit normal, into the bed.
    pub normal: Vec3,
    /// Material index.
    pub material: usize,
}

impl Wall {
    /// Signed distance of a grain's centre (m).
    #[inline(always)]
    pub fn distance(&self, row: &Row) -> f64 {
        (row[0] - self.point[0]) * self.normal[0]
            + (row[1] - self.point[1]) * self.normal[1]
            + (row[2] - self.point[2]) * self.normal[2]
    }

    /// Floor at z = 0 and four side walls of a box centred on the origin; `length` along x, `width` along y (m). No lid.
    /// Order: floor, -x, +x, -y, +y.
    pub fn open_box(length: f64, width: f64, floor: usize, sides: usize) -> Vec<Self> {
        let wall = |point, normal, material| Self { point, normal, material };
        vec![
            wall([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], floor),
            wall([-0.5 * length, 0.0, 0.0], [1.0, 0.0, 0.0], sides),
            wall([0.5 * length, 0.0, 0.0], [-1.0, 0.0, 0.0], sides),
            wall([0.0, -0.5 * width, 0.0], [0.0, 1.0, 0.0], sides),
            wall([0.0, 0.5 * width, 0.0], [0.0, -1.0, 0.0], sides),
        ]
    }
}
