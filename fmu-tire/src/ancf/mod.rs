//! The flexible tire: shells in the absolute nodal coordinate formulation (ANCF).
//!
//! A node carries its position `r` and a director `d` through the thickness, six coordinates, both in the inertial frame; no
//! rotations appear, so the mass matrix is constant and rigid motion is exact. The element is the four-node bilinear shell
//! (Yamashita, Valkeapaa, Jayakumar, Sugiyama 2015): Green-Lagrange strain, orthotropic layers, assumed natural strain for
//! transverse shear and thickness, five enhanced strain parameters, structural damping.
//!
//! What makes it fast here:
//!
//! * All strains of an element are linear in 32 quadratic forms of its coordinates, the *generalised strains* (see
//!   [`strain`]). The layers, the integration through thickness and plane and the enhanced strains condense into one constant
//!   32 x 32 matrix ([`element::ElementType`]); the cost of a force does not depend on the number of layers.
//! * Congruent elements share that matrix: a tire has one type per row, not one per element.
//! * Elements of a type go eight at a time through one kernel ([`kernel`]), and the analytic tangent is the same kernel applied
//!   to unit displacements.
//!
//! | module | what |
//! |---|---|
//! | [`material`], [`laminate`] | engineering constants, layers |
//! | [`element`], [`strain`], [`kernel`] | the shell |
//! | [`mesh`], [`assembly`], [`team`] | many shells: forces, tangent, sparse scatter, threads |
//! | [`statics`], [`hht`], [`secant`] | equilibrium, time integration, its quasi-Newton memory |
//! | [`spec`], [`profile`], [`geometry`], [`inflate`] | the tire: specification, mesh, inflation |
//! | [`surface`], [`plane`], [`rim`], [`tire`] | contact surface with lugs, ground of its own, rim's motion, the tire on a wheel |
//! | [`variables`], [`FlexibleTireUnit`] | the unit `tire_ancf` |

pub mod assembly;
mod batch;
pub mod element;
pub mod error;
pub mod external;
pub mod geometry;
pub mod hht;
pub mod inflate;
pub mod kernel;
pub mod laminate;
pub mod material;
pub mod mesh;
pub mod plane;
pub mod profile;
pub mod rim;
pub mod secant;
pub mod spec;
pub mod statics;
pub mod strain;
pub mod surface;
pub mod team;
pub mod tire;
mod unit;
pub mod variables;

pub use error::AncfError;
pub use unit::FlexibleTireUnit;

use terramech_fmi2::Model;

/// The model `tire_ancf`.
pub fn model() -> Model {
    let (table, vars) = variables::declare();
    let mut model = Model::new("tire_ancf", "Flexible tire: ANCF shells, inflated, on its rim", table, move || {
        Box::new(FlexibleTireUnit::new(vars))
    });
    model.weight = 2.0;
    model.default_step = 4e-5;
    model.default_specification = spec::HMMWV_LAYERED.into();
    model.schema = schemars::schema_for!(spec::FlexibleTire).to_value();
    model.documentation = DOCUMENTATION.into();
    model
}

const DOCUMENTATION: &str = "A tire of layered ANCF shells on a rigid rim, inflated by a follower pressure. The axle is Y of the wheel.

It takes the wheel's state; its rim runs on a smooth path to that state moved on by its velocities. Forces on its vertices come as \
arrays contact.index and contact.force (means over the sender's step); with ground = plane it presses on its own rigid horizontal \
plane at the height plane.height instead, by penalty and Coulomb friction.

The wheel wrench is the mean reaction of the rim over the step, plus hub.mass x (acceleration - gravity) and the like for \
hub.inertia: all of the tire's mass and inertia, which the vehicle integrates with its wheel. So no mass counts twice, and a light \
wheel is stable.

The inner step of the specification and the communication step are independent.";
