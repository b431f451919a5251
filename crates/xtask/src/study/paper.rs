//! `cargo xtask study NAME --paper`: a vehicle study in its published size, and the events of the publication (section 8 of the validation page) looked for in what came out.
//!
//! The run takes hours. It writes a checkpoint every tenth of a simulated second; asked for again it goes on from there, and one that has ended is only looked at.

use super::{out, plots, terramech, write};
use crate::pack;
use crate::process::{run, target};
use anyhow::{Context, Result, bail};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use terramech_results::report::{Axis, Plot, Style};
use terramech_results::{CsvTable, ExitState, Manifest};

/// Rows: what it is, what the publication says, what came out.
type Rows = Vec<(String, &'static str, String)>;

/// Runs it as far as it has not yet, or looks at the run in `folder`; writes `paper-NAME.md`, plots and the picture.
///
/// # Errors
/// A study that is not a vehicle's, a run that fails, a column that is not there, a file that cannot be written.
pub(super) fn paper(name: &str, folder: Option<&Path>, docs: &Path) -> Result<()> {
    // Before hours of work.
    let look = match name {
        "straight-line" => straight_line,
        "obstacle" => obstacle,
        "turn" => turn,
        "multi-pass" => return passes(folder, docs),
        _ => bail!("study '{name}' has no published size; there are: straight-line, obstacle, turn, multi-pass"),
    };
    let folder = match folder {
        Some(folder) => folder.to_owned(),
        None => {
            pack::pack()?;
            go_on(name)?
        }
    };
    let csv = CsvTable::read(folder.join("results.csv"))?;
    let manifest = Manifest::read(folder.join("manifest.json"))?;
    let seen = Seen { csv: &csv };
    let rows = look(&seen)?;
    let ended = match &manifest.state {
        ExitState::Done => "at its stop time".to_owned(),
        ExitState::Stopped { reason } => reason.clone(),
        other => bail!("the run in {} has not ended: {other:?}", folder.display()),
    };
    let mut text = format!(
        "# {name}, published size\n\nWritten by `cargo xtask study {name} --paper` from a run of `examples/{name}/paper.ssd`: {:.2} s simulated in {} of wall time on {} ({} threads). It ended: {ended}.\n\n\
         | | said | computed |\n|---|---|---|\n",
        manifest.simulated_seconds,
        hours(manifest.wall_seconds),
        manifest.machine.cpu,
        manifest.threads,
    );
    for (what, said, computed) in rows {
        writeln!(text, "| {what} | {said} | {computed} |")?;
    }
    let prefix = format!("paper-{name}");
    for (title, file) in plots(&prefix, name, &csv, docs)? {
        writeln!(text, "\n![{title}]({file})")?;
    }
    let picture = std::fs::read(folder.join("scene.png")).context("the run drew no scene.png")?;
    write(&docs.join(format!("{prefix}.png")), &picture)?;
    writeln!(text, "\n![The system where the run ended: tires coloured by strain]({prefix}.png)")?;
    write(&docs.join(format!("{prefix}.md")), text.as_bytes())
}

/// Starts the run or goes on with it; gives its folder.
fn go_on(name: &str) -> Result<PathBuf> {
    let folder = out(&format!("paper-{name}"));
    reach(&folder, name, &[])?;
    Ok(folder)
}

/// Brings the run in a folder to its end, from the beginning or from where it was stopped.
fn reach(folder: &Path, name: &str, more: &[String]) -> Result<()> {
    let ended = Manifest::read(folder.join("manifest.json")).is_ok_and(|m| match m.state {
        ExitState::Done => true,
        ExitState::Stopped { reason } => !reason.contains("on request"),
        _ => false,
    });
    if ended {
        return Ok(());
    }
    if folder.join("checkpoint").exists() {
        return run(Command::new(target().join("release/terramech")).arg("run").arg("--resume").arg(folder));
    }
    let more = [&["--checkpoint-every", "0.098"].map(String::from)[..], more].concat();
    terramech(&format!("{name}/paper.ssd"), folder, &more)
}

/// Three passes of the rig over one bed, each from the bed that the one before left. Means over the last 0.6 s, in which the wheel rolls 1.2 m.
fn passes(folder: Option<&Path>, docs: &Path) -> Result<()> {
    const STOP: &str = "1.6";
    let place = folder.map_or_else(|| out("paper-multi-pass"), Path::to_owned);
    if folder.is_none() {
        pack::pack()?;
        std::fs::create_dir_all(&place).with_context(|| format!("cannot make {}", place.display()))?;
    }
    let bed = |pass: usize| place.join(format!("{pass}.bed")).display().to_string();
    let mut text = format!(
        "# multi-pass, published size\n\nWritten by `cargo xtask study multi-pass --paper`: `examples/multi-pass/paper.ssd` (tire of 90 x 24 layered shells, 5 kN, 2 m/s, slip 0.2; bed of 10 x 0.6 m, grains of \
         6 mm, 80 kPa), one bed, means from 1 to {STOP} s. Sinkage counts from the untouched bed.\n\n| pass | sinkage (mm) | increment (mm) | drawbar pull (N) | wheel torque (N m) | wall time |\n|---|---|---|---|---|---|\n"
    );
    let axes = |y: &str, unit: &str| (Axis::new("position of the carriage", "m"), Axis::new(y, unit));
    let ((x1, y1), (x2, y2)) = (axes("sinkage", "m"), axes("drawbar pull", "N"));
    let mut plots = [Plot::new("Sinkage, pass by pass", x1, y1), Plot::new("Drawbar pull, pass by pass", x2, y2)];
    let mut before = 0.0;
    for pass in 1..=3 {
        let run = place.join(format!("pass{pass}"));
        let mut more = vec!["--stop-time".to_owned(), STOP.to_owned()];
        let set = |name: &str, path: String| ["--set".to_owned(), format!("terrain.{name}={path}")];
        more.extend(set("bed_save_end", bed(pass)));
        if pass > 1 {
            more.extend(set("bed_load", bed(pass - 1)));
        }
        if folder.is_none() {
            reach(&run, "multi-pass", &more)?;
        }
        let csv = CsvTable::read(run.join("results.csv"))?;
        let seen = Seen { csv: &csv };
        let of = |name: &str| -> Result<&[f64]> {
            let name = format!("rig.{name}");
            csv.numbers(&name).with_context(|| format!("results.csv has no column '{name}'"))
        };
        let mean = |name: &str| -> Result<f64> { Ok(seen.mean(of(name)?, 1.0, f64::INFINITY)) };
        for (plot, name) in plots.iter_mut().zip(["sinkage_filtered", "drawbar_pull_filtered"]) {
            *plot = plot.clone().with(format!("pass {pass}"), of("carrier.position")?, of(name)?, Style::Line);
        }
        let sinkage = 1e3 * mean("sinkage")?;
        let manifest = Manifest::read(run.join("manifest.json"))?;
        writeln!(
            text,
            "| {pass} | {sinkage:.1} | {:.1} | {:.0} | {:.0} | {} |",
            sinkage - before,
            mean("drawbar_pull")?,
            mean("wheel_torque")?,
            hours(manifest.wall_seconds)
        )?;
        before = sinkage;
    }
    for (plot, name) in plots.iter().zip(["sinkage", "pull"]) {
        let file = format!("paper-multi-pass-{name}.svg");
        write(&docs.join(&file), plot.svg().as_bytes())?;
        writeln!(text, "\n![{}]({file})", plot.title)?;
    }
    write(&docs.join("paper-multi-pass.md"), text.as_bytes())
}

fn hours(seconds: f64) -> String {
    if seconds < 3600.0 { format!("{:.0} min", seconds / 60.0) } else { format!("{:.1} h", seconds / 3600.0) }
}

/// Columns of a run, and what is read off them.
struct Seen<'a> {
    csv: &'a CsvTable,
}

