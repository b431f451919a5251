//! Complementarity granular soil (DEM-C): rigid grains, unilateral contact with Coulomb friction and cohesion, steps of about 1e-3 s.
//!
//! [`engine`] is the step, `contacts.rs` makes the problem that [`terramech_mechanics::cone`] solves. Grains, sorting, lists, walls, bodies, meshes,
//! sampling and settling are those of [`crate::dem`] and [`crate::mesh`].

mod contacts;
pub mod engine;

pub use engine::{ConeEngine, ConeSetup, ConeState, StepReport};
