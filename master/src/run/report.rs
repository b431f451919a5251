//! Manifest, report page and the closing table of a run.

use std::fmt::Write;
use std::time::Duration;

use terramech_results::report::Report;
use terramech_results::{
    CsvTable, Error, ExitState, Headline, Input, Manifest, RunFolder, Timings, UnitFacts, UnitTiming,
};

use super::display::{duration, short};
use super::host::Host;
use super::{End, Options, Outcome};
use crate::check::plan::Plan;
use crate::coupling::System;
use crate::exit::{self, ExitCode};
use crate::record::Recorder;

/// The manifest at the start of a run.
pub fn manifest(plan: &Plan, options: &Options) -> Manifest {
    let mut manifest = Manifest::start(env!("CARGO_PKG_VERSION"), options.command.clone());
    manifest.inputs = plan
        .inputs
        .iter()
        .map(|i| Input {
            path: i.path.display().to_string(),
            sha256: i.sha256.clone(),
            bytes: std::fs::metadata(&i.path).map_or(0, |m| m.len()),
        })
        .collect();
    manifest.threads = options.threads;
    // What units that choose a path at run time choose: the same rule, so the same answer.
    if let Ok(isa) = terramech_simd::Isa::chosen() {
        manifest.instruction_path = isa.to_string();
    }
    manifest
}

/// Adds units, and timings of a run from `since` (s of simulated time) on.
pub fn timings(manifest: &mut Manifest, system: &System, recorder: Option<&Recorder>, since: f64) {
    let plan = system.plan();
    let clockwork = system.clockwork();
    manifest.ranks = system.job().map_or(1, |job| job.size());
    let units = 0..plan.components.len();
    manifest.units = units
        .clone()
        .map(|i| UnitFacts {
            name: plan.components[i].name.clone(),
            model: plan.model(i).model_name.clone(),
            guid: plan.model(i).guid.clone(),
            version: plan.model(i).generation_tool.clone().unwrap_or_default(),
            threads: system.threads()[i] as usize,
            rank: system.job().map_or(0, |job| job.owner()[i]),
        })
        .collect();
    manifest.timings = Timings {
        since,
        initialise_seconds: clockwork.initialise,
        run_seconds: clockwork.run,
        units: units
            .map(|i| {
                let (calls, seconds) = system.effort(i);
                UnitTiming { name: plan.components[i].name.clone(), calls, seconds, share: 0.0 }
            })
            .collect(),
        coupling_seconds: clockwork.coupling,
        waiting_seconds: clockwork.waiting,
        io_seconds: clockwork.watching + recorder.map_or(0.0, Recorder::seconds),
        ..Timings::default()
    }
    .with_shares();
}

/// The state for the manifest.
pub fn exit_state(end: &End) -> ExitState {
    match end {
        End::Done => ExitState::Done,
        End::EndedBy { .. } | End::Condition { .. } | End::Stopped { .. } => ExitState::Stopped { reason: tell(end) },
        End::Failed(failure) => {
            ExitState::Failed { code: exit::code_of_failure(failure) as i32, message: failure.to_string() }
        }
    }
}

/// Writes `report.html`.
pub fn page(
    plan: &Plan,
    folder: &RunFolder,
    headlines: &[Headline],
    manifest: &Manifest,
    recorder: Option<&Recorder>,
) -> Result<(), Error> {
    let path = folder.file("results.csv");
    if !path.exists() {
        return Ok(());
    }
    let csv = CsvTable::read(path)?;
    let figures = recorder.map(Recorder::figures).unwrap_or_default();
    let mut report = Report::of_run(&plan.name, &csv, headlines, manifest, figures);
    if let Some((png, caption)) = recorder.and_then(Recorder::scene) {
        folder.write("scene.png", &png)?;
        report = report.with_picture("The system", png, caption);
    }
    report.write(folder)
}

