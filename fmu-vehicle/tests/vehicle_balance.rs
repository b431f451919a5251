//! Balances of the whole vehicle: pitch in braking (5.5), momentum and energy of the unforced system, independence of the step.

mod checks;
mod study;

use checks::{figure, relative};
use fmu_vehicle::powertrain::Mode;
use fmu_vehicle::vehicle::place::Rest;
use fmu_vehicle::vehicle::tires::TireModel;
use fmu_vehicle::vehicle::{DriverInputs, Part, Place, Vehicle, VehicleSpec};
use serde_json::{Value, json};
use study::{EXTERNAL, Study};
use terramech_handling_tires::{Contact, Probe};
use terramech_mechanics::Vec3;

/// Braking at a constant pedal: what the front axle carries more and the rear one less balances m a h.
#[test]
fn case_5_5_pitch_in_braking() {
    let mut s = Study::new(TireModel::Fiala(None), EXTERNAL, 20.0);
    s.v.inputs = DriverInputs { braking: 0.25, ..DriverInputs::default() };
    s.run(1.5, 1e-3);
    let probe = Probe::level(0.0, 0.8);
    let about = |s: &Study| {
        let (p, l) = s.v.system.momentum();
        (p, l - s.v.system.center_of_mass().cross(&p))
    };
    let (p0, l0) = about(&s);
    let n = 1000;
    let (mut transfer, mut arm, mut height, mut base) = (0.0, 0.0, 0.0, 0.0);
    for _ in 0..n {
        s.run(1e-3, 1e-3);
        let com = s.v.system.center_of_mass();
        for (i, f) in s.tires.forces(&s.v).iter().enumerate() {
            let wheel = s.v.wheel_state(i);
            let c = Contact::new(&wheel, &probe, s.tires.tire.radius()).unwrap();
            let w = c.wrench(f);
            let r = wheel.position + c.arm - com;
            // Moment of the normal forces about the centre of mass, nose down negative: what the load transfer holds up.
            transfer += r.x * f.force.z;
            // The tires' own moments about y: rolling resistance.
            arm += (w.moment - c.arm.cross(&w.force)).y;
            base += if i < 2 { 0.5 * r.x } else { -0.5 * r.x };
        }
        height += com.z;
    }
    let n = f64::from(n);
    let (p1, l1) = about(&s);
    let (a, height, wheelbase) = ((p0.x - p1.x) / s.v.system.mass(), height / n, base / n);
    // Over one second.
    let spin = l1.y - l0.y;
    // x F_z = m a h - (rate of angular momentum: wheels and shafts that slow down) + the tires' moments.
    let mah = s.v.system.mass() * a * height;
    let expected = (mah - spin + arm / n) / wheelbase;
    println!(
        "a {a:.3} m/s2, h {height:.3} m, L {wheelbase:.3} m: m a h / L {:.1} N, wheels' spin {:.1} N, rolling {:.1} N",
        mah / wheelbase,
        -spin / wheelbase,
        arm / n / wheelbase
    );
    relative(
        "5.5",
        "load transfer in braking: (m a h + spin of the wheels) / L",
        "N",
        expected,
        transfer / n / wheelbase,
        1e-2,
    );
}

/// The HMMWV without what drives and brakes it (one-dimensional shafts carry momentum that is none of a body), changed by `change`.
fn bare(change: impl Fn(&mut Value)) -> VehicleSpec {
    let mut spec: Value =
        serde_json::to_value(VehicleSpec::read("hmmwv/vehicle.json", &Place::Folder(None)).unwrap()).unwrap();
    for k in 0..2 {
        spec["axles"][k].as_object_mut().unwrap().remove("brake");
        change(&mut spec["axles"][k]["suspension"]["double_wishbone"]);
    }
    for part in ["driveline", "powertrain", "drag"] {
        spec.as_object_mut().unwrap().remove(part);
    }
    let part: Part<VehicleSpec> = serde_json::from_value(spec).unwrap();
    let Part::Inline(spec) = part else { panic!("in place") };
    *spec
}

