//! `cargo xtask validate [NAME]`: the validation cases with their long versions, as tables in `docs/validation/`.
//!
//! One mechanism for all crates: a test prints a line `VALIDATION|case|quantity|unit|expected|computed|tolerance` for each figure it
//! checks (the test itself decides whether it passes); this task runs the tests of a part and makes the table. Beside it stands a plot of
//! every figure's error over its tolerance, and a plot for each `CURVE` a test prints ([`plots`]).

mod cmu;
mod plots;

use crate::process::{cargo, root};
use anyhow::{Context, Result, bail};
use std::fmt::Write as _;
use std::io::{BufRead, BufReader};
use std::process::Stdio;

/// Where the plots go into the text, which is written before them.
const PLOTS: &str = "@plots@";

/// A part of the validation: name, title, what `cargo test` is given.
struct Part {
    name: &'static str,
    title: &'static str,
    /// What the cases that belong to it begin with; empty = whatever the tests print.
    sections: &'static [&'static str],
    args: &'static [&'static str],
}

const PARTS: &[Part] = &[
    Part {
        name: "dem-p",
        title: "DEM-P terrain",
        sections: &["2.", "9.2", "9.8"],
        args: &[
            "--package",
            "fmu-terrain",
            "--test",
            "bed_at_rest",
            "--test",
            "cohesion",
            "--test",
            "flows",
            "--test",
            "free_flight",
            "--test",
            "impact",
            "--test",
            "mesh_contact",
            "--test",
            "offset",
            "--test",
            "rolling",
            "--test",
            "soil_tests",
        ],
    },
    Part {
        name: "dem-c",
        title: "DEM-C terrain",
        sections: &["3"],
        args: &[
            "--package",
            "fmu-terrain",
            "--package",
            "terramech-mechanics",
            "--lib",
            "--test",
            "dem_c",
            "--test",
            "dem_c_wheel",
            "--test",
            "dem_c_cost",
        ],
    },
    Part { name: "ancf", title: "ANCF shell and flexible tire", sections: &[], args: &["--package", "fmu-tire"] },
    Part {
        name: "vehicle",
        title: "Vehicle and multibody",
        sections: &[],
        args: &["--package", "fmu-vehicle", "--package", "terramech-handling-tires"],
    },
    Part {
        name: "algorithms",
        title: "Coupling algorithms",
        sections: &[],
        args: &["--package", "terramech", "--test", "algorithms"],
    },
    Part { name: "coupling", title: "Coupled system", sections: &[], args: &["--package", "terramech-system-tests"] },
];

/// Runs one part or all.
///
/// # Errors
/// An unknown name, or a case that fails.
pub fn validate(name: Option<&str>) -> Result<()> {
    // An hour: only when asked for.
    if name == Some("cmu") {
        return cmu::validate();
    }
    let parts: Vec<&Part> = PARTS.iter().filter(|p| name.is_none_or(|n| n == p.name)).collect();
    if parts.is_empty() {
        let known: Vec<&str> = PARTS.iter().map(|p| p.name).chain(["cmu"]).collect();
        bail!("validation '{}' is unknown; there are: {}", name.unwrap_or_default(), known.join(", "));
    }
    let mut failed = Vec::new();
    for part in parts {
        if !run(part)? {
            failed.push(part.name);
        }
    }
    if !failed.is_empty() {
        bail!("cases of {} fail; the table shows the figures that were reached", failed.join(", "));
    }
    Ok(())
}

fn run(part: &Part) -> Result<bool> {
    let mut args = vec!["test", "--release", "--quiet"];
    args.extend(part.args);
    args.extend(["--", "--nocapture", "--include-ignored", "--test-threads", "1"]);
    eprintln!("== {}: cargo {}", part.title, args.join(" "));
    let mut child = cargo(&args).stdout(Stdio::piped()).spawn().context("cannot start cargo")?;
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut curves = plots::Curves::default();
    for line in BufReader::new(child.stdout.take().expect("piped")).lines() {
        let line = line?;
        if let Some((_, row)) = line.split_once("VALIDATION|") {
            eprintln!("   {row}");
            // Tests of one crate may belong to two parts.
            if !part.sections.is_empty() && !part.sections.iter().any(|s| row.trim_start().starts_with(s)) {
                continue;
            }
            rows.push(row.split('|').map(|s| s.trim().to_string()).collect());
        } else if let Some((_, curve)) = line.split_once("CURVE|") {
            curves.add(curve)?;
        } else {
            eprintln!("{line}");
        }
    }
    let passed = child.wait()?.success();
    rows.sort_by(|a, b| natural(&a[0]).cmp(&natural(&b[0])));
    let mut text = format!(
        "# Validation: {}\n\nWritten by `cargo xtask validate {}`; the cases and their sources are those of the tests. Values in SI units unless \
         the unit says otherwise. Tolerances are absolute.\n\n{PLOTS}| case | quantity | unit | expected | computed | error | tolerance |\n|---|---|---|---|---|---|---|\n",
        part.title, part.name
    );
    for row in &rows {
        let cell = |i: usize| row.get(i).map_or("", String::as_str);
        let error = match (cell(3).parse::<f64>(), cell(4).parse::<f64>()) {
            (Ok(e), Ok(c)) if e != 0.0 => format!("{:+.2e} relative", c / e - 1.0),
            (Ok(e), Ok(c)) => format!("{:+.2e}", c - e),
            _ => String::new(),
        };
        writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} |",
            cell(0),
            cell(1),
            cell(2),
            cell(3),
            cell(4),
            error,
            cell(5)
        )?;
    }
    let folder = root().join("docs/validation");
    std::fs::create_dir_all(&folder)?;
    let path = folder.join(format!("{}.md", part.name));
    let pictures = plots::write(&folder, part.name, part.title, &rows, &curves)?;
    std::fs::write(&path, text.replacen(PLOTS, &pictures, 1))
        .with_context(|| format!("cannot write {}", path.display()))?;
    eprintln!("== {} figures in {}", rows.len(), path.display());
    Ok(passed)
}

/// Sorts "2.10" after "2.9".
fn natural(case: &str) -> Vec<u64> {
    case.split(|c: char| !c.is_ascii_digit()).filter_map(|n| n.parse().ok()).collect()
}
