//! Scalar connections: names to ports, causality, types, units, extrapolation. And the connectors a description declares.

use super::plan::{Connection, Port, Transform, When};
use super::system::System;
use crate::description::{self, ConnectorKind, ConnectorType, Description, End, Transformation};
use crate::fault::{FaultKind, Faults};
use crate::model_description::{Causality, Item, Kind, ModelDescription, Variability};
use crate::suggest::matches;
use crate::unit::{Linear, Relation, Unit, relate};

/// Rules with patterns are compared with every connection; more than this is no description of a person.
const MOST_RULES: usize = 1000;

/// Compares the declared connectors with the variables: name, kind, type, unit.
pub fn check_connectors(system: &System<'_>, faults: &mut Faults) {
    for (component, c) in system.description.components.iter().enumerate() {
        let Some(model) = system.model(component) else { continue };
        for connector in &c.connectors {
            // The label is needed for faults only; most connectors have none.
            let Some(Item::Scalar(index)) = model.find(&connector.name) else {
                let element = format!("Connector \"{}\" of \"{}\"", connector.name, c.name);
                system.scalar(component, &connector.name, &connector.place, &element, faults);
                continue;
            };
            let variable = &model.variables[index];
            let fits = match connector.kind {
                ConnectorKind::Input => variable.causality == Causality::Input,
                ConnectorKind::Output => variable.causality == Causality::Output,
                ConnectorKind::Parameter => variable.causality == Causality::Parameter,
                ConnectorKind::CalculatedParameter => variable.causality == Causality::CalculatedParameter,
                ConnectorKind::Inout => true,
            };
            let name = || format!("{}.{}", c.name, connector.name);
            let element = || format!("Connector \"{}\" of \"{}\"", connector.name, c.name);
            if !fits {
                let given = variable.causality.to_string();
                let kind = FaultKind::CausalityMismatch { variable: name(), given, allowed: connector.kind.name() };
                faults.add(&connector.place, element(), kind);
            }
            let Some(declared) = &connector.value_type else { continue };
            if declared.kind() != Some(variable.kind) {
                let kind = FaultKind::TypeMismatch {
                    from: format!("connector {}", connector.name),
                    from_type: declared.kind().map_or("Binary", Kind::name).to_owned(),
                    to: format!("variable {}", name()),
                    to_type: variable.kind.to_string(),
                };
                faults.add(&connector.place, element(), kind);
            } else if let ConnectorType::Real(Some(unit)) = declared {
                let unit = unit_of_file(system.description, unit);
                let own = model.unit_of(Item::Scalar(index));
                // Another scale is refused as well: values are in the variable's unit, and a connector that says otherwise
                // would be believed by a reader.
                if matches!(relate(Some(&unit), own), Relation::Different | Relation::Convert(_)) {
                    let kind = FaultKind::UnitMismatch {
                        from: format!("connector {}", connector.name),
                        from_unit: unit.to_string(),
                        to: format!("variable {}", name()),
                        to_unit: own.map(ToString::to_string).unwrap_or_default(),
                    };
                    faults.add(&connector.place, element(), kind);
                }
            }
        }
    }
}

/// A unit by name, as the description defines it.
fn unit_of_file(description: &Description, name: &str) -> Unit {
    let defined = description.units.iter().find(|unit| unit.name == name);
    defined.cloned().unwrap_or_else(|| Unit::named(name))
}

/// Resolves all connections.
pub fn resolve(system: &System<'_>, faults: &mut Faults) -> Vec<Connection> {
    let connections = &system.description.connections;
    let mut resolved = Vec::with_capacity(connections.len());
    for c in connections {
        resolved.extend(connection(system, c, faults));
    }
    resolved
}

/// How messages call a connection.
struct Label<'a>(&'a System<'a>, &'a description::Connection);

impl std::fmt::Display for Label<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = |end: &End| format!("{}.{}", self.0.name(end.component), end.connector);
        write!(f, "Connection {} -> {}", name(&self.1.from), name(&self.1.to))
    }
}

