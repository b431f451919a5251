//! The multibody core by itself: closed forms (cases 5.1 to 5.3), invariants, drift, faults.

mod checks;

use checks::figure;
use fmu_vehicle::mbs::{GROUND, MbsError, Model, SpringDamper, SpringLaw, System};
use terramech_mechanics::{Mat3, Quat, Vec3, rotation};

fn v(x: f64, y: f64, z: f64) -> Vec3 {
    Vec3::new(x, y, z)
}

fn sphere(i: f64) -> Mat3 {
    Mat3::identity() * i
}

fn run(s: &mut System, seconds: f64, h: f64) {
    for _ in 0..(seconds / h).round() as usize {
        s.step(h, &mut |_, _| {}).unwrap();
    }
}

fn pendulum(p: Vec3, axis: Vec3, q: Quat) -> (System, fmu_vehicle::mbs::BodyId) {
    let mut m = Model::new();
    m.gravity = v(0.0, 0.0, -9.80665);
    let bob = m.body("bob", 1.0, sphere(0.1), p + v(2.0, 0.0, 0.0), q);
    m.revolute("pin", GROUND, bob, &p, &axis);
    (m.build().unwrap(), bob)
}

#[test]
fn case_5_1_pendulum() {
    let (mut s, bob) = pendulum(Vec3::zeros(), Vec3::y(), Quat::identity());
    run(&mut s, 5.0, 1e-3);
    let p = s.motion(bob).p;
    figure("5.1", "pendulum x at 5 s", "m", -1.9996839, p.x, 1e-4);
    figure("5.1", "pendulum y at 5 s", "m", 0.0, p.y, 1e-9);
    figure("5.1", "pendulum z at 5 s", "m", -0.0355587, p.z, 1e-4);
}

#[test]
fn case_5_2_inclined_pendulum() {
    // The axis is z turned by -45 degrees about x; the body is turned at will, its inertia is a sphere's.
    let axis = rotation::exp(&v(-std::f64::consts::FRAC_PI_4, 0.0, 0.0)) * Vec3::z();
    let (mut s, bob) = pendulum(v(1.0, 2.0, 3.0), axis, rotation::exp(&v(0.3, -0.2, 0.9)));
    run(&mut s, 5.0, 1e-3);
    let p = s.motion(bob).p;
    figure("5.2", "inclined pendulum x at 5 s", "m", 1.209961, p.x, 1e-4);
    figure("5.2", "inclined pendulum y at 5 s", "m", 3.406399, p.y, 1e-4);
    figure("5.2", "inclined pendulum z at 5 s", "m", 1.593601, p.z, 1e-4);
}

#[test]
fn the_pendulum_converges_with_second_order() {
    let exact = pendulum_at(1e-4);
    let (coarse, fine) = ((pendulum_at(4e-3) - exact).norm(), (pendulum_at(2e-3) - exact).norm());
    let order = (coarse / fine).log2();
    figure("5.1", "order of convergence", "1", 2.0, order, 0.1);
}

fn pendulum_at(h: f64) -> Vec3 {
    let (mut s, bob) = pendulum(Vec3::zeros(), Vec3::y(), Quat::identity());
    run(&mut s, 2.0, h);
    s.motion(bob).p
}

#[test]
fn case_5_3_geared_shafts() {
    let mut m = Model::new();
    let (a, b) = (m.shafts.shaft("a", 10.0), m.shafts.shaft("b", 100.0));
    m.shafts.gear("gear", a, b, -0.1, Vec3::zeros(), Vec3::zeros());
    let mut s = m.build().unwrap();
    for _ in 0..100 {
        s.step(1e-2, &mut |_, loads| loads.shaft(a, 6.0)).unwrap();
    }
    figure("5.3", "acceleration of shaft A", "rad/s2", 0.545455, s.shaft_speed(a), 1e-6);
    figure("5.3", "acceleration of shaft B", "rad/s2", -0.0545455, s.shaft_speed(b), 1e-7);
}

/// A spatial four-bar linkage: crank with a hinge, coupler with ball and cross joints, rocker with a hinge.
fn linkage() -> Model {
    let mut m = Model::new();
    let (a, b, c, d) = (v(0.0, 0.0, 0.0), v(0.0, 0.1, 0.3), v(0.8, 0.3, 0.5), v(0.9, 0.1, 0.0));
    let crank = m.body("crank", 1.0, sphere(0.02), (a + b) / 2.0, Quat::identity());
    let coupler = m.body("coupler", 2.0, sphere(0.1), (b + c) / 2.0, Quat::identity());
    let rocker = m.body("rocker", 1.5, sphere(0.05), (c + d) / 2.0, Quat::identity());
    m.revolute("crank pin", GROUND, crank, &a, &v(1.0, 0.1, 0.0));
    m.spherical("crank end", crank, coupler, &b);
    let arm = (c - b).cross(&Vec3::y()).normalize();
    let other = arm.cross(&(c - b)).normalize();
    m.universal("rocker end", coupler, rocker, &c, &arm, &other);
    m.revolute("rocker pin", GROUND, rocker, &d, &v(0.1, 1.0, 0.0));
    m
}

