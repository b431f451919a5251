//! Handling on a rigid plane with tires inside: cases 5.5, 5.8 and 9.6, and that every tire model drives.

mod checks;
mod study;

use checks::{figure, relative};
use fmu_vehicle::vehicle::tires::TireModel;
use fmu_vehicle::vehicle::{DriverInputs, Part, Place, VehicleSpec};
use study::{EXTERNAL, Study};
use terramech_handling_tires::{Contact, Probe};
use terramech_mechanics::Vec3;

#[test]
fn it_stands_still_where_it_was_placed() {
    let mut s = Study::new(TireModel::Fiala(None), EXTERNAL, 0.0);
    s.run(3.0, 1e-3);
    let weight = s.v.system.mass() * 9.81;
    let loads = s.wheel_loads();
    relative("5 rest", "sum of tire loads of the standing HMMWV", "N", weight, loads.iter().sum(), 1e-3);
    for (i, load) in loads.iter().enumerate() {
        relative("5 rest", &format!("load of tire {} against static equilibrium", i + 1), "N", s.loads[i], *load, 1e-3);
    }
    let v = s.v.chassis_state().state.velocity.norm();
    assert!(v < 1e-3, "{v}");
}

#[test]
fn case_5_8_acceleration_does_not_depend_on_the_step() {
    let speed = |h: f64| {
        let mut s = Study::new(TireModel::Fiala(None), EXTERNAL, 0.0);
        s.v.inputs = DriverInputs { throttle: 1.0, ..DriverInputs::default() };
        s.run(3.5, h);
        s.v.chassis_state().state.velocity.x
    };
    let (coarse, fine) = (speed(1e-3), speed(2.5e-4));
    relative("5.8", "speed after 3.5 s at full throttle, step 1e-3 against 2.5e-4 s", "m/s", fine, coarse, 1e-3);
}

/// The excess load of the outer tires balances the centrifugal moment of the whole vehicle.
#[test]
fn case_5_5_steady_circle() {
    let mut s = Study::new(
        TireModel::Fiala(None),
        r#"{"kind": {"path": {"path": {"circle": {"radius": 30, "lead": 5}}, "speed": 10, "speed_pid": {"kp": 0.6, "ki": 0.2}}}}"#,
        9.5,
    );
    s.run(16.0, 1e-3);
    // Means over one second of the steady turn.
    let (mut loads, mut a, mut height, mut n) = ([0.0; 4], 0.0, 0.0, 0.0);
    let mut gyroscopic = 0.0;
    let (mut yaw, mut speed, mut across) = (0.0, 0.0, [Vec3::zeros(); 4]);
    for _ in 0..1000 {
        s.run(1e-3, 1e-3);
        let c = s.v.chassis_state().state;
        let r = (c.orientation * Vec3::x()).xy();
        let left = Vec3::new(-r.y, r.x, 0.0).normalize();
        let com = s.v.system.center_of_mass();
        for (i, f) in s.wheel_loads().iter().enumerate() {
            loads[i] += f;
            let wheel = s.v.wheel_state(i);
            let contact = Contact::new(&wheel, &Probe::level(0.0, 0.8), s.tires.tire.radius()).unwrap();
            let p = wheel.position + contact.arm - com;
            across[i] += Vec3::new(p.dot(&Vec3::new(left.y, -left.x, 0.0)), p.dot(&left), p.z);
        }
        let (p, l) = s.v.system.momentum();
        gyroscopic += c.angular_velocity.z * (l - com.cross(&p)).dot(&left);
        yaw += c.angular_velocity.z;
        speed += c.velocity.xy().norm();
        a += c.angular_velocity.z * c.velocity.xy().norm();
        height += com.z;
        n += 1.0;
    }
    let m = s.v.system.mass();
    let (a, height) = (a / n, height / n);
    let side = loads.iter().sum::<f64>() / n;
    relative("5.5", "sum of tire loads in the turn", "N", m * 9.81, side, 2e-3);
    relative("5.5", "speed on the circle", "m/s", 10.0, speed / n, 2e-2);
    // Moments about the point on the ground under the centre of mass: the outer loads' excess balances m a h.
    let moment: f64 = (0..4).map(|i| -(loads[i] / n) * (across[i].y / n)).sum();
    // The spinning wheels turn with the vehicle: their couple adds 3 % to m a h.
    let expected = m * a * height + gyroscopic / n;
    relative("5.5", "moment of the wheel loads: m a h + wheels' gyroscopic couple", "N.m", expected, moment, 1e-2);
    println!("m a h {:.1} N m, gyroscopic {:.1} N m", m * a * height, gyroscopic / n);
    println!("a {a:.3} m/s2, yaw rate {:.4} rad/s, h {height:.3} m, loads {loads:?}", yaw / n);
}

