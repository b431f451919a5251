//! `cargo xtask study checks`: what must hold for the coupled system whatever the study (validation, section 9), measured on the small studies.

use super::{out, terramech_at, write};
use crate::process::root;
use crate::statistics::mean_and_error;
use anyhow::{Context, Result};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use terramech_results::CsvTable;

/// Communication steps of case 9.1: H, 2 H, 5 H (s).
const STEPS: [&str; 3] = ["0.0002", "0.0004", "0.001"];
/// Seeds of beds for the scatter of case 9.6.
const SEEDS: [u64; 3] = [1, 2, 3];
/// Grade of case 9.7 (rad).
const SLOPE: f64 = 0.15;

/// One row of the table.
struct Row {
    case: &'static str,
    what: String,
    value: String,
    expected: String,
    holds: bool,
}

/// Runs them and writes `checks.md`.
///
/// # Errors
/// A run that fails, a file that cannot be written.
pub(super) fn checks(docs: &Path) -> Result<()> {
    let mut rows = Vec::new();
    let base = steps(&mut rows)?;
    energy(&base, &mut rows)?;
    rest(&base, &mut rows)?;
    mirrored(&mut rows)?;
    let mut text = String::from(
        "# The coupled system: what must hold whatever the study\n\nWritten by `cargo xtask study checks`, on the small studies (`examples/straight-line`, `examples/obstacle`). Cases of section 9 \
         of the validation; 9.2 (impulses in the loop) is `docs/validation/ancf.md`, 9.6 and 9.7 on rigid ground are `tests/fmpy/test_handling.py` and `test_slope.py`.\n\n\
         | case | what | computed | expected | holds |\n|---|---|---|---|---|\n",
    );
    for r in rows {
        writeln!(
            text,
            "| {} | {} | {} | {} | {} |",
            r.case,
            r.what,
            r.value,
            r.expected,
            if r.holds { "yes" } else { "NO" }
        )?;
    }
    write(&docs.join("checks.md"), text.as_bytes())
}

/// Runs a description with another communication step: a copy of its folder beside a copy of the tires.
fn with_step(step: &str) -> Result<CsvTable> {
    let folder = out(&format!("checks-{step}"));
    let examples = folder.join("examples");
    for name in ["straight-line", "tires"] {
        let (from, to) = (root().join("examples").join(name), examples.join(name));
        std::fs::create_dir_all(&to)?;
        for entry in std::fs::read_dir(from)? {
            let entry = entry?;
            std::fs::copy(entry.path(), to.join(entry.file_name()))?;
        }
    }
    let file = examples.join("straight-line/system.ssd");
    let text = std::fs::read_to_string(&file)?;
    let change = |text: &str, from: &str, to: &str| -> Result<String> {
        anyhow::ensure!(text.contains(from), "{} has no {from}", file.display());
        Ok(text.replace(from, to))
    };
    let text = change(&text, "baseStepSize=\"0.0002\"", &format!("baseStepSize=\"{step}\""))?;
    // Whole multiples of every step.
    let text = change(&text, "Recording every=\"0.005\"", "Recording every=\"0.01\"")?;
    std::fs::write(&file, text)?;
    run(&file, &folder.join("out"), &["--stop-time".into(), "1.5".into()])
}

fn run(file: &Path, out: &Path, more: &[String]) -> Result<CsvTable> {
    terramech_at(file, out, more)?;
    Ok(CsvTable::read(out.join("results.csv"))?)
}

/// Mean of a column over a window (s).
fn mean(csv: &CsvTable, name: &str, [from, to]: [f64; 2]) -> Result<f64> {
    let values = csv.numbers(name).with_context(|| format!("no column '{name}'"))?;
    let rows: Vec<usize> = (0..csv.time.len()).filter(|&k| (from..=to).contains(&csv.time[k])).collect();
    Ok(rows.iter().map(|&k| values[k]).sum::<f64>() / rows.len().max(1) as f64)
}

