//! A bed as large as the source paper's: how long it takes to come to rest, and what a step costs with four wheels on it, with and
//! without sleep.
//!
//! `cargo run --release -p fmu-terrain --example bench_large -- [--length M] [--width M] [--tile M] [--depth M] [--steps N] [--threads N]`;
//! default 20 x 3.6 m, 0.155 m deep, r 12 mm: 923,000 grains. Times are processor time of all threads (s), and by the clock.

use fmu_terrain::dem::{
    Adhesion, Body, CpuEngine, Cylinder, Fill, GrainEngine, Material, Radii, Recipe, Sample, Settle, Setup, Sleep,
    Surface, Wall, prepare,
};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut length, mut width, mut tile, mut depth) = (20.0, 3.6, 0.5, 0.155);
    let (mut steps, mut threads) = (400_u32, 2);
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let value = args.next().ok_or(format!("{arg} needs a value"))?;
        match arg.as_str() {
            "--length" => length = value.parse()?,
            "--width" => width = value.parse()?,
            "--tile" => tile = value.parse()?,
            "--depth" => depth = value.parse()?,
            "--steps" => steps = value.parse()?,
            "--threads" => threads = value.parse()?,
            _ => return Err(format!("'{arg}' is unknown").into()),
        }
    }
    let radii = Radii::Equal(0.012);
    let fill = Fill::Depth(depth);
    let sample = Sample { length, width, fill, radii, density: 2500.0, material: 0, seed: 1, spacing: 1.02 };
    // As the published studies: what a bed costs does not depend on how well it rests.
    let settle = Settle { energy: 1e-3, least_time: 0.1, most_time: 3.0 };
    let recipe = Recipe { tile: Some(tile), ..Recipe::new(sample, settle, 0.1) };
    let soil = Material { adhesion: Adhesion { pressure: 1e5, ..Adhesion::default() }, ..Material::default() };
    let setup = Setup {
        step: 3.5e-5,
        materials: vec![soil],
        walls: Wall::open_box(length, width, 0, 0),
        expected_overlap: 0.15,
        ..Setup::default()
    };
    let (clock, cpu) = (Instant::now(), cpu_seconds());
    let mut told = (String::new(), clock, cpu);
    let mut phases = Vec::new();
    let (engine, report) = prepare(setup.clone(), &recipe, threads, &mut |phase, _| {
        if told.0 != phase {
            phases.push((told.0.clone(), told.1.elapsed().as_secs_f64(), cpu_seconds() - told.2));
            told = (phase.to_string(), Instant::now(), cpu_seconds());
        }
        true
    })?;
    phases.push((told.0.clone(), told.1.elapsed().as_secs_f64(), cpu_seconds() - told.2));
    for (phase, clock, cpu) in phases.iter().filter(|p| !p.0.is_empty()) {
        println!("{phase:32} {clock:8.1} s by the clock, {cpu:8.1} s of processors");
    }
    println!(
        "bed of {} grains, {:.4} m high, {:.0} bytes a grain: {:.1} s by the clock, {:.1} s of processors",
        report.grains,
        report.height,
        engine.memory() as f64 / report.grains as f64,
        clock.elapsed().as_secs_f64(),
        cpu_seconds() - cpu
    );
    let height = Surface::of(engine.state(), length, width).mean();
    let state = engine.state().clone();
    drop(engine);
    for sleep in [None, Some(0.5), Some(0.3)] {
        let sleep = sleep.map(|distance| Sleep { distance, energy: 1e-4 });
        let mut engine = CpuEngine::with_state(Setup { sleep, ..setup.clone() }, state.clone(), threads)?;
        // As long as it takes for the lists to be made anew once or twice.
        let mut done = 0;
        for (k, count) in [(0, 300), (1, steps)] {
            let (clock, cpu) = (Instant::now(), cpu_seconds());
            let mut bodies = wheels(-0.25 * length + 5.0 * 3.5e-5 * f64::from(done), height);
            engine.advance(count, &mut bodies)?;
            done += count;
            if k == 1 {
                let n = f64::from(count);
                println!(
                    "sleep beyond {:>4}: {:5.1} % asleep, {:8.3} ms of processors a step ({:.1} ns a grain), {:8.3} ms by the clock, {:.1} s of processors for a second",
                    sleep.map_or("none".into(), |s| s.distance.to_string()),
                    100.0 * engine.state().asleep(),
                    1e3 * (cpu_seconds() - cpu) / n,
                    1e9 * (cpu_seconds() - cpu) / n / report.grains as f64,
                    1e3 * clock.elapsed().as_secs_f64() / n,
                    (cpu_seconds() - cpu) / n / 3.5e-5,
                );
            }
        }
    }
    Ok(())
}

/// Four wheels as far apart as a vehicle's, at 5 m/s, 4 mm deep: they are there at once, and much more would push two grains into each other by half a radius.
fn wheels(x: f64, height: f64) -> Vec<Body> {
    let wheel = |dx: f64, y: f64| {
        let at = [x + dx, y, height + 0.466];
        Body::new(Box::new(Cylinder::new(0.47, 0.25, at, [0.0, 1.0, 0.0], [5.0, 0.0, 0.0], [0.0, 11.0, 0.0])), 0)
    };
    vec![wheel(1.65, 0.9), wheel(1.65, -0.9), wheel(-1.65, 0.9), wheel(-1.65, -0.9)]
}

/// Processor time of this process, threads that have ended included (s), in hundredths: ticks of Linux.
fn cpu_seconds() -> f64 {
    let Ok(stat) = std::fs::read_to_string("/proc/self/stat") else { return 0.0 };
    // Behind the name, which may hold spaces: user and system time are the 12th and 13th.
    let behind = stat.rsplit(')').next().unwrap_or_default();
    behind.split_whitespace().skip(11).take(2).filter_map(|t| t.parse::<f64>().ok()).sum::<f64>() / 100.0
}
