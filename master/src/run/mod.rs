//! A run from start to end: units are made and initialised, stepped to the stop time and recorded, and whatever happens, what
//! was recorded is readable afterwards and the manifest tells how it ended. A run that does not get through initialisation writes
//! nothing, so that an earlier run in the same folder stays as it is.

mod condition;
mod display;
mod energy;
mod exit;
mod host;
mod report;
mod ringing;
mod saving;
mod stop;
mod watchdog;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use terramech_results::{Headline, LogWriter, Manifest, RunFolder, write_summary};

use crate::check::plan::Plan;
use crate::checkpoint::{Checkpoint, How};
use crate::coupling::{Advance, Failure, Job, Relay, System, algorithm_of, assemble, serve_lead};
use crate::loading::Environment;
use crate::record::Recorder;
use crate::world::{Ranks, World};

pub use crate::exit::{ExitCode, code_of_failure};
pub use display::Display;
pub use energy::BondEnergy;
pub use report::{closing, tell};
pub use stop::Stop;

use condition::Conditions;
use host::Host;
use ringing::Ringing;
use saving::Saving;

/// How a run is done.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Folder for what the run leaves.
    pub out: PathBuf,
    /// Threads for all units together.
    pub threads: usize,
    /// The command line, for the manifest.
    pub command: Vec<String>,
    /// When checkpoints are written.
    pub checkpoints: Checkpoints,
    /// Wall time that a call into a unit may take without a report of progress; `None`: any.
    pub call_limit: Option<Duration>,
}

impl Options {
    /// Whether units that are spread write side by side.
    pub fn in_pieces(&self) -> bool {
        self.checkpoints.how.as_ref().is_some_and(|how| how.pieces)
    }
}

