//! The energy that explicit coupling creates or loses, per power bond.
//!
//! Over a communication step each side computes with its own picture of the bond: the receiver of the effort with the effort
//! it holds, F', and its own flow v; the receiver of the flow with the flow it holds, v', and its own effort F. The coupling
//! creates the energy
//!
//! ```text
//! R = integral of F' v dt - integral of F v' dt
//! ```
//!
//! which the exact coupling makes zero (S. Sadjina, L. T. Kyllingstad, S. Skjong, E. Pedersen, "Energy conservation and power
//! bonds in co-simulations: non-iterative adaptive step size control and error estimation", Engineering with Computers 33
//! (2017), equations 8 to 12). Both integrals are taken by the trapezoidal rule; outputs that jump when their unit takes new inputs
//! are read again after those are set, since half of what is created sits in that jump. An effort that is the sender's mean over its last step
//! (as the forces of our units are) is its own integral.

use super::connect::{Held, Links};
use super::contact::Contact;
use super::pool::Member;
use crate::check::plan::{Plan, Port, Transform};
use crate::loading::{CallError, Class, Outputs, Slot};
use crate::model_description::Item;

/// One end's output and what is held of it on the other side.
#[derive(Clone, Debug)]
struct Side {
    unit: usize,
    /// Where it lies in the links' outputs and in what is read again.
    slot: Slot,
    again: Slot,
    /// The unit that holds it.
    receiver: usize,
    connection: usize,
    route: Held,
    held: f64,
    begin: f64,
}

#[derive(Clone, Debug)]
struct Pair {
    effort: Side,
    flow: Side,
    /// Product of both units in W.
    watts: f64,
    /// Powers of the step just done, in these units: held effort by own flow, held flow by own effort.
    terms: [f64; 2],
}

/// One bond with its sums.
#[derive(Clone, Debug)]
struct Bond {
    name: String,
    means: bool,
    pairs: Vec<Pair>,
    contacts: Vec<Contact>,
    sums: Energy,
}

/// What a bond has carried.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Energy the coupling has created; negative: lost (J).
    pub residual: f64,
    /// Energy that has passed, both directions counted as positive (J).
    pub passed: f64,
}

/// All bonds of a system.
#[derive(Clone, Debug, Default)]
pub struct Bonds {
    bonds: Vec<Bond>,
    /// Per unit, the outputs that are read again after its inputs are set.
    again: Vec<Outputs>,
    /// Whether a step is under way: what was noted at its beginning is there.
    open: bool,
}

impl Bonds {
    /// Resolves the bonds of a plan to what `links` carries.
    pub fn new(plan: &Plan, links: &Links) -> Self {
        let mut again: Vec<Outputs> = Vec::new();
        again.resize_with(plan.components.len(), Outputs::default);
        let mut bonds = Vec::new();
        for bond in &plan.bonds {
            let mut pairs = Vec::new();
            for pair in &bond.pairs {
                let mut side = |connection: usize| -> Option<Side> {
                    let c = &plan.connections[connection];
                    let route = links.held(connection)?;
                    let again = again[c.from.component].scalar(Class::Real, c.from.value_reference, c.from.variable);
                    let (unit, receiver) = (c.from.component, c.to.component);
                    Some(Side { unit, slot: route.slot, again, receiver, connection, route, held: 0.0, begin: 0.0 })
                };
                // A connection that is served at the start only carries no power.
                if let (Some(effort), Some(flow)) = (side(pair.effort), side(pair.flow)) {
                    let scale = |port: Port| {
                        let unit = plan.model(port.component).unit_of(Item::Scalar(port.variable));
                        unit.and_then(|u| u.base.as_ref()).map_or(1.0, |b| b.factor)
                    };
                    let watts = scale(plan.connections[pair.effort].from) * scale(plan.connections[pair.flow].from);
                    pairs.push(Pair { effort, flow, watts, terms: [0.0; 2] });
                }
            }
            let contacts = bond.contacts.iter().filter_map(|c| Contact::new(plan, links, *c)).collect();
            bonds.push(Bond { name: bond.name.clone(), means: bond.means, pairs, contacts, sums: Energy::default() });
        }
        Self { bonds, again, open: false }
    }

    /// A step that was begun does not count.
    pub fn forget(&mut self) {
        self.open = false;
        self.bonds.iter_mut().flat_map(|b| &mut b.contacts).for_each(Contact::forget);
    }

    /// Whether there is nothing to do.
    pub fn is_empty(&self) -> bool {
        self.bonds.is_empty()
    }

    /// Names and sums so far.
    pub fn energies(&self) -> impl Iterator<Item = (&str, Energy)> {
        self.bonds.iter().map(|b| (b.name.as_str(), b.sums))
    }

