//! The coupled units and the parts of a communication step; what the units do in it: `stepping.rs`.

mod stepping;

use std::sync::Arc;
use std::time::Instant;

use super::bonds::{Bonds, Energy};
use super::connect::{For, Links, list};
use super::job::Job;
use super::pieces::Pieces;
use super::pool::{Answer, Finished, Member, Pool, Task};
use super::watch::{Schedule, Watch, WatchId};
use super::{Failure, Moment};
use crate::check::plan::Plan;
use crate::decimal::{Clock, Ticker};
use crate::description::algorithm::Scheme;
use crate::loading::{CallError, Class, Instance, NotFinite, Outputs, Sets, Stepped};

/// Wall time of a run so far, by purpose.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clockwork {
    /// Initialisation (s).
    pub initialise: f64,
    /// From the first communication point to the last (s).
    pub run: f64,
    /// Reading outputs for others, carrying and setting them (s).
    pub coupling: f64,
    /// Reading values for observers (s).
    pub watching: f64,
    /// Waiting for other ranks (s).
    pub waiting: f64,
}

/// The instances of a plan and what passes between them.
pub struct System {
    pub(super) plan: Arc<Plan>,
    /// `None` while a worker has it, and where it is on another rank.
    pub(super) members: Vec<Option<Box<Member>>>,
    /// The other ranks, if there are any.
    pub(super) job: Option<Box<Job>>,
    /// Steps of the units on other ranks and the time inside them (s), and what broke off there: known at the end.
    pub(super) elsewhere: Vec<(u64, f64)>,
    pub(super) early_elsewhere: Vec<(String, u64)>,
    pub(super) threads: Vec<u32>,
    pub(super) pool: Pool,
    pub(super) links: Links,
    /// The exchange in stages, where direct feed-through is resolved.
    stages: Vec<Links>,
    pub(super) bonds: Bonds,
    pub(super) watches: Vec<Watch>,
    pub(super) pieces: Pieces,
    pub(super) sets: Sets,
    finished: Vec<Finished>,
    due: Vec<usize>,
    pub(super) clockwork: Clockwork,
    /// A unit that ended the run, and the time it had reached (s).
    pub(super) ended: Option<(usize, f64)>,
    /// Whether the next read serves every watch, due or not: after a restored state nothing has been read yet.
    pub(super) read_all: bool,
    /// Whether all units have the base step.
    uniform: bool,
    /// Length of each unit's step (s).
    sizes: Vec<f64>,
    /// Base steps between communication points: 1 unless the algorithm varies it.
    pub(super) stride: u64,
    ticker: Option<Ticker>,
    /// Whether exchanging values takes so little that looking at the clock would cost a good part of it.
    short: bool,
    /// The unit whose step the caller does while the others are handed over; looked at again every few steps.
    split: Option<usize>,
}

/// Of short exchanges one in so many is timed; as often the sharing of units is looked at again.
const SAMPLE: u64 = 256;
/// An exchange below this (s) is short.
const SHORT: f64 = 5e-6;

