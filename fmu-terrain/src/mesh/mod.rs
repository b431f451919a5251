//! Spheres against triangle meshes: one grain, one body, and the contacts between them.
//!
//! Nothing here knows contact laws: a [`MeshBody`] holds the mesh and moves it, a [`FacetGrid`] finds the facets near a
//! grain, [`MeshBody::contacts`] turns them into contacts, [`to_vertices`] carries force and couple of a contact to the
//! vertices so that force and moment balance. [`MeshShape`] is body and grid together, as the engine takes it.
//!
//! How many contacts a grain has, and how facets that are one surface count once: the head of `blend.rs`. In short, flat and
//! convex surfaces give one contact; folds below 10 degrees ([`FULL_ANGLE`]) count as one surface, with the force of
//! a flat plate at the same overlap to 1 - cos(fold/2) (4e-5 at 1 degree); folds above 30 degrees ([`SEPARATE_ANGLE`]) are two
//! surfaces; the force is continuous in the positions of grain and vertices throughout.
//!
//! History belongs to the pair of grain and body, not to facets: [`inherited`] says which old contact a new one continues.
//!
//! No step allocates once its scratch has grown. All results depend on positions and the order of facets alone: the
//! grid gives candidates ascending, and candidates that are too far away change nothing.

mod blend;
mod body;
mod broad;
mod closest;
mod narrow;
mod shape;
mod topology;
mod vertex_forces;

pub use blend::{FULL_ANGLE, SEPARATE_ANGLE, likeness};
pub use body::{MeshBody, MeshError, mesh_from_arrays};
pub use broad::FacetGrid;
pub use closest::{Closest, Feature, closest_on_triangle};
pub use narrow::{ContactScratch, MeshContact, inherited};
pub use shape::MeshShape;
pub use vertex_forces::{spread_couple, to_vertices};
