//! `cargo xtask validate cmu`: a wheel in real sand (section 7). Runs the example `cmu` of `fmu-terrain`, which goes on where it was stopped,
//! and writes `docs/validation/cmu.md` from the figures in `docs/validation/cmu.jsonl`, as far as they are there. With `TERRAMECH_CMU=page` it
//! writes the page alone.

use crate::process::{cargo, root, run, target};
use crate::statistics::{at_zero, mean_and_deviation};
use anyhow::{Context, Result};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use terramech_results::report::{Axis, Plot, Style};

/// A row of the file: slip angle (deg), slip, pull with deviation (N), side force (N), load (N), sinkage with deviation (m).
struct Row {
    angle: f64,
    slip: f64,
    fx: [f64; 2],
    fy: f64,
    load: f64,
    sinkage: [f64; 2],
}

/// Runs it.
///
/// # Errors
/// The example does not build or ends with an error; a file cannot be written.
pub fn validate() -> Result<()> {
    let folder = root().join("docs/validation");
    let data = root().join("tests/reference/cmu_single_wheel.csv");
    let results = folder.join("cmu.jsonl");
    if std::env::var("TERRAMECH_CMU").as_deref() != Ok("page") {
        run(&mut cargo(["build", "--release", "--quiet", "-p", "fmu-terrain", "--example", "cmu"]))?;
        let mut command = Command::new(target().join("release/examples/cmu"));
        let threads = std::thread::available_parallelism().map_or(1, usize::from).to_string();
        command.arg("--data").arg(&data).arg("--results").arg(&results).args(["--threads", &threads]);
        run(&mut command)?;
    }
    page(&folder, &data, &results)
}

fn page(folder: &Path, data: &Path, results: &Path) -> Result<()> {
    let text = std::fs::read_to_string(data).with_context(|| format!("cannot read {}", data.display()))?;
    let rows: Vec<Row> = text.lines().filter(|l| l.starts_with("smooth")).map(row).collect::<Result<_>>()?;
    let text = std::fs::read_to_string(results).unwrap_or_default();
    let mut made: BTreeMap<String, Value> = BTreeMap::new();
    for line in text.lines() {
        let value: Value = serde_json::from_str(line).with_context(|| format!("{}: {line}", results.display()))?;
        made.insert(value["key"].as_str().unwrap_or_default().to_string(), value);
    }
    let mut page = String::from(
        "# Validation: a wheel in real sand\n\nWritten by `cargo xtask validate cmu` from `cmu.jsonl`; the study is the example `cmu` of `fmu-terrain`, \
         whose pages say what is done; the experiments and their source are in `tests/reference/cmu_single_wheel.csv`. It goes on where it was \
         stopped. Smooth rigid wheel of radius 58 mm, 50 mm wide, under the measured load, at the measured slip; forces in the wheel's frame, \
         Fy to the left of a heading that is turned to the left of the way (the sign that the rows of the locked wheel show). Speeds scaled up \
         as far as (omega R)^2/(g R) stays below 0.01. Grains of radius 5 mm (4.5 to 5.5): the wheel is five grains wide.\n\n",
    );
    calibration(&mut page, &made)?;
    let counts = table(&mut page, &rows, &made)?;
    writeln!(page, "{counts}\n")?;
    convergence(&mut page, &made)?;
    for (file, title, unit, measured, computed) in [
        ("cmu-pull.svg", "Pull", "N", 0, "fx"),
        ("cmu-side.svg", "Side force", "N", 1, "fy"),
        ("cmu-sinkage.svg", "Sinkage", "m", 2, "sinkage"),
    ] {
        let mut plot = Plot::new(format!("{title} over slip"), Axis::new("slip", ""), Axis::new(title, unit));
        for angle in [0.0, 15.0, 45.0] {
            let of = || rows.iter().filter(|r| r.angle == angle);
            let x: Vec<f64> = of().map(|r| r.slip).collect();
            let y: Vec<f64> = of().map(|r| [r.fx[0], r.fy, r.sinkage[0]][measured]).collect();
            plot = plot.with(format!("measured, {angle} deg"), &x, &y, Style::Points);
            let known = || of().filter_map(|r| Some((r.slip, made.get(&key(r))?[computed].as_f64()?)));
            let (x, y): (Vec<f64>, Vec<f64>) = known().unzip();
            plot = plot.with_same_colour(format!("computed, {angle} deg"), &x, &y, Style::Line);
        }
        std::fs::write(folder.join(file), plot.svg()).with_context(|| format!("cannot write {file}"))?;
        writeln!(page, "![{title}]({file})\n")?;
    }
    let path = folder.join("cmu.md");
    std::fs::write(&path, page.trim_end().to_string() + "\n")
        .with_context(|| format!("cannot write {}", path.display()))?;
    eprintln!("== {}", path.display());
    Ok(())
}