impl<'a> Seen<'a> {
    fn time(&self) -> &'a [f64] {
        &self.csv.time
    }

    fn of(&self, name: &str) -> Result<&'a [f64]> {
        let name = format!("vehicle.{name}");
        self.csv.numbers(&name).with_context(|| format!("results.csv has no column '{name}'"))
    }

    fn wheel(&self, k: usize, what: &str) -> Result<&'a [f64]> {
        self.of(&format!("wheel[{k}].{what}"))
    }

    /// Sum over some wheels.
    fn sum(&self, wheels: &[usize], what: &str) -> Result<Vec<f64>> {
        let mut all = vec![0.0; self.time().len()];
        for &k in wheels {
            all.iter_mut().zip(self.wheel(k, what)?).for_each(|(sum, x)| *sum += x);
        }
        Ok(all)
    }

    /// Mean from `from` to `to` (s).
    fn mean(&self, values: &[f64], from: f64, to: f64) -> f64 {
        let inside = self.time().iter().zip(values).filter(|(t, _)| (from..to).contains(*t)).map(|(_, v)| *v);
        let (sum, count) = inside.fold((0.0, 0_u32), |(s, n), v| (s + v, n + 1));
        sum / f64::from(count.max(1))
    }

    /// Means over 0.04 s around each time: what the grains do to a wheel flickers.
    fn smooth(&self, values: &[f64]) -> Vec<f64> {
        let time = self.time();
        let (mut from, mut to, mut sum) = (0, 0, 0.0);
        time.iter()
            .map(|t| {
                while to < time.len() && time[to] <= t + 0.02 {
                    sum += values[to];
                    to += 1;
                }
                while time[from] < t - 0.02 {
                    sum -= values[from];
                    from += 1;
                }
                sum / (to - from) as f64
            })
            .collect()
    }

    /// The first time (s) and place at which it holds.
    fn first(&self, holds: impl Fn(usize) -> bool) -> Option<(f64, usize)> {
        (0..self.time().len()).find(|k| holds(*k)).map(|k| (self.time()[k], k))
    }

    /// Spans of time (s) longer than `least` in which it holds.
    fn spans(&self, least: f64, holds: impl Fn(usize) -> bool) -> Vec<[f64; 2]> {
        let mut spans: Vec<[f64; 2]> = Vec::new();
        let mut open = false;
        for (k, &t) in self.time().iter().enumerate() {
            match (holds(k), open) {
                (true, false) => spans.push([t, t]),
                (true, true) => spans.last_mut().into_iter().for_each(|s| s[1] = t),
                _ => {}
            }
            open = holds(k);
        }
        spans.retain(|s| s[1] - s[0] >= least);
        spans
    }
}

