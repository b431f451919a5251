//! Balances: load, drawbar pull, torque, frames of forces, the pull-slip curve.

mod support;
use support::{Contact, Rig, hertz_plane};

const R: f64 = 0.058;
const STANDING: &str = r#""slide": {"gap": 0, "greatest_sinkage": 1e-9, "release": 0.01}"#;

fn plane() -> impl FnMut(&Contact, f64) -> [f64; 3] {
    hertz_plane(25.0 / 1e-3f64.powf(1.5), 500.0)
}

#[test]
fn the_soil_carries_the_stated_force_whatever_the_masses() {
    for (mass, hub) in [(2.5, 0.0), (1.0, 1.0), (4.0, 0.5)] {
        let mut rig = Rig::entered(&format!(r#"{{"load": {{"mass": {mass}, "force": 25}}}}"#));
        rig.set("wheel[1].hub_mass", hub).unwrap();
        assert!((rig.get("wheel[1].load_mass") - 25.0 / 9.81).abs() < 1e-12);
        rig.exit();
        rig.run(&mut plane(), 5e-4, 1.5);
        assert!((rig.get("wheel_force_filtered.z") - 25.0).abs() < 0.02, "{mass} {hub}");
    }
}

#[test]
fn a_mass_presses_with_its_weight_and_the_hub_s() {
    let mut rig = Rig::entered(r#"{"load": {"mass": 2}}"#);
    rig.set("wheel[1].hub_mass", 0.5).unwrap();
    assert_eq!(rig.get("wheel[1].load_mass"), 2.0);
    rig.exit();
    rig.run(&mut plane(), 5e-4, 1.5);
    assert!((rig.get("wheel_force_filtered.z") - 2.5 * 9.81).abs() < 0.02);
}

#[test]
fn a_force_forward_on_the_wheel_is_a_positive_pull() {
    let mut rig = Rig::ready(&format!(r#"{{{STANDING}, "drive": {{"delay": 0, "ramp": 0.2}}}}"#));
    rig.run(&mut |_, _| [3.0, 0.0, 20.0], 1e-3, 1.0);
    assert!((rig.get("drawbar_pull") - 3.0).abs() < 1e-12);
    assert!((rig.get("drawbar_pull_filtered") - 3.0).abs() < 1e-12);
    assert!((rig.get("wheel_force.z") - 20.0).abs() < 1e-12);
}

#[test]
fn while_the_carriage_speeds_up_the_pull_lacks_the_slide_s_inertia() {
    let mut rig = Rig::entered(&format!(
        r#"{{{STANDING}, "load": {{"mass": 2}}, "drive": {{"slip": 0, "speed": 0.1, "delay": 0, "ramp": 0.2}}}}"#
    ));
    rig.set("wheel[1].hub_mass", 1.0).unwrap();
    rig.exit();
    let (mut impulse, mut v) = (0.0, 0.0);
    while rig.time < 0.5 {
        rig.step(1e-3).unwrap();
        let now = rig.get("carrier.velocity");
        assert!((rig.get("drawbar_pull") + 3.0 * (now - v) / 1e-3).abs() < 1e-9);
        impulse += rig.get("drawbar_pull") * 1e-3;
        v = now;
    }
    assert!((impulse + 3.0 * 0.1).abs() < 1e-12);
}

#[test]
fn torque_turns_the_inertia_and_holds_against_the_soil() {
    let mut rig = Rig::entered(&format!(
        r#"{{{STANDING}, "spin_inertia": 0.01, "drive": {{"slip": 0.5, "speed": 0.1, "delay": 0, "ramp": 0.2}}}}"#
    ));
    rig.set("wheel[1].hub_inertia.yy", 0.02).unwrap();
    rig.exit();
    let mut angular_impulse = 0.0;
    while rig.time < 0.5 {
        rig.step(1e-3).unwrap();
        angular_impulse += rig.get("wheel_torque") * 1e-3;
    }
    assert!((angular_impulse - 0.03 * 0.2 / R).abs() < 1e-12);
    // The soil brakes the driven wheel: its moment about +Y is negative, the drive's torque positive.
    rig.set("wheel[1].moment.y", -0.7).unwrap();
    rig.step(1e-3).unwrap();
    assert!((rig.get("wheel_torque") - 0.7).abs() < 1e-12);
}

#[test]
fn wheel_forces_are_in_the_heading_frame() {
    let angle = std::f64::consts::FRAC_PI_6;
    let mut rig = Rig::ready(&format!(r#"{{{STANDING}, "toe": {{"angle": {angle}}}}}"#));
    rig.push([1.0, 2.0, 3.0]);
    for (axis, x) in [("x", 0.3), ("y", 0.4)] {
        rig.set(&format!("wheel[1].moment.{axis}"), x).unwrap();
    }
    rig.step(1e-3).unwrap();
    let [x, y, z] = rig.vector("wheel_force");
    let (s, c) = angle.sin_cos();
    assert!((x - (c + 2.0 * s)).abs() < 1e-14 && (y - (2.0 * c - s)).abs() < 1e-14 && z == 3.0);
    // The pull is along the carriage.
    assert!((rig.get("drawbar_pull") - 1.0).abs() < 1e-14);
    assert!((rig.get("wheel_torque") + (0.4 * c - 0.3 * s)).abs() < 1e-14);
}

/// Pull 10 N times slip/(slip + 0.2): grows with slip, 8.33 N at slip 1.
fn traction(c: &Contact, _: f64) -> [f64; 3] {
    [10.0 * c.slip / (c.slip.abs() + 0.2), 0.0, 25.0]
}

#[test]
fn a_growing_resistance_runs_through_the_pull_slip_curve_and_ends_the_run() {
    let mut rig = Rig::ready(&format!(
        r#"{{{STANDING}, "carriage": {{"mass": 1}}, "drive": {{"mode": "imposed_angular_speed", "angular_speed": 2,
            "delay": 0.1, "ramp": 0.2, "resistance": {{"rate": 2}}}}}}"#
    ));
    let mut points = Vec::new();
    let end = loop {
        let now = rig.contact();
        if let Err(e) = rig.step(1e-3) {
            break e;
        }
        assert!(rig.time < 8.0);
        rig.push(traction(&now, 1e-3));
        let (slip, pull) = (rig.get("slip"), rig.get("drawbar_pull"));
        assert!(rig.get("carrier.velocity") >= 0.0);
        if rig.time > 1.0 {
            points.push((slip, pull));
        }
    };
    assert!(end.contains("stopped the carriage") && rig.instance.ended(), "{end}");
    assert_eq!((rig.get("carrier.velocity"), rig.get("slip")), (0.0, 1.0));
    assert!((rig.instance.last_successful_time() - rig.time).abs() < 1e-9);
    // The greatest pull, 10/1.2 N, is reached 4.17 s after the ramp's end; then the momentum of 3.5 kg is used up.
    let late = rig.time - 0.312 - 10.0 / 1.2 / 2.0;
    assert!(late > 0.0 && late < 0.3, "{late}");
    for s in [0.1, 0.3, 0.6, 0.9] {
        let near = points.iter().min_by(|a, b| (a.0 - s).abs().total_cmp(&(b.0 - s).abs())).unwrap();
        let expected = 10.0 * near.0 / (near.0 + 0.2);
        // Towards the stop the braked slide's inertia adds up to 0.3 N.
        assert!((near.1 / expected - 1.0).abs() < 0.04, "{near:?} {expected}");
    }
}

#[test]
fn a_stopped_carriage_may_be_held() {
    let mut rig = Rig::ready(&format!(
        r#"{{{STANDING}, "carriage": {{"mass": 1}}, "drive": {{"mode": "imposed_angular_speed", "angular_speed": 2,
            "delay": 0.1, "ramp": 0.2, "resistance": {{"rate": 20, "at_stop": "hold"}}}}}}"#
    ));
    rig.run(&mut traction, 1e-3, 2.0);
    assert_eq!((rig.get("carrier.velocity"), rig.get("slip"), rig.phase()), (0.0, 1.0, 6));
    let x = rig.get("carrier.position");
    rig.run(&mut traction, 1e-3, 2.2);
    assert_eq!(rig.get("carrier.position"), x);
}
