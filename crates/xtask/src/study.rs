//! `cargo xtask study NAME`: the studies of vehicles and tires on soil in small size, with plots in `docs/studies`.
//!
//! A vehicle study is one run of its `system.ssd`. The multi-pass study is a chain: each pass loads the bed that the pass before it left, for each
//! cohesion; the settled bed comes from the first pass.

mod checks;
mod depth;

use crate::pack;
use crate::process::{fmus, root, run, target};
use anyhow::{Context, Result, bail};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use terramech_results::report::{Axis, Item, Plot, Report, Style};
use terramech_results::{CsvTable, Headline, Manifest, read_summary};

/// The vehicle studies.
const VEHICLE: [&str; 3] = ["straight-line", "obstacle", "turn"];
/// Cohesions of the multi-pass study (Pa).
const COHESION: [f64; 2] = [2e4, 5e4];
const PASSES: usize = 3;

/// Runs one study, or all.
///
/// # Errors
/// An unknown name, a run that fails, a file that cannot be written.
pub fn study(name: Option<&str>) -> Result<()> {
    let known = [&VEHICLE[..], &["multi-pass", "depth", "checks"]].concat();
    if let Some(name) = name.filter(|n| !known.contains(n)) {
        bail!("study '{name}' is unknown; there are: {}", known.join(", "));
    }
    pack::pack()?;
    let docs = root().join("docs/studies");
    std::fs::create_dir_all(&docs).with_context(|| format!("cannot make {}", docs.display()))?;
    for each in known.into_iter().filter(|k| name.is_none_or(|n| n == *k)) {
        match each {
            "multi-pass" => passes(&docs)?,
            "depth" => depth::depth(&docs)?,
            "checks" => checks::checks(&docs)?,
            _ => vehicle(each, &docs)?,
        }
    }
    Ok(())
}

fn out(name: &str) -> PathBuf {
    target().join("studies").join(name)
}

/// `terramech run` of a description with more arguments.
fn terramech(description: &str, out: &Path, more: &[String]) -> Result<()> {
    terramech_at(&root().join("examples").join(description), out, more)
}

/// `terramech run` of a description anywhere.
fn terramech_at(file: &Path, out: &Path, more: &[String]) -> Result<()> {
    let mut command = Command::new(target().join("release/terramech"));
    command.arg("run").arg(file).arg("--fmu-path").arg(fmus());
    run(command.arg("--out").arg(out).args(more))
}

fn vehicle(name: &str, docs: &Path) -> Result<()> {
    let out = out(name);
    terramech(&format!("{name}/system.ssd"), &out, &[])?;
    let csv = CsvTable::read(out.join("results.csv"))?;
    let report = Report::of_run(name, &csv, &[], &Manifest::start("", vec![]), vec![]);
    for section in report.sections.iter().filter(|s| s.title.starts_with("Driving") || s.title == "Energy") {
        for item in &section.items {
            if let Item::Plot(plot) = item {
                let slug: String =
                    plot.title.to_lowercase().chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
                write(&docs.join(format!("{name}-{slug}.svg")), plot.svg().as_bytes())?;
            }
        }
    }
    let picture = out.join("scene.png");
    write(&docs.join(format!("{name}.png")), &std::fs::read(&picture).context("the run drew no scene.png")?)
}

fn passes(docs: &Path) -> Result<()> {
    let file = root().join("examples/multi-pass/terrain.json");
    let mut soil: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&file)?)?;
    let mut table = String::from(
        "# A tire over the same soil, three passes\n\nWritten by `cargo xtask study multi-pass`: `examples/multi-pass/system.ssd` (HMMWV tire 30 x 12, 5 kN, 2 m/s, \
         slip 0.2; load, speed and slip are not published), means from 0.7 to 1.2 s. Sinkage counts from the untouched bed.\n\n\
         | cohesion (kPa) | pass | sinkage (mm) | increment (mm) | drawbar pull (N) | wheel torque (N m) |\n|---|---|---|---|---|---|\n",
    );
    let axes = |y: &str, unit: &str| (Axis::new("pass", ""), Axis::new(y, unit));
    let ((x1, y1), (x2, y2)) = (axes("sinkage", "m"), axes("drawbar pull", "N"));
    let mut plots = [Plot::new("Sinkage against passes", x1, y1), Plot::new("Drawbar pull against passes", x2, y2)];
    for cohesion in COHESION {
        soil["soil"]["adhesion"]["pressure"] = cohesion.into();
        let mut curves = [vec![], vec![]];
        let bed = |pass: usize| out(&format!("bed-{cohesion}-{pass}"));
        for pass in 1..=PASSES {
            let folder = out(&format!("multi-pass-{cohesion}-{pass}"));
            std::fs::create_dir_all(out(""))?;
            let mut more = vec![
                "--set".to_string(),
                format!("terrain.specification={soil}"),
                "--set".into(),
                format!("terrain.bed_save_end={}", bed(pass).display()),
            ];
            if pass > 1 {
                more.extend(["--set".into(), format!("terrain.bed_load={}", bed(pass - 1).display())]);
            }
            terramech("multi-pass/system.ssd", &folder, &more)?;
            let found = read_summary(folder.join("summary.json"))?;
            let value = |name: &str| headline(&found, name);
            let (sinkage, pull) = (value("sinkage")?, value("drawbar pull")?);
            let before = curves[0].last().copied().unwrap_or(0.0);
            writeln!(
                table,
                "| {} | {pass} | {:.1} | {:.1} | {pull:.0} | {:.0} |",
                cohesion / 1e3,
                1e3 * sinkage,
                1e3 * (sinkage - before),
                value("wheel torque")?
            )?;
            curves[0].push(sinkage);
            curves[1].push(pull);
        }
        let x: Vec<f64> = (1..=PASSES).map(|p| p as f64).collect();
        plots = std::array::from_fn(|k| {
            plots[k].clone().with(format!("{} kPa", cohesion / 1e3), &x, &curves[k], Style::Line)
        });
    }
    for (plot, name) in plots.iter().zip(["sinkage", "pull"]) {
        write(&docs.join(format!("multi-pass-{name}.svg")), plot.svg().as_bytes())?;
        writeln!(table, "\n![{}](multi-pass-{name}.svg)", plot.title)?;
    }
    write(&docs.join("multi-pass.md"), table.as_bytes())
}

/// A headline result by its name.
fn headline(found: &[Headline], name: &str) -> Result<f64> {
    found.iter().find(|h| h.name == name).map(|h| h.value).with_context(|| format!("no headline '{name}'"))
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    std::fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
    eprintln!("   {}", path.display());
    Ok(())
}
