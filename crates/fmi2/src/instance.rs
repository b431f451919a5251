//! One instance behind the C interface, in safe Rust: state machine, checks on every get and set, saved states.
//!
//! [`mod@crate::export`] turns C calls into calls of this type; tests and Rust hosts may use it directly.

use crate::state::{self, Saved};
use crate::types::*;
use crate::unit::{LogCategory, Pieces, Step, Unit, UnitError};
use crate::values::Values;
use crate::variables::{Start, Variable};
use crate::{Host, Model};
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// The states of the FMI 2.0 co-simulation state machine that our units can be in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// After `fmi2Instantiate` or `fmi2Reset`.
    Instantiated,
    /// Between enter and exit of initialization mode.
    Initialization,
    /// Between steps.
    StepComplete,
    /// After a discarded step: the last successful time may be asked, and a step from there may follow unless the unit has ended the run.
    StepFailed,
    /// After `fmi2Terminate`.
    Terminated,
    /// After a panic or a numerical failure: set-state, reset and free only.
    Poisoned,
}

impl Mode {
    fn describe(self) -> &'static str {
        match self {
            Self::Instantiated => "instantiated (before initialization mode)",
            Self::Initialization => "in initialization mode",
            Self::StepComplete => "between steps",
            Self::StepFailed => "after a discarded step",
            Self::Terminated => "terminated",
            Self::Poisoned => {
                "poisoned by an earlier failure (only fmi2SetFMUstate, fmi2Reset and fmi2FreeInstance may follow)"
            }
        }
    }
}

/// Why a call was refused; becomes a log message and a status.
#[derive(Debug)]
pub struct Refused {
    /// Status to return.
    pub status: Fmi2Status,
    /// Message for the log.
    pub message: String,
    /// Category to log it under: who has to act.
    pub category: LogCategory,
}

impl Refused {
    fn error(message: impl Into<String>) -> Self {
        Self { status: FMI2_ERROR, message: message.into(), category: LogCategory::Error }
    }
}

type Call<T = ()> = Result<T, Refused>;

/// Where logs go.
pub type LogSink = Box<dyn FnMut(LogCategory, &str)>;
/// Where progress goes; false asks to stop.
pub type ProgressSink = Box<dyn FnMut(&str, f64) -> bool>;

/// An instance of a model.
pub struct Instance {
    model: Model,
    unit: Box<dyn Unit>,
    values: Values,
    mode: Mode,
    experiment: Option<(f64, Option<f64>)>,
    time: f64,
    last_successful_time: f64,
    ended: bool,
    resources: Option<PathBuf>,
    /// Where a team may leave parts of saved states.
    pieces: Option<PathBuf>,
    log: RefCell<LogSink>,
    progress: RefCell<ProgressSink>,
}

macro_rules! host {
    ($self:ident) => {
        &Host { resources: $self.resources.as_deref(), log: &$self.log, progress: &$self.progress }
    };
}

// After the macro, which it uses.
mod access;

impl Instance {
    /// A fresh instance of `model`; `resources` is the FMU's unpacked resources folder, if known.
    pub fn new(model: Model, resources: Option<&Path>, log: LogSink) -> Self {
        Self {
            unit: model.unit(),
            values: Values::new(&model.table),
            model,
            mode: Mode::Instantiated,
            experiment: None,
            time: 0.0,
            last_successful_time: 0.0,
            ended: false,
            resources: resources.map(Path::to_path_buf),
            pieces: None,
            log: RefCell::new(log),
            progress: RefCell::new(Box::new(|_, _| true)),
        }
    }

    /// Where the instance is.
    pub fn mode(&self) -> Mode {
        self.mode
    }
    /// Its model.
    pub fn model(&self) -> &Model {
        &self.model
    }
    /// Sends a message to the log.
    pub fn log(&self, category: LogCategory, text: &str) {
        (self.log.borrow_mut())(category, text);
    }
    /// Replaces the progress report.
    pub fn set_progress(&mut self, sink: Option<ProgressSink>) {
        self.progress = RefCell::new(sink.unwrap_or_else(|| Box::new(|_, _| true)));
    }
    /// Makes the instance refuse all but set-state, reset and free.
    pub fn poison(&mut self) {
        self.mode = Mode::Poisoned;
    }
    /// End of the last successful step (s).
    pub fn last_successful_time(&self) -> f64 {
        self.last_successful_time
    }
    /// Whether the unit has ended the run by itself.
    pub fn ended(&self) -> bool {
        self.ended
    }

