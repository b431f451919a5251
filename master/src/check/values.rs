//! Parameter values and `--set` overrides to settings by value reference.

use std::path::{Path, PathBuf};

use super::plan::{Connection, Setting};
use super::system::System;
use crate::description::{Assignment, Given};
use crate::fault::{FaultKind, Faults, Place};
use crate::model_description::variables::{allowed_value, value_of};
use crate::model_description::{Item, Kind, ModelDescription, Value, Variable};
use crate::unit::{Relation, relate};

/// Name of the parameter that holds a unit's specification.
const SPECIFICATION: &str = "specification";

/// The settings of each component. Specification files go into `files`.
pub fn settings(
    system: &System<'_>,
    overrides: &[String],
    files: &mut Vec<PathBuf>,
    faults: &mut Faults,
) -> (Vec<Vec<Setting>>, Vec<Override>) {
    let mut all = Vec::with_capacity(system.description.components.len());
    for (index, c) in system.description.components.iter().enumerate() {
        let mut settings = Vec::new();
        if let Some(model) = system.model(index) {
            for a in &c.values {
                settings.extend(assigned(system, index, model, a, faults));
            }
        }
        all.push(settings);
    }
    let mut done: Vec<Override> = Vec::new();
    for text in overrides {
        let Some(next) = overridden(system, text, &mut all, faults) else { continue };
        match done.iter().find(|o| (o.component, o.variable) == (next.component, next.variable)) {
            Some(o) => {
                let kind =
                    FaultKind::SetTwice { target: next.target, first: o.value.clone(), second: next.value.clone() };
                faults.add(&Place::file("--set"), "", kind);
            }
            None => done.push(next),
        }
    }
    for (index, settings) in all.iter_mut().enumerate() {
        let Some(model) = system.model(index) else { continue };
        for setting in settings.iter_mut() {
            if &*model.variables[setting.variable].name == SPECIFICATION
                && let Value::String(text) = &mut setting.value
            {
                resolve_specification(system, index, model.is_ours, text, files, faults);
            }
        }
    }
    (all, done)
}

/// A variable that the command line sets.
pub struct Override {
    component: usize,
    variable: usize,
    /// `unit.variable`.
    target: String,
    value: String,
}

/// A value that a connection would overwrite silently is a mistake of whoever gave it.
pub fn refuse_connected(system: &System<'_>, overrides: &[Override], connections: &[Connection], faults: &mut Faults) {
    for o in overrides {
        let Some(c) = connections.iter().find(|c| (c.to.component, c.to.variable) == (o.component, o.variable)) else {
            continue;
        };
        let variable = system.model(c.from.component).map(|model| &*model.variables[c.from.variable].name);
        let source_name = format!("{}.{}", system.name(c.from.component), variable.unwrap_or_default());
        let kind = FaultKind::SetButConnected { target: o.target.clone(), source_name, place: c.place.to_string() };
        faults.add(&Place::file("--set"), "", kind);
    }
}

fn assigned(
    system: &System<'_>,
    component: usize,
    model: &ModelDescription,
    a: &Assignment,
    faults: &mut Faults,
) -> Option<Setting> {
    let element = format!("Parameter \"{}\"", a.variable);
    if model.find(&a.variable).is_none() && !a.must_exist {
        let text = format!("\"{}\" has no such variable; the value is ignored", system.name(component));
        faults.note(&a.place, element, text);
        return None;
    }
    let port = system.scalar(component, &a.variable, &a.place, &element, faults)?;
    let variable = &model.variables[port.variable];
    let name = format!("{}.{}", system.name(component), variable.name);
    let wrong = |faults: &mut Faults| {
        let allowed = takes(variable);
        let kind = FaultKind::WrongKind { variable: name.clone(), given: a.value.described(), allowed };
        faults.add(&a.place, element.clone(), kind);
        None
    };
    let value = match (variable.kind, &a.value) {
        (Kind::Real, Given::Real(_) | Given::Integer(_)) => {
            let mut x = if let Given::Real(x) = a.value { x } else { integer(&a.value).into() };
            let unit = model.unit_of(Item::Scalar(port.variable));
            match relate(a.unit.as_ref(), unit) {
                _ if a.suppress_unit_conversion => {}
                Relation::Same => {}
                Relation::Convert(map) => x = map.apply(x),
                Relation::Different => {
                    let kind = FaultKind::UnitMismatch {
                        from: "the given value".into(),
                        from_unit: a.unit.as_ref().map(ToString::to_string).unwrap_or_default(),
                        to: name,
                        to_unit: unit.map(ToString::to_string).unwrap_or_default(),
                    };
                    faults.add(&a.place, element, kind);
                    return None;
                }
                Relation::Unknown => {
                    faults.note(&a.place, element.clone(), "its units cannot be compared; taken as it is")
                }
            }
            Value::Real(a.linear.map_or(x, |map| map.apply(x)))
        }
        (Kind::Integer, Given::Integer(x)) => match a.linear {
            None => Value::Integer(*x),
            Some(_) => return wrong(faults),
        },
        (Kind::Boolean, Given::Boolean(x)) => Value::Boolean(*x),
        (Kind::String, Given::String(x)) => Value::String(x.clone()),
        (Kind::Enumeration, Given::Item(text)) => item_value(model, variable, text, &a.place, &element, faults)?,
        (Kind::Enumeration, Given::Integer(x)) => {
            item_value(model, variable, &x.to_string(), &a.place, &element, faults)?
        }
        _ => return wrong(faults),
    };
    finish(variable, port.variable, name, value, &a.place, &element, faults)
}

