//! Parts of the apparatuses: bodies that are moved, all of analytic shape.

use crate::dem::vec3::Vec3;
use crate::dem::{BodyTouch, Shape};

/// Half of a shear box: everything beyond two planes across x, above a height or below it; it moves along x. What lies under
/// the edge of the upper half, or over that of the lower one, rests against a shelf.
pub struct Frame {
    /// Where the two planes are at the communication point (m).
    pub start: [f64; 2],
    /// Height of the edge (m).
    pub edge: f64,
    /// Above the edge, else below it.
    pub upper: bool,
    /// Speed along x (m/s).
    pub speed: f64,
    now: [f64; 2],
}

impl Frame {
    /// A frame at its communication point.
    pub fn new(start: [f64; 2], edge: f64, upper: bool, speed: f64) -> Self {
        Self { start, edge, upper, speed, now: start }
    }
}

fn touch(centre: Vec3, radius: f64, distance: f64, normal: Vec3, velocity: Vec3, out: &mut Vec<BodyTouch>) {
    if distance < radius {
        out.push(BodyTouch {
            overlap: radius - distance,
            weight: 1.0,
            share: 1.0,
            normal,
            point: std::array::from_fn(|c| centre[c] - distance * normal[c]),
            velocity,
            angular_velocity: [0.0; 3],
            vertices: [u32::MAX; 3],
            weights: [0.0; 3],
        });
    }
}

impl Shape for Frame {
    fn move_to(&mut self, t: f64) {
        self.now = self.start.map(|x| x + self.speed * t);
    }
    fn bounds(&self) -> [Vec3; 2] {
        let far = f64::INFINITY;
        let [low, high] = if self.upper { [self.edge, far] } else { [-far, self.edge] };
        [[-far, -far, low], [far, far, high]]
    }
    fn touches(&self, centre: Vec3, radius: f64, out: &mut Vec<BodyTouch>) {
        let v = [self.speed, 0.0, 0.0];
        let up = if self.upper { -1.0 } else { 1.0 };
        let over = up * (centre[2] - self.edge);
        for (beside, side) in [(centre[0] - self.now[0], 1.0), (self.now[1] - centre[0], -1.0)] {
            if beside > 0.0 && over > 0.0 {
                let d = beside.hypot(over);
                touch(centre, radius, d, [side * beside / d, 0.0, up * over / d], v, out);
            } else if beside > over {
                touch(centre, radius, beside, [side, 0.0, 0.0], v, out);
            } else {
                touch(centre, radius, over, [0.0, 0.0, up], v, out);
            }
        }
    }
    fn centre(&self) -> Vec3 {
        [0.5 * (self.now[0] + self.now[1]), 0.0, self.edge]
    }
}

/// A plate or punch that is moved up and down: a box, sides along the axes, endless along y.
pub struct Punch {
    /// Half its width along x (m); infinite for a lid.
    pub half: f64,
    /// Height of its lower face at the communication point (m).
    pub start: f64,
    /// Velocity along x and z (m/s).
    pub velocity: [f64; 2],
    now: f64,
}

impl Punch {
    /// A punch at its communication point, centred on x = 0.
    pub fn new(half: f64, start: f64, velocity: [f64; 2]) -> Self {
        Self { half, start, velocity, now: start }
    }
}

impl Shape for Punch {
    fn move_to(&mut self, t: f64) {
        self.now = self.start + self.velocity[1] * t;
    }
    fn bounds(&self) -> [Vec3; 2] {
        [[-self.half, f64::NEG_INFINITY, self.now], [self.half, f64::INFINITY, f64::INFINITY]]
    }
    fn touches(&self, centre: Vec3, radius: f64, out: &mut Vec<BodyTouch>) {
        let (beside, above) = (centre[0].abs() - self.half, self.now - centre[2]);
        let side = if centre[0] < 0.0 { -1.0 } else { 1.0 };
        let v = [self.velocity[0], 0.0, self.velocity[1]];
        if beside > 0.0 && above > 0.0 {
            let d = beside.hypot(above);
            touch(centre, radius, d, [side * beside / d, 0.0, -above / d], v, out);
        } else if beside > above {
            touch(centre, radius, beside, [side, 0.0, 0.0], v, out);
        } else {
            touch(centre, radius, above, [0.0, 0.0, -1.0], v, out);
        }
    }
    fn centre(&self) -> Vec3 {
        [0.0, 0.0, self.now]
    }
}
