//! The co-simulation master: reads an SSP system description, couples FMI 2.0 units, records the run.
//!
//! The way of a system description through this crate: [`archive`] opens what is packed, [`description`] reads the SSP files,
//! [`model_description`] the FMUs' own, [`check`] joins them to a validated [`check::plan::Plan`] or tells every fault,
//! [`inspect`] shows it.
//!
//! The way of a plan through a run: [`loading`] calls foreign libraries and nothing else does, [`coupling`] initialises the units and steps
//! them side by side, [`record`] writes what they do, [`run`](mod@run) ties the three together from start to end, in one process or on the ranks of a [`world`], and [`cli`] is the command line around it all.

// Foreign code is called in one room only.
#![deny(unsafe_code)]

pub mod archive;
pub mod check;
pub mod checkpoint;
pub mod cli;
pub mod coupling;
pub mod decimal;
pub mod description;
pub mod exit;
pub mod fault;
mod files;
pub mod inspect;
#[allow(unsafe_code)]
pub mod loading;
pub mod model_description;
pub mod osp;
pub mod pack;
pub mod record;
pub mod run;
pub mod suggest;
pub mod unit;
pub mod world;
pub mod xml;
