//! Speed of the granular engine: grain-steps per second in a settled bed that a wheel drives through.
//!
//! `cargo run --release -p fmu-terrain --example bench_bed -- [--beds DIR] [--threads 1,2] [--team N] [--json] [--skin S] [grains ...]`;
//! default 20000 100000 on 1 and 2 threads. `--beds` keeps settled beds, and writes them as data files for LAMMPS too.
//! Rates are wall-clock; the processor-time rate (grain-steps per second of one processor) is what to compare where
//! other work runs on the machine. `cargo xtask bench dem` runs this next to LAMMPS. `--team` spreads the bed over members with one thread each, and counts what they tell each other
//! (`cargo xtask bench mpi`).

use fmu_terrain::dem::spread::{Links, Message, team_of_threads};
use fmu_terrain::dem::{
    Body, CpuEngine, Cylinder, DemError, DemState, Fill, Grain, GrainEngine, Material, Precision, Radii, Recipe,
    Sample, Settle, Setup, Surface, Wall, prepare,
};
use std::fmt::Write as _;
use std::io::IsTerminal as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

const RADIUS: f64 = 0.012;
const DENSITY: f64 = 2500.0;

fn main() -> Outcome<()> {
    let (mut sizes, mut threads, mut beds, mut json, mut mixed) = (Vec::new(), vec![1, 2], None, false, false);
    let mut skin = Setup::default().skin;
    let mut members = 0;
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--beds" => beds = args.next(),
            "--json" => json = true,
            "--mixed" => mixed = true,
            "--team" => members = args.next().unwrap_or_default().parse()?,
            "--skin" => skin = args.next().unwrap_or_default().parse()?,
            "--threads" => {
                threads = args.next().unwrap_or_default().split(',').map(str::parse).collect::<Result<_, _>>()?;
            }
            n => sizes.push(n.parse().map_err(|e| format!("grains '{n}': {e}"))?),
        }
    }
    if sizes.is_empty() {
        sizes = vec![20_000, 100_000];
    }
    if !json {
        println!(
            "grains  threads  Mgrain-steps/s  per processor s  best slice  contacts/grain  listed/grain  rebuilt every  bytes/grain"
        );
    }
    if members > 0 {
        return sizes.iter().try_for_each(|&n| bench_team(n, members, beds.as_deref().map(Path::new), skin));
    }
    for n in sizes {
        bench(n, &threads, beds.as_deref().map(Path::new), json, skin, mixed)?;
    }
    Ok(())
}

/// Length and width of the reference bed [m]: about 0.3 m deep.
fn base(n: usize) -> (f64, f64) {
    let area = n as f64 * 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3) / 0.58 / 0.3;
    ((2.5 * area).sqrt(), (area / 2.5).sqrt())
}

/// The bed of the reference figures: r 12 mm, rho 2500, E 1e7, nu .3, mu .9, e .2, h 4e-5.
fn setup(n: usize) -> Setup {
    let (length, width) = base(n);
    Setup { materials: vec![Material::default()], walls: Wall::open_box(length, width, 0, 0), ..Setup::default() }
}

fn bench(n: usize, threads: &[usize], beds: Option<&Path>, json: bool, skin: f64, mixed: bool) -> Outcome<()> {
    let (length, width) = base(n);
    let grains = settled(n, beds)?;
    let precision = if mixed { Precision::Single } else { Precision::Double };
    for &threads in threads {
        let mut engine = CpuEngine::new(Setup { skin, precision, ..setup(n) }, &grains, threads)?;
        let height = Surface::of(engine.state(), length, width).mean();
        // The wheel is pressed in over 0.04 s, then driven at slip 1/3.
        let wheel = |centre, vx: f64, vz, w| {
            let cylinder = Cylinder::new(0.4, 0.25, centre, [0.0, 1.0, 0.0], [vx, 0.0, vz], [0.0, w, 0.0]);
            [Body::new(Box::new(cylinder), 0)]
        };
        let x = -0.25 * length;
        let h = engine.setup().step;
        engine.advance(1000, &mut wheel([x, 0.0, height + 0.4], 0.0, -0.5, 0.0))?;
        let mut bodies = wheel([x, 0.0, height + 0.38], 1.0, 0.0, 1.5 / 0.4);
        engine.advance(100, &mut bodies)?;
        let (before, steps) = (engine.state().rebuilds, (20_000_000 / n).clamp(50, 2000) as u32);
        let (start, cpu) = (Instant::now(), cpu_seconds());
        // In slices: the best of them is what the program can do where other work on the machine disturbs the mean.
        let slices = 20.min(steps);
        let mut best = 0.0_f64;
        let mut done = 0;
        for k in 1..=slices {
            let now = steps * k / slices;
            let before = cpu_seconds();
            let mut bodies = wheel([x + f64::from(100 + done) * h, 0.0, height + 0.38], 1.0, 0.0, 1.5 / 0.4);
            engine.advance(now - done, &mut bodies)?;
            best = best.max(n as f64 * f64::from(now - done) / 1e6 / (cpu_seconds() - before));
            done = now;
        }
        let work = n as f64 * f64::from(steps) / 1e6;
        let (rate, per_cpu) = (work / start.elapsed().as_secs_f64(), work / (cpu_seconds() - cpu));
        let s = engine.state();
        let contacts = s.grain_contacts() as f64 / n as f64;
        let every = f64::from(steps) / (s.rebuilds - before).max(1) as f64;
        let listed = s.slabs.iter().map(|s| s.other.len()).sum::<usize>() as f64 / n as f64;
        let bytes = engine.memory() as f64 / n as f64;
        if json {
            println!(
                "{{\"grains\":{n},\"threads\":{threads},\"rate\":{rate:.4},\"per_cpu\":{per_cpu:.4},\"best\":{best:.4},\
                 \"contacts\":{contacts:.4},\"every\":{every:.2},\"bytes\":{bytes:.1}}}"
            );
        } else {
            println!(
                "{n:6}  {threads:7}  {rate:14.2}  {per_cpu:15.2}  {best:10.2}  {contacts:14.2}  {listed:12.2}  {every:13.1}  {bytes:11.0}"
            );
        }
    }
    Ok(())
}

