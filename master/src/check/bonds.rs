//! Power bonds: those that a description declares, and those that our own units have by their names.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::plan::{ArrayConnection, BondPair, Connection, ContactPair, Port, PowerBond, When};
use super::recording::scalar_of;
use super::system::System;
use crate::fault::{FaultKind, Faults};
use crate::model_description::Item;

/// All bonds, the declared ones first.
pub fn bonds(
    system: &System<'_>,
    connections: &[Connection],
    arrays: &[ArrayConnection],
    faults: &mut Faults,
) -> Vec<PowerBond> {
    let mut bonds = declared(system, connections, faults);
    let taken: HashSet<usize> = bonds.iter().flat_map(|b| &b.pairs).map(|p| p.effort).collect();
    bonds.extend(wheels(system, connections, &taken));
    bonds.extend(contacts(system, arrays));
    bonds
}

/// What a quantity is multiplied with to a power, by the names our units give.
const PARTNERS: [(&str, &str); 2] = [("force.", "velocity."), ("moment.", "angular_velocity.")];

/// Whether a component is one of our units.
fn is_ours(system: &System<'_>, component: usize) -> bool {
    system.model(component).is_some_and(|m| m.is_ours)
}

/// Wheels of our units: `Qforce.x` of one is fed by another, which is fed by its `Qvelocity.x`; moments likewise. Forces of our units are means over their
/// last step.
fn wheels(system: &System<'_>, connections: &[Connection], taken: &HashSet<usize>) -> Vec<PowerBond> {
    let name = |port: Port| system.model(port.component).map_or("", |m| &*m.variables[port.variable].name);
    let mut back: HashMap<(usize, usize, &str), usize> = HashMap::new();
    for (index, c) in connections.iter().enumerate().filter(|(_, c)| c.when == When::Always) {
        back.entry((c.from.component, c.to.component, name(c.from))).or_insert(index);
    }
    let mut found: BTreeMap<(usize, String, usize), Vec<BondPair>> = BTreeMap::new();
    for (effort, c) in connections.iter().enumerate() {
        let (a, b) = (c.from.component, c.to.component);
        if taken.contains(&effort) || c.when != When::Always || !is_ours(system, a) || !is_ours(system, b) {
            continue;
        }
        let target = name(c.to);
        for (force, velocity) in PARTNERS {
            // The last of the name's parts that fits: `Q`, then `force.`, then the axis.
            let Some((wheel, axis)) = target.rsplit_once(force).filter(|(q, _)| q.is_empty() || q.ends_with('.'))
            else {
                continue;
            };
            let partner = format!("{wheel}{velocity}{axis}");
            if let Some(&flow) = back.get(&(b, a, partner.as_str())) {
                let wheel = wheel.trim_end_matches('.').to_owned();
                found.entry((b, wheel, a)).or_default().push(BondPair { effort, flow });
            }
        }
    }
    let bond = |((component, wheel, _), pairs): ((usize, String, usize), Vec<BondPair>)| {
        let dot = if wheel.is_empty() { "" } else { "." };
        let name = format!("{}{dot}{wheel}", system.name(component));
        PowerBond { name, pairs, contacts: Vec::new(), means: true }
    };
    found.into_iter().map(bond).collect()
}

