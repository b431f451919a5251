//! What can go wrong in the granular engine.

use thiserror::Error;

/// Errors of the engine. The first group is the user's fault, the second the computation's.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum DemError {
    /// A parameter outside its range.
    #[error("{what} is {given}; allowed: {allowed}")]
    Parameter {
        /// Which one.
        what: String,
        /// Its value.
        given: String,
        /// What is allowed.
        allowed: String,
    },
    /// The step asked for is above the critical one.
    #[error(
        "step {step:.3e} s is above the critical one, {critical:.3e} s = {factor} x sqrt(m*/k_n) at an overlap of \
         {overlap:.3e} m ({pair}); take a smaller step, a softer or denser material, or state a smaller expected overlap"
    )]
    StepTooLarge {
        /// Asked for (s).
        step: f64,
        /// Allowed (s).
        critical: f64,
        /// The factor on sqrt(m*/k_n).
        factor: f64,
        /// Overlap expected at most (m).
        overlap: f64,
        /// The stiffest contact.
        pair: String,
    },
    /// Grains overlap too much where they are placed.
    #[error("grains {a} and {b} overlap by {overlap:.3e} m at {time:.6} s, more than {allowed:.3e} m; {hint}")]
    Interpenetration {
        /// Grain number.
        a: u32,
        /// Grain number.
        b: u32,
        /// Overlap (m).
        overlap: f64,
        /// Allowed (m).
        allowed: f64,
        /// Time (s).
        time: f64,
        /// What may help.
        hint: &'static str,
    },
    /// A grain is outside the container.
    #[error("grain {id} is outside the container at ({x:.4}, {y:.4}, {z:.4}) m, time {time:.6} s; {hint}")]
    Escaped {
        /// Grain number.
        id: u32,
        /// Position (m).
        x: f64,
        /// Position (m).
        y: f64,
        /// Position (m).
        z: f64,
        /// Time (s).
        time: f64,
        /// What may help.
        hint: &'static str,
    },
    /// A value of a body that came from outside is not finite, or its mesh is broken.
    #[error("body {body}: {reason}")]
    Body {
        /// Number of the body, from 1.
        body: usize,
        /// What is wrong.
        reason: String,
    },
    /// A value that is not finite turned up.
    #[error("grain {id} has a value that is not finite at {time:.6} s: the step is too large or an input was wrong")]
    NotFinite {
        /// Grain number.
        id: u32,
        /// Time (s).
        time: f64,
    },
    /// The bed did not come to rest.
    #[error(
        "the bed did not settle within {time} s: kinetic energy per grain {energy:.3e} J, limit {limit:.3e} J; \
         raise the time or the limit"
    )]
    NotSettled {
        /// Time tried (s).
        time: f64,
        /// Reached (J).
        energy: f64,
        /// Limit (J).
        limit: f64,
    },
    /// The caller asked to stop.
    #[error("stopped on request during {0}")]
    Cancelled(&'static str),
    /// Another member of the team has failed.
    #[error("{0}")]
    Elsewhere(String),
    /// The members of the team have lost each other.
    #[error("the terrain's team is broken: {0}")]
    Team(String),
    /// Saved data does not fit.
    #[error("saved bed: {0}")]
    State(String),
}

impl DemError {
    /// A parameter outside its range.
    pub fn parameter(what: impl Into<String>, given: impl ToString, allowed: impl Into<String>) -> Self {
        Self::Parameter { what: what.into(), given: given.to_string(), allowed: allowed.into() }
    }
}
