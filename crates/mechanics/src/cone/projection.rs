//! Projection on the cones of a contact, in the metric of its diagonal.

/// A cone |x| <= mu g_n beside the normal impulse: mu, the ratio of diagonals w_x/w_n, and |x|.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// mu (1).
    pub mu: f64,
    /// w_x/w_n (1).
    pub kappa: f64,
    /// |x| (N s).
    pub x: f64,
}

/// The normal impulse of the nearest point of the cones: `z` is the normal impulse asked for (cohesion added). Each x is then cut back to
/// mu times it. Minimises (g - z)^2 + sum kappa max(0, |x| - mu g)^2 over g >= 0.
///
/// The derivative is concave and rises, piecewise linear: Newton's method from g = z climbs to its root in as many steps as
/// there are sides, at most one more.
#[inline(always)]
pub fn project<const N: usize>(z: f64, sides: [Side; N]) -> f64 {
    let mut g = z;
    for _ in 0..=N {
        let (mut top, mut bottom) = (z, 1.0);
        for s in &sides {
            if s.x > s.mu * g {
                top += s.mu * s.kappa * s.x;
                bottom += s.mu * s.mu * s.kappa;
            }
        }
        let next = top / bottom;
        if next <= g {
            break;
        }
        g = next;
    }
    g.max(0.0)
}

/// Factor that cuts a vector of length `x` back to `most`.
#[inline(always)]
pub fn cut(x: f64, most: f64) -> f64 {
    if x > most { most / x } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_cone_has_the_closed_form() {
        let side = |x| [Side { mu: 0.5, kappa: 1.0, x }];
        // Inside, polar, between: the page on laws, section 3.
        assert_eq!(project(2.0, side(0.9)), 2.0);
        assert_eq!(project(-2.0, side(0.9)), 0.0);
        assert!((project(1.0, side(2.0)) - (0.5 * 2.0 + 1.0) / 1.25).abs() < 1e-15);
    }

    #[test]
    fn three_cones_give_the_least_distance() {
        let sides = [
            Side { mu: 0.5, kappa: 3.5, x: 1.0 },
            Side { mu: 0.1, kappa: 1.2, x: 0.4 },
            Side { mu: 0.05, kappa: 0.7, x: 2.0 },
        ];
        for z in [-1.0, -0.2, 0.3, 1.5, 2.5, 30.0] {
            let cost = |g: f64| {
                (g - z).powi(2) + sides.iter().map(|s| s.kappa * (s.x - s.mu * g).max(0.0).powi(2)).sum::<f64>()
            };
            let g = project(z, sides);
            for other in [g * (1.0 + 1e-4) + 1e-6, (g * (1.0 - 1e-4) - 1e-6).max(0.0)] {
                assert!(cost(g) <= cost(other) + 1e-15, "{z}: {g} is beaten by {other}");
            }
        }
    }
}
