//! Connections resolved to buffers: what is read of each unit, and where each value goes.

use crate::check::plan::{ArrayConnection, Connection, Plan, Transform};
use crate::loading::{CallError, Class, Instance, Outputs, Sets, Slot};
use crate::unit::Linear;

/// A scalar on its way.
#[derive(Clone, Debug)]
struct Route {
    source: usize,
    slot: Slot,
    class: Class,
    reference: u32,
    variable: usize,
    carry: Carry,
}

/// What happens to it.
#[derive(Clone, Debug)]
enum Carry {
    Copy,
    Linear(Linear),
    Table(Vec<(i32, i32)>),
}

/// An array on its way.
#[derive(Clone, Copy, Debug)]
struct ArrayRoute {
    source: usize,
    slot: Slot,
    reference: u32,
    array: usize,
}

/// What one unit receives.
#[derive(Clone, Debug, Default)]
struct Incoming {
    scalars: Vec<Route>,
    arrays: Vec<ArrayRoute>,
}

/// A set of connections that are served together.
#[derive(Debug, Default)]
pub struct Links {
    /// What is read of each unit.
    pub outputs: Vec<Outputs>,
    incoming: Vec<Incoming>,
}

/// A set that was refused, and the variables it was about.
pub struct Refused {
    /// The call.
    pub error: CallError,
    /// Names of the variables.
    pub about: String,
}

impl Links {
    /// Resolves these connections of the plan, in their order.
    pub fn new<'p>(
        plan: &'p Plan,
        scalars: impl Iterator<Item = &'p Connection>,
        arrays: impl Iterator<Item = &'p ArrayConnection>,
    ) -> Self {
        let count = plan.components.len();
        let mut links = Self { outputs: Vec::new(), incoming: vec![Incoming::default(); count] };
        links.outputs.resize_with(count, Outputs::default);
        for c in scalars {
            let class = Class::from(c.from.kind);
            let slot = links.outputs[c.from.component].scalar(class, c.from.value_reference, c.from.variable);
            links.incoming[c.to.component].scalars.push(Route {
                source: c.from.component,
                slot,
                class: Class::from(c.to.kind),
                reference: c.to.value_reference,
                variable: c.to.variable,
                carry: match &c.transform {
                    Transform::Linear(linear) => Carry::Linear(*linear),
                    Transform::Table(table) => Carry::Table(table.clone()),
                    // Integer to Real and such: through a number.
                    Transform::Copy if class != Class::from(c.to.kind) => Carry::Linear(Linear::IDENTITY),
                    Transform::Copy => Carry::Copy,
                },
            });
        }
        for c in arrays {
            let slot = links.outputs[c.from.component].array(c.kind, c.from.value_reference, c.from.array);
            links.incoming[c.to.component].arrays.push(ArrayRoute {
                source: c.from.component,
                slot,
                reference: c.to.value_reference,
                array: c.to.array,
            });
        }
        links
    }

    /// Sets what `target` receives from the units that are `fresh` (read since the last time). A value that is not
    /// fresh is not set again: a receiver that moves a position on by its velocity would be thrown back.
    pub fn carry(
        &self,
        plan: &Plan,
        target: usize,
        instance: &mut Instance,
        sets: &mut Sets,
        fresh: impl Fn(usize) -> bool,
    ) -> Result<(), Box<Refused>> {
        let incoming = &self.incoming[target];
        sets.clear();
        for route in incoming.scalars.iter().filter(|r| fresh(r.source)) {
            route.put(&self.outputs[route.source], sets);
        }
        let model = plan.model(target);
        instance.set(sets).map_err(|error| {
            let set = |r: &&Route| fresh(r.source) && call_of(r.class) == error.call;
            let names = incoming.scalars.iter().filter(set).map(|r| &*model.variables[r.variable].name);
            Box::new(Refused { about: list(names), error })
        })?;
        for route in incoming.arrays.iter().filter(|r| fresh(r.source)) {
            let from = &self.outputs[route.source];
            let result = match route.slot {
                Slot::IntegerArray(_) => instance.set_integer_array(route.reference, from.integers_of(route.slot)),
                _ => instance.set_real_array(route.reference, from.reals_of(route.slot)),
            };
            result.map_err(|error| {
                Box::new(Refused { about: list([&*model.arrays[route.array].name].into_iter()), error })
            })?;
        }
        Ok(())
    }

    /// The units that receive something.
    pub fn targets(&self) -> impl Iterator<Item = usize> + '_ {
        let some = |i: &usize| !self.incoming[*i].scalars.is_empty() || !self.incoming[*i].arrays.is_empty();
        (0..self.incoming.len()).filter(some)
    }
}

impl Route {
    #[inline]
    fn put(&self, from: &Outputs, sets: &mut Sets) {
        match (&self.carry, self.slot, self.class) {
            (Carry::Copy, Slot::Scalar(Class::Real, i), _) => sets.real(self.reference, from.reals.values[i]),
            (Carry::Linear(l), slot, Class::Real) => sets.real(self.reference, l.apply(from.number(slot))),
            (Carry::Copy, Slot::Scalar(Class::Integer, i), _) => {
                sets.integer(self.reference, from.integers.values[i]);
            }
            (Carry::Copy, Slot::Scalar(Class::Boolean, i), _) => {
                sets.boolean(self.reference, from.booleans.values[i] != 0);
            }
            (Carry::Copy, Slot::Scalar(Class::String, i), _) => {
                sets.string(self.reference, from.strings.values[i].as_str());
            }
            (Carry::Table(table), slot, class) => {
                let value = from.number(slot) as i32;
                let value = table.iter().find(|(key, _)| *key == value).map_or(value, |(_, to)| *to);
                match class {
                    Class::Boolean => sets.boolean(self.reference, value != 0),
                    Class::Real => sets.real(self.reference, f64::from(value)),
                    _ => sets.integer(self.reference, value),
                }
            }
            // Whole numbers by construction: check lets Integer, Enumeration and Boolean through only.
            (Carry::Linear(l), slot, Class::Boolean) => {
                sets.boolean(self.reference, l.apply(from.number(slot)) != 0.0);
            }
            (Carry::Linear(l), slot, _) => sets.integer(self.reference, l.apply(from.number(slot)) as i32),
            (Carry::Copy, Slot::RealArray(_) | Slot::IntegerArray(_), _) => {}
        }
    }
}

fn call_of(class: Class) -> &'static str {
    match class {
        Class::Real => "fmi2SetReal",
        Class::Integer => "fmi2SetInteger",
        Class::Boolean => "fmi2SetBoolean",
        Class::String => "fmi2SetString",
    }
}

/// The first few names.
pub fn list<'n>(names: impl Iterator<Item = &'n str>) -> String {
    const SHOWN: usize = 4;
    let names: Vec<&str> = names.collect();
    let shown = names[..names.len().min(SHOWN)].join(", ");
    if names.len() > SHOWN { format!("{shown} and {} more", names.len() - SHOWN) } else { shown }
}
