//! A wheel on uneven ground: the plane that stands for a profile.
//!
//! One probe under the wheel sees a bump only once the centre is over it. The wheel's disc meets the ground earlier: the area in which disc and profile
//! overlap gives a plane that the single-point models can take (the principle of D. J. Schuring's and of J. Sui and J. A. Hirshey's equivalent plane,
//! "A new analytical tire model for vehicle dynamic analysis", 2001): its normal points from the centroid of the area to the wheel centre, and it cuts off
//! the disc a circular segment of the same area. On a plane it is that plane.

use crate::Probe;
use terramech_mechanics::{RigidState, Vec3};

/// A point of the ground that was asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The point (m), in W; its z is the height of the ground.
    pub position: Vec3,
    /// Unit normal of the ground there.
    pub normal: Vec3,
    /// Friction there.
    pub friction: f64,
}

/// Slices between two samples.
const SLICES: usize = 8;
/// Least vertical part of the plane's normal: about 72 degrees.
const STEEP: f64 = 0.3;

/// Points (m, in W) at which to ask the ground: under the wheel centre, or `count` of them along the heading over the
/// tire's diameter.
pub fn points(wheel: &RigidState, radius: f64, count: usize) -> Vec<Vec3> {
    let x = heading(wheel);
    if count < 2 {
        return vec![wheel.position];
    }
    (0..count).map(|k| wheel.position + x * (0.95 * radius * (2.0 * k as f64 / (count - 1) as f64 - 1.0))).collect()
}

/// Level unit vector along the wheel's heading.
fn heading(wheel: &RigidState) -> Vec3 {
    let axle = wheel.orientation * Vec3::y();
    Vec3::new(axle.y, -axle.x, 0.0).try_normalize(1e-9).unwrap_or(Vec3::x())
}

/// The plane under a wheel that touches one sample: its tangent plane, at the wheel's place now.
pub fn tangent(wheel: &RigidState, s: &Sample) -> Probe {
    let d = wheel.position - s.position;
    // The sample was taken where the wheel was at the last communication point.
    let height = s.position.z - (s.normal.x * d.x + s.normal.y * d.y) / s.normal.z;
    Probe { height, normal: s.normal, friction: s.friction }
}

/// The plane that stands for a profile: samples in the order of the heading, at least two. `None`: the disc does not touch it.
pub fn equivalent(wheel: &RigidState, radius: f64, samples: &[Sample]) -> Option<Probe> {
    let x = heading(wheel);
    let centre = wheel.position;
    let s = |k: usize| (samples[k].position - centre).dot(&x);
    let (mut area, mut first, mut second, mut friction, mut side) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let y = Vec3::z().cross(&x);
    for k in 1..samples.len() {
        let (a, b) = (s(k - 1), s(k));
        let (za, zb) = (samples[k - 1].position.z - centre.z, samples[k].position.z - centre.z);
        let width = (b - a) / SLICES as f64;
        for i in 0..SLICES {
            let t = (i as f64 + 0.5) / SLICES as f64;
            let at = a + (b - a) * t;
            let rest = radius * radius - at * at;
            if rest <= 0.0 {
                continue;
            }
            let rim = -rest.sqrt();
            let depth = (za + (zb - za) * t).min(0.0) - rim;
            if depth > 0.0 {
                let d = depth * width;
                area += d;
                first += d * at;
                second += d * (rim + 0.5 * depth);
                let near = &samples[if t < 0.5 { k - 1 } else { k }];
                friction += d * near.friction;
                side += d * near.normal.dot(&y) / near.normal.z;
            }
        }
    }
    if area <= 0.0 {
        return None;
    }
    let depth = segment_depth(area, radius);
    // Up from the centroid to the centre, in the wheel's vertical plane; tilted to the side as the ground is.
    let (u, w) = (-first / area, -second / area);
    let slope = u / w.max(STEEP * u.hypot(w));
    let normal = (x * slope + Vec3::z() + y * (side / area)).normalize();
    let normal = if normal.z < STEEP { Vec3::new(normal.x, normal.y, STEEP).normalize() } else { normal };
    // The plane whose distance from the centre, in the wheel's vertical plane, is radius - depth.
    let along = (normal.z * normal.z + normal.dot(&x).powi(2)).sqrt();
    let height = centre.z - (radius - depth) * along / normal.z;
    Some(Probe { height, normal, friction: friction / area })
}