fn row(line: &str) -> Result<Row> {
    let x: Vec<f64> = line
        .split(',')
        .skip(1)
        .map(|t| t.parse::<f64>().with_context(|| format!("not a row: {line}")))
        .collect::<Result<_>>()?;
    let [angle, _, _, slip, fx, sd, fy, load, sinkage, deviation] = x[..] else {
        anyhow::bail!("not a row: {line}");
    };
    Ok(Row { angle, slip, fx: [fx, sd], fy, load, sinkage: [1e-3 * sinkage, 1e-3 * deviation] })
}

fn key(r: &Row) -> String {
    format!("row {} {}", r.angle, r.slip)
}

fn number(v: &Value, name: &str) -> f64 {
    v[name].as_f64().unwrap_or(f64::NAN)
}

fn calibration(page: &mut String, made: &BTreeMap<String, Value>) -> Result<()> {
    page.push_str("## Calibration\n\nRepose angle 29 deg and bulk density 1330 kg/m3 first, then two parameters on slip angle 0, slips -0.2, 0.231, 0.5: the friction of the \
         wheel, and *laying*, the factor on the frictions between grains while the bed is poured, which decides how dense it lies. Measured on \
         these rows: pull -7.31, 0.70, 0.97 N, sinkage 15.1, 17.9, 22.7 mm.\n\n");
    page.push_str("| trial | result |\n|---|---|\n");
    for (key, v) in made.range("packing".to_string()..).take_while(|(k, _)| k.starts_with("packing")) {
        writeln!(
            page,
            "| {key} (grain friction, rolling friction, laying) | packing fraction {:.3} |",
            number(v, "fraction")
        )?;
    }
    for (key, v) in made.range("repose".to_string()..).take_while(|(k, _)| k.starts_with("repose")) {
        writeln!(page, "| {key} (grain friction, rolling friction) | {:.1} deg |", number(v, "angle_deg"))?;
    }
    for (key, v) in made.range("calibrate".to_string()..).take_while(|(k, _)| k.starts_with("calibrate")) {
        let (fx, z) = (number(v, "fx"), 1e3 * number(v, "sinkage"));
        writeln!(
            page,
            "| {key} (grain friction, laying, wheel friction, slip angle, slip) | pull {fx:.2} N, sinkage {z:.1} mm |"
        )?;
    }
    if let Some(c) = made.get("chosen") {
        writeln!(
            page,
            "\nChosen: grain friction {}, rolling friction {:.3}, laying {}, wheel friction {}, grain density {:.0} kg/m3; sum of squared errors over \
             what counts as agreement {:.1} (six figures).",
            number(c, "friction"),
            number(c, "rolling"),
            number(c, "laying"),
            number(c, "wheel"),
            number(c, "density"),
            number(c, "error")
        )?;
    }
    page.push('\n');
    Ok(())
}

