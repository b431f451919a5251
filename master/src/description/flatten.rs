//! Nested systems to a flat one.
//!
//! Every connector is a point: of a component, or of a system seen from both sides. A connection leads from a source point to
//! a sink point, by the kinds of its connectors (SSP 1.0: the words "start" and "end" say nothing about direction). A
//! component's input is then followed backwards through system connectors to the component output that feeds it.

use std::collections::HashMap;

use super::raw::{self, Child};
use super::{Component, Connection, ConnectorKind, Description, End, Transformation};
use crate::fault::{FaultKind, Faults, Place};
use crate::suggest::close;

/// With more faults than this, names are no longer compared for suggestions: it costs time and nobody reads that far.
pub(crate) const SUGGEST_UP_TO: usize = 30;

/// System connectors on the way of one connection, and dots in a name. Nesting is limited by the XML reader to less; only a
/// loop or a file made to cost time has more.
pub(super) const MOST_HOPS: usize = 256;

/// A system or component in the tree.
pub(super) struct Scope<'r> {
    /// Dotted name; empty for the root.
    path: String,
    /// `None` for a system or dictionary.
    pub(super) component: Option<usize>,
    /// Whether it is a signal dictionary, whose entries take and give.
    dictionary: bool,
    pub(super) children: HashMap<&'r str, usize>,
    pub(super) connectors: HashMap<&'r str, ConnectorKind>,
}

pub(super) type Point<'r> = (usize, &'r str);

/// A connection between two points, directed.
pub(super) struct Feed<'r> {
    pub(super) from: Point<'r>,
    pub(super) to: Point<'r>,
    pub(super) written: &'r raw::Connection,
}

pub(super) struct Flattener<'r, 'f> {
    pub(super) scopes: Vec<Scope<'r>>,
    pub(super) feeds: Vec<Feed<'r>>,
    pub(super) components: Vec<Component>,
    /// Scopes of the signal dictionaries: one each, whoever refers to it.
    dictionaries: HashMap<&'r str, usize>,
    /// Component names so far, with their lines.
    names: HashMap<String, u32>,
    /// Values bound so far.
    pub(super) assigned: usize,
    pub(super) faults: &'f mut Faults,
}

/// Flattens a system into a description (components, connections, values, extras).
pub fn flatten(root: &raw::System, description: &mut Description, faults: &mut Faults) {
    let mut f = Flattener {
        scopes: Vec::new(),
        feeds: Vec::new(),
        components: Vec::new(),
        dictionaries: HashMap::new(),
        names: HashMap::new(),
        assigned: 0,
        faults,
    };
    let scope = f.enter(root, String::new(), description);
    f.connect(root, scope);
    let incoming = f.incoming();
    let connections = f.follow(&incoming);
    f.bind(root, scope);
    description.components = f.components;
    description.connections = connections;
}