fn connection(system: &System<'_>, c: &description::Connection, faults: &mut Faults) -> Option<Connection> {
    let from = end(system, c, &c.from, faults);
    let to = end(system, c, &c.to, faults);
    let (from, to) = (from?, to?);
    let (a, b) = (system.model(from.component)?, system.model(to.component)?);
    let (source, target) = (&a.variables[from.variable], &b.variables[to.variable]);
    let label = Label(system, c);
    let dotted = |end: &End| format!("{}.{}", system.name(end.component), end.connector);
    let mut sound = true;
    if !matches!(source.causality, Causality::Output | Causality::CalculatedParameter) {
        let kind = FaultKind::CausalityMismatch {
            variable: dotted(&c.from),
            given: source.causality.to_string(),
            allowed: "output or calculatedParameter (it is the source of a connection)",
        };
        faults.add(&c.place, label.to_string(), kind);
        sound = false;
    }
    if !matches!(target.causality, Causality::Input | Causality::Parameter) {
        let kind = FaultKind::CausalityMismatch {
            variable: dotted(&c.to),
            given: target.causality.to_string(),
            allowed: "input or parameter (it is the target of a connection)",
        };
        faults.add(&c.place, label.to_string(), kind);
        sound = false;
    }
    let transform = transform(system, c, (a, from), (b, to), faults)?;
    if !sound {
        return None;
    }
    let once = target.causality == Causality::Parameter
        || source.causality == Causality::CalculatedParameter
        || matches!(source.variability, Variability::Fixed | Variability::Constant);
    let when = if once { When::Initially } else { When::Always };
    Some(Connection { from, to, transform, when, extrapolation: 0, place: c.place.clone() })
}

/// The port of one end. The label is made only if there is something to tell.
fn end(system: &System<'_>, c: &description::Connection, end: &End, faults: &mut Faults) -> Option<Port> {
    match system.model(end.component)?.find(&end.connector) {
        Some(Item::Scalar(variable)) => system.port(end.component, variable),
        _ => system.scalar(end.component, &end.connector, &c.place, &Label(system, c).to_string(), faults),
    }
}

/// The unit of an end: the variable's, else the connector's.
fn unit_of(system: &System<'_>, model: &ModelDescription, port: Port, end: &End) -> Option<Unit> {
    if let Some(unit) = model.unit_of(Item::Scalar(port.variable)) {
        return Some(unit.clone());
    }
    let unit = system.connector_units.get(&(end.component, end.connector.as_str()))?;
    Some(unit_of_file(system.description, unit))
}

fn transform(
    system: &System<'_>,
    c: &description::Connection,
    (a, from): (&ModelDescription, Port),
    (b, to): (&ModelDescription, Port),
    faults: &mut Faults,
) -> Option<Transform> {
    let (source, target) = (&a.variables[from.variable], &b.variables[to.variable]);
    let dotted = |end: &End| format!("{}.{}", system.name(end.component), end.connector);
    let mismatch = |from_type: String, to_type: String, faults: &mut Faults| {
        let kind = FaultKind::TypeMismatch { from: dotted(&c.from), from_type, to: dotted(&c.to), to_type };
        faults.add(&c.place, Label(system, c).to_string(), kind);
        None
    };
    let types = (source.kind, target.kind);
    match (types, &c.transformation) {
        ((Kind::Real | Kind::Integer, Kind::Real), None | Some(Transformation::Linear(_))) => {
            let mut map = Linear::IDENTITY;
            if source.kind == Kind::Real && !c.suppress_unit_conversion {
                // The usual case, one unit for both, needs no copies.
                let same = || -> Option<bool> {
                    let (x, y) = (a.unit_of(Item::Scalar(from.variable))?, b.unit_of(Item::Scalar(to.variable))?);
                    Some(x == y)
                };
                if same() != Some(true) {
                    map = conversion(system, c, (a, from), (b, to), faults)?;
                }
            }
            if let Some(Transformation::Linear(linear)) = &c.transformation {
                map = map.then(*linear);
            }
            let plain = map == Linear::IDENTITY && source.kind == Kind::Real;
            Some(if plain { Transform::Copy } else { Transform::Linear(map) })
        }
        ((Kind::Boolean, Kind::Boolean | Kind::Integer), Some(Transformation::Booleans(table))) => {
            Some(Transform::Table(table.clone()))
        }
        ((Kind::Integer, Kind::Integer), Some(Transformation::Integers(table))) => {
            Some(Transform::Table(table.clone()))
        }
        ((Kind::Enumeration, Kind::Enumeration), Some(Transformation::Items(table))) => {
            items_table(system, c, (a, from), (b, to), table, faults)
        }
        ((Kind::Enumeration, Kind::Enumeration), None) => {
            let items = |model: &ModelDescription, port: Port| {
                model.type_of(&model.variables[port.variable]).map(|t| t.items.clone()).unwrap_or_default()
            };
            let (x, y) = (items(a, from), items(b, to));
            if x == y {
                return Some(Transform::Copy);
            }
            let shown = |items: Vec<(String, i32)>| {
                let names: Vec<String> = items.iter().take(12).map(|(name, value)| format!("{name}={value}")).collect();
                format!("Enumeration {{{}}}", names.join(", "))
            };
            mismatch(shown(x), shown(y), faults)
        }
        ((Kind::Boolean | Kind::Enumeration, Kind::Integer), None) => Some(Transform::Copy),
        ((x, y), None) if x == y => Some(Transform::Copy),
        ((x, y), None) => mismatch(x.to_string(), y.to_string(), faults),
        ((x, y), Some(t)) => {
            let what = match t {
                Transformation::Linear(_) => "LinearTransformation",
                Transformation::Booleans(_) => "BooleanMappingTransformation",
                Transformation::Integers(_) => "IntegerMappingTransformation",
                Transformation::Items(_) => "EnumerationMappingTransformation",
            };
            mismatch(format!("{x} (through a {what})"), y.to_string(), faults)
        }
    }
}