/// The table; how many rows agree, in words.
fn table(page: &mut String, rows: &[Row], made: &BTreeMap<String, Value>) -> Result<String> {
    page.push_str(
        "## Rows\n\nAgreement: pull within three deviations or 5 % of the load; sinkage within 15 % or 2 mm. m measured, c computed.\n\n\
         | angle deg | slip | Fx m, N | Fx c, N | error | Fy m, N | Fy c, N | error | sinkage m, mm | c, mm | error | agrees (Fx, sinkage) |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut agreed = [0; 3];
    for r in rows {
        let Some(v) = made.get(&key(r)) else {
            writeln!(
                page,
                "| {} | {} | {:.2} | not computed yet | | {:.2} | | | {:.1} | | | |",
                r.angle,
                r.slip,
                r.fx[0],
                r.fy,
                1e3 * r.sinkage[0]
            )?;
            continue;
        };
        let [fx, fy, z] = ["fx", "fy", "sinkage"].map(|k| number(v, k));
        let pull = (fx - r.fx[0]).abs() <= (3.0 * r.fx[1]).max(0.05 * r.load);
        let sinks = (z - r.sinkage[0]).abs() <= (0.15 * r.sinkage[0]).max(0.002);
        agreed[0] += 1;
        agreed[1] += usize::from(pull);
        agreed[2] += usize::from(sinks);
        let word = |x: bool| if x { "yes" } else { "no" };
        writeln!(
            page,
            "| {} | {} | {:.2} | {fx:.2} | {:+.2} | {:.2} | {fy:.2} | {:+.2} | {:.1} | {:.1} | {:+.1} | {}, {} |",
            r.angle,
            r.slip,
            r.fx[0],
            fx - r.fx[0],
            r.fy,
            fy - r.fy,
            1e3 * r.sinkage[0],
            1e3 * z,
            1e3 * (z - r.sinkage[0]),
            word(pull),
            word(sinks)
        )?;
    }
    Ok(format!(
        "\nOf {} rows, {} computed; pull agrees in {}, sinkage in {}.",
        rows.len(),
        agreed[0],
        agreed[1],
        agreed[2]
    ))
}

fn convergence(page: &mut String, made: &BTreeMap<String, Value>) -> Result<()> {
    page.push_str("## Convergence\n\nSlip angle 0. Difference from the row as it stands in the table.\n\n| slip | what is changed | pull N | difference | sinkage mm | difference | grains |\n|---|---|---|---|---|---|---|\n");
    for (name, v) in made.range("converge".to_string()..).take_while(|(k, _)| k.starts_with("converge")) {
        let mut words = name.splitn(3, ' ').skip(1);
        let (slip, what) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
        let base = made.get(&format!("row 0 {slip}"));
        let [fx, z] = ["fx", "sinkage"].map(|k| (number(v, k), base.map_or(f64::NAN, |b| number(b, k))));
        writeln!(
            page,
            "| {slip} | {what} | {:.2} | {:+.2} | {:.1} | {:+.1} | {} |",
            fx.0,
            fx.0 - fx.1,
            1e3 * z.0,
            1e3 * (z.0 - z.1),
            number(v, "grains")
        )?;
    }
    page.push('\n');
    for slip in ["0.231", "-0.2"] {
        let Some(base) = made.get(&format!("row 0 {slip}")) else { continue };
        let of = |name: String| made.get(&format!("converge {slip} {name}"));
        let beds: Vec<&Value> = (2..=5).filter_map(|k| of(format!("seed {k}"))).chain([base]).collect();
        let mut sizes: Vec<(f64, &Value)> =
            [6.25, 4.0, 3.2].into_iter().filter_map(|r| Some((r, of(format!("radius {r} mm"))?))).collect();
        sizes.push((5.0, base));
        if beds.len() < 5 || sizes.len() < 3 {
            continue;
        }
        write!(page, "Slip {slip}:")?;
        for (name, what, scale) in [("fx", "pull (N)", 1.0), ("sinkage", "sinkage (mm)", 1e3)] {
            let of_beds: Vec<f64> = beds.iter().map(|v| number(v, name)).collect();
            let [mean, deviation] = mean_and_deviation(&of_beds);
            let of_sizes: Vec<(f64, f64)> = sizes.iter().map(|(r, v)| (*r, number(v, name))).collect();
            write!(
                page,
                " {what} of five beds {:.2}, deviation {:.2}; by a line over {} radii, at radius 0: {:.2}.",
                scale * mean,
                scale * deviation,
                sizes.len(),
                scale * at_zero(&of_sizes)
            )?;
        }
        page.push_str("\n\n");
    }
    Ok(())
}
