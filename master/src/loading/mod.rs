//! Foreign code comes in here and nowhere else: loading a unit's library and calling it.
//!
//! [`Library`] opens the shared library of an FMU and resolves its functions once; [`Instance`] is one
//! `fmi2Instantiate`, with safe methods that turn every status into a `Result`. Logs and progress reports of a unit go to an
//! [`Environment`].
//!
//! Rules this room keeps, so that the rest of the crate needs no `unsafe`:
//! - an instance is called by one thread at a time (`Instance` is `Send` and not `Sync`, its methods take `&mut self`);
//! - an instance is freed before its library could go, and a library is never unloaded (see [`Library`]);
//! - what the callbacks point to lives as long as the instance;
//! - after `fmi2Error` an instance is only freed, after `fmi2Fatal` no function of its library is called again.

mod bare;
mod environment;
mod error;
mod functions;
mod image;
mod instance;
mod library;
mod pin;
mod pulse;
mod state;
mod team;
mod values;

pub use bare::BareLoop;
pub use environment::{Environment, LogLine};
pub use error::{CallError, Cause, LoadError, Status};
pub use image::whole;
pub use instance::{Instance, Made, Stepped};
pub use library::Library;
pub use pin::pin_instruction_path;
pub use pulse::Pulse;
pub use team::{Shared, Team};
pub use values::{Array, Batch, Class, NotFinite, Outputs, Sets, Slot};
