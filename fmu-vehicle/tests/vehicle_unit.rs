//! The unit `vehicle` through its interface: placement, masses, a run, saved states, faults.

mod checks;

use checks::{figure, relative};
use fmu_vehicle::vehicle;
use terramech_fmi2::instance::Instance;

fn instance(specification: &str) -> Instance {
    let mut i = Instance::new(vehicle::model(), None, Box::new(|_, _| {}));
    if !specification.is_empty() {
        let vr = i.model().table.find("specification").unwrap().0;
        i.set_string(vr, specification).unwrap();
    }
    i.setup(0.0, None).unwrap();
    i
}

fn vr(i: &Instance, name: &str) -> u32 {
    i.model().table.find(name).unwrap_or_else(|| panic!("no variable {name}")).0
}

fn get(i: &mut Instance, name: &str) -> f64 {
    let vr = vr(i, name);
    i.real(vr).unwrap()
}

fn set(i: &mut Instance, name: &str, x: f64) {
    let vr = vr(i, name);
    i.set_real(vr, x).unwrap();
}

/// A spring with grip under each wheel.
fn tires(i: &mut Instance, ground: f64) {
    for k in (1..=8).filter(|k| i.model().table.find(&format!("wheel[{k}].force.x")).is_some()).collect::<Vec<_>>() {
        let mut s = |n: &str| get(i, &format!("wheel[{k}].{n}"));
        let (z, vx, vy, vz) = (s("position.z"), s("velocity.x"), s("velocity.y"), s("velocity.z"));
        let spin = s("angular_velocity.y");
        let load = (3e5 * (0.467 + ground - z) - 3e3 * vz).max(0.0);
        let pull = (5e3 * (0.467 * spin - vx)).clamp(-0.8 * load, 0.8 * load);
        set(i, &format!("wheel[{k}].force.x"), pull);
        set(i, &format!("wheel[{k}].force.y"), (-5e3 * vy).clamp(-0.8 * load, 0.8 * load));
        set(i, &format!("wheel[{k}].force.z"), load);
        set(i, &format!("wheel[{k}].moment.y"), -0.467 * pull);
    }
}

fn run(i: &mut Instance, from: usize, steps: usize, h: f64, ground: f64) {
    for k in from..from + steps {
        tires(i, ground);
        i.do_step(k as f64 * h, h).unwrap();
    }
}

