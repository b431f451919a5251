//! Every suspension, steering, driveline and powertrain template: it closes, stands, and has the freedom it should.

use fmu_vehicle::powertrain::Mode;
use fmu_vehicle::vehicle::place::Rest;
use fmu_vehicle::vehicle::{Part, Place, Vehicle, VehicleSpec};
use serde_json::{Value, json};
use terramech_mechanics::Vec3;

fn hmmwv() -> Value {
    serde_json::to_value(VehicleSpec::read("hmmwv/vehicle.json", &Place::Folder(None)).unwrap()).unwrap()
}

fn complete(value: Value) -> VehicleSpec {
    let mut part: Part<VehicleSpec> = serde_json::from_value(value).unwrap();
    let mut f = terramech_fmi2::specification::Faults::new();
    part.resolve(&Place::Folder(None), "vehicle", &mut f, |v, p, path, f| v.resolve(p, path, f));
    let Part::Inline(v) = part else { panic!("in place") };
    v.check("", &mut f);
    f.into_result("template").unwrap();
    *v
}

fn small(mass: f64) -> Value {
    json!({"mass": mass, "inertia": [0.2, 0.2, 0.2]})
}

/// A suspension with its spring and shock on `end`.
fn with_elements(mut s: Value, end: &str, spring: [f64; 3], name: &str) -> Value {
    s["axle_inertia"] = json!(0.4);
    s["spindle"] = small(14.7);
    s["spring"] = json!({"linear": {"rate": 120e3, "free_length": 0.45}});
    s["shock"] = json!({"linear": {"coefficient": 9000.0}});
    s["points"]["spindle"] = json!([0.0, 0.91, -0.026]);
    let top = json!([spring[0], spring[1], spring[2] + 0.4]);
    s["points"]["spring_chassis"] = top.clone();
    s["points"]["shock_chassis"] = top;
    s["points"][format!("spring_{end}")] = json!(spring);
    s["points"][format!("shock_{end}")] = json!(spring);
    json!({name: s})
}

fn tie_rod(s: &mut Value) {
    s["points"]["tie_rod_chassis"] = json!([-0.25, 0.45, 0.054]);
    s["points"]["tie_rod_upright"] = json!([-0.176, 0.82, -0.016]);
    s["points"]["upright_com"] = json!([0.0, 0.75, -0.026]);
    s["upright"] = small(19.5);
}

fn suspensions() -> Vec<(&'static str, Value)> {
    let wishbone = json!({
        "upper_front": [0.1, 0.45, 0.24], "upper_back": [-0.2, 0.45, 0.22], "upper_outer": [-0.02, 0.72, 0.215],
        "lower_front": [0.22, 0.31, 0.0], "lower_back": [-0.22, 0.31, 0.0], "lower_outer": [0.0, 0.79, -0.12]
    });
    let mut reduced = json!({"points": wishbone});
    tie_rod(&mut reduced);
    let mut links = json!({"points": {
        "upper_front_chassis": [0.1, 0.45, 0.24], "upper_front_upright": [0.02, 0.72, 0.215],
        "upper_back_chassis": [-0.2, 0.45, 0.22], "upper_back_upright": [-0.05, 0.71, 0.21],
        "lateral_chassis": [0.0, 0.31, 0.0], "lateral_upright": [0.0, 0.79, -0.12],
        "trailing_chassis": [0.6, 0.6, -0.05], "trailing_upright": [0.02, 0.78, -0.11]
    }});
    tie_rod(&mut links);
    let mut strut = json!({"points": {
        "lower_front": [0.22, 0.31, 0.0], "lower_back": [-0.22, 0.31, 0.0], "lower_outer": [0.0, 0.79, -0.12],
        "lower_com": [0.0, 0.55, -0.06], "strut_top": [-0.03, 0.6, 0.6], "strut_bottom": [0.0, 0.7, 0.1],
        "strut_com": [-0.02, 0.63, 0.45]
    }, "lower_arm": small(24.0), "strut": small(3.0)});
    tie_rod(&mut strut);
    let arm = json!({"points": {"arm_com": [0.2, 0.6, 0.0], "inner": [0.45, 0.3, 0.02], "outer": [0.55, 0.75, 0.02]}, "arm": small(30.0)});
    let solid = json!({"points": {
        "axle_com": [0.0, 0.0, -0.026], "upper_chassis": [0.5, 0.45, 0.15], "upper_axle": [0.02, 0.1, 0.14],
        "lower_chassis": [0.6, 0.45, -0.1], "lower_axle": [0.0, 0.55, -0.1]
    }, "axle": {"mass": 90.0, "inertia": [20.0, 2.0, 20.0]}});
    vec![
        ("reduced_double_wishbone", with_elements(reduced, "upright", [0.0, 0.7, 0.1], "reduced_double_wishbone")),
        ("multi_link", with_elements(links, "upright", [0.0, 0.7, 0.1], "multi_link")),
        ("mac_pherson", with_elements(strut, "upright", [0.0, 0.7, 0.1], "mac_pherson")),
        ("semi_trailing_arm", with_elements(arm, "arm", [0.1, 0.65, 0.05], "semi_trailing_arm")),
        ("solid_axle", with_elements(solid, "axle", [0.0, 0.6, 0.05], "solid_axle")),
    ]
}

