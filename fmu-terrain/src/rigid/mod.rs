//! Model `terrain_rigid`: ground that does not yield.
//!
//! [`ground`] is a height field with friction: a plane, the facets of an OBJ mesh ([`facets`]) or a map of heights ([`grid`], grey PNG by [`png`]
//! or CSV), with obstacles on it. It answers probes (height, normal, friction at points), which tires for handling need, and pushes back
//! bodies of [`points`] by the penalty law of [`contact`]. `unit.rs` is the interface: the same connectors as every terrain.

pub mod config;
pub mod contact;
pub mod facets;
pub mod grid;
pub mod ground;
pub mod png;
pub mod points;
pub mod press;
mod unit;

pub use unit::RigidUnit;

use crate::config::Terrain;
use crate::variables;
use terramech_fmi2::Model;

/// The specification that a fresh FMU carries: a level plane at height 0.
pub fn default_specification() -> String {
    serde_json::json!({"rigid": config::Rigid::default()}).to_string()
}

/// The model.
pub fn model() -> Model {
    let (table, vars) = variables::declare(false);
    let make = move || -> Box<dyn terramech_fmi2::Unit> { Box::new(RigidUnit::new(vars.clone())) };
    let mut model = Model::new("terrain_rigid", "Rigid ground: plane, mesh or height map, with friction", table, make);
    model.weight = 1.0;
    model.default_specification = default_specification();
    model.schema = schemars::schema_for!(Terrain).to_value();
    model.documentation = DOCUMENTATION.into();
    model
}

const DOCUMENTATION: &str = "Ground that does not yield: a height field over x and y with a coefficient of friction. The block 'rigid' of the \
specification says which: a plane (level or sloped), the facets of an OBJ mesh over a plane, or a map of heights from a grey PNG or a CSV file; half-round \
obstacles on it; a map of friction. Blocks of other models are checked and not used, so that a study swaps one terrain for another.

probe.position takes points; probe.height, probe.normal and probe.friction answer for the ground over their x and y. 'height' is the height of the \
ground at x = y = 0.

Up to eight bodies, as in every terrain: 'mesh', 'rigid_mesh', 'cylinder' (an array of points on its tread). Vertices below the ground are pushed out by a \
pressure proportional to the depth, with damping and with Coulomb friction that sticks. The lower of the frictions of body and ground holds. Forces and \
wrenches are means over the last communication step.

grain.*, kinetic_energy, bed_load and bed_save belong to granular beds: there are no grains here, and a bed_load is told to be without effect.";