    /// The sums, for a checkpoint.
    pub fn sums(&mut self) -> impl Iterator<Item = &mut Energy> {
        self.bonds.iter_mut().map(|b| &mut b.sums)
    }

    /// A unit has been given its inputs and is about to step from base step `span.0` to `span.1`: notes what it holds, and its own
    /// outputs at the beginning of the step.
    pub fn begin(
        &mut self,
        unit: usize,
        member: &mut Member,
        links: &Links,
        span: (u64, u64),
    ) -> Result<(), CallError> {
        if self.bonds.is_empty() {
            return Ok(());
        }
        self.open = true;
        if !self.again[unit].is_empty() {
            member.instance.read(&mut self.again[unit])?;
        }
        for pair in self.bonds.iter_mut().flat_map(|b| &mut b.pairs) {
            for side in [&mut pair.effort, &mut pair.flow] {
                if side.receiver == unit {
                    side.held = links.value_of(side.route, span);
                }
                if side.unit == unit {
                    side.begin = self.again[unit].number(side.again);
                }
            }
        }
        for contact in self.bonds.iter_mut().flat_map(|b| &mut b.contacts) {
            contact.begin(unit, &links.outputs);
        }
        Ok(())
    }

    /// What was held over the step just done, by connection, in the unit of its target.
    pub fn hold(&mut self, plan: &Plan, held: &[(usize, f64)]) {
        for side in self.bonds.iter_mut().flat_map(|b| &mut b.pairs).flat_map(|p| [&mut p.effort, &mut p.flow]) {
            if let Some((c, value)) = held.iter().find(|(c, _)| *c == side.connection) {
                side.held = match &plan.connections[*c].transform {
                    Transform::Linear(l) => l.inverse(*value),
                    _ => *value,
                };
            }
        }
    }

    /// Whether a step has begun that [`Bonds::end`] is to add up.
    #[inline]
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// All outputs at the end of a step of this length (s) have been read: adds the step up.
    pub fn end(&mut self, links: &Links, length: f64) {
        self.terms(links, |_| true);
        self.add(length);
    }

    /// The powers of the step just done as each side computes them, of units that are here: what the receiver of an effort computes, and what the receiver of a flow does (W).
    pub fn terms(&mut self, links: &Links, is_here: impl Fn(usize) -> bool) {
        for bond in &mut self.bonds {
            for p in &mut bond.pairs {
                let end = |side: &Side| links.outputs[side.unit].number(side.slot);
                if is_here(p.effort.receiver) {
                    p.terms[0] = p.effort.held * (0.5 * (p.flow.begin + end(&p.flow)));
                }
                if is_here(p.flow.receiver) {
                    let effort = if bond.means { end(&p.effort) } else { 0.5 * (p.effort.begin + end(&p.effort)) };
                    p.terms[1] = p.flow.held * effort;
                }
            }
            bond.contacts.iter_mut().for_each(|c| c.end(&links.outputs, &is_here));
        }
    }

    /// The terms with the unit that computes each; the order never changes.
    fn all_terms(&mut self) -> impl Iterator<Item = (usize, &mut f64)> {
        self.bonds.iter_mut().flat_map(|bond| {
            let pairs = bond.pairs.iter_mut().flat_map(|p| {
                let [effort, flow] = &mut p.terms;
                [(p.effort.receiver, effort), (p.flow.receiver, flow)]
            });
            pairs.chain(bond.contacts.iter_mut().flat_map(Contact::terms))
        })
    }

    /// Gives the terms of some units.
    pub fn pack_terms(&mut self, of: impl Fn(usize) -> bool, mut to: impl FnMut(f64)) {
        self.all_terms().filter(|(unit, _)| of(*unit)).for_each(|(_, term)| to(*term));
    }

    /// Takes the terms of some units.
    pub fn take_terms(&mut self, of: impl Fn(usize) -> bool, mut from: impl FnMut() -> f64) {
        self.all_terms().filter(|(unit, _)| of(*unit)).for_each(|(_, term)| *term = from());
    }

    /// Adds up a step of this length (s) from all terms.
    pub fn add(&mut self, length: f64) {
        if !std::mem::take(&mut self.open) {
            return;
        }
        for bond in &mut self.bonds {
            let mut power = 0.0;
            for p in &bond.pairs {
                let [given, taken] = p.terms;
                bond.sums.residual += length * p.watts * (given - taken);
                power += p.watts * given;
            }
            for contact in &mut bond.contacts {
                let (made, passed) = contact.made_and_passed();
                bond.sums.residual += length * made;
                power += passed;
            }
            bond.sums.passed += length * power.abs();
        }
    }

    /// A step has begun, here or on another rank.
    pub fn open(&mut self) {
        self.open = !self.bonds.is_empty();
    }
}