impl System {
    pub(super) fn new(
        plan: Arc<Plan>,
        members: Vec<Option<Box<Member>>>,
        threads: Vec<u32>,
        pool: Pool,
        job: Option<Box<Job>>,
    ) -> Self {
        use crate::check::plan::When;
        let always = |c: &usize| plan.connections[*c].when == When::Always;
        let always_array = |a: &usize| plan.arrays[*a].when == When::Always;
        let links = Links::new(
            &plan,
            (0..plan.connections.len()).filter(always),
            (0..plan.arrays.len()).filter(always_array),
            true,
        );
        let mut stages = Vec::new();
        // An iteration that leaves feed-through unresolved would compare values of different times.
        if plan.algorithm.resolve_feed_through || plan.algorithm.scheme == Scheme::Iterated {
            for stage in &plan.initialisation {
                let scalars = stage.connections.iter().copied().filter(always);
                stages.push(Links::new(&plan, scalars, stage.arrays.iter().copied().filter(always_array), false));
            }
        }
        let bonds = Bonds::new(&plan, &links);
        let uniform = plan.components.iter().all(|c| c.multiple == 1);
        let sizes = plan.components.iter().map(|c| plan.clock.length(c.multiple)).collect();
        let ticker = plan.clock.ticker();
        Self {
            uniform,
            sizes,
            stride: 1,
            ticker,
            short: false,
            split: None,
            job,
            elsewhere: vec![(0, 0.0); members.len()],
            early_elsewhere: Vec::new(),
            plan,
            members,
            threads,
            pool,
            links,
            stages,
            bonds,
            watches: Vec::new(),
            pieces: Pieces::default(),
            sets: Sets::default(),
            finished: Vec::new(),
            due: Vec::new(),
            clockwork: Clockwork::default(),
            ended: None,
            read_all: false,
        }
    }

    /// The plan.
    pub fn plan(&self) -> &Arc<Plan> {
        &self.plan
    }

    /// The clock.
    pub fn clock(&self) -> Clock {
        self.plan.clock
    }

    /// Threads of each unit.
    pub fn threads(&self) -> &[u32] {
        &self.threads
    }

    /// Where the wall time went.
    pub fn clockwork(&self) -> Clockwork {
        self.clockwork
    }

    /// Notes the wall time from the first communication point to the last.
    pub fn ran_for(&mut self, time: std::time::Duration) {
        self.clockwork.run = time.as_secs_f64();
    }

    /// Number of steps of a unit, and the wall time inside them (s).
    pub fn effort(&self, unit: usize) -> (u64, f64) {
        self.members[unit].as_ref().map_or(self.elsewhere[unit], |m| (m.calls, m.seconds))
    }

    /// How often units broke a step off and went on: those that did.
    pub fn early_returns(&self) -> impl Iterator<Item = (&str, u64)> {
        let members = self.members.iter().flatten();
        let here = members.map(|m| (m.instance.name(), m.instance.early_returns()));
        let elsewhere = self.early_elsewhere.iter().map(|(name, count)| (name.as_str(), *count));
        here.filter(|(_, count)| *count > 0).chain(elsewhere)
    }

    /// The unit that ended the run by itself, and the time it had reached (s).
    pub fn ended(&self) -> Option<(usize, f64)> {
        self.ended
    }

    /// Whether a unit communicates at this base step.
    pub fn is_due(&self, unit: usize, tick: u64) -> bool {
        self.uniform || tick.is_multiple_of(self.plan.components[unit].multiple)
    }

    /// The time of a base step (s).
    pub(super) fn time(&self, tick: u64) -> f64 {
        match &self.ticker {
            Some(ticker) => ticker.time(tick),
            None => self.plan.clock.time(tick),
        }
    }

    /// A unit that has ended the run goes on after all.
    pub(super) fn forget_end(&mut self) {
        self.ended = None;
    }

    /// From now on another base step (s), from another start.
    pub(super) fn set_clock(&mut self, clock: Clock) {
        let mut plan = (*self.plan).clone();
        plan.clock = clock;
        self.sizes = plan.components.iter().map(|c| clock.length(c.multiple)).collect();
        self.ticker = clock.ticker();
        self.plan = Arc::new(plan);
    }

    /// From now on so many base steps between communication points.
    pub(super) fn set_stride(&mut self, stride: u64) {
        if stride != self.stride {
            self.stride = stride;
            let clock = self.plan.clock;
            self.sizes = self.plan.components.iter().map(|c| clock.length(c.multiple * stride)).collect();
        }
    }

    /// Base steps to the next instant that an observer waits for, at most to the end of the run.
    pub(super) fn until_pause(&self, tick: u64) -> u64 {
        let end = self.plan.clock.steps.saturating_sub(tick);
        let schedules = self.watches.iter().flat_map(|w| &w.schedules);
        schedules.filter_map(|s| s.next_fixed(tick)).map(|next| next - tick).fold(end, u64::min)
    }

