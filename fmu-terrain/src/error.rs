//! The granular engine's errors as the interface's.

use crate::dem::DemError;
use terramech_fmi2::UnitError;

/// What an engine error means to the interface. `running`: after the bed was made, where what a user gave has been checked
/// and the computation itself has failed.
pub fn unit_error(e: DemError, running: bool) -> UnitError {
    match e {
        DemError::Cancelled(phase) => UnitError::Cancelled(phase.into()),
        DemError::State(_) => UnitError::state(e.to_string()),
        DemError::Parameter { .. } | DemError::StepTooLarge { .. } | DemError::Body { .. } => {
            UnitError::input(e.to_string())
        }
        // A bed that cannot be made is the specification's fault: too soft a soil, too little time to settle.
        _ if !running => UnitError::input(e.to_string()),
        _ => UnitError::numerical(e.to_string()),
    }
}
