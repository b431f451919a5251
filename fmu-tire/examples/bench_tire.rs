//! Cost of the flexible tire: a step of 4e-5 s, rolling in contact at 5 m/s and 10 mm of deflection, split into its parts.
//!
//! `cargo run --release -p fmu-tire --example bench_tire -- [layered|lumped] [divisions] [across] [threads] [steps]`. Lines
//! `BENCH|quantity|value|unit` are for `cargo xtask bench tire`. Parts are the least of five rounds of this thread's processor time: what
//! shares the machine only ever adds.

use fmu_tire::ancf::assembly::Assembly;
use fmu_tire::ancf::hht::HhtCost;
use fmu_tire::ancf::kernel::{Loads, TangentWeights};
use fmu_tire::ancf::mesh::ForceBuffer;
use fmu_tire::ancf::plane::Plane;
use fmu_tire::ancf::spec::{FlexibleTire, HMMWV_LAYERED, HMMWV_LUMPED, parse};
use fmu_tire::ancf::team::Team;
use fmu_tire::ancf::tire::{SavedTire, Tire, Wrench};
use std::hint::black_box;
use std::time::Instant;
use terramech_mechanics::RigidState;
use terramech_mechanics::sparse::Precision;
use terramech_simd::{Kernel, Lanes};

const STEP: f64 = 4e-5;
/// Speed of the axle, m/s, and how far the free tire reaches below the plane, m.
const SPEED: f64 = 5.0;
const DEFLECTION: f64 = 0.01;
/// Steps of lowering before anything is timed; steps compared with full Newton.
const LOWERING: usize = 500;
const COMPARED: usize = 200;

static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);

/// Processor time of this thread, ms.
fn cpu() -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|s| s.split_whitespace().next().and_then(|x| x.parse::<f64>().ok()))
        .map_or_else(|| 1e3 * START.elapsed().as_secs_f64(), |ns| 1e-6 * ns)
}

/// Least time of a call in five rounds, ms.
fn timed<T>(times: u32, mut f: impl FnMut() -> T) -> f64 {
    let mut round = || {
        let start = cpu();
        for _ in 0..times {
            black_box(f());
        }
        (cpu() - start) / f64::from(times)
    };
    (0..5).map(|_| round()).fold(f64::MAX, f64::min)
}

fn row(quantity: &str, value: f64, unit: &str) {
    println!("BENCH|{quantity}|{value:.9}|{unit}");
}

fn main() {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or_else(|| "layered".into());
    let mut spec = parse(if name == "lumped" { HMMWV_LUMPED } else { HMMWV_LAYERED }).expect("the data file is valid");
    let mut number = |default: usize| args.next().and_then(|a| a.parse().ok()).unwrap_or(default);
    spec.divisions = number(90) as u32;
    let across = number(24) as u32;
    // Bead, sidewall, tread share one side as 2 : 4 : 6.
    let bead = (across / 12).max(1);
    let wall = (across / 6).max(1);
    spec.sections.iter_mut().zip([bead, wall, across / 2 - bead - wall]).for_each(|(s, n)| s.elements = n);
    let (threads, steps) = (number(1), number(1000));
    println!("{name}, {} x {}, {threads} threads, {}", spec.divisions, spec.across(), terramech_simd::active());
    if threads == 1 {
        parts(&spec);
    }
    if steps > 0 {
        rolling(&spec, threads, steps);
    }
}

/// The parts of a step, each alone, beside what the machine allows.
fn parts(spec: &FlexibleTire) {
    let start = cpu();
    let tire = Tire::new(spec, Precision::Single).expect("the tire inflates");
    row("build_and_inflate", cpu() - start, "ms");
    let n = tire.state.shell.q.len();
    let (q, zero) = (tire.state.shell.q.clone(), vec![0.0; n]);
    let loads = Loads { damping: spec.damping, pressure: spec.pressure };
    let (mut buffer, mut force, mut inertia) = (ForceBuffer::default(), vec![0.0; n], vec![0.0; n]);
    let mesh = tire.mesh.mesh.clone();
    let forces = timed(20, || mesh.forces(&loads, &q, &zero, &zero, &mut buffer, &mut force, &mut inertia));
    row("forces", forces, "ms");
    // Multiply-adds of an element: stress 1,024, strains and rates 2 x 174, gradient 300, pressure 220, inertia 192.
    row("forces_limit", 2084.0 * mesh.shells().len() as f64 / (1e6 * multiply_adds()), "ms");
    let weights = TangentWeights { stiffness: 0.8, velocity: 2.5e4, mass: 1.8e9, pressure: true, geometric: true };
    let fixed: Vec<[bool; 6]> = (0..mesh.node_count()).map(|i| [tire.mesh.on_rim(i); 6]).collect();
    let start = cpu();
    let mut assembly = Assembly::new(&mesh, &fixed, Precision::Single).expect("analysis");
    row("analysis", cpu() - start, "ms");
    row("assembly", timed(3, || assembly.assemble(&mesh, &loads, &q, &weights, &[])), "ms");
    row("factorisation", timed(2, || assembly.factorise().expect("regular")), "ms");
    let mut rhs = vec![1.0; assembly.len()];
    row("solve", timed(20, || assembly.solve(&mut rhs)), "ms");
    let entries = assembly.solver().entries();
    row("factor_entries", entries as f64, "1");
    // A solve streams the factor twice.
    row("solve_limit", 2.0 * stream(entries), "ms");
}

