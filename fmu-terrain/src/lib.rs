//! Terrain units: granular soil by the discrete element method.
//!
//! [`dem`] is the granular engine, without FMI; [`mesh`] finds where grains touch triangle meshes.

pub mod dem;
pub mod mesh;
