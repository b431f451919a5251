//! Cost and convergence of the complementarity engine: a settled bed at rest, then a wheel that drives through it.
//!
//! `cargo run --release -p fmu-terrain --example bench_cone -- --beds DIR [--threads 2] [--method relaxation|nesterov|bb|gs] [--tolerance 1e-3]
//! [--iterations 500] [--steps 50] [--step 1e-3] [--rolling 0] [--young 1e7] [--rigid] [--json] [grains ...]`; default 20000 and 100000 grains. DIR is where the example
//! `bench_bed` leaves its settled beds: r 12 mm, rho 2500, mu .9. The wheel is that of `bench_bed`: radius 0.4 m, pressed in by 20 mm, 1 m/s, slip 1/3.
//! `cargo xtask bench dem-c` runs this.

use fmu_terrain::dem::{Body, Cylinder, Grain, GrainEngine, Material, Setup, Surface, Wall};
use fmu_terrain::dem_c::{ConeEngine, ConeSetup, ConeState};
use std::path::Path;
use std::time::Instant;
use terramech_mechanics::cone::Method;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

const RADIUS: f64 = 0.012;
const DENSITY: f64 = 2500.0;

/// What the command line says.
struct Args {
    beds: String,
    threads: usize,
    step: f64,
    steps: u32,
    rolling: f64,
    young: f64,
    json: bool,
    cone: ConeSetup,
}

/// Figures of some steps.
#[derive(Default)]
struct Sum {
    steps: f64,
    iterations: f64,
    contacts: f64,
    residual: f64,
    worst: f64,
    unconverged: f64,
    clock: f64,
    processor: f64,
}

fn main() -> Outcome<()> {
    let mut a = Args {
        beds: "target/bench/beds".into(),
        threads: 2,
        step: 1e-3,
        steps: 50,
        rolling: 0.0,
        young: 1e7,
        json: false,
        cone: ConeSetup { iterations: 500, ..ConeSetup::default() },
    };
    let mut sizes: Vec<usize> = Vec::new();
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut next = || args.next().ok_or(format!("{arg} wants a value"));
        match arg.as_str() {
            "--beds" => a.beds = next()?,
            "--threads" => a.threads = next()?.parse()?,
            "--step" => a.step = next()?.parse()?,
            "--steps" => a.steps = next()?.parse()?,
            "--rolling" => a.rolling = next()?.parse()?,
            "--tolerance" => a.cone.tolerance = next()?.parse()?,
            "--iterations" => a.cone.iterations = next()?.parse()?,
            "--rigid" => a.cone.elastic = false,
            "--young" => a.young = next()?.parse()?,
            "--json" => a.json = true,
            "--method" => {
                a.cone.method = match next()?.as_str() {
                    "relaxation" => Method::Relaxation,
                    "nesterov" => Method::Nesterov,
                    "bb" => Method::BarzilaiBorwein,
                    "gs" => Method::GaussSeidel,
                    other => return Err(format!("method '{other}': relaxation, nesterov, bb or gs").into()),
                }
            }
            n => sizes.push(n.parse().map_err(|e| format!("grains '{n}': {e}"))?),
        }
    }
    if sizes.is_empty() {
        sizes = vec![20_000, 100_000];
    }
    for n in sizes {
        bench(n, &a)?;
    }
    Ok(())
}

/// Length and width of the reference bed (m): about 0.3 m deep.
fn base(n: usize) -> (f64, f64) {
    let area = n as f64 * 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3) / 0.58 / 0.3;
    ((2.5 * area).sqrt(), (area / 2.5).sqrt())
}

fn bed(n: usize, a: &Args) -> Outcome<ConeEngine> {
    let file = Path::new(&a.beds).join(format!("bed-{n}.f64"));
    let bytes = std::fs::read(&file).map_err(|e| format!("{}: {e}; the example bench_bed makes it", file.display()))?;
    let reals: Vec<f64> = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("8"))).collect();
    let grain = |x: &[f64]| Grain::at([x[0], x[1], x[2]], RADIUS, DENSITY);
    let grains: Vec<Grain> = reals.chunks_exact(9).map(grain).collect();
    let (length, width) = base(n);
    let material = Material {
        young_modulus: a.young,
        rolling_friction: a.rolling,
        spinning_friction: 0.5 * a.rolling,
        ..Material::default()
    };
    let setup = Setup {
        step: a.step,
        materials: vec![material],
        walls: Wall::open_box(length, width, 0, 0),
        ..Setup::default()
    };
    let state = fmu_terrain::dem::DemState::of(&grains, setup.walls.len());
    Ok(ConeEngine::with_state(setup, a.cone, state, ConeState::default(), a.threads)?)
}

