//! `cargo xtask bench tire`: the flexible HMMWV tire, inflated, rolling at 5 m/s on a plane in steps of 4e-5 s.
//!
//! Peers (stored, measured on another machine; performance figures of the project's reference): Project Chrono 10 with PARDISO, 462 ms per
//! step on one thread and 303 on two; the source paper's tire 1,417 ms. Ratios are ours over the peer's, or over the part's own limit:
//! element work at the machine's rate of multiply-adds, a solve at the rate at which it reads memory in order.

use super::Row;
use crate::process::{cargo, run, target};
use anyhow::{Context, Result, bail};
use std::process::{Command, Stdio};

const CHRONO: [f64; 2] = [462.0, 303.0];

/// Runs it.
///
/// # Errors
/// The tire's benchmark does not build or run.
pub fn tire() -> Result<Vec<Row>> {
    run(&mut cargo(["build", "--release", "--quiet", "-p", "fmu-tire", "--example", "bench_tire"]))?;
    let mut rows = Vec::new();
    let one = measure(["layered", "90", "24", "1", "1000"])?;
    let get = |name: &str| one.iter().find(|r| r.name == name).map(|r| r.value);
    for r in &one {
        let ratio = match r.name.as_str() {
            "ms_per_step" => Some(r.value / CHRONO[0]),
            part => get(&format!("{part}_limit")).map(|limit| r.value / limit),
        };
        rows.push(Row { name: format!("tire.90x24.{}", r.name), value: r.value, unit: r.unit, ratio });
    }
    for r in measure(["layered", "90", "24", "2", "1000"])?.into_iter().filter(|r| r.name == "ms_per_step") {
        let name = "tire.90x24.ms_per_step_2_threads".into();
        rows.push(Row { name, value: r.value, unit: r.unit, ratio: Some(r.value / CHRONO[1]) });
    }
    for (mesh, args) in
        [("90x24_lumped", ["lumped", "90", "24", "1", "1000"]), ("30x10", ["layered", "30", "10", "1", "4000"])]
    {
        let wanted = ["ms_per_step", "steps_per_second", "position_error", "force_error_rms"];
        for r in measure(args)?.into_iter().filter(|r| wanted.contains(&r.name.as_str())) {
            rows.push(Row { name: format!("tire.{mesh}.{}", r.name), ..r });
        }
    }
    Ok(rows)
}

fn measure(args: [&str; 5]) -> Result<Vec<Row>> {
    let program = target().join("release/examples/bench_tire");
    let out = Command::new(&program).args(args).stderr(Stdio::inherit()).output()?;
    if !out.status.success() {
        bail!("bench_tire {} failed ({})", args.join(" "), out.status);
    }
    let text = String::from_utf8_lossy(&out.stdout);
    text.lines()
        .filter_map(|line| line.strip_prefix("BENCH|"))
        .map(|line| {
            let cells: Vec<&str> = line.split('|').collect();
            let [name, value, unit] = cells[..] else { bail!("bench_tire printed '{line}'") };
            let unit = ["ms", "1", "m", "1/s"].into_iter().find(|u| *u == unit).context("unknown unit")?;
            Ok(Row { name: name.into(), value: value.parse()?, unit, ratio: None })
        })
        .collect()
}