/// When checkpoints are written, and from which one the run goes on.
#[derive(Clone, Debug, Default)]
pub struct Checkpoints {
    /// How the run was started, kept in each checkpoint. Without it none is written.
    pub how: Option<How>,
    /// The checkpoint to go on from.
    pub from: Option<Arc<Checkpoint>>,
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
    /// By a condition of the user (`--stop-when`).
    Condition {
        /// The condition.
        text: String,
        /// When it held (s).
        time: f64,
    },
    /// On request (Ctrl-C).
    Stopped {
        /// Simulated time (s); `None` during initialisation.
        time: Option<f64>,
        /// Whether it can be resumed from there.
        saved: bool,
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

/// The ranks that a run is spread over, and those of each unit.
pub struct Placed {
    /// The ranks.
    pub world: Box<dyn World>,
    /// By unit.
    pub ranks: Vec<Ranks>,
}

impl Placed {
    /// The unit that this rank serves the lead of, if it does.
    pub fn serves(&self) -> Option<usize> {
        let rank = self.world.rank();
        self.ranks.iter().position(|r| r.all().skip(1).any(|r| r == rank))
    }
}

/// Runs a plan in this process.
///
/// # Errors
/// A [`Failure`] before there is a folder to leave anything in. Every later failure is the [`End`] of the outcome.
pub fn run(plan: Plan, options: &Options, display: Display, stop: &Stop) -> Result<Outcome, Failure> {
    run_on(plan, options, display, stop, None)
}

/// The part of a rank other than 0: steps its units until rank 0 says that it is over. It writes nothing; what its units say goes to rank 0.
///
/// # Errors
/// A [`Failure`]; rank 0 tells it too.
pub fn serve(plan: Plan, options: &Options, stop: &Stop, placed: Placed) -> Result<(), Failure> {
    let host = Arc::new(Host::elsewhere(stop.clone()));
    if let Some(unit) = placed.serves() {
        let environment: Arc<dyn Environment> = Arc::clone(&host) as Arc<dyn Environment>;
        return serve_lead(&plan, unit, options.threads, &environment, placed.world, placed.ranks[unit]);
    }
    let job = Box::new(Job::new(placed.world, &placed.ranks, Arc::clone(&host) as Arc<dyn Relay>));
    let plan = Arc::new(plan);
    if let Some(limit) = options.call_limit {
        let (dog, host) = (Arc::clone(&host.watchdog), Arc::clone(&host));
        let manifest = report::manifest(&plan, options);
        let alarm = move |unit: &str, call: &'static str| {
            report::give_up(&host, None, manifest.clone(), unit, call, limit);
        };
        dog.start(limit, alarm).map_err(|e| Failure::Environment(format!("no thread for the watchdog: {e}")))?;
    }
    let environment: Arc<dyn Environment> = Arc::clone(&host) as Arc<dyn Environment>;
    let mut system = assemble(Arc::clone(&plan), options.threads, true, &environment, Some(job))?;
    system.write_into(&options.out, options.in_pieces());
    let mut tick = 0;
    match &options.checkpoints.from {
        None => system.initialise()?,
        Some(checkpoint) => {
            tick = checkpoint.header.tick;
            system.restore(&checkpoint.units, &checkpoint.header.coupling)?;
        }
    }
    system.share_watches()?;
    let served = system.serve(tick, |time, tick| host.at(time, tick));
    system.finish();
    host.watchdog.finish();
    served
}

/// [`run`] on several ranks, called on rank 0; the others [`serve`].
///
/// # Errors
/// As of [`run`].
pub fn run_on(
    plan: Plan,
    options: &Options,
    display: Display,
    stop: &Stop,
    placed: Option<Placed>,
) -> Result<Outcome, Failure> {
    let begin = Instant::now();
    let plan = Arc::new(plan);
    let host = Arc::new(Host::new(display, stop.clone()));
    // From here on whatever ends this run ends it on the other ranks too.
    let job = placed.map(|p| Job::new(p.world, &p.ranks, Arc::clone(&host) as Arc<dyn Relay>));
    // An earlier run in this folder stays until this one has started.
    let folder = Arc::new(RunFolder::open(&options.out)?);
    let mut manifest = report::manifest(&plan, options);
    for note in &plan.notes {
        host.note(&note.to_string());
    }

    if let Some(limit) = options.call_limit {
        let dog = Arc::clone(&host.watchdog);
        let (host, folder, manifest) = (Arc::clone(&host), Arc::downgrade(&folder), manifest.clone());
        let alarm = move |unit: &str, call: &'static str| {
            let folder = folder.upgrade();
            report::give_up(&host, folder.as_deref(), manifest, unit, call, limit);
        };
        dog.start(limit, alarm).map_err(|e| Failure::Environment(format!("no thread for the watchdog: {e}")))?;
    }
    let mut state = State { system: None, recorder: None, reached: None };
    let mut saving = Saving::new(&plan, options, begin)?;
    let from = options.checkpoints.from.as_deref();
    let result = state.start(&plan, options, &host, job.map(Box::new)).and_then(|()| {
        let log = if from.is_some() {
            folder.go_on();
            LogWriter::go_on(&folder)?
        } else {
            folder.begin()?;
            LogWriter::create(&folder)?
        };
        manifest.write(&folder)?;
        host.open_log(log)?;
        state.go(&plan, &folder, &host, stop, &mut saving)
    });
    let mut end = match result {
        Ok(end) => end,
        // A unit that was asked to stop fails the call it was in.
        Err(Failure::Unit(_) | Failure::OnRank { .. }) if stop.is_asked() => {
            End::Stopped { time: state.reached, saved: false }
        }
        Err(failure) => End::Failed(failure),
    };
    let finished = state.finish(&host);
    if let (Err(failure), false) = (finished, matches!(end, End::Failed(_))) {
        end = End::Failed(failure);
    }
    host.watchdog.finish();
    host.finish();

