//! The units through their interface.

use terramech_fmi2::instance::Instance;
use terramech_handling_tires::unit::models;

fn fresh(k: usize) -> Instance {
    let mut i = Instance::new(models().swap_remove(k), None, Box::new(|_, _| {}));
    i.setup(0.0, None).unwrap();
    i
}

fn vr(i: &Instance, name: &str) -> u32 {
    i.model().table.find(name).unwrap().0
}

fn set(i: &mut Instance, name: &str, x: f64) {
    let vr = vr(i, name);
    i.set_real(vr, x).unwrap();
}

fn get(i: &mut Instance, name: &str) -> f64 {
    let vr = vr(i, name);
    i.real(vr).unwrap()
}

#[test]
fn a_rolling_tire_on_a_plane_and_on_a_probe() {
    for k in 0..2 {
        let mut i = fresh(k);
        i.enter_initialization().unwrap();
        assert_eq!(get(&mut i, "hub.mass"), 37.6);
        let r = get(&mut i, "radius");
        set(&mut i, "wheel.position.z", r - 0.03);
        set(&mut i, "wheel.velocity.x", 10.0);
        set(&mut i, "wheel.velocity.y", 0.3);
        set(&mut i, "wheel.angular_velocity.y", 10.0 / (r - 0.01));
        i.exit_initialization().unwrap();
        for n in 0..500 {
            i.do_step(f64::from(n) * 4e-3, 4e-3).unwrap();
        }
        assert!(get(&mut i, "wheel.force.z") > 1000.0 && get(&mut i, "wheel.force.y") < -100.0);
        let state = i.save().unwrap();
        let mut j = fresh(k);
        j.restore(&state).unwrap();
        for unit in [&mut i, &mut j] {
            for (name, x) in
                [("probe.height", vec![0.01]), ("probe.normal", vec![0.0, 0.0, 1.0]), ("probe.friction", vec![0.3])]
            {
                let vr = vr(unit, name);
                unit.set_real_array(vr, &x).unwrap();
            }
            unit.do_step(2.0, 4e-3).unwrap();
        }
        assert_eq!(get(&mut i, "wheel.force.y"), get(&mut j, "wheel.force.y"));
        assert!((get(&mut i, "deflection") - 0.04).abs() < 1e-9);
        let height = vr(&i, "probe.height");
        i.set_real_array(height, &[0.0, 1.0]).unwrap();
        assert!(i.do_step(2.004, 4e-3).unwrap_err().message.contains("probe.height"));
    }
}

#[test]
fn faults_name_the_field() {
    let mut i = fresh(1);
    let vr = vr(&i, "specification");
    i.set_string(vr, r#"{"mass": -1, "inertia": [1, 1, 1], "width": 0.3}"#).unwrap();
    assert!(i.enter_initialization().unwrap_err().message.contains("'mass' is -1"));
}