#[test]
fn loops_do_not_drift_and_keep_their_energy_for_a_minute() {
    let mut s = linkage().build().unwrap();
    let start = s.gravity_energy() + s.kinetic_energy();
    let (mut gap, mut most, mut scale) = (0.0_f64, 0.0_f64, 0.0_f64);
    for _ in 0..60_000 {
        s.step(1e-3, &mut |_, _| {}).unwrap();
        gap = gap.max(s.largest_gap().0);
        let kinetic = s.kinetic_energy();
        scale = scale.max(kinetic);
        most = most.max((s.gravity_energy() + kinetic - start).abs());
    }
    figure("5 drift", "largest gap of a spatial four-bar over 60 s", "m", 0.0, gap, 1e-6);
    figure("5 energy", "energy error over 60 s / largest kinetic energy", "1", 0.0, most / scale, 1e-3);
}

#[test]
fn a_free_system_keeps_momentum() {
    let mut m = Model::new();
    m.gravity = Vec3::zeros();
    let a = m.body("a", 2.0, Mat3::from_diagonal(&v(0.1, 0.2, 0.25)), v(0.0, 0.0, 0.0), Quat::identity());
    let b = m.body("b", 1.0, Mat3::from_diagonal(&v(0.1, 0.1, 0.15)), v(1.0, 0.0, 0.0), Quat::identity());
    m.universal("cross", a, b, &v(0.5, 0.1, 0.0), &Vec3::y(), &Vec3::z());
    let spring = SpringLaw::Linear { rate: 50.0, free_length: 0.8, preload: 0.0 };
    let (p, q) = (v(0.0, 0.3, 0.2), v(1.0, 0.3, -0.1));
    m.spring(
        &p,
        &q,
        SpringDamper { name: "spring".into(), a, b, p_ap: p, p_bp: q, spring, damper: Default::default(), stops: None },
    );
    let mut s = m.build().unwrap();
    let mut start = *s.motion(a);
    start.set_velocity(&v(0.3, -0.2, 0.1), &v(1.0, 2.0, -0.5));
    s.set_motion(a, start);
    s.project_velocities().unwrap();
    let (p0, l0) = s.momentum();
    run(&mut s, 10.0, 1e-3);
    let (p1, l1) = s.momentum();
    figure("5 momentum", "change over 10 s, free pair of bodies", "N.s", 0.0, (p1 - p0).norm(), 1e-10);
    figure("5 momentum", "relative change of angular momentum", "1", 0.0, (l1 - l0).norm() / l0.norm(), 1e-4);
}

#[test]
fn a_restored_state_continues_to_the_same_bits() {
    let mut s = linkage().build().unwrap();
    run(&mut s, 0.5, 1e-3);
    let saved = s.save();
    run(&mut s, 0.5, 1e-3);
    let mut t = linkage().build().unwrap();
    t.restore(&saved).unwrap();
    run(&mut t, 0.5, 1e-3);
    assert_eq!(s.save(), t.save());
}

