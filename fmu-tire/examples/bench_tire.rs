//! Cost of the flexible tire: milliseconds per step of 4e-5 s, rolling in contact, split into its parts.
//!
//! `cargo run --release -p fmu-tire --example bench_tire -- [layered|lumped] [divisions] [steps]`

use fmu_tire::ancf::assembly::Assembly;
use fmu_tire::ancf::hht::HhtCost;
use fmu_tire::ancf::kernel::{Loads, TangentWeights};
use fmu_tire::ancf::mesh::ForceBuffer;
use fmu_tire::ancf::plane::Plane;
use fmu_tire::ancf::spec::{HMMWV_LAYERED, HMMWV_LUMPED, parse};
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

fn timed<T>(times: u32, mut f: impl FnMut() -> T) -> f64 {
    let start = cpu();
    for _ in 0..times {
        std::hint::black_box(f());
    }
    (cpu() - start) / f64::from(times)
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
    for precision in [Precision::Double, Precision::Single] {
        rolling(&spec, precision, steps);
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
    let forces = timed(100, || mesh.forces(&loads, &q, &zero, &zero, &mut buffer, &mut force, &mut inertia));
    println!("element forces {forces:.3} ms ({:.3} us per element)", 1e3 * forces / mesh.shells().len() as f64);
    let weights = TangentWeights { stiffness: 0.8, velocity: 0.8 * 4e4, mass: 1.8e9, pressure: true, geometric: true };
    let _ = tire.hht_mut();
    for precision in [Precision::Double, Precision::Single] {
        let fixed: Vec<[bool; 6]> = (0..mesh.node_count()).map(|i| [tire.mesh.on_rim(i); 6]).collect();
        let start = cpu();
        let mut assembly = Assembly::new(&mesh, &fixed, precision).expect("analysis");
        let analysis = cpu() - start;
        let assemble = timed(10, || assembly.assemble(&mesh, &loads, &q, &weights, &[]));
        let factorise = timed(5, || assembly.factorise().expect("regular"));
        let mut rhs = vec![1.0; assembly.len()];
        let solve = timed(50, || assembly.solve(&mut rhs));
        println!(
            "{precision:?}: analysis {analysis:.1} ms, assembly {assemble:.1} ms, factorisation {factorise:.1} ms, solve {solve:.2} ms, {:.2} M entries",
            1e-6 * assembly.solver().entries() as f64
        );
    }
}

fn rolling(spec: &fmu_tire::ancf::spec::FlexibleTire, precision: Precision, steps: usize) {
    let h = 4e-5;
    let mut tire = Tire::new(spec, precision).expect("the tire inflates");
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
    let (ms, cost, force) = run(&mut tire, steps);
    println!(
        "{precision:?} rolling at {SPEED} m/s: {ms:.2} ms per step, {:.2} iterations, one factorisation per {:.0} steps, {force:.0} N, {} nodes touch",
        cost.iterations as f64 / cost.steps as f64,
        cost.steps as f64 / cost.factorisations.max(1) as f64,
        tire.plane_forces().len(),
    );
}
