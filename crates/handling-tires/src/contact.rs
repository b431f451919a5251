//! The contact of a wheel's disc with the ground under it.

use terramech_mechanics::{RigidState, Vec3};

/// The ground under a wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// Height (m) at the point asked for.
    pub height: f64,
    /// Unit normal.
    pub normal: Vec3,
    /// Coefficient of friction.
    pub friction: f64,
}

impl Probe {
    /// Level ground.
    pub fn level(height: f64, friction: f64) -> Self {
        Self { height, normal: Vec3::z(), friction }
    }
}

/// Where and how a wheel meets the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Along the heading, in W.
    pub x: Vec3,
    /// To the left, in W.
    pub y: Vec3,
    /// Normal of the ground, in W.
    pub z: Vec3,
    /// Contact point from the wheel centre (m), in W.
    pub arm: Vec3,
    /// Deflection (m), positive in contact.
    pub depth: f64,
    /// Rate of deflection (m/s).
    pub depth_rate: f64,
    /// Distance of the centre from the contact point (m): the loaded radius.
    pub loaded_radius: f64,
    /// Speed of the wheel centre along x (m/s).
    pub vx: f64,
    /// Speed of the contact point across (m/s).
    pub vy: f64,
    /// Angular speed about the axle (rad/s).
    pub omega: f64,
    /// Inclination (rad), top to the right positive about x.
    pub camber: f64,
    /// Friction of the ground.
    pub friction: f64,
    /// Radius at which the wheel rolls without slip (m).
    pub rolling_radius: f64,
}

impl Contact {
    /// The contact of a wheel (axle along its y axis) of undeformed `radius` (m) with the tangent plane of the ground; `None` in the
    /// air or lying on its side.
    pub fn new(wheel: &RigidState, g: &Probe, radius: f64) -> Option<Self> {
        let axle = wheel.orientation * Vec3::y();
        let n = g.normal;
        let x = axle.cross(&n);
        let sine = x.norm();
        if sine < 0.2 {
            return None;
        }
        let x = x / sine;
        let y = n.cross(&x);
        // From the centre down in the wheel's plane.
        let down = -x.cross(&axle);
        let above = Vec3::new(0.0, 0.0, wheel.position.z - g.height).dot(&n);
        let distance = above / -down.dot(&n);
        let depth = (radius - distance) * -down.dot(&n);
        if depth <= 0.0 {
            return None;
        }
        let arm = down * distance;
        let v = wheel.velocity;
        let omega = wheel.angular_velocity.dot(&axle);
        // The contact point moves with the carcass, not with the tread: without the spin about the axle.
        let w = wheel.angular_velocity - axle * omega;
        let vc = v + w.cross(&arm);
        Some(Self {
            x,
            y,
            z: n,
            arm,
            depth,
            depth_rate: -v.dot(&n),
            loaded_radius: distance,
            vx: v.dot(&x),
            vy: vc.dot(&y),
            omega,
            camber: axle.dot(&n).clamp(-1.0, 1.0).asin(),
            friction: g.friction,
            // A third of the deflection: the belt keeps its length.
            rolling_radius: radius - depth / 3.0,
        })
    }

    /// Slip velocity along (m/s), positive when the wheel drives.
    pub fn slip_x(&self) -> f64 {
        self.omega * self.rolling_radius - self.vx
    }

    /// Wrench about the wheel centre in W.
    pub fn wrench(&self, f: &TireForces) -> Wrench {
        let to_w = |v: &Vec3| self.x * v.x + self.y * v.y + self.z * v.z;
        let force = to_w(&f.force);
        Wrench { force, moment: self.arm.cross(&force) + to_w(&f.moment) }
    }
}

/// Force (N) and moment (N m) at the contact point, contact frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TireForces {
    /// Along, across, normal.
    pub force: Vec3,
    /// Overturning, rolling, aligning.
    pub moment: Vec3,
}

/// Force (N) and moment (N m) on a wheel about its centre, in W.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// Force.
    pub force: Vec3,
    /// Moment.
    pub moment: Vec3,
}

/// Piecewise linear load curve through (0, 0), the last segment continued.
pub(crate) fn curve(points: &[[f64; 2]], x: f64) -> f64 {
    let n = points.len();
    let k = points.partition_point(|p| p[0] <= x).clamp(1, n - 1);
    let (a, b) = (points[k - 1], points[k]);
    a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1])
}
