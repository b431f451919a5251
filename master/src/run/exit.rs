//! The exit code of a run's end.

use super::End;
use crate::exit::{ExitCode, code_of_failure};

/// The code of a run's end.
pub fn code_of_end(end: &End) -> ExitCode {
    match end {
        End::Done | End::EndedBy { .. } | End::Condition { .. } => ExitCode::Done,
        End::Stopped { .. } => ExitCode::Stopped,
        End::Failed(failure) => code_of_failure(failure),
    }
}
