//! Why a run cannot go on, told apart by who has to act: the user, the unit's author, the numerics, the machine.

use crate::exit::ExitCode;
use crate::loading::{CallError, Cause, LoadError};
use crate::world::Broken;

/// Where in its life a unit failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Moment {
    /// Before initialisation mode.
    Before,
    /// In initialisation mode.
    Initialising,
    /// At this simulated time (s), while it is stepped.
    At(f64),
}

impl Moment {
    /// The simulated time (s), if it runs.
    pub fn time(self) -> Option<f64> {
        if let Self::At(time) = self { Some(time) } else { None }
    }
}

/// A failed call with what the master knows about it.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitFailure {
    /// When.
    pub moment: Moment,
    /// The call.
    pub error: CallError,
    /// What is needed to read the error: the names of the variables the call was about, or nothing.
    pub about: String,
}

impl std::fmt::Display for UnitFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (unit, said) = (&self.error.unit, self.error.said.as_slice());
        if self.is_input() && !said.is_empty() {
            return write!(f, "unit {unit}: {}", said.join("\n  "));
        }
        match self.moment {
            Moment::At(time) => write!(f, "unit {unit} at t = {time} s: ")?,
            Moment::Initialising => write!(f, "unit {unit} in initialisation: ")?,
            Moment::Before => write!(f, "unit {unit} before the start: ")?,
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

impl UnitFailure {
    /// Whether the user's input is to blame. While units are stepped their input comes from each other.
    pub fn is_input(&self) -> bool {
        match (self.error.cause, self.moment) {
            (Cause::Numerical | Cause::Environment, _) | (_, Moment::At(_)) => false,
            (Cause::Input, _) => true,
            // Until it has entered initialisation mode a unit has seen nothing but parameters: it can only object to them.
            (Cause::Unknown, moment) => moment == Moment::Before || self.error.call == "fmi2EnterInitializationMode",
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
    /// The coupling makes energy faster than the system takes it away.
    #[error(
        "the coupling rings at t = {time} s: what passes through power bond {bond} has grown for {steps} steps, and {part:.0} % of it is made by the coupling itself{}",
        limit.as_ref().map(|l| format!("; it is {l}")).unwrap_or_else(|| "; take a smaller step".into())
    )]
    Rings {
        /// When, s.
        time: f64,
        /// The bond.
        bond: String,
        /// For how long.
        steps: u64,
        /// What the coupling makes, in per cent of what passes.
        part: f64,
        /// The stable step, where it could be estimated.
        limit: Option<String>,
    },
    /// The iteration of a step did not come to its end.
    #[error(
        "the coupling does not converge at t = {time} s: after {iterations} iterations {worst} still changes by {change:.1e} of its largest value (allowed: {tolerance:.1e}); a smaller step or a larger tolerance may help"
    )]
    NotConverged {
        /// When, s.
        time: f64,
        /// How many were done.
        iterations: u32,
        /// The connection whose value changes most.
        worst: String,
        /// By how much, relative.
        change: f64,
        /// What is allowed.
        tolerance: f64,
    },
    /// What a run leaves cannot be written.
    #[error(transparent)]
    Results(#[from] terramech_results::Error),
    /// Told by a rank of the run's world.
    #[error("rank {rank}: {text}")]
    OnRank {
        /// The rank.
        rank: usize,
        /// What it said.
        text: String,
        /// Who has to act.
        code: ExitCode,
    },
    /// The machine does not let us work.
    #[error("{0}")]
    Environment(String),
}

impl From<Broken> for Failure {
    fn from(broken: Broken) -> Self {
        Self::Environment(format!("the ranks of the run have lost each other: {broken}"))
    }
}

impl Failure {
    /// A failed call.
    pub fn unit(error: CallError, moment: Moment, about: impl Into<String>) -> Self {
        Self::Unit(Box::new(UnitFailure { moment, error, about: about.into() }))
    }
}