    /// Whether the exchange at this base step is timed.
    fn is_timed(&self, tick: u64) -> bool {
        !self.short || tick.is_multiple_of(SAMPLE)
    }

    /// The time since then (s), for all exchanges that it stands for.
    fn took(&self, begin: Instant) -> f64 {
        begin.elapsed().as_secs_f64() * if self.short { SAMPLE as f64 } else { 1.0 }
    }

    /// Asks for variables of a unit to be read on a schedule; `fill` adds them. Call it before the first `read`.
    pub fn watch(&mut self, unit: usize, schedules: Vec<Schedule>, fill: impl FnOnce(&mut Outputs)) -> WatchId {
        let mut outputs = Outputs::default();
        fill(&mut outputs);
        self.watches.push(Watch { member: unit, schedules, outputs });
        WatchId(self.watches.len() - 1)
    }

    /// What was read last for an observer.
    pub fn watched(&self, id: WatchId) -> &Outputs {
        &self.watches[id.0].outputs
    }

    /// Reads the outputs of all units that communicate now, for the others and for observers.
    ///
    /// # Errors
    /// A call that fails; a value that is not finite.
    pub fn read(&mut self, tick: u64) -> Result<(), Failure> {
        if let Some(job) = self.job.take() {
            return self.read_on_ranks(job, tick);
        }
        let timed = self.is_timed(tick).then(Instant::now);
        self.read_outputs(tick)?;
        self.note_all(tick);
        if self.bonds.is_open() {
            self.bonds.end(&self.links, self.plan.clock.length(self.stride));
        }
        if let Some(begin) = timed {
            self.clockwork.coupling += self.took(begin);
        }
        if self.watches.is_empty() {
            return Ok(());
        }
        let watched = timed.map(|_| Instant::now());
        let all = std::mem::take(&mut self.read_all);
        self.read_watches(tick, all, |_| true)?;
        if let Some(begin) = watched {
            self.clockwork.watching += self.took(begin);
        }
        Ok(())
    }

    /// Reads for the other units.
    pub(super) fn read_outputs(&mut self, tick: u64) -> Result<(), Failure> {
        let time = self.time(tick);
        let (uniform, plan) = (self.uniform, &self.plan);
        for (unit, (member, outputs)) in self.members.iter_mut().zip(&mut self.links.outputs).enumerate() {
            if outputs.is_plain() && (uniform || tick.is_multiple_of(plan.components[unit].multiple)) {
                let Some(member) = member.as_deref_mut() else { continue };
                // What nearly every unit of a large system is: a few Reals, by one call.
                if let Err(e) = member.instance.read_reals(&mut outputs.reals) {
                    let about = about(plan, unit, outputs, e.call);
                    return Err(Failure::unit(*e, Moment::At(time), about));
                }
                if !outputs.reals.is_finite() {
                    finite(plan, unit, outputs, time)?;
                }
            } else if !outputs.is_empty() && (uniform || tick.is_multiple_of(plan.components[unit].multiple)) {
                read(plan, unit, member.as_deref_mut(), outputs, time)?;
            }
        }
        Ok(())
    }

    /// Reads for the observers of some units.
    pub(super) fn read_watches(
        &mut self,
        tick: u64,
        all: bool,
        is_asked: impl Fn(usize) -> bool,
    ) -> Result<(), Failure> {
        let time = self.time(tick);
        for index in 0..self.watches.len() {
            let watch = &self.watches[index];
            if is_asked(watch.member) && self.is_watch_due(watch, tick, all) {
                let watch = &mut self.watches[index];
                let member = self.members[watch.member].as_deref_mut();
                read(&self.plan, watch.member, member, &mut watch.outputs, time)?;
            }
        }
        Ok(())
    }

