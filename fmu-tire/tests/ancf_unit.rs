//! The unit `tire_ancf`: case 9.3 (free fall, spin-up in the air), its own plane, faults, exact states.

mod ancf_support;

use ancf_support::report;
use fmu_tire::ancf::spec::{FlexibleTire, HMMWV_LAYERED, HMMWV_LUMPED};
use terramech_fmi2::instance::Instance;

/// The HMMWV tire on a coarse mesh, as inline JSON.
fn coarse(text: &str) -> String {
    let mut spec: FlexibleTire = serde_json::from_str(text).unwrap();
    spec.divisions = 24;
    spec.sections.iter_mut().zip([1, 1, 2]).for_each(|(s, n)| s.elements = n);
    serde_json::to_string(&spec).unwrap()
}

struct Unit(Instance);

impl Unit {
    fn new(specification: &str, set: impl FnOnce(&mut Self)) -> Self {
        let mut unit = Self(Instance::new(fmu_tire::ancf::model(), None, Box::new(|_, text| println!("{text}"))));
        let vr = unit.vr("specification");
        unit.0.set_string(vr, specification).unwrap();
        unit.0.setup(0.0, None).unwrap();
        set(&mut unit);
        unit.0.enter_initialization().unwrap();
        unit.0.exit_initialization().unwrap();
        unit
    }

    fn vr(&self, name: &str) -> u32 {
        self.0.model().table.find(name).unwrap_or_else(|| panic!("no variable {name}")).0
    }

    fn get(&mut self, name: &str) -> f64 {
        let vr = self.vr(name);
        self.0.real(vr).unwrap()
    }

    fn set(&mut self, name: &str, x: f64) {
        let vr = self.vr(name);
        self.0.set_real(vr, x).unwrap();
    }

    /// Turned by `angle` about the axle, at height z.
    fn wheel(&mut self, x: f64, z: f64, vx: f64, vz: f64, angle: f64, omega: f64) {
        self.set("wheel.position.x", x);
        self.set("wheel.position.z", z);
        self.set("wheel.velocity.x", vx);
        self.set("wheel.velocity.z", vz);
        self.set("wheel.orientation.w", (0.5 * angle).cos());
        self.set("wheel.orientation.y", (0.5 * angle).sin());
        self.set("wheel.angular_velocity.y", omega);
    }
}

/// A light wheel (5 kg, 0.2 kg m2) in free fall under the explicit coupling: the wrench stays zero.
#[test]
fn free_fall_feels_no_wrench() {
    for (name, text) in [("layered", HMMWV_LAYERED), ("lumped", HMMWV_LUMPED)] {
        for (h, steps) in [(4e-5, 200), (1e-3, 30)] {
            let mut unit = Unit::new(&coarse(text), |_| ());
            let mass = 5.0 + unit.get("hub.mass");
            let (mut z, mut v, mut worst, mut first) = (0.0, 0.0, 0.0f64, 0.0f64);
            for k in 0..steps {
                unit.wheel(0.0, z, 0.0, v, 0.0, 0.0);
                unit.0.do_step(f64::from(k) * h, h).unwrap();
                let force = unit.get("wheel.force.z");
                // The start of the fall rings for some tens of inner steps.
                if k >= steps / 2 {
                    worst = worst.max(force.abs());
                } else {
                    first = first.max(force.abs());
                }
                v += h * (force / mass - 9.81);
                z += h * v;
            }
            println!(
                "{name}, H {h}: largest wrench {worst:.3} N (first half {first:.2} N) of {:.1} N weight, fell to v = {v:.5}",
                9.81 * mass
            );
            report(
                "9.3 free fall",
                &format!("{name}, H {h} s: largest wrench after the start, over the weight"),
                "1",
                0.0,
                worst / (9.81 * mass),
                0.005,
            );
            assert!(worst < 0.005 * 9.81 * mass && first < 0.2 * 9.81 * mass, "{name} {h}: {worst}, first {first}");
            assert!((v + 9.81 * h * f64::from(steps)).abs() < 0.005 * 9.81 * h * f64::from(steps), "{v}");
        }
    }
}

