//! Obstacles: rigid bodies that are free to move, in a bed and among driven bodies.
//!
//! To the grains an obstacle is a [`Shape`](super::Shape) as any other; what the grains do to it moves it ([`FreeBody`]), in
//! step with them. It meets the box in its own points ([`Solid::points`]) and a driven body in that body's surface points, each
//! taken for a small sphere ([`contact`]). Two obstacles meet in the points of both.
//!
//! An obstacle may sleep until it is touched: it then lies where it was put and carries what leans on it. A driven body wakes it,
//! or soil that pushes harder than a tenth of its weight.

pub mod contact;
mod motion;
mod solid;

pub use motion::{FreeBody, FreeState};
pub use solid::{MassOf, Solid};
