//! What can go wrong with a flexible tire, told apart by whose fault it is.

use terramech_mechanics::sparse::SparseError;

/// Faults of the shell model and its solvers.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AncfError {
    /// The user's input: every fault found, one per entry.
    #[error("{}", .0.join("\n"))]
    Input(Vec<String>),
    /// An element turned inside out.
    #[error("element {element} is inverted (volume ratio {ratio:.3}) at t = {time} s, near ({x:.4}, {y:.4}, {z:.4}) m")]
    Inverted {
        /// Index of the element, from 0.
        element: usize,
        /// Simulation time, s.
        time: f64,
        /// Centre of the element, m, inertial frame.
        x: f64,
        /// See `x`.
        y: f64,
        /// See `x`.
        z: f64,
        /// Current over reference volume at the worst point.
        ratio: f64,
    },
    /// Newton did not converge, even after the step was cut.
    #[error(
        "Newton failed at t = {time} s: correction {correction:.3e} m after {iterations} iterations, wanted {tolerance:.1e} m, step down to {step:.1e}"
    )]
    Newton {
        /// Simulation time (or load factor in statics), s.
        time: f64,
        /// Iterations of the last attempt.
        iterations: usize,
        /// Last correction, m.
        correction: f64,
        /// Wanted, m.
        tolerance: f64,
        /// Smallest step tried, s (or load increment).
        step: f64,
    },
    /// No equilibrium was found on a plane.
    #[error(
        "no equilibrium of the tire on the plane at {height} m: none beyond {reached:.4} m (correction {correction:.3e} m, wanted {tolerance:.1e} m); the plane may be too near the rim"
    )]
    Unpressed {
        /// Where the plane was to go, m.
        height: f64,
        /// How far it came, m.
        reached: f64,
        /// Last correction, m.
        correction: f64,
        /// Wanted, m.
        tolerance: f64,
    },
    /// A value stopped being a number.
    #[error("{what} is not finite at t = {time} s")]
    NotFinite {
        /// Which quantity.
        what: String,
        /// Simulation time, s.
        time: f64,
    },
    /// The linear solver failed.
    #[error(transparent)]
    Sparse(#[from] SparseError),
}