/// Drives over waves on springs under the wheels.
fn shake(v: &mut Vehicle) -> f64 {
    let mut gap = 0.0_f64;
    for k in 0..1500 {
        let t = f64::from(k) * 1e-3;
        v.inputs.throttle = 0.4;
        v.inputs.steering = 0.3 * (4.0 * t).sin();
        for i in 0..v.wheel_count() {
            let s = v.wheel_state(i);
            let ground = 0.03 * (12.0 * t + i as f64).sin();
            let f = (3e5 * (0.467 + ground - s.position.z) - 3e3 * s.velocity.z).max(0.0);
            v.wrenches[i].force = Vec3::new(-100.0 * s.velocity.x, -500.0 * s.velocity.y, f);
        }
        v.step(1e-3).unwrap();
        gap = gap.max(v.system.largest_gap().0);
    }
    gap
}

#[test]
fn suspensions_close_stand_and_move() {
    for (name, suspension) in suspensions() {
        let mut spec = hmmwv();
        spec["axles"][1]["suspension"] = suspension;
        let rest = Rest::find(&complete(spec), &[], &[], Mode::Drive).unwrap_or_else(|e| panic!("{name}: {e}"));
        let weight = rest.vehicle.system.mass() * 9.81;
        let sum: f64 = rest.loads.iter().sum();
        assert!((sum / weight - 1.0).abs() < 1e-5, "{name}: {sum} {weight}");
        let mut v = rest.vehicle;
        let gap = shake(&mut v);
        println!("{name}: rear wheel at rest, loads {:?}, gap {gap:.1e}", rest.loads);
        assert!(gap < 1e-8, "{name}: {gap}");
    }
}

#[test]
fn a_solid_axle_with_knuckles_steers() {
    let solid = json!({"points": {
        "axle_com": [0.0, 0.0, -0.026], "upper_chassis": [-0.5, 0.45, 0.15], "upper_axle": [-0.02, 0.1, 0.14],
        "lower_chassis": [-0.6, 0.45, -0.1], "lower_axle": [0.0, 0.55, -0.1]
    }, "axle": {"mass": 90.0, "inertia": [20.0, 2.0, 20.0]}, "knuckles": {
        "knuckle": {"mass": 12.0, "inertia": [0.2, 0.2, 0.2]}, "knuckle_com": [0.0, 0.8, -0.026],
        "kingpin_upper": [0.0, 0.76, 0.1], "kingpin_lower": [0.0, 0.79, -0.12], "tie_rod": [-0.2, 0.72, -0.1],
        "drag_link_chassis": [-0.250317, 0.448437, 0.054229], "drag_link_knuckle": [-0.2, 0.72, 0.05]
    }});
    let mut spec = hmmwv();
    spec["axles"][0]["suspension"] = with_elements(solid, "axle", [0.0, 0.6, 0.05], "solid_axle");
    let rest = Rest::find(&complete(spec), &[], &[], Mode::Drive).unwrap();
    let weight = rest.vehicle.system.mass() * 9.81;
    assert!((rest.loads.iter().sum::<f64>() / weight - 1.0).abs() < 1e-5, "{:?}", rest.loads);
    let mut v = rest.vehicle;
    assert!(shake(&mut v) < 1e-8);
    v.system.set_gravity(Vec3::zeros());
    v.inputs.steering = 1.0;
    for _ in 0..500 {
        (0..4).for_each(|i| v.wrenches[i].force = Vec3::zeros());
        v.step(1e-3).unwrap();
    }
    let q = v.chassis_state().state.orientation.inverse();
    let angle = |i: usize| {
        let axle = q * (v.wheel_state(i).orientation * Vec3::y());
        (-axle.x).atan2(axle.y).to_degrees()
    };
    println!("left {:.1}, right {:.1} deg", angle(0), angle(1));
    assert!(angle(0) > 5.0 && angle(1) > 5.0, "{} {}", angle(0), angle(1));
}