fn straight_line(seen: &Seen) -> Result<Rows> {
    let loads = seen.sum(&[1, 2, 3, 4], "force.z")?;
    let (x, speed, gear) = (seen.of("chassis.position.x")?, seen.of("speed")?, seen.of("gear")?);
    let most = loads.iter().copied().fold(0.0, f64::max);
    let at = seen.first(|k| loads[k] == most).map_or(0.0, |f| f.0);
    let mut rows = vec![
        (
            "drop".into(),
            "in the first second",
            format!("from 50 mm; the tires together carry at most {:.1} kN, at {at:.2} s", most / 1e3),
        ),
        (
            "wheel loads at rest".into(),
            "-",
            format!(
                "0.85 to 1.0 s, at the spindles: {:.0} N, front axle {:.0} N, rear {:.0} N",
                seen.mean(&loads, 0.85, 1.0),
                seen.mean(&seen.sum(&[1, 2], "force.z")?, 0.85, 1.0),
                seen.mean(&seen.sum(&[3, 4], "force.z")?, 0.85, 1.0)
            ),
        ),
    ];
    let half = |wheels: &[usize], what: &str| -> Result<Vec<f64>> {
        Ok(seen.sum(wheels, what)?.into_iter().map(|v| 0.5 * v).collect())
    };
    let (front, rear) = (half(&[1, 2], "position.x")?, half(&[3, 4], "position.x")?);
    let stood = seen.mean(&front, 0.85, 1.0);
    let (zf, zr) = (half(&[1, 2], "position.z")?, half(&[3, 4], "position.z")?);
    let rest = [seen.mean(&zf, 0.85, 1.0), seen.mean(&zr, 0.85, 1.0)];
    if let Some((time, k)) = seen.first(|k| rear[k] >= stood) {
        let span = 0.15;
        let axle = |w: &[usize]| seen.sum(w, "force.x");
        let (before, after) = ([time - span, time], [time + 0.02, time + 0.02 + span]);
        let told = |v: &[f64], scale: f64, digits: usize| {
            let [a, b] = [before, after].map(|[from, to]| scale * seen.mean(v, from, to));
            format!("{a:.digits$} before, {b:.digits$} after")
        };
        rows.push((
            "rear tires come to where the front tires stood".into(),
            "at about 3.4 s, falling into the ruts",
            format!("at {time:.2} s, at {:.2} m/s", speed[k]),
        ));
        let above = |z: &[f64], rest: f64| z.iter().map(|z| z - rest).collect::<Vec<_>>();
        rows.push((
            "centres of the rear wheels over those at rest (mm)".into(),
            "fall",
            told(&above(&zr, rest[1]), 1e3, 1),
        ));
        rows.push((
            "centres of the front wheels over those at rest (mm)".into(),
            "-",
            told(&above(&zf, rest[0]), 1e3, 1),
        ));
        rows.push(("net force of the rear axle (N)".into(), "larger after", told(&axle(&[3, 4])?, 1.0, 0)));
        let share: Vec<f64> = axle(&[3, 4])?.iter().zip(axle(&[1, 2])?).map(|(r, f)| 100.0 * r / (r + f)).collect();
        rows.push(("its share of both axles' (%)".into(), "-", told(&share, 1.0, 1)));
        rows.push(("net force of the front axle (N)".into(), "-", told(&axle(&[1, 2])?, 1.0, 0)));
    }
    let shift = seen.first(|k| gear[k] > 1.5);
    rows.push((
        "first gear change".into(),
        "at 4.70 s",
        shift.map_or("none".into(), |(t, k)| {
            format!("at {t:.2} s, at {:.2} m/s and {:.2} m from the start", speed[k], x[k] - x[0])
        }),
    ));
    if let (Some(t), Some(v), Some(d)) = (seen.time().last(), speed.last(), x.last()) {
        rows.push(("end".into(), "-", format!("{t:.2} s, {v:.2} m/s, {:.2} m from the start", d - x[0])));
    }
    Ok(rows)
}

