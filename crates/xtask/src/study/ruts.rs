//! `cargo xtask study ruts`: the straight line on soil in which wheels leave ruts: weakly cohesive, four layers of coarse grains instead of two.
//!
//! What is looked for: the rear tires fall into the ruts at which the front tires stood, and what their net force does.

use super::{out, terramech, write};
use anyhow::{Context, Result};
use std::fmt::Write as _;
use std::path::Path;
use terramech_results::CsvTable;
use terramech_results::report::{Axis, Plot, Style};

/// Later than this (s) the front wheels are at the end of the bed.
const STOP: &str = "4";
/// Means are taken over this (s).
const WINDOW: f64 = 0.1;

/// Runs it; writes `ruts.md` and two plots.
///
/// # Errors
/// A run that fails, a column that is not there, a file that cannot be written.
pub(super) fn ruts(docs: &Path) -> Result<()> {
    let folder = out("ruts");
    let set = |name: &str, value: &str| ["--set".to_string(), format!("{name}.specification={value}")];
    let mut more = vec!["--stop-time".to_string(), STOP.into()];
    more.extend(set("terrain", "terrain-soft.json"));
    more.extend(set("vehicle", "vehicle-soft.json"));
    terramech("straight-line/system.ssd", &folder, &more)?;
    let csv = CsvTable::read(folder.join("results.csv"))?;
    let column = |name: String| -> Result<&[f64]> {
        csv.numbers(&name).with_context(|| format!("results.csv has no column '{name}'"))
    };
    let time = &csv.time[..];
    // Of an axle: mean of its wheels' x and z (m), sum of the longitudinal forces on them (N).
    let axle = |wheels: [u32; 2]| -> Result<[Vec<f64>; 3]> {
        let both = |what: &str, scale: f64| -> Result<Vec<f64>> {
            let a = column(format!("vehicle.wheel[{}].{what}", wheels[0]))?;
            let b = column(format!("vehicle.wheel[{}].{what}", wheels[1]))?;
            Ok(a.iter().zip(b).map(|(a, b)| scale * (a + b)).collect())
        };
        Ok([both("position.x", 0.5)?, both("position.z", 0.5)?, both("force.x", 1.0)?])
    };
    let (front, rear) = (axle([1, 2])?, axle([3, 4])?);
    let stood = front[0].first().copied().context("results.csv is empty")?;
    let entered = rear[0].iter().position(|x| *x > stood).map(|k| time[k]);
    let entered = entered.context("the rear wheels have not come to where the front wheels stood")?;
    let mean = |values: &[f64], from: f64, to: f64| {
        let inside: Vec<f64> =
            time.iter().zip(values).filter(|(t, _)| (from..to).contains(*t)).map(|(_, v)| *v).collect();
        inside.iter().sum::<f64>() / inside.len().max(1) as f64
    };
    let last = time.last().copied().unwrap_or(0.0);
    let span = last - entered;
    let mut text = format!(
        "# Ruts\n\nWritten by `cargo xtask study ruts`: `examples/straight-line/system.ssd` on `terrain-soft.json` (cohesion 10 kPa, 0.26 m of \
         grains of 36 mm), the vehicle starting at x = -3.2 m. The rear wheels come to where the front wheels stood at {entered:.2} s (said: 3.4 s). Means over the {span:.2} s \
         before that and after it.\n\n| | before | after |\n|---|---|---|\n"
    );
    let rows = [
        ("height of the rear wheels' centres (m)", &rear[1], 4, 1.0),
        ("height of the front wheels' centres (m)", &front[1], 4, 1.0),
        ("net force of the rear axle (N)", &rear[2], 0, 1.0),
        ("net force of the front axle (N)", &front[2], 0, 1.0),
    ];
    for (name, values, digits, scale) in rows {
        let [before, after] = [mean(values, entered - span, entered), mean(values, entered, last)].map(|v| scale * v);
        writeln!(text, "| {name} | {before:.digits$} | {after:.digits$} |")?;
    }
    let centres: Vec<f64> = (0..(last / WINDOW) as u32).map(|k| (f64::from(k) + 0.5) * WINDOW).collect();
    let smooth = |values: &[f64]| -> Vec<f64> {
        centres.iter().map(|t| mean(values, t - 0.5 * WINDOW, t + 0.5 * WINDOW)).collect()
    };
    let plots = [
        ("heights", "Heights of the wheels' centres", "height", "m", 1),
        ("forces", "Net force by axle", "force", "N", 2),
    ];
    for (file, title, label, unit, k) in plots {
        let plot = Plot::new(title, Axis::new("time", "s"), Axis::new(label, unit))
            .with("front", &centres, &smooth(&front[k]), Style::Line)
            .with("rear", &centres, &smooth(&rear[k]), Style::Line);
        write(&docs.join(format!("ruts-{file}.svg")), plot.svg().as_bytes())?;
        writeln!(text, "\n![{title}](ruts-{file}.svg)")?;
    }
    write(&docs.join("ruts.md"), text.as_bytes())
}
