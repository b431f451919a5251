//! The description with its opened FMUs, and the look-ups that every part of the check needs.

use std::collections::HashMap;

use super::plan::{ArrayPort, Fmu, Port};
use crate::description::Description;
use crate::description::annotations::Address;
use crate::fault::{FaultKind, Faults, Place};
use crate::model_description::{Item, ModelDescription};
use crate::suggest::close;

/// With more faults than this, names are no longer compared for suggestions: it costs time and nobody reads that far.
const SUGGEST_UP_TO: usize = 30;

/// A description joined with its FMUs.
pub struct System<'d> {
    /// The description.
    pub description: &'d Description,
    /// The distinct FMUs.
    pub fmus: Vec<Fmu>,
    /// Per component; `None` where the FMU could not be opened, which is told already.
    pub fmu_of: Vec<Option<usize>>,
    /// Components by name.
    pub by_name: HashMap<&'d str, usize>,
    /// Declared connectors that carry a unit, by component and name.
    pub connector_units: HashMap<(usize, &'d str), &'d str>,
}

impl System<'_> {
    /// The model of a component.
    pub fn model(&self, component: usize) -> Option<&ModelDescription> {
        self.fmu_of[component].map(|fmu| &*self.fmus[fmu].model)
    }

    /// Name of a component.
    pub fn name(&self, component: usize) -> &str {
        &self.description.components[component].name
    }

    /// The component of a name; a fault with suggestions if there is none.
    pub fn component(&self, name: &str, place: &Place, element: &str, faults: &mut Faults) -> Option<usize> {
        let found = self.by_name.get(name).copied();
        if found.is_none() {
            let names = self.by_name.keys().copied();
            let close = if faults.len() < SUGGEST_UP_TO { close(name, names) } else { Vec::new() };
            faults.add(place, element, FaultKind::UnknownComponent { given: name.to_owned(), close });
        }
        found
    }

    /// The scalar or array of a name; a fault with suggestions if there is none, nothing if the FMU is missing.
    pub fn item(
        &self,
        component: usize,
        name: &str,
        place: &Place,
        element: &str,
        faults: &mut Faults,
    ) -> Option<Item> {
        let model = self.model(component)?;
        let found = model.find(name);
        if found.is_none() {
            let close = if faults.len() < SUGGEST_UP_TO { close(name, model.names()) } else { Vec::new() };
            let kind = FaultKind::UnknownVariable {
                component: self.name(component).to_owned(),
                model: model.model_name.clone(),
                given: name.to_owned(),
                close,
            };
            faults.add(place, element, kind);
        }
        found
    }

    /// The scalar of a name; an array is a fault.
    pub fn scalar(
        &self,
        component: usize,
        name: &str,
        place: &Place,
        element: &str,
        faults: &mut Faults,
    ) -> Option<Port> {
        match self.item(component, name, place, element, faults)? {
            Item::Scalar(variable) => self.port(component, variable),
            Item::Array(_) => {
                let variable = format!("{}.{name}", self.name(component));
                let kind = FaultKind::ArrayAgainstScalar { variable, given: "an array", needed: "a scalar" };
                faults.add(place, element, kind);
                None
            }
        }
    }

    /// The port of a scalar.
    pub fn port(&self, component: usize, variable: usize) -> Option<Port> {
        let v = &self.model(component)?.variables[variable];
        Some(Port { component, variable, value_reference: v.value_reference, kind: v.kind })
    }

    /// The array of an address; a scalar is a fault.
    pub fn array(&self, address: &Address, place: &Place, element: &str, faults: &mut Faults) -> Option<ArrayPort> {
        let component = self.component(&address.element, place, element, faults)?;
        match self.item(component, &address.connector, place, element, faults)? {
            Item::Array(array) => {
                let value_reference = self.model(component)?.arrays[array].value_reference;
                Some(ArrayPort { component, array, value_reference })
            }
            Item::Scalar(_) => {
                let variable = address.to_string();
                let kind = FaultKind::ArrayAgainstScalar { variable, given: "a scalar", needed: "an array" };
                faults.add(place, element, kind);
                None
            }
        }
    }

    /// Splits `component.variable`; the longest component name that fits wins.
    pub fn split<'t>(&self, dotted: &'t str) -> Option<(usize, &'t str)> {
        let dots: Vec<usize> = dotted.match_indices('.').map(|(at, _)| at).collect();
        dots.into_iter().rev().find_map(|at| Some((*self.by_name.get(&dotted[..at])?, &dotted[at + 1..])))
    }
}
