//! A run from start to end: units are made and initialised, stepped to the stop time and recorded, and whatever happens, what
//! was recorded is readable afterwards and the manifest tells how it ended. A run that does not get through initialisation writes
//! nothing, so that an earlier run in the same folder stays as it is.

mod display;
mod energy;
mod exit;
mod host;
mod report;
mod stop;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use terramech_results::{Headline, LogWriter, Manifest, RunFolder, write_summary};

use crate::check::plan::Plan;
use crate::coupling::{Advance, Failure, System, algorithm_of, assemble};
use crate::loading::Environment;
use crate::record::Recorder;

pub use display::Display;
pub use energy::BondEnergy;
pub use exit::{ExitCode, code_of_failure};
pub use report::{closing, tell};
pub use stop::Stop;

use host::Host;

/// How a run is done.
#[derive(Clone, Debug)]
pub struct Options {
    /// Folder for what the run leaves.
    pub out: PathBuf,
    /// Threads for all units together.
    pub threads: usize,
    /// The command line, for the manifest.
    pub command: Vec<String>,
}

/// How a run ended.
#[derive(Debug)]
pub enum End {
    /// At its stop time.
    Done,
    /// A unit ended it by itself.
    EndedBy {
        /// The unit.
        unit: String,
        /// Time it had reached (s).
        time: f64,
    },
    /// On request (Ctrl-C).
    Stopped {
        /// Simulated time (s); `None` during initialisation.
        time: Option<f64>,
    },
    /// By a failure.
    Failed(Failure),
}

/// What a run has to tell.
#[derive(Debug)]
pub struct Outcome {
    /// How it ended.
    pub end: End,
    /// Headline values.
    pub headlines: Vec<Headline>,
    /// The manifest as written.
    pub manifest: Manifest,
    /// What each power bond has carried and what the coupling has added to it.
    pub bonds: Vec<BondEnergy>,
    /// Remarks on what could not be recorded as wanted.
    pub remarks: Vec<String>,
    /// The folder.
    pub out: PathBuf,
    /// Whether the run came so far as to write there.
    pub recorded: bool,
}

impl Outcome {
    /// The exit code of the command.
    pub fn exit_code(&self) -> ExitCode {
        exit::code_of_end(&self.end)
    }
}

/// Runs a plan.
///
/// # Errors
/// A [`Failure`] before there is a folder to leave anything in. Every later failure is the [`End`] of the outcome.
pub fn run(plan: Plan, options: &Options, display: Display, stop: &Stop) -> Result<Outcome, Failure> {
    let begin = Instant::now();
    let plan = Arc::new(plan);
    // An earlier run in this folder stays until this one has started.
    let folder = Arc::new(RunFolder::open(&options.out)?);
    let mut manifest = report::manifest(&plan, options);
    let host = Arc::new(Host::new(display, stop.clone()));
    for note in &plan.notes {
        host.note(&note.to_string());
    }

    let mut state = State { system: None, recorder: None, reached: None };
    let result = state.start(&plan, options, &host).and_then(|()| {
        folder.begin()?;
        manifest.write(&folder)?;
        host.open_log(LogWriter::create(&folder)?)?;
        state.go(&plan, &folder, &host, stop)
    });
    let mut end = match result {
        Ok(end) => end,
        // A unit that was asked to stop fails the call it was in.
        Err(Failure::Unit(_)) if stop.is_asked() => End::Stopped { time: state.reached },
        Err(failure) => End::Failed(failure),
    };
    let finished = state.finish(&host);
    if let (Err(failure), false) = (finished, matches!(end, End::Failed(_))) {
        end = End::Failed(failure);
    }
    host.finish();

    // Where not even the start was reached there is nothing to average, and nothing to remark on.
    let recorder = state.recorder.as_ref().filter(|_| state.reached.is_some());
    let mut headlines = recorder.map(Recorder::headlines).unwrap_or_default();
    let bonds = state.system.as_ref().filter(|_| recorder.is_some()).map(energy::bonds).unwrap_or_default();
    headlines.extend(bonds.iter().map(BondEnergy::headline));
    manifest.wall_seconds = begin.elapsed().as_secs_f64();
    manifest.simulated_seconds = state.reached.map_or(0.0, |t| t - plan.clock.start.to_f64());
    if let Some(system) = &state.system {
        report::timings(&mut manifest, system, state.recorder.as_ref());
    }
    manifest.state = report::exit_state(&end);
    let mut remarks = recorder.map(|r| r.remarks().to_vec()).unwrap_or_default();
    if state.recorder.is_none() {
        return Ok(Outcome { end, headlines, manifest, bonds, remarks, out: options.out.clone(), recorded: false });
    }
    let written = write_summary(&folder, &headlines)
        .and_then(|()| manifest.write(&folder))
        .and_then(|()| report::page(&plan, &folder, &headlines, &manifest, state.recorder.as_ref()));
    if let Err(e) = written {
        remarks.push(e.to_string());
        if !matches!(end, End::Failed(_)) {
            end = End::Failed(Failure::Results(e));
        }
    }
    Ok(Outcome { end, headlines, manifest, bonds, remarks, out: options.out.clone(), recorded: true })
}

struct State {
    system: Option<System>,
    recorder: Option<Recorder>,
    /// Simulated time that was reached (s).
    reached: Option<f64>,
}

impl State {
    /// Makes the units and initialises them.
    fn start(&mut self, plan: &Arc<Plan>, options: &Options, host: &Arc<Host>) -> Result<(), Failure> {
        let environment: Arc<dyn Environment> = Arc::clone(host) as Arc<dyn Environment>;
        let system = self.system.insert(assemble(Arc::clone(plan), options.threads, true, &environment)?);
        host.initialising();
        system.initialise()
    }

    /// Steps them to the end.
    fn go(&mut self, plan: &Arc<Plan>, folder: &Arc<RunFolder>, host: &Arc<Host>, stop: &Stop) -> Result<End, Failure> {
        let Some(system) = &mut self.system else { return Err(Failure::Environment("no units".into())) };
        let recorder = self.recorder.insert(Recorder::new(system, folder)?);
        let begin = Instant::now();
        let mut algorithm = algorithm_of(plan);
        host.running(plan.clock);
        let mut tick = 0;
        let end = loop {
            let time = plan.clock.time(tick);
            host.at(time, tick);
            system.read(tick)?;
            recorder.observe(system, tick)?;
            self.reached = Some(time);
            if tick >= plan.clock.steps {
                break End::Done;
            }
            if stop.is_asked() {
                break End::Stopped { time: Some(time) };
            }
            match algorithm.advance(system, tick) {
                Ok(Advance::To(next)) => tick = next,
                Ok(Advance::Ended) => {
                    let (unit, time) = system.ended().unwrap_or((0, time));
                    break End::EndedBy { unit: plan.components[unit].name.clone(), time };
                }
                Err(failure) => {
                    system.ran_for(begin.elapsed());
                    return Err(failure);
                }
            }
        };
        system.ran_for(begin.elapsed());
        Ok(end)
    }

    /// Ends the units and closes the files.
    fn finish(&mut self, host: &Host) -> Result<(), Failure> {
        if let Some(system) = &mut self.system {
            for error in system.terminate() {
                host.note(&error.to_string());
            }
        }
        self.recorder.as_mut().map_or(Ok(()), Recorder::finish)
    }
}