#[test]
fn it_places_itself_by_ground_height_and_hands_out_its_load_masses() {
    let mut i = instance(r#"{"payload": [{"mass": 107.91, "position": [0, 0, 0.6]}]}"#);
    set(&mut i, "start.x", 5.0);
    set(&mut i, "start.heading", 0.3);
    i.enter_initialization().unwrap();
    for k in 1..=4 {
        set(&mut i, &format!("wheel[{k}].hub_mass"), 4.838);
        set(&mut i, &format!("wheel[{k}].hub_inertia.yy"), 0.5);
        set(&mut i, &format!("wheel[{k}].tire_radius"), 0.47);
    }
    set(&mut i, "ground_height", -0.2);
    assert!((get(&mut i, "chassis.position.x") - 5.0).abs() < 1e-12);
    let total: f64 = (1..=4).map(|k| get(&mut i, &format!("wheel[{k}].load_mass"))).sum();
    relative("5 mass", "sum of load masses, with payload", "kg", 2550.0, total, 1e-6);
    figure("5 mass", "mass of the unit, with payload", "kg", 2550.0, get(&mut i, "mass"), 1e-6);
    for k in 1..=4 {
        assert!((get(&mut i, &format!("wheel[{k}].position.z")) - 0.27).abs() < 1e-9);
    }
    // Set again: what follows from it follows.
    set(&mut i, "ground_height", 1.0);
    assert!((get(&mut i, "wheel[1].position.z") - 1.47).abs() < 1e-9);
    i.exit_initialization().unwrap();
}

#[test]
fn a_held_vehicle_is_lowered_without_a_bounce_and_then_drives() {
    let mut i = instance(r#"{"hold": {"duration": 5.0}}"#);
    i.enter_initialization().unwrap();
    i.exit_initialization().unwrap();
    set(&mut i, "driver.throttle", 0.5);
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for k in 0..4000 {
        tires(&mut i, 0.0);
        i.do_step(f64::from(k) * 1e-3, 1e-3).unwrap();
        let load: f64 = (1..=4).map(|w| get(&mut i, &format!("wheel[{w}].force.z"))).sum();
        if k > 1000 {
            least = least.min(load);
        }
        most = most.max(load);
    }
    let weight = get(&mut i, "mass") * 9.81;
    assert!(most < 1.15 * weight && least > 0.9 * weight, "{least} {most} {weight}");
    assert!(get(&mut i, "speed") > 0.5, "it was released and drives: {}", get(&mut i, "speed"));
    assert!(get(&mut i, "engine.speed") > 50.0);
}

#[test]
fn a_saved_unit_continues_to_the_same_bits() {
    let spec = r#"{"driver": {"kind": {"path": {"path": {"lane_change": {"lead": 5, "length": 20, "offset": 3}}, "speed": 8}}}}"#;
    let mut a = instance(spec);
    a.enter_initialization().unwrap();
    a.exit_initialization().unwrap();
    run(&mut a, 0, 800, 1e-3, 0.0);
    let state = a.save().unwrap();
    let mut b = instance("");
    b.restore(&state).unwrap();
    run(&mut a, 800, 800, 1e-3, 0.0);
    run(&mut b, 800, 800, 1e-3, 0.0);
    for name in [
        "wheel[1].position.x",
        "wheel[4].angular_velocity.y",
        "chassis.velocity.y",
        "driver_used.steering",
        "engine.speed",
    ] {
        assert_eq!(get(&mut a, name), get(&mut b, name), "{name}");
    }
    assert_eq!(a.save().unwrap(), b.save().unwrap());
}

fn error_of(specification: &str) -> String {
    instance(specification).enter_initialization().unwrap_err().message.clone()
}

#[test]
fn faults_name_file_and_path() {
    let e = error_of(r#"{"vehicle": "humvee.json"}"#);
    assert!(e.contains("humvee.json") && e.contains("hmmwv/vehicle.json"), "{e}");
    let e = error_of(r#"{"step": 0.1, "payload": [{"mass": -1, "position": [0, 0, 0]}]}"#);
    assert!(e.contains("2 faults") && e.contains("payload[0].mass") && e.contains("'step' is 0.1"), "{e}");
    let e = error_of(r#"{"colour": "green"}"#);
    assert!(e.contains("colour"), "{e}");
    let e = error_of(r#"{"driver": {"kind": {"path": {"path": {"points": {"points": [[0, 0]]}}, "speed": 5}}}}"#);
    assert!(e.contains("driver.kind.path.path.points.points") && e.contains("at least two points"), "{e}");
    let e = error_of(
        r#"{"vehicle": {"name": "x", "chassis": {"mass": 0, "com": [0,0,0], "inertia": [1,1,1]}, "axles": [
            {"origin": [0,0,0], "suspension": "hmmwv/suspension_front.json", "steering": 3, "wheel": {"mass": 1, "inertia": [1,1,1], "tire_radius": 0.4}}]}}"#,
    );
    assert!(e.contains("vehicle.chassis.mass") && e.contains("vehicle.axles[0].steering"), "{e}");
}

#[test]
fn a_missing_hardpoint_is_told() {
    let front =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/data/hmmwv/suspension_front.json")).unwrap();
    let mut value: serde_json::Value = serde_json::from_str(&front).unwrap();
    value["double_wishbone"]["points"].as_object_mut().unwrap().remove("lower_outer");
    let e = error_of(&format!(
        r#"{{"vehicle": {{"name": "x", "chassis": {{"mass": 1, "com": [0,0,0], "inertia": [1,1,1]}}, "axles": [
            {{"origin": [0,0,0], "suspension": {value}, "wheel": {{"mass": 1, "inertia": [1,1,1], "tire_radius": 0.4}}}}]}}}}"#
    ));
    assert!(e.contains("lower_outer") && e.contains("vehicle.axles[0].suspension.double_wishbone.points"), "{e}");
}