    /// Whether an observer wants to see values at this base step.
    pub(super) fn is_watch_due(&self, watch: &Watch, tick: u64, all: bool) -> bool {
        let multiple = self.plan.components[watch.member].multiple;
        let communicates = self.uniform || tick.is_multiple_of(multiple);
        all || communicates && watch.schedules.iter().any(|s| s.is_due_within(tick, multiple))
    }

    /// The outputs of all units that communicate now have been read.
    #[inline]
    pub(super) fn note_all(&mut self, tick: u64) {
        if self.links.has_tracks() {
            for unit in 0..self.members.len() {
                if self.is_due(unit, tick) {
                    self.links.note(unit, tick);
                }
            }
        }
    }

    /// Sets the inputs of all units that communicate now from what was read.
    ///
    /// # Errors
    /// A call that fails.
    pub fn carry(&mut self, tick: u64) -> Result<(), Failure> {
        let timed = self.is_timed(tick).then(Instant::now);
        for unit in 0..self.members.len() {
            if self.is_due(unit, tick) {
                self.carry_to(unit, tick)?;
            }
        }
        // With the inputs set, outputs that depend on them are read again and handed on, in the order of the initial exchange.
        self.resolve(tick)?;
        if !self.stages.is_empty() {
            let time = self.time(tick);
            for unit in 0..self.members.len() {
                if self.is_due(unit, tick) {
                    let outputs = &mut self.links.outputs[unit];
                    read(&self.plan, unit, self.members[unit].as_deref_mut(), outputs, time)?;
                    self.links.note(unit, tick);
                }
            }
            for unit in 0..self.members.len() {
                if self.is_due(unit, tick) {
                    self.carry_to(unit, tick)?;
                }
            }
        }
        if !self.bonds.is_empty() {
            for unit in 0..self.members.len() {
                if self.is_due(unit, tick) {
                    self.begin_bonds(unit, tick)?;
                }
            }
            if self.job.is_some() && (0..self.members.len()).any(|unit| self.is_due(unit, tick)) {
                self.bonds.open();
            }
        }
        if let Some(begin) = timed {
            let took = begin.elapsed().as_secs_f64();
            self.clockwork.coupling += self.took(begin);
            self.short = took < SHORT * self.members.len() as f64;
        }
        Ok(())
    }

    /// [`System::carry`] and [`System::step`] in one pass, unit by unit: no unit sees what another has been given, so it is the same. `false`, and nothing
    /// is done, where something comes between the two, or where their times are taken.
    ///
    /// # Errors
    /// Those of both.
    pub(super) fn carry_and_step(&mut self, tick: u64) -> Result<bool, Failure> {
        let between =
            self.job.is_some() || !self.stages.is_empty() || !self.bonds.is_empty() || !self.plan.drives.is_empty();
        if between || !self.uniform || self.pool.helpers() > 0 || self.is_timed(tick) {
            return Ok(false);
        }
        let time = self.time(tick);
        let step = For { span: (tick, tick + self.stride), all_fresh: true };
        for (unit, (member, size)) in self.members.iter_mut().zip(&self.sizes).enumerate() {
            let Some(member) = member.as_deref_mut() else { continue };
            if self.links.is_plain(unit) {
                if let Err(e) = self.links.carry_plain(unit, &mut member.instance, &mut self.sets.reals.1) {
                    return Err(Failure::unit(*e, Moment::At(time), self.links.received(&self.plan, unit)));
                }
            } else {
                self.links
                    .carry(&self.plan, unit, &mut member.instance, &mut self.sets, step, |_| true)
                    .map_err(|r| Failure::unit(r.error, Moment::At(time), r.about))?;
            }
            let stepped = match member.quick_step(time, *size) {
                Some(Ok(())) => continue,
                Some(Err(code)) => member.instance.after(code, time, *size),
                None => member.step(time, *size),
            };
            match stepped {
                Ok(Stepped::Done) => {}
                Ok(Stepped::Ended(time)) => {
                    self.ended.get_or_insert((unit, time));
                }
                Err(error) => return Err(Failure::unit(error, Moment::At(time), "")),
            }
        }
        Ok(true)
    }

