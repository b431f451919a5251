//! The wheel comes down gently: on a stiff plane, on a soft one, on soil that yields, and in the air.

mod support;
use support::{Contact, Rig, hertz_plane, plastic_soil};

const LOAD: &str = r#"{"load": {"force": 25}}"#;

/// Greatest force over load, least force after first reaching the load over load, and the time of the drive's start.
fn touchdown(rig: &mut Rig, soil: &mut dyn FnMut(&Contact, f64) -> [f64; 3], size: f64) -> (f64, f64, f64) {
    let load = 25.0;
    let (mut greatest, mut least, mut reached) = (0.0f64, f64::MAX, false);
    let mut driving = f64::NAN;
    while rig.time < 3.0 {
        let next = rig.time + size;
        rig.run(soil, size, next);
        let f = rig.get("wheel[1].force.z");
        greatest = greatest.max(f / load);
        reached |= f >= 0.99 * load;
        if reached && rig.time > 0.3 {
            least = least.min(f / load);
        }
        if driving.is_nan() && rig.phase() >= 3 {
            driving = rig.time;
        }
    }
    (greatest, least, driving)
}

#[test]
fn a_soft_damped_plane_is_met_without_overshoot() {
    // 25 N at a depth of 1 mm; contact stiffness 37.5 kN/m.
    let k = 25.0 / 1e-3f64.powf(1.5);
    for size in [1e-4, 5e-4, 1e-3] {
        let mut rig = Rig::ready(LOAD);
        let (greatest, least, driving) = touchdown(&mut rig, &mut hertz_plane(k, 500.0), size);
        println!("H {size}: greatest {greatest}, least {least}, drive at {driving} s");
        assert!(greatest < 1.05 && least > 0.97, "H {size}: {greatest} {least}");
        assert!(driving > 0.1 && driving < 0.5, "{driving}");
        assert!((rig.get("sinkage") - 1e-3).abs() < 1e-5);
        assert!((rig.get("wheel_force.z") - 25.0).abs() < 0.05);
    }
}

#[test]
fn rigid_ground_is_met_without_a_bounce() {
    // 25 N at a depth of 10 micrometres: 3.75 MN/m. With 2.5 kg the undamped contact sways in 5 ms.
    let k = 25.0 / 1e-5f64.powf(1.5);
    let mut rig = Rig::ready(LOAD);
    let mut soil = hertz_plane(k, 2e5);
    let (mut touched, mut highest) = (false, f64::MIN);
    while rig.time < 1.0 {
        let next = rig.time + 2e-5;
        rig.run(&mut soil, 2e-5, next);
        touched |= rig.get("wheel[1].force.z") > 0.0;
        if touched {
            highest = highest.max(-rig.get("sinkage"));
        }
    }
    println!("highest after first touch {highest} m");
    assert!(touched && highest < 5e-5, "{highest}");
    assert!((rig.get("wheel_force.z") - 25.0).abs() < 0.1);
}

#[test]
fn soil_that_yields_carries_the_load_and_no_more() {
    // 25 N at 15 mm.
    let mut rig = Rig::ready(LOAD);
    let (greatest, least, driving) = touchdown(&mut rig, &mut plastic_soil(25.0 / 0.015), 5e-4);
    println!("greatest {greatest}, least {least}, drive at {driving} s, sinkage {}", rig.get("sinkage"));
    assert!(greatest < 1.02, "{greatest}");
    assert!((rig.get("sinkage") - 0.015).abs() < 3e-4);
    assert!(driving < 0.8);
}

#[test]
fn in_the_air_it_is_lowered_at_the_speed_set_and_ends_at_the_stop() {
    let mut rig = Rig::ready("");
    let z0 = rig.get("wheel[1].position.z");
    assert!((z0 - 0.063).abs() < 1e-15);
    rig.run(&mut |_, _| [0.0; 3], 1e-3, 1.0);
    let z = rig.get("wheel[1].position.z");
    assert!((z0 - z - 0.05).abs() < 5e-4, "{z}");
    assert_eq!(rig.phase(), 1);
    assert!((rig.get("wheel[1].velocity.z") + 0.05).abs() < 1e-12);
    rig.run(&mut |_, _| [0.0; 3], 1e-3, 3.0);
    assert!((rig.get("sinkage") - 1.5 * 0.058).abs() < 1e-12);
    assert_eq!(rig.get("wheel[1].velocity.z"), 0.0);
    assert!(rig.phase() >= 4);
    let log = rig.log.borrow();
    assert_eq!(log.iter().filter(|l| l.contains("end stop")).count(), 1, "{log:?}");
}

#[test]
fn the_end_stop_lets_the_wheel_rise_again() {
    let mut rig = Rig::ready(r#"{"slide": {"greatest_sinkage": 0.001}}"#);
    rig.run(&mut |_, _| [0.0; 3], 1e-3, 0.5);
    assert!((rig.get("sinkage") - 0.001).abs() < 1e-15);
    rig.run(&mut |_, _| [0.0, 0.0, 26.0], 1e-3, 0.6);
    assert!(rig.get("sinkage") < 0.001);
}

#[test]
fn grousers_are_placed_above_the_ground() {
    let mut rig = Rig::entered("");
    rig.set("ground_height", 0.3).unwrap();
    rig.set("wheel[1].outer_radius", 0.064).unwrap();
    assert!((rig.get("wheel[1].position.z") - 0.369).abs() < 1e-15);
    assert!((rig.get("sinkage") + 0.011).abs() < 1e-15);
}

#[test]
fn a_tire_that_sends_the_hub_s_inertia_back_is_met_without_chatter() {
    // A flexible tire: 330 kN/m, 11.6 kg handed to the hub, which it answers with at the acceleration of the step before.
    for (size, speed) in [(4e-5, 0.03), (4e-5, 0.12), (2e-4, 0.12), (1e-3, 0.12)] {
        let mut rig = Rig::entered(&format!(
            r#"{{"load": {{"mass": 500, "force": 5000}}, "slide": {{"lowering_speed": {speed}}}, "inner_step": 4e-5}}"#
        ));
        rig.set("wheel[1].hub_mass", 11.6).unwrap();
        rig.exit();
        let mut before = 0.0;
        let mut soil = |c: &Contact, size: f64| {
            let acceleration = (c.velocity[2] - before) / size;
            before = c.velocity[2];
            [0.0, 0.0, 3.3e5 * c.depth.max(0.0) + 11.6 * acceleration]
        };
        let (mut last, mut jump) = (0.0, 0.0f64);
        // The slide's damper lets the load come slowly where it lowers slowly.
        while rig.time < 0.06 / speed + 0.5 {
            let next = rig.time + size;
            rig.run(&mut soil, size, next);
            let speed = rig.get("wheel[1].velocity.z");
            jump = jump.max((speed - last).abs());
            last = speed;
        }
        // No more than free fall, but at touchdown with a long step.
        assert!(jump < 9.81 * size * 1.01 + 0.1 * speed, "H {size}, {speed} m/s: the speed jumps by {jump} m/s");
        let force = rig.get("wheel_force.z");
        assert!((force - 5000.0).abs() < 25.0, "H {size}, {speed} m/s: {force} N");
    }
}
