//! Model `tire_rigid`: a wheel that does not deform.
//!
//! A cylinder, smooth or with straight grousers, or a Wavefront OBJ mesh. It follows the wheel state rigidly, publishes its
//! mesh for the terrain, and hands the terrain's wrench (or the sum of forces at its vertices) to the vehicle. All its mass
//! goes to the hub, so the wrench holds contact forces only.

pub mod config;
pub mod contact;
pub mod error;
mod unit;
pub mod variables;

pub use unit::RigidTireUnit;

use terramech_fmi2::Model;

/// The specification that a fresh FMU carries: the smooth wheel of the single-wheel experiment (radius 58 mm, width 50 mm).
pub fn default_specification() -> String {
    serde_json::to_string_pretty(&config::RigidTire::default()).expect("plain data serialises")
}

/// The model.
pub fn model() -> Model {
    let (table, vars) = variables::declare();
    let mut model =
        Model::new("tire_rigid", "Rigid wheel: cylinder with optional grousers, or a mesh", table, move || {
            Box::new(RigidTireUnit::new(vars))
        });
    model.weight = 0.5;
    model.default_specification = default_specification();
    model.schema = schemars::schema_for!(config::RigidTire).to_value();
    model.documentation = DOCUMENTATION.into();
    model
}

const DOCUMENTATION: &str = "A wheel that does not deform: a cylinder about the Y axis, smooth or with straight grousers, or \
a Wavefront OBJ mesh (axle along Y, wheel centre at the origin, closed, wound outward).

It takes the wheel's state, publishes its mesh at the end of each step in the inertial frame (arrays mesh.position, \
mesh.velocity, mesh.triangle), and hands the terrain's answer on to the wheel: the wrench 'contact' about the wheel centre, or \
with \"contact\": \"vertices\" the sum of the forces on its vertices (arrays contact.index, contact.force).

All its mass and inertia are calculated parameters hub.mass and hub.inertia.*, which the vehicle integrates with its wheel; \
the wheel wrench therefore holds contact forces only.

radius is the undeformed radius without grousers, to which slip and sinkage refer; outer_radius includes them, so that the \
vehicle places the wheel above the soil.";
