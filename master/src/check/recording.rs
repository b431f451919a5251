//! What a run writes: scalars, VTK datasets, headline results.

use std::collections::BTreeMap;

use super::plan::{ArrayPort, Connection, Port, RecordedScalar, Recording, SummaryItem, VtkDataset, VtkField};
use super::steps::{Times, in_steps};
use super::system::System;
use crate::decimal::Decimal;
use crate::description::annotations::{Address, Dataset};
use crate::fault::{FaultKind, Faults, Place};
use crate::model_description::{Causality, Item, Kind};
use crate::suggest::matches;

/// Patterns are compared with every variable; more than this is no description of a person.
const MOST_PATTERNS: u64 = 1000;

/// A period in base steps; 1 where none is given or the clock is missing.
fn period(every: Option<Decimal>, times: Option<&Times>, place: &Place, element: &str, faults: &mut Faults) -> u64 {
    let (Some(every), Some(times)) = (every, times) else { return 1 };
    in_steps("every", every, times.clock.step, place, element, faults).unwrap_or(1).max(1)
}

/// Scalars and datasets.
pub fn recording(
    system: &System<'_>,
    connections: &[Connection],
    times: Option<&Times>,
    faults: &mut Faults,
) -> Recording {
    let extras = &system.description.extras;
    let default = period(extras.every, times, &system.description.place, "Recording", faults);
    // Sorted by component and variable: the columns do not depend on the order of connections.
    let mut chosen: BTreeMap<(usize, usize), u64> = BTreeMap::new();
    for c in connections.iter().filter(|c| c.from.kind != Kind::String) {
        chosen.insert((c.from.component, c.from.variable), default);
    }
    if extras.scalars.len() as u64 > MOST_PATTERNS {
        let kind =
            FaultKind::TooMuch { what: "Scalars patterns", given: extras.scalars.len() as u64, allowed: MOST_PATTERNS };
        faults.add(&system.description.place, "Recording", kind);
        return Recording::default();
    }
    for rule in &extras.scalars {
        let element = format!("Scalars {}", rule.what);
        let every = match rule.every {
            Some(_) => period(rule.every, times, &rule.place, &element, faults),
            None => default,
        };
        let before = chosen.len();
        let mut hits = 0;
        for component in 0..system.description.components.len() {
            if !matches(&rule.what.element, system.name(component)) {
                continue;
            }
            let Some(model) = system.model(component) else {
                hits += 1; // its FMU is missing, which is told already
                continue;
            };
            for (index, variable) in model.variables.iter().enumerate() {
                if variable.kind != Kind::String && matches(&rule.what.connector, &variable.name) {
                    chosen.insert((component, index), every);
                    hits += 1;
                }
            }
        }
        if hits == 0 && chosen.len() == before {
            nothing_matches(system, &rule.what, &rule.place, &element, faults);
        }
    }
    let scalars = chosen.into_iter().filter_map(|((component, variable), every)| {
        let unit = system.model(component)?.unit_of(Item::Scalar(variable)).cloned();
        Some(RecordedScalar { port: system.port(component, variable)?, unit, every })
    });
    let scalars = scalars.collect();
    let mut vtk: Vec<VtkDataset> = Vec::new();
    for d in &extras.datasets {
        if vtk.iter().any(|other| other.name == d.name) {
            let kind = FaultKind::Duplicate { what: "dataset", name: d.name.clone(), first: 0 };
            faults.add(&d.place, "Recording", kind);
        }
        vtk.extend(dataset(system, d, times, faults));
    }
    Recording { scalars, vtk }
}

/// The best message for a pattern without a match: unknown component, unknown variable, or an array.
fn nothing_matches(system: &System<'_>, what: &Address, place: &Place, element: &str, faults: &mut Faults) {
    if !what.element.contains('*') {
        let Some(component) = system.component(&what.element, place, element, faults) else { return };
        if !what.connector.contains('*') {
            system.scalar(component, &what.connector, place, element, faults);
            return;
        }
    }
    let allowed = "a pattern that fits a scalar variable (* stands for any text)".to_owned();
    faults.add(place, element, FaultKind::BadValue { what: "connector".into(), given: what.to_string(), allowed });
}

