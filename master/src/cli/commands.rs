//! The commands, from typed arguments to their exit code.

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::args::{Args, Check, Command, Import, Inspect, Pack, System};
use crate::check;
use crate::check::plan::Plan;
use crate::checkpoint::How;
use crate::description::Audience;
use crate::fault::Faults;
use crate::inspect::{self, Form};
use crate::run::{self, ExitCode};

/// Carries out a command.
pub fn carry_out(args: Args, words: &[OsString]) -> ExitCode {
    match args.command {
        Command::Run(args) => super::run::run(&args, words),
        Command::Check(args) => check(&args),
        Command::Pack(args) => pack(&args),
        Command::Import(args) => import(&args),
        Command::Inspect(args) => inspect(&args),
        Command::Soil(args) => super::soil::soil(&args),
    }
}

/// What was typed about a system, with paths made absolute: what a checkpoint keeps to start the run again.
pub(super) fn how(system: &System) -> How {
    let absolute = |path: &PathBuf| std::path::absolute(path).unwrap_or_else(|_| path.clone());
    // From the working folder, else along --fmu-path, as the description's own FMUs.
    let found = |path: &str| {
        let along = system.fmu_path.iter().map(|folder| folder.join(path)).find(|p| p.exists());
        if Path::new(path).exists() { PathBuf::from(path) } else { along.unwrap_or_else(|| PathBuf::from(path)) }
    };
    let absolute_swap = |text: &String| match text.split_once('=') {
        Some((name, path)) if !path.is_empty() => format!("{name}={}", absolute(&found(path)).display()),
        _ => text.clone(),
    };
    How {
        system: system.system.clone().unwrap_or_default(),
        fmu_path: system.fmu_path.iter().map(absolute).collect(),
        stop_time: system.stop_time.clone(),
        set: system.set.clone(),
        algorithm: system.algorithm.clone(),
        params: system.params.iter().map(absolute).collect(),
        swap: system.swap.iter().map(absolute_swap).collect(),
        inputs: system.inputs.as_ref().map(absolute),
        stop_when: system.stop_when.clone(),
        ..How::default()
    }
}

pub(super) fn plan(how: &How, checking: bool) -> Result<Plan, Faults> {
    let options = check::Options {
        fmu_path: how.fmu_path.clone(),
        stop_time: how.stop_time.clone(),
        set: how.set.clone(),
        algorithm: how.algorithm.clone(),
        params: how.params.clone(),
        swap: how.swap.clone(),
        inputs: how.inputs.clone(),
        stop_when: how.stop_when.clone(),
        ..check::Options::default()
    };
    if checking && inspect::is_fmu(&how.system) {
        check::plan_of_fmu(&how.system, &options)
    } else {
        check::plan(&how.system, &options)
    }
}

/// Faults as one text, and their exit code.
pub(super) fn told(faults: &Faults) -> (String, ExitCode) {
    let mut text = faults.to_string();
    if faults.len() > 1 {
        text += &format!("\n{} faults; nothing was run", faults.len());
    }
    (text, if faults.exit_code() == 4 { ExitCode::Environment } else { ExitCode::Input })
}

/// Prints faults and gives their exit code.
fn tell(faults: &Faults) -> ExitCode {
    let (text, code) = told(faults);
    eprintln!("{text}");
    code
}

fn check(args: &Check) -> ExitCode {
    let how = how(&args.system);
    match plan(&how, true) {
        Ok(plan) => {
            for note in &plan.notes {
                eprintln!("note: {note}");
            }
            let failures = if args.no_units { Vec::new() } else { crate::coupling::try_units(&plan) };
            if let Some(first) = failures.first() {
                failures.iter().for_each(|failure| eprintln!("{failure}"));
                if failures.len() > 1 {
                    eprintln!("{} units object", failures.len());
                }
                return run::code_of_failure(first);
            }
            if inspect::is_fmu(&how.system) {
                let text = format!("{}: model {}: no fault\n", plan.file.display(), plan.model(0).model_name);
                let _ = std::io::stdout().lock().write_all(text.as_bytes());
                return ExitCode::Done;
            }
            let text = format!(
                "{}: {} units, {} connections, {} array connections; {} steps of {} s to t = {} s: no fault\n",
                plan.name,
                plan.components.len(),
                plan.connections.len(),
                plan.arrays.len(),
                plan.clock.steps,
                plan.clock.step,
                plan.clock.stop()
            );
            let _ = std::io::stdout().lock().write_all(text.as_bytes());
            if !args.stability {
                return ExitCode::Done;
            }
            let base = plan.clock.step;
            let cores = std::thread::available_parallelism().map_or(1, usize::from);
            match crate::coupling::stability_of(plan, cores) {
                Ok(found) => {
                    let text = format!("coupling at the start: {found} (base step {base} s)\n");
                    let _ = std::io::stdout().lock().write_all(text.as_bytes());
                    ExitCode::Done
                }
                Err(failure) => {
                    eprintln!("{failure}");
                    run::code_of_failure(&failure)
                }
            }
        }
        Err(faults) => tell(&faults),
    }
}

fn pack(args: &Pack) -> ExitCode {
    let options = check::Options { fmu_path: args.fmu_path.clone(), ..check::Options::default() };
    let audience = if args.for_other_tools { Audience::OtherTools } else { Audience::Terramech };
    match crate::pack::pack(&args.system, &options, &args.out, audience) {
        Ok(remarks) => {
            remarks.iter().for_each(|remark| eprintln!("note: {remark}"));
            let _ = writeln!(std::io::stdout().lock(), "{}", args.out.display());
            ExitCode::Done
        }
        Err(faults) => tell(&faults),
    }
}

fn import(args: &Import) -> ExitCode {
    match crate::osp::import(&args.system, &args.fmu_path, &args.out) {
        Ok(remarks) => {
            remarks.iter().for_each(|remark| eprintln!("note: {remark}"));
            let _ = writeln!(std::io::stdout().lock(), "{}", args.out.display());
            ExitCode::Done
        }
        Err(faults) => tell(&faults),
    }
}

fn inspect(args: &Inspect) -> ExitCode {
    let options = check::Options { fmu_path: args.fmu_path.clone(), need_library: false, ..check::Options::default() };
    let form = match (args.json, args.mermaid) {
        (true, _) => Form::Json,
        (_, true) => Form::Mermaid,
        _ => Form::Tables,
    };
    match inspect::open(&args.path, &options) {
        Ok(subject) => {
            // A reader that has gone (`| head`) is no mistake.
            let _ = std::io::stdout().lock().write_all(inspect::show(&subject, form).as_bytes());
            ExitCode::Done
        }
        Err(faults) => tell(&faults),
    }
}
