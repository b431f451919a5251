//! Cost of the flexible tire: milliseconds per step of 4e-5 s, rolling in contact, split into its parts.
//!
//! `cargo run --release -p fmu-tire --example bench_tire -- [layered|lumped] [divisions] [steps]`

use fmu_tire::ancf::assembly::Assembly;
use fmu_tire::ancf::hht::HhtCost;
use fmu_tire::ancf::kernel::{Loads, TangentWeights};
use fmu_tire::ancf::mesh::ForceBuffer;
use fmu_tire::ancf::plane::Plane;
use fmu_tire::ancf::spec::{HMMWV_LAYERED, HMMWV_LUMPED, parse};
use fmu_tire::ancf::team::Team;
use fmu_tire::ancf::tire::Tire;
use std::time::Instant;
use terramech_mechanics::RigidState;
use terramech_mechanics::sparse::Precision;

/// Speed of the axle, m/s, and how far the free tire reaches below the plane, m.
const SPEED: f64 = 5.0;
const DEFLECTION: f64 = 0.01;

/// Processor time of this thread, ms: on a busy machine the wall clock counts the others.
fn cpu() -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|s| s.split_whitespace().next().and_then(|x| x.parse::<f64>().ok()))
        .map_or_else(|| 1e3 * START.elapsed().as_secs_f64(), |ns| 1e-6 * ns)
}

static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);

/// Least time of a call in five rounds, ms: what shares the machine only ever adds.
fn timed<T>(times: u32, mut f: impl FnMut() -> T) -> f64 {
    let mut round = || {
        let start = cpu();
        for _ in 0..times {
            std::hint::black_box(f());
        }
        (cpu() - start) / f64::from(times)
    };
    (0..5).map(|_| round()).fold(f64::MAX, f64::min)
}

fn main() {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or_else(|| "layered".into());
    let mut spec = parse(if name == "lumped" { HMMWV_LUMPED } else { HMMWV_LAYERED }).expect("the data file is valid");
    if let Some(divisions) = args.next().and_then(|a| a.parse().ok()) {
        spec.divisions = divisions;
    }
    let steps: usize = args.next().and_then(|a| a.parse().ok()).unwrap_or(400);
    println!("instruction path {}, {name}, {} x {}", terramech_simd::active(), spec.divisions, spec.across());
    parts(&spec);
    if steps == 0 {
        return;
    }
    let tolerances = std::env::var("TOL").unwrap_or_else(|_| "1e-8".into());
    for tolerance in tolerances.split(',').map(|t| t.parse().expect("a number")) {
        spec.integrator.tolerance = tolerance;
        rolling(&spec, Precision::Single, steps);
    }
}

/// The parts of a step, each alone.
fn parts(spec: &fmu_tire::ancf::spec::FlexibleTire) {
    let start = cpu();
    let mut tire = Tire::new(spec, Precision::Double).expect("the tire inflates");
    println!("build and inflate {:.0} ms", cpu() - start);
    let n = tire.state.shell.q.len();
    let (q, zero) = (tire.state.shell.q.clone(), vec![0.0; n]);
    let loads = Loads { damping: spec.damping, pressure: spec.pressure };
    let (mut buffer, mut force, mut inertia) = (ForceBuffer::default(), vec![0.0; n], vec![0.0; n]);
    let mesh = tire.mesh.mesh.clone();
    let forces = timed(20, || mesh.forces(&loads, &q, &zero, &zero, &mut buffer, &mut force, &mut inertia));
    println!("element forces {forces:.3} ms ({:.3} us per element)", 1e3 * forces / mesh.shells().len() as f64);
    let weights = TangentWeights { stiffness: 0.8, velocity: 0.8 * 4e4, mass: 1.8e9, pressure: true, geometric: true };
    let _ = tire.hht_mut();
    for precision in [Precision::Double, Precision::Single] {
        let fixed: Vec<[bool; 6]> = (0..mesh.node_count()).map(|i| [tire.mesh.on_rim(i); 6]).collect();
        let start = cpu();
        let mut assembly = Assembly::new(&mesh, &fixed, precision).expect("analysis");
        let analysis = cpu() - start;
        let assemble = timed(3, || assembly.assemble(&mesh, &loads, &q, &weights, &[]));
        let factorise = timed(2, || assembly.factorise().expect("regular"));
        let mut rhs = vec![1.0; assembly.len()];
        let solve = timed(20, || assembly.solve(&mut rhs));
        println!(
            "{precision:?}: analysis {analysis:.1} ms, assembly {assemble:.1} ms, factorisation {factorise:.1} ms, solve {solve:.2} ms, {:.2} M entries",
            1e-6 * assembly.solver().entries() as f64
        );
    }
}

