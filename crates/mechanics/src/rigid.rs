//! State of a rigid body and its motion over a step.

use crate::{Quat, Vec3, rotation};
use serde::{Deserialize, Serialize};

/// Position, orientation, velocity and angular velocity of a body frame B, in the inertial frame W.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "Plain", into = "Plain")]
pub struct RigidState {
    /// `p_WB` (m).
    pub position: Vec3,
    /// `q_WB`, body to inertial.
    pub orientation: Quat,
    /// `v_WB_W` (m/s).
    pub velocity: Vec3,
    /// `w_WB_W` (rad/s), components in W.
    pub angular_velocity: Vec3,
}

impl Default for RigidState {
    /// At rest at the origin, axes along the inertial ones.
    fn default() -> Self {
        Self {
            position: Vec3::zeros(),
            orientation: Quat::identity(),
            velocity: Vec3::zeros(),
            angular_velocity: Vec3::zeros(),
        }
    }
}

impl RigidState {
    /// The state after `h` seconds of constant velocity and angular velocity, the orientation by the exponential map.
    #[must_use]
    pub fn advanced(&self, h: f64) -> Self {
        Self {
            position: self.position + self.velocity * h,
            orientation: rotation::turned(&self.orientation, &self.angular_velocity, h),
            ..*self
        }
    }

    /// `p_WP` of the body-fixed point `p_BP` (m).
    pub fn to_world(&self, p_bp: &Vec3) -> Vec3 {
        self.position + self.orientation * p_bp
    }

    /// `p_BP` of the point that is at `p_WP` now (m).
    pub fn to_body(&self, p_wp: &Vec3) -> Vec3 {
        self.orientation.inverse() * (p_wp - self.position)
    }

    /// Velocity (m/s) in W of the body-fixed point that is at `p_WP` now.
    pub fn velocity_at(&self, p_wp: &Vec3) -> Vec3 {
        self.velocity + self.angular_velocity.cross(&(p_wp - self.position))
    }

    /// The 13 reals of a wheel state in interface order: position, orientation (w, x, y, z), velocity, angular velocity.
    pub fn to_array(&self) -> [f64; 13] {
        let (p, q, v, w) = (self.position, rotation::to_wxyz(&self.orientation), self.velocity, self.angular_velocity);
        [p.x, p.y, p.z, q[0], q[1], q[2], q[3], v.x, v.y, v.z, w.x, w.y, w.z]
    }

    /// Reads the 13 reals of [`Self::to_array`].
    ///
    /// # Errors
    /// [`RigidStateError`] names the first component that is not finite, or the quaternion whose norm is not 1.
    pub fn from_array(a: &[f64; 13]) -> Result<Self, RigidStateError> {
        const NAMES: [&str; 13] = [
            "position.x",
            "position.y",
            "position.z",
            "orientation.w",
            "orientation.x",
            "orientation.y",
            "orientation.z",
            "velocity.x",
            "velocity.y",
            "velocity.z",
            "angular_velocity.x",
            "angular_velocity.y",
            "angular_velocity.z",
        ];
        if let Some(k) = a.iter().position(|x| !x.is_finite()) {
            return Err(RigidStateError::NotFinite { name: NAMES[k], value: a[k] });
        }
        Ok(Self {
            position: Vec3::new(a[0], a[1], a[2]),
            orientation: rotation::from_wxyz([a[3], a[4], a[5], a[6]])?,
            velocity: Vec3::new(a[7], a[8], a[9]),
            angular_velocity: Vec3::new(a[10], a[11], a[12]),
        })
    }
}

/// Why 13 reals are not a rigid state.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RigidStateError {
    /// A component is NaN or infinite.
    #[error("{name} is {value}: must be finite")]
    NotFinite {
        /// Structured name of the component, as in `orientation.w`.
        name: &'static str,
        /// The value given.
        value: f64,
    },
    /// The quaternion has not norm 1.
    #[error(transparent)]
    Orientation(#[from] rotation::NotAnOrientation),
}

/// How a state is written to files: plain arrays, quaternion scalar first.
#[derive(Serialize, Deserialize)]
struct Plain {
    position: [f64; 3],
    orientation: [f64; 4],
    velocity: [f64; 3],
    angular_velocity: [f64; 3],
}

impl From<RigidState> for Plain {
    fn from(s: RigidState) -> Self {
        Self {
            position: s.position.into(),
            orientation: rotation::to_wxyz(&s.orientation),
            velocity: s.velocity.into(),
            angular_velocity: s.angular_velocity.into(),
        }
    }
}

impl From<Plain> for RigidState {
    fn from(s: Plain) -> Self {
        let [w, x, y, z] = s.orientation;
        Self {
            position: s.position.into(),
            // Written from a unit quaternion: normalising here would change bits of a saved state.
            orientation: Quat::new_unchecked(nalgebra::Quaternion::new(w, x, y, z)),
            velocity: s.velocity.into(),
            angular_velocity: s.angular_velocity.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moving() -> RigidState {
        RigidState {
            position: Vec3::new(1.0, 2.0, 3.0),
            orientation: rotation::exp(&Vec3::new(0.1, 0.2, 0.3)),
            velocity: Vec3::new(0.5, 0.0, -1.0),
            angular_velocity: Vec3::new(0.0, 4.0, 1.0),
        }
    }

    #[test]
    fn point_velocity_is_the_derivative_of_its_position() {
        let s = moving();
        let p_bp = Vec3::new(0.3, -0.2, 0.1);
        let h = 1e-6;
        let difference = (s.advanced(h).to_world(&p_bp) - s.advanced(-h).to_world(&p_bp)) / (2.0 * h);
        assert!((difference - s.velocity_at(&s.to_world(&p_bp))).norm() < 1e-8);
        assert!((s.to_body(&s.to_world(&p_bp)) - p_bp).norm() < 1e-15);
    }

    #[test]
    fn array_and_back() {
        let s = moving();
        assert_eq!(RigidState::from_array(&s.to_array()).unwrap(), s);
        let mut a = s.to_array();
        a[8] = f64::NAN;
        assert!(RigidState::from_array(&a).unwrap_err().to_string().starts_with("velocity.y is NaN"));
    }
}
