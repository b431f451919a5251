//! Exit codes, in one place.
//!
//! | code | meaning |
//! |---|---|
//! | 0 | done: the stop time was reached, or a unit or a condition of the user ended the run |
//! | 1 | the description or another input is wrong |
//! | 2 | a unit failed |
//! | 3 | the computation broke down: no convergence, values that are not finite |
//! | 4 | the environment failed: disk, threads, temporary folder |
//! | 130 | stopped by Ctrl-C (128 + SIGINT, as shells count) |

use serde::{Deserialize, Serialize};

use crate::coupling::Failure;
use crate::loading::{Cause, LoadError};

/// What the process returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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

/// The code of a failure.
pub fn code_of_failure(failure: &Failure) -> ExitCode {
    match failure {
        Failure::Input(_) => ExitCode::Input,
        Failure::Unit(unit) if unit.is_input() => ExitCode::Input,
        Failure::Unit(unit) => match unit.error.cause {
            Cause::Numerical => ExitCode::Numerical,
            Cause::Environment => ExitCode::Environment,
            Cause::Input | Cause::Unknown => ExitCode::Unit,
        },
        // A file that is cut or of another machine is what the user gave.
        Failure::Load(LoadError::Image { .. }) => ExitCode::Input,
        Failure::Load(_) => ExitCode::Unit,
        Failure::NotFinite { .. } | Failure::NotConverged { .. } | Failure::Rings { .. } => ExitCode::Numerical,
        Failure::Results(error) if error.is_users_mistake() => ExitCode::Input,
        Failure::OnRank { code, .. } => *code,
        Failure::Results(_) | Failure::Environment(_) => ExitCode::Environment,
    }
}
