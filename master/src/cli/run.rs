//! `terramech run`, in one process or as one rank of several.

use std::ffi::OsString;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use terramech_results::Manifest;

use super::args::Run;
use super::commands::{how, plan, told};
use crate::check::plan::Plan;
use crate::checkpoint::{self, Checkpoint, How, fingerprint};
use crate::description::algorithm::Scheme;
use crate::run::{self, Checkpoints, Display, ExitCode, Options, Placed, Stop};
use crate::world::{self, Card, Place, Placer, Ranks, World};

/// What a person is told, and the exit code.
type Told = (String, ExitCode);

/// Carries out the command.
pub fn run(args: &Run, words: &[OsString]) -> ExitCode {
    let world = match world::start() {
        Ok(world) => world,
        Err(broken) => {
            eprintln!("{broken}");
            return ExitCode::Environment;
        }
    };
    match world {
        None => alone(args, words),
        Some(world) => together(args, words, world),
    }
}

fn alone(args: &Run, words: &[OsString]) -> ExitCode {
    let ready = orders(args).map_err(|text| (text, ExitCode::Input)).and_then(|_| prepare(args, words, 1));
    match ready {
        Err((text, code)) => {
            eprintln!("{text}");
            code
        }
        Ok(ready) => {
            ready.remarks.iter().for_each(|remark| eprintln!("{remark}"));
            if !args.place.is_empty() || args.place_by.is_some() || args.pieces {
                eprintln!("note: --place, --place-by and --pieces have no effect in one process");
            }
            let Ready { plan, options, .. } = ready;
            let (stop, display) = (stop(0), display(args));
            finish(args, run::run(plan, &options, display, &stop))
        }
    }
}

fn together(args: &Run, words: &[OsString], mut world: Box<dyn World>) -> ExitCode {
    let (rank, size) = (world.rank(), world.size());
    let prepared = orders(args)
        .map_err(|text| (text, ExitCode::Input))
        .and_then(|orders| Ok((prepare(args, words, world.neighbours())?, orders)))
        .and_then(|(ready, orders)| {
            let ranks = places(&ready.plan, &orders, args.place_by.as_deref(), size)?;
            Ok((ready, ranks))
        });
    let identity = prepared.as_ref().map(|(ready, ranks)| ready.identity(ranks)).map_err(Clone::clone);
    match world::meet(world.as_mut(), &Card::of(&identity)) {
        Ok(isa) => {
            if terramech_simd::Isa::chosen().is_ok_and(|chosen| chosen != isa) {
                crate::loading::pin_instruction_path(isa);
            }
        }
        Err((text, code)) => {
            if !text.is_empty() {
                eprintln!("{text}");
            }
            // One rank's code is the launcher's; more would be told as more failures.
            return if rank == 0 { code } else { ExitCode::Done };
        }
    }
    let Ok((ready, ranks)) = prepared else { return ExitCode::Environment };
    let Ready { plan, options, remarks } = ready;
    let stop = stop(rank);
    if rank != 0 {
        // What fails here is told by rank 0, which has learnt it.
        let _ = run::serve(plan, &options, &stop, Placed { world, ranks });
        return ExitCode::Done;
    }
    remarks.iter().for_each(|remark| eprintln!("{remark}"));
    let idle: Vec<String> =
        (0..size).filter(|r| !ranks.iter().any(|all| all.all().any(|one| one == *r))).map(|r| r.to_string()).collect();
    if !idle.is_empty() {
        eprintln!("note: {size} ranks for {} units: nothing to do for rank {}", ranks.len(), idle.join(", "));
    }
    finish(args, run::run_on(plan, &options, display(args), &stop, Some(Placed { world, ranks })))
}

/// What a run needs, read and checked.
struct Ready {
    plan: Plan,
    options: Options,
    remarks: Vec<String>,
}

impl Ready {
    /// What must be the same on all ranks.
    fn identity(&self, ranks: &[Ranks]) -> Vec<(String, String)> {
        let mut parts = fingerprint(&self.plan);
        parts.push(("steps".into(), self.plan.clock.steps.to_string()));
        parts.push(("ranks of the units".into(), format!("{ranks:?}")));
        parts.push(("--pieces".into(), self.options.in_pieces().to_string()));
        if let Some(from) = &self.options.checkpoints.from {
            parts.push(("checkpoint".into(), from.header.tick.to_string()));
        }
        parts
    }
}

fn prepare(args: &Run, words: &[OsString], neighbours: usize) -> Result<Ready, Told> {
    let mut how = How {
        every: args.checkpoint_every.clone(),
        keep: args.keep_checkpoints.into(),
        pieces: args.pieces,
        ..how(&args.system)
    };
    let mut from = None;
    let mut remarks = Vec::new();
    let mut out = args.out.clone().unwrap_or_default();
    if let Some(folder) = &args.resume {
        let (checkpoint, then, said) = resumed(args, folder)?;
        (from, how, out, remarks) = (Some(checkpoint), then, folder.clone(), said);
    }
    let plan = plan(&how, false).map_err(|faults| told(&faults))?;
    how.system = std::path::absolute(&how.system).unwrap_or(how.system);
    let options = Options {
        out,
        call_limit: Some(args.call_limit)
            .filter(|s| *s > 0.0)
            .and_then(|s| std::time::Duration::try_from_secs_f64(s).ok()),
        checkpoints: Checkpoints { how: Some(how), from },
        threads: args.threads.map_or_else(|| threads(neighbours), usize::from),
        command: words.iter().map(|w| w.to_string_lossy().into_owned()).collect(),
    };
    Ok(Ready { plan, options, remarks })
}

