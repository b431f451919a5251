//! The co-simulation master: reads an SSP system description, couples FMI 2.0 units, records the run.
//!
//! The way of a system description through this crate: [`archive`] opens what is packed, [`description`] reads the SSP files,
//! [`model_description`] the FMUs' own, [`check`] joins them to a validated [`check::plan::Plan`] or tells every fault,
//! [`inspect`] shows it. Running a plan is the business of the modules after these.

// Foreign code is called in one room only.
#![deny(unsafe_code)]

pub mod archive;
pub mod check;
pub mod cli;
pub mod coupling;
pub mod decimal;
pub mod description;
pub mod fault;
pub mod inspect;
#[allow(unsafe_code)]
pub mod loading;
pub mod model_description;
pub mod record;
pub mod run;
pub mod suggest;
pub mod unit;
pub mod xml;
