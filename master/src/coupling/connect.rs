//! Connections resolved to buffers: what is read of each unit, and where each value goes.

use super::extrapolate::Track;
use crate::check::plan::{Plan, Transform};
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
    /// Index into the plan's connections.
    connection: usize,
    /// Index into [`Links::tracks`], where the value is extrapolated.
    track: Option<usize>,
    /// Orders of derivatives that its receiver takes: it then interpolates itself.
    derivatives: u8,
}

/// A track with the output it follows.
#[derive(Clone, Debug)]
struct Followed {
    source: usize,
    slot: Slot,
    track: Track,
}

/// A connection whose value is asked for outside [`Links::carry`].
#[derive(Clone, Copy, Debug)]
pub struct Held {
    source: usize,
    /// Where its source lies in the outputs.
    pub slot: Slot,
    track: Option<usize>,
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
    /// Where all scalars are Reals that are copied: where they come from, and their references.
    plain: Plain,
    references: Vec<u32>,
}

/// Reals that are copied as they are, in the order of their targets.
#[derive(Clone, Debug, Default)]
enum Plain {
    /// There are none, or others too.
    #[default]
    None,
    /// All from one unit, one after the other from this place in its outputs: they need not even be gathered.
    Whole { source: usize, at: usize },
    /// In a few runs: source, place, length.
    Runs(Vec<(usize, usize, usize)>),
    /// One by one: source and place.
    Single(Vec<(u32, u32)>),
}

impl Plain {
    /// From source and place of each.
    fn of(places: Vec<(u32, u32)>) -> Self {
        let mut runs: Vec<(usize, usize, usize)> = Vec::new();
        for &(source, at) in &places {
            match runs.last_mut() {
                Some((s, a, length)) if *s == source as usize && *a + *length == at as usize => *length += 1,
                _ => runs.push((source as usize, at as usize, 1)),
            }
        }
        match runs.as_slice() {
            [] => Self::None,
            &[(source, at, _)] => Self::Whole { source, at },
            // Below some four values a copied run costs more than as many loads.
            _ if runs.len() * 4 <= places.len() => Self::Runs(runs),
            _ => Self::Single(places),
        }
    }
}

/// A set of connections that are served together.
#[derive(Debug, Default)]
pub struct Links {
    /// What is read of each unit.
    pub outputs: Vec<Outputs>,
    incoming: Vec<Incoming>,
    tracks: Vec<Followed>,
}

/// When values are carried: for which step (base steps), and whether all sources have been read since the last time.
#[derive(Clone, Copy, Debug)]
pub struct For {
    /// From base step, to base step.
    pub span: (u64, u64),
    /// Whether no source has to be asked if it is fresh.
    pub all_fresh: bool,
}

/// A set that was refused, and the variables it was about.
pub struct Refused {
    /// The call.
    pub error: CallError,
    /// Names of the variables.
    pub about: String,
}

