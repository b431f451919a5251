//! The trait a unit implements, and what it gets from its host.

use crate::Values;
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// What went wrong in a unit. The framework turns each into a status and a log message.
#[derive(Debug, thiserror::Error)]
pub enum UnitError {
    /// The user's input is wrong: specification, parameter, input value. `fmi2Error`.
    #[error("{0}")]
    Input(String),
    /// The computation failed: no convergence, values that are not finite. `fmi2Error`; poisons the instance.
    #[error("{0}")]
    Numerical(String),
    /// The step was done only up to `last_successful_time` (s). `fmi2Discard`.
    #[error("step discarded after t = {last_successful_time} s: {reason}")]
    Discard {
        /// Time reached (s).
        last_successful_time: f64,
        /// Why no further.
        reason: String,
    },
    /// The model has ended (`fmi2Terminated` is true) at this time (s). `fmi2Discard`.
    #[error("the unit ended the run at t = {last_successful_time} s: {reason}")]
    Ended {
        /// Time reached (s).
        last_successful_time: f64,
        /// Why.
        reason: String,
    },
    /// The machine refused: a file that cannot be written, no memory, no threads. `fmi2Error`.
    #[error("{0}")]
    Environment(String),
    /// The environment asked to stop (through the progress report). `fmi2Error`.
    #[error("stopped on request during {0}")]
    Cancelled(String),
    /// A saved state does not fit. `fmi2Error`.
    #[error("saved state: {0}")]
    State(String),
}

impl UnitError {
    /// A fault of the user's input.
    pub fn input(text: impl Into<String>) -> Self {
        Self::Input(text.into())
    }
    /// A fault of the computation.
    pub fn numerical(text: impl Into<String>) -> Self {
        Self::Numerical(text.into())
    }
    /// A refusal of the machine.
    pub fn environment(text: impl Into<String>) -> Self {
        Self::Environment(text.into())
    }
    /// A state that does not fit.
    pub fn state(text: impl Into<String>) -> Self {
        Self::State(text.into())
    }
}

/// Log categories, as announced in the model description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogCategory {
    /// Errors.
    Error,
    /// Warnings.
    Warning,
    /// What the unit does, few lines a run.
    Info,
    /// Details for developers.
    Debug,
    /// A failure of the computation: the master tells who has to act by this category and the next two.
    Numerical,
    /// A fault of what the user gave: specification, parameter, file.
    Input,
    /// A refusal of the machine: a file that cannot be written, no memory.
    Environment,
}

impl LogCategory {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Error, Self::Warning, Self::Info, Self::Debug, Self::Numerical, Self::Input, Self::Environment];
    /// The category's name in the interface.
    pub fn name(self) -> &'static str {
        match self {
            Self::Error => "logStatusError",
            Self::Warning => "logStatusWarning",
            Self::Info => "logInfo",
            Self::Debug => "logDebug",
            Self::Numerical => "logNumerical",
            Self::Input => "logInput",
            Self::Environment => "logEnvironment",
        }
    }
    /// Whether it tells of a failure.
    pub fn is_error(self) -> bool {
        matches!(self, Self::Error | Self::Numerical | Self::Input | Self::Environment)
    }
    /// What it holds.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Error => "Errors",
            Self::Warning => "Warnings",
            Self::Info => "Progress of the unit, few lines a run",
            Self::Debug => "Details for developers",
            Self::Numerical => "Errors of the computation: no convergence, values that are not finite",
            Self::Input => "Errors of what was given: specification, parameter, file",
            Self::Environment => "Errors of the machine: a file that cannot be written, no memory",
        }
    }
}

type Log<'a> = dyn FnMut(LogCategory, &str) + 'a;
type Progress<'a> = dyn FnMut(&str, f64) -> bool + 'a;