/// Links that count messages and bytes.
struct Counted {
    links: Box<dyn Links>,
    messages: Arc<AtomicU64>,
    bytes: Arc<AtomicU64>,
}

impl Links for Counted {
    fn index(&self) -> usize {
        self.links.index()
    }
    fn size(&self) -> usize {
        self.links.size()
    }
    fn round(&mut self, out: Vec<Message>, from: &[usize]) -> Result<Vec<Vec<u8>>, DemError> {
        self.messages.fetch_add(out.len() as u64, Ordering::Relaxed);
        self.bytes.fetch_add(out.iter().map(|m| m.1.len() as u64).sum(), Ordering::Relaxed);
        self.links.round(out, from)
    }
}

/// The same bed and wheel over members of a team, as threads of this process.
fn bench_team(n: usize, members: usize, beds: Option<&Path>, skin: f64) -> Outcome<()> {
    let (length, width) = base(n);
    let grains = settled(n, beds)?;
    let setup = Setup { skin, ..setup(n) };
    let state = DemState::of(&grains, setup.walls.len());
    let height = Surface::of(&state, length, width).mean();
    let (messages, bytes) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0)));
    let steps = (20_000_000 / n).clamp(50, 2000) as u32;
    let member = |links: Box<dyn Links>| -> Result<(f64, f64, [u64; 2], u32), DemError> {
        let links = Box::new(Counted { links, messages: Arc::clone(&messages), bytes: Arc::clone(&bytes) });
        let mut engine = CpuEngine::spread(setup.clone(), &state, links, 1)?;
        let wheel = |centre, vx: f64, vz, w| {
            let cylinder = Cylinder::new(0.4, 0.25, centre, [0.0, 1.0, 0.0], [vx, 0.0, vz], [0.0, w, 0.0]);
            [Body::new(Box::new(cylinder), 0)]
        };
        // In the middle, over the cut.
        let x = -0.5;
        engine.advance(1000, &mut wheel([x, 0.0, height + 0.4], 0.0, -0.5, 0.0))?;
        engine.advance(100, &mut wheel([x, 0.0, height + 0.38], 1.0, 0.0, 1.5 / 0.4))?;
        let count = || [messages.load(Ordering::Relaxed), bytes.load(Ordering::Relaxed)];
        let (before, start, cpu) = (count(), Instant::now(), cpu_seconds());
        engine.advance(steps, &mut wheel([x + 0.004, 0.0, height + 0.38], 1.0, 0.0, 1.5 / 0.4))?;
        let after = count();
        let (clock, processor) = (start.elapsed().as_secs_f64(), cpu_seconds() - cpu);
        let ghosts = engine.state().slabs.last().map_or(0, |s| s.halo - s.last);
        Ok((clock, processor, [after[0] - before[0], after[1] - before[1]], ghosts))
    };
    let told = std::thread::scope(|scope| {
        let member = &member;
        let all: Vec<_> = team_of_threads(members).into_iter().map(|l| scope.spawn(move || member(l))).collect();
        all.into_iter().map(|m| m.join()).next()
    });
    let Some(Ok(told)) = told else { return Err("a member has panicked".into()) };
    let (clock, processor, [messages, bytes], ghosts) = told?;
    let (work, steps) = (n as f64 * f64::from(steps) / 1e6, f64::from(steps));
    println!(
        "{{\"grains\":{n},\"members\":{members},\"rate\":{:.4},\"per_cpu\":{:.4},\"messages\":{:.2},\"bytes\":{:.0},\"ghosts\":{ghosts}}}",
        work / clock,
        work / processor,
        messages as f64 / steps,
        bytes as f64 / steps
    );
    Ok(())
}