/// Dips of a speed: the least between two greater ones, at least 3 % below the one before and the one after; the greatest before it and itself, each with its place.
fn dips(speed: &[f64]) -> Vec<[(f64, usize); 2]> {
    let mut dips = Vec::new();
    let (mut top, mut low) = ((0.0, 0), (f64::INFINITY, 0));
    for (k, &v) in speed.iter().enumerate() {
        let deep = low.0 < 0.97 * top.0;
        if !deep && v > top.0 || deep && v > low.0 / 0.97 {
            if deep {
                dips.push([top, low]);
            }
            (top, low) = ((v, k), (f64::INFINITY, k));
        } else if v < low.0 {
            low = (v, k);
        }
    }
    dips
}

fn obstacle(seen: &Seen) -> Result<Rows> {
    let (x, speed) = (seen.of("chassis.position.x")?, seen.smooth(seen.of("speed")?));
    let mut rows = Rows::new();
    for (wheel, name) in [(1, "front left"), (3, "rear left")] {
        let z = seen.wheel(wheel, "position.z")?;
        // Once it stands on the soil.
        let stands = |k: usize| seen.time()[k] > 0.15;
        let top = (0..z.len()).filter(|&k| stands(k)).map(|k| z[k]).fold(f64::NEG_INFINITY, f64::max);
        if let Some((time, k)) = seen.first(|k| z[k] == top && stands(k)) {
            let rest = seen.mean(z, 0.15, 0.3);
            rows.push((
                format!("{name} wheel highest"),
                "over the cylinder",
                format!(
                    "{:.0} mm up, at {time:.2} s, chassis at x = {:.2} m, {:.2} m/s",
                    1e3 * (top - rest),
                    x[k],
                    speed[k]
                ),
            ));
        }
    }
    let dips = dips(&speed);
    let told: Vec<String> = dips
        .iter()
        .filter(|[top, _]| top.0 > 0.5)
        .map(|[(v, k), (w, j)]| {
            format!(
                "from {v:.2} m/s at x = {:.2} m to {w:.2} m/s at x = {:.2} m, {:.2} s",
                x[*k],
                x[*j],
                seen.time()[*j]
            )
        })
        .collect();
    let told = if told.is_empty() { "none of 3 % or more".into() } else { told.join("; ") };
    rows.push(("dips of forward speed".into(), "two, at x = 0 and x = 2.5 m", told));
    for (wheel, name) in [(1, "front left"), (3, "rear left")] {
        let load = seen.wheel(wheel, "force.z")?;
        let spans = seen.spans(0.015, |k| seen.time()[k] > 0.15 && load[k] < 1.0);
        let told: Vec<String> = spans.iter().map(|[a, b]| format!("{a:.2} to {b:.2} s")).collect();
        let most = load.iter().copied().fold(0.0, f64::max);
        let later = seen.time().iter().zip(load).filter(|(t, _)| **t > 0.15);
        let (when, least) =
            later.fold((0.0, f64::INFINITY), |(t, low), (u, f)| if *f < low { (*u, *f) } else { (t, low) });
        let told = if told.is_empty() { "never".into() } else { told.join(", ") };
        rows.push((
            format!("{name} tire off the ground"),
            "at times",
            format!("{told}; least load {:.2} kN at {when:.2} s, greatest {:.1} kN", least / 1e3, most / 1e3),
        ));
    }
    if let (Some(t), Some(v), Some(d)) = (seen.time().last(), speed.last(), x.last()) {
        rows.push(("end".into(), "-", format!("{t:.2} s, {v:.2} m/s, x = {d:.2} m")));
    }
    Ok(rows)
}