    // Where not even the start was reached there is nothing to average, and nothing to remark on.
    let recorder = state.recorder.as_ref().filter(|_| state.reached.is_some());
    let mut headlines = recorder.map(Recorder::headlines).unwrap_or_default();
    let bonds = state.system.as_ref().filter(|_| recorder.is_some()).map(energy::bonds).unwrap_or_default();
    headlines.extend(bonds.iter().map(BondEnergy::headline));
    manifest.wall_seconds = saving.wall_seconds();
    manifest.simulated_seconds = state.reached.map_or(0.0, |t| t - plan.clock.start.to_f64());
    if let Some(system) = &state.system {
        let start = plan.clock.start.to_f64();
        let since = saving.from().map_or(0.0, |c| plan.clock.time(c.header.tick) - start);
        report::timings(&mut manifest, system, state.recorder.as_ref(), since);
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
    fn start(
        &mut self,
        plan: &Arc<Plan>,
        options: &Options,
        host: &Arc<Host>,
        job: Option<Box<Job>>,
    ) -> Result<(), Failure> {
        let environment: Arc<dyn Environment> = Arc::clone(host) as Arc<dyn Environment>;
        let system = self.system.insert(assemble(Arc::clone(plan), options.threads, true, &environment, job)?);
        system.write_into(&options.out, options.in_pieces());
        host.initialising();
        match &options.checkpoints.from {
            None => system.initialise(),
            Some(checkpoint) => {
                checkpoint.fits(plan)?;
                system.restore(&checkpoint.units, &checkpoint.header.coupling)
            }
        }
    }

    /// Steps them to the end.
    fn go(
        &mut self,
        plan: &Arc<Plan>,
        folder: &Arc<RunFolder>,
        host: &Arc<Host>,
        stop: &Stop,
        saving: &mut Saving,
    ) -> Result<End, Failure> {
        let Some(system) = &mut self.system else { return Err(Failure::Environment("no units".into())) };
        let from = saving.from();
        let recorder = self.recorder.insert(Recorder::new(system, folder, from.map(|c| &c.header.recording))?);
        let conditions = Conditions::new(system);
        system.share_watches()?;
        let begin = Instant::now();
        let mut algorithm = algorithm_of(plan);
        let mut tick = from.map_or(0, |c| c.header.tick);
        host.running(plan.clock, tick);
        if let Some(c) = from {
            algorithm.restore(&c.header.algorithm.iter().map(|b| f64::from_bits(*b)).collect::<Vec<_>>());
        }
        let mut ringing = Ringing::default();
        let mut first = from.is_some();
        let end = loop {
            let time = plan.clock.time(tick);
            host.at(time, tick);
            let stopping = stop.is_asked();
            let saves = |system: &System| saving.is_due(tick, stopping) && system.all_due(tick);
            // Other ranks send their states with what is read, since they do not wait for what comes of it.
            system.will_save(tick < plan.clock.steps && saves(system));
            system.read(tick)?;
            if let (Some(observable), Some((unit, ended))) = (system.has_ended(tick), system.ended()) {
                if observable {
                    recorder.observe(system, tick)?;
                    self.reached = Some(ended);
                }
                break End::EndedBy { unit: plan.components[unit].name.clone(), time: ended };
            }
            // What was recorded at the checkpoint is there already.
            if !std::mem::take(&mut first) {
                recorder.observe(system, tick)?;
            }
            self.reached = Some(time);
            ringing.look(system, tick)?;
            if tick >= plan.clock.steps {
                break End::Done;
            }
            if tick > 0
                && let Some(condition) = conditions.met(system)
            {
                break End::Condition { text: condition.text.clone(), time };
            }
            if saves(system) {
                saving.write(folder, system, recorder, algorithm.as_ref(), tick)?;
            }
            // With units of different steps, a few more lead to where the run can be resumed.
            if stopping && (saving.is_at(tick) || !saving.is_due(tick, true)) {
                break End::Stopped { time: Some(time), saved: saving.is_at(tick) };
            }
            match algorithm.advance(system, tick) {
                Ok(Advance::To(next)) => tick = next,
                Ok(Advance::Ended(last)) => {
                    let (unit, time) = system.ended().unwrap_or((0, time));
                    // A unit that gives up need not have outputs any more.
                    if let Some(last) = last
                        && system.read(last).is_ok()
                    {
                        recorder.observe(system, last)?;
                        self.reached = Some(time);
                    }
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
            let said = system.finish();
            for (unit, count) in system.early_returns() {
                host.note(&format!("unit {unit} broke off {count} steps before their end and went on from there"));
            }
            said.iter().for_each(|text| host.note(text));
        }
        self.recorder.as_mut().map_or(Ok(()), Recorder::finish)
    }
}
