//! `UnitDefinitions` and `TypeDefinitions`.

use std::collections::HashMap;

use super::{Kind, ModelDescription, TypeDefinition};
use crate::fault::{FaultKind, Faults};
use crate::unit::{BASE_UNITS, BaseUnit, Dimension, Unit};
use crate::xml::Element;

/// Names of units and types of a file, to their indices.
#[derive(Default)]
pub struct Names {
    units: HashMap<String, usize>,
    types: HashMap<String, usize>,
}

impl Names {
    /// The unit of that name; one that is not defined is entered by its name alone, with a note.
    pub fn unit(&self, name: &str, e: Element<'_>, model: &mut ModelDescription, faults: &mut Faults) -> usize {
        if let Some(&index) = self.units.get(name) {
            return index;
        }
        if let Some(index) = model.units.iter().position(|unit| unit.name == name) {
            return index;
        }
        let unit = Unit::named(name);
        if unit.base.is_none() {
            faults.note(&e.place(), e.label(), format!("unit \"{name}\" is not defined under UnitDefinitions"));
        }
        model.units.push(unit);
        model.units.len() - 1
    }

    /// The type of that name.
    pub fn type_of(&self, name: &str) -> Option<usize> {
        self.types.get(name).copied()
    }
}

/// Reads units and types into the model.
pub fn read(root: Element<'_>, model: &mut ModelDescription, faults: &mut Faults) -> Names {
    let mut names = Names::default();
    for e in root.children().filter(|e| e.name() == "UnitDefinitions").flat_map(|e| e.all("Unit")) {
        if let Some(unit) = unit(e, faults) {
            if names.units.contains_key(&unit.name) {
                faults.note(&e.place(), e.label(), "the unit is defined twice; the first definition counts");
                continue;
            }
            names.units.insert(unit.name.clone(), model.units.len());
            model.units.push(unit);
        }
    }
    for e in root.children().filter(|e| e.name() == "TypeDefinitions").flat_map(|e| e.all("SimpleType")) {
        if let Some(definition) = simple_type(e, &names, model, faults) {
            if names.types.insert(definition.name.clone(), model.types.len()).is_some() {
                faults.note(&e.place(), e.label(), "the type is defined twice; the last definition counts");
            }
            model.types.push(definition);
        }
    }
    names
}

/// Reads a `Unit` element; FMI 2.0 and SSP 1.0 write it the same way.
pub fn unit(e: Element<'_>, faults: &mut Faults) -> Option<Unit> {
    let name = e.required("name", faults)?.to_owned();
    let base = e.child("BaseUnit").map(|base| {
        let mut exponents = [0; 8];
        for (exponent, unit) in exponents.iter_mut().zip(BASE_UNITS) {
            *exponent = base.parsed(unit, "a whole number", faults, |text| text.parse().ok()).unwrap_or(0);
        }
        let factor = base.real("factor", faults).unwrap_or(1.0);
        if factor == 0.0 {
            base.bad_value("factor", "0", "a factor other than 0", faults);
        }
        let offset = base.real("offset", faults).unwrap_or(0.0);
        BaseUnit { dimension: Dimension(exponents), factor, offset }
    });
    Some(Unit { name, base })
}

fn simple_type(
    e: Element<'_>,
    names: &Names,
    model: &mut ModelDescription,
    faults: &mut Faults,
) -> Option<TypeDefinition> {
    let name = e.required("name", faults)?.to_owned();
    let Some((kind, body)) = e.children().find_map(|c| Kind::of(c.name()).map(|kind| (kind, c))) else {
        let kind = FaultKind::MissingElement { name: "Real, Integer, Boolean, String or Enumeration" };
        faults.add(&e.place(), e.label(), kind);
        return None;
    };
    let mut items = Vec::new();
    if kind == Kind::Enumeration {
        for item in body.all("Item") {
            let value = item.parsed("value", "a whole number", faults, |text| text.parse().ok());
            if item.attribute("value").is_none() {
                faults.add(&item.place(), item.label(), FaultKind::MissingAttribute { name: "value" });
            }
            if let (Some(name), Some(value)) = (item.required("name", faults), value) {
                items.push((name.to_owned(), value));
            }
        }
    }
    Some(TypeDefinition {
        name,
        kind,
        quantity: body.attribute("quantity").map(str::to_owned),
        unit: body.attribute("unit").map(|unit| names.unit(unit, body, model, faults)),
        min: body.real("min", faults),
        max: body.real("max", faults),
        items,
    })
}
