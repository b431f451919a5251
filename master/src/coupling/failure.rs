//! Why a run cannot go on, told apart by who has to act: the user, the unit's author, the numerics, the machine.

use crate::loading::{CallError, LoadError};

/// A failed call with what the master knows about it.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitFailure {
    /// When, in s; `None` before initialisation mode.
    pub time: Option<f64>,
    /// The call.
    pub error: CallError,
    /// What is needed to read the error: the names of the variables the call was about, or nothing.
    pub about: String,
}

impl std::fmt::Display for UnitFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.time {
            Some(time) => write!(f, "unit {} at t = {time} s: ", self.error.unit)?,
            None => write!(f, "unit {} before the start: ", self.error.unit)?,
        }
        write!(f, "{} returned {}", self.error.call, self.error.status)?;
        if !self.about.is_empty() {
            write!(f, " ({})", self.about)?;
        }
        match self.error.said.as_slice() {
            [] => write!(f, "; the unit logged no reason"),
            [one] => write!(f, "\n  {one}"),
            many => write!(f, "\n  {}", many.join("\n  ")),
        }
    }
}

/// Why a run ends before its time.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// What the user gave is wrong, and `check` could not know.
    #[error("{0}")]
    Input(String),
    /// A unit's library cannot be used.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// A unit failed.
    #[error("{0}")]
    Unit(Box<UnitFailure>),
    /// A unit gave a value that is no number.
    #[error(
        "{variable} is {value} at t = {time} s: the computation of unit {unit} has broken down; a smaller step may help"
    )]
    NotFinite {
        /// The unit.
        unit: String,
        /// `component.variable`, with the element where it is an array.
        variable: String,
        /// NaN or an infinity.
        value: f64,
        /// When, s.
        time: f64,
    },
    /// What a run leaves cannot be written.
    #[error(transparent)]
    Results(#[from] terramech_results::Error),
    /// The machine does not let us work.
    #[error("{0}")]
    Environment(String),
}

impl Failure {
    /// A failed call.
    pub fn unit(error: CallError, time: Option<f64>, about: impl Into<String>) -> Self {
        Self::Unit(Box::new(UnitFailure { time, error, about: about.into() }))
    }
}
