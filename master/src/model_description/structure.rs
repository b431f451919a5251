//! `ModelStructure`: what depends on what.

use std::collections::HashMap;

use super::{Dependencies, ModelDescription};
use crate::fault::Faults;
use crate::xml::Element;

/// Reads `Outputs` and `InitialUnknowns`; continuous states are no business of a co-simulation master.
pub fn read(structure: Element<'_>, model: &mut ModelDescription, faults: &mut Faults) {
    let count = model.variables.len();
    if let Some(list) = structure.child("Outputs") {
        model.outputs = unknowns(list, count, faults);
    }
    if let Some(list) = structure.child("InitialUnknowns") {
        model.initial_unknowns = unknowns(list, count, faults);
    }
}

fn unknowns(list: Element<'_>, count: usize, faults: &mut Faults) -> HashMap<usize, Dependencies> {
    let mut map = HashMap::new();
    // The standard counts from 1.
    let variable = |text: &str| text.parse::<usize>().ok().filter(|&i| i >= 1 && i <= count).map(|i| i - 1);
    for e in list.all("Unknown") {
        let allowed = "the number of a ScalarVariable, counted from 1";
        if e.required("index", faults).is_none() {
            continue;
        }
        let Some(unknown) = e.parsed("index", allowed, faults, variable) else { continue };
        let dependencies = match e.attribute("dependencies") {
            None => Dependencies::Assumed,
            Some(text) => {
                let known: Option<Box<[usize]>> = text.split_whitespace().map(variable).collect();
                match known {
                    Some(known) => Dependencies::Listed(known),
                    None => {
                        e.bad_value("dependencies", text, "numbers of ScalarVariables, counted from 1", faults);
                        continue;
                    }
                }
            }
        };
        map.insert(unknown, dependencies);
    }
    map
}
