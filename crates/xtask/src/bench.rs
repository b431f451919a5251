//! `cargo xtask bench NAME [--json FILE]`: measurements, each row with its ratio to a peer or to a stated limit.
//!
//! Row names are `<bench>.<case>.<quantity>`; they are stable, so that results of different days can be compared.

mod dem;
mod dem_c;
mod master;
mod mpi;
mod output;
mod scaling;
mod tire;
mod vehicle;
mod vehicle_on_soil;

use anyhow::{Context, Result, bail};
use serde_json::json;
use std::path::Path;

/// One figure.
pub struct Row {
    /// `<bench>.<case>.<quantity>`.
    pub name: String,
    /// Measured value.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
    /// Ratio to the peer or limit that the benchmark states, if it has one.
    pub ratio: Option<f64>,
}

/// A benchmark: name, what it does, its function.
type Bench = (&'static str, &'static str, fn() -> Result<Vec<Row>>);

const BENCHES: &[Bench] = &[
    ("dem", "granular engine beside LAMMPS, 20k and 100k grains, 1 and 2 threads", dem::dem),
    ("dem-c", "complementarity engine, 20k and 100k grains, settled and driven, 1 and 2 threads", dem_c::dem_c),
    ("tire", "flexible tire, rolling in contact, 1 and 2 threads, split into its parts", tire::tire),
    ("vehicle", "HMMWV at 1e-3 s on one core", vehicle::vehicle),
    ("vehicle-on-soil", "the obstacle study as published, 923,000 grains, per unit", vehicle_on_soil::vehicle_on_soil),
    ("output", "what the ParaView series of grains costs a run", output::output),
    ("mpi", "the single wheel in one process and on two ranks (needs MPI)", mpi::mpi),
    ("master", "cost of coupling beside a bare loop of the same calls, FMPy and libcosim", master::master),
];

/// Runs the benchmark `name`; prints a table, writes JSON when asked.
///
/// # Errors
/// An unknown name, or a benchmark that fails.
pub fn bench(name: &str, json: Option<&Path>) -> Result<()> {
    let Some((_, what, run)) = BENCHES.iter().find(|(n, ..)| *n == name) else {
        let known: Vec<String> = BENCHES.iter().map(|(n, what, _)| format!("\n  {n}: {what}")).collect();
        bail!("benchmark '{name}' is unknown; there are:{}", known.concat());
    };
    eprintln!("== {name}: {what}");
    let rows = run()?;
    let width = rows.iter().map(|r| r.name.len()).max().unwrap_or(0);
    for r in &rows {
        let ratio = r.ratio.map(|x| format!("  ratio {x:.3}")).unwrap_or_default();
        println!("{:<width$}  {:>12.5} {}{ratio}", r.name, r.value, r.unit);
    }
    if let Some(path) = json {
        let list: Vec<_> =
            rows.iter().map(|r| json!({"name": r.name, "value": r.value, "unit": r.unit, "ratio": r.ratio})).collect();
        std::fs::write(path, serde_json::to_string_pretty(&list)? + "\n")
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}