fn rolling(spec: &fmu_tire::ancf::spec::FlexibleTire, precision: Precision, steps: usize) {
    let h = 4e-5;
    let mut tire = Tire::new(spec, precision).expect("the tire inflates");
    let threads = std::env::var("THREADS").ok().and_then(|t| t.parse().ok()).unwrap_or(1);
    tire.set_team(&Team::new(threads).expect("threads"));
    let radius = tire.state.shell.q.chunks(6).map(|n| -n[2]).fold(0.0, f64::max);
    tire.state.plane = Some(Plane::horizontal(-radius - 1e-4));
    let wheel = |time: f64| {
        let ramp: f64 = (time / 0.02).min(1.0);
        // Lowered over 20 ms while rolling.
        let z = -DEFLECTION * ramp * ramp * (3.0 - 2.0 * ramp);
        let vz = if ramp < 1.0 { -DEFLECTION * 6.0 * ramp * (1.0 - ramp) / 0.02 } else { 0.0 };
        let omega = SPEED / (radius - 0.3 * DEFLECTION);
        RigidState {
            position: [SPEED * time, 0.0, z].into(),
            orientation: nalgebra::UnitQuaternion::from_scaled_axis([0.0, omega * time, 0.0].into()),
            velocity: [SPEED, 0.0, vz].into(),
            angular_velocity: [0.0, omega, 0.0].into(),
        }
    };
    tire.place(&wheel(0.0));
    let mut step = 0usize;
    let mut run = |tire: &mut Tire, steps: usize| -> (f64, HhtCost, f64) {
        let before = tire.cost();
        let start = cpu();
        let mut force = 0.0;
        for _ in 0..steps {
            let wrench = tire.step(&wheel(step as f64 * h), h, &[]).expect("the step converges");
            force = wrench.force.z;
            step += 1;
        }
        let after = tire.cost();
        let cost = HhtCost {
            steps: after.steps - before.steps,
            iterations: after.iterations - before.iterations,
            factorisations: after.factorisations - before.factorisations,
        };
        ((cpu() - start) / steps as f64, cost, force)
    };
    let (ms, cost, force) = run(&mut tire, 500);
    println!("{precision:?} lowering: {ms:.2} ms per step, {cost:?}, {force:.0} N");
    let saved = tire.save();
    let (ms, cost, force) = run(&mut tire, steps);
    println!(
        "{precision:?} tolerance {:.0e} rolling at {SPEED} m/s: {ms:.2} ms per step, {:.2} iterations, one factorisation per {:.0} steps, {force:.0} N, {} nodes touch",
        spec.integrator.tolerance,
        cost.iterations as f64 / cost.steps as f64,
        cost.steps as f64 / cost.factorisations.max(1) as f64,
        tire.plane_forces().len(),
    );
    accuracy(spec, precision, saved, &wheel);
}

/// The same run with Newton converged to round-off: differences of positions and wrench.
fn accuracy(
    spec: &fmu_tire::ancf::spec::FlexibleTire,
    precision: Precision,
    saved: fmu_tire::ancf::tire::SavedTire,
    wheel: &dyn Fn(f64) -> RigidState,
) {
    let run = |tolerance: f64| {
        let mut spec = spec.clone();
        spec.integrator.tolerance = tolerance;
        spec.integrator.iterations = 40;
        let mut tire = Tire::new(&spec, precision).expect("the tire inflates");
        tire.restore(saved.clone()).expect("the same mesh");
        let mut wrenches = Vec::new();
        for step in 500..700 {
            wrenches.push(tire.step(&wheel(f64::from(step) * 4e-5), 4e-5, &[]).expect("the step converges"));
        }
        (wrenches, tire.state.shell.q)
    };
    let (w, q) = run(spec.integrator.tolerance);
    let (reference, q_reference) = run(1e-13);
    let apart = q
        .chunks_exact(6)
        .zip(q_reference.chunks_exact(6))
        .map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt())
        .fold(0.0, f64::max);
    let rms = |f: &dyn Fn(usize) -> f64| ((0..w.len()).map(|k| f(k).powi(2)).sum::<f64>() / w.len() as f64).sqrt();
    let mean = |w: &[fmu_tire::ancf::tire::Wrench]| w.iter().map(|w| w.force.z).sum::<f64>() / w.len() as f64;
    println!(
        "   after 200 steps against Newton to 1e-13 m: positions {apart:.1e} m apart; force differs by {:.2} N rms, {:.3} N in the mean of {:.0} N (which swings by {:.1} N rms)",
        rms(&|k| (w[k].force - reference[k].force).norm()),
        mean(&w) - mean(&reference),
        mean(&reference),
        rms(&|k| reference[k].force.z - mean(&reference)),
    );
}
