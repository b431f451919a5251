//! What ranks tell each other beside the rounds.

use serde::{Deserialize, Serialize};
use terramech_results::LogEntry;

/// A note.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Note {
    /// A message of a unit, for the log.
    Log(LogEntry),
    /// A unit is at long work.
    Progress {
        /// The unit.
        unit: String,
        /// What it does.
        phase: String,
        /// How much of it is done, 0 to 1; negative: unknown.
        fraction: f64,
    },
    /// Somebody asked the run to stop.
    Stop,
}
