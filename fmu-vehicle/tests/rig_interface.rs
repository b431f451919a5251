//! Specifications that are wrong, parameters that come late, states, the model description.

mod support;
use support::{Rig, plastic_soil};
use terramech_fmi2::instance::Instance;

fn refused(specification: &str) -> String {
    Rig::new(specification).instance.enter_initialization().unwrap_err().message
}

#[test]
fn all_faults_of_a_specification_at_once() {
    let e = refused(r#"{"drive": {"slip": 1.0, "ramp": 0}, "load": {"mass": -1}, "toe": {"angle": 0.1, "delay": 1}}"#);
    for part in ["4 faults", "'drive.slip' is 1", "'drive.ramp' is 0", "'load.mass' is -1", "'toe.ramp' is 0", "inline"]
    {
        assert!(e.contains(part), "{part} missing in {e}");
    }
}

#[test]
fn unknown_and_misshapen_elements_are_named_with_their_path() {
    let e = refused(r#"{"drive": {"mode": "imposed_joy"}}"#);
    assert!(e.contains("drive.mode") && e.contains("imposed_angular_speed"), "{e}");
    let e = refused(r#"{"load": {"weight": 3}}"#);
    assert!(e.contains("load") && e.contains("weight") && e.contains("force"), "{e}");
    for not_finite in ["NaN", "1e999", "Infinity"] {
        let e = refused(&format!(r#"{{"load": {{"force": {not_finite}}}}}"#));
        // What is no JSON has no path yet, but a place.
        assert!(e.contains("inline specification") && e.contains("line 1"), "{e}");
    }
}

#[test]
fn faults_that_parameters_bring_are_told_when_the_wheel_is_placed() {
    let mut rig = Rig::entered(r#"{"drive": {"base": "angular_speed", "slip": 1.0}}"#);
    let vr = rig.vr("drive.base");
    rig.instance.set_string(vr, "linear_speed").unwrap();
    let e = rig.instance.exit_initialization().unwrap_err().message;
    assert!(e.contains("drive.slip") && e.contains("below 1") && e.contains("parameters"), "{e}");
    rig.instance.set_string(vr, "sideways").unwrap();
    let e = rig.instance.exit_initialization().unwrap_err().message;
    assert!(e.contains("drive.base") && e.contains("sideways") && e.contains("angular_speed"), "{e}");
    rig.instance.set_string(vr, "angular_speed").unwrap();
    rig.set("wheel[1].outer_radius", 0.01).unwrap();
    let e = rig.instance.exit_initialization().unwrap_err().message;
    assert!(e.contains("wheel[1].outer_radius") && e.contains("0.01"), "{e}");
    rig.set("wheel[1].outer_radius", 0.0).unwrap();
    rig.exit();
}

#[test]
fn the_specification_comes_too_late_once_read() {
    let mut rig = Rig::entered("");
    let vr = rig.vr("specification");
    let e = rig.instance.set_string(vr, "{}").unwrap_err().message;
    assert!(e.contains("too late"), "{e}");
    assert!(rig.set("drive.slip", 2.0).unwrap_err().contains("-1 to 1"));
    rig.exit();
    assert!(rig.set("wheel[1].hub_mass", 1.0).unwrap_err().contains("after initialization"));
}

#[test]
fn the_wheel_s_state_depends_on_no_wrench() {
    let rig = Rig::new("");
    let table = &rig.instance.model().table;
    let ground = table.find("ground_height").unwrap().0;
    let names = |v: &terramech_fmi2::variables::Variable| -> Vec<String> {
        v.initial_dependencies.iter().map(|&d| table.variables()[d as usize].name.clone()).collect()
    };
    for v in table.variables().iter().filter(|v| !v.causality.settable()) {
        assert!(names(v).iter().all(|n| !n.contains("force.x") && !n.contains("moment") && !n.contains("hub")), "{v}");
    }
    let z = table.find("wheel[1].position.z").unwrap().1;
    assert!(z.initial_dependencies.contains(&ground));
    assert!(names(z).contains(&"wheel[1].tire_radius".to_string()));
}

#[test]
fn a_saved_state_goes_on_bit_for_bit_on_a_fresh_instance() {
    // Yielding soil keeps a state of its own: a prescribed force serves both continuations.
    let force = |t: f64| [3.0 * (9.0 * t).sin(), 1.0, 25.0 * (1.0 - (-8.0 * t).exp())];
    let text = r#"{"toe": {"angle": 0.2, "delay": 0.1, "ramp": 0.3}, "filter_window": 0.05}"#;
    for split in [0.02, 0.3, 0.7] {
        let mut rig = Rig::entered(text);
        rig.set("drive.slip", 0.4).unwrap();
        rig.set("ground_height", 0.25).unwrap();
        rig.exit();
        let step = |rig: &mut Rig| {
            let t = rig.time;
            rig.push(force(t));
            rig.step(1e-3).unwrap();
        };
        while rig.time < split {
            step(&mut rig);
        }
        let saved = rig.instance.save().unwrap();
        assert_eq!(saved, rig.instance.save().unwrap());
        let mut other = Rig::new("");
        other.instance = Instance::new(fmu_vehicle::rig::model(), None, Box::new(|_, _| {}));
        other.instance.restore(&saved).unwrap_or_else(|e| panic!("{}", e.message));
        other.time = rig.time;
        while rig.time < 1.2 {
            step(&mut rig);
            step(&mut other);
            let (a, b) = (rig.outputs(), other.outputs());
            assert!(a.iter().zip(&b).all(|(a, b)| a.0 == b.0 && a.1.to_bits() == b.1.to_bits()), "t {}", rig.time);
        }
        assert_eq!(rig.instance.save().unwrap(), other.instance.save().unwrap());
    }
}

#[test]
fn a_state_saved_in_initialization_mode_keeps_its_parameters() {
    let mut rig = Rig::entered(r#"{"drive": {"slip": 0.5}}"#);
    // Its start value, which overrides nevertheless.
    rig.set("drive.slip", 0.2).unwrap();
    rig.get("slip");
    let saved = rig.instance.save().unwrap();
    let mut other = Rig::new("");
    other.instance.restore(&saved).unwrap_or_else(|e| panic!("{}", e.message));
    other.exit();
    other.run(&mut plastic_soil(2000.0), 1e-3, 3.0);
    assert!((other.get("slip") - 0.2).abs() < 1e-12);
}

#[test]
fn two_rigs_do_not_know_of_each_other() {
    let (mut a, mut b) = (Rig::ready(""), Rig::ready(""));
    a.run(&mut plastic_soil(2000.0), 1e-3, 0.2);
    let alone = a.outputs();
    a.run(&mut plastic_soil(2000.0), 1e-3, 0.3);
    b.run(&mut plastic_soil(2000.0), 1e-3, 0.2);
    assert_eq!(b.outputs(), alone);
}

#[test]
fn absurd_forces_poison_the_instance_with_a_message() {
    let mut rig = Rig::ready("");
    rig.push([0.0, 0.0, f64::MAX]);
    rig.run(&mut |_, _| [0.0, 0.0, f64::MAX], 1e-3, 0.05);
    rig.set("wheel[1].force.z", f64::NAN).unwrap_err();
    let e = loop {
        match rig.step(1e3) {
            Ok(()) => assert!(rig.time < 1e5),
            Err(e) => break e,
        }
    };
    assert!(e.contains("not finite"), "{e}");
}

#[test]
fn the_model_description_and_the_default_specification_are_sound() {
    let model = fmu_vehicle::rig::model();
    let xml = model.xml();
    for part in ["wheel[1].force.x", "drawbar_pull_filtered", "wheel_force_filtered.y", "ground_height", "1/s"] {
        assert!(xml.contains(part), "{part}");
    }
    let spec: fmu_vehicle::rig::config::RigSpecification =
        terramech_fmi2::specification::parse(&model.default_specification, "default").unwrap();
    assert_eq!(spec, Default::default());
    spec.check("default").unwrap();
    let schema = model.schema.to_string();
    assert!(
        schema.contains("imposed_angular_speed") && schema.contains("(N/s)") && schema.contains("additionalProperties")
    );
}