/// The cores this process may use, shared with the ranks beside it unless the launcher has bound each to its own.
fn threads(neighbours: usize) -> usize {
    let mine = std::thread::available_parallelism().map_or(1, usize::from);
    let cpus = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let machine = cpus.lines().filter(|l| l.starts_with("processor")).count().max(mine);
    mine.min((machine / neighbours.max(1)).max(1))
}

/// The checkpoint to go on from, how the run was started, and remarks.
fn resumed(args: &Run, folder: &Path) -> Result<(Arc<Checkpoint>, How, Vec<String>), Told> {
    let (checkpoint, remarks) =
        checkpoint::newest(folder).map_err(|failure| (failure.to_string(), run::code_of_failure(&failure)))?;
    let mut remarks: Vec<String> = remarks.iter().map(|remark| format!("note: {remark}")).collect();
    let mut how = checkpoint.header.how.clone();
    how.stop_time = args.system.stop_time.clone().or(how.stop_time);
    if !args.system.stop_when.is_empty() {
        how.stop_when.clone_from(&args.system.stop_when);
    }
    how.pieces |= args.pieces;
    how.every = args.checkpoint_every.clone().or(how.every);
    remarks.push(format!("resuming at t = {} s", checkpoint.header.time));
    Ok((Arc::new(checkpoint), how, remarks))
}

/// The orders of `--place`, all faults at once.
fn orders(args: &Run) -> Result<Vec<Place>, String> {
    let (mut orders, mut faults) = (Vec::new(), Vec::new());
    for text in &args.place {
        match Place::parse(text) {
            Ok(order) => orders.push(order),
            Err(fault) => faults.push(fault),
        }
    }
    if faults.is_empty() { Ok(orders) } else { Err(faults.join("\n")) }
}

/// The ranks of each unit.
fn places(plan: &Plan, orders: &[Place], earlier: Option<&Path>, size: usize) -> Result<Vec<Ranks>, Told> {
    if plan.algorithm.scheme != Scheme::Jacobi || plan.algorithm.resolve_feed_through {
        let given = plan.algorithm.scheme.name();
        let more = if plan.algorithm.resolve_feed_through { " with resolved feed-through" } else { "" };
        return Err((
            format!(
                "{}: the algorithm {given}{more} lets units wait for each other; on several ranks allowed: jacobi, without resolved feed-through (--algorithm jacobi)",
                plan.file.display()
            ),
            ExitCode::Input,
        ));
    }
    let measured = earlier.map(Manifest::read).transpose().map_err(|e| (e.to_string(), ExitCode::Input))?;
    let weight = |index: usize| match &measured {
        None => plan.model(index).weight,
        Some(m) => {
            let timing = m.timings.units.iter().find(|t| t.name == plan.components[index].name);
            // The time of one thread alone is not known: what counts is what others wait for.
            timing.map_or(0.0, |t| t.seconds)
        }
    };
    let placers: Vec<Placer<'_>> = plan
        .components
        .iter()
        .enumerate()
        .map(|(index, c)| Placer {
            name: &c.name,
            ranks: c.ranks,
            written: &c.place,
            weight: weight(index),
            spreads: plan.model(index).spreads,
        })
        .collect();
    world::place(&placers, orders, size).map_err(|faults| told(&faults))
}

fn stop(rank: usize) -> Stop {
    let stop = Stop::new();
    if let Err(e) = stop.on_interrupt(rank == 0) {
        eprintln!("note: Ctrl-C will not stop this run cleanly: {e}");
    }
    stop
}

fn display(args: &Run) -> Display {
    if args.quiet { Display::quiet() } else { Display::for_stderr() }
}

/// What is told at the end.
fn finish(args: &Run, outcome: Result<run::Outcome, crate::coupling::Failure>) -> ExitCode {
    let outcome = match outcome {
        Ok(outcome) => outcome,
        Err(failure) => {
            eprintln!("{failure}");
            return run::code_of_failure(&failure);
        }
    };
    for remark in &outcome.remarks {
        eprintln!("note: {remark}");
    }
    let code = outcome.exit_code();
    if !matches!(outcome.end, run::End::Done) {
        eprintln!("{}", run::tell(&outcome.end));
    }
    if !args.quiet && outcome.recorded {
        let text = format!("{}results in {}\n", run::closing(&outcome), outcome.out.display());
        let _ = std::io::stdout().lock().write_all(text.as_bytes());
    } else if code != ExitCode::Done && outcome.recorded && outcome.manifest.simulated_seconds > 0.0 {
        eprintln!("what was recorded is in {}", outcome.out.display());
    }
    code
}
