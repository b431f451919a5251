//! `cargo xtask demo`: a wheel on granular soil, from the sources to a report.

use crate::process::{fmus, root, target};
use crate::{pack, process};
use anyhow::{Context, Result};
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Builds, packs, runs `examples/single-wheel` into `out`, and says what came out.
///
/// # Errors
/// A build or the run that failed.
pub fn demo(out: &Path) -> Result<()> {
    let start = Instant::now();
    pack::pack()?;
    eprintln!(
        "== built and packed in {:.0} s; the run takes about two minutes on two cores",
        start.elapsed().as_secs_f64()
    );
    let out = std::env::current_dir().context("the current folder is gone")?.join(out);
    let mut terramech = Command::new(target().join("release/terramech"));
    terramech.arg("run").arg(root().join("examples/single-wheel/system.ssd"));
    terramech.arg("--out").arg(&out).arg("--fmu-path").arg(fmus());
    process::run(&mut terramech)?;
    println!();
    println!("Report:     {}", out.join("report.html").display());
    println!("ParaView:   {} (one .pvd per unit: open them together)", out.join("vtk").display());
    println!("Time series: {}", out.join("results.csv").display());
    println!(
        "Speed: the carriage runs five times faster than in the experiment, so the numbers beside the measured ones show the \
         order of magnitude; the soil of this demo is not calibrated."
    );
    Ok(())
}