fn dataset(system: &System<'_>, d: &Dataset, times: Option<&Times>, faults: &mut Faults) -> Option<VtkDataset> {
    let element = format!("Dataset \"{}\"", d.name);
    let every = period(d.every, times, &d.place, &element, faults);
    let position = array_of(system, &d.position, Some(Kind::Real), &d.place, &element, faults);
    let beside = |of: &Address, name: &str| Address { element: of.element.clone(), connector: name.to_owned() };
    let triangle = d
        .triangle
        .as_ref()
        .map(|name| array_of(system, &beside(&d.position, name), Some(Kind::Integer), &d.place, &element, faults));
    let mut fields = Vec::new();
    for f in &d.fields {
        let array = array_of(system, &f.array, None, &f.place, &element, faults);
        let index = f
            .index
            .as_ref()
            .map(|name| array_of(system, &beside(&f.array, name), Some(Kind::Integer), &f.place, &element, faults));
        let (Some(array), false) = (array, index == Some(None)) else { continue };
        let Some(model) = system.model(array.component) else { continue };
        let kind = model.arrays[array.array].kind;
        fields.push(VtkField { name: f.name.clone(), array, kind, index: index.flatten() });
    }
    let triangle = match triangle {
        Some(None) => return None,
        triangle => triangle.flatten(),
    };
    Some(VtkDataset { name: d.name.clone(), every, position: position?, triangle, fields })
}

/// An array that can be read, of a kind.
fn array_of(
    system: &System<'_>,
    address: &Address,
    kind: Option<Kind>,
    place: &Place,
    element: &str,
    faults: &mut Faults,
) -> Option<ArrayPort> {
    let port = system.array(address, place, element, faults)?;
    let array = &system.model(port.component)?.arrays[port.array];
    if array.causality == Causality::Input {
        let kind = FaultKind::CausalityMismatch {
            variable: address.to_string(),
            given: "input".into(),
            allowed: "output or calculatedParameter (record the output that feeds it)",
        };
        faults.add(place, element, kind);
        return None;
    }
    if let Some(kind) = kind
        && array.kind != kind
    {
        let kind = FaultKind::WrongKind {
            variable: element.to_owned(),
            given: format!("{address}, an array of {}", array.kind),
            allowed: format!("an array of {kind} here"),
        };
        faults.add(place, element, kind);
        return None;
    }
    Some(port)
}

/// A scalar by address.
pub(super) fn scalar_of(
    system: &System<'_>,
    address: &Address,
    place: &Place,
    element: &str,
    faults: &mut Faults,
) -> Option<Port> {
    let component = system.component(&address.element, place, element, faults)?;
    system.scalar(component, &address.connector, place, element, faults)
}

/// Headline results. With another stop time on the command line a window may lie after the end: such an item is left out.
pub fn summary(
    system: &System<'_>,
    times: Option<&Times>,
    stop_time_given: bool,
    faults: &mut Faults,
) -> Vec<SummaryItem> {
    let mut items = Vec::new();
    for i in &system.description.extras.summary {
        let element = format!("Item \"{}\"", i.name);
        let port = scalar_of(system, &i.what, &i.place, &element, faults);
        let (Some(port), Some(times)) = (port, times) else { continue };
        if port.kind == Kind::String {
            let given = format!("{}, a String", i.what);
            let kind = FaultKind::WrongKind { variable: element.clone(), given, allowed: "a number to average".into() };
            faults.add(&i.place, &element, kind);
            continue;
        }
        let clock = &times.clock;
        let mut steps = |name: &str, time: Option<Decimal>, absent: u64| match time {
            Some(time) => in_steps(name, time.minus(clock.start), clock.step, &i.place, &element, faults),
            None => Some(absent),
        };
        let (from, to) = (steps("from", i.from, 0), steps("to", i.to, clock.steps));
        let (Some(from), Some(mut to)) = (from, to) else { continue };
        if to > clock.steps && from < clock.steps {
            faults.note(&i.place, &element, "its window ends after the run and is cut there");
        }
        to = to.min(clock.steps);
        if from >= to {
            if stop_time_given {
                faults.note(&i.place, &element, "its window lies after the end of the run; the item is left out");
            } else {
                let allowed = "a window of at least one base step inside the run".to_owned();
                let given = format!("{} to {}", clock.time(from), clock.time(to));
                faults.add(&i.place, &element, FaultKind::BadValue { what: "window".into(), given, allowed });
            }
            continue;
        }
        let unit = system.model(port.component).and_then(|m| m.unit_of(Item::Scalar(port.variable))).cloned();
        let (name, measured, source) = (i.name.clone(), i.measured, i.source.clone());
        items.push(SummaryItem { name, port, unit, from, to, measured, source });
    }
    items
}
