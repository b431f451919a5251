//! The energy balance of the vehicle: engine work + work of the wheels' forces = change of energy + what is dissipated.

mod checks;
mod study;

use checks::figure;
use fmu_vehicle::vehicle::DriverInputs;
use fmu_vehicle::vehicle::energy::Energies;
use fmu_vehicle::vehicle::tires::TireModel;
use study::{EXTERNAL, Study};

/// What has come in since `start` and is nowhere (J).
fn missing(start: &Energies, now: &Energies) -> f64 {
    let stored = (now.kinetic - start.kinetic) + (now.potential - start.potential);
    (now.engine - start.engine) + (now.wheels - start.wheels) - stored - (now.dissipated - start.dissipated)
}

#[test]
fn what_the_engine_does_is_stored_or_dissipated() {
    let mut s = Study::new(TireModel::Fiala(None), EXTERNAL, 0.0);
    s.v.start_energy();
    let start = s.v.energies();
    let drive = |s: &mut Study, steering, throttle, braking, time| {
        let before = s.v.energies();
        s.v.inputs = DriverInputs { steering, throttle, braking };
        s.run(time, 1e-3);
        (before, s.v.energies())
    };
    // Full throttle through a change of gear.
    let gear = s.v.gear();
    let (_, fast) = drive(&mut s, 0.0, 1.0, 0.0, 6.0);
    assert!(s.v.gear() > gear, "it changed gear");
    assert!(fast.kinetic > 0.4 * fast.engine && fast.dissipated > 0.1 * fast.engine, "{fast:?}");
    figure(
        "9.4",
        "vehicle, energy missing after full throttle / engine work",
        "1",
        0.0,
        missing(&start, &fast) / fast.engine,
        1e-5,
    );
    // Left and right: shocks and steering take part.
    let (before, _) = drive(&mut s, 0.3, 0.4, 0.0, 1.0);
    let (_, swung) = drive(&mut s, -0.3, 0.4, 0.0, 1.0);
    assert!(swung.dissipated > before.dissipated);
    figure(
        "9.4",
        "vehicle, energy missing after a swerve / engine work",
        "1",
        0.0,
        missing(&before, &swung) / swung.engine,
        1e-3,
    );
    // Hard braking: the brakes take what was in motion.
    let (before, stands) = drive(&mut s, 0.0, 0.0, 1.0, 4.0);
    assert!(stands.kinetic < 0.02 * before.kinetic + 5e3, "{stands:?}");
    let taken = stands.dissipated - before.dissipated;
    assert!(taken > 0.3 * before.kinetic, "brakes and engine took {taken} J of {} J", before.kinetic);
    figure(
        "9.4",
        "vehicle, energy missing after braking / kinetic energy before",
        "1",
        0.0,
        missing(&before, &stands) / before.kinetic,
        2e-3,
    );
}

/// Coarser steps lose more: the remainder is the integrator's.
#[test]
fn the_balance_closes_better_with_smaller_steps() {
    let error = |h: f64| {
        let mut s = Study::new(TireModel::Fiala(None), EXTERNAL, 0.0);
        s.v.start_energy();
        let start = s.v.energies();
        s.v.inputs = DriverInputs { throttle: 0.7, ..DriverInputs::default() };
        s.run(1.5, h);
        let now = s.v.energies();
        (missing(&start, &now) / now.engine).abs()
    };
    let (coarse, fine) = (error(2e-3), error(2.5e-4));
    println!("missing: {coarse:.2e} at 2 ms, {fine:.2e} at 0.25 ms");
    assert!(fine < 0.5 * coarse && coarse < 1e-2, "{coarse} {fine}");
}

#[test]
fn a_saved_vehicle_keeps_its_balance() {
    let mut s = Study::new(TireModel::Fiala(None), EXTERNAL, 0.0);
    s.v.start_energy();
    s.v.inputs = DriverInputs { throttle: 1.0, ..DriverInputs::default() };
    s.run(0.5, 1e-3);
    let (saved, energies) = (s.v.save(), s.v.energies());
    s.run(0.3, 1e-3);
    assert_ne!(s.v.energies(), energies);
    s.v.restore(&saved).unwrap();
    assert_eq!(s.v.energies(), energies);
}