/// Change of a column over the run.
fn change(csv: &CsvTable, name: &str) -> Result<f64> {
    let values = csv.numbers(name).with_context(|| format!("no column '{name}'"))?;
    Ok(values.last().copied().unwrap_or_default() - values.first().copied().unwrap_or_default())
}

/// Sum of the wheels' forces along an axis, mean over a window.
fn wheels(csv: &CsvTable, axis: &str, window: [f64; 2]) -> Result<f64> {
    (1..=4).map(|i| mean(csv, &format!("vehicle.wheel[{i}].force.{axis}"), window)).sum()
}

/// Case 9.1; gives the run with the smallest step.
fn steps(rows: &mut Vec<Row>) -> Result<CsvTable> {
    let runs: Vec<CsvTable> = STEPS.iter().map(|s| with_step(s)).collect::<Result<_>>()?;
    let load = |csv: &CsvTable| wheels(csv, "z", [0.35, 0.5]);
    let figure = |csv: &CsvTable| -> Result<[f64; 3]> {
        Ok([load(csv)?, mean(csv, "vehicle.speed", [1.45, 1.5])?, change(csv, "vehicle.engine_work")?])
    };
    let first = figure(&runs[0])?;
    for (csv, step) in runs.iter().zip(STEPS).skip(1) {
        let now = figure(csv)?;
        let names = ["sum of the wheel loads at rest", "speed at 1.5 s", "engine work to 1.5 s"];
        for ((name, a), (b, limit)) in names.iter().zip(first).zip(now.into_iter().zip([0.01, 0.05, 0.05])) {
            let error = b / a - 1.0;
            rows.push(Row {
                case: "9.1",
                what: format!("{name}: H = {step} s against {} s", STEPS[0]),
                value: format!("{:+.2} %", 100.0 * error),
                expected: format!("within {:.0} %", 100.0 * limit),
                holds: error.abs() <= limit,
            });
        }
    }
    runs.into_iter().next().context("a run")
}

/// Case 9.4.
fn energy(csv: &CsvTable, rows: &mut Vec<Row>) -> Result<()> {
    let engine = change(csv, "vehicle.engine_work")?;
    let vehicle: f64 = ["kinetic", "potential", "dissipated"]
        .iter()
        .map(|n| change(csv, &format!("vehicle.{n}_energy")))
        .sum::<Result<f64>>()?;
    let mut tires = 0.0;
    for i in 1..=4 {
        for (name, sign) in [("strain_energy", 1.0), ("dissipated_energy", 1.0), ("pressure_work", -1.0)] {
            tires += sign * change(csv, &format!("tire{i}.{name}"))?;
        }
    }
    let ground = change(csv, "terrain.body_work")?;
    let left = (engine - vehicle - tires - ground) / engine;
    rows.push(Row {
        case: "9.4",
        what: format!(
            "engine work {engine:.0} J less vehicle {vehicle:.0} J, tires {tires:.0} J, soil {ground:.0} J, over engine work"
        ),
        value: format!("{:+.2} %", 100.0 * left),
        expected: "within 1 %".into(),
        holds: left.abs() <= 0.01,
    });
    Ok(())
}