/// The end of a run by a unit that does not return: its thread cannot be ended, so the process is.
pub fn give_up(
    host: &Host,
    folder: Option<&RunFolder>,
    mut manifest: Manifest,
    unit: &str,
    call: &str,
    limit: Duration,
) {
    let at = host.time().map_or_else(|| "before the start".into(), |t| format!("at t = {t} s"));
    let message = format!(
        "unit {unit} {at}: {call} has not returned for {} and shows no progress: the run is given up (--call-limit)",
        duration(limit.as_secs_f64())
    );
    host.say(&message);
    // Without a file of results the run had not started: an earlier one stays as it is.
    if let Some(folder) = folder.filter(|f| f.has_begun()) {
        manifest.simulated_seconds = host.time().unwrap_or(0.0);
        manifest.state = ExitState::Failed { code: ExitCode::Unit as i32, message };
        let _ = manifest.write(folder);
    }
    crate::archive::remove_temporaries();
    std::process::exit(ExitCode::Unit as i32);
}

/// One sentence on how a run ended.
pub fn tell(end: &End) -> String {
    match end {
        End::Done => "done".into(),
        End::EndedBy { unit, time } => format!("unit {unit} ended the run by itself at t = {time} s"),
        End::Condition { text, time } => format!("ended at t = {time} s: {text}"),
        End::Stopped { time: Some(time), saved: true } => {
            format!("stopped on request at t = {time} s; `terramech run --resume OUT` goes on from there")
        }
        End::Stopped { time: Some(time), saved: false } => format!("stopped on request at t = {time} s"),
        End::Stopped { time: None, .. } => "stopped on request during initialisation; nothing was written".into(),
        End::Failed(failure) => failure.to_string(),
    }
}

/// The table at the end of a run.
pub fn closing(outcome: &Outcome) -> String {
    let m = &outcome.manifest;
    let t = &m.timings;
    let mut text = String::new();
    if m.simulated_seconds == 0.0 {
        return "nothing was simulated; ".into();
    }
    // The last headlines are those of the power bonds, which have their own lines below.
    let heads = &outcome.headlines[..outcome.headlines.len() - outcome.bonds.len()];
    let width = heads.iter().map(|h| h.name.chars().count()).max().unwrap_or(0);
    for h in heads {
        let _ = write!(text, "{:width$}  {} {}", h.name, short(h.value), h.unit);
        if let Some([from, to]) = h.window {
            let _ = write!(text, "  (mean, t = {from} to {to} s)");
        }
        if let Some(measured) = h.measured {
            let _ = write!(text, "  measured: {} {}", short(measured), h.unit);
        }
        text.push('\n');
    }
    if !heads.is_empty() {
        text.push('\n');
    }
    let _ = write!(text, "{} s simulated in {}", short(m.simulated_seconds), duration(m.wall_seconds));
    let here = m.simulated_seconds - t.since;
    if t.since > 0.0 {
        let _ = write!(text, "; since it was resumed, {} s", short(here));
    }
    let _ = writeln!(
        text,
        " (initialisation {}, stepping {}, real-time factor {})",
        duration(t.initialise_seconds),
        duration(t.run_seconds),
        short(if t.run_seconds > 0.0 { here / t.run_seconds } else { 0.0 }),
    );
    for bond in &outcome.bonds {
        let _ = writeln!(text, "{}", bond.tell());
    }
    let width = t.units.iter().map(|u| u.name.len()).max().unwrap_or(0).max("recording".len());
    let mut row = |name: &str, seconds: f64, share: f64, more: String| {
        let _ = writeln!(text, "  {name:width$}  {:>10}  {:5.1} %{more}", duration(seconds), 100.0 * share);
    };
    for (unit, facts) in t.units.iter().zip(&m.units) {
        let threads = if facts.threads == 1 { "1 thread".into() } else { format!("{} threads", facts.threads) };
        let rank = if m.ranks > 1 { format!(", rank {}", facts.rank) } else { String::new() };
        row(&unit.name, unit.seconds, unit.share, format!("  {} steps, {threads}{rank}", unit.calls));
    }
    row("coupling", t.coupling_seconds, t.coupling_share, String::new());
    row("recording", t.io_seconds, t.io_share, String::new());
    if m.ranks > 1 {
        let share = if t.run_seconds > 0.0 { t.waiting_seconds / t.run_seconds } else { 0.0 };
        row("waiting", t.waiting_seconds, share, "  of rank 0, for the others".into());
    }
    text
}
