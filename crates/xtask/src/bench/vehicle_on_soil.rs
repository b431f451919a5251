//! `cargo xtask bench vehicle-on-soil`: the obstacle study as published, per simulated second.
//!
//! The bed of 923,000 grains is made once and kept in the build folder. The vehicle starts on its tires at 3 m/s, so that all of it rolls from the first
//! step; the first steps, in which soil far from it falls asleep, are not counted: two runs, of which the shorter is taken off. Parallel to the clock the
//! time of each unit's calls tells which one bounds the step.

use super::Row;
use crate::process::{fmus, root, run, target};
use anyhow::{Context, Result};
use std::path::Path;
use std::process::Command;

/// The study's step (s).
const STEP: f64 = 3.5e-5;
/// Steps of the two runs.
const STEPS: [u32; 2] = [600, 1200];
/// Target, and the publication: 474,000 s for 7.64 s on 20 cores (s/s).
const TARGET: f64 = 2500.0;
const PUBLISHED: f64 = 62_042.0;
const VEHICLE: &str = r#"{"vehicle": "hmmwv/vehicle_2550.json", "start": {"x": -3, "speed": 3, "clearance": -0.01}}"#;
const UNITS: [&str; 6] = ["vehicle", "tire1", "tire2", "tire3", "tire4", "terrain"];

/// Runs it.
///
/// # Errors
/// A build or a run that fails.
pub fn vehicle_on_soil() -> Result<Vec<Row>> {
    crate::pack::pack()?;
    let folder = target().join("bench");
    std::fs::create_dir_all(&folder)?;
    // Named by what it is made from: another specification makes another bed.
    let specification = std::fs::read(root().join("examples/obstacle/terrain-paper.json"))?;
    let bed = folder.join(format!("obstacle-{}.bed", &terramech_results::sha256(&specification)[..12]));
    if !bed.is_file() {
        go(&folder.join("bed"), 1, &format!("terrain.bed_save={}", bed.display()))?;
    }
    let load = format!("terrain.bed_load={}", bed.display());
    let mut seconds = Vec::new();
    for steps in STEPS {
        let out = folder.join("vehicle-on-soil");
        go(&out, steps, &load)?;
        seconds.push(timings(&out)?);
    }
    let simulated = f64::from(STEPS[1] - STEPS[0]) * STEP;
    let per = |k: usize| (seconds[1][k] - seconds[0][k]) / simulated;
    let row = |name: &str, value: f64, ratio: Option<f64>| Row {
        name: format!("vehicle-on-soil.obstacle.{name}"),
        value,
        unit: "s/s",
        ratio,
    };
    let total = per(0);
    let mut rows = vec![row("s_per_s", total, Some(total / TARGET))];
    rows.push(Row { unit: "1", ..row("times_faster_than_published", PUBLISHED / total, None) });
    rows.extend(UNITS.iter().enumerate().map(|(k, unit)| row(unit, per(k + 1), None)));
    rows.push(row("coupling", per(UNITS.len() + 1), None));
    rows.push(row("recording", per(UNITS.len() + 2), None));
    Ok(rows)
}

fn go(out: &Path, steps: u32, set: &str) -> Result<()> {
    let mut command = Command::new(target().join("release/terramech"));
    command.arg("run").arg(root().join("examples/obstacle/paper.ssd")).arg("--fmu-path").arg(fmus());
    command.arg("--out").arg(out).args(["--stop-time", &format!("{:.6}", f64::from(steps) * STEP)]);
    command.args(["--set", set, "--set", &format!("vehicle.specification={VEHICLE}")]);
    run(&mut command)
}

/// Wall time of the stepping, of the units in order, of coupling and recording (s).
fn timings(out: &Path) -> Result<Vec<f64>> {
    let text = std::fs::read_to_string(out.join("manifest.json"))?;
    let manifest: serde_json::Value = serde_json::from_str(&text)?;
    let t = &manifest["timings"];
    let number = |v: &serde_json::Value, what: &str| v.as_f64().with_context(|| format!("manifest without {what}"));
    let mut all = vec![number(&t["run_seconds"], "run_seconds")?];
    for unit in UNITS {
        let units = t["units"].as_array().context("manifest without units")?;
        let found = units.iter().find(|u| u["name"] == unit).with_context(|| format!("manifest without {unit}"))?;
        all.push(number(&found["seconds"], "seconds")?);
    }
    all.push(number(&t["coupling_seconds"], "coupling_seconds")?);
    all.push(number(&t["io_seconds"], "io_seconds")?);
    Ok(all)
}
