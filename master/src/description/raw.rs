//! One `.ssd` file as it is written: nested systems, connectors, connections as pairs of names.

use super::annotations::{ComponentExtras, SystemExtras, of_type, time};
use super::parameters::{self, Bound, Context};
use super::{Connector, ConnectorKind, ConnectorType, Enumeration, Transformation};
use crate::decimal::Decimal;
use crate::fault::{Faults, Place};
use crate::model_description::Kind;
use crate::unit::Linear;
use crate::xml::{Element, boolean};

/// The type of OSP's annotations.
pub const OSP: &str = "com.opensimulationplatform";

/// A system with its elements.
#[derive(Default)]
pub struct System {
    pub name: String,
    pub connectors: Vec<Connector>,
    pub values: Vec<Bound>,
    pub elements: Vec<Child>,
    pub connections: Vec<Connection>,
    pub extras: SystemExtras,
    pub place: Place,
}

/// An element of a system.
pub enum Child {
    Component(Component),
    System(System),
    /// A reference to a signal dictionary: its name here, and the dictionary's.
    Dictionary {
        name: String,
        dictionary: String,
        place: Place,
    },
}

/// A component as written.
pub struct Component {
    pub name: String,
    pub source: String,
    pub connectors: Vec<Connector>,
    pub values: Vec<Bound>,
    pub step_hint: Option<Decimal>,
    pub extras: ComponentExtras,
    pub place: Place,
}

/// A connection as written: which end is the source is told by the connectors' kinds.
pub struct Connection {
    pub start: (Option<String>, String),
    pub end: (Option<String>, String),
    pub transformation: Option<Transformation>,
    pub suppress_unit_conversion: bool,
    pub place: Place,
}

/// Reads a `System` element and all below it.
pub fn system(e: Element<'_>, context: &mut Context<'_>, faults: &mut Faults) -> System {
    let mut system = System {
        name: e.attribute("name").unwrap_or_default().to_owned(),
        connectors: connectors(e, faults),
        values: parameters::bindings(e, false, context, faults),
        extras: SystemExtras::read(e.child("Annotations"), faults),
        place: e.place(),
        ..System::default()
    };
    for child in e.child("Elements").into_iter().flat_map(Element::children) {
        match child.name() {
            "Component" => system.elements.extend(component(child, context, faults).map(Child::Component)),
            "System" => {
                if child.required("name", faults).is_some() {
                    system.elements.push(Child::System(self::system(child, context, faults)));
                }
            }
            "SignalDictionaryReference" => {
                let (name, dictionary) = (child.required("name", faults), child.required("dictionary", faults));
                if let (Some(name), Some(dictionary)) = (name, dictionary) {
                    let text =
                        "what is connected through it is followed; the dictionary's own types and units are not read";
                    faults.note(&child.place(), child.label(), text);
                    let (name, dictionary) = (name.to_owned(), dictionary.to_owned());
                    system.elements.push(Child::Dictionary { name, dictionary, place: child.place() });
                }
            }
            other => faults.note(&child.place(), child.label(), format!("element \"{other}\" is ignored")),
        }
    }
    for c in e.child("Connections").into_iter().flat_map(|list| list.all("Connection")) {
        let start = c.required("startConnector", faults);
        let end = c.required("endConnector", faults);
        let (Some(start), Some(end)) = (start, end) else { continue };
        system.connections.push(Connection {
            start: (c.attribute("startElement").map(str::to_owned), start.to_owned()),
            end: (c.attribute("endElement").map(str::to_owned), end.to_owned()),
            transformation: transformation(c, faults),
            suppress_unit_conversion: c.boolean("suppressUnitConversion", faults).unwrap_or(false),
            place: c.place(),
        });
    }
    system
}

