//! Penalty contact of one point that carries an area.
//!
//! Pressure `p = k d (1 + d'/v)`, at least 0 (K. H. Hunt, F. R. E. Crossley 1975, with exponent 1: no jump of the force at the touch, no pull at
//! parting). Traction `t = -(a k s + k d/v u)`, u the velocity along the ground and s the displacement since the touch, a the ratio of stiffnesses;
//! beyond `mu p` it is cut back to `mu p` and s to what the spring then holds (Coulomb with sticking).

use super::config::Penalty;
use super::ground::GroundPoint;
use terramech_mechanics::Vec3;

/// A point of a body now.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Position (m).
    pub position: Vec3,
    /// Velocity (m/s).
    pub velocity: Vec3,
    /// The area (m2) that it stands for, times the outward unit normal.
    pub area: Vec3,
}

/// Force of the ground on a point, and the energies of the contact.
#[derive(Clone, Copy, Debug, Default)]
pub struct Touch {
    /// Force (N).
    pub force: Vec3,
    /// Energy in the springs (J).
    pub elastic: f64,
}

/// The force on a point, if it is in the ground; `slip` (m) is the tangential displacement since the touch and is brought
/// forward by `h` s, or set to 0 without touch. `friction` is that of the pair.
pub fn touch(
    c: &Penalty,
    point: &Point,
    ground: &GroundPoint,
    friction: f64,
    slip: &mut Vec3,
    h: f64,
) -> Option<Touch> {
    let n = ground.normal;
    let depth = (ground.height - point.position.z) * n.z;
    // What faces away from the ground does not touch it: the upper side of a tire that is deep in a step.
    let area = -point.area.dot(&n);
    if depth <= 0.0 || area <= 0.0 {
        *slip = Vec3::zeros();
        return None;
    }
    let approach = -point.velocity.dot(&n);
    let along = point.velocity + n * approach;
    let pressure = c.stiffness * depth * (1.0 + approach / c.damping_speed).max(0.0);
    // The ground may have turned under the point.
    let moved = *slip + along * h;
    *slip = moved - n * moved.dot(&n);
    let stiffness = c.tangential * c.stiffness;
    let viscous = c.stiffness * depth / c.damping_speed;
    let mut traction = -(*slip * stiffness + along * viscous);
    let (size, limit) = (traction.norm(), friction * pressure);
    if size > limit {
        traction *= limit / size;
        *slip = if stiffness > 0.0 { -(traction + along * viscous) / stiffness } else { Vec3::zeros() };
        let held = slip.norm() * stiffness;
        if held > limit {
            *slip *= limit / held;
        }
    }
    Some(Touch {
        force: (n * pressure + traction) * area,
        elastic: 0.5 * area * (c.stiffness * depth * depth + stiffness * slip.norm_squared()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLAT: GroundPoint = GroundPoint { height: 0.0, normal: Vec3::new(0.0, 0.0, 1.0), friction: 0.5 };

    fn point(z: f64, v: Vec3) -> Point {
        Point { position: Vec3::new(0.0, 0.0, z), velocity: v, area: Vec3::new(0.0, 0.0, -1e-3) }
    }

    #[test]
    fn pressure_by_depth_and_nothing_above() {
        let c = Penalty::default();
        let mut s = Vec3::new(1.0, 0.0, 0.0);
        assert!(touch(&c, &point(1e-9, Vec3::zeros()), &FLAT, 0.5, &mut s, 1e-4).is_none());
        assert_eq!(s, Vec3::zeros());
        let t = touch(&c, &point(-1e-3, Vec3::zeros()), &FLAT, 0.5, &mut s, 1e-4).unwrap();
        assert_eq!(t.force, Vec3::new(0.0, 0.0, 100.0));
        assert!((t.elastic - 0.05).abs() < 1e-15);
        let t = touch(&c, &point(-1e-3, Vec3::new(0.0, 0.0, 9.0)), &FLAT, 0.5, &mut s, 1e-4).unwrap();
        assert_eq!(t.force, Vec3::zeros(), "it never pulls");
        let up = Point { area: Vec3::new(0.0, 0.0, 1e-3), ..point(-1e-3, Vec3::zeros()) };
        assert!(touch(&c, &up, &FLAT, 0.5, &mut s, 1e-4).is_none(), "the far side does not touch");
    }

    #[test]
    fn it_sticks_below_the_limit_and_slides_at_it() {
        let c = Penalty::default();
        // A 1 kg block on 10 points of 1 cm2 each, pulled with 3 N and with 8 N; weight 9.81 N, friction 0.5.
        for (pull, holds) in [(3.0, true), (8.0, false)] {
            let (mut x, mut v, h) = (Vec3::new(0.0, 0.0, -9.81 / 1e5), Vec3::zeros(), 1e-5);
            let mut slip = Vec3::zeros();
            for _ in 0..100_000 {
                let p = Point { position: x, velocity: v, area: Vec3::new(0.0, 0.0, -1e-3) };
                let f = touch(&c, &p, &FLAT, 0.5, &mut slip, h).unwrap().force;
                v += h * (f + Vec3::new(pull, 0.0, -9.81));
                x += h * v;
            }
            let expected = if holds { 0.0 } else { (pull - 0.5 * 9.81) * 1.0 };
            assert!((v.x - expected).abs() < 1e-2 * pull, "pull {pull} N: {} m/s after 1 s", v.x);
        }
    }
}