impl Links {
    /// Resolves these connections of the plan, by index and in their order. Values are held, unless `extrapolate`.
    pub fn new(
        plan: &Plan,
        scalars: impl Iterator<Item = usize>,
        arrays: impl Iterator<Item = usize>,
        extrapolate: bool,
    ) -> Self {
        let count = plan.components.len();
        let mut links = Self { incoming: vec![Incoming::default(); count], ..Self::default() };
        links.outputs.resize_with(count, Outputs::default);
        for connection in scalars {
            let c = &plan.connections[connection];
            let class = Class::from(c.from.kind);
            let slot = links.outputs[c.from.component].scalar(class, c.from.value_reference, c.from.variable);
            let track = (extrapolate && c.extrapolation > 0).then(|| {
                let track = Track::new(c.extrapolation);
                links.tracks.push(Followed { source: c.from.component, slot, track });
                links.tracks.len() - 1
            });
            let interpolates = plan.model(c.to.component).co_simulation.can_interpolate_inputs;
            links.incoming[c.to.component].scalars.push(Route {
                connection,
                track,
                derivatives: if interpolates && Class::from(c.to.kind) == Class::Real { c.extrapolation } else { 0 },
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
        for array in arrays {
            let c = &plan.arrays[array];
            let slot = links.outputs[c.from.component].array(c.kind, c.from.value_reference, c.from.array);
            links.incoming[c.to.component].arrays.push(ArrayRoute {
                source: c.from.component,
                slot,
                reference: c.to.value_reference,
                array: c.to.array,
            });
        }
        for incoming in &mut links.incoming {
            let plain = |r: &Route| match (r.slot, r.track, &r.carry) {
                (Slot::Scalar(Class::Real, at), None, Carry::Copy) => Some((r.source as u32, at as u32)),
                _ => None,
            };
            if let Some(plain) = incoming.scalars.iter().map(plain).collect() {
                incoming.plain = Plain::of(plain);
                incoming.references = incoming.scalars.iter().map(|r| r.reference).collect();
            }
        }
        links
    }

    /// The outputs of a unit have been read at a base step: continues the tracks that follow them.
    #[inline]
    pub fn note(&mut self, unit: usize, tick: u64) {
        if self.tracks.is_empty() {
            return;
        }
        for f in self.tracks.iter_mut().filter(|f| f.source == unit) {
            f.track.note(tick, self.outputs[unit].number(f.slot));
        }
    }

    /// Whether anything is extrapolated.
    #[inline]
    pub fn has_tracks(&self) -> bool {
        !self.tracks.is_empty()
    }

    /// Where the value of a connection is found; `None` if it is not among these.
    pub fn held(&self, connection: usize) -> Option<Held> {
        let route = self.incoming.iter().flat_map(|i| &i.scalars).find(|r| r.connection == connection)?;
        Some(Held { source: route.source, slot: route.slot, track: route.track })
    }

    /// Where the source of an array connection of the plan lies; `None` if it is not among these.
    pub fn array_slot(&self, plan: &Plan, connection: usize) -> Option<Slot> {
        let c = &plan.arrays[connection];
        let mut routes = self.incoming[c.to.component].arrays.iter();
        routes.find(|r| r.array == c.to.array && r.source == c.from.component).map(|r| r.slot)
    }

    /// What a connection would give now for a step over `span` (base steps), in the unit of its source.
    pub fn value_of(&self, held: Held, span: (u64, u64)) -> f64 {
        match held.track {
            Some(track) => self.tracks[track].track.mean(span.0, span.1),
            None => self.outputs[held.source].number(held.slot),
        }
    }

    /// The values of all Real inputs as the outputs stand now, in the unit of their targets; the order never changes.
    pub fn real_inputs(&self) -> Vec<f64> {
        self.incoming
            .iter()
            .flat_map(|i| &i.scalars)
            .filter(|r| r.class == Class::Real)
            .map(|r| r.number(self))
            .collect()
    }

    /// Indices of the connections behind [`Links::real_inputs`].
    pub fn real_connections(&self) -> impl Iterator<Item = usize> {
        self.incoming.iter().flat_map(|i| &i.scalars).filter(|r| r.class == Class::Real).map(|r| r.connection)
    }

    /// Adds the Real inputs of `target` from a list as [`Links::real_inputs`] makes it.
    pub fn put_reals(&self, target: usize, values: &[f64], sets: &mut Sets) {
        let mut at = 0;
        for (unit, incoming) in self.incoming.iter().enumerate() {
            for route in incoming.scalars.iter().filter(|r| r.class == Class::Real) {
                if unit == target {
                    sets.real(route.reference, values[at]);
                }
                at += 1;
            }
        }
    }

    /// The tracks with the unit whose output each follows.
    pub fn tracks_of(&mut self) -> impl Iterator<Item = (usize, &mut Track)> {
        self.tracks.iter_mut().map(|f| (f.source, &mut f.track))
    }

    /// What each unit needs of others: target, source, and where the value lies in the outputs of the source.
    pub fn needs(&self) -> impl Iterator<Item = (usize, usize, Slot)> + '_ {
        self.incoming.iter().enumerate().flat_map(|(target, incoming)| {
            let scalars = incoming.scalars.iter().map(move |r| (target, r.source, r.slot));
            scalars.chain(incoming.arrays.iter().map(move |r| (target, r.source, r.slot)))
        })
    }

    /// The tracks, for a checkpoint.
    pub fn tracks(&mut self) -> impl Iterator<Item = &mut Track> {
        self.tracks.iter_mut().map(|f| &mut f.track)
    }

    /// Sets what `target` receives for its step from the units that are `fresh` (read since the last time).
    /// A value that is not fresh is not set again: a receiver that moves a position on by its velocity would be thrown back.
    /// An extrapolated value is set anew for every step.
    pub fn carry(
        &self,
        plan: &Plan,
        target: usize,
        instance: &mut Instance,
        sets: &mut Sets,
        step: For,
        fresh: impl Fn(usize) -> bool,
    ) -> Result<(), Box<Refused>> {
        let incoming = &self.incoming[target];
        let span = step.span;
        if step.all_fresh && !matches!(incoming.plain, Plain::None) {
            let values = self.gather(incoming, &mut sets.reals.1);
            if let Err(error) = instance.set_reals(&incoming.references, values) {
                let model = plan.model(target);
                let about = list(incoming.scalars.iter().map(|r| &*model.variables[r.variable].name));
                return Err(Box::new(Refused { about, error: *error }));
            }
            return self.carry_arrays(plan, target, instance, fresh);
        }
        if incoming.scalars.is_empty() {
            return self.carry_arrays(plan, target, instance, fresh);
        }
        sets.clear();
        for route in &incoming.scalars {
            match route.track {
                Some(track) if route.derivatives > 0 && instance.takes_derivatives() => {
                    let values = self.tracks[track].track.at(span.0, plan.clock.length(1));
                    route.put_number(values[0], sets);
                    for order in 1..=route.derivatives {
                        sets.derivative(route.reference, order.into(), route.slope() * values[usize::from(order)]);
                    }
                }
                Some(track) => route.put_number(self.tracks[track].track.mean(span.0, span.1), sets),
                None if fresh(route.source) => route.put(&self.outputs[route.source], sets),
                None => {}
            }
        }
        let model = plan.model(target);
        instance.set(sets).map_err(|error| {
            let set = |r: &&Route| (r.track.is_some() || fresh(r.source)) && call_of(r.class) == error.call;
            let names = incoming.scalars.iter().filter(set).map(|r| &*model.variables[r.variable].name);
            Box::new(Refused { about: list(names), error })
        })?;
        self.carry_arrays(plan, target, instance, fresh)
    }

    /// Whether what a unit receives are Reals that are copied, and nothing else; or whether it receives nothing.
    #[inline]
    pub fn is_plain(&self, target: usize) -> bool {
        let incoming = &self.incoming[target];
        incoming.arrays.is_empty() && incoming.scalars.len() == incoming.references.len()
    }

    /// Sets what a unit receives for which [`Links::is_plain`] holds.
    #[inline]
    pub fn carry_plain(
        &self,
        target: usize,
        instance: &mut Instance,
        buffer: &mut Vec<f64>,
    ) -> Result<(), Box<CallError>> {
        let incoming = &self.incoming[target];
        instance.set_reals(&incoming.references, self.gather(incoming, buffer))
    }

    /// Names of the variables that a unit receives.
    pub fn received(&self, plan: &Plan, target: usize) -> String {
        let model = plan.model(target);
        list(self.incoming[target].scalars.iter().map(|r| &*model.variables[r.variable].name))
    }

    /// The values of plain Reals, in the order of their references; in `buffer` unless they lie together already.
    #[inline]
    fn gather<'v>(&'v self, incoming: &Incoming, buffer: &'v mut Vec<f64>) -> &'v [f64] {
        let count = incoming.references.len();
        match &incoming.plain {
            Plain::None => return &[],
            Plain::Whole { source, at } => return &self.outputs[*source].reals.values[*at..*at + count],
            Plain::Runs(runs) => {
                buffer.clear();
                for &(source, at, length) in runs {
                    buffer.extend_from_slice(&self.outputs[source].reals.values[at..at + length]);
                }
            }
            Plain::Single(places) => {
                buffer.resize(count, 0.0);
                for (value, &(source, at)) in buffer.iter_mut().zip(places) {
                    *value = self.outputs[source as usize].reals.values[at as usize];
                }
            }
        }
        buffer
    }

    fn carry_arrays(
        &self,
        plan: &Plan,
        target: usize,
        instance: &mut Instance,
        fresh: impl Fn(usize) -> bool,
    ) -> Result<(), Box<Refused>> {
        if self.incoming[target].arrays.is_empty() {
            return Ok(());
        }
        let model = plan.model(target);
        for route in self.incoming[target].arrays.iter().filter(|r| fresh(r.source)) {
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
    /// The value now, in the unit of the target.
    fn number(&self, links: &Links) -> f64 {
        let number = links.outputs[self.source].number(self.slot);
        if let Carry::Linear(l) = &self.carry { l.apply(number) } else { number }
    }

    /// What derivatives are multiplied by on the way.
    fn slope(&self) -> f64 {
        if let Carry::Linear(l) = &self.carry { l.factor } else { 1.0 }
    }

    /// A number in the unit of the source, to a Real.
    fn put_number(&self, number: f64, sets: &mut Sets) {
        let number = if let Carry::Linear(l) = &self.carry { l.apply(number) } else { number };
        sets.real(self.reference, number);
    }

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