#[test]
fn vehicles_of_three_and_four_axles_are_models_of_their_own() {
    for (wheels, model) in [6, 8].into_iter().zip(vehicle::models().skip(1)) {
        let mut i = Instance::new(model, None, Box::new(|_, _| {}));
        i.setup(0.0, None).unwrap();
        i.enter_initialization().unwrap();
        let carried: f64 = (1..=wheels).map(|k| get(&mut i, &format!("wheel[{k}].load_mass"))).sum();
        let mass = get(&mut i, "mass");
        relative("5 mass", &format!("sum of load masses, {wheels} wheels"), "kg", mass, carried, 1e-6);
        i.exit_initialization().unwrap();
        set(&mut i, "driver.throttle", 0.6);
        run(&mut i, 0, 3000, 1e-3, 0.0);
        let speed = get(&mut i, "speed");
        assert!(speed > 2.0 && speed < 12.0, "{wheels} wheels: {speed} m/s");
        // The tires carry the weight while it drives.
        let load: f64 = (1..=wheels).map(|k| get(&mut i, &format!("wheel[{k}].force.z"))).sum();
        assert!((load / (9.81 * mass) - 1.0).abs() < 0.1, "{wheels} wheels: {load} N");
    }
    // A vehicle of another number of axles is refused with the model that takes it.
    let e = error_of(r#"{"vehicle": "hmmwv/three_axles.json"}"#);
    assert!(e.contains("has 3 axles") && e.contains("vehicle_6 (3 axles)"), "{e}");
}

#[test]
fn vehicle_handling_drives_alone() {
    let fresh = || {
        let mut i = Instance::new(vehicle::handling_model(), None, Box::new(|_, _| {}));
        i.setup(0.0, None).unwrap();
        i
    };
    let mut a = fresh();
    a.enter_initialization().unwrap();
    set(&mut a, "ground_height", 0.3);
    a.exit_initialization().unwrap();
    set(&mut a, "driver.throttle", 0.6);
    set(&mut a, "driver.steering", 0.1);
    let steps = |i: &mut Instance, from: usize, n: usize| {
        for k in from..from + n {
            i.do_step(k as f64 * 2e-3, 2e-3).unwrap();
        }
    };
    steps(&mut a, 0, 100);
    let weight = get(&mut a, "mass") * 9.81;
    let load: f64 = (1..=4).map(|k| get(&mut a, &format!("tire[{k}].normal_force"))).sum();
    assert!((load / weight - 1.0).abs() < 0.05, "{load} {weight}: placed on its deflected tires");
    steps(&mut a, 100, 1400);
    assert!(get(&mut a, "speed") > 2.0 && get(&mut a, "yaw_rate") > 0.01);
    let state = a.save().unwrap();
    let mut b = fresh();
    b.restore(&state).unwrap();
    steps(&mut a, 1500, 200);
    steps(&mut b, 1500, 200);
    assert_eq!(a.save().unwrap(), b.save().unwrap());
}

#[test]
fn a_wrong_word_for_tires_is_told() {
    let mut i = Instance::new(vehicle::handling_model(), None, Box::new(|_, _| {}));
    let vr = vr(&i, "tires");
    i.set_string(vr, "inside").unwrap();
    i.setup(0.0, None).unwrap();
    i.enter_initialization().unwrap();
    let e = i.exit_initialization().unwrap_err().message.clone();
    assert!(e.contains("'tires' is 'inside'") && e.contains("internal, external"), "{e}");
}

#[test]
fn a_vehicle_that_rolls_over_ends_the_run_with_a_plain_statement() {
    let mut i = instance("");
    i.enter_initialization().unwrap();
    i.exit_initialization().unwrap();
    // Two tires on one side push it over.
    let mut end = None;
    for k in 0..4000 {
        for (w, f) in [(1, 2.5e4), (2, 0.0), (3, 2.5e4), (4, 0.0)] {
            set(&mut i, &format!("wheel[{w}].force.z"), if k < 400 { f } else { 0.0 });
        }
        if let Err(e) = i.do_step(f64::from(k) * 1e-3, 1e-3) {
            end = Some(e.message);
            break;
        }
    }
    let e = end.expect("it turns over");
    assert!(e.contains("rolled over") && e.contains("degrees"), "{e}");
    // What was reached can still be read.
    assert!(get(&mut i, "mass") > 2000.0 && get(&mut i, "chassis.position.z").is_finite());
}
