//! Complementarity granular soil (DEM-C): rigid grains, unilateral contact with Coulomb friction and cohesion, steps of about 1e-3 s.
//!
//! [`engine`] is the step, `contacts.rs` makes the problem (elastic contacts by default, or rigid ones) that [`terramech_mechanics::cone`] solves,
//! `obstacles.rs` moves free bodies. Grains, sorting, lists, walls, bodies, meshes,
//! sampling and settling are those of [`crate::dem`] and [`crate::mesh`].

mod contacts;
pub mod engine;
mod obstacles;

pub use engine::{ConeEngine, ConeSetup, ConeState, StepReport};

use crate::config::{Bed, Fill, Terrain};
use crate::dem_p::GranularUnit;
use crate::variables;
use terramech_fmi2::Model;

/// The model: the connectors of `terrain_dem_p`, and what the solver did.
pub fn model() -> Model {
    let (table, vars) = variables::declare(true);
    let make = move || -> Box<dyn terramech_fmi2::Unit> { Box::new(GranularUnit::<ConeEngine>::new(vars.clone())) };
    let name = "Granular soil: rigid spheres with complementarity contacts";
    let mut model = Model::new("terrain_dem_c", name, table, make);
    model.weight = 100.0;
    model.default_specification = default_specification();
    model.schema = schemars::schema_for!(Terrain).to_value();
    model.documentation = DOCUMENTATION.into();
    model
}

/// The specification that a fresh FMU carries: that of `terrain_dem_p` with inner step and solver, in a smaller box, since a default has to initialise in
/// seconds.
pub fn default_specification() -> String {
    let bed = Bed { length: 0.2, width: 0.12, fill: Fill::Depth(0.03), ..Bed::default() };
    let spec = Terrain { bed, dem_c: Some(crate::config::DemC::default()), ..Terrain::default() };
    serde_json::to_string_pretty(&spec).expect("plain data serialises")
}

const DOCUMENTATION: &str = "Rigid spheres in a box without a lid. Contacts are unilateral, with Coulomb friction, rolling and spinning \
resistance and cohesion, solved together in each inner step as a cone-complementarity problem; Contacts have the stiffness of the \
soil's Young's modulus, taken implicitly; with dem_c.contacts = rigid it plays no part. \
The inner step is dem_c.step, 1e-3 s by default.

Connectors and specification are those of terrain-dem-p: one replaces the other by the attribute 'source' or by --swap, and a bed \
that one has saved starts the other.

solver.residual is the largest residual of a contact, a speed; solver.unconverged counts the inner steps that stopped at \
dem_c.iterations before it fell below dem_c.tolerance.";
