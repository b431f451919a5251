//! The HMMWV: kinematics, rest, powertrain (cases 5.4, 5.6, 5.7, 5.8), payload.

mod checks;

use checks::{figure, relative};
use fmu_vehicle::mbs::{GROUND, Model};
use fmu_vehicle::powertrain::Mode;
use fmu_vehicle::suspension::AxleContext;
use fmu_vehicle::vehicle::place::Rest;
use fmu_vehicle::vehicle::{Hub, Payload, Place, Vehicle, VehicleSpec};
use terramech_mechanics::{Mat3, Quat, Vec3};

fn hmmwv() -> VehicleSpec {
    VehicleSpec::read("hmmwv/vehicle.json", &Place::Folder(None)).unwrap()
}

#[test]
fn case_5_4_wishbone_kinematics() {
    let spec = hmmwv();
    let mut m = Model::new();
    let chassis = m.body("chassis", 1000.0, Mat3::identity() * 500.0, Vec3::zeros(), Quat::identity());
    m.fixed("bench", GROUND, chassis, &Vec3::zeros());
    let c = AxleContext { name: "front".into(), origin: Vec3::zeros(), chassis, tie_rod: chassis };
    let corners = spec.axles[0].suspension.get().template().1.build(&mut m, &c);
    let jack = m.support("jack", corners[0].spindle, &corners[0].center);
    let mut s = m.build().unwrap();
    let expected = [
        (-60.0, 0.9922, 0.4595),
        (-20.0, 0.4297, 0.1161),
        (20.0, -0.5159, -0.0904),
        (60.0, -1.7873, -0.2157),
        (100.0, -3.3639, -0.2936),
    ];
    for (travel, camber, toe) in expected {
        s.set_drive(jack, travel * 1e-3, 0.0);
        s.close().unwrap();
        let axis = s.motion(corners[0].spindle).q * Vec3::y();
        // Left wheel: the axis tips down outboard when the top leans outboard; it turns back when the wheel toes in.
        let found_camber = (-axis.z).asin().to_degrees();
        let found_toe = axis.x.atan2(axis.y).to_degrees();
        figure("5.4", &format!("camber at {travel} mm"), "deg", camber, found_camber, 1e-3);
        figure("5.4", &format!("toe at {travel} mm"), "deg", toe, found_toe, 1e-3);
    }
    // The whole curve for the tables' plot.
    let mut curves = [String::new(), String::new()];
    for travel in (-60..=100).step_by(5) {
        s.set_drive(jack, f64::from(travel) * 1e-3, 0.0);
        s.close().unwrap();
        let axis = s.motion(corners[0].spindle).q * Vec3::y();
        for (curve, angle) in curves.iter_mut().zip([(-axis.z).asin(), axis.x.atan2(axis.y)]) {
            curve.push_str(&format!("{} {};", f64::from(travel) * 1e-3, angle));
        }
    }
    let reference = |k: usize| -> String {
        expected.iter().map(|e| format!("{} {};", e.0 * 1e-3, [e.1, e.2][k] * std::f64::consts::PI / 180.0)).collect()
    };
    for (k, name) in ["camber", "toe"].into_iter().enumerate() {
        let head = format!("\nCURVE|kinematics|HMMWV front wishbone: camber and toe|travel|m|{name}|rad");
        println!("{}|line|{name}|{}", head.replace(&format!("|{name}|"), "|angle|"), curves[k]);
        println!("{}|points|{name}, reference|{}", head.replace(&format!("|{name}|"), "|angle|"), reference(k));
    }
}