    /// Sets the inputs of one unit from what was read last.
    pub(super) fn carry_to(&mut self, unit: usize, tick: u64) -> Result<(), Failure> {
        let (plan, uniform, ticker) = (&self.plan, self.uniform, self.ticker);
        // Asked for only where something fails: a division for every unit and step.
        let time = || ticker.map_or_else(|| plan.clock.time(tick), |t| t.time(tick));
        let due = |unit: usize| uniform || tick.is_multiple_of(plan.components[unit].multiple);
        let Some(member) = self.members[unit].as_deref_mut() else { return Ok(()) };
        let span = (tick, tick + plan.components[unit].multiple * self.stride);
        self.links
            .carry(plan, unit, &mut member.instance, &mut self.sets, For { span, all_fresh: uniform }, due)
            .map_err(|r| Failure::unit(r.error, Moment::At(time()), r.about))?;
        if plan.drives.is_empty() {
            return Ok(());
        }
        drive(plan, unit, &mut member.instance, &mut self.sets, time())
            .map_err(|e| Failure::unit(e, Moment::At(time()), "inputs over time"))
    }

    /// Notes for the power bonds what a unit holds now.
    pub(super) fn begin_bonds(&mut self, unit: usize, tick: u64) -> Result<(), Failure> {
        if self.bonds.is_empty() {
            return Ok(());
        }
        let span = (tick, tick + self.plan.components[unit].multiple * self.stride);
        let Some(member) = self.members[unit].as_deref_mut() else { return Ok(()) };
        self.bonds
            .begin(unit, member, &self.links, span)
            .map_err(|e| Failure::unit(e, Moment::At(self.plan.clock.time(tick)), "outputs of a power bond"))
    }

    /// The exchange in stages, if the plan asks for it.
    pub(super) fn resolve(&mut self, tick: u64) -> Result<(), Failure> {
        let mut stages = std::mem::take(&mut self.stages);
        let result = stages.iter_mut().try_for_each(|stage| self.exchange(stage, tick));
        self.stages = stages;
        result
    }

    /// One stage of an exchange between communication points: its sources are read, then its targets set.
    fn exchange(&mut self, stage: &mut Links, tick: u64) -> Result<(), Failure> {
        let plan = Arc::clone(&self.plan);
        let time = plan.clock.time(tick);
        let due = |unit: usize| tick.is_multiple_of(plan.components[unit].multiple);
        for unit in 0..self.members.len() {
            if due(unit) && !stage.outputs[unit].is_empty() {
                read(&plan, unit, self.members[unit].as_deref_mut(), &mut stage.outputs[unit], time)?;
            }
        }
        for unit in 0..self.members.len() {
            if let (true, Some(member)) = (due(unit), self.members[unit].as_deref_mut()) {
                stage
                    .carry(
                        &plan,
                        unit,
                        &mut member.instance,
                        &mut self.sets,
                        For { span: (0, 0), all_fresh: self.uniform },
                        due,
                    )
                    .map_err(|r| Failure::unit(r.error, Moment::At(time), r.about))?;
            }
        }
        Ok(())
    }

    /// One unit's step, on the caller's thread, and its outputs at the end of it.
    pub(super) fn step_one(&mut self, unit: usize, tick: u64) -> Result<(), Failure> {
        let multiple = self.plan.components[unit].multiple;
        let (time, size) = self.span(unit, tick);
        let Some(member) = self.members[unit].as_deref_mut() else { return Ok(()) };
        match member.work(Task::Step(time, size)) {
            Ok(Answer::Stepped(Stepped::Ended(time))) => {
                self.ended.get_or_insert((unit, time));
                return Ok(());
            }
            Ok(_) => {}
            Err(e) => return Err(Failure::unit(e, Moment::At(time), "")),
        }
        if !self.links.outputs[unit].is_empty() {
            let end = self.plan.clock.time(tick + multiple);
            read(&self.plan, unit, self.members[unit].as_deref_mut(), &mut self.links.outputs[unit], end)?;
            self.links.note(unit, tick + multiple);
        }
        Ok(())
    }