/// A torque of 50 N m spins the same wheel up in the air: T = I alpha of the whole wheel.
#[test]
fn spin_up_in_the_air() {
    for (name, text) in [("layered", HMMWV_LAYERED), ("lumped", HMMWV_LUMPED)] {
        for (h, steps) in [(4e-5, 500), (1e-3, 40)] {
            let mut unit = Unit::new(&coarse(text), |u| u.set("gravity", 0.0));
            let inertia = 0.2 + unit.get("hub.inertia.yy");
            let (mut angle, mut omega, mut last) = (0.0, 0.0, 0.0f64);
            for k in 0..steps {
                unit.wheel(0.0, 0.0, 0.0, 0.0, angle, omega);
                unit.0.do_step(f64::from(k) * h, h).unwrap();
                last = unit.get("wheel.moment.y");
                omega += h * (50.0 + last) / inertia;
                angle += h * omega;
            }
            let expected = 50.0 / inertia * h * f64::from(steps);
            println!("{name}, H {h}: omega {omega:.4} expected {expected:.4} rad/s, last moment {last:.3} N m");
            report(
                "9.3 spin-up",
                &format!("{name}, H {h} s: angular speed"),
                "rad/s",
                expected,
                omega,
                0.02 * expected,
            );
            assert!((omega - expected).abs() < 0.02 * expected, "{name} {h}: {omega} against {expected}");
        }
    }
}

/// On its own plane: presses, rolls, saves and restores with the same bits.
#[test]
fn rolls_on_its_plane_and_goes_on_exactly_from_a_saved_state() {
    let specification = coarse(HMMWV_LUMPED);
    let place = |u: &mut Unit| {
        let vr = u.vr("ground");
        u.0.set_string(vr, "plane").unwrap();
        u.set("plane.height", -0.475);
    };
    let mut unit = Unit::new(&specification, place);
    let h = 2e-4;
    let run = |unit: &mut Unit, from: i32, to: i32| {
        for k in from..to {
            let t = f64::from(k) * h;
            let depth = 0.5 * (t / 0.01).min(1.0) * 0.01;
            unit.wheel(2.0 * t, -depth, 2.0, if t < 0.01 { -0.5 } else { 0.0 }, 2.0 * t / 0.47, 2.0 / 0.47);
            unit.0.do_step(t, h).unwrap();
        }
    };
    run(&mut unit, 0, 60);
    let state = unit.0.save().unwrap();
    run(&mut unit, 60, 90);
    let mesh = unit.vr("mesh.position");
    let names = [
        "wheel.force.x",
        "wheel.force.z",
        "wheel.moment.y",
        "plane.force",
        "deflection",
        "patch_area",
        "strain_energy",
    ];
    let first: Vec<f64> = names.iter().map(|n| unit.get(n)).collect();
    let positions = unit.0.real_array(mesh).unwrap().to_vec();
    println!("{names:?}: {first:?}");
    assert!(first[3] > 100.0 && first[5] > 0.0, "{first:?}");
    let mut other = Unit::new(&specification, place);
    other.0.restore(&state).unwrap();
    run(&mut other, 60, 90);
    let second: Vec<f64> = names.iter().map(|n| other.get(n)).collect();
    assert_eq!(first, second);
    assert!(other.0.real_array(mesh).unwrap() == positions.as_slice(), "the same bits");
}