/// What a unit may ask of its environment during a call. It is not `Sync`: logs and progress come from the thread
/// inside the FMI call only.
pub struct Host<'a> {
    /// The FMU's `resources` folder, if the environment gave one.
    pub resources: Option<&'a Path>,
    pub(crate) log: &'a RefCell<Log<'a>>,
    pub(crate) progress: &'a RefCell<Progress<'a>>,
}

impl Host<'_> {
    /// Writes to the environment's log.
    pub fn log(&self, category: LogCategory, text: &str) {
        (self.log.borrow_mut())(category, text);
    }
    /// Reports long work: phase and done fraction in [0, 1] (negative: unknown).
    ///
    /// # Errors
    /// [`UnitError::Cancelled`] when the environment asks to stop; pass it on with `?`.
    pub fn progress(&self, phase: &str, fraction: f64) -> Result<(), UnitError> {
        if (self.progress.borrow_mut())(phase, fraction) { Ok(()) } else { Err(UnitError::Cancelled(phase.into())) }
    }
    /// Runs `work` with a host that logs nowhere and never stops: for tests of units.
    pub fn silent<R>(work: impl FnOnce(&Host) -> R) -> R {
        Self::with_resources(None, work)
    }
    /// As [`Host::silent`], with a resources folder.
    pub fn with_resources<R>(resources: Option<PathBuf>, work: impl FnOnce(&Host) -> R) -> R {
        let log = RefCell::new(|_: LogCategory, _: &str| {});
        let progress = RefCell::new(|_: &str, _: f64| true);
        work(&Host { resources: resources.as_deref(), log: &log, progress: &progress })
    }
}

/// The members of a unit that is spread over several processes, or over threads of one. All do the same in the same order.
pub trait Team: Send {
    /// This member; 0 is the lead.
    fn index(&self) -> usize;
    /// How many there are.
    fn size(&self) -> usize;
    /// Hands over messages by member and takes one from each member of `from`, in that order.
    ///
    /// # Errors
    /// The members have lost each other.
    fn round(&mut self, out: &[(usize, Vec<u8>)], from: &[usize]) -> Result<Vec<Vec<u8>>, UnitError>;
}

/// A frame of points that the members of a team write, each its own (`terramech_writePieces`).
#[derive(Clone, Debug, PartialEq)]
pub struct Pieces {
    /// Files are `PREFIX_K.vtp` of member K and `PREFIX.pvtp`, which lists them.
    pub prefix: PathBuf,
    /// The array of positions (3 a point, m).
    pub position: u32,
    /// Arrays with values at the points, and the names of their fields.
    pub fields: Vec<(u32, String)>,
}

/// A communication step.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Start of the step (s).
    pub time: f64,
    /// Length of the step (s), positive.
    pub size: f64,
}

/// Where an instance is in the FMI state machine, as far as a unit cares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Before initialization mode.
    Instantiated,
    /// In initialization mode.
    Initialization,
    /// After it.
    Stepping,
}