    /// Whether a unit's step at this base step ends within the run: a slow unit's last one that would not is left out.
    pub(super) fn fits(&self, unit: usize, tick: u64) -> bool {
        tick + self.plan.components[unit].multiple * self.stride <= self.plan.clock.steps
    }

    /// The energy residual of each power bond so far.
    pub fn energies(&self) -> impl Iterator<Item = (&str, Energy)> {
        self.bonds.energies()
    }

    /// `fmi2Terminate` for all units that still run here. Gives what went wrong; nothing hangs on it any more.
    pub fn terminate(&mut self) -> Vec<CallError> {
        self.members.iter_mut().flatten().filter_map(|m| m.instance.terminate().err()).collect()
    }
}

/// Sets the inputs of a unit that follow a table.
pub(super) fn drive(
    plan: &Plan,
    unit: usize,
    instance: &mut Instance,
    sets: &mut Sets,
    time: f64,
) -> Result<(), CallError> {
    sets.clear();
    for drive in plan.drives.iter().filter(|d| d.port.component == unit) {
        let (reference, value) = (drive.port.value_reference, drive.at(time));
        match Class::from(drive.port.kind) {
            Class::Real => sets.real(reference, value),
            Class::Boolean => sets.boolean(reference, value != 0.0),
            Class::Integer => sets.integer(reference, value as i32),
            Class::String => {}
        }
    }
    instance.set(sets)
}

/// Reads values of a unit and checks that they are finite.
#[inline]
pub(super) fn read(
    plan: &Plan,
    unit: usize,
    member: Option<&mut Member>,
    outputs: &mut Outputs,
    time: f64,
) -> Result<(), Failure> {
    let Some(member) = member else { return Ok(()) };
    member.instance.read(outputs).map_err(|error| {
        let about = about(plan, unit, outputs, error.call);
        Failure::unit(error, Moment::At(time), about)
    })?;
    finite(plan, unit, outputs, time)
}

/// The gate where values leave a unit.
#[inline]
pub(super) fn finite(plan: &Plan, unit: usize, outputs: &Outputs, time: f64) -> Result<(), Failure> {
    let Some((what, value)) = outputs.not_finite() else { return Ok(()) };
    let model = plan.model(unit);
    let name = &plan.components[unit].name;
    let variable = match what {
        NotFinite::Variable(variable) => format!("{name}.{}", model.variables[variable].name),
        NotFinite::Element(array, element) => format!("{name}.{}, element {element}", model.arrays[array].name),
    };
    Err(Failure::NotFinite { unit: name.clone(), variable, value, time })
}

/// Names of the variables that a failed call was about.
pub(super) fn about(plan: &Plan, unit: usize, outputs: &Outputs, call: &str) -> String {
    let model = plan.model(unit);
    let scalars = |variables: &[usize]| list(variables.iter().map(|&v| &*model.variables[v].name));
    match call {
        "fmi2GetReal" => scalars(&outputs.reals.variables),
        "fmi2GetInteger" => scalars(&outputs.integers.variables),
        "fmi2GetBoolean" => scalars(&outputs.booleans.variables),
        "fmi2GetString" => scalars(&outputs.strings.variables),
        "terramech_getRealArray" => list(outputs.real_arrays.iter().map(|a| &*model.arrays[a.array].name)),
        "terramech_getIntegerArray" => list(outputs.integer_arrays.iter().map(|a| &*model.arrays[a.array].name)),
        _ => String::new(),
    }
}
