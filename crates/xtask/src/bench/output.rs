//! `cargo xtask bench output`: what the ParaView series of grains costs a run.
//!
//! The multi-pass study in small size (11,000 grains, flexible tire) from its settled bed, with all grains (number, radius, velocity, force)
//! written fifty times a simulated second, with those of a region around the wheel's way, and with none, in turn; the least of several runs
//! each. All other recording stays.

use super::Row;
use crate::process::{fmus, root, run, target};
use anyhow::{Context, Result};
use std::fs;
use std::path::Path;
use std::process::Command;

const ROUNDS: usize = 4;
const STOP: &str = "0.5";
/// The most that output may slow a run by.
const ALLOWED: f64 = 0.05;

/// Runs it.
///
/// # Errors
/// A build or a run that fails.
pub fn output() -> Result<Vec<Row>> {
    crate::pack::pack()?;
    let folder = target().join("bench/output");
    for name in ["multi-pass", "tires"] {
        let to = folder.join(name);
        fs::create_dir_all(&to)?;
        for file in fs::read_dir(root().join("examples").join(name))? {
            let file = file?.path();
            fs::copy(&file, to.join(file.file_name().context("a file without a name")?))?;
        }
    }
    let description = fs::read_to_string(folder.join("multi-pass/system.ssd"))?;
    let begin = description.find(r#"<tm:Dataset name="bed""#).context("the study records no dataset 'bed'")?;
    let end = begin + description[begin..].find("</tm:Dataset>").context("a dataset without end")? + 13;
    let often = description[begin..end].replace(r#"every="0.1""#, r#"every="0.02""#);
    let variant = |name: &str, dataset: &str| -> Result<_> {
        let path = folder.join("multi-pass").join(name);
        fs::write(&path, [&description[..begin], dataset, &description[end..]].concat())?;
        Ok(path)
    };
    let (none, all) = (variant("none.ssd", "")?, variant("all.ssd", &often)?);
    let mut soil: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.join("multi-pass/terrain.json"))?)?;
    soil["output"] = serde_json::json!({"low": [-2, -0.25, 0], "high": [2, 0.25, 1]});
    let region = soil.to_string();
    let bed = folder.join("settled.bed");
    let (out, save) = (folder.join("run"), format!("terrain.bed_save={}", bed.display()));
    go(&none, &out, &["--set", &save, "--stop-time", "0.001"])?;
    let load = format!("terrain.bed_load={}", bed.display());
    let region = format!("terrain.specification={region}");
    let mut least = [f64::INFINITY; 3];
    let mut bytes = [0; 3];
    for _ in 0..ROUNDS {
        for (k, (file, more)) in [(&none, None), (&all, None), (&all, Some(&region))].into_iter().enumerate() {
            let mut args = vec!["--set", &load, "--stop-time", STOP];
            if let Some(more) = more {
                args.extend(["--set", more]);
            }
            go(file, &out, &args)?;
            let manifest: serde_json::Value = serde_json::from_str(&fs::read_to_string(out.join("manifest.json"))?)?;
            let seconds = manifest["timings"]["run_seconds"].as_f64().context("manifest without run_seconds")?;
            least[k] = least[k].min(seconds);
            bytes[k] = size(&out.join("vtk"))?;
        }
    }
    let row = |name: &str, value: f64, unit: &'static str, ratio: Option<f64>| Row {
        name: format!("output.{name}"),
        value,
        unit,
        ratio,
    };
    let slower = |k: usize| least[k] / least[0] - 1.0;
    Ok(vec![
        row("none.run", least[0], "s", None),
        row("all.run", least[1], "s", None),
        row("all.slower", slower(1), "1", Some(slower(1) / ALLOWED)),
        row("all.written", (bytes[1] - bytes[0]) as f64 / 1e6, "MB", None),
        row("region.slower", slower(2), "1", Some(slower(2) / ALLOWED)),
        row("region.written", (bytes[2] - bytes[0]) as f64 / 1e6, "MB", None),
    ])
}

fn go(system: &Path, out: &Path, more: &[&str]) -> Result<()> {
    let mut command = Command::new(target().join("release/terramech"));
    command.arg("run").arg(system).arg("--fmu-path").arg(fmus()).arg("--out").arg(out).arg("--quiet");
    run(command.args(more))
}

/// Bytes of the files in a folder and those below it.
fn size(folder: &Path) -> Result<i64> {
    let mut sum = 0;
    for entry in fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))? {
        let entry = entry?;
        let data = entry.metadata()?;
        sum += if data.is_dir() { size(&entry.path())? } else { data.len() as i64 };
    }
    Ok(sum)
}