/// A unit: one model's physics.
///
/// # Protocol
/// The framework calls, in this order: `setup` once with the experiment; `enter_initialization`; any number of
/// `refresh`; `exit_initialization`; then `step` after `step`, with `refresh` for on-demand variables between them;
/// `terminate`. `save` and `restore` may come at any stage; a restored unit goes on at the stage of the saved one.
/// Inputs and parameters are in `Values` when a call begins; outputs must be there when it ends.
///
/// *Late work* (settling, assembly, inflation) runs at the first `refresh` of a value that needs it or at
/// `exit_initialization`; the unit locks the parameters it used ([`Values::lock`]).
///
/// After a call returned [`UnitError::Numerical`] or panicked, the instance is poisoned: only `restore`, reset and free
/// follow. Other errors leave the unit as it was; a unit must not change itself before it has checked its input.
pub trait Unit: Send {
    /// The experiment: start time (s), stop time (s) if known.
    ///
    /// # Errors
    /// A start time the unit cannot take.
    fn setup(&mut self, _start: f64, _stop: Option<f64>) -> Result<(), UnitError> {
        Ok(())
    }
    /// Makes it a member of a team, before anything else. The lead (member 0) is called as any unit is; the others are asked to [`Unit::serve`].
    ///
    /// # Errors
    /// The unit cannot be spread.
    fn join(&mut self, _team: Box<dyn Team>) -> Result<(), UnitError> {
        Err(UnitError::input("this unit cannot be spread over several processes"))
    }
    /// A member other than the lead: does what the lead asks, until that is dropped.
    ///
    /// # Errors
    /// What failed; the lead has failed too.
    fn serve(&mut self, _v: &mut Values, _host: &Host) -> Result<(), UnitError> {
        Err(UnitError::input("this unit is no member of a team"))
    }
    /// Measures what its specification describes, by itself: numbers, plots and a page go into a folder, a table into the log.
    ///
    /// # Errors
    /// A unit that has nothing to measure; faults of the specification, of the measurement, of the folder.
    fn measure(&mut self, _v: &mut Values, _host: &Host, _folder: &Path) -> Result<(), UnitError> {
        Err(UnitError::input("this unit has nothing to measure by itself"))
    }
    /// Gives its team back: a restored unit takes its place in it, by [`Unit::join`]. The other members serve on.
    fn leave(&mut self) -> Option<Box<dyn Team>> {
        None
    }
    /// Where members of a team may leave their parts of what is saved: files `PREFIX.K` of member K, which the saved bytes name. `None`: all of it is in the bytes. Parts of
    /// restored bytes lie in the prefix's folder.
    fn keep_pieces(&mut self, _prefix: Option<PathBuf>) {}
    /// Writes points by all members side by side.
    ///
    /// # Errors
    /// Arrays that cannot be written so, files that cannot be written.
    fn write_pieces(&mut self, _v: &mut Values, _host: &Host, _pieces: &Pieces) -> Result<(), UnitError> {
        Err(UnitError::input("this unit writes no files in pieces"))
    }
    /// Initialization mode begins.
    ///
    /// # Errors
    /// Faults of the specification or of parameters.
    fn enter_initialization(&mut self, _v: &mut Values, _host: &Host) -> Result<(), UnitError> {
        Ok(())
    }
    /// Brings the value of `vr` up to date before it is read: called for every output and calculated parameter before
    /// stepping starts, and for on-demand variables always.
    ///
    /// # Errors
    /// Faults of the specification, of parameters, of late work.
    fn refresh(&mut self, _v: &mut Values, _host: &Host, _vr: u32, _stage: Stage) -> Result<(), UnitError> {
        Ok(())
    }
    /// Initialization mode ends: everything late is done now, all outputs valid.
    ///
    /// # Errors
    /// As `refresh`.
    fn exit_initialization(&mut self, _v: &mut Values, _host: &Host) -> Result<(), UnitError> {
        Ok(())
    }
    /// One communication step from `step.time` to `step.time + step.size`.
    ///
    /// # Errors
    /// See [`UnitError`].
    fn step(&mut self, v: &mut Values, host: &Host, step: Step) -> Result<(), UnitError>;
    /// The run ends.
    ///
    /// # Errors
    /// Rare.
    fn terminate(&mut self, _v: &mut Values, _host: &Host) -> Result<(), UnitError> {
        Ok(())
    }
    /// The unit's own state, whole (values of variables are saved by the framework): contents of files, never paths
    /// or thread counts. Saving changes nothing that is computed later.
    ///
    /// # Errors
    /// A state that cannot be saved.
    fn save(&mut self) -> Result<Vec<u8>, UnitError>;
    /// Takes a state back, on this or a fresh instance; `v` holds the saved values already. On an error the unit is
    /// poisoned.
    ///
    /// # Errors
    /// Bytes that do not fit.
    fn restore(&mut self, v: &mut Values, bytes: &[u8]) -> Result<(), UnitError>;
}
