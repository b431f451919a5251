//! Inputs over time from a CSV file, and conditions that end a run.

use std::path::Path;
use std::sync::Arc;

use terramech_results::{CsvTable, Data};

use super::plan::{Comparison, Connection, Drive, Port, StopCondition};
use super::system::System;
use crate::fault::{FaultKind, Faults, Place};
use crate::model_description::{Causality, Item, Kind, Variability};
use crate::unit::{Linear, Relation, Unit, relate};

/// The columns of a CSV file as `results.csv` has them: `time [s],component.variable [unit],...`.
pub fn drives(system: &System<'_>, path: Option<&Path>, connections: &[Connection], faults: &mut Faults) -> Vec<Drive> {
    let Some(path) = path else { return Vec::new() };
    let place = Place::file(path);
    let read = crate::files::open(path)
        .map_err(|e| e.to_string())
        .and_then(|_| CsvTable::read(path).map_err(|e| e.to_string()));
    let table = match read {
        Ok(table) => table,
        Err(reason) => {
            faults.add(&place, "", FaultKind::Unreadable { reason });
            return Vec::new();
        }
    };
    let finite = table.time.iter().all(|t| t.is_finite());
    if table.time.is_empty() || !finite || table.time.windows(2).any(|w| w[1] <= w[0]) {
        let (what, given) = ("time".into(), format!("{} rows", table.time.len()));
        let allowed = "at least one row, times ascending".into();
        faults.add(&place, "", FaultKind::BadValue { what, given, allowed });
        return Vec::new();
    }
    let times: Arc<[f64]> = table.time.into();
    let mut drives = Vec::new();
    for column in table.columns {
        let element = format!("column \"{}\"", column.name);
        let Some(port) = dotted(system, &column.name, &place, &element, faults) else { continue };
        let Some(model) = system.model(port.component) else { continue };
        let variable = &model.variables[port.variable];
        let settable = variable.causality == Causality::Input
            || (variable.causality == Causality::Parameter && variable.variability == Variability::Tunable);
        if !settable {
            let given = format!("{} and variability {}", variable.causality, variable.variability);
            let allowed = "input, or parameter of variability tunable";
            faults.add(&place, element, FaultKind::CausalityMismatch { variable: column.name, given, allowed });
            continue;
        }
        if let Some(c) = connections.iter().find(|c| c.to == port) {
            let source_name = format!("{}.{}", system.name(c.from.component), source_variable(system, c));
            let kind = FaultKind::SetButConnected { target: column.name, source_name, place: c.place.to_string() };
            faults.add(&place, element, kind);
            continue;
        }
        let Data::Numbers(mut values) = column.data else {
            let kind = FaultKind::WrongKind {
                variable: column.name,
                given: "a column of texts".into(),
                allowed: variable.kind.to_string(),
            };
            faults.add(&place, element, kind);
            continue;
        };
        if let Some(bad) = values.iter().find(|x| !x.is_finite() || (variable.kind != Kind::Real && x.fract() != 0.0)) {
            let kind = FaultKind::WrongKind {
                variable: column.name,
                given: bad.to_string(),
                allowed: format!("finite values of kind {}", variable.kind),
            };
            faults.add(&place, element, kind);
            continue;
        }
        let own = model.unit_of(Item::Scalar(port.variable));
        let given = (!column.unit.is_empty()).then(|| Unit::named(&column.unit));
        match relate(given.as_ref(), own) {
            Relation::Same => {}
            Relation::Convert(map) => values.iter_mut().for_each(|x| *x = Linear::apply(map, *x)),
            Relation::Unknown => faults.note(&place, element, "its units cannot be compared; taken as it is"),
            Relation::Different => {
                let kind = FaultKind::UnitMismatch {
                    from: "the column".into(),
                    from_unit: given.map(|u| u.to_string()).unwrap_or_default(),
                    to: column.name,
                    to_unit: own.map(ToString::to_string).unwrap_or_default(),
                };
                faults.add(&place, element, kind);
                continue;
            }
        }
        drives.push(Drive { port, times: Arc::clone(&times), values });
    }
    drives
}

fn source_variable(system: &System<'_>, c: &Connection) -> String {
    system.model(c.from.component).map(|m| m.variables[c.from.variable].name.to_string()).unwrap_or_default()
}

/// `component.variable` to its port.
fn dotted(system: &System<'_>, name: &str, place: &Place, element: &str, faults: &mut Faults) -> Option<Port> {
    let Some((component, variable)) = system.split(name) else {
        let first = name.split('.').next().unwrap_or_default();
        system.component(first, place, element, faults);
        return None;
    };
    system.scalar(component, variable, place, element, faults)
}

/// Conditions such as `rig.drawbar_pull < 0`.
pub fn conditions(system: &System<'_>, texts: &[String], faults: &mut Faults) -> Vec<StopCondition> {
    let place = Place::file("--stop-when");
    let mut conditions = Vec::new();
    for text in texts {
        // Longer signs first.
        let signs = ["<=", ">=", "==", "!=", "<", ">"];
        let parts = signs.iter().find_map(|sign| {
            let (name, value) = text.split_once(sign)?;
            Some((name.trim(), *sign, value.trim().parse::<f64>().ok().filter(|x| x.is_finite())?))
        });
        let Some((name, sign, value)) = parts else {
            let (what, given) = ("--stop-when".into(), text.clone());
            let allowed =
                "unit.variable, one of < <= > >= == !=, and a number, such as \"rig.drawbar_pull < 0\"".into();
            faults.add(&place, "", FaultKind::BadValue { what, given, allowed });
            continue;
        };
        let Some(port) = dotted(system, name, &place, text, faults) else { continue };
        if port.kind == Kind::String {
            let kind = FaultKind::WrongKind {
                variable: name.to_owned(),
                given: "a String".into(),
                allowed: "a number to compare".into(),
            };
            faults.add(&place, text, kind);
            continue;
        }
        let comparison = match sign {
            "<=" => Comparison::AtMost,
            ">=" => Comparison::AtLeast,
            "==" => Comparison::Equal,
            "!=" => Comparison::Unequal,
            "<" => Comparison::Below,
            _ => Comparison::Above,
        };
        conditions.push(StopCondition { text: text.clone(), port, comparison, value });
    }
    conditions
}
