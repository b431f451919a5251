//! `cargo xtask study NAME`: the studies of vehicles and tires on soil in small size, with plots in `docs/studies`.
//!
//! A vehicle study is one run of its `system.ssd`. The multi-pass study is a chain: each pass loads the bed that the pass before it left, for each
//! cohesion; the settled bed comes from the first pass.

mod checks;
mod depth;
mod paper;
mod ruts;

use crate::pack;
use crate::process::{fmus, root, run, target};
use crate::statistics::mean_and_error;
use anyhow::{Context, Result, bail};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use terramech_results::report::{Axis, Item, Plot, Report, Style};
use terramech_results::{CsvTable, Headline, Manifest, read_summary};

/// The vehicle studies.
const VEHICLE: [&str; 3] = ["straight-line", "obstacle", "turn"];
/// Cohesions of the multi-pass study with the Young's modulus of the soil (Pa). With the smaller modulus 100 kPa would press grains a tenth
/// of their radius into each other, and the bed would creep for seconds.
const COHESION: [[f64; 2]; 3] = [[2e4, 2e7], [5e4, 2e7], [1e5, 1e8]];
const PASSES: usize = 3;
/// Beds of each cohesion.
const SEEDS: [u64; 3] = [1, 2, 3];

/// Runs one study, or all. `published`: in the size of the publication, and perhaps the folder of a run of it that is only looked at.
///
/// # Errors
/// An unknown name, a run that fails, a file that cannot be written.
pub fn study(name: Option<&str>, published: Option<Option<&Path>>) -> Result<()> {
    let known = [&VEHICLE[..], &["ruts", "multi-pass", "depth", "checks"]].concat();
    if let Some(name) = name.filter(|n| !known.contains(n)) {
        bail!("study '{name}' is unknown; there are: {}", known.join(", "));
    }
    let docs = root().join("docs/studies");
    std::fs::create_dir_all(&docs).with_context(|| format!("cannot make {}", docs.display()))?;
    if let Some(folder) = published {
        let name = name.context("--paper: which study? It takes hours")?;
        return paper::paper(name, folder, &docs);
    }
    pack::pack()?;
    for each in known.into_iter().filter(|k| name.is_none_or(|n| n == *k)) {
        match each {
            "ruts" => ruts::ruts(&docs)?,
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
    plots(name, name, &CsvTable::read(out.join("results.csv"))?, docs)?;
    let picture = out.join("scene.png");
    write(&docs.join(format!("{name}.png")), &std::fs::read(&picture).context("the run drew no scene.png")?)
}

/// Writes the plots of a vehicle's run as `PREFIX-TITLE.svg`; gives their titles and files.
fn plots(prefix: &str, name: &str, csv: &CsvTable, docs: &Path) -> Result<Vec<(String, String)>> {
    let report = Report::of_run(name, csv, &[], &Manifest::start("", vec![]), vec![]);
    let mut written = Vec::new();
    for section in report.sections.iter().filter(|s| s.title.starts_with("Driving") || s.title == "Energy") {
        for item in &section.items {
            if let Item::Plot(plot) = item {
                let slug: String =
                    plot.title.to_lowercase().chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
                let file = format!("{prefix}-{slug}.svg");
                write(&docs.join(&file), plot.svg().as_bytes())?;
                written.push((plot.title.clone(), file));
            }
        }
    }
    Ok(written)
}

fn passes(docs: &Path) -> Result<()> {
    let mut table = format!(
        "# A tire over the same soil, three passes\n\nWritten by `cargo xtask study multi-pass`: `examples/multi-pass/system.ssd` (HMMWV tire 30 x 12, 5 kN, 2 m/s, \
         slip 0.2; load, speed and slip are not published), means from 0.7 to 1.2 s and over {} beds poured at random, with standard errors. Sinkage counts \
         from the untouched bed. Young's modulus of the soil 20 MPa, with 100 kPa of cohesion 100 MPa.\n\n\
         | cohesion (kPa) | pass | sinkage (mm) | increment (mm) | drawbar pull (N) | wheel torque (N m) |\n|---|---|---|---|---|---|\n",
        SEEDS.len()
    );
    let axes = |y: &str, unit: &str| (Axis::new("pass", ""), Axis::new(y, unit));
    let ((x1, y1), (x2, y2)) = (axes("sinkage", "m"), axes("drawbar pull", "N"));
    let mut plots = [Plot::new("Sinkage against passes", x1, y1), Plot::new("Drawbar pull against passes", x2, y2)];
    let x: Vec<f64> = (1..=PASSES).map(|p| p as f64).collect();
    for [cohesion, young_modulus] in COHESION {
        let beds = SEEDS.map(|seed| one_bed(cohesion, young_modulus, seed));
        let beds: Vec<_> = beds.into_iter().collect::<Result<_>>()?;
        // What a quantity of a pass is over the beds, as text: mean and standard error.
        let told = |of: &dyn Fn(&Passes) -> f64, scale: f64, digits: usize| {
            let [mean, error] = mean_and_error(&beds.iter().map(of).collect::<Vec<_>>());
            format!("{:.digits$} +- {:.digits$}", scale * mean, scale * error)
        };
        for k in 0..PASSES {
            let increment = |b: &Passes| b[k][0] - if k > 0 { b[k - 1][0] } else { 0.0 };
            writeln!(
                table,
                "| {} | {} | {} | {} | {} | {} |",
                cohesion / 1e3,
                k + 1,
                told(&|b| b[k][0], 1e3, 1),
                told(&increment, 1e3, 1),
                told(&|b| b[k][1], 1.0, 0),
                told(&|b| b[k][2], 1.0, 0)
            )?;
        }
        plots = std::array::from_fn(|q| {
            let means: Vec<f64> =
                (0..PASSES).map(|k| mean_and_error(&beds.iter().map(|b| b[k][q]).collect::<Vec<_>>())[0]).collect();
            plots[q].clone().with(format!("{} kPa", cohesion / 1e3), &x, &means, Style::Line)
        });
    }
    for (plot, name) in plots.iter().zip(["sinkage", "pull"]) {
        write(&docs.join(format!("multi-pass-{name}.svg")), plot.svg().as_bytes())?;
        writeln!(table, "\n![{}](multi-pass-{name}.svg)", plot.title)?;
    }
    write(&docs.join("multi-pass.md"), table.as_bytes())
}

/// Sinkage (m), drawbar pull (N), wheel torque (N m) of each pass.
type Passes = [[f64; 3]; PASSES];

/// All passes over one bed.
fn one_bed(cohesion: f64, young_modulus: f64, seed: u64) -> Result<Passes> {
    let file = root().join("examples/multi-pass/terrain.json");
    let mut soil: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&file)?)?;
    soil["soil"]["adhesion"]["pressure"] = cohesion.into();
    soil["soil"]["young_modulus"] = young_modulus.into();
    soil["bed"]["seed"] = seed.into();
    std::fs::create_dir_all(out(""))?;
    let bed = |pass: usize| out(&format!("bed-{cohesion}-{seed}-{pass}"));
    let mut found = [[0.0; 3]; PASSES];
    for (k, values) in found.iter_mut().enumerate() {
        let set = |name: &str, value: String| ["--set".to_string(), format!("terrain.{name}={value}")];
        let mut more = set("specification", soil.to_string()).to_vec();
        more.extend(set("bed_save_end", bed(k + 1).display().to_string()));
        if k > 0 {
            more.extend(set("bed_load", bed(k).display().to_string()));
        }
        let folder = out(&format!("multi-pass-{cohesion}-{seed}-{}", k + 1));
        terramech("multi-pass/system.ssd", &folder, &more)?;
        let summary = read_summary(folder.join("summary.json"))?;
        for (value, name) in values.iter_mut().zip(["sinkage", "drawbar pull", "wheel torque"]) {
            *value = headline(&summary, name)?;
        }
    }
    Ok(found)
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