#[test]
fn understeer_follows_from_the_axles_cornering_stiffness() {
    // Constant speed, small steady steering input: yaw rate = v/(L + K v^2) delta with K = m/L (b/C_f - a/C_r).
    let mut s = Study::new(
        TireModel::Fiala(None),
        r#"{"kind": {"path": {"path": {"circle": {"radius": 150, "lead": 5}}, "speed": 12, "speed_pid": {"kp": 0.6, "ki": 0.2}}}}"#,
        11.8,
    );
    s.run(12.0, 1e-3);
    let (mut delta, mut front, mut rear, mut curvature) = (0.0, 0.0, 0.0, 0.0);
    for _ in 0..1000 {
        s.run(1e-3, 1e-3);
        let c = s.v.chassis_state().state;
        let q = c.orientation.inverse();
        // Steering angle and slip angle of each axle by its wheels' headings and velocities.
        for i in 0..4 {
            let w = s.v.wheel_state(i);
            let axle = q * (w.orientation * Vec3::y());
            let heading = (-axle.x).atan2(axle.y);
            let v = q * w.velocity;
            let slip = v.y.atan2(v.x) - heading;
            if i < 2 {
                delta += heading / 2e3;
                front += slip / 2e3;
            } else {
                delta -= heading / 2e3;
                rear += slip / 2e3;
            }
        }
        curvature += c.angular_velocity.z / c.velocity.xy().norm() / 1e3;
    }
    let (f, r) = (s.v.wheel_state(0).position, s.v.wheel_state(2).position);
    let wheelbase = (f - r).xy().norm();
    // Kinematics of the turn: delta = L/R + alpha_r - alpha_f, slip angles negative to the left.
    relative("5.5", "steering angle: L/R + K a", "rad", wheelbase * curvature + rear - front, delta, 1e-2);
}

#[test]
fn case_9_6_mirrored_runs_are_mirrored() {
    let run = |side: f64| {
        let mut s = Study::new(
            TireModel::Pac02 { tir: None, file: None, mass: 37.6, inertia: [3.84, 6.69, 3.84] },
            EXTERNAL,
            8.0,
        );
        s.v.inputs = DriverInputs { throttle: 0.3, steering: 0.2 * side, braking: 0.0 };
        s.run(3.0, 1e-3);
        s.v.chassis_state().state
    };
    let (l, r) = (run(1.0), run(-1.0));
    println!("left {:?} right {:?}", l.position.as_slice(), r.position.as_slice());
    assert!(l.position.y > 1.0);
    // The Pitman arm sits on the left of the vehicle and swings to one side: mirrored up to its effect of 1e-4.
    figure(
        "9.6",
        "y of mirrored runs on rigid ground, sum / travel",
        "1",
        0.0,
        (l.position.y + r.position.y) / l.position.x,
        1e-3,
    );
}

/// With a rack in the middle instead of the Pitman arm, and without what turns about X (the drive's reaction rolls the chassis to one side), the
/// vehicle is symmetric, and so are its runs.
#[test]
fn case_9_6_a_symmetric_vehicle_is_mirrored_to_round_off() {
    let mut spec =
        serde_json::to_value(VehicleSpec::read("hmmwv/vehicle.json", &Place::Folder(None)).unwrap()).unwrap();
    spec["steering"] = serde_json::json!([{"rack_pinion": {"rack": {"mass": 5.0, "inertia": [0.3, 0.1, 0.3]},
        "rack_com": [1.44, 0.0, 0.05], "full_angle": 1.0, "pinion_radius": 0.06, "direction": -1.0}}]);
    for part in ["driveline", "powertrain"] {
        spec.as_object_mut().unwrap().remove(part);
    }
    let Part::Inline(spec) = serde_json::from_value::<Part<VehicleSpec>>(spec).unwrap() else { panic!("in place") };
    let run = |side: f64| {
        let mut s = Study::of(&spec, TireModel::Fiala(None), EXTERNAL, 8.0);
        s.v.inputs = DriverInputs { throttle: 0.0, steering: 0.2 * side, braking: 0.0 };
        s.run(3.0, 1e-3);
        s.v.chassis_state().state
    };
    let (l, r) = (run(1.0), run(-1.0));
    assert!(l.position.y.abs() > 1.0, "{l:?}");
    figure(
        "9.6",
        "symmetric vehicle, y of mirrored runs: sum / travel",
        "1",
        0.0,
        (l.position.y + r.position.y) / l.position.x,
        1e-9,
    );
    figure(
        "9.6",
        "symmetric vehicle, x of mirrored runs: difference / travel",
        "1",
        0.0,
        (l.position.x - r.position.x) / l.position.x,
        1e-9,
    );
}

#[test]
fn every_tire_model_drives() {
    for model in [
        TireModel::Rigid(Default::default()),
        TireModel::Fiala(None),
        TireModel::Pac02 { tir: None, file: None, mass: 37.6, inertia: [3.84, 6.69, 3.84] },
    ] {
        let mut s = Study::new(model.clone(), EXTERNAL, 0.0);
        s.v.inputs.throttle = 0.8;
        s.run(4.0, 1e-3);
        let x = s.v.chassis_state().state;
        println!("{:?}: {:.2} m/s after 4 s", std::mem::discriminant(&model), x.velocity.x);
        assert!(x.velocity.x > 3.0 && x.position.y.abs() < 0.5, "{x:?}");
        s.v.inputs = DriverInputs { braking: 1.0, ..DriverInputs::default() };
        s.run(4.0, 1e-3);
        let v = s.v.chassis_state().state.velocity.norm();
        assert!(v < 0.05, "{model:?} stands after braking: {v}");
    }
}