fn integer(given: &Given) -> i32 {
    if let Given::Integer(x) = given { *x } else { 0 }
}

/// The kind of a variable in words.
fn takes(variable: &Variable) -> String {
    format!("{} ({})", variable.kind, allowed_value(variable.kind))
}

/// An item of an enumeration by name or number.
fn item_value(
    model: &ModelDescription,
    variable: &Variable,
    text: &str,
    place: &Place,
    element: &str,
    faults: &mut Faults,
) -> Option<Value> {
    let items = model.type_of(variable).map(|t| t.items.as_slice()).unwrap_or_default();
    let number = text.trim().parse::<i32>().ok();
    let found = items.iter().find(|(name, _)| name == text).or_else(|| items.iter().find(|(_, v)| Some(*v) == number));
    if let Some((_, value)) = found {
        return Some(Value::Integer(*value));
    }
    let allowed = items.iter().take(30).map(|(name, value)| format!("{name} ({value})")).collect::<Vec<_>>().join(", ");
    let enumeration = model.type_of(variable).map_or_else(|| variable.name.to_string(), |t| t.name.clone());
    faults.add(place, element, FaultKind::UnknownItem { enumeration, given: text.to_owned(), allowed });
    None
}

/// Range and whether the variable may be set at all.
fn finish(
    variable: &Variable,
    index: usize,
    name: String,
    value: Value,
    place: &Place,
    element: &str,
    faults: &mut Faults,
) -> Option<Setting> {
    if !variable.takes_start() {
        let kind = FaultKind::CausalityMismatch {
            variable: name,
            given: format!("{} and variability {}", variable.causality, variable.variability),
            allowed: "parameter, input, or a variable whose initial value is set from outside (initial exact or approx)",
        };
        faults.add(place, element, kind);
        return None;
    }
    let number = match value {
        Value::Real(x) => Some(x),
        Value::Integer(x) => Some(f64::from(x)),
        _ => None,
    };
    if let Some(x) = number
        && (variable.min.is_some_and(|min| x < min) || variable.max.is_some_and(|max| x > max))
    {
        let bound = |b: Option<f64>, sign: &str| b.map_or_else(|| format!("{sign}infinity"), |b| b.to_string());
        let range = format!("{} to {}", bound(variable.min, "-"), bound(variable.max, ""));
        faults.add(place, element, FaultKind::OutOfRange { variable: name, given: value.to_string(), range });
        return None;
    }
    Some(Setting { variable: index, value_reference: variable.value_reference, kind: variable.kind, value })
}

/// One `unit.variable=value`.
fn overridden(system: &System<'_>, text: &str, all: &mut [Vec<Setting>], faults: &mut Faults) -> Option<Override> {
    let place = Place::file("--set");
    let bad = |faults: &mut Faults| -> Option<Override> {
        let kind = FaultKind::BadValue {
            what: "--set".into(),
            given: text.to_owned(),
            allowed: "unit.variable=value, such as rig.drive.slip=0.5".into(),
        };
        faults.add(&place, "", kind);
        None
    };
    let Some((target, given)) = text.split_once('=') else { return bad(faults) };
    let target = target.trim();
    let Some((component, name)) = system.split(target) else {
        match target.split_once('.') {
            Some((unit, _)) => {
                system.component(unit, &place, text, faults);
            }
            None => return bad(faults),
        }
        return None;
    };
    let port = system.scalar(component, name, &place, text, faults)?;
    let model = system.model(component)?;
    let variable = &model.variables[port.variable];
    let value = match variable.kind {
        Kind::Enumeration => item_value(model, variable, given, &place, text, faults),
        kind => {
            let read = value_of(kind, given);
            if read.is_none() {
                let given = format!("\"{given}\"");
                let kind = FaultKind::WrongKind { variable: target.to_owned(), given, allowed: takes(variable) };
                faults.add(&place, text, kind);
            }
            read
        }
    };
    let setting = finish(variable, port.variable, target.to_owned(), value?, &place, text, faults)?;
    let settings = &mut all[component];
    match settings.iter_mut().find(|s| s.variable == setting.variable) {
        Some(old) => *old = setting,
        None => settings.push(setting),
    }
    Some(Override { component, variable: port.variable, target: target.to_owned(), value: given.to_owned() })
}

/// A specification that is a path is made absolute, counted from the description's folder; text that starts with `{` and an
/// empty one stay. A foreign unit's parameter of that name is left alone unless the file exists.
fn resolve_specification(
    system: &System<'_>,
    component: usize,
    is_ours: bool,
    text: &mut String,
    files: &mut Vec<PathBuf>,
    faults: &mut Faults,
) {
    if text.is_empty() || text.trim_start().starts_with('{') {
        return;
    }
    let path = system.description.folder.join(Path::new(&*text));
    match path.canonicalize() {
        Ok(found) if found.is_file() => {
            *text = found.to_string_lossy().into_owned();
            if !files.contains(&found) {
                files.push(found);
            }
        }
        _ if is_ours => {
            let c = &system.description.components[component];
            let kind = FaultKind::NotFound {
                what: "specification",
                source_uri: text.clone(),
                searched: path.display().to_string(),
            };
            faults.add(&c.place, format!("Component \"{}\"", c.name), kind);
        }
        _ => {}
    }
}