fn component(e: Element<'_>, context: &mut Context<'_>, faults: &mut Faults) -> Option<Component> {
    let name = e.required("name", faults);
    let source = e.required("source", faults);
    match e.attribute("type") {
        None | Some("application/x-fmu-sharedlibrary") => {}
        Some(given) => e.bad_value("type", given, "application/x-fmu-sharedlibrary (an FMU)", faults),
    }
    match e.attribute("implementation") {
        None | Some("any" | "CoSimulation") => {}
        Some(given) => e.bad_value("implementation", given, "any or CoSimulation", faults),
    }
    let annotations = e.child("Annotations");
    let hint = of_type(annotations, OSP).filter(|hint| hint.name() == "StepSizeHint");
    Some(Component {
        connectors: connectors(e, faults),
        values: parameters::bindings(e, true, context, faults),
        step_hint: hint.and_then(|hint| {
            hint.required("value", faults)?;
            time(hint, "value", true, faults)
        }),
        extras: ComponentExtras::read(annotations, faults),
        place: e.place(),
        name: name?.to_owned(),
        source: source?.to_owned(),
    })
}

fn connectors(e: Element<'_>, faults: &mut Faults) -> Vec<Connector> {
    let mut connectors = Vec::new();
    for c in e.child("Connectors").into_iter().flat_map(|list| list.all("Connector")) {
        let name = c.required("name", faults);
        let kind = c.required("kind", faults).and_then(|_| {
            c.parsed("kind", "input, output, parameter, calculatedParameter or inout", faults, ConnectorKind::of)
        });
        // SSP 1.0 puts the type as a child; 2.0 does too.
        let value_type = c.children().find_map(|t| match t.name() {
            "Real" => Some(ConnectorType::Real(t.attribute("unit").map(str::to_owned))),
            "Binary" => Some(ConnectorType::Binary),
            "Enumeration" => t.required("name", faults).map(|name| ConnectorType::Enumeration(name.to_owned())),
            other => Kind::of(other).map(ConnectorType::Plain),
        });
        if let (Some(name), Some(kind)) = (name, kind) {
            connectors.push(Connector { name: name.to_owned(), kind, value_type, place: c.place() });
        }
    }
    connectors
}

/// The transformation of a connection or mapping entry.
pub fn transformation(e: Element<'_>, faults: &mut Faults) -> Option<Transformation> {
    let whole = |text: &str| text.parse::<i32>().ok();
    let logical = |text: &str| boolean(text).map(i32::from);
    for t in e.children() {
        match t.name() {
            "LinearTransformation" => {
                return Some(Transformation::Linear(Linear {
                    factor: t.real("factor", faults).unwrap_or(1.0),
                    offset: t.real("offset", faults).unwrap_or(0.0),
                }));
            }
            "BooleanMappingTransformation" => {
                return Some(Transformation::Booleans(table(t, "true or false", logical, faults)));
            }
            "IntegerMappingTransformation" => {
                return Some(Transformation::Integers(table(t, "a whole number", whole, faults)));
            }
            "EnumerationMappingTransformation" => {
                return Some(Transformation::Items(table(t, "a name", |text| Some(text.to_owned()), faults)));
            }
            _ => {}
        }
    }
    None
}

fn table<T>(e: Element<'_>, allowed: &str, read: impl Fn(&str) -> Option<T>, faults: &mut Faults) -> Vec<(T, T)> {
    let mut entries = Vec::new();
    for entry in e.all("MapEntry") {
        if entry.required("source", faults).is_none() || entry.required("target", faults).is_none() {
            continue;
        }
        let source = entry.parsed("source", allowed, faults, &read);
        let target = entry.parsed("target", allowed, faults, &read);
        if let (Some(source), Some(target)) = (source, target) {
            entries.push((source, target));
        }
    }
    entries
}

/// The file's `Enumerations`.
pub fn enumerations(root: Element<'_>, faults: &mut Faults) -> Vec<Enumeration> {
    let mut list = Vec::new();
    for e in root.child("Enumerations").into_iter().flat_map(|l| l.all("Enumeration")) {
        let mut items = Vec::new();
        for item in e.all("Item") {
            if item.required("value", faults).is_none() {
                continue;
            }
            let value = item.parsed("value", "a whole number", faults, |text| text.parse().ok());
            if let (Some(name), Some(value)) = (item.required("name", faults), value) {
                items.push((name.to_owned(), value));
            }
        }
        if let Some(name) = e.required("name", faults) {
            list.push(Enumeration { name: name.to_owned(), items });
        }
    }
    list
}