/// Billions of multiply-adds of f64 per second on one thread.
fn multiply_adds() -> f64 {
    struct Chains(f64);
    impl Kernel for Chains {
        type Output = f64;
        #[inline(always)]
        fn run<L: Lanes>(self) -> f64 {
            let mut chains = [L::splat(1.0); 6];
            let (a, b) = (L::splat(self.0), L::splat(1e-6));
            for _ in 0..20_000 {
                for c in &mut chains {
                    *c = c.fma(a, b);
                }
            }
            let mut out = [0.0; 8];
            let mut sum = chains[0];
            for c in &chains[1..] {
                sum += *c;
            }
            sum.store(&mut out);
            out[0]
        }
    }
    // The clock of a running thread ticks every few milliseconds.
    let ms = timed(1000, || terramech_simd::dispatch(terramech_simd::active(), Chains(black_box(0.999_999))));
    6.0 * 8.0 * 20_000.0 / (1e6 * ms)
}

/// Time to read so many f32 in order, ms.
fn stream(entries: usize) -> f64 {
    struct Sum<'a>(&'a [f32]);
    impl Kernel for Sum<'_> {
        type Output = f32;
        #[inline(always)]
        fn run<L: Lanes>(self) -> f32 {
            let mut sums = [0.0f32; 64];
            for chunk in self.0.chunks_exact(64) {
                for k in 0..64 {
                    sums[k] += chunk[k];
                }
            }
            sums.iter().sum()
        }
    }
    let data = vec![1.0f32; entries];
    timed(50, || terramech_simd::dispatch(terramech_simd::active(), Sum(black_box(&data))))
}

/// The wheel at a time: rolling from the beginning, lowered over 20 ms.
fn wheel(time: f64, radius: f64) -> RigidState {
    let ramp: f64 = (time / 0.02).min(1.0);
    let z = -DEFLECTION * ramp * ramp * (3.0 - 2.0 * ramp);
    let vz = if ramp < 1.0 { -DEFLECTION * 6.0 * ramp * (1.0 - ramp) / 0.02 } else { 0.0 };
    let omega = SPEED / (radius - 0.3 * DEFLECTION);
    RigidState {
        position: [SPEED * time, 0.0, z].into(),
        orientation: nalgebra::UnitQuaternion::from_scaled_axis([0.0, omega * time, 0.0].into()),
        velocity: [SPEED, 0.0, vz].into(),
        angular_velocity: [0.0, omega, 0.0].into(),
    }
}

fn rolling(spec: &FlexibleTire, threads: usize, steps: usize) {
    let mut tire = Tire::new(spec, Precision::Single).expect("the tire inflates");
    tire.set_team(&Team::new(threads).expect("threads"));
    let radius = tire.state.shell.q.chunks(6).map(|n| -n[2]).fold(0.0, f64::max);
    tire.state.plane = Some(Plane::horizontal(-radius - 1e-4));
    tire.place(&wheel(0.0, radius));
    let mut step = 0;
    let mut advance = |tire: &mut Tire, steps: usize| {
        for _ in 0..steps {
            tire.step(&wheel(step as f64 * STEP, radius), STEP, &[]).expect("the step converges");
            step += 1;
        }
    };
    advance(&mut tire, LOWERING);
    let saved = tire.save();
    let (clock, start, before) = (Instant::now(), cpu(), tire.cost());
    advance(&mut tire, steps);
    let per_step = |x: f64| x / steps as f64;
    row("ms_per_step", per_step(1e3 * clock.elapsed().as_secs_f64()), "ms");
    // With several threads, only what the calling one did.
    row("processor_ms_per_step", per_step(cpu() - start), "ms");
    let after = tire.cost();
    let cost = HhtCost {
        steps: after.steps - before.steps,
        iterations: after.iterations - before.iterations,
        factorisations: after.factorisations - before.factorisations,
    };
    row("iterations_per_step", per_step(cost.iterations as f64), "1");
    row("steps_per_factorisation", steps as f64 / cost.factorisations.max(1) as f64, "1");
    row("steps_per_second", steps as f64 / clock.elapsed().as_secs_f64(), "1/s");
    if threads == 1 {
        accuracy(spec, saved, radius);
    }
}

/// The same run with Newton converged to round-off: differences of positions and wrench.
fn accuracy(spec: &FlexibleTire, saved: SavedTire, radius: f64) {
    let run = |tolerance: f64| {
        let mut spec = spec.clone();
        spec.integrator.tolerance = tolerance;
        spec.integrator.iterations = 40;
        let mut tire = Tire::new(&spec, Precision::Single).expect("the tire inflates");
        tire.restore(saved.clone()).expect("the same mesh");
        let mut step = |k: usize| tire.step(&wheel((LOWERING + k) as f64 * STEP, radius), STEP, &[]);
        let wrenches: Vec<Wrench> = (0..COMPARED).map(|k| step(k).expect("the step converges")).collect();
        (wrenches, tire.state.shell.q)
    };
    let (w, q) = run(spec.integrator.tolerance);
    let (reference, q_reference) = run(1e-13);
    let apart = q
        .chunks_exact(6)
        .zip(q_reference.chunks_exact(6))
        .map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt())
        .fold(0.0, f64::max);
    let square: f64 = w.iter().zip(&reference).map(|(a, b)| (a.force - b.force).norm_squared()).sum();
    let mean = reference.iter().map(|w| w.force.norm()).sum::<f64>() / COMPARED as f64;
    row("position_error", apart, "m");
    row("force_error_rms", (square / COMPARED as f64).sqrt() / mean, "1");
}