impl<'r> Flattener<'r, '_> {
    fn enter(&mut self, system: &'r raw::System, path: String, description: &mut Description) -> usize {
        let scope = self.scopes.len();
        let connectors = system.connectors.iter().map(|c| (c.name.as_str(), c.kind)).collect();
        let children = HashMap::new();
        self.scopes.push(Scope { path: path.clone(), component: None, dictionary: false, children, connectors });
        let dotted = if path.is_empty() { path } else { format!("{path}.") };
        description.extras.append(system.extras.clone(), &dotted);
        for child in &system.elements {
            let (name, place) = match child {
                Child::Component(c) => (c.name.as_str(), &c.place),
                Child::System(s) => (s.name.as_str(), &s.place),
                Child::Dictionary { name, place, .. } => (name.as_str(), place),
            };
            let full = format!("{dotted}{name}");
            if let Some(&first) = self.names.get(&full) {
                let kind = FaultKind::Duplicate { what: "element", name: full, first };
                self.faults.add(place, format!("System \"{}\"", system.name), kind);
                continue;
            }
            if name.is_empty() {
                let kind = FaultKind::MissingAttribute { name: "name" };
                self.faults.add(place, "element", kind);
                continue;
            }
            self.names.insert(full.clone(), place.line);
            let index = match child {
                Child::System(s) => self.enter(s, full, description),
                Child::Component(c) => self.component(c, full),
                Child::Dictionary { dictionary, .. } => self.dictionary(dictionary),
            };
            self.scopes[scope].children.insert(name, index);
        }
        scope
    }

    fn dictionary(&mut self, name: &'r str) -> usize {
        let next = self.scopes.len();
        let scope = *self.dictionaries.entry(name).or_insert(next);
        if scope == next {
            let path = format!("signal dictionary {name}");
            let (children, connectors) = (HashMap::new(), HashMap::new());
            self.scopes.push(Scope { path, component: None, dictionary: true, children, connectors });
        }
        scope
    }

    fn component(&mut self, c: &'r raw::Component, name: String) -> usize {
        let mut connectors = HashMap::new();
        for connector in &c.connectors {
            if connectors.insert(connector.name.as_str(), connector.kind).is_some() {
                let first = c.connectors.iter().find(|o| o.name == connector.name).map_or(0, |o| o.place.line);
                let kind = FaultKind::Duplicate { what: "connector", name: connector.name.clone(), first };
                self.faults.add(&connector.place, format!("Component \"{name}\""), kind);
            }
        }
        let component = Some(self.components.len());
        let children = HashMap::new();
        self.scopes.push(Scope { path: name.clone(), component, dictionary: false, children, connectors });
        self.components.push(Component {
            name,
            source: c.source.clone(),
            connectors: c.connectors.clone(),
            values: Vec::new(),
            step_hint: c.step_hint,
            extras: c.extras.clone(),
            place: c.place.clone(),
        });
        self.scopes.len() - 1
    }

    /// Directs and collects the connections of a system and of those inside it.
    fn connect(&mut self, system: &'r raw::System, scope: usize) {
        for c in &system.connections {
            let start = self.point(scope, &c.start, &c.place);
            let end = self.point(scope, &c.end, &c.place);
            let (Some((a, a_is_source)), Some((b, b_is_source))) = (start, end) else { continue };
            let forwards = match (a_is_source, b_is_source) {
                (Some(true), Some(false)) | (None, None) => true,
                (Some(false), Some(true)) => false,
                // A kind that is not told follows from the other end.
                (Some(source), None) => source,
                (None, Some(source)) => !source,
                (Some(both), Some(_)) => {
                    let both = if both { "sources" } else { "targets" };
                    let kind = FaultKind::SameDirection { first: self.name(a), second: self.name(b), both };
                    self.faults.add(&c.place, "Connection", kind);
                    continue;
                }
            };
            let (from, to) = if forwards { (a, b) } else { (b, a) };
            self.feeds.push(Feed { from, to, written: c });
        }
        for child in &system.elements {
            if let Child::System(s) = child
                && let Some(&inner) = self.scopes[scope].children.get(s.name.as_str())
            {
                self.connect(s, inner);
            }
        }
    }

    /// The point that one end of a connection names, and whether data comes out of it there.
    fn point(
        &mut self,
        scope: usize,
        (element, connector): &'r (Option<String>, String),
        place: &Place,
    ) -> Option<(Point<'r>, Option<bool>)> {
        let at = match element {
            None => scope,
            Some(element) => match self.scopes[scope].children.get(element.as_str()) {
                Some(&child) => child,
                None => {
                    let names = self.scopes[scope].children.keys().copied();
                    let close = if self.faults.len() < SUGGEST_UP_TO { close(element, names) } else { Vec::new() };
                    let kind = FaultKind::UnknownComponent { given: element.clone(), close };
                    self.faults.add(place, "Connection", kind);
                    return None;
                }
            },
        };
        let target = &self.scopes[at];
        let kind = target.connectors.get(connector.as_str()).copied();
        if target.dictionary {
            return Some(((at, connector.as_str()), None));
        }
        if kind.is_none() && target.component.is_none() {
            let close = close(connector, target.connectors.keys().copied());
            let element = if target.path.is_empty() { "the system".to_owned() } else { target.path.clone() };
            let kind = FaultKind::UnknownConnector { element, given: connector.clone(), close };
            self.faults.add(place, "Connection", kind);
            return None;
        }
        if kind.is_none() {
            let text = format!(
                "connector \"{connector}\" of \"{}\" is not declared: other tools will not accept that",
                target.path
            );
            self.faults.note(place, "Connection", text);
        }
        let out = match kind {
            Some(ConnectorKind::Output | ConnectorKind::CalculatedParameter) => Some(true),
            Some(ConnectorKind::Input | ConnectorKind::Parameter) => Some(false),
            Some(ConnectorKind::Inout) | None => None,
        };
        // Seen from inside, a system's input is a source.
        let out = if element.is_none() { out.map(|out| !out) } else { out };
        Some(((at, connector.as_str()), out))
    }

    fn name(&self, (scope, connector): Point<'_>) -> String {
        let path = &self.scopes[scope].path;
        if path.is_empty() { connector.to_owned() } else { format!("{path}.{connector}") }
    }

    /// Sink -> index of the feed that leads there; a second one is a fault.
    fn incoming(&mut self) -> HashMap<Point<'r>, usize> {
        let mut incoming: HashMap<Point<'r>, usize> = HashMap::with_capacity(self.feeds.len());
        for (index, feed) in self.feeds.iter().enumerate() {
            if let Some(&first) = incoming.get(&feed.to) {
                let first = &self.feeds[first];
                let kind = FaultKind::DoubledInput {
                    target: self.name(feed.to),
                    first: self.name(first.from),
                    first_line: first.written.place.line,
                    second: self.name(feed.from),
                };
                self.faults.add(&feed.written.place, "Connection", kind);
            } else {
                incoming.insert(feed.to, index);
            }
        }
        incoming
    }

    /// Connections from component to component.
    fn follow(&mut self, incoming: &HashMap<Point<'r>, usize>) -> Vec<Connection> {
        let mut connections = Vec::with_capacity(self.feeds.len());
        for (index, feed) in self.feeds.iter().enumerate() {
            let (scope, connector) = feed.to;
            let Some(component) = self.scopes[scope].component else { continue };
            if incoming.get(&feed.to) != Some(&index) {
                continue; // the second of two feeds, told already
            }
            let to = End { component, connector: connector.to_owned() };
            let mut transformation = feed.written.transformation.clone();
            let mut suppress = feed.written.suppress_unit_conversion;
            let mut at = feed.from;
            let mut hops = 0;
            let source = loop {
                if let Some(component) = self.scopes[at.0].component {
                    break Some(End { component, connector: at.1.to_owned() });
                }
                let Some(&before) = incoming.get(&at) else {
                    let text = format!(
                        "nothing feeds system connector \"{}\": {} keeps its start value",
                        self.name(at),
                        self.name(feed.to)
                    );
                    self.faults.note(&feed.written.place, "Connection", text);
                    break None;
                };
                let before = &self.feeds[before];
                suppress |= before.written.suppress_unit_conversion;
                transformation = match chained(&before.written.transformation, transformation.take()) {
                    Ok(transformation) => transformation,
                    Err(what) => {
                        let instead = "use one mapping transformation on the way from component to component";
                        self.faults.add(&feed.written.place, "Connection", FaultKind::Unsupported { what, instead });
                        break None;
                    }
                };
                at = before.from;
                hops += 1;
                if hops > MOST_HOPS {
                    let path = vec![self.name(feed.from), self.name(feed.to)];
                    self.faults.add(&feed.written.place, "Connection", FaultKind::Loop { path });
                    break None;
                }
            };
            if let Some(from) = source {
                let place = feed.written.place.clone();
                connections.push(Connection { from, to, transformation, suppress_unit_conversion: suppress, place });
            }
        }
        connections
    }
}

/// One transformation after the other, where that is one again.
fn chained(first: &Option<Transformation>, then: Option<Transformation>) -> Result<Option<Transformation>, String> {
    match (first, then) {
        (None, then) => Ok(then),
        (Some(first), None) => Ok(Some(first.clone())),
        (Some(Transformation::Linear(a)), Some(Transformation::Linear(b))) => {
            Ok(Some(Transformation::Linear(a.then(b))))
        }
        _ => Err("a chain of mapping transformations through system connectors".to_owned()),
    }
}