    fn require(&self, function: &str, allowed: &[Mode]) -> Call {
        if allowed.contains(&self.mode) {
            return Ok(());
        }
        let allowed: Vec<&str> = allowed.iter().map(|m| m.describe()).collect();
        Err(Refused::error(format!(
            "{function} is not allowed now: the instance is {}; it is allowed {}",
            self.mode.describe(),
            allowed.join(", or ")
        )))
    }

    /// Takes a unit's answer: poisons on numerical failure.
    fn take<T>(&mut self, what: &str, result: Result<T, UnitError>) -> Call<T> {
        result.map_err(|e| {
            let status = match &e {
                UnitError::Numerical(_) => {
                    self.mode = Mode::Poisoned;
                    FMI2_ERROR
                }
                UnitError::Discard { last_successful_time, .. } | UnitError::Ended { last_successful_time, .. } => {
                    self.mode = Mode::StepFailed;
                    self.ended = matches!(e, UnitError::Ended { .. });
                    // By the contract of the trait the unit stands there now.
                    (self.last_successful_time, self.time) = (*last_successful_time, *last_successful_time);
                    FMI2_DISCARD
                }
                UnitError::Input(_) | UnitError::Environment(_) | UnitError::Cancelled(_) | UnitError::State(_) => {
                    FMI2_ERROR
                }
            };
            let category = match &e {
                UnitError::Numerical(_) => LogCategory::Numerical,
                UnitError::Input(_) => LogCategory::Input,
                UnitError::Environment(_) => LogCategory::Environment,
                UnitError::Discard { .. } | UnitError::Ended { .. } => LogCategory::Warning,
                UnitError::Cancelled(_) | UnitError::State(_) => LogCategory::Error,
            };
            Refused { status, message: format!("{what}: {e}"), category }
        })
    }

    /// `fmi2SetupExperiment`.
    ///
    /// # Errors
    /// Wrong mode, times that are not finite or not ascending, or the unit's refusal.
    pub fn setup(&mut self, start: f64, stop: Option<f64>) -> Call {
        self.require("fmi2SetupExperiment", &[Mode::Instantiated])?;
        if !start.is_finite() || stop.is_some_and(|s| !(s.is_finite() && s >= start)) {
            return Err(Refused::error(format!(
                "fmi2SetupExperiment: start time {start} s, stop time {stop:?} s; allowed: finite, stop not before start"
            )));
        }
        let r = self.unit.setup(start, stop);
        self.take("fmi2SetupExperiment", r)?;
        self.experiment = Some((start, stop));
        (self.time, self.last_successful_time) = (start, start);
        Ok(())
    }

    /// `terramech_setTeam`.
    ///
    /// # Errors
    /// Wrong mode, a member that the team does not have, a unit that cannot be spread.
    pub fn set_team(&mut self, team: Box<dyn crate::unit::Team>) -> Call {
        self.require("terramech_setTeam", &[Mode::Instantiated])?;
        if team.index() >= team.size() {
            let (index, size) = (team.index(), team.size());
            return Err(Refused::error(format!(
                "terramech_setTeam: member {index} of {size}; allowed: from 0 to size - 1"
            )));
        }
        let r = self.unit.join(team);
        self.take("terramech_setTeam", r)
    }

    /// `terramech_serveTeam`.
    ///
    /// # Errors
    /// Wrong mode, a unit that is no member of a team, what failed.
    pub fn serve_team(&mut self) -> Call {
        self.require("terramech_serveTeam", &[Mode::Instantiated])?;
        let r = self.unit.serve(&mut self.values, host!(self));
        self.mode = Mode::Poisoned;
        self.take("terramech_serveTeam", r)
    }

    /// `terramech_measure`.
    ///
    /// # Errors
    /// Wrong mode, what the unit cannot measure.
    pub fn measure(&mut self, folder: &Path) -> Call {
        self.require("terramech_measure", &[Mode::Instantiated])?;
        let r = self.unit.measure(&mut self.values, host!(self), folder);
        self.take("terramech_measure", r)
    }

