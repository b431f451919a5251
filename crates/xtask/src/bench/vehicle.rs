//! `cargo xtask bench vehicle`: the HMMWV at 1e-3 s on one core.
//!
//! Beside the clock the time the thread was on a core is given, which other work on the machine disturbs less. The ratio of the headline is
//! that to the target of 60 us; a peer, Project Chrono 10, takes 300 to 550 us per step for the same vehicle (measured on a machine like this, stated in
//! docs/benchmarks/vehicle.md), so that `speed_up_of_peer` is no measurement side by side.

use super::Row;
use crate::process::{cargo, run, target};
use anyhow::{Context, Result, bail};
use std::process::Command;

/// Target (us per step).
const TARGET: f64 = 60.0;
/// The peer's fastest (us per step).
const PEER: f64 = 300.0;

/// Runs it.
///
/// # Errors
/// The program does not build or run, or prints something else.
pub fn vehicle() -> Result<Vec<Row>> {
    run(&mut cargo(["build", "--release", "--quiet", "-p", "fmu-vehicle", "--example", "bench_vehicle"]))?;
    let out = Command::new(target().join("release/examples/bench_vehicle"))
        .stderr(std::process::Stdio::inherit())
        .output()
        .context("bench_vehicle cannot be started")?;
    if !out.status.success() {
        bail!("bench_vehicle failed ({})", out.status);
    }
    let text = String::from_utf8_lossy(&out.stdout);
    let mut rows = Vec::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let (Some(name), Some(value), unit) = (words.next(), words.next(), words.next().unwrap_or("1")) else {
            bail!("bench_vehicle printed '{line}'; expected: name value unit");
        };
        let value: f64 = value.parse().with_context(|| format!("bench_vehicle printed '{line}'"))?;
        let unit = if unit == "us" { "us" } else { "1" };
        let ratio = name.ends_with("us_per_step").then_some(value / TARGET);
        rows.push(Row { name: name.into(), value, unit, ratio });
        if name == "vehicle.hmmwv.us_per_step" {
            rows.push(Row {
                name: "vehicle.hmmwv.speed_up_of_peer".into(),
                value: PEER / value,
                unit: "1",
                ratio: None,
            });
        }
    }
    if !rows.iter().any(|r| r.name == "vehicle.hmmwv.us_per_step") {
        bail!("bench_vehicle printed no vehicle.hmmwv.us_per_step");
    }
    Ok(rows)
}
