//! Joints, one file each: functions of [`Model`](super::Model) that add constraint rows from points and axes given in the
//! inertial frame at the design position.

mod distance;
mod fixed;
mod prismatic;
mod rack;
mod revolute;
mod revolute_spherical;
mod spherical;
mod support;
mod universal;

use terramech_mechanics::Vec3;

/// Two unit vectors that complete the unit vector `n` to a right-handed frame (u, w, n).
pub(crate) fn frame(n: &Vec3) -> (Vec3, Vec3) {
    // The coordinate axis farthest from n, so that the cross product is well conditioned.
    let k = (0..3).min_by(|&i, &j| n[i].abs().total_cmp(&n[j].abs())).expect("three axes");
    let mut e = Vec3::zeros();
    e[k] = 1.0;
    let u = e.cross(n).normalize();
    (u, n.cross(&u))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_right_handed() {
        for n in [Vec3::x(), Vec3::y(), Vec3::z(), Vec3::new(0.6, -0.8, 0.0)] {
            let (u, w) = frame(&n);
            assert!((u.cross(&w) - n).norm() < 1e-15 && u.dot(&n).abs() < 1e-15);
        }
    }
}
