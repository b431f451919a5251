//! Exit codes, in one place.
//!
//! | code | meaning |
//! |---|---|
//! | 0 | done: the stop time was reached, or a unit ended the run by itself |
//! | 1 | the description or another input is wrong |
//! | 2 | a unit failed |
//! | 3 | the computation broke down: no convergence, values that are not finite |
//! | 4 | the environment failed: disk, threads, temporary folder |
//! | 130 | stopped by Ctrl-C (128 + SIGINT, as shells count) |

use super::End;
use crate::coupling::Failure;

/// What the process returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ExitCode {
    /// Done.
    Done = 0,
    /// Wrong input.
    Input = 1,
    /// A unit failed.
    Unit = 2,
    /// Numerical failure.
    Numerical = 3,
    /// The environment failed.
    Environment = 4,
    /// Stopped by the user.
    Stopped = 130,
}

/// The code of a run's end.
pub fn code_of_end(end: &End) -> ExitCode {
    match end {
        End::Done | End::EndedBy { .. } => ExitCode::Done,
        End::Stopped { .. } => ExitCode::Stopped,
        End::Failed(failure) => code_of_failure(failure),
    }
}

/// The code of a failure.
pub fn code_of_failure(failure: &Failure) -> ExitCode {
    match failure {
        Failure::Input(_) => ExitCode::Input,
        Failure::Unit(unit) if unit.error.numerical => ExitCode::Numerical,
        // Until it has entered initialisation mode a unit has seen nothing but parameters: it can only object to them.
        Failure::Unit(unit) if unit.time.is_none() || unit.error.call == "fmi2EnterInitializationMode" => {
            ExitCode::Input
        }
        Failure::Load(_) | Failure::Unit(_) => ExitCode::Unit,
        Failure::NotFinite { .. } => ExitCode::Numerical,
        Failure::Results(error) if error.is_users_mistake() => ExitCode::Input,
        Failure::Results(_) | Failure::Environment(_) => ExitCode::Environment,
    }
}
