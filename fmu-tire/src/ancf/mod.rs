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
//! | [`mesh`], [`assembly`] | many shells: forces, tangent, sparse scatter |
//! | [`statics`], [`hht`] | equilibrium, time integration |

pub mod assembly;
pub mod element;
pub mod error;
pub mod external;
pub mod hht;
pub mod kernel;
pub mod laminate;
pub mod lane;
pub mod material;
pub mod mesh;
pub mod statics;
pub mod strain;

pub use error::AncfError;
