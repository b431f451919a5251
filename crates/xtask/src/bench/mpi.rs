//! `cargo xtask bench mpi`: the single wheel in one process against two ranks: what the exchange between processes costs.
//!
//! The terrain alone on rank 0, rig and wheel on rank 1, one thread each; the same bed and steps in one process with one thread. The exchange is what rank 0 spends on it: packing, and
//! waiting for the message of the other rank, which has next to nothing to compute. The results of both runs must be the same bits.
//!
//! Then a bed of 100,000 grains that a wheel drives through, on two cores: one engine with two threads beside a team of two members with one each; what the members tell each other; and from that a model of many
//! members (`scaling.rs`), written to `docs/benchmarks/mpi-scaling.md`.

use super::Row;
use super::scaling::{Measured, write};
use crate::mpi::{build, missing, mpirun};
use crate::process::{cargo, fmus, root, run, target};
use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::Command;

/// Simulated time (s), long enough that the wheel sinks in and drives.
const TIME: &str = "0.4";
/// Part of the wall time that the publication lost to the exchange, and our target.
const PUBLISHED: f64 = 0.05;
const TARGET: f64 = 0.01;

/// Wall times of a run (s), and the steps of the terrain.
struct Timed {
    run: f64,
    exchange: f64,
    terrain: f64,
    steps: f64,
}

/// Runs it.
///
/// # Errors
/// No MPI here, a run that fails, results that differ.
pub fn mpi() -> Result<Vec<Row>> {
    if let Some(missing) = missing() {
        bail!("this benchmark needs MPI: {missing}");
    }
    let with_mpi = build()?;
    crate::pack::pack()?;
    let folder = target().join("bench/mpi");
    std::fs::create_dir_all(&folder)?;
    let bed = folder.join("wheel.bed");
    let save = format!("terrain.bed_save={}", bed.display());
    run(Command::new(target().join("release/terramech")).args(arguments(&folder.join("bed"), "0.0002", &save)))?;
    let load = format!("terrain.bed_load={}", bed.display());
    let (alone, ranks) = (folder.join("alone"), folder.join("ranks"));
    run(Command::new(target().join("release/terramech")).args(arguments(&alone, TIME, &load)))?;
    let mut placed = mpirun(2);
    placed.arg(with_mpi).args(arguments(&ranks, TIME, &load));
    run(placed.args(["--place", "terrain=0", "--place", "rig=1", "--place", "tire=1"]))?;
    for name in ["results.csv", "summary.json"] {
        if std::fs::read(alone.join(name))? != std::fs::read(ranks.join(name))? {
            bail!("{name} of two ranks differs from that of one process");
        }
    }
    let (one, two) = (timed(&alone)?, timed(&ranks)?);
    let row = |name: &str, value: f64, unit: &'static str, ratio: Option<f64>| Row {
        name: format!("mpi.single-wheel.{name}"),
        value,
        unit,
        ratio,
    };
    let share = two.exchange / two.run;
    let mut rows = vec![
        row("exchange_share", share, "1", Some(share / TARGET)),
        row("exchange_us_per_step", 1e6 * two.exchange / two.steps, "us", None),
        row("published_over_ours", PUBLISHED / share, "1", None),
        row("in_process_us_per_step", 1e6 * one.exchange / one.steps, "us", None),
        row("terrain_us_per_step", 1e6 * two.terrain / two.steps, "us", None),
        row("wall_ratio", two.run / one.run, "1", None),
    ];
    rows.extend(spread()?);
    Ok(rows)
}

/// Grains of the bed.
const GRAINS: usize = 100_000;
/// Aim for what spreading costs, over one engine on as many cores.
const AIM: f64 = 0.1;

fn spread() -> Result<Vec<Row>> {
    run(&mut cargo(["build", "--release", "--quiet", "--workspace", "--example", "bench_bed"]))?;
    let beds = target().join("bench/beds");
    let measure = |more: &[&str]| -> Result<serde_json::Value> {
        let mut command = Command::new(target().join("release/examples/bench_bed"));
        command.arg("--beds").arg(&beds).args(more).arg(GRAINS.to_string()).stderr(std::process::Stdio::inherit());
        let out = command.output()?;
        let text = String::from_utf8_lossy(&out.stdout).into_owned();
        if !out.status.success() {
            bail!("bench_bed {} failed ({})", more.join(" "), out.status);
        }
        let line = text.lines().last().unwrap_or_default();
        serde_json::from_str(line).with_context(|| format!("bench_bed printed '{line}'"))
    };
    // The better of two each, in turn: other work on the machine makes either look worse.
    let (mut shared, mut team) = (Vec::new(), Vec::new());
    for _ in 0..2 {
        shared.push(measure(&["--json", "--threads", "2"])?);
        team.push(measure(&["--team", "2"])?);
    }
    let best = |runs: &[serde_json::Value], key: &str| -> Result<f64> {
        let values = runs.iter().map(|v| v[key].as_f64().with_context(|| format!("bench_bed printed no '{key}'")));
        Ok(values.collect::<Result<Vec<f64>>>()?.into_iter().fold(0.0, f64::max))
    };
    let (one, two) = (best(&shared, "rate")?, best(&team, "rate")?);
    let overhead = one / two - 1.0;
    let (bytes, messages) = (best(&team, "bytes")?, best(&team, "messages")?);
    // Looked at behind the one cut: a layer of cells of the bed of `bench_bed`.
    let ghosts = best(&team, "ghosts")?;
    let row = |name: &str, value: f64, unit: &'static str, ratio: Option<f64>| Row {
        name: format!("mpi.spread.100k.{name}"),
        value,
        unit,
        ratio,
    };
    let measured = Measured { rate: 1e6 * best(&team, "per_cpu")?, bytes: 120.0 };
    write(&root().join("docs/benchmarks"), &measured)?;
    Ok(vec![
        row("rate", two, "Mgrain-steps/s", Some(two / one)),
        row("shared_rate", one, "Mgrain-steps/s", None),
        row("overhead", overhead, "1", Some(overhead / AIM)),
        row("per_processor", best(&team, "per_cpu")?, "Mgrain-steps/s", None),
        row("messages_per_step", messages, "1", None),
        row("bytes_per_step", bytes, "B", None),
        row("grains_at_the_cut", ghosts, "1", None),
        row("bytes_per_step_and_grain_at_the_cut", bytes / ghosts, "B", None),
    ])
}

fn arguments(out: &Path, stop: &str, set: &str) -> Vec<String> {
    let path = |p: &Path| p.display().to_string();
    let system = path(&root().join("examples/single-wheel/system.ssd"));
    let words = ["run", &system, "--fmu-path", &path(&fmus()), "--out", &path(out), "--stop-time", stop, "--set", set];
    let more = ["--threads", "1", "--quiet"];
    words.into_iter().chain(more).map(str::to_owned).collect()
}

fn timed(out: &Path) -> Result<Timed> {
    let manifest = terramech_results::Manifest::read(out.join("manifest.json"))?;
    let t = &manifest.timings;
    let terrain = t.units.iter().find(|u| u.name == "terrain").context("manifest without the terrain")?;
    let exchange = t.coupling_seconds + t.waiting_seconds;
    Ok(Timed { run: t.run_seconds, exchange, terrain: terrain.seconds, steps: terrain.calls as f64 })
}
