//! Parameter bindings: `.ssv` parameter sets and `.ssm` mappings, inline or in files.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::raw::transformation;
use super::uri::{Roots, find};
use super::{Given, Transformation};
use crate::fault::{Fault, FaultKind, Faults, Place};
use crate::model_description::types;
use crate::unit::{Linear, Unit};
use crate::xml::{Document, Element, Limits, boolean};

/// Parameters that come out of one mapping.
const MOST_MAPPED: usize = 1_000_000;

/// Where the file with the bindings lies, and what else is read on the way.
pub struct Context<'p> {
    /// For `source` URIs.
    pub roots: Roots<'p>,
    /// The description's units, for inline sets that have none of their own.
    pub units: HashMap<String, Unit>,
    /// Files read so far.
    pub files: Vec<PathBuf>,
}

/// A value bound to a (hierarchical) name, mapping applied.
#[derive(Clone)]
pub struct Bound {
    pub name: String,
    pub value: Given,
    pub unit: Option<Unit>,
    pub linear: Option<Linear>,
    pub suppress_unit_conversion: bool,
    pub must_exist: bool,
    pub place: Place,
}

/// All bindings of a component or system, in order; later ones win.
pub fn bindings(e: Element<'_>, at_component: bool, context: &mut Context<'_>, faults: &mut Faults) -> Vec<Bound> {
    let mut all = Vec::new();
    for b in e.child("ParameterBindings").into_iter().flat_map(|list| list.all("ParameterBinding")) {
        match b.attribute("type") {
            None | Some("application/x-ssp-parameter-set") => {}
            Some(given) => {
                b.bad_value("type", given, "application/x-ssp-parameter-set", faults);
                continue;
            }
        }
        let prefix = b.attribute("prefix").unwrap_or_default();
        let mut values = match b.attribute("source").filter(|source| !source.is_empty()) {
            Some(_) => load(b, "parameter set", context, faults)
                .map(|(document, _)| match document.root_named("ParameterSet") {
                    Ok(set) => parameter_set(set, prefix, false, &HashMap::new(), faults),
                    Err(fault) => {
                        faults.push(fault);
                        Vec::new()
                    }
                })
                .unwrap_or_default(),
            None => match b.child("ParameterValues").and_then(|values| values.child("ParameterSet")) {
                Some(set) => parameter_set(set, prefix, at_component, &context.units, faults),
                None => {
                    let name = "ParameterValues/ParameterSet (or an attribute \"source\")";
                    faults.add(&b.place(), b.label(), FaultKind::MissingElement { name });
                    Vec::new()
                }
            },
        };
        if let Some(m) = b.child("ParameterMapping") {
            let inline = m.child("ParameterMapping");
            if let Some(mapping) = inline {
                values = mapped(values, mapping, faults);
            } else if m.attribute("source").is_some()
                && let Some((document, _)) = load(m, "parameter mapping", context, faults)
            {
                match document.root_named("ParameterMapping") {
                    Ok(mapping) => values = mapped(values, mapping, faults),
                    Err(fault) => faults.push(fault),
                }
            }
        }
        all.append(&mut values);
    }
    all
}

/// Reads the file that `source` names.
fn load(
    e: Element<'_>,
    what: &'static str,
    context: &mut Context<'_>,
    faults: &mut Faults,
) -> Option<(Document, PathBuf)> {
    let source = e.attribute("source")?;
    if e.attribute("sourceBase") == Some("component") {
        let what = "sourceBase=\"component\"".to_owned();
        let instead = "put the file beside the description and leave sourceBase out";
        faults.add(&e.place(), e.label(), FaultKind::Unsupported { what, instead });
        return None;
    }
    // Parameter files lie beside the description; the search path is for FMUs.
    let path = match find(source, Roots { search: &[], ..context.roots }) {
        Ok(path) => path,
        Err(searched) => {
            let kind = FaultKind::NotFound { what, source_uri: source.to_owned(), searched };
            faults.add(&e.place(), e.label(), kind);
            return None;
        }
    };
    match read_document(&path, &shown(&path, context.roots)) {
        Ok(document) => {
            context.files.push(path.clone());
            Some((document, path))
        }
        Err(fault) => {
            faults.push(fault);
            None
        }
    }
}

/// A file of an archive is shown by its name inside.
fn shown(path: &Path, roots: Roots<'_>) -> PathBuf {
    match roots.archive {
        Some(folder) => path.strip_prefix(folder).unwrap_or(path).to_path_buf(),
        None => crate::fault::shown(path),
    }
}

/// Reads an XML file within the default limits.
pub fn read_document(path: &Path, name: &Path) -> Result<Document, Fault> {
    let limits = Limits::default();
    Document::read(&crate::files::read(path, name, limits.bytes)?, name, limits)
}