/// Depth (m) at which a plane cuts off a segment of `area` (m2) from a disc: `r^2 (acos(1 - q) - (1 - q) sqrt(2 q - q^2))`, q = depth / r.
fn segment_depth(area: f64, r: f64) -> f64 {
    let a = area / (r * r);
    // Small depths: 4/3 sqrt(2) q^1.5. Newton from there; the derivative is the chord 2 sqrt(2 q - q^2).
    let mut q = (a * 0.75 / std::f64::consts::SQRT_2).powf(2.0 / 3.0).min(0.99);
    for _ in 0..20 {
        let chord = (2.0 * q - q * q).sqrt();
        let step = ((1.0 - q).acos() - (1.0 - q) * chord - a) / (2.0 * chord);
        q = (q - step).clamp(1e-12, 1.0);
        if step.abs() < 1e-14 {
            break;
        }
    }
    q * r
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Contact;

    const R: f64 = 0.47;

    fn wheel(z: f64, yaw: f64) -> RigidState {
        RigidState {
            position: Vec3::new(1.0, 2.0, z),
            orientation: terramech_mechanics::rotation::exp(&Vec3::new(0.0, 0.0, yaw)),
            ..RigidState::default()
        }
    }

    fn ground(w: &RigidState, f: impl Fn(f64, f64) -> (f64, Vec3)) -> Vec<Sample> {
        points(w, R, 41)
            .into_iter()
            .map(|p| {
                let (z, normal) = f(p.x, p.y);
                Sample { position: Vec3::new(p.x, p.y, z), normal, friction: 0.7 }
            })
            .collect()
    }

    #[test]
    fn a_plane_is_its_own_equivalent() {
        for (sx, sy) in [(0.0, 0.0), (0.2, 0.0), (-0.1, 0.15)] {
            let n = Vec3::new(-sx, -sy, 1.0).normalize();
            let plane = |x: f64, y: f64| (sx * (x - 1.0) + sy * (y - 2.0), n);
            let w = wheel((R - 0.03) / n.z, 0.4);
            let found = equivalent(&w, R, &ground(&w, plane)).unwrap();
            let exact = Probe { height: plane(1.0, 2.0).0, normal: n, friction: 0.7 };
            let (a, b) = (Contact::new(&w, &found, R).unwrap(), Contact::new(&w, &exact, R).unwrap());
            assert!((a.depth - b.depth).abs() < 2e-4, "{sx} {sy}: {} {}", a.depth, b.depth);
            assert!((found.normal - n).norm() < 5e-3, "{sx} {sy}: {:?} {n:?}", found.normal);
            assert!((found.friction - 0.7).abs() < 1e-12);
        }
    }

    #[test]
    fn an_obstacle_ahead_pushes_back_before_the_centre_is_over_it() {
        // A half-round of 0.1 m whose axis is 0.25 m ahead of the centre.
        let bar = |x: f64, _: f64| {
            let d = x - 1.25;
            if d.abs() < 0.1 { ((0.01 - d * d).sqrt(), Vec3::z()) } else { (0.0, Vec3::z()) }
        };
        let w = wheel(R, 0.0);
        let p = equivalent(&w, R, &ground(&w, bar)).unwrap();
        assert!(p.normal.x < -0.2 && p.normal.z > 0.7, "{p:?}");
        let c = Contact::new(&w, &p, R).unwrap();
        assert!(c.depth > 0.005 && c.depth < 0.1, "{}", c.depth);
        let high = wheel(R + 0.2, 0.0);
        assert!(equivalent(&high, R, &ground(&high, bar)).is_none());
    }

    #[test]
    fn segments_have_the_depth_of_their_area() {
        for q in [1e-6, 1e-3, 0.05, 0.5, 1.0_f64] {
            let area = R * R * ((1.0 - q).acos() - (1.0 - q) * (2.0 * q - q * q).sqrt());
            assert!((segment_depth(area, R) / (q * R) - 1.0).abs() < 1e-5, "{q}");
        }
    }
}