#[test]
fn masses_are_the_sum_of_the_data() {
    let v = Vehicle::build(&hmmwv(), &[], &[], Mode::Drive, false).unwrap();
    figure("5 mass", "without tires", "kg", 2422.738, v.system.mass(), 1e-9);
    let layered = [Hub { mass: 4.838, inertia: [0.1; 3], tire_radius: 0.0 }; 4];
    let v = Vehicle::build(&hmmwv(), &[], &layered, Mode::Drive, false).unwrap();
    figure("5 mass", "with layered tires of 4.84 kg", "kg", 2442.09, v.system.mass(), 1e-6);
    // The shipped variant differs by its payload alone.
    let loaded = VehicleSpec::read("hmmwv/vehicle_2550.json", &Place::Folder(None)).unwrap();
    let plain = hmmwv();
    let (name, source) = (plain.name.clone(), plain.source.clone());
    assert_eq!(VehicleSpec { name, source, payload: Vec::new(), ..loaded.clone() }, plain);
    let v = Vehicle::build(&loaded, &[], &layered, Mode::Drive, false).unwrap();
    figure("5 mass", "with layered tires and payload", "kg", 2550.0, v.system.mass(), 1e-6);
    // What the unit's specification loads comes on top.
    let more = [Payload { mass: 80.0, position: [0.0; 3], inertia: [0.0; 3] }];
    let v = Vehicle::build(&loaded, &more, &layered, Mode::Drive, false).unwrap();
    figure("5 mass", "with a further load of 80 kg", "kg", 2630.0, v.system.mass(), 1e-6);
}

#[test]
fn wheel_loads_at_rest_balance_the_weight() {
    for name in ["hmmwv/vehicle.json", "hmmwv/vehicle_2018.json"] {
        let spec = VehicleSpec::read(name, &Place::Folder(None)).unwrap();
        let rest = Rest::find(&spec, &[], &[], Mode::Drive).unwrap();
        let s = &rest.vehicle.system;
        let weight = s.mass() * 9.81;
        let sum: f64 = rest.loads.iter().sum();
        relative("5 rest", &format!("{name}: sum of wheel loads"), "N", weight, sum, 1e-6);
        // Moment balance about the rear wheel centres and about the middle plane.
        let (front, rear) = (rest.vehicle.wheel_state(0).position, rest.vehicle.wheel_state(2).position);
        let com = s.center_of_mass();
        let front_load = weight * (com.x - rear.x) / (front.x - rear.x);
        relative("5 rest", &format!("{name}: front wheel loads"), "N", front_load, rest.loads[0] + rest.loads[1], 1e-5);
        // The Pitman arm sits on the left: not quite symmetric.
        let track = front.y - rest.vehicle.wheel_state(1).position.y;
        let difference = weight * 2.0 * com.y / track;
        let found = rest.loads[0] + rest.loads[2] - rest.loads[1] - rest.loads[3];
        figure("5 rest", &format!("{name}: left less right, moment balance"), "N", difference, found, 1e-5 * weight);
        for i in 0..4 {
            assert!((rest.vehicle.wheel_state(i).position.z - 0.467).abs() < 1e-9);
        }
        println!("{name}: chassis at {:.4} m", rest.vehicle.chassis_state().state.position.z);
    }
}

/// On a stand: chassis held in the air by its own weight taken away, wheels free or braked.
fn on_a_stand() -> Vehicle {
    let mut v = Rest::find(&hmmwv(), &[], &[], Mode::Drive).unwrap().vehicle;
    v.system.set_gravity(Vec3::zeros());
    v
}

#[test]
fn case_5_6_stall() {
    let mut v = on_a_stand();
    v.inputs.throttle = 1.0;
    v.inputs.braking = 1.0;
    v.hold(true, 0.0);
    // The stand: the chassis is kept from turning over by holding it.
    let chassis = v.chassis();
    for _ in 0..6000 {
        v.step_with(1e-3, &mut |view, loads| stand(chassis, view, loads)).unwrap();
    }
    let e = v.engine();
    relative("5.6", "engine speed at stall", "rpm", 2534.3, e.speed * 30.0 / std::f64::consts::PI, 1e-4);
    relative("5.6", "converter input torque", "N.m", 313.0, e.converter_input, 2e-4);
    let sum: f64 = (0..4).map(|i| v.axle_torque(i)).sum();
    relative("5.6", "sum of wheel torques in first gear", "N.m", 15652.0, sum, 2e-4);
    v.inputs.throttle = 0.8;
    for _ in 0..6000 {
        v.step_with(1e-3, &mut |view, loads| stand(chassis, view, loads)).unwrap();
    }
    let e = v.engine();
    relative("5.6", "engine speed at stall, 80 % throttle", "rpm", 2515.1, e.speed * 30.0 / std::f64::consts::PI, 1e-4);
}

