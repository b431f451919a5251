//! The model `terrain_dem_c` through the safe side of the interface.

use std::sync::{Arc, Mutex};
use terramech_fmi2::instance::Instance;

const H: f64 = 1e-3;
const SMALL: &str = r#"{"soil": {"radius": {"equal": 0.006}, "rolling_friction": 0.1},
    "bed": {"length": 0.16, "width": 0.1, "fill": {"depth": 0.04}}, "dem_c": {"iterations": 100}}"#;

fn vr(i: &Instance, name: &str) -> u32 {
    i.model().table.find(name).unwrap_or_else(|| panic!("no variable {name}")).0
}

fn make(model: terramech_fmi2::Model, strings: &[(&str, &str)]) -> Instance {
    let mut i = Instance::new(model, None, Box::new(|_, text| println!("{text}")));
    for (name, value) in strings {
        let v = vr(&i, name);
        i.set_string(v, value).unwrap();
    }
    i.setup(0.0, None).unwrap();
    i
}

fn real(i: &mut Instance, name: &str) -> f64 {
    let v = vr(i, name);
    i.real(v).unwrap()
}

/// A cylinder of radius 40 mm that touches the bed and sinks at 50 mm/s.
fn place(i: &mut Instance, z: f64) {
    for (name, x) in [("position.z", z), ("orientation.w", 1.0), ("velocity.z", -0.05)] {
        let v = vr(i, &format!("body[1].{name}"));
        i.set_real(v, x).unwrap();
    }
}

fn with_wheel(strings: &[(&str, &str)]) -> (Instance, f64) {
    let all = [&[("specification", SMALL), ("body[1].shape", "cylinder")], strings].concat();
    let mut i = make(fmu_terrain::dem_c::model(), &all);
    for (name, x) in [("radius", 0.04), ("width", 0.03)] {
        let v = vr(&i, &format!("body[1].{name}"));
        i.set_real(v, x).unwrap();
    }
    i.enter_initialization().unwrap();
    let z = real(&mut i, "height") + 0.04;
    place(&mut i, z);
    i.exit_initialization().unwrap();
    (i, z)
}

fn press(i: &mut Instance, z: f64, steps: std::ops::Range<usize>) -> Vec<f64> {
    steps
        .map(|k| {
            place(i, z - 0.05 * k as f64 * H);
            i.do_step(k as f64 * H, H).unwrap();
            real(i, "body[1].force.z")
        })
        .collect()
}

#[test]
fn a_wheel_that_sinks_is_pushed_up_and_a_state_goes_on_bit_for_bit() {
    let (mut i, z) = with_wheel(&[]);
    let first = press(&mut i, z, 0..60);
    let mean = first[40..].iter().sum::<f64>() / 20.0;
    assert!(mean > 0.5 && mean < 100.0, "mean force {mean} N");
    let iterations = vr(&i, "solver.iterations");
    assert!(i.integer(iterations).unwrap() > 0 && real(&mut i, "solver.residual") > 0.0);
    let saved = i.save().unwrap();
    let on = press(&mut i, z, 60..70);
    i.restore(&saved).unwrap();
    assert_eq!(on, press(&mut i, z, 60..70));
}

