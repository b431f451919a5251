//! One instance behind the C interface, in safe Rust: state machine, checks on every get and set, saved states.
//!
//! [`mod@crate::export`] turns C calls into calls of this type; tests and Rust hosts may use it directly.

use crate::state::{self, Saved};
use crate::types::*;
use crate::unit::{LogCategory, Stage, Step, Unit, UnitError};
use crate::values::{Value, Values};
use crate::variables::{Causality, Variability, Variable};
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
    /// After a discarded step: the last successful time may be asked, nothing else but terminate.
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
    /// Per variable, what a get or set of a Real between steps may skip: [`READ`], [`WRITE`].
    quick: Vec<u8>,
    unit: Box<dyn Unit>,
    values: Values,
    mode: Mode,
    experiment: Option<(f64, Option<f64>)>,
    time: f64,
    last_successful_time: f64,
    ended: bool,
    resources: Option<PathBuf>,
    log: RefCell<LogSink>,
    progress: RefCell<ProgressSink>,
}

macro_rules! host {
    ($self:ident) => {
        &Host { resources: $self.resources.as_deref(), log: &$self.log, progress: &$self.progress }
    };
}

impl Instance {
    /// A fresh instance of `model`; `resources` is the FMU's unpacked resources folder, if known.
    pub fn new(model: Model, resources: Option<&Path>, log: LogSink) -> Self {
        Self {
            unit: model.unit(),
            values: Values::new(&model.table),
            quick: model.table.variables().iter().map(quick).collect(),
            model,
            mode: Mode::Instantiated,
            experiment: None,
            time: 0.0,
            last_successful_time: 0.0,
            ended: false,
            resources: resources.map(Path::to_path_buf),
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
                    self.last_successful_time = *last_successful_time;
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
        self.require("fmi2DoStep", &[Mode::StepComplete])?;
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
        self.take("fmi2DoStep", r)?;
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

    /// Checks a get of `vr` and brings its value up to date.
    fn before_get(&mut self, function: &str, vr: u32, type_name: &str) -> Call {
        let v = self.variable(function, vr, type_name)?;
        let (settable, on_demand) = (v.causality.settable(), v.on_demand);
        let stage = match self.mode {
            Mode::Instantiated if settable => return Ok(()),
            Mode::Instantiated => {
                return Err(Refused::error(format!(
                    "{function}: '{}' has no value before initialization mode",
                    self.model.table.variables()[vr as usize].name
                )));
            }
            Mode::Initialization => Stage::Initialization,
            Mode::Poisoned => return self.require(function, &[Mode::Initialization, Mode::StepComplete]),
            _ => Stage::Stepping,
        };
        if !settable && (on_demand || stage == Stage::Initialization) {
            let r = self.unit.refresh(&mut self.values, host!(self), vr, stage);
            self.take(function, r)?;
        }
        Ok(())
    }

    /// Checks a set of `vr`.
    fn before_set(&self, function: &str, vr: u32, type_name: &str) -> Call<&Variable> {
        let v = self.variable(function, vr, type_name)?;
        if !v.causality.settable() {
            return Err(Refused::error(format!("{function}: {v} cannot be set; allowed: inputs and parameters")));
        }
        let late = match self.mode {
            Mode::Instantiated | Mode::Initialization => false,
            Mode::StepComplete => v.causality == Causality::Parameter && v.variability == Variability::Fixed,
            _ => {
                self.require(function, &[Mode::Instantiated, Mode::Initialization, Mode::StepComplete])?;
                false
            }
        };
        if late {
            return Err(Refused::error(format!(
                "{function}: fixed parameter '{}' cannot be set after initialization mode",
                v.name
            )));
        }
        if let Some(reason) = self.values.locks[vr as usize] {
            return Err(Refused::error(format!("{function}: '{}' comes too late: {reason}", v.name)));
        }
        Ok(v)
    }

    fn not_finite(&self, function: &str, vr: u32, x: f64, at: Option<usize>) -> Refused {
        let at = at.map(|i| format!(" at element {i}")).unwrap_or_default();
        let name = &self.model.table.variables()[vr as usize].name;
        Refused::error(format!("{function}: '{name}'{at} is {x}; allowed: finite values"))
    }

    /// Reads a real.
    ///
    /// # Errors
    /// Unknown reference, wrong type, wrong mode, late work that fails, a value that is not finite.
    pub fn real(&mut self, vr: u32) -> Call<f64> {
        // Thousands of these a step: nothing needs to be brought up to date, and the table has been asked before.
        if self.mode == Mode::StepComplete
            && self.quick.get(vr as usize).is_some_and(|q| q & READ != 0)
            && let Value::Real(x) = self.values.values[vr as usize]
            && x.is_finite()
        {
            return Ok(x);
        }
        self.before_get("fmi2GetReal", vr, "Real")?;
        match self.values.values[vr as usize] {
            Value::Real(x) if x.is_finite() => Ok(x),
            Value::Real(x) => {
                self.mode = Mode::Poisoned;
                Err(Refused { category: LogCategory::Numerical, ..self.not_finite("fmi2GetReal", vr, x, None) })
            }
            _ => unreachable!("checked against the table"),
        }
    }
    /// Writes a real.
    ///
    /// # Errors
    /// Unknown reference, wrong type, not settable, too late, not finite, outside its range.
    pub fn set_real(&mut self, vr: u32, x: f64) -> Call {
        if self.mode == Mode::StepComplete
            && self.quick.get(vr as usize).is_some_and(|q| q & WRITE != 0)
            && x.is_finite()
            && self.values.locks[vr as usize].is_none()
        {
            self.store(vr, Value::Real(x));
            return Ok(());
        }
        let v = self.before_set("fmi2SetReal", vr, "Real")?;
        if !x.is_finite() {
            return Err(self.not_finite("fmi2SetReal", vr, x, None));
        }
        in_range("fmi2SetReal", v, x)?;
        self.store(vr, Value::Real(x));
        Ok(())
    }
    /// Reads an integer.
    ///
    /// # Errors
    /// As [`Instance::real`].
    pub fn integer(&mut self, vr: u32) -> Call<i32> {
        self.before_get("fmi2GetInteger", vr, "Integer")?;
        match self.values.values[vr as usize] {
            Value::Integer(x) => Ok(x),
            _ => unreachable!("checked against the table"),
        }
    }
    /// Writes an integer.
    ///
    /// # Errors
    /// As [`Instance::set_real`].
    pub fn set_integer(&mut self, vr: u32, x: i32) -> Call {
        let v = self.before_set("fmi2SetInteger", vr, "Integer")?;
        in_range("fmi2SetInteger", v, x.into())?;
        self.store(vr, Value::Integer(x));
        Ok(())
    }
    /// Reads a Boolean.
    ///
    /// # Errors
    /// As [`Instance::real`].
    pub fn boolean(&mut self, vr: u32) -> Call<bool> {
        self.before_get("fmi2GetBoolean", vr, "Boolean")?;
        match self.values.values[vr as usize] {
            Value::Boolean(x) => Ok(x),
            _ => unreachable!("checked against the table"),
        }
    }
    /// Writes a Boolean.
    ///
    /// # Errors
    /// As [`Instance::set_real`].
    pub fn set_boolean(&mut self, vr: u32, x: bool) -> Call {
        self.before_set("fmi2SetBoolean", vr, "Boolean")?;
        self.store(vr, Value::Boolean(x));
        Ok(())
    }
    /// Reads a string.
    ///
    /// # Errors
    /// As [`Instance::real`].
    pub fn string(&mut self, vr: u32) -> Call<&str> {
        self.before_get("fmi2GetString", vr, "String")?;
        match &self.values.values[vr as usize] {
            Value::String(x) => Ok(x),
            _ => unreachable!("checked against the table"),
        }
    }
    /// Writes a string.
    ///
    /// # Errors
    /// As [`Instance::set_real`].
    pub fn set_string(&mut self, vr: u32, x: &str) -> Call {
        self.before_set("fmi2SetString", vr, "String")?;
        self.store(vr, Value::String(x.into()));
        Ok(())
    }
    fn store(&mut self, vr: u32, value: Value) {
        self.values.values[vr as usize] = value;
        self.values.mark_changed(vr);
    }

    /// Elements of an array now.
    ///
    /// # Errors
    /// Unknown reference, not an array, wrong mode, late work that fails.
    pub fn array_size(&mut self, vr: u32) -> Call<usize> {
        let function = "terramech_getArraySize";
        let v = self.model.table.variables().get(vr as usize);
        let Some(v) = v.filter(|v| v.start.is_array()) else {
            return Err(Refused::error(format!(
                "{function}: value reference {vr} is not an array of model {}",
                self.model.name
            )));
        };
        self.before_get(function, vr, v.start.type_name())?;
        Ok(match &self.values.values[vr as usize] {
            Value::RealArray(x) => x.len(),
            Value::IntegerArray(x) => x.len(),
            _ => unreachable!("checked against the table"),
        })
    }
    /// Reads a real array.
    ///
    /// # Errors
    /// As [`Instance::array_size`], and values that are not finite.
    pub fn real_array(&mut self, vr: u32) -> Call<&[f64]> {
        let function = "terramech_getRealArray";
        self.before_get(function, vr, "RealArray")?;
        let bad = match &self.values.values[vr as usize] {
            Value::RealArray(x) => first_not_finite(x),
            _ => unreachable!("checked against the table"),
        };
        if let Some((i, x)) = bad {
            self.mode = Mode::Poisoned;
            return Err(Refused { category: LogCategory::Numerical, ..self.not_finite(function, vr, x, Some(i)) });
        }
        match &self.values.values[vr as usize] {
            Value::RealArray(x) => Ok(x),
            _ => unreachable!("checked against the table"),
        }
    }
    /// Writes a real array and sets its size.
    ///
    /// # Errors
    /// As [`Instance::set_real`].
    pub fn set_real_array(&mut self, vr: u32, x: &[f64]) -> Call {
        let function = "terramech_setRealArray";
        self.before_set(function, vr, "RealArray")?;
        if let Some((i, x)) = first_not_finite(x) {
            return Err(self.not_finite(function, vr, x, Some(i)));
        }
        match &mut self.values.values[vr as usize] {
            Value::RealArray(to) => {
                to.clear();
                to.extend_from_slice(x);
            }
            _ => unreachable!("checked against the table"),
        }
        self.values.mark_changed(vr);
        Ok(())
    }
    /// Reads an integer array.
    ///
    /// # Errors
    /// As [`Instance::array_size`].
    pub fn integer_array(&mut self, vr: u32) -> Call<&[i32]> {
        self.before_get("terramech_getIntegerArray", vr, "IntegerArray")?;
        match &self.values.values[vr as usize] {
            Value::IntegerArray(x) => Ok(x),
            _ => unreachable!("checked against the table"),
        }
    }
    /// Writes an integer array and sets its size.
    ///
    /// # Errors
    /// As [`Instance::set_real`].
    pub fn set_integer_array(&mut self, vr: u32, x: &[i32]) -> Call {
        self.before_set("terramech_setIntegerArray", vr, "IntegerArray")?;
        match &mut self.values.values[vr as usize] {
            Value::IntegerArray(to) => {
                to.clear();
                to.extend_from_slice(x);
            }
            _ => unreachable!("checked against the table"),
        }
        self.values.mark_changed(vr);
        Ok(())
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
        let keep = |(v, x): (&Variable, &Value)| (!v.not_in_state).then(|| x.clone());
        let saved = Saved {
            guid: self.model.guid(),
            stage: modes.iter().position(|m| *m == self.mode).unwrap_or(0) as u8,
            time: self.time,
            values: self.model.table.variables().iter().zip(&self.values.values).map(keep).collect(),
            locked: self.values.locks.iter().map(Option::is_some).collect(),
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
            values.values[i] = value.unwrap_or_else(|| self.values.values[i].clone());
            values.locks[i] = locked.then_some("the restored state was computed with it");
        }
        let mut unit = self.model.unit();
        match unit.restore(&mut values, &saved.unit) {
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

/// A Real that is read as it stands between steps.
const READ: u8 = 1;
/// A Real without range that may be set between steps.
const WRITE: u8 = 2;

fn quick(v: &Variable) -> u8 {
    if v.start.type_name() != "Real" {
        return 0;
    }
    let read = if v.on_demand { 0 } else { READ };
    let free = v.min.is_none() && v.max.is_none() && v.causality.settable();
    let late = v.causality == Causality::Parameter && v.variability == Variability::Fixed;
    read | if free && !late { WRITE } else { 0 }
}

fn in_range(function: &str, v: &Variable, x: f64) -> Call {
    if v.min.is_some_and(|m| x < m) || v.max.is_some_and(|m| x > m) {
        let bound = |b: Option<f64>| b.map_or("unbounded".into(), |b| b.to_string());
        return Err(Refused::error(format!(
            "{function}: '{}' is {x} {}; allowed: {} to {}",
            v.name,
            v.unit,
            bound(v.min),
            bound(v.max)
        )));
    }
    Ok(())
}

fn first_not_finite(x: &[f64]) -> Option<(usize, f64)> {
    // Not finite = all bits of the exponent set. Without branches and without sums that wait for each other.
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    if !x.iter().fold(false, |bad, x| bad | (x.to_bits() & EXPONENT == EXPONENT)) {
        return None;
    }
    x.iter().copied().enumerate().find(|(_, x)| !x.is_finite())
}