/// The tangent kept over steps changes the result by no more than the tolerance says.
#[test]
fn kept_tangent_agrees_with_full_newton() {
    let run = |tolerance: f64| {
        let mut spec: FlexibleTire = serde_json::from_str(&coarse(HMMWV_LAYERED)).unwrap();
        spec.integrator.tolerance = tolerance;
        let place = |u: &mut Unit| {
            let vr = u.vr("ground");
            u.0.set_string(vr, "plane").unwrap();
            u.set("plane.height", -0.469);
        };
        let mut unit = Unit::new(&serde_json::to_string(&spec).unwrap(), place);
        let h = 1e-4;
        for k in 0..40 {
            let t = f64::from(k) * h;
            unit.wheel(3.0 * t, -0.5 * t, 3.0, -0.5, 3.0 * t / 0.467, 3.0 / 0.467);
            unit.0.do_step(t, h).unwrap();
        }
        let mesh = unit.vr("mesh.position");
        (unit.0.real_array(mesh).unwrap().to_vec(), unit.get("wheel.force.z"))
    };
    let (b, fb) = run(1e-13);
    let (a, fa) = run(1e-8);
    let worst = a.iter().zip(&b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    println!("positions differ by {worst:.2e} m after 40 steps, force {fa:.3} N against {fb:.3} N");
    assert!(worst < 1e-6 && (fa - fb).abs() < 1e-2 * fb.abs(), "{worst} {fa} {fb}");
}

/// What the unit says to a specification, changed from the layered tire on a coarse mesh.
fn refused(change: impl FnOnce(&mut FlexibleTire)) -> String {
    let mut spec: FlexibleTire = serde_json::from_str(&coarse(HMMWV_LAYERED)).unwrap();
    change(&mut spec);
    let mut unit = Instance::new(fmu_tire::ancf::model(), None, Box::new(|_, _| ()));
    let vr = unit.model().table.find("specification").unwrap().0;
    unit.set_string(vr, &serde_json::to_string(&spec).unwrap()).unwrap();
    unit.setup(0.0, None).unwrap();
    unit.enter_initialization().expect_err("the specification is wrong").message
}

/// Each fault of a specification is told with its place, what was given and what is allowed.
#[test]
fn faults_of_a_specification_are_named() {
    use fmu_tire::ancf::spec::{Lugs, Shape};
    type Change = fn(&mut FlexibleTire);
    let cases: [(Change, &[&str]); 18] = [
        (|s| s.sections[1].layers[0].thickness = -0.0005, &["section 'sidewall'", "layer 1", "thickness = -0.0005 m"]),
        (|s| s.materials[0].young[1] = 1e3, &["section 'bead'", "not positive definite"]),
        (
            |s| {
                let Shape::Profile(points) = &mut s.shape else { unreachable!() };
                (points[30][1], points[31][2]) = (0.05, 0.1);
            },
            &["profile", "crosses itself between t = "],
        ),
        (|s| s.divisions = 3, &["'divisions' is 3", "8 to 720"]),
        (|s| s.sections[2].elements = 0, &["'sections'", "at least one element"]),
        (|s| s.sections.clear(), &["'sections'"]),
        // Memory for that does not exist; it must not even be asked for.
        (|s| s.sections[2].elements = u32::MAX, &["'sections' have 4294967297 elements", "allowed: 60"]),
        (|s| s.pressure = 1e12, &["'pressure' is 1000000000000", "inside out"]),
        (|s| s.materials.push(s.materials[0].clone()), &["two are called 'carcass'"]),
        (|s| s.integrator.iterations = 1, &["'integrator.iterations' is 1", "2 to 1000"]),
        (|s| s.materials[1].density = -1.0, &["section 'tread'", "density = -1"]),
        (|s| s.sections[0].layers.clear(), &["section 'bead'", "no layers"]),
        (|s| s.sections[0].layers[1].material = "steal".into(), &["no material is called 'steal'"]),
        (|s| s.pressure = -2e5, &["'pressure' is -200000"]),
        (|s| s.damping = -0.1, &["'damping' is -0.1"]),
        (|s| s.integrator.alpha = 0.2, &["'integrator.alpha' is 0.2", "-1/3 to 0"]),
        (|s| s.integrator.step = 0.0, &["'integrator.step' is 0"]),
        (
            |s| s.lugs = Some(Lugs { count: 7, height: -0.01, elements: 1, staggered: false }),
            &["'lugs.height' is -0.01", "'lugs.count' is 7", "divisor of 'divisions' (24)"],
        ),
    ];
    for (change, parts) in cases {
        let text = refused(change);
        println!("{text}\n");
        parts.iter().for_each(|p| assert!(text.contains(p), "{p} missing in: {text}"));
    }
}

/// A plane that would reach the rim.
#[test]
fn a_plane_above_the_rim_is_refused() {
    let mut unit = Instance::new(fmu_tire::ancf::model(), None, Box::new(|_, _| ()));
    let find = |u: &Instance, name: &str| u.model().table.find(name).unwrap().0;
    for (name, value) in [("specification", coarse(HMMWV_LUMPED)), ("ground", "plane".into())] {
        let vr = find(&unit, name);
        unit.set_string(vr, &value).unwrap();
    }
    unit.setup(0.0, None).unwrap();
    let vr = find(&unit, "plane.height");
    unit.set_real(vr, 1e30).unwrap();
    unit.enter_initialization().unwrap();
    let text = unit.exit_initialization().expect_err("it reaches the rim").message;
    assert!(text.contains("above the rim's lowest point") && text.contains("-0.2683"), "{text}");
}

/// Contact arrays that do not fit, and forces that no tire stands: told, the instance is poisoned, and a saved state brings it back.
#[test]
fn faults_of_a_run_are_named_and_a_saved_state_brings_the_tire_back() {
    let start = || {
        let mut unit = Unit::new(&coarse(HMMWV_LAYERED), |_| ());
        unit.wheel(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        unit.0.do_step(0.0, 1e-4).unwrap();
        let state = unit.0.save().unwrap();
        (unit, state)
    };
    let nan = f64::NAN;
    let cases: [(&[i32], &[f64], &[&str]); 6] = [
        (&[5, 4], &[0.0; 6], &["'contact.index' element 1 is 4 after 5", "ascending and unique"]),
        (&[4, 4], &[0.0; 6], &["'contact.index' element 1 is 4 after 4"]),
        (&[-1], &[0.0; 3], &["'contact.index' element 0 is -1"]),
        (&[100_000], &[0.0; 3], &["'contact.index' element 0 is 100000", "0 to 215"]),
        (&[4], &[0.0; 2], &["'contact.index' has 1 elements and 'contact.force' 2", "three reals"]),
        // A tread node pulled by a hundred tons: the step is halved, then the run stops with its figures.
        (&[4], &[0.0, 0.0, 1e9], &["t = 0.0001"]),
    ];
    for (index, force, parts) in cases {
        let (mut unit, state) = start();
        let (i, f) = (unit.vr("contact.index"), unit.vr("contact.force"));
        unit.0.set_integer_array(i, index).unwrap();
        unit.0.set_real_array(f, force).unwrap();
        let text = unit.0.do_step(1e-4, 1e-4).expect_err("the input is wrong").message;
        println!("{text}\n");
        parts.iter().for_each(|p| assert!(text.contains(p), "{p} missing in: {text}"));
        assert!(unit.0.do_step(1e-4, 1e-4).is_err(), "poisoned");
        unit.0.restore(&state).unwrap();
        unit.0.set_integer_array(i, &[]).unwrap();
        unit.0.set_real_array(f, &[]).unwrap();
        unit.0.do_step(1e-4, 1e-4).unwrap();
    }
    let (mut unit, _) = start();
    let f = unit.vr("contact.force");
    // Not a number: refused where it enters, or at the step.
    let i = unit.vr("contact.index");
    unit.0.set_integer_array(i, &[4]).unwrap();
    let refused = unit.0.set_real_array(f, &[nan, 0.0, 0.0]).err().or_else(|| unit.0.do_step(1e-4, 1e-4).err());
    assert!(refused.expect("not a number").message.contains("contact.force"));
    let (mut unit, _) = start();
    let w = unit.vr("wheel.orientation.w");
    let refused = unit.0.set_real(w, 7.0).err().or_else(|| unit.0.do_step(1e-4, 1e-4).err());
    assert!(refused.expect("no unit quaternion").message.contains("wheel"));
}