#[test]
fn each_engine_starts_from_the_bed_of_the_other() {
    let folder = std::env::temp_dir().join(format!("terramech-swap-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let models = [fmu_terrain::dem_p::model as fn() -> terramech_fmi2::Model, fmu_terrain::dem_c::model];
    for (k, from) in models.iter().enumerate() {
        let file = folder.join(format!("{k}.bed"));
        let file = file.to_str().unwrap();
        let mut i = make(from(), &[("specification", SMALL), ("bed_save", file)]);
        i.enter_initialization().unwrap();
        let height = real(&mut i, "height");
        for to in models {
            let mut j = make(to(), &[("specification", SMALL), ("bed_load", file)]);
            j.enter_initialization().unwrap();
            assert_eq!(real(&mut j, "height"), height);
            j.exit_initialization().unwrap();
            for s in 0..20 {
                j.do_step(s as f64 * H, H).unwrap();
            }
            // At rest it stays at rest: a grain of 6 mm and 2.3 g at 5 cm/s has 3 microjoules.
            let (energy, grains) = (real(&mut j, "kinetic_energy"), vr(&j, "grain_count"));
            let each = energy / f64::from(j.integer(grains).unwrap());
            assert!(each < 3e-6, "{each:e} J a grain from {k}");
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A unit whose log is kept.
fn heard(model: terramech_fmi2::Model) -> (Instance, Arc<Mutex<Vec<String>>>) {
    let told = Arc::new(Mutex::new(Vec::<String>::new()));
    let log = Arc::clone(&told);
    (Instance::new(model, None, Box::new(move |_, text| log.lock().unwrap().push(text.into()))), told)
}

#[test]
fn offsets_that_do_not_come_along_to_the_other_engine_are_told() {
    const OFFSET: &str = r#"{"soil": {"radius": {"equal": 0.006}, "rolling_friction": 0.1, "young_modulus": 1e8, "adhesion": {"pressure": 2e4}},
        "bed": {"length": 0.16, "width": 0.1, "fill": {"depth": 0.04}, "adhesion_onset": "offset"}}"#;
    let file = std::env::temp_dir().join(format!("terramech-offset-{}.bed", std::process::id()));
    let path = file.to_str().unwrap();
    let mut i = make(fmu_terrain::dem_p::model(), &[("specification", OFFSET), ("bed_save", path)]);
    i.enter_initialization().unwrap();
    // The bed is made when something of it is read.
    real(&mut i, "height");
    for (model, warned) in [(fmu_terrain::dem_p::model(), false), (fmu_terrain::dem_c::model(), true)] {
        let (mut j, told) = heard(model);
        for (name, value) in [("specification", OFFSET), ("bed_load", path)] {
            let v = vr(&j, name);
            j.set_string(v, value).unwrap();
        }
        j.setup(0.0, None).unwrap();
        j.enter_initialization().unwrap();
        real(&mut j, "height");
        let told = told.lock().unwrap();
        assert_eq!(told.iter().any(|t| t.contains("count from an offset")), warned, "{told:?}");
    }
    std::fs::remove_file(file).unwrap();
}

#[test]
fn a_solver_that_does_not_converge_and_odd_adhesion_are_told() {
    let (mut i, told) = heard(fmu_terrain::dem_c::model());
    // 20 kPa, given in kPa.
    let text = r#"{"soil": {"radius": {"equal": 0.01}, "adhesion": {"pressure": 0.02}},
        "bed": {"length": 0.12, "width": 0.1, "fill": {"depth": 0.03}}, "dem_c": {"iterations": 1, "tolerance": 1e-12}}"#;
    let v = vr(&i, "specification");
    i.set_string(v, text).unwrap();
    i.setup(0.0, None).unwrap();
    i.enter_initialization().unwrap();
    i.exit_initialization().unwrap();
    i.do_step(0.0, H).unwrap();
    let unconverged = vr(&i, "solver.unconverged");
    assert!(i.integer(unconverged).unwrap() > 0);
    let told = told.lock().unwrap().join("\n");
    assert!(told.contains("worst contact at") && told.contains("before 0.0010 s"), "{told}");
    assert!(told.contains("soil.adhesion") && told.contains("a pressure in Pa"), "{told}");
}

#[test]
fn wrong_settings_are_told_by_their_place() {
    let text = r#"{"dem_c": {"tolerance": -1, "iterations": 0, "recovery_time": 0}}"#;
    let mut i = make(fmu_terrain::dem_c::model(), &[("specification", text)]);
    let e = i.enter_initialization().unwrap_err().message;
    for part in ["dem_c.tolerance", "dem_c.iterations", "dem_c.recovery_time"] {
        assert!(e.contains(part), "{e}");
    }
}

#[test]
fn no_mass_negative_friction_and_what_is_no_number_are_told_by_the_unit() {
    let text =
        r#"{"soil": {"density": 0, "friction": -0.5}, "bodies": {"surface": {"friction": -1}}, "dem_c": {"step": 0}}"#;
    let mut i = make(fmu_terrain::dem_c::model(), &[("specification", text)]);
    let e = i.enter_initialization().unwrap_err().message;
    for part in ["soil.density", "soil.friction", "-0.5", "bodies.surface.friction", "dem_c.step"] {
        assert!(e.contains(part), "{part}: {e}");
    }
    // A velocity of a wheel that is no number is refused where it enters; the unit goes on with the one before.
    let (mut i, z) = with_wheel(&[]);
    press(&mut i, z, 0..2);
    let velocity = vr(&i, "body[1].velocity.x");
    let e = i.set_real(velocity, f64::NAN).unwrap_err().message;
    assert!(e.contains("body[1].velocity.x") && e.contains("NaN"), "{e}");
    press(&mut i, z, 2..4);
}

#[test]
fn a_wheel_too_fast_for_the_step_is_told() {
    // 100 mm in a step, eight diameters of a grain.
    let (mut i, z) = with_wheel(&[]);
    place(&mut i, z - 0.02);
    let velocity = vr(&i, "body[1].velocity.x");
    i.set_real(velocity, 100.0).unwrap();
    let e = (0..3).find_map(|k| i.do_step(f64::from(k) * H, H).err()).expect("a fault").message;
    assert!(e.contains("half its radius") && e.contains("smaller"), "{e}");
}
