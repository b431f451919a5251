//! `cargo xtask bench master`: what coupling costs, beside a bare loop of the same calls, FMPy and libcosim.
//!
//! The master and the bare loop take turns in one process, on one thread and without recording; the fastest of several repeats counts. Peers run
//! the same FMUs in the same rings and pairs; libcosim knows no arrays, FMPy reads the same description.

use super::Row;
use crate::process::{cargo, root, run, target};
use crate::test::virtual_environment;
use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Runs it.
///
/// # Errors
/// Our own part does not build or run. Peers missing is no error: their rows are left out.
pub fn master() -> Result<Vec<Row>> {
    let folder = target().join("bench/master");
    run(&mut cargo(["build", "--release", "--quiet", "-p", "terramech", "--example", "bench_master"]))?;
    run(&mut cargo(["build", "--release", "--quiet", "--workspace", "--example", "testunits"]))?;
    let examples = target().join("release/examples");
    let library = examples.join(format!("{}testunits{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX));
    let ours = figures(Command::new(examples.join("bench_master")).arg(library).arg(&folder))?;
    let peers = peers(&folder).unwrap_or_else(|why| {
        eprintln!("FMPy and libcosim cannot be measured ({why:#}): our rows only");
        BTreeMap::new()
    });
    let mut rows = Vec::new();
    let mut put = |name: String, value: f64, unit: &'static str, ratio: Option<f64>| {
        rows.push(Row { name: format!("master.{name}"), value, unit, ratio });
    };
    for case in ["ring2", "ring10", "ring50", "ring100", "pair3000_arrays", "pair3000"] {
        let of = |what: &str| ours.get(&format!("{case}.{what}")).copied().unwrap_or(f64::NAN);
        let micro = of("microseconds_per_step");
        put(format!("{case}.ratio_to_floor"), of("ratio_to_floor"), "1", Some(of("ratio_to_floor") / 1.3));
        put(format!("{case}.step"), micro, "us", None);
        put(format!("{case}.floor"), of("floor"), "us", None);
        for peer in ["fmpy", "libcosim"] {
            if let Some(&theirs) = peers.get(&format!("{case}.{peer}")) {
                put(format!("{case}.{peer}"), theirs, "us", None);
                put(format!("{case}.times_faster_than_{peer}"), theirs / micro, "1", None);
            }
        }
    }
    let of = |name: &str| ours.get(name).copied().unwrap_or(f64::NAN);
    let scalars = of("pair3000.microseconds_per_step") / of("pair3000_arrays.microseconds_per_step");
    put("pair3000.ratio_to_block".into(), scalars, "1", Some(scalars / 2.0));
    for (connections, limit) in [(6000, 0.1), (60_000, 1.0)] {
        let seconds = of(&format!("load{connections}.seconds"));
        put(format!("load{connections}.seconds"), seconds, "s", Some(seconds / limit));
    }
    Ok(rows)
}

/// `name value` lines of a program.
fn figures(command: &mut Command) -> Result<BTreeMap<String, f64>> {
    let out = command.output().with_context(|| format!("cannot start {:?}", command.get_program()))?;
    if !out.status.success() {
        bail!("{:?} failed ({}): {}", command.get_program(), out.status, String::from_utf8_lossy(&out.stderr));
    }
    let text = String::from_utf8_lossy(&out.stdout);
    let line = |l: &str| {
        let (name, value) = l.split_once(' ')?;
        Some((name.to_owned(), value.trim().parse().ok()?))
    };
    Ok(text.lines().filter_map(line).collect())
}

fn peers(folder: &Path) -> Result<BTreeMap<String, f64>> {
    let here = root().join("crates/xtask/src/bench");
    let python = virtual_environment("venv-bench-master", &here.join("master_peers.txt"))?;
    figures(Command::new(python).arg(here.join("master_peers.py")).arg(folder))
}