    /// `terramech_setPieces`: a prefix of files, or none.
    pub fn set_pieces(&mut self, prefix: Option<PathBuf>) {
        self.pieces.clone_from(&prefix);
        self.unit.keep_pieces(prefix);
    }

    /// `terramech_writePieces`.
    ///
    /// # Errors
    /// Wrong mode, a variable that is no array of numbers, the unit's refusal.
    pub fn write_pieces(&mut self, pieces: &Pieces) -> Call {
        self.require("terramech_writePieces", &[Mode::Initialization, Mode::StepComplete, Mode::StepFailed])?;
        let table = &self.model.table;
        let start = |vr: u32| table.variables().get(vr as usize).map(|v| &v.start);
        let reals = |vr: u32| matches!(start(vr), Some(Start::RealArray));
        let fields = pieces.fields.iter().all(|(vr, _)| reals(*vr) || matches!(start(*vr), Some(Start::IntegerArray)));
        if !(reals(pieces.position) && fields) {
            return Err(Refused::error(
                "terramech_writePieces: a variable is no array; allowed: arrays of reals, fields of integers too",
            ));
        }
        let r = self.unit.write_pieces(&mut self.values, host!(self), pieces);
        self.take("terramech_writePieces", r)
    }

    /// `fmi2EnterInitializationMode`.
    ///
    /// # Errors
    /// Wrong mode, or faults of specification and parameters.
    pub fn enter_initialization(&mut self) -> Call {
        self.require("fmi2EnterInitializationMode", &[Mode::Instantiated])?;
        if self.experiment.is_none() {
            return Err(Refused::error("fmi2EnterInitializationMode: fmi2SetupExperiment has to be called before"));
        }
        let r = self.unit.enter_initialization(&mut self.values, host!(self));
        self.take("fmi2EnterInitializationMode", r)?;
        self.mode = Mode::Initialization;
        Ok(())
    }

    /// `fmi2ExitInitializationMode`.
    ///
    /// # Errors
    /// Wrong mode, or faults of late work (settling, assembly, inflation).
    pub fn exit_initialization(&mut self) -> Call {
        self.require("fmi2ExitInitializationMode", &[Mode::Initialization])?;
        let r = self.unit.exit_initialization(&mut self.values, host!(self));
        self.take("fmi2ExitInitializationMode", r)?;
        self.mode = Mode::StepComplete;
        Ok(())
    }

    /// `fmi2Terminate`.
    ///
    /// # Errors
    /// Wrong mode.
    pub fn terminate(&mut self) -> Call {
        self.require("fmi2Terminate", &[Mode::StepComplete, Mode::StepFailed])?;
        let r = self.unit.terminate(&mut self.values, host!(self));
        self.take("fmi2Terminate", r)?;
        self.mode = Mode::Terminated;
        Ok(())
    }

    /// `fmi2Reset`: as after instantiation.
    pub fn reset(&mut self) {
        self.unit = self.model.unit();
        self.values = Values::new(&self.model.table);
        self.mode = Mode::Instantiated;
        self.experiment = None;
        self.ended = false;
        (self.time, self.last_successful_time) = (0.0, 0.0);
    }

    /// `fmi2DoStep`.
    ///
    /// # Errors
    /// Wrong mode, a time that is not where the instance is, a step that is not positive, or the unit's error.
    pub fn do_step(&mut self, time: f64, size: f64) -> Call {
        let allowed = [Mode::StepComplete, Mode::StepFailed];
        self.require("fmi2DoStep", if self.ended { &allowed[..1] } else { &allowed })?;
        if !(size.is_finite() && size > 0.0) {
            return Err(Refused::error(format!("fmi2DoStep: step size {size} s; allowed: finite and positive")));
        }
        // The host may form its times by products or sums: allow their round-off, no more.
        if (time - self.time).abs() > 1e-9 * size + 1e-12 * time.abs() || !time.is_finite() {
            return Err(Refused::error(format!(
                "fmi2DoStep: communication point {time} s, but the instance is at {} s",
                self.time
            )));
        }
        let r = self.unit.step(&mut self.values, host!(self), Step { time, size });
        self.values.forget_derivatives();
        self.take("fmi2DoStep", r)?;
        self.mode = Mode::StepComplete;
        self.time = time + size;
        self.last_successful_time = self.time;
        Ok(())
    }