#[test]
fn a_joint_that_cannot_close_is_named() {
    let mut m = Model::new();
    let a = m.body("arm", 1.0, sphere(0.1), v(0.5, 0.0, 0.0), Quat::identity());
    m.revolute("shoulder", GROUND, a, &Vec3::zeros(), &Vec3::y());
    m.distance_of("short rod", GROUND, a, &v(3.0, 0.0, 0.0), &v(1.0, 0.0, 0.0), 0.5);
    match m.build() {
        Err(e @ MbsError::DoesNotClose { .. }) => assert!(e.to_string().contains("short rod"), "{e}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn redundant_constraints_are_told() {
    let mut m = Model::new();
    let a = m.body("door", 1.0, sphere(0.1), v(0.5, 0.0, 0.0), Quat::identity());
    m.revolute("upper hinge", GROUND, a, &v(0.0, 0.0, 1.0), &Vec3::z());
    m.revolute("lower hinge", GROUND, a, &v(0.0, 0.0, 0.0), &Vec3::z());
    match m.build() {
        Err(e @ MbsError::Redundant { count: 5, .. }) => {
            let text = e.to_string();
            assert!(text.contains("lower hinge") && text.contains("upper hinge"), "{text}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn impossible_bodies_are_refused() {
    let mut m = Model::new();
    m.body("ghost", 0.0, sphere(0.1), Vec3::zeros(), Quat::identity());
    assert!(m.build().unwrap_err().to_string().contains("'ghost': mass is 0 kg"));
    let mut m = Model::new();
    m.body("needle", 1.0, Mat3::from_diagonal(&v(1.0, 0.1, 0.1)), Vec3::zeros(), Quat::identity());
    assert!(m.build().unwrap_err().to_string().contains("sum of the other two"));
}

#[test]
fn brakes_hold_and_slip() {
    let mut m = Model::new();
    m.gravity = Vec3::zeros();
    let hub = m.body("hub", 10.0, sphere(1.0), Vec3::zeros(), Quat::identity());
    let disc = m.body("disc", 5.0, sphere(2.0), Vec3::zeros(), Quat::identity());
    m.fixed("mount", GROUND, hub, &Vec3::zeros());
    m.revolute("bearing", hub, disc, &Vec3::zeros(), &Vec3::y());
    let brake = m.friction(hub, disc, &Vec3::y());
    let mut s = m.build().unwrap();
    let mut spin = *s.motion(disc);
    spin.set_velocity(&Vec3::zeros(), &v(0.0, 10.0, 0.0));
    s.set_motion(disc, spin);
    s.set_friction(brake, 4.0);
    run(&mut s, 1.0, 1e-3);
    assert!((s.motion(disc).w_body().y - 8.0).abs() < 1e-10, "{}", s.motion(disc).w_body().y);
    assert!((s.friction_torque(brake) + 4.0).abs() < 1e-9);
    run(&mut s, 4.5, 1e-3);
    assert!(s.motion(disc).w_body().y.abs() < 1e-13);
    let angle = rotation::log(&s.motion(disc).q).norm();
    // It stands against a torque within the limit, without creep, and slips beyond it.
    let push = |s: &mut System, torque: f64, n: usize| {
        for _ in 0..n {
            s.step(1e-3, &mut |_, l| l.bodies[disc.index()][4] += torque).unwrap();
        }
    };
    push(&mut s, 3.0, 2000);
    assert!((rotation::log(&s.motion(disc).q).norm() - angle).abs() < 1e-12);
    push(&mut s, 6.0, 1000);
    assert!((s.motion(disc).w_body().y - 1.0).abs() < 1e-10);
}

#[test]
fn joints_leave_the_freedom_they_should() {
    let mut m = Model::new();
    let slider = m.body("slider", 2.0, sphere(0.1), v(0.0, 0.0, 0.0), Quat::identity());
    let bob = m.body("bob", 1.0, sphere(0.1), v(0.0, 0.0, -0.5), Quat::identity());
    m.prismatic("rail", GROUND, slider, &Vec3::zeros(), &v(1.0, 0.0, 0.0));
    m.revolute_spherical("link", slider, bob, &v(0.0, 0.0, 0.0), &Vec3::y(), &v(0.0, 0.0, -0.4));
    let rack_body = m.body("rack body", 1.0, sphere(0.1), v(0.0, 1.0, 0.0), Quat::identity());
    let rack = m.rack("rack", GROUND, rack_body, &v(0.0, 1.0, 0.0), &Vec3::y());
    let motor_body = m.body("arm", 1.0, sphere(0.1), v(0.0, 2.0, 0.0), Quat::identity());
    let motor = m.revolute_motor("motor", GROUND, motor_body, &v(0.0, 2.0, 0.0), &Vec3::z());
    let mut s = m.build().unwrap();
    let h = 1e-3;
    for k in 1..=1000 {
        let t = f64::from(k) * h;
        s.set_drive(rack, 0.1 * t * t, 0.2 * t);
        s.set_drive(motor, 1.5 * t * t, 3.0 * t);
        s.step(h, &mut |_, l| l.bodies[slider.index()][0] += 6.0).unwrap();
    }
    let p = s.motion(slider).p;
    assert!(p.x > 0.5 && p.yz().norm() < 1e-9, "{p:?}");
    assert!((s.motion(rack_body).p.y - 1.1).abs() < 1e-9 && (s.motion(rack_body).v().y - 0.2).abs() < 1e-9);
    let turned = rotation::log(&s.motion(motor_body).q);
    assert!((turned - v(0.0, 0.0, 1.5)).norm() < 1e-8, "{turned:?}");
    assert!((s.motion(motor_body).w_body().z - 3.0).abs() < 1e-9);
}