/// Grains of the settled bed: from the folder `beds`, or made (and kept there).
fn settled(n: usize, beds: Option<&Path>) -> Outcome<Vec<Grain>> {
    let file = beds.map(|dir| dir.join(format!("bed-{n}.f64")));
    if let Some(bytes) = file.as_ref().and_then(|f| std::fs::read(f).ok()) {
        let reals: Vec<f64> = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("8"))).collect();
        let grain = |x: &[f64]| Grain {
            velocity: [x[3], x[4], x[5]],
            angular_velocity: [x[6], x[7], x[8]],
            ..Grain::at([x[0], x[1], x[2]], RADIUS, DENSITY)
        };
        return Ok(reals.chunks_exact(9).map(grain).collect());
    }
    let (length, width) = base(n);
    let fill = Fill::Count(n);
    let radii = Radii::Equal(RADIUS);
    let sample = Sample { length, width, fill, radii, density: DENSITY, material: 0, seed: 1, spacing: 1.02 };
    let settle = Settle { energy: 1e-3, least_time: 0.1, most_time: 2.0 };
    let recipe = Recipe::new(sample, settle, 0.0);
    let (engine, _) = prepare(setup(n), &recipe, 2, &mut |what, done| {
        if std::io::stderr().is_terminal() {
            eprint!("\r{n} grains: {what} {:3.0} % ", 100.0 * done);
        }
        true
    })?;
    eprintln!("{}{n} grains: the bed is made", if std::io::stderr().is_terminal() { "\r" } else { "" });
    let state = engine.state();
    let rows: Vec<_> = state.by_id().iter().map(|&i| state.rows[i as usize]).collect();
    if let (Some(file), Some(dir)) = (&file, beds) {
        std::fs::create_dir_all(dir)?;
        let reals = rows.iter().flat_map(|r| [r[0], r[1], r[2], r[4], r[5], r[6], r[8], r[9], r[10]]);
        std::fs::write(file, reals.flat_map(f64::to_le_bytes).collect::<Vec<_>>())?;
        std::fs::write(dir.join(format!("bed-{n}.data")), lammps_data(n, &rows)?)?;
    }
    Ok(rows
        .iter()
        .map(|r| Grain {
            velocity: [r[4], r[5], r[6]],
            angular_velocity: [r[8], r[9], r[10]],
            ..Grain::at([r[0], r[1], r[2]], RADIUS, DENSITY)
        })
        .collect())
}

/// The bed as a LAMMPS data file, `atom_style sphere`.
fn lammps_data(n: usize, rows: &[fmu_terrain::dem::grains::Row]) -> Outcome<String> {
    let (length, width) = base(n);
    let top = rows.iter().fold(0.0_f64, |m, r| m.max(r[2])) + 0.2;
    let mut text = format!("settled bed\n\n{n} atoms\n1 atom types\n\n");
    for (axis, [low, high]) in
        [("x", [-0.5 * length, 0.5 * length]), ("y", [-0.5 * width, 0.5 * width]), ("z", [0.0, top])]
    {
        writeln!(text, "{low} {high} {axis}lo {axis}hi")?;
    }
    text.push_str("\nAtoms # sphere\n\n");
    for (k, r) in rows.iter().enumerate() {
        writeln!(text, "{} 1 {} {DENSITY} {} {} {}", k + 1, 2.0 * RADIUS, r[0], r[1], r[2])?;
    }
    text.push_str("\nVelocities\n\n");
    for (k, r) in rows.iter().enumerate() {
        writeln!(text, "{} {} {} {} {} {} {}", k + 1, r[4], r[5], r[6], r[8], r[9], r[10])?;
    }
    Ok(text)
}

/// Processor time of all threads of this process [s], to the nanosecond where the kernel tells it.
fn cpu_seconds() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let nanoseconds = |p: std::path::PathBuf| std::fs::read_to_string(p.join("schedstat")).ok();
    tasks.flatten().filter_map(|t| nanoseconds(t.path())?.split_whitespace().next()?.parse::<f64>().ok()).sum::<f64>()
        * 1e-9
}
