//! Coupled units in time: initialisation, and communication step after communication step.
//!
//! A [`System`] holds the instances of a [`Plan`](crate::check::plan::Plan), what they read from each other and the time in whole base
//! steps. It offers the parts of a communication step (read all outputs that are due, carry them to inputs, let all due units
//! step); an [`Algorithm`] puts them in order. The caller's loop is
//!
//! ```text
//! initialise
//! loop: system.read(tick); observers record; stop at the end or on request; tick = algorithm.advance(system, tick)
//! ```
//!
//! so that observers see all units at the same time, before any input is set.
//!
//! Results are the same bits for any number of threads: a unit is called by one thread at a time, what it computes depends
//! on its inputs alone, and those are carried by the caller's thread in the order of the plan.

mod algorithm;
mod bonds;
mod connect;
mod contact;
mod ecco;
mod extrapolate;
mod failure;
mod gauss_seidel;
mod initialise;
mod iterated;
mod job;
mod measure;
mod pieces;
mod pool;
mod rollback;
mod save;
mod share;
mod stability;
mod system;
mod trial;
mod watch;

pub use algorithm::{Advance, Algorithm, Jacobi, algorithm_of};
pub use bonds::Energy;
pub use ecco::Ecco;
pub use failure::{Failure, Moment, UnitFailure};
pub use gauss_seidel::GaussSeidel;
pub use initialise::{assemble, serve_lead};
pub use iterated::Iterated;
pub use job::{Job, Note, Relay};
pub use measure::measure;
pub use pieces::Show;
pub use save::{CouplingState, UnitState};
pub use share::share_threads;
pub use stability::{Stability, stability, stability_of};
pub use system::{Clockwork, System};
pub use trial::try_units;
pub use watch::{Schedule, WatchId};
