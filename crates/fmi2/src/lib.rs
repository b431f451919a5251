//! The C interface that Terramech's units and their master share: FMI 2.0 for co-simulation with an array and a
//! progress extension.
//!
//! Two sides use this crate. A **unit** implements the safe trait [`Unit`], describes its variables in a
//! [`Table`] and calls [`export!`] once; everything of C (argument checks, call order, panics, state, logging) is
//! done here. A **master** takes the types of [`types`] and the signatures of [`functions`] and loads them.
//!
//! What a unit author writes: a specification (read by [`specification`]), a variable table, and physics.
//!
//! ```
//! use terramech_fmi2::{Host, Model, RealVar, Step, Table, Unit, UnitError, Values, Var};
//!
//! struct Vars { force: RealVar, speed: RealVar }
//! fn declare() -> (Table, Vars) {
//!     let mut t = Table::new();
//!     let force = t.input_real("force.x", 0.0, "N", "Force on the mass");
//!     let speed = t.output_real("velocity.x", "m/s", "Speed of the mass");
//!     (t, Vars { force, speed })
//! }
//! struct Mass { vars: Vars, speed: f64 }
//! impl Unit for Mass {
//!     fn step(&mut self, v: &mut Values, _: &Host, step: Step) -> Result<(), UnitError> {
//!         self.speed += v[self.vars.force] * step.size;
//!         v[self.vars.speed] = self.speed;
//!         Ok(())
//!     }
//!     fn save(&mut self) -> Result<Vec<u8>, UnitError> { Ok(self.speed.to_le_bytes().to_vec()) }
//!     fn restore(&mut self, _: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
//!         self.speed = f64::from_le_bytes(bytes.try_into().map_err(|_| UnitError::state("8 bytes expected"))?);
//!         Ok(())
//!     }
//! }
//! let (table, vars) = declare();
//! let model = Model::new("mass", "A free mass", table, || Box::new(Mass { vars: declare().1, speed: 0.0 }));
//! assert!(model.xml().contains("velocity.x"));
//! ```
//!
//! Design: the *framework* holds the values of all variables ([`Values`]), so that getting and setting are
//! uniform, checked in one place and saved with the state; the *unit* holds its own state only, reads inputs from
//! the store at a step and writes outputs back. All models of one library are listed in one function; the GUID
//! selects among them.

pub mod description_xml;
pub mod export;
pub mod functions;
mod host_team;
pub mod instance;
pub mod model;
mod panics;
pub mod specification;
pub mod state;
pub mod types;
pub mod unit;
pub mod values;
pub mod variables;

pub use model::Model;
pub use unit::{Host, LogCategory, Pieces, Stage, Step, Team, Unit, UnitError};
pub use values::{Value, Values};
pub use variables::{BooleanVar, IntegerArrayVar, IntegerVar, RealArrayVar, RealVar, StringVar, Table, Var};
