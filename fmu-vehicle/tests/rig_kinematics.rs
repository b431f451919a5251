//! Motions of all modes: speeds, slip, heading, orientation, positions.

mod support;
use support::Rig;
use terramech_mechanics::rotation;

const R: f64 = 0.058;
/// Touches down at once: the end stop is at the gap's end.
const STANDING: &str = r#""slide": {"gap": 0, "greatest_sinkage": 1e-9, "release": 0.01}"#;

fn spec(drive: &str, rest: &str) -> String {
    format!(r#"{{"drive": {{{drive}}}, {STANDING}{rest}}}"#)
}

/// Runs without soil; the stop carries the wheel.
fn drive(rig: &mut Rig, size: f64, time: f64) {
    rig.run(&mut |_, _| [0.0; 3], size, time);
}

#[test]
fn imposed_slip_from_the_carriage_speed() {
    for s in [-1.0, -0.7, -0.2, 0.0, 0.231, 0.5, 0.75, 0.9] {
        let mut rig = Rig::ready(&spec(&format!(r#""slip": {s}, "speed": 0.1, "delay": 0.1, "ramp": 0.2"#), ""));
        drive(&mut rig, 1e-3, 0.05);
        assert_eq!((rig.get("carrier.velocity"), rig.get("wheel_speed"), rig.get("slip")), (0.0, 0.0, 0.0));
        drive(&mut rig, 1e-3, 0.2);
        // In the middle of the ramp the slip is already the one asked for.
        assert!(rig.get("carrier.velocity") > 0.01 && rig.get("carrier.velocity") < 0.09);
        assert!((rig.get("slip") - s).abs() < 1e-12, "{s}: {}", rig.get("slip"));
        drive(&mut rig, 1e-3, 1.0);
        let (v, omega) = (rig.get("carrier.velocity"), rig.get("wheel_speed"));
        assert!((v - 0.1).abs() < 1e-15 && (rig.get("slip") - s).abs() < 1e-12);
        let expected = if s >= 0.0 { 0.1 / (1.0 - s) / R } else { 0.1 * (1.0 + s) / R };
        assert!((omega - expected).abs() < 1e-12 * (1.0 + expected), "{s}: {omega}");
        // Half of the ramp counts: from the end of the touchdown at about 0.011 s, less delay and half the ramp.
        let x = rig.get("carrier.position");
        assert!((x - 0.1 * (1.0 - 0.011 - 0.1 - 0.1)).abs() < 3e-4, "{x}");
        assert_eq!(rig.get("slip_filtered"), rig.get("slip_filtered").clamp(s - 1e-9, s + 1e-9));
    }
}

#[test]
fn imposed_slip_from_the_wheel_speed() {
    for s in [-0.5, 0.3, 1.0] {
        let text = format!(r#""base": "angular_speed", "angular_speed": 2, "slip": {s}, "delay": 0, "ramp": 0.1"#);
        let mut rig = Rig::ready(&spec(&text, ""));
        drive(&mut rig, 1e-3, 0.5);
        assert_eq!(rig.get("wheel_speed"), 2.0);
        let expected = if s >= 0.0 { 2.0 * R * (1.0 - s) } else { 2.0 * R / (1.0 + s) };
        assert!((rig.get("carrier.velocity") - expected).abs() < 1e-15);
        assert!((rig.get("slip") - s).abs() < 1e-12);
    }
}

#[test]
fn parameters_override_the_specification() {
    let mut rig = Rig::entered(&spec(r#""slip": 0.5, "speed": 0.4"#, ""));
    rig.set("drive.slip", 0.25).unwrap();
    // Set to its start value: given all the same.
    rig.set("drive.speed", 0.1).unwrap();
    assert_eq!(rig.get("carrier.velocity"), 0.0);
    rig.exit();
    drive(&mut rig, 1e-3, 1.0);
    assert!((rig.get("slip") - 0.25).abs() < 1e-12 && (rig.get("carrier.velocity") - 0.1).abs() < 1e-15);
    assert!(rig.set("drive.slip", 0.1).unwrap_err().contains("after initialization"));
}

#[test]
fn the_wheel_s_state_is_that_of_a_body_that_turns_about_z_and_its_axle() {
    let toe = r#", "toe": {"angle": 0.26, "delay": 0.1, "ramp": 0.4}"#;
    let mut rig = Rig::ready(&spec(r#""slip": 0.2, "speed": 0.1, "delay": 0.0, "ramp": 0.3"#, toe));
    assert_eq!(rig.orientation(), [1.0, 0.0, 0.0, 0.0]);
    let h = 1e-4;
    let mut tested = 0;
    while rig.time < 1.0 {
        let (q0, p0) = (rotation::from_wxyz(rig.orientation()).unwrap(), rig.vector("wheel[1].position"));
        let next = rig.time + h;
        drive(&mut rig, h, next);
        let (w, v) = (rig.vector("wheel[1].angular_velocity"), rig.vector("wheel[1].velocity"));
        let q1 = rotation::from_wxyz(rig.orientation()).unwrap();
        // Differences lag by half a step: at accelerations of 100 rad/s2 and 1 m/s2 that much.
        let turned = rotation::log(&(q1 * q0.inverse())) / h;
        let p1 = rig.vector("wheel[1].position");
        for k in 0..3 {
            assert!((turned[k] - w[k]).abs() < 2e-3, "t {}: {turned} {w:?}", rig.time);
            assert!(((p1[k] - p0[k]) / h - v[k]).abs() < 2e-4, "t {}: {p0:?} {p1:?} {v:?}", rig.time);
        }
        tested += 1;
    }
    assert!(tested > 5000);
    assert!((rig.get("slip_angle") - 0.26).abs() < 1e-15);
    // Rolling forward turns about the axle, which points to the left of the heading.
    let w = rig.vector("wheel[1].angular_velocity");
    let omega = rig.get("wheel_speed");
    assert!((w[0] + omega * 0.26f64.sin()).abs() < 1e-12 && (w[1] - omega * 0.26f64.cos()).abs() < 1e-12);
    // Its slip refers to the carriage's speed along X, not to the speed along the heading.
    assert!((rig.get("slip") - 0.2).abs() < 1e-12);
}

#[test]
fn a_heading_without_ramp_is_turned_from_the_start() {
    let mut rig = Rig::entered(r#"{"toe": {"angle": 0.5}}"#);
    let q = rig.orientation();
    assert!((q[0] - 0.25f64.cos()).abs() < 1e-15 && (q[3] - 0.25f64.sin()).abs() < 1e-15);
}

#[test]
fn a_rolling_start_has_full_speed_at_once() {
    let mut rig = Rig::entered(r#"{"drive": {"start": "rolling", "slip": 0.2, "speed": 0.1}}"#);
    assert_eq!(rig.get("carrier.velocity"), 0.1);
    assert!((rig.get("slip") - 0.2).abs() < 1e-15);
    rig.exit();
    drive(&mut rig, 1e-3, 0.3);
    assert!((rig.get("carrier.position") - 0.03).abs() < 1e-12);
    assert_eq!(rig.phase(), 1);
}

#[test]
fn communication_steps_that_the_inner_step_does_not_divide() {
    let text = spec(r#""slip": 0.2, "speed": 0.1, "delay": 0.0, "ramp": 0.1"#, "");
    let (mut a, mut b) = (Rig::ready(&text), Rig::ready(&text));
    drive(&mut a, 1e-3, 0.5);
    drive(&mut b, 2.5e-4 * (1.0 + 1e-13), 0.5);
    assert!((a.get("carrier.position") - b.get("carrier.position")).abs() < 1e-4);
    assert!((a.get("slip") - b.get("slip")).abs() < 1e-12);
}