/// Case 9.7: at rest on level soil and on a grade.
fn rest(level: &CsvTable, rows: &mut Vec<Row>) -> Result<()> {
    let weight = 9.81 * mean(level, "vehicle.mass", [0.0, 0.5]).unwrap_or(2422.738 + 107.91 + 4.0 * 11.151);
    let mut put = |what: &str, force: f64, expected: f64, limit: f64| {
        let error = force / expected - 1.0;
        rows.push(Row {
            case: "9.7",
            what: what.into(),
            value: format!("{force:.0} N, {:+.1} %", 100.0 * error),
            expected: format!("{expected:.0} N within {:.0} %", 100.0 * limit),
            holds: error.abs() <= limit,
        });
    };
    put("at rest on level soil: sum of the wheel loads", wheels(level, "z", [0.35, 0.5])?, weight, 0.03);
    let vehicle = root().join("examples/straight-line/vehicle.json");
    let mut vehicle: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(vehicle)?)?;
    vehicle["driver"] = serde_json::json!({ "kind": { "table": { "points": [{ "time": 0, "braking": 1 }] } } });
    let units = ["vehicle", "terrain", "tire1", "tire2", "tire3", "tire4"];
    let mut more: Vec<String> = units.iter().flat_map(|u| ["--set".into(), format!("{u}.slope={SLOPE}")]).collect();
    more.extend(["--set".into(), format!("vehicle.specification={vehicle}"), "--stop-time".into(), "0.9".into()]);
    let csv = run(&root().join("examples/straight-line/system.ssd"), &out("checks-slope"), &more)?;
    let window = [0.7, 0.9];
    put(&format!("braked on a grade of {SLOPE} rad: across"), wheels(&csv, "z", window)?, weight * SLOPE.cos(), 0.03);
    put(&format!("braked on a grade of {SLOPE} rad: along"), wheels(&csv, "x", window)?, weight * SLOPE.sin(), 0.05);
    Ok(())
}

/// Case 9.6: the cylinder under the right wheels instead of the left ones, against the scatter of beds. Beds poured from a grid of a few layers
/// keep some of its order, which is the same for every seed and no mirror image of itself: these are poured at random.
fn mirrored(rows: &mut Vec<Row>) -> Result<()> {
    let file = root().join("examples/obstacle/terrain.json");
    let soil: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(file)?)?;
    let of = |name: &str, seed: u64, side: f64| -> Result<CsvTable> {
        let mut soil = soil.clone();
        soil["bed"]["seed"] = seed.into();
        soil["bed"]["placing"] = "poisson_disk".into();
        let y = soil["obstacles"][0]["position"][1].as_f64().context("obstacles[0].position")?;
        soil["obstacles"][0]["position"][1] = (side * y).into();
        let more = ["--set".to_string(), format!("terrain.specification={soil}"), "--stop-time".into(), "0.6".into()];
        let folder: PathBuf = out(&format!("checks-{name}"));
        run(&root().join("examples/obstacle/system.ssd"), &folder, &more)
    };
    // Largest roll, least speed, greatest load of the front wheel on the cylinder's side.
    let figures = |csv: &CsvTable, side: f64| -> Result<[f64; 3]> {
        let column = |name: &str| csv.numbers(name).map(<[f64]>::to_vec).with_context(|| format!("no column '{name}'"));
        let wheel = if side > 0.0 { 1 } else { 2 };
        let greatest = |v: Vec<f64>| v.into_iter().fold(f64::NEG_INFINITY, f64::max);
        Ok([
            greatest(column("vehicle.roll")?.into_iter().map(|x| side * x).collect()),
            -greatest(column("vehicle.speed")?.into_iter().map(|x| -x).collect()),
            greatest(column(&format!("vehicle.wheel[{wheel}].force.z"))?),
        ])
    };
    let (mut left, mut right) = (Vec::new(), Vec::new());
    for seed in SEEDS {
        left.push(figures(&of(&format!("left-{seed}"), seed, 1.0)?, 1.0)?);
        right.push(figures(&of(&format!("right-{seed}"), seed, -1.0)?, -1.0)?);
    }
    for (k, (name, unit)) in
        [("largest roll", "rad"), ("least speed", "m/s"), ("greatest load on the cylinder", "N")].iter().enumerate()
    {
        let [[left, a], [right, b]] =
            [&left, &right].map(|runs| mean_and_error(&runs.iter().map(|f| f[k]).collect::<Vec<_>>()));
        let limit = 3.0 * a.hypot(b);
        rows.push(Row {
            case: "9.6",
            what: format!("obstacle mirrored: {name} ({unit}), means of {} beds", SEEDS.len()),
            value: format!("{right:.4}"),
            expected: format!("{left:.4} within {limit:.4} (three standard errors)"),
            holds: (right - left).abs() <= limit,
        });
    }
    Ok(())
}
