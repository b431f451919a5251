//! Orientations as unit quaternions, scalar first (w, x, y, z), body to inertial.
//!
//! nalgebra stores and prints the vector part first; these functions are the only place where that matters, so that
//! no unit has to remember it.

use crate::{Mat3, Quat, Vec3};

/// Why four numbers are not an orientation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("({w}, {x}, {y}, {z}) is not an orientation: a quaternion (w, x, y, z) must be finite and have norm 1 (its norm is {norm}, allowed 1 +- {tolerance})",
    w = given[0], x = given[1], y = given[2], z = given[3])]
pub struct NotAnOrientation {
    /// The four numbers given, scalar first.
    pub given: [f64; 4],
    /// Their norm.
    pub norm: f64,
    /// How far the norm may be from 1.
    pub tolerance: f64,
}

/// How far from 1 the norm of a quaternion that crosses an interface may be. An integrator that forgets to normalise
/// drifts by far less in a step, while swapped or missing components miss it.
pub const NORM_TOLERANCE: f64 = 1e-3;

/// Reads `q_WB` from (w, x, y, z) and normalises it.
///
/// # Errors
/// [`NotAnOrientation`] if a component is not finite or the norm is further than [`NORM_TOLERANCE`] from 1.
pub fn from_wxyz(wxyz: [f64; 4]) -> Result<Quat, NotAnOrientation> {
    let q = nalgebra::Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    let norm = q.norm();
    if norm.is_nan() || (norm - 1.0).abs() > NORM_TOLERANCE {
        return Err(NotAnOrientation { given: wxyz, norm, tolerance: NORM_TOLERANCE });
    }
    // Left as it is when already normal to round-off: a state that is saved and read again must not change a bit.
    if (norm - 1.0).abs() <= 4.0 * f64::EPSILON { Ok(Quat::new_unchecked(q)) } else { Ok(Quat::new_normalize(q)) }
}

/// The four numbers (w, x, y, z) of `q_WB`.
pub fn to_wxyz(q_wb: &Quat) -> [f64; 4] {
    [q_wb.w, q_wb.i, q_wb.j, q_wb.k]
}

/// `R_WB`, the matrix whose columns are the body's axes in the inertial frame.
pub fn matrix(q_wb: &Quat) -> Mat3 {
    q_wb.to_rotation_matrix().into_inner()
}

/// The exponential map: the rotation by `|theta|` radians about the axis `theta / |theta|`; the identity for zero.
pub fn exp(theta: &Vec3) -> Quat {
    let half = 0.5 * theta;
    let a = half.norm();
    // sin(a)/a by its series where the quotient would lose digits.
    let sinc = if a < 1e-4 { 1.0 - a * a / 6.0 } else { a.sin() / a };
    let v = half * sinc;
    Quat::new_normalize(nalgebra::Quaternion::new(a.cos(), v.x, v.y, v.z))
}

/// The inverse of [`exp`]: the rotation vector of `q`, of length at most pi.
pub fn log(q: &Quat) -> Vec3 {
    q.scaled_axis()
}

/// `q_WB` after a time `h` (s) of turning with constant angular velocity `omega_w` (rad/s), components in W.
pub fn turned(q_wb: &Quat, omega_w: &Vec3, h: f64) -> Quat {
    let q = exp(&(omega_w * h)) * q_wb;
    // A product of unit quaternions drifts by round-off; over 1e6 steps that would show.
    Quat::new_normalize(q.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn scalar_first_and_body_to_inertial() {
        let q = from_wxyz([FRAC_PI_2.cos().max(0.0) + (PI / 4.0).cos(), 0.0, 0.0, (PI / 4.0).sin()]).unwrap();
        // A quarter turn about Z brings the body's X axis to the inertial Y axis.
        let x = matrix(&q) * Vec3::x();
        assert!((x - Vec3::y()).norm() < 1e-12);
        let back = to_wxyz(&q);
        assert!((back[0] - (PI / 4.0).cos()).abs() < 1e-15 && (back[3] - (PI / 4.0).sin()).abs() < 1e-15);
    }

    #[test]
    fn not_an_orientation_is_told() {
        for bad in [[0.0; 4], [2.0, 0.0, 0.0, 0.0], [f64::NAN, 0.0, 0.0, 1.0]] {
            let message = from_wxyz(bad).unwrap_err().to_string();
            assert!(message.contains("norm 1"), "{message}");
        }
    }

    #[test]
    fn reading_what_was_written_changes_no_bit() {
        let q = exp(&Vec3::new(0.3, -0.7, 1.1));
        assert_eq!(to_wxyz(&from_wxyz(to_wxyz(&q)).unwrap()), to_wxyz(&q));
    }

    #[test]
    fn exponential_map_is_exact_for_constant_rate() {
        let omega = Vec3::new(0.2, 3.0, -1.0);
        let q0 = exp(&Vec3::new(1.0, 0.5, 0.0));
        let mut q = q0;
        for _ in 0..1000 {
            q = turned(&q, &omega, 1e-3);
        }
        assert!((matrix(&q) - matrix(&turned(&q0, &omega, 1.0))).norm() < 1e-12);
        assert!((log(&exp(&Vec3::new(1e-9, 0.0, 0.0))).x - 1e-9).abs() < 1e-20);
    }
}
