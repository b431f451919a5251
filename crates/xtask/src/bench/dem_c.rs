//! `cargo xtask bench dem-c`: the complementarity engine on the beds of `bench dem`, at rest and with a wheel that drives through.
//!
//! Peer and limit are figures of the page on performance, measured once: Project Chrono 10 Multicore (rigid contacts, APGD, 100 iterations, residual .04
//! to .10 m/s): 2.14 s a step at 20k grains; APGD 50 at 100k: 6.9 s; memory traffic of an accelerated gradient sweep: 18 ns a contact on one core.

use super::Row;
use crate::process::{cargo, run, target};
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::process::Command;

/// Seconds that the peer takes for a step, by thousands of grains.
const PEER: [(usize, f64); 2] = [(20, 2.14), (100, 6.9)];

/// Milliseconds of an iteration at 100k grains on two cores: what memory traffic allows an accelerated gradient.
const LIMIT: f64 = 2.5;

/// Runs it.
///
/// # Errors
/// The engine does not build or run.
pub fn dem_c() -> Result<Vec<Row>> {
    let beds = target().join("bench/beds");
    let build =
        ["build", "--release", "--quiet", "-p", "fmu-terrain", "--example", "bench_cone", "--example", "bench_bed"];
    run(&mut cargo(build))?;
    let program = |name: &str| target().join("release/examples").join(name);
    let mut rows = Vec::new();
    for (thousands, peer) in PEER {
        let n = (1000 * thousands).to_string();
        if !beds.join(format!("bed-{n}.f64")).exists() {
            // It settles the bed and keeps it.
            run(Command::new(program("bench_bed")).arg("--beds").arg(&beds).args(["--threads", "2", &n]))?;
        }
        for threads in ["1", "2"] {
            let mut command = Command::new(program("bench_cone"));
            command.arg("--beds").arg(&beds).args(["--json", "--threads", threads, &n]);
            let out = command.stderr(std::process::Stdio::inherit()).output().context("cannot start bench_cone")?;
            if !out.status.success() {
                bail!("bench_cone with {n} grains failed ({})", out.status);
            }
            let tail = if threads == "2" { "" } else { "_1_thread" };
            for line in String::from_utf8_lossy(&out.stdout).lines() {
                let v: Value = serde_json::from_str(line).with_context(|| format!("bench_cone printed '{line}'"))?;
                let get = |key: &str| v[key].as_f64().with_context(|| format!("bench_cone printed no '{key}'"));
                let case = v["case"].as_str().unwrap_or_default().to_string();
                let mut put = |name: String, value: f64, unit: &'static str, ratio: Option<f64>| {
                    rows.push(Row { name: format!("dem-c.{thousands}k.{name}{tail}"), value, unit, ratio });
                };
                if case == "fixed" {
                    let (ms, processor) = (get("ms_per_iteration")?, get("cpu_ms_per_iteration")?);
                    let limit = (thousands == 100 && threads == "2").then_some(LIMIT);
                    put("ms_per_iteration".into(), ms, "ms", limit.map(|l| ms / l));
                    put("processor_ms_per_iteration".into(), processor, "ms", limit.map(|l| processor / (2.0 * l)));
                    put(
                        "ns_per_contact_and_iteration".into(),
                        1e6 * processor / get("contacts")?,
                        "ns of a processor",
                        None,
                    );
                } else if case == "settled" || case == "driven" {
                    put(format!("{case}.iterations"), get("iterations")?, "1", None);
                    put(format!("{case}.residual"), get("residual")?, "m/s", None);
                    put(format!("{case}.unconverged"), get("unconverged")?, "steps", None);
                    let step = 1e-3 * get("ms_per_step")?;
                    put(format!("{case}.step"), step, "s", Some(peer / step));
                    put(format!("{case}.step_processor"), 1e-3 * get("cpu_ms_per_step")?, "s of a processor", None);
                }
            }
        }
    }
    Ok(rows)
}