/// The vehicle without gravity and tires, turned loose: linear and angular momentum stay, whatever springs and shocks do inside.
#[test]
fn a_free_vehicle_keeps_its_momentum() {
    let spec = bare(|_| {});
    let mut v = Rest::find(&spec, &[], &[], Mode::Neutral).unwrap().vehicle;
    v.system.set_gravity(Vec3::zeros());
    v.system.launch(&Vec3::new(3.0, -1.0, 0.5), &Vec3::new(0.3, 0.2, 0.5));
    v.system.project_velocities().unwrap();
    let about = |v: &Vehicle| {
        let (p, l) = v.system.momentum();
        (p, l - v.system.center_of_mass().cross(&p))
    };
    let (p0, l0) = about(&v);
    for _ in 0..3000 {
        v.step(1e-3).unwrap();
    }
    let (p1, l1) = about(&v);
    println!("angular momentum {l0:?} -> {l1:?}");
    figure(
        "5 momentum",
        "HMMWV turned loose, relative change of momentum in 3 s",
        "1",
        0.0,
        (p1 - p0).norm() / p0.norm(),
        1e-9,
    );
    figure(
        "5 momentum",
        "HMMWV turned loose, relative change of angular momentum in 3 s",
        "1",
        0.0,
        (l1 - l0).norm() / l0.norm(),
        1e-3,
    );
}

/// Springs without shocks and stops: kinetic and spring energy swing, their sum stays.
#[test]
fn an_undamped_vehicle_keeps_its_energy() {
    let (rate, free) = (1.2e5, 0.45);
    let spec = bare(|s| {
        s["spring"] = json!({"linear": {"rate": rate, "free_length": free}});
        s["shock"] = json!({"linear": {"coefficient": 0.0}});
        s.as_object_mut().unwrap().remove("stops");
    });
    let mut v = Rest::find(&spec, &[], &[], Mode::Neutral).unwrap().vehicle;
    v.system.set_gravity(Vec3::zeros());
    // Taken off its wheels the springs are let loose.
    v.system.launch(&Vec3::zeros(), &Vec3::new(0.5, 0.3, 0.4));
    v.system.project_velocities().unwrap();
    let springs = |v: &Vehicle| -> f64 {
        (0..4).map(|i| 0.5 * rate * (v.system.stroke(v.corner(i).spring).length - free).powi(2)).sum()
    };
    let start = springs(&v) + v.system.kinetic_energy();
    let (mut most, mut swing) = (0.0_f64, 0.0_f64);
    for _ in 0..3000 {
        v.step(1e-3).unwrap();
        let kinetic = v.system.kinetic_energy();
        swing = swing.max(kinetic);
        most = most.max((springs(&v) + kinetic - start).abs());
    }
    println!("energy {start:.1} J, kinetic up to {swing:.1} J, largest change {most:.3} J");
    figure("5 energy", "undamped HMMWV, energy error in 3 s / largest kinetic energy", "1", 0.0, most / swing, 5e-3);
}

/// A sine of the steering at 12 m/s: the path does not depend on the step.
#[test]
fn a_sine_steer_does_not_depend_on_the_step() {
    let run = |h: f64| {
        let mut s = Study::new(TireModel::Fiala(None), EXTERNAL, 12.0);
        for k in 0..(4.0 / h).round() as usize {
            let t = k as f64 * h;
            s.v.inputs = DriverInputs { steering: 0.15 * (3.0 * t).sin(), throttle: 0.2, braking: 0.0 };
            s.run(h, h);
        }
        s.v.chassis_state().state.position
    };
    let (coarse, fine) = (run(1e-3), run(2.5e-4));
    relative("5.8", "x after 4 s of sine steering, step 1e-3 against 2.5e-4 s", "m", fine.x, coarse.x, 1e-3);
    figure("5.8", "y after 4 s of sine steering, step 1e-3 against 2.5e-4 s", "m", fine.y, coarse.y, 1e-2);
}
