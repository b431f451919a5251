//! Every model passes the same checks: zero at rest, dissipation, limits, mirror images; and closed values.

use terramech_handling_tires::{Contact, Probe, Tire, Transient, fiala::Fiala, pac02::Pac02, rigid::Rigid};
use terramech_mechanics::{RigidState, Vec3, rotation};

fn models() -> [Tire; 3] {
    [Tire::Rigid(Rigid::default()), Tire::Fiala(Fiala::hmmwv()), Tire::Pac02(Box::new(Pac02::hmmwv()))]
}

fn wheel(tire: &Tire, depth: f64, v: Vec3, omega: f64, camber: f64) -> RigidState {
    RigidState {
        position: Vec3::new(0.0, 0.0, tire.radius() - depth),
        orientation: rotation::exp(&Vec3::new(camber, 0.0, 0.0)),
        velocity: v,
        angular_velocity: Vec3::new(0.0, omega, 0.0),
    }
}

/// The transient slip after long rolling in one state.
fn settled(tire: &Tire, w: &RigidState, friction: f64) -> (Contact, Transient) {
    let c = Contact::new(w, &Probe::level(0.0, friction), tire.radius()).unwrap();
    let mut s = Transient::default();
    (0..20_000).for_each(|_| s = s.advanced(tire, Some(&c), 1e-3));
    (c, s)
}

#[test]
fn free_rolling_gives_hardly_any_force_and_the_air_none() {
    for t in models() {
        let depth = 0.03;
        let w = wheel(&t, depth, Vec3::new(10.0, 0.0, 0.0), 10.0 / (t.radius() - depth / 3.0), 0.0);
        let (c, s) = settled(&t, &w, 0.8);
        let f = t.forces(&c, &s, 1.0);
        assert!(
            f.force.z > 1000.0 && f.force.x.abs() < 0.03 * f.force.z && f.force.y.abs() < 0.03 * f.force.z,
            "{t:?} {f:?}"
        );
        let up = wheel(&t, -0.01, Vec3::zeros(), 0.0, 0.0);
        assert!(Contact::new(&up, &Probe::level(0.0, 0.8), t.radius()).is_none());
    }
}

#[test]
fn forces_oppose_slip_and_stay_within_friction() {
    for t in models() {
        for (vy, slip) in [(1.0, 0.0), (-3.0, 0.1), (0.0, 0.4), (5.0, -0.8), (0.3, 0.02)] {
            let w = wheel(&t, 0.03, Vec3::new(10.0, vy, 0.0), 10.0 * (1.0 + slip) / (t.radius() - 0.01), 0.0);
            let (c, s) = settled(&t, &w, 0.8);
            let f = t.forces(&c, &s, 1.0);
            let power = f.force.y * c.vy - f.force.x * c.slip_x();
            assert!(power < 0.0, "{t:?} makes energy: {power} W at {vy} m/s, slip {slip}");
            // Fiala's two directions are not coupled: up to sqrt(2).
            let horizontal = f.force.xy().norm();
            assert!(horizontal < 1.45 * f.force.z, "{t:?}: {horizontal} N of {} N", f.force.z);
        }
    }
}

#[test]
fn the_right_wheel_is_the_mirror_image_of_the_left() {
    for t in models() {
        let at = |m: f64| {
            let w = wheel(&t, 0.03, Vec3::new(10.0, m * 0.7, 0.0), 22.0, m * 0.03);
            let (c, s) = settled(&t, &w, 0.8);
            t.forces(&c, &s, m)
        };
        let (l, r) = (at(1.0), at(-1.0));
        let mirrored = Vec3::new(r.force.x, -r.force.y, r.force.z);
        assert!((l.force - mirrored).norm() < 1e-9 * l.force.norm(), "{l:?} {r:?}");
        let mirrored = Vec3::new(-r.moment.x, r.moment.y, -r.moment.z);
        assert!((l.moment - mirrored).norm() < 1e-9 * l.moment.norm().max(1.0), "{l:?} {r:?}");
    }
}

#[test]
fn fiala_at_given_slips() {
    let t = Fiala::hmmwv();
    let tire = Tire::Fiala(t.clone());
    let w = wheel(&tire, 0.025, Vec3::new(10.0, 0.2, 0.0), 10.0 / (0.47 - 0.025 / 3.0), 0.0);
    let (c, s) = settled(&tire, &w, t.reference_friction);
    let f = tire.forces(&c, &s, 1.0);
    let tan = 0.02_f64;
    let limit = 4798.0 * (0.9835 - (0.9835 - 0.5568) * tan);
    let h: f64 = 1.0 - 50_000.0 * tan / (3.0 * limit);
    let expected = -limit * (1.0 - h.powi(3));
    println!("VALIDATION|handling|Fiala side force at tan(alpha) .02|N|{expected}|{}|1e-6", f.force.y);
    assert!((f.force.y / expected - 1.0).abs() < 1e-6 && f.moment.z > 0.0, "{} {expected}", f.force.y);
}

#[test]
fn the_carcass_holds_a_standing_wheel() {
    // A wheel pushed sideways at standstill: the carcass deflects like a spring and does not creep.
    for t in models() {
        let (mut s, h, m) = (Transient::default(), 1e-3, 600.0);
        let (mut y, mut v) = (0.0, 0.0);
        let mut before = 0.0;
        for k in 0..20_000 {
            let w = wheel(&t, 0.03, Vec3::new(0.0, v, 0.0), 0.0, 0.0);
            let c = Contact::new(&w, &Probe::level(0.0, 0.8), t.radius()).unwrap();
            v += h * (t.forces(&c, &s, 1.0).force.y + 500.0) / m;
            y += h * v;
            s = s.advanced(&t, Some(&c), h);
            if k == 15_000 {
                before = y;
            }
        }
        assert!((y - before).abs() < 1e-4 && y.abs() < 0.1, "{t:?}: {before} {y}");
    }
}

#[test]
fn tir_files_tell_what_is_missing() {
    let e = Pac02::parse("[MODEL]\nUNLOADED_RADIUS = 0.4\nPCX1 = 1.6 $ shape\n").unwrap_err().to_string();
    assert!(e.contains("FNOMIN") && e.contains("PKY1") && !e.contains("PCX1"), "{e}");
    assert!(Pac02::parse("[MODEL]\nnonsense here\n").unwrap_err().to_string().contains("line 2"));
}
