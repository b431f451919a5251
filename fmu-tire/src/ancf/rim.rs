//! Motion of the rim between communication points.
//!
//! At a communication point the tire is told the wheel's state; its rim stands where it was extrapolated to, a little off. Over the next
//! step the rim runs on a cubic from where it is, with the velocity it has, to the told state moved on by its velocities: position and
//! velocity have no jump, which would excite the bead. Orientation does the same in the rotation vector (exponential map).

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use terramech_mechanics::RigidState;

/// Pose, velocity and acceleration of the rim, inertial frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RimMotion {
    /// Pose and velocity.
    pub state: RigidState,
    /// Acceleration of the centre, m/s2.
    pub acceleration: Vector3<f64>,
    /// Angular acceleration, rad/s2.
    pub angular_acceleration: Vector3<f64>,
}

/// A path over one communication step.
#[derive(Debug, Clone, Copy)]
pub struct RimPath {
    from: RigidState,
    to: RigidState,
    size: f64,
    /// Rotation vector from start to end, and its rate at the end.
    turn: Vector3<f64>,
    end_rate: Vector3<f64>,
}

/// Nodes fixed to the rim, in the wheel's frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RimNodes {
    /// Node and its coordinates (position, director) in the wheel's frame.
    pub nodes: Vec<(u32, [f64; 6])>,
}

impl RimPath {
    /// From the rim's state at the beginning to the told one, moved on by `size` seconds with its velocities.
    pub fn new(from: RigidState, told: &RigidState, size: f64) -> Self {
        let to = told.advanced(size);
        let turn = (to.orientation * from.orientation.inverse()).scaled_axis();
        Self { from, end_rate: inverse_left_jacobian(&turn) * to.angular_velocity, to, size, turn }
    }

    /// The rim `t` seconds after the beginning, 0 to `size`.
    pub fn at(&self, t: f64) -> RimMotion {
        let h = self.size;
        let (p, v, a) = cubic(
            &Vector3::zeros(),
            &self.from.velocity,
            &(self.to.position - self.from.position),
            &self.to.velocity,
            t,
            h,
        );
        let (turn, rate, second) =
            cubic(&Vector3::zeros(), &self.from.angular_velocity, &self.turn, &self.end_rate, t, h);
        let jacobian = left_jacobian(&turn);
        let mut state = self.from;
        state.position = self.from.position + p;
        state.velocity = v;
        state.orientation = UnitQuaternion::from_scaled_axis(turn) * self.from.orientation;
        state.angular_velocity = jacobian * rate;
        // The Jacobian's own rate is of second order in the turn of one step, and zero about a fixed axis.
        RimMotion { state, acceleration: a, angular_acceleration: jacobian * second }
    }

    /// Mean acceleration and angular acceleration over the step.
    pub fn mean_acceleration(&self) -> [Vector3<f64>; 2] {
        [
            (self.to.velocity - self.from.velocity) / self.size,
            (self.to.angular_velocity - self.from.angular_velocity) / self.size,
        ]
    }
}

impl RimNodes {
    /// Writes coordinates, rates and second derivatives of the rim's nodes.
    pub fn prescribe(&self, rim: &RimMotion, q: &mut [f64], v: &mut [f64], a: &mut [f64]) {
        let turn: Rotation3<f64> = rim.state.orientation.to_rotation_matrix();
        let (w, dw) = (rim.state.angular_velocity, rim.angular_acceleration);
        for (node, local) in &self.nodes {
            let first = 6 * *node as usize;
            for half in 0..2 {
                let arm = turn * Vector3::from_column_slice(&local[3 * half..3 * half + 3]);
                let speed = w.cross(&arm);
                let second = dw.cross(&arm) + w.cross(&speed);
                let (origin, velocity, acceleration) = if half == 0 {
                    (rim.state.position, rim.state.velocity, rim.acceleration)
                } else {
                    (Vector3::zeros(), Vector3::zeros(), Vector3::zeros())
                };
                for k in 0..3 {
                    q[first + 3 * half + k] = origin[k] + arm[k];
                    v[first + 3 * half + k] = velocity[k] + speed[k];
                    a[first + 3 * half + k] = acceleration[k] + second[k];
                }
            }
        }
    }
}

/// Hermite cubic: value, first and second derivative.
fn cubic(
    p0: &Vector3<f64>,
    v0: &Vector3<f64>,
    p1: &Vector3<f64>,
    v1: &Vector3<f64>,
    t: f64,
    h: f64,
) -> (Vector3<f64>, Vector3<f64>, Vector3<f64>) {
    let c2 = (p1 - p0) * (3.0 / (h * h)) - (v0 * 2.0 + v1) / h;
    let c3 = (p0 - p1) * (2.0 / (h * h * h)) + (v0 + v1) / (h * h);
    (p0 + v0 * t + c2 * (t * t) + c3 * (t * t * t), v0 + c2 * (2.0 * t) + c3 * (3.0 * t * t), c2 * 2.0 + c3 * (6.0 * t))
}

/// Maps the rate of a rotation vector to the angular velocity.
fn left_jacobian(turn: &Vector3<f64>) -> Matrix3<f64> {
    let (angle, cross) = (turn.norm(), turn.cross_matrix());
    let (a, b) = if angle < 1e-4 {
        (0.5 - angle * angle / 24.0, 1.0 / 6.0 - angle * angle / 120.0)
    } else {
        ((1.0 - angle.cos()) / (angle * angle), (angle - angle.sin()) / angle.powi(3))
    };
    Matrix3::identity() + cross * a + cross * cross * b
}

fn inverse_left_jacobian(turn: &Vector3<f64>) -> Matrix3<f64> {
    left_jacobian(turn).try_inverse().unwrap_or(Matrix3::identity())
}
