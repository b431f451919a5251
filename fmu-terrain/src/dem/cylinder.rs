//! The analytic cylinder: a wheel for tools that know only scalars.

use super::body::{BodyTouch, Shape};
use super::vec3::{Vec3, add, add_scaled, cross, dot, norm, scale, sub};

/// A solid cylinder, axis along the body's y, moving on with its velocity and angular velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Radius (m).
    pub radius: f64,
    /// Width along the axis (m).
    pub width: f64,
    /// Centre at the communication point (m).
    pub start: Vec3,
    /// Direction of the axis at the communication point.
    pub start_axis: Vec3,
    /// Velocity (m/s).
    pub velocity: Vec3,
    /// Angular velocity in the inertial frame (rad/s).
    pub angular_velocity: Vec3,
    centre: Vec3,
    axis: Vec3,
}

impl Cylinder {
    /// A cylinder at its communication point.
    pub fn new(radius: f64, width: f64, centre: Vec3, axis: Vec3, velocity: Vec3, angular_velocity: Vec3) -> Self {
        let axis = scale(1.0 / norm(axis), axis);
        Self { radius, width, start: centre, start_axis: axis, velocity, angular_velocity, centre, axis }
    }
}

/// Turns a vector by the rotation vector `turn` (rad) (Rodrigues).
pub fn rotate(turn: Vec3, x: Vec3) -> Vec3 {
    let angle = norm(turn);
    if angle == 0.0 {
        return x;
    }
    let k = scale(1.0 / angle, turn);
    let (s, c) = angle.sin_cos();
    add(add(scale(c, x), scale(s, cross(k, x))), scale((1.0 - c) * dot(k, x), k))
}

/// Signed distance (m) of the point `q`, from the centre, from the surface of a cylinder of this axis, radius and half length, and the
/// direction away from it.
pub fn nearest_on_cylinder(q: Vec3, axis: Vec3, radius: f64, half: f64) -> (f64, Vec3) {
    let along = dot(q, axis);
    let radial = add_scaled(q, -along, axis);
    let d = norm(radial);
    let outward = if d > 0.0 { scale(1.0 / d, radial) } else { [0.0; 3] };
    let end = if along < 0.0 { scale(-1.0, axis) } else { axis };
    let (dr, da) = (d - radius, along.abs() - half);
    if dr > 0.0 && da > 0.0 {
        let away = add_scaled(scale(dr, outward), da, end);
        let distance = norm(away);
        (distance, scale(1.0 / distance, away))
    } else if dr > da {
        (dr, outward)
    } else {
        (da, end)
    }
}

impl Shape for Cylinder {
    fn move_to(&mut self, t: f64) {
        self.centre = add_scaled(self.start, t, self.velocity);
        self.axis = rotate(scale(t, self.angular_velocity), self.start_axis);
    }

    fn bounds(&self) -> [Vec3; 2] {
        // Half extent along k: of the axis segment, and of the disc normal to the axis.
        let half = self.axis.map(|a| 0.5 * self.width * a.abs() + self.radius * (1.0 - a * a).max(0.0).sqrt());
        [sub(self.centre, half), add(self.centre, half)]
    }

    fn touches(&self, centre: Vec3, radius: f64, out: &mut Vec<BodyTouch>) {
        let q = sub(centre, self.centre);
        let (distance, normal) = nearest_on_cylinder(q, self.axis, self.radius, 0.5 * self.width);
        if distance >= radius {
            return;
        }
        let point = add_scaled(centre, -distance, normal);
        let velocity = add(self.velocity, cross(self.angular_velocity, sub(point, self.centre)));
        out.push(BodyTouch {
            overlap: radius - distance,
            weight: 1.0,
            share: 1.0,
            normal,
            point,
            velocity,
            angular_velocity: self.angular_velocity,
            vertices: [u32::MAX; 3],
            weights: [0.0; 3],
        });
    }

    fn centre(&self) -> Vec3 {
        self.centre
    }

    /// Five rings of 96 points: what it meets an obstacle in.
    fn surface(&self, out: &mut Vec<(Vec3, Vec3)>) {
        const AROUND: u32 = 96;
        const RINGS: u32 = 5;
        // Any direction across the axis: the points stay with the space, not with the turning surface, whose speed they have.
        let aside = if self.axis[0].abs() < 0.8 { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let across = cross(self.axis, aside);
        let u = scale(1.0 / norm(across), across);
        let w = cross(self.axis, u);
        for ring in 0..RINGS {
            let along = self.width * (f64::from(ring) / f64::from(RINGS - 1) - 0.5);
            for k in 0..AROUND {
                let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(AROUND)).sin_cos();
                let arm = add_scaled(scale(along, self.axis), self.radius, add(scale(c, u), scale(s, w)));
                out.push((add(self.centre, arm), add(self.velocity, cross(self.angular_velocity, arm))));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wheel() -> Cylinder {
        Cylinder::new(0.3, 0.2, [0.0; 3], [0.0, 2.0, 0.0], [0.0; 3], [0.0, 1.0, 0.0])
    }

    fn overlap(at: Vec3) -> Option<(f64, Vec3)> {
        let mut out = Vec::new();
        wheel().touches(at, 0.01, &mut out);
        out.first().map(|t| (t.overlap, t.normal))
    }

    #[test]
    fn side_cap_edge_and_inside() {
        let close = |a: Option<(f64, Vec3)>, delta: f64, n: Vec3| {
            let (d, m) = a.expect("touches");
            assert!((d - delta).abs() < 1e-12 && norm(sub(m, n)) < 1e-12, "{d} {m:?}");
        };
        close(overlap([0.0, 0.05, -0.305]), 0.005, [0.0, 0.0, -1.0]);
        close(overlap([0.1, 0.105, 0.0]), 0.005, [0.0, 1.0, 0.0]);
        close(overlap([0.298, 0.0, 0.0]), 0.012, [1.0, 0.0, 0.0]);
        let s = 0.004;
        close(overlap([0.3 + s, -0.1 - s, 0.0]), 0.01 - s * 2_f64.sqrt(), [0.5_f64.sqrt(), -(0.5_f64.sqrt()), 0.0]);
        assert!(overlap([0.0, 0.0, 0.311]).is_none());
    }

    #[test]
    fn it_moves_on_and_its_surface_has_the_rims_speed() {
        let mut w = wheel();
        w.velocity = [2.0, 0.0, 0.0];
        w.move_to(0.5);
        assert_eq!(w.centre(), [1.0, 0.0, 0.0]);
        let mut out = Vec::new();
        w.touches([1.0, 0.0, -0.305], 0.01, &mut out);
        assert!((out[0].velocity[0] - (2.0 - 0.3)).abs() < 1e-12);
    }
}