/// A stiff, damped hold of the chassis.
fn stand(chassis: fmu_vehicle::mbs::BodyId, view: &fmu_vehicle::mbs::View, loads: &mut fmu_vehicle::mbs::Loads) {
    let u = &view.u[chassis.index()];
    let l = &mut loads.bodies[chassis.index()];
    for k in 0..3 {
        l[k] -= 5e4 * u[k];
        l[k + 3] -= 1e6 * u[k + 3];
    }
}

#[test]
fn case_5_7_first_up_shift() {
    let mut v = on_a_stand();
    v.inputs.throttle = 0.5;
    let chassis = v.chassis();
    let mut shifted = None;
    for k in 0..12_000 {
        let mean = (0..4).map(|i| v.wheel_speed(i)).sum::<f64>() / 4.0;
        v.step_with(5e-4, &mut |view, loads| stand(chassis, view, loads)).unwrap();
        if v.gear() == 2 {
            shifted = Some((k, mean));
            break;
        }
    }
    let (_, mean) = shifted.expect("no shift within 6 s");
    relative("5.7", "mean wheel speed at the first up-shift", "rad/s", 10.472, mean, 2e-3);
}

#[test]
fn steering_input_one_turns_left() {
    let mut v = on_a_stand();
    let chassis = v.chassis();
    v.inputs.steering = 1.0;
    for _ in 0..500 {
        v.step_with(1e-3, &mut |view, loads| stand(chassis, view, loads)).unwrap();
    }
    let chassis_q = v.chassis_state().state.orientation;
    let angle = |i: usize| {
        let axis = chassis_q.inverse() * (v.wheel_state(i).orientation * Vec3::y());
        (-axis.x).atan2(axis.y).to_degrees()
    };
    println!("left {:.2} right {:.2} rear {:.3} {:.3} deg", angle(0), angle(1), angle(2), angle(3));
    assert!(angle(0) > 20.0 && angle(1) > 15.0, "{} {}", angle(0), angle(1));
    assert!(angle(2).abs() < 1.0);
}

#[test]
fn nothing_drifts_over_a_minute_of_waves() {
    for name in ["hmmwv/vehicle.json", "hmmwv/vehicle_2018.json"] {
        let spec = VehicleSpec::read(name, &Place::Folder(None)).unwrap();
        let mut v = Rest::find(&spec, &[], &[], Mode::Drive).unwrap().vehicle;
        let (mut gap, mut iterations) = (0.0_f64, 0);
        let n = 60_000;
        for k in 0..n {
            let t = f64::from(k) * 1e-3;
            v.inputs.steering = (3.0 * t).sin();
            v.inputs.throttle = 0.5;
            // Springs under the wheels with a wave running through them.
            for i in 0..4 {
                let s = v.wheel_state(i);
                let ground = 0.05 * (10.0 * t + i as f64).sin();
                let f = (3e5 * (0.467 + ground - s.position.z) - 3e3 * s.velocity.z).max(0.0);
                v.wrenches[i].force = Vec3::new(-50.0 * s.velocity.x, -200.0 * s.velocity.y, f);
            }
            let report = v.step(1e-3).unwrap();
            iterations += report.iterations;
            if k % 10 == 0 {
                gap = gap.max(v.system.largest_gap().0);
            }
        }
        println!("{name}: {:.2} Newton iterations a step", f64::from(iterations as u32) / f64::from(n));
        figure("5 drift", &format!("{name}: largest gap in 60 s over waves of 50 mm"), "m", 0.0, gap, 1e-8);
    }
}

#[test]
fn a_saved_vehicle_continues_to_the_same_bits() {
    let rest = Rest::find(&hmmwv(), &[], &[], Mode::Drive).unwrap().vehicle;
    let drive = |v: &mut Vehicle, n: usize| {
        for _ in 0..n {
            v.inputs.throttle = 0.7;
            v.inputs.steering = 0.3;
            for i in 0..4 {
                let s = v.wheel_state(i);
                v.wrenches[i].force = Vec3::new(0.0, 0.0, 3e5 * (0.48 - s.position.z) - 3e3 * s.velocity.z);
            }
            v.step(1e-3).unwrap();
        }
    };
    let mut a = rest.clone();
    drive(&mut a, 700);
    let saved = a.save();
    let mut b = rest;
    b.restore(&saved).unwrap();
    drive(&mut a, 700);
    drive(&mut b, 700);
    assert_eq!(a.save(), b.save());
}
