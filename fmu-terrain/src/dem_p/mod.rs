//! Model `terrain_dem_p`: granular soil with penalty contacts.
//!
//! `unit.rs` puts an engine behind the interface (that of [`crate::dem`] here, that of [`crate::dem_c`] there), [`bodies`] turns inputs into bodies of the engine,
//! [`outputs`] its state into outputs, and [`bed_file`] keeps settled beds.

pub mod bed_file;
pub mod bodies;
pub mod outputs;
pub mod pieces;
mod platform;
pub mod team;
mod unit;

pub use unit::{DemPUnit, GranularUnit};

use crate::config::Terrain;
use crate::variables;
use terramech_fmi2::Model;

/// The specification that a fresh FMU carries: a small bed of 6 mm grains that settles within seconds.
pub fn default_specification() -> String {
    serde_json::to_string_pretty(&Terrain::default()).expect("plain data serialises")
}

/// The model.
pub fn model() -> Model {
    let (table, vars) = variables::declare(false);
    let make = move || -> Box<dyn terramech_fmi2::Unit> { Box::new(DemPUnit::new(vars.clone())) };
    let mut model = Model::new("terrain_dem_p", "Granular soil: spheres with penalty contacts", table, make);
    model.weight = 100.0;
    model.spreads = true;
    model.default_specification = default_specification();
    model.schema = schemars::schema_for!(Terrain).to_value();
    model.documentation = DOCUMENTATION.into();
    model
}

const DOCUMENTATION: &str = "Spheres in a box without a lid, floor at z = 0, centre of the box at x = y = 0. Contacts are \
springs and dashpots (Hertz-Mindlin with tangential history by default), with Coulomb friction, rolling and spinning \
resistance, and adhesion.

The bed is poured, settled and levelled when 'height' is first read in initialization mode, or when that ends; what it was \
made from is locked from then on. 'height' is the mean, over square cells two mean diameters wide, of the highest point of a \
grain in each.

Up to eight bodies. body[k].shape 'mesh' takes vertices, their velocities and triangles before every step and moves each \
vertex on by its velocity; it answers with forces on vertices (contact.index, contact.force) and with the total wrench about \
the centre: body[k].position.{x,y,z} if that is ever set, else the mean of the vertices. 'rigid_mesh' takes the mesh once, at \
the state that the body has when initialization ends, and then the state alone. 'cylinder' takes state, radius and width, \
axis along the body's y, and needs no arrays.

Obstacles of the specification are rigid bodies that are free to move: spheres, cylinders, boxes, closed meshes. They lie on \
the settled bed and sleep until a body touches them; obstacle.* are their states and surfaces.

Forces and wrenches are means over the last communication step. The inner step divides the communication step. Results do \
not depend on 'threads' by a single bit.

bed_save writes the settled bed to a file, bed_save_end the bed as it is when the run ends, bed_load starts from one: passes over the same soil.";
