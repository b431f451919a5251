//! What can go wrong with a foreign library and its calls.

use std::path::PathBuf;

use terramech_fmi2::types;

/// The library of a unit cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// Its file is no whole library for this machine.
    #[error("{}: the unit's library cannot be loaded: {reason}", path.display())]
    Image {
        /// The library.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The dynamic linker refused it.
    #[error("{}: the unit's library cannot be loaded: {reason}", path.display())]
    Open {
        /// The library.
        path: PathBuf,
        /// The linker's words.
        reason: String,
    },
    /// A function of the standard is not there.
    #[error("{}: the unit's library lacks the function {symbol} of FMI 2.0 for co-simulation", path.display())]
    Symbol {
        /// The library.
        path: PathBuf,
        /// The missing function.
        symbol: &'static str,
    },
    /// Built for another version or platform of types.
    #[error("{}: {function} says \"{given}\"; allowed: \"{allowed}\"", path.display())]
    Platform {
        /// The library.
        path: PathBuf,
        /// The function asked.
        function: &'static str,
        /// Its answer.
        given: String,
        /// The answer we can work with.
        allowed: &'static str,
    },
    /// `fmi2Instantiate` gave NULL.
    #[error("{unit}: fmi2Instantiate gave no instance{}", what_it_said(said))]
    Instantiate {
        /// Instance name.
        unit: String,
        /// What the unit logged about it.
        said: Vec<String>,
    },
    /// A name or path that cannot be handed to C.
    #[error("{unit}: {what} \"{given}\" cannot be handed to a unit: it holds a zero byte")]
    Text {
        /// Instance name.
        unit: String,
        /// What it is.
        what: &'static str,
        /// The text.
        given: String,
    },
}

/// The status of a call that did not succeed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// `fmi2Discard`: the call was not carried out (a step: not to its end).
    Discard,
    /// `fmi2Error`.
    Error,
    /// `fmi2Fatal`.
    Fatal,
    /// `fmi2Pending` from a function that may not answer so.
    Pending,
    /// A number that is no status.
    Unknown(i32),
    /// Not called: the instance had failed before.
    NotCalled,
    /// Not called: the library lacks the function.
    Missing,
    /// The call succeeded, its answer makes no sense; the text says why.
    Nonsense,
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Discard => f.write_str("fmi2Discard"),
            Self::Error => f.write_str("fmi2Error"),
            Self::Fatal => f.write_str("fmi2Fatal (all instances of this library are unusable)"),
            Self::Pending => f.write_str("fmi2Pending, which this function must not return"),
            Self::Unknown(code) => write!(f, "{code}, which is no status of the standard"),
            Self::NotCalled => f.write_str("nothing: the instance had failed before and takes no calls"),
            Self::Missing => f.write_str("nothing: the library lacks this function"),
            Self::Nonsense => f.write_str("fmi2OK with an answer that makes no sense"),
        }
    }
}

impl Status {
    /// The failure behind a C status; `None` for success (fmi2OK, fmi2Warning).
    pub(super) fn of(code: types::Fmi2Status) -> Option<Self> {
        match code {
            types::FMI2_OK | types::FMI2_WARNING => None,
            types::FMI2_DISCARD => Some(Self::Discard),
            types::FMI2_ERROR => Some(Self::Error),
            types::FMI2_FATAL => Some(Self::Fatal),
            types::FMI2_PENDING => Some(Self::Pending),
            other => Some(Self::Unknown(other)),
        }
    }
}

/// A call that failed, with the unit's own words (without the name of the call, which our units put before them).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{unit}: {call} returned {status}{}", what_it_said(said))]
pub struct CallError {
    /// Instance name.
    pub unit: String,
    /// The function.
    pub call: &'static str,
    /// What it returned.
    pub status: Status,
    /// What the unit logged during the call (errors and warnings), or what else is known.
    pub said: Vec<String>,
    /// Who has to act, as far as the unit said.
    pub cause: Cause,
}

/// Who has to act on a failed call: told by the log category of what the unit logged during it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cause {
    /// The unit did not say.
    #[default]
    Unknown,
    /// The computation broke down (`logNumerical`).
    Numerical,
    /// What the user gave is wrong (`logInput`).
    Input,
    /// The machine refused (`logEnvironment`).
    Environment,
}

impl Cause {
    /// The cause that a log category tells.
    pub(super) fn of(category: &str) -> Self {
        match category {
            "logNumerical" => Self::Numerical,
            "logInput" => Self::Input,
            "logEnvironment" => Self::Environment,
            _ => Self::Unknown,
        }
    }
}

fn what_it_said(said: &[String]) -> String {
    match said {
        [] => "; it logged no reason".to_owned(),
        [one] => format!(": {one}"),
        many => format!(":\n  {}", many.join("\n  ")),
    }
}