/// The units of a file by name.
pub fn units(root: Element<'_>, faults: &mut Faults) -> HashMap<String, Unit> {
    let list = root.child("Units").into_iter().flat_map(|list| list.all("Unit"));
    list.filter_map(|e| types::unit(e, faults)).map(|unit| (unit.name.clone(), unit)).collect()
}

/// The parameters of a file that is given by itself.
pub fn parameter_file(root: Element<'_>, units: &HashMap<String, Unit>, faults: &mut Faults) -> Vec<Bound> {
    parameter_set(root, "", true, units, faults)
}

fn parameter_set(
    set: Element<'_>,
    prefix: &str,
    must_exist: bool,
    outer_units: &HashMap<String, Unit>,
    faults: &mut Faults,
) -> Vec<Bound> {
    let own_units = units(set, faults);
    let mut values = Vec::new();
    for p in set.child("Parameters").into_iter().flat_map(|list| list.all("Parameter")) {
        let Some(name) = p.required("name", faults) else { continue };
        let Some(body) = p.children().next() else {
            let name = "Real, Integer, Boolean, String or Enumeration";
            faults.add(&p.place(), p.label(), FaultKind::MissingElement { name });
            continue;
        };
        let Some(text) = body.required("value", faults) else { continue };
        let value = match body.name() {
            "Real" => body.real("value", faults).map(Given::Real),
            "Integer" => {
                let allowed = "a whole number from -2147483648 to 2147483647";
                body.parsed("value", allowed, faults, |text| text.parse().ok()).map(Given::Integer)
            }
            "Boolean" => body.parsed("value", "true, false, 1 or 0", faults, boolean).map(Given::Boolean),
            "String" => Some(Given::String(text.to_owned())),
            "Enumeration" => Some(Given::Item(text.to_owned())),
            other => {
                let what = format!("a parameter of type {other}");
                let instead = "FMI 2.0 has Real, Integer, Boolean, String and Enumeration";
                faults.add(&body.place(), p.label(), FaultKind::Unsupported { what, instead });
                None
            }
        };
        let unit = body.attribute("unit").map(|unit| {
            own_units.get(unit).or_else(|| outer_units.get(unit)).cloned().unwrap_or_else(|| Unit::named(unit))
        });
        let Some(value) = value else { continue };
        values.push(Bound {
            name: format!("{prefix}{name}"),
            value,
            unit,
            linear: None,
            suppress_unit_conversion: false,
            must_exist,
            place: p.place(),
        });
    }
    values
}

/// Renames and transforms. With a mapping, only what it maps is applied; one source may have several targets.
fn mapped(values: Vec<Bound>, mapping: Element<'_>, faults: &mut Faults) -> Vec<Bound> {
    let mut by_name: HashMap<&str, Vec<&Bound>> = HashMap::new();
    for value in &values {
        by_name.entry(&value.name).or_default().push(value);
    }
    let mut out = Vec::new();
    for entry in mapping.all("MappingEntry") {
        let (Some(source), Some(target)) = (entry.required("source", faults), entry.required("target", faults)) else {
            continue;
        };
        let suppress = entry.boolean("suppressUnitConversion", faults).unwrap_or(false);
        let transformation = transformation(entry, faults);
        let Some(found) = by_name.get(source) else {
            faults.note(&entry.place(), entry.label(), format!("the parameter set has no parameter \"{source}\""));
            continue;
        };
        if out.len() + found.len() > MOST_MAPPED {
            let (given, allowed) = ((out.len() + found.len()) as u64, MOST_MAPPED as u64);
            faults.add(&entry.place(), entry.label(), FaultKind::TooMuch { what: "mapped parameters", given, allowed });
            break;
        }
        for bound in found {
            let mut bound = Bound { name: target.to_owned(), suppress_unit_conversion: suppress, ..(*bound).clone() };
            match &transformation {
                None => {}
                Some(Transformation::Linear(linear)) => bound.linear = Some(*linear),
                Some(table) => bound.value = through(&bound.value, table),
            }
            out.push(bound);
        }
    }
    out
}

/// A value through a table; one that is not in it stays.
fn through(value: &Given, table: &Transformation) -> Given {
    let look = |table: &[(i32, i32)], value: i32| table.iter().find(|(from, _)| *from == value).map(|(_, to)| *to);
    match (value, table) {
        (Given::Boolean(v), Transformation::Booleans(table)) => {
            Given::Boolean(look(table, i32::from(*v)).map_or(*v, |to| to != 0))
        }
        (Given::Integer(v), Transformation::Integers(table)) => Given::Integer(look(table, *v).unwrap_or(*v)),
        (Given::Item(v), Transformation::Items(table)) => {
            Given::Item(table.iter().find(|(from, _)| from == v).map_or_else(|| v.clone(), |(_, to)| to.clone()))
        }
        (value, _) => value.clone(),
    }
}