    fn variable(&self, function: &str, vr: u32, type_name: &str) -> Call<&Variable> {
        let v = self.model.table.variables().get(vr as usize).ok_or_else(|| {
            Refused::error(format!("{function}: value reference {vr} does not exist in model {}", self.model.name))
        })?;
        if v.start.type_name() != type_name {
            return Err(Refused::error(format!("{function}: value reference {vr} is {v}, not {type_name}")));
        }
        Ok(v)
    }

    /// The whole state as sealed bytes. Changes nothing.
    ///
    /// # Errors
    /// A poisoned instance, or the unit's refusal.
    pub fn save(&mut self) -> Call<Vec<u8>> {
        let modes = [Mode::Instantiated, Mode::Initialization, Mode::StepComplete, Mode::StepFailed, Mode::Terminated];
        self.require("fmi2GetFMUstate", &modes)?;
        let r = self.unit.save();
        let unit = self.take("fmi2GetFMUstate", r)?;
        // Arrays that are computed when they are read (all grains) need no place in it.
        let is_array = |v: &Variable| matches!(v.start, Start::RealArray | Start::IntegerArray);
        let is_kept = |v: &Variable| !(v.not_in_state || v.on_demand && is_array(v));
        let keep = |(i, v): (usize, &Variable)| is_kept(v).then(|| self.values.value(i));
        let saved = Saved {
            guid: self.model.guid(),
            stage: modes.iter().position(|m| *m == self.mode).unwrap_or(0) as u8,
            time: self.time,
            values: self.model.table.variables().iter().enumerate().map(keep).collect(),
            locked: self.values.locked(),
            unit,
        };
        let r = state::encode(&saved);
        self.take("fmi2GetFMUstate", r)
    }

    /// Checks bytes without taking them.
    ///
    /// # Errors
    /// Bytes that are not a state of this model.
    pub fn check_state(&self, bytes: &[u8]) -> Call {
        state::decode(bytes, &self.model.guid()).map(|_| ()).map_err(|e| Refused::error(e.to_string()))
    }

    /// Takes a state, also on a fresh or poisoned instance.
    ///
    /// # Errors
    /// Bytes that are not a state of this model (nothing changed), or the unit's refusal (poisoned).
    pub fn restore(&mut self, bytes: &[u8]) -> Call {
        let saved =
            state::decode(bytes, &self.model.guid()).map_err(|e| Refused::error(format!("fmi2SetFMUstate: {e}")))?;
        let mut values = Values::new(&self.model.table);
        if saved.values.len() != values.values.len() || saved.locked.len() != values.values.len() {
            return Err(Refused::error("fmi2SetFMUstate: the state has another number of variables"));
        }
        for (i, (value, locked)) in saved.values.into_iter().zip(&saved.locked).enumerate() {
            // A value of another type would be met later, where types are no longer asked for.
            if value.as_ref().is_some_and(|v| !v.is_like(&values.values[i])) {
                let v = &self.model.table.variables()[i];
                return Err(Refused::error(format!("fmi2SetFMUstate: the state has a value of another type for {v}")));
            }
            values.put_value(i, value.unwrap_or_else(|| self.values.value(i)));
            if *locked {
                values.lock([i as u32], "the restored state was computed with it");
            }
        }
        let mut unit = self.model.unit();
        // Its members go on serving: the one before must not end them.
        let joined = self.unit.leave().map_or(Ok(()), |team| unit.join(team));
        unit.keep_pieces(self.pieces.clone());
        match joined.and_then(|()| unit.restore(&mut values, &saved.unit)) {
            Ok(()) => {}
            Err(e) => {
                self.mode = Mode::Poisoned;
                return Err(Refused::error(format!("fmi2SetFMUstate: {e}")));
            }
        }
        self.unit = unit;
        self.values = values;
        self.mode = [Mode::Instantiated, Mode::Initialization, Mode::StepComplete, Mode::StepFailed, Mode::Terminated]
            .get(saved.stage as usize)
            .copied()
            .unwrap_or(Mode::Instantiated);
        (self.time, self.last_successful_time) = (saved.time, saved.time);
        self.experiment = Some((saved.time, None));
        self.ended = false;
        Ok(())
    }
}