fn run(engine: &mut ConeEngine, steps: u32, mut bodies: impl FnMut(u32) -> Vec<Body>) -> Outcome<Sum> {
    let mut s = Sum::default();
    for k in 0..steps {
        let mut bodies = bodies(k);
        let (start, cpu) = (Instant::now(), cpu_seconds());
        engine.advance(1, &mut bodies)?;
        s.clock += start.elapsed().as_secs_f64();
        s.processor += cpu_seconds() - cpu;
        let r = engine.report();
        s.steps += 1.0;
        s.iterations += f64::from(r.outcome.iterations);
        s.contacts += r.contacts as f64;
        s.residual += r.outcome.residual;
        s.worst = s.worst.max(r.outcome.residual);
        s.unconverged += f64::from(!r.outcome.converged);
    }
    Ok(s)
}

fn bench(n: usize, a: &Args) -> Outcome<()> {
    let mut engine = bed(n, a)?;
    let (length, width) = base(n);
    let tell = |case: &str, s: &Sum| {
        let mean = |x: f64| x / s.steps;
        if a.json {
            println!(
                "{{\"grains\":{n},\"threads\":{},\"case\":\"{case}\",\"contacts\":{:.0},\"iterations\":{:.3},\"residual\":{:.3e},\
                 \"worst\":{:.3e},\"unconverged\":{},\"ms_per_step\":{:.4},\"cpu_ms_per_step\":{:.4}}}",
                a.threads,
                mean(s.contacts),
                mean(s.iterations),
                mean(s.residual),
                s.worst,
                s.unconverged,
                1e3 * mean(s.clock),
                1e3 * mean(s.processor),
            );
        } else {
            println!(
                "{n} grains, {} threads, {case}: {:.0} contacts, {:.1} iterations, residual {:.1e} (worst {:.1e}) m/s, {} of {} steps above the \
                 tolerance, {:.1} ms a step ({:.1} ms of processors)",
                a.threads,
                mean(s.contacts),
                mean(s.iterations),
                mean(s.residual),
                s.worst,
                s.unconverged,
                s.steps,
                1e3 * mean(s.clock),
                1e3 * mean(s.processor),
            );
        }
    };
    // The bed of soft grains comes to rest as rigid ones.
    let start = run(&mut engine, 60, |_| Vec::new())?;
    tell("begin", &start);
    let rest = run(&mut engine, a.steps, |_| Vec::new())?;
    tell("settled", &rest);
    let height = Surface::of(engine.state(), length, width).mean();
    let wheel = |centre, vx: f64, vz, w| {
        vec![Body::new(Box::new(Cylinder::new(0.4, 0.25, centre, [0.0, 1.0, 0.0], [vx, 0.0, vz], [0.0, w, 0.0])), 0)]
    };
    let (x, h) = (-0.25 * length, a.step);
    let press = (0.04 / h).round() as u32;
    let down = run(&mut engine, press, |k| wheel([x, 0.0, height + 0.4 - 0.5 * h * f64::from(k)], 0.0, -0.5, 0.0))?;
    tell("pressed", &down);
    let drive = run(&mut engine, a.steps, |k| wheel([x + h * f64::from(k), 0.0, height + 0.38], 1.0, 0.0, 1.5 / 0.4))?;
    tell("driven", &drive);
    // The same steps with few and with many iterations: what one costs, whatever a step costs beside.
    let fixed = |iterations: u32| -> Outcome<Sum> {
        let cone = ConeSetup { iterations, tolerance: 1e-30, ..a.cone };
        let (setup, state) = (engine.setup().clone(), engine.state().clone());
        run(&mut ConeEngine::with_state(setup, cone, state, engine.cone_state(), a.threads)?, 8, |_| Vec::new())
    };
    let (few, many) = (fixed(4)?, fixed(40)?);
    let per = |x: f64, y: f64| 1e3 * (y - x) / (many.iterations - few.iterations);
    let (clock, processor) = (per(few.clock, many.clock), per(few.processor, many.processor));
    let contacts = many.contacts / many.steps;
    if a.json {
        println!(
            "{{\"grains\":{n},\"threads\":{},\"case\":\"fixed\",\"contacts\":{contacts:.0},\"ms_per_iteration\":{clock:.5},\
             \"cpu_ms_per_iteration\":{processor:.5}}}",
            a.threads
        );
    } else {
        println!(
            "{n} grains, {} threads: {clock:.3} ms an iteration, {processor:.3} ms of processors, {:.1} ns of a processor per contact",
            a.threads,
            1e6 * processor / contacts
        );
    }
    Ok(())
}

/// Processor time of all threads of this process (s), to the nanosecond where the kernel tells it.
fn cpu_seconds() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let nanoseconds = |p: std::path::PathBuf| std::fs::read_to_string(p.join("schedstat")).ok();
    tasks.flatten().filter_map(|t| nanoseconds(t.path())?.split_whitespace().next()?.parse::<f64>().ok()).sum::<f64>()
        * 1e-9
}