fn conversion(
    system: &System<'_>,
    c: &description::Connection,
    (a, from): (&ModelDescription, Port),
    (b, to): (&ModelDescription, Port),
    faults: &mut Faults,
) -> Option<Linear> {
    let (x, y) = (unit_of(system, a, from, &c.from), unit_of(system, b, to, &c.to));
    match relate(x.as_ref(), y.as_ref()) {
        Relation::Same => Some(Linear::IDENTITY),
        Relation::Convert(map) => Some(map),
        relation => {
            let shown = |unit: &Option<Unit>| unit.as_ref().map(ToString::to_string).unwrap_or_default();
            let dotted = |end: &End| format!("{}.{}", system.name(end.component), end.connector);
            if relation == Relation::Unknown {
                let text =
                    format!("units {} and {} cannot be compared; values cross as they are", shown(&x), shown(&y));
                faults.note(&c.place, Label(system, c).to_string(), text);
                return Some(Linear::IDENTITY);
            }
            let kind = FaultKind::UnitMismatch {
                from: dotted(&c.from),
                from_unit: shown(&x),
                to: dotted(&c.to),
                to_unit: shown(&y),
            };
            faults.add(&c.place, Label(system, c).to_string(), kind);
            None
        }
    }
}

fn items_table(
    system: &System<'_>,
    c: &description::Connection,
    (a, from): (&ModelDescription, Port),
    (b, to): (&ModelDescription, Port),
    table: &[(String, String)],
    faults: &mut Faults,
) -> Option<Transform> {
    let mut number = |model: &ModelDescription, port: Port, name: &str| {
        let definition = model.type_of(&model.variables[port.variable]);
        let items = definition.map(|t| t.items.as_slice()).unwrap_or_default();
        let found = items.iter().find(|(item, _)| item == name).map(|(_, value)| *value);
        if found.is_none() {
            let kind = FaultKind::UnknownItem {
                enumeration: definition.map(|t| t.name.clone()).unwrap_or_default(),
                given: name.to_owned(),
                allowed: items.iter().take(30).map(|(item, _)| item.as_str()).collect::<Vec<_>>().join(", "),
            };
            faults.add(&c.place, Label(system, c).to_string(), kind);
        }
        found
    };
    let mut numbers = Vec::with_capacity(table.len());
    for (x, y) in table {
        let (x, y) = (number(a, from, x), number(b, to, y));
        numbers.push((x?, y?));
    }
    Some(Transform::Table(numbers))
}

/// Sets the orders of extrapolation; a rule that fits no connection is a fault.
pub fn extrapolate(system: &System<'_>, connections: &mut [Connection], faults: &mut Faults) {
    let rules = &system.description.extras.extrapolations;
    if rules.len() > MOST_RULES {
        let kind =
            FaultKind::TooMuch { what: "Extrapolation rules", given: rules.len() as u64, allowed: MOST_RULES as u64 };
        faults.add(&rules[MOST_RULES].place, "Extrapolation", kind);
        return;
    }
    for rule in rules {
        let mut hits = 0;
        for c in connections.iter_mut() {
            let Some(model) = system.model(c.to.component) else { continue };
            let name = &model.variables[c.to.variable].name;
            if system.name(c.to.component) == rule.to.element && matches(&rule.to.connector, name) {
                hits += 1;
                if c.to.kind == Kind::Real && c.when == When::Always {
                    c.extrapolation = rule.order;
                }
            }
        }
        // Where connections were lost to other faults, a rule without a hit says nothing.
        if hits == 0 && connections.len() == system.description.connections.len() {
            let kind = FaultKind::BadValue {
                what: "connector".into(),
                given: rule.to.to_string(),
                allowed: "an input that a connection leads to (* stands for any text)".into(),
            };
            faults.add(&rule.place, "Extrapolation", kind);
        }
    }
}
