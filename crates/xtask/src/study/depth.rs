//! `cargo xtask study depth`: sinkage and drawbar pull of the first pass over beds of several depths. The published beds are shallow.

use super::{headline, out, terramech, write};
use crate::process::root;
use anyhow::Result;
use std::fmt::Write as _;
use std::path::Path;
use terramech_results::read_summary;
use terramech_results::report::{Axis, Plot, Style};

/// Depths of the bed (m).
const DEPTHS: [f64; 4] = [0.10, 0.15, 0.20, 0.30];

/// Runs them; writes `depth.md` and two plots.
///
/// # Errors
/// A run that fails, a file that cannot be written.
pub(super) fn depth(docs: &Path) -> Result<()> {
    let file = root().join("examples/multi-pass/terrain.json");
    let mut soil: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(file)?)?;
    let mut table = String::from(
        "# Depth of the bed\n\nWritten by `cargo xtask study depth`: the first pass of `examples/multi-pass/system.ssd` (5 kN, 2 m/s, slip 0.2, cohesion 20 kPa, grains of 20 mm) over beds on a rigid \
         floor, means from 0.7 to 1.2 s.\n\n| depth (m) | sinkage (mm) | drawbar pull (N) | wheel torque (N m) |\n|---|---|---|---|\n",
    );
    let mut curves = [Vec::new(), Vec::new()];
    for depth in DEPTHS {
        soil["bed"]["fill"] = serde_json::json!({ "depth": depth });
        let folder = out(&format!("depth-{depth}"));
        terramech("multi-pass/system.ssd", &folder, &["--set".into(), format!("terrain.specification={soil}")])?;
        let found = read_summary(folder.join("summary.json"))?;
        let [sinkage, pull, torque] = ["sinkage", "drawbar pull", "wheel torque"].map(|name| headline(&found, name));
        let (sinkage, pull) = (sinkage?, pull?);
        writeln!(table, "| {depth} | {:.1} | {pull:.0} | {:.0} |", 1e3 * sinkage, torque?)?;
        curves[0].push(sinkage);
        curves[1].push(pull);
    }
    for (values, (name, label, unit)) in curves.iter().zip([("sinkage", "sinkage", "m"), ("pull", "drawbar pull", "N")])
    {
        let title = format!("First pass: {label} against depth of the bed");
        let plot = Plot::new(&title, Axis::new("depth of the bed", "m"), Axis::new(label, unit));
        write(
            &docs.join(format!("depth-{name}.svg")),
            plot.with("20 kPa", &DEPTHS, values, Style::Line).svg().as_bytes(),
        )?;
        writeln!(table, "\n![{title}](depth-{name}.svg)")?;
    }
    write(&docs.join("depth.md"), table.as_bytes())
}