fn turn(seen: &Seen) -> Result<Rows> {
    let (steering, throttle) = (seen.of("driver_used.steering")?, seen.of("driver_used.throttle")?);
    let lateral = seen.smooth(seen.of("lateral_acceleration")?);
    let (x, y, speed) = (seen.of("chassis.position.x")?, seen.of("chassis.position.y")?, seen.of("speed")?);
    let last = seen.time().last().copied().unwrap_or(0.0);
    let most = steering.iter().map(|s| s.abs()).fold(0.0, f64::max);
    let mut rows = Rows::new();
    let begins = seen.first(|k| steering[k].abs() > 0.25 * most);
    rows.push((
        "steering rises".into(),
        "sharply at about 2.5 s",
        begins.map_or("never".into(), |(t, k)| {
            format!("a quarter of its most ({most:.2}) at {t:.2} s, x = {:.2} m", x[k])
        }),
    ));
    let spread = |v: &[f64], from: f64, to: f64| {
        let mean = seen.mean(v, from, to);
        let squares: Vec<f64> = v.iter().map(|v| (v - mean).powi(2)).collect();
        format!("{mean:.2} +- {:.2}", seen.mean(&squares, from, to).sqrt())
    };
    for (name, values) in [("steering", steering), ("throttle", throttle)] {
        rows.push((
            format!("{name}: mean and deviation"),
            "both settle",
            format!(
                "{} in the last second, {} in the one before",
                spread(values, last - 1.0, last),
                spread(values, last - 2.0, last - 1.0)
            ),
        ));
    }
    let radius: Vec<f64> = x.iter().zip(y).map(|(x, y)| x.hypot(*y)).collect();
    rows.push(("speed (m/s)".into(), "7.5", format!("{} in the last second", spread(speed, last - 1.0, last))));
    rows.push(("radius (m)".into(), "12", format!("{} in the last second", spread(&radius, last - 1.0, last))));
    let acceleration: Vec<f64> = lateral.iter().map(|a| a.abs()).collect();
    rows.push((
        "lateral acceleration (m/s2)".into(),
        "4.69",
        format!("{} in the last second", spread(&acceleration, last - 1.0, last)),
    ));
    rows.push(("end".into(), "-", format!("{last:.2} s")));
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dip_is_between_two_greater_speeds() {
        // A ripple of 1 % on the way up is none; one at the end that does not rise again is none.
        let speed = [2.0, 1.98, 2.1, 2.2, 1.5, 1.0, 1.02, 1.2, 2.0, 1.9, 2.1, 1.8];
        assert_eq!(dips(&speed), [[(2.2, 3), (1.0, 5)], [(2.0, 8), (1.9, 9)]]);
        assert!(dips(&[1.0, 2.0, 3.0]).is_empty());
        assert!(dips(&[]).is_empty());
    }
}