#[test]
fn a_rack_steers() {
    let mut spec = hmmwv();
    spec["steering"] = json!([{"rack_pinion": {"rack": {"mass": 5.0, "inertia": [0.3, 0.1, 0.3]}, "rack_com": [1.44, 0.0, 0.05],
        "full_angle": 1.0, "pinion_radius": 0.06, "direction": -1.0}}]);
    let mut v = Rest::find(&complete(spec), &[], &[], Mode::Drive).unwrap().vehicle;
    v.system.set_gravity(Vec3::zeros());
    v.inputs.steering = 1.0;
    for _ in 0..300 {
        v.step(1e-3).unwrap();
    }
    let q = v.chassis_state().state.orientation.inverse();
    let axle = q * (v.wheel_state(0).orientation * Vec3::y());
    let angle = (-axle.x).atan2(axle.y).to_degrees();
    assert!(angle > 10.0, "{angle}");
}

#[test]
fn drivelines_and_powertrains_drive() {
    for (driveline, powertrain) in [
        ("hmmwv/driveline_rear.json", "hmmwv/powertrain.json"),
        ("hmmwv/driveline.json", "hmmwv/powertrain_map.json"),
        ("hmmwv/driveline_simple.json", "hmmwv/powertrain_map.json"),
        ("hmmwv/driveline.json", "hmmwv/powertrain_2018.json"),
    ] {
        let mut spec = hmmwv();
        spec["driveline"] = json!(driveline);
        spec["powertrain"] = json!(powertrain);
        let mut v = Rest::find(&complete(spec), &[], &[], Mode::Drive).unwrap().vehicle;
        v.inputs.throttle = 0.6;
        for _ in 0..3000 {
            for i in 0..4 {
                let s = v.wheel_state(i);
                let load = (3e5 * (0.467 - s.position.z) - 3e3 * s.velocity.z).max(0.0);
                let pull = (5e3 * (0.467 * s.angular_velocity.y - s.velocity.x)).clamp(-0.8 * load, 0.8 * load);
                v.wrenches[i].force = Vec3::new(pull, -5e3 * s.velocity.y, load);
                v.wrenches[i].moment = Vec3::new(0.0, -0.467 * pull, 0.0);
            }
            v.step(1e-3).unwrap();
        }
        let speed = v.chassis_state().state.velocity.x;
        println!("{driveline} {powertrain}: {speed:.2} m/s, gear {}, engine {:.0} rad/s", v.gear(), v.engine().speed);
        assert!(speed > 1.5, "{driveline} {powertrain}: {speed}");
    }
}

#[test]
fn a_powertrain_with_shafts_needs_a_driveline_with_shafts() {
    let mut spec = hmmwv();
    spec["driveline"] = json!("hmmwv/driveline_simple.json");
    let mut part: Part<VehicleSpec> = serde_json::from_value(spec).unwrap();
    let mut f = terramech_fmi2::specification::Faults::new();
    part.resolve(&Place::Folder(None), "vehicle", &mut f, |v, p, path, f| v.resolve(p, path, f));
    part.get().check("", &mut f);
    assert!(f.into_result("x").unwrap_err().to_string().contains("'simple' goes with 'map'"));
}
