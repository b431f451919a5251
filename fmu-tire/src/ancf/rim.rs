//! Motion of the rim between communication points.
//!
//! At a communication point the tire is told the wheel's state; its rim stands where it was extrapolated to, a little off. Over the next
//! step the rim's velocity runs linearly from what it is to the told one, so that the acceleration is constant and neither position nor
//! velocity jumps (a jump excites the bead; a cubic through both told values swings between 7 and -5 times the acceleration). What the
//! position is off is corrected by a share of [`CORRECTION`] per step. Orientation does the same by the exponential map.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
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

/// Share of the position's error that a step corrects: with it, the error itself adds at most this share of the true acceleration.
pub const CORRECTION: f64 = 0.1;

/// A path over one communication step: constant acceleration.
#[derive(Debug, Clone, Copy)]
pub struct RimPath {
    from: RigidState,
    acceleration: Vector3<f64>,
    angular_acceleration: Vector3<f64>,
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
        let target = told.advanced(size);
        let plain = |state: &RigidState| Self {
            from,
            acceleration: (state.velocity - from.velocity) / size,
            angular_acceleration: (state.angular_velocity - from.angular_velocity) / size,
        };
        let reached = plain(&target).at(size).state;
        let mut corrected = target;
        corrected.velocity += (target.position - reached.position) * (CORRECTION / size);
        corrected.angular_velocity +=
            (target.orientation * reached.orientation.inverse()).scaled_axis() * (CORRECTION / size);
        plain(&corrected)
    }

    /// The rim `t` seconds after the beginning, 0 to `size`.
    pub fn at(&self, t: f64) -> RimMotion {
        let mut state = self.from;
        state.position += self.from.velocity * t + self.acceleration * (0.5 * t * t);
        state.velocity += self.acceleration * t;
        let turn = self.from.angular_velocity * t + self.angular_acceleration * (0.5 * t * t);
        state.orientation = UnitQuaternion::from_scaled_axis(turn) * self.from.orientation;
        state.angular_velocity += self.angular_acceleration * t;
        RimMotion { state, acceleration: self.acceleration, angular_acceleration: self.angular_acceleration }
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
