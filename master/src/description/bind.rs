//! Parameter values of all levels to one value per component variable: deeper levels first, so that higher ones win.

use std::collections::{HashMap, HashSet};

use super::flatten::{Flattener, MOST_HOPS, Point};
use super::parameters::Bound;
use super::raw::{self, Child};
use super::{Assignment, Given, Transformation};
use crate::fault::FaultKind;
use crate::unit::Linear;

/// Values bound to variables, replaced ones included.
const MOST_VALUES: usize = 4_000_000;

impl<'r> Flattener<'r, '_> {
    /// Settles the values of all levels: deeper ones first, so that higher ones replace them.
    pub(super) fn bind(&mut self, root: &'r raw::System, scope: usize) {
        let mut outgoing: HashMap<Point<'r>, Vec<usize>> = HashMap::new();
        for (index, feed) in self.feeds.iter().enumerate() {
            outgoing.entry(feed.from).or_default().push(index);
        }
        let mut position: Vec<HashMap<String, usize>> = vec![HashMap::new(); self.components.len()];
        self.bind_system(root, scope, &outgoing, &mut position);
    }

    fn bind_system(
        &mut self,
        system: &'r raw::System,
        scope: usize,
        outgoing: &HashMap<Point<'r>, Vec<usize>>,
        position: &mut [HashMap<String, usize>],
    ) {
        for child in &system.elements {
            match child {
                Child::System(s) => {
                    if let Some(&inner) = self.scopes[scope].children.get(s.name.as_str()) {
                        self.bind_system(s, inner, outgoing, position);
                    }
                }
                Child::Dictionary { .. } => {}
                Child::Component(c) => {
                    let inner = self.scopes[scope].children.get(c.name.as_str());
                    if let Some(component) = inner.and_then(|&inner| self.scopes[inner].component) {
                        for bound in &c.values {
                            self.assign(component, &bound.name, bound.clone(), position);
                        }
                    }
                }
            }
        }
        for bound in &system.values {
            if !self.resolve(scope, &bound.name, bound, outgoing, position) {
                let text = "it names no variable of this system and is ignored";
                self.faults.note(&bound.place, format!("Parameter \"{}\"", bound.name), text);
            }
        }
    }

    /// Finds what a hierarchical name means in a system; `false` if nothing.
    fn resolve(
        &mut self,
        scope: usize,
        name: &str,
        bound: &Bound,
        outgoing: &HashMap<Point<'r>, Vec<usize>>,
        position: &mut [HashMap<String, usize>],
    ) -> bool {
        if let Some(component) = self.scopes[scope].component {
            self.assign(component, name, bound.clone(), position);
            return true;
        }
        if let Some((&connector, _)) = self.scopes[scope].connectors.get_key_value(name) {
            self.spread((scope, connector), bound, outgoing, position);
            return true;
        }
        // "a.b.c" may be element "a" or element "a.b": the longest element name that fits wins.
        let dots: Vec<usize> = name.match_indices('.').map(|(at, _)| at).take(MOST_HOPS).collect();
        for at in dots.into_iter().rev() {
            if let Some(&child) = self.scopes[scope].children.get(&name[..at]) {
                return self.resolve(child, &name[at + 1..], bound, outgoing, position);
            }
        }
        false
    }

    /// Carries a value from a system connector inwards to the component variables it feeds.
    fn spread(
        &mut self,
        start: Point<'r>,
        bound: &Bound,
        outgoing: &HashMap<Point<'r>, Vec<usize>>,
        position: &mut [HashMap<String, usize>],
    ) {
        let mut open = vec![(start, bound.clone())];
        let mut seen = HashSet::from([start]);
        while let Some((point, bound)) = open.pop() {
            for &index in outgoing.get(&point).into_iter().flatten() {
                let feed = &self.feeds[index];
                let (to, written) = (feed.to, feed.written);
                let mut bound = bound.clone();
                bound.suppress_unit_conversion |= written.suppress_unit_conversion;
                match &written.transformation {
                    None => {}
                    Some(Transformation::Linear(next)) => {
                        bound.linear = Some(bound.linear.unwrap_or(Linear::IDENTITY).then(*next));
                    }
                    Some(_) => {
                        let what = "a mapping transformation between a system parameter and a component".to_owned();
                        let instead = "bind the parameter at the component";
                        self.faults.add(&written.place, "Connection", FaultKind::Unsupported { what, instead });
                        continue;
                    }
                }
                match self.scopes[to.0].component {
                    Some(component) => self.assign(component, to.1, bound, position),
                    None if seen.insert(to) => open.push((to, bound)),
                    None => {}
                }
            }
        }
    }

    fn assign(&mut self, component: usize, variable: &str, bound: Bound, position: &mut [HashMap<String, usize>]) {
        self.assigned += 1;
        if self.assigned > MOST_VALUES {
            if self.assigned == MOST_VALUES + 1 {
                let (given, allowed) = (self.assigned as u64, MOST_VALUES as u64);
                self.faults.add(
                    &bound.place,
                    "ParameterBindings",
                    FaultKind::TooMuch { what: "bound values", given, allowed },
                );
            }
            return;
        }
        let assignment = Assignment {
            variable: variable.to_owned(),
            value: bound.value,
            unit: bound.unit,
            linear: bound.linear,
            suppress_unit_conversion: bound.suppress_unit_conversion,
            must_exist: bound.must_exist,
            place: bound.place,
        };
        let values = &mut self.components[component].values;
        match position[component].get(variable) {
            Some(&at) => values[at] = assignment,
            None => {
                position[component].insert(variable.to_owned(), values.len());
                values.push(assignment);
            }
        }
    }
}

impl Given {
    /// The value in words, with its kind.
    pub fn described(&self) -> String {
        match self {
            Self::Real(v) => format!("Real {v:?}"),
            Self::Integer(v) => format!("Integer {v}"),
            Self::Boolean(v) => format!("Boolean {v}"),
            Self::String(v) => format!("String \"{v}\""),
            Self::Item(v) => format!("Enumeration \"{v}\""),
        }
    }
}