/// Contacts of our units: a terrain's `body[k].contact.force` with its `.index` against the velocities of the mesh that it is given as `body[k].velocity`.
fn contacts(system: &System<'_>, arrays: &[ArrayConnection]) -> Vec<PowerBond> {
    let name = |component: usize, array: usize| system.model(component).map_or("", |m| &*m.arrays[array].name);
    let mut bonds = Vec::new();
    for (effort, c) in arrays.iter().enumerate() {
        let (terrain, tire) = (c.from.component, c.to.component);
        let Some(body) = name(terrain, c.from.array).strip_suffix(".contact.force") else { continue };
        if !is_ours(system, terrain) || !is_ours(system, tire) {
            continue;
        }
        let with = |from: usize, to: usize, fits: &dyn Fn(&ArrayConnection) -> bool| {
            arrays.iter().position(|c| c.from.component == from && c.to.component == to && fits(c))
        };
        let index = with(terrain, tire, &|c| name(terrain, c.from.array) == format!("{body}.contact.index"));
        let flow =
            with(tire, terrain, &|c| c.when == When::Always && name(terrain, c.to.array) == format!("{body}.velocity"));
        if let (Some(index), Some(flow)) = (index, flow) {
            let name = format!("{}.{body}", system.name(terrain));
            let contacts = vec![ContactPair { effort, index, flow }];
            bonds.push(PowerBond { name, pairs: Vec::new(), contacts, means: true });
        }
    }
    bonds
}

/// Power bonds: each pair to two connections in opposite directions whose product is a power.
fn declared(system: &System<'_>, connections: &[Connection], faults: &mut Faults) -> Vec<PowerBond> {
    let mut by_source: HashMap<(usize, usize), Vec<usize>> = HashMap::new();
    for (index, c) in connections.iter().enumerate() {
        by_source.entry((c.from.component, c.from.variable)).or_default().push(index);
    }
    let mut bonds = Vec::new();
    for bond in &system.description.extras.bonds {
        let element = format!("PowerBond \"{}\"", bond.name);
        let mut pairs = Vec::new();
        for (effort, flow) in &bond.pairs {
            let e = scalar_of(system, effort, &bond.place, &element, faults);
            let f = scalar_of(system, flow, &bond.place, &element, faults);
            let (Some(e), Some(f)) = (e, f) else { continue };
            let none = Vec::new();
            let from = |port: Port| by_source.get(&(port.component, port.variable)).unwrap_or(&none);
            let found = from(e).iter().find_map(|&effort| {
                let to = connections[effort].to.component;
                let back = |&&flow: &&usize| connections[flow].to.component == e.component && f.component == to;
                from(f).iter().find(back).map(|&flow| BondPair { effort, flow })
            });
            match found {
                Some(pair) => {
                    if is_power(system, e, f) == Some(false) {
                        let unit = |port: Port| {
                            let unit = system.model(port.component)?.unit_of(Item::Scalar(port.variable))?;
                            Some(unit.to_string())
                        };
                        let kind = FaultKind::BadValue {
                            what: "Pair".into(),
                            given: format!(
                                "{effort} [{}] x {flow} [{}]",
                                unit(e).unwrap_or_default(),
                                unit(f).unwrap_or_default()
                            ),
                            allowed: "two quantities whose product is a power, such as N and m/s".into(),
                        };
                        faults.add(&bond.place, &element, kind);
                    }
                    pairs.push(pair);
                }
                // Where connections were lost to other faults, that says nothing.
                None if connections.len() < system.description.connections.len() => {}
                None => {
                    let kind = FaultKind::BadValue {
                        what: "Pair".into(),
                        given: format!("{effort} and {flow}"),
                        allowed:
                            "two outputs that connections carry in opposite directions between the same two components"
                                .into(),
                    };
                    faults.add(&bond.place, &element, kind);
                }
            }
        }
        bonds.push(PowerBond { name: bond.name.clone(), pairs, contacts: Vec::new(), means: bond.means });
    }
    bonds
}

/// Whether the product of two variables is a power; `None` where a unit is not known. The radian does not count here:
/// a torque is written in N.m.
fn is_power(system: &System<'_>, a: Port, b: Port) -> Option<bool> {
    let dimension = |port: Port| {
        let unit = system.model(port.component)?.unit_of(Item::Scalar(port.variable))?;
        Some(unit.base.as_ref()?.dimension.0)
    };
    let (a, b) = (dimension(a)?, dimension(b)?);
    let power = [1, 2, -3, 0, 0, 0, 0];
    Some((0..7).all(|i| a[i] + b[i] == power[i]))
}
