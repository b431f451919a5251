//! Dry friction between two turning parts with a torque limit: brakes, parking locks, clutches.
//!
//! A friction element holds its relative speed at zero with whatever torque that needs, up to its limit; beyond it slips with the limit torque. The
//! torques of all elements are found together: each element's response to a unit impulse is one solve with the step's factor, and
//! the small box-constrained problem is solved to round-off. So a locked wheel stands still, without creep and without a stiff spring.

use super::{BodyId, ShaftId};
use terramech_mechanics::Vec3;

/// Handle of a friction element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrictionId(pub(crate) usize);

/// A friction element.
#[derive(Clone, Debug)]
pub(crate) enum Friction {
    /// Between two bodies about an axis given in each as a unit vector.
    Bodies { a: BodyId, b: BodyId, axis_a: Vec3, axis_b: Vec3 },
    /// Between two shafts.
    Shafts { a: ShaftId, b: ShaftId },
}

/// Impulses within [-limit, limit] that bring the relative speeds `v + D p` to zero where they can. `d` is symmetric positive
/// semidefinite, n x n. Gauss-Seidel to round-off: n is at most a dozen.
pub(crate) fn box_solve(d: &[f64], v: &[f64], limit: &[f64], p: &mut [f64]) {
    let n = v.len();
    for _ in 0..200 {
        let mut change = 0.0_f64;
        for i in 0..n {
            let dii = d[i * n + i];
            if dii <= 0.0 {
                continue;
            }
            let slip = v[i] + (0..n).map(|j| d[i * n + j] * p[j]).sum::<f64>();
            let new = (p[i] - slip / dii).clamp(-limit[i], limit[i]);
            change = change.max((new - p[i]).abs() / limit[i].max(1e-300));
            p[i] = new;
        }
        if change < 1e-14 {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sticks_within_the_limit_and_slips_beyond() {
        let d = [2.0, 0.5, 0.5, 1.0];
        let mut p = [0.0; 2];
        box_solve(&d, &[1.0, -1.0], &[10.0, 10.0], &mut p);
        assert!((1.0 + 2.0 * p[0] + 0.5 * p[1]).abs() < 1e-13 && (-1.0 + 0.5 * p[0] + p[1]).abs() < 1e-13);
        let mut p = [0.0; 2];
        box_solve(&d, &[1.0, -1.0], &[0.1, 10.0], &mut p);
        assert_eq!(p[0], -0.1);
        assert!((-1.0 + 0.5 * p[0] + p[1]).abs() < 1e-13);
    }
}
