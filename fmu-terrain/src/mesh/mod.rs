//! Spheres against triangle meshes: one grain, one body, and the contacts between them.
//!
//! Nothing here knows forces: a [`MeshBody`] holds the mesh and moves it, a [`FacetGrid`] finds the facets near a grain,
//! [`MeshBody::contacts`] turns them into contacts (`blend` holds the rule by which facets that are one surface count
//! once), and [`VertexLoads`] carries force and couple of a contact to the vertices so that force and moment balance.
//!
//! One inner step of the engine, for each body:
//! 1. [`MeshBody::move_to`] the time since the last communication point.
//! 2. If grains and mesh together may have moved by the skin ([`MeshBody::drift`]): [`FacetGrid::refit`], and for each
//!    grain [`FacetGrid::near`] with the reach radius + skin; the facets it gives are kept, ascending.
//! 3. For each grain with facets: [`MeshBody::contacts`], any number of threads at once, each with its own
//!    [`ContactScratch`]. Each contact counts with its `weight`; its history is that of the old contact which
//!    [`inherited`] names.
//! 4. In canonical order of grains, on one thread: [`VertexLoads::add`].
//!
//! No step allocates once its scratch has grown. All results depend on positions and the order of facets alone.

mod blend;
mod body;
mod broad;
mod closest;
mod narrow;
mod topology;
mod vertex_loads;

pub use blend::{FULL_ANGLE, SEPARATE_ANGLE, likeness};
pub use body::{MeshBody, MeshError, mesh_from_arrays};
pub use broad::FacetGrid;
pub use closest::{Closest, Feature, closest_on_triangle};
pub use narrow::{ContactScratch, MeshContact, inherited};
pub use vertex_loads::{VertexLoads, to_vertices};
