//! A `modelDescription.xml`: read or refused with a fault, and what was read can be shown.

use std::path::Path;

use terramech::fault::Faults;
use terramech::{inspect, model_description};

/// Reads it.
pub fn read(bytes: &[u8]) {
    let mut faults = Faults::new();
    match model_description::read(bytes, Path::new("modelDescription.xml"), &mut faults) {
        Some(model) => drop((inspect::model_json(&model), inspect::model_tables(&model))),
        None => assert!(!faults.to_string().is_empty()),
    }
}
