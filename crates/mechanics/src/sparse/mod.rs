//! Symmetric sparse systems solved by a kept L D L' factorisation.
//!
//! The analysis (fill-reducing order, shape of the factor) depends on the pattern alone and is done once; factorisation and
//! solve reuse its memory. L D L' rather than Cholesky, because the tangent of a thin shell under compression may be
//! indefinite and yet a good iteration matrix; [`SymmetricSolver::negative_pivots`] tells which it was.
//!
//! This is the only module that calls `faer`, whose interface moves with each minor version.

mod ordering;
mod solver;
mod substitution;

pub use ordering::block_order;
pub use solver::{Precision, SymmetricPattern, SymmetricSolver};

/// Why a sparse system could not be set up or factorised.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SparseError {
    /// The pattern is not a sorted lower triangle with a full diagonal.
    #[error("sparse pattern: column {column} is not a sorted list of rows >= {column} that starts with the diagonal")]
    Pattern {
        /// First column that breaks the rule.
        column: usize,
    },
    /// A zero or non-finite pivot was met.
    #[error("sparse factorisation stopped: pivot {index} (in elimination order) is zero or not finite")]
    ZeroPivot {
        /// Position of the pivot in elimination order.
        index: usize,
    },
    /// The analysis failed, for want of memory.
    #[error("sparse analysis failed: {0}")]
    Analysis(String),
}
