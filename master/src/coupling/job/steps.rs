//! The rounds of a [`Job`] while its units are stepped.

use std::rc::Rc;
use std::time::{Duration, Instant};

use super::bytes::{Packer, Unpacker};
use super::cargo::Cargo;
use super::{Job, Report, Stage, Trouble};
use crate::coupling::watch::{Schedule, Watch};
use crate::coupling::{Advance, Failure, Show, System, UnitState};
use crate::loading::{Class, Outputs};
use crate::model_description::Kind;
use crate::world::{Broken, Message};

/// What a message of a round is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    Values = 0,
    /// Its sender cannot go on.
    Nothing = 1,
    /// The run is over; from rank 0 only.
    Over = 2,
}

/// A watch as it is told to the ranks: unit, schedules, then value reference and index of its scalars by class and of its arrays.
type Told = (usize, Vec<[u64; 3]>, [Vec<(u32, usize)>; 6]);

impl Job {
    /// Rank 0 calls the run off, if it has not yet: the others come to their round, and hear it there.
    pub(super) fn call_off(&mut self) -> Result<(), Failure> {
        if std::mem::replace(&mut self.called_off, true) {
            return Ok(());
        }
        for (_, bytes) in &mut self.out {
            bytes.clear();
            bytes.extend([What::Over as u8, 0]);
        }
        Ok(self.world.borrow_mut().round(&self.out, &mut self.into, Some(&mut *self.notes.borrow_mut()))?)
    }

    fn trouble(&mut self, failure: &Failure, at: (u64, u8), units: &[String]) {
        if self.trouble.is_none() {
            self.trouble = Some(self.trouble_of(failure, at, units));
        }
        self.idle = true;
    }
}

impl System {
    /// The other ranks, if there are any.
    pub fn job(&self) -> Option<&Job> {
        self.job.as_deref()
    }

    fn names(&self) -> Vec<String> {
        self.plan.components.iter().map(|c| c.name.clone()).collect()
    }

    /// All ranks have done their part of what comes before the first step; with one rank, the result itself.
    pub(in crate::coupling) fn agree(&mut self, mine: Result<(), Failure>) -> Result<(), Failure> {
        let names = self.names();
        match &mut self.job {
            None => mine,
            Some(job) => job.agree(&names, mine),
        }
    }

    /// Tells all ranks what rank 0 watches: the last thing before the first [`System::read`]. With one rank there is nothing to tell.
    ///
    /// # Errors
    /// Another rank has failed.
    pub fn share_watches(&mut self) -> Result<(), Failure> {
        self.agree(Ok(()))?;
        let Some(mut job) = self.job.take() else { return Ok(()) };
        let told: Vec<Told> = self.watches.iter().map(tell).collect();
        let told = job.broadcast(serde_json::to_vec(&(told, self.shows())).unwrap_or_default())?;
        if job.rank() != 0 {
            let (told, shows): (Vec<Told>, Vec<Show>) =
                serde_json::from_slice(&told).map_err(|e| Broken(e.to_string()))?;
            self.watches = told.into_iter().map(take).collect();
            self.take_shows(shows);
        }
        job.begin(&self.links);
        self.job = Some(job);
        Ok(())
    }

    /// Rank 0: whether the state at the next [`System::read`] is to be saved. The others send theirs then.
    pub fn will_save(&mut self, will: bool) {
        if let Some(job) = &mut self.job {
            job.save = will;
        }
    }

    /// [`System::read`] on several ranks.
    pub(in crate::coupling) fn read_on_ranks(&mut self, mut job: Box<Job>, tick: u64) -> Result<(), Failure> {
        let result = self.round(&mut job, tick);
        if result.as_ref().is_err_and(|f| matches!(f, Failure::Environment(_))) {
            // There is nobody left to tell.
            job.stage = Stage::Closed;
        }
        self.job = Some(job);
        result
    }

    fn round(&mut self, job: &mut Job, tick: u64) -> Result<(), Failure> {
        let begin = Instant::now();
        let all = std::mem::take(&mut self.read_all);
        let length = self.plan.clock.length(1);
        if !job.idle {
            let read = self.read_outputs(tick);
            self.is_read(job, tick, read);
        }
        let over = job.rank() == 0 && job.idle && self.ended.is_none();
        let asked = job.notes.borrow().relay.is_stop_asked();
        // A spread unit that is led from here talks to its other members when it is read, and then nobody else can.
        let asks_members = job.teams.iter().any(|t| t.2.is_some());
        let mut watching = Duration::ZERO;
        if asks_members {
            watching = self.read_watched(job, tick, all);
        }
        let [mut out, mut late, mut into] = [&mut job.out, &mut job.to_first, &mut job.into].map(std::mem::take);
        self.pack(job, tick, (over, asked), &mut out);
        // Rank 0 has told the others whether to save, the others learn it now.
        let told_to_save = job.save && Self::what(job, over) == What::Values;
        let (world, notes) = (Rc::clone(&job.world), Rc::clone(&job.notes));
        let begun = Instant::now();
        let mut worked = Duration::ZERO;
        let round = world.borrow_mut().round_around(
            (&out, &mut late, &mut |late| {
                let begin = Instant::now();
                if !asks_members {
                    watching = self.read_watched(job, tick, all);
                }
                self.pack(job, tick, (over, asked), late);
                late.iter_mut().for_each(|(_, bytes)| self.pack_watched(job, tick, all, bytes));
                worked = begin.elapsed();
            }),
            &mut into,
            Some(&mut *notes.borrow_mut()),
        );
        let waited = begun.elapsed() - worked;
        (job.out, job.to_first, job.into) = (out, late, into);
        round?;
        let come = self.unpack(job, tick, all)?;
        let first = come.troubles.into_iter().chain(job.trouble.clone()).min_by_key(|t| (t.at, t.rank));
        job.called_off |= over;
        if job.rank() == 0 {
            if let Some((unit, time)) = come.ended
                && self.ended.is_none_or(|(other, _)| unit < other)
            {
                self.ended = Some((unit, time));
            }
            // A step that failed was before the end of the run; outputs that cannot be read are after it.
            if let Some(first) = first.filter(|t| t.at.0 < tick || self.ended.is_none()) {
                if told_to_save {
                    // They send their states all the same.
                    job.gather(Vec::new())?;
                }
                return Err(first.failure());
            }
        }
        self.note_all(tick);
        if self.bonds.is_open() {
            self.bonds.add(length * self.stride as f64);
        }
        if job.save {
            let states = if job.rank() == 0 { Vec::new() } else { self.pack_states(tick) };
            let states = job.gather(states)?;
            job.states = (job.rank() == 0).then_some(states);
            job.save = job.rank() == 0;
        }
        // Who ended the run steps no more.
        job.idle |= self.ended.is_some();
        self.clockwork.coupling += begin.elapsed().saturating_sub(waited + watching).as_secs_f64();
        self.clockwork.watching += watching.as_secs_f64();
        self.clockwork.waiting += waited.as_secs_f64();
        Ok(())
    }

    /// Reads what rank 0 watches of the units that are here, and their terms of the power bonds; gives the time that took.
    fn read_watched(&mut self, job: &mut Job, tick: u64, all: bool) -> Duration {
        let begin = Instant::now();
        if job.idle {
            return Duration::ZERO;
        }
        let read = self.read_watches(tick, all, |unit| job.is_here(unit)).and_then(|()| self.write_shows(tick));
        let watching = begin.elapsed();
        self.is_read(job, tick, read);
        if self.bonds.is_open() && !job.idle {
            self.bonds.terms(&self.links, |unit| job.is_here(unit));
        }
        watching
    }

    /// What has been read of the units that are here, or could not be.
    fn is_read(&self, job: &mut Job, tick: u64, read: Result<(), Failure>) {
        match read {
            Ok(()) => {}
            // A unit that has ended the run need not have outputs any more.
            Err(_) if self.ended.is_some() => (job.readable, job.idle) = (false, true),
            Err(failure) => job.trouble(&failure, (tick, 0), &self.names()),
        }
    }

    /// What goes with the messages of a round now.
    fn what(job: &Job, over: bool) -> What {
        match (over, job.idle) {
            (true, _) => What::Over,
            (false, true) => What::Nothing,
            (false, false) => What::Values,
        }
    }

    /// Fills messages of a round with the values that other ranks need.
    fn pack(&self, job: &Job, tick: u64, (over, asked): (bool, bool), out: &mut [Message]) {
        let me = job.rank();
        let what = Self::what(job, over);
        for (to, bytes) in out {
            bytes.clear();
            let mut packer = Packer(bytes);
            packer.byte(what as u8);
            if me == 0 {
                packer.byte(u8::from(job.save && what == What::Values));
            }
            if *to == 0 {
                packer.byte(u8::from(asked));
                let (unit, time) = self.ended.unwrap_or((usize::MAX, f64::NAN));
                packer.whole(unit as u64);
                packer.real(time);
                packer.byte(u8::from(job.readable));
                packer.bytes(
                    &job.trouble.as_ref().map(|t| serde_json::to_vec(t).unwrap_or_default()).unwrap_or_default(),
                );
            }
            if what != What::Values {
                continue;
            }
            for cargo in job.cargo_out.get(to).into_iter().flatten().filter(|c| self.is_due(c.unit, tick)) {
                cargo.pack(&self.links.outputs[cargo.unit], &mut packer);
            }
        }
    }

    /// Adds what rank 0 is told besides: terms of power bonds, and what it watches.
    fn pack_watched(&mut self, job: &Job, tick: u64, all: bool, to: &mut Vec<u8>) {
        if Self::what(job, false) != What::Values {
            return;
        }
        let mut packer = Packer(to);
        self.bonds.pack_terms(|unit| job.is_here(unit), |term| packer.real(term));
        for watch in self.watches.iter().filter(|w| job.is_here(w.member)) {
            if self.is_watch_due(watch, tick, all) {
                Cargo::whole(watch.member, &watch.outputs).pack(&watch.outputs, &mut packer);
            }
        }
    }

    /// Takes the messages of a round apart.
    fn unpack(&mut self, job: &mut Job, tick: u64, all: bool) -> Result<Come, Failure> {
        let mut come = Come::default();
        let me = job.rank();
        let into = std::mem::take(&mut job.into);
        for (from, bytes) in &into {
            let mut unpacker = Unpacker(bytes);
            let what = unpacker.byte()?;
            if *from == 0 {
                job.save = unpacker.byte()? != 0;
            }
            if me == 0 {
                if unpacker.byte()? != 0 {
                    job.notes.borrow().relay.hear(*from, super::Note::Stop);
                }
                let (unit, time) = (unpacker.whole()? as usize, unpacker.real()?);
                if unit < self.members.len() && come.ended.is_none_or(|(other, _)| unit < other) {
                    come.ended = Some((unit, time));
                }
                job.readable &= unpacker.byte()? != 0;
                let trouble = unpacker.bytes()?;
                if !trouble.is_empty() {
                    come.troubles.push(serde_json::from_slice(trouble).map_err(|e| Broken(e.to_string()))?);
                }
            }
            if what == What::Over as u8 {
                job.over = true;
            }
            if what != What::Values as u8 {
                // Its values are missing here: neither can this rank go on.
                job.idle |= me != 0;
                continue;
            }
            for cargo in job.cargo_in.get(from).into_iter().flatten() {
                if self.is_due(cargo.unit, tick) {
                    cargo.unpack(&mut self.links.outputs[cargo.unit], &mut unpacker)?;
                }
            }
            if me == 0 {
                let mut lost = None;
                self.bonds.take_terms(
                    |unit| job.owner[unit] == *from,
                    || {
                        unpacker.real().unwrap_or_else(|e| {
                            lost = Some(e);
                            f64::NAN
                        })
                    },
                );
                if let Some(lost) = lost {
                    return Err(lost.into());
                }
                let mut watches = std::mem::take(&mut self.watches);
                for watch in watches.iter_mut().filter(|w| job.owner[w.member] == *from) {
                    if self.is_watch_due(watch, tick, all) {
                        Cargo::whole(watch.member, &watch.outputs).unpack(&mut watch.outputs, &mut unpacker)?;
                    }
                }
                self.watches = watches;
            }
        }
        job.into = into;
        Ok(come)
    }

    /// Carries and steps the units of this rank. What fails here is told in the next round.
    pub(in crate::coupling) fn advance_on_ranks(&mut self, tick: u64) -> Advance {
        let next = Advance::To(tick + self.stride);
        if self.job.as_ref().is_none_or(|job| job.idle) {
            return next;
        }
        let failed = match self.carry(tick) {
            Err(failure) => Some((1, failure)),
            Ok(()) => self.step(tick).err().map(|failure| (2, failure)),
        };
        if let Some((part, failure)) = failed {
            let names = self.names();
            if let Some(job) = &mut self.job {
                job.trouble(&failure, (tick, part), &names);
            }
        }
        next
    }

    /// Rank 0, after a [`System::read`] at a base step: whether a unit has ended the run on its way there, and if so, whether all units stand here and could be read.
    pub fn has_ended(&self, tick: u64) -> Option<bool> {
        let job = self.job.as_ref()?;
        let (_, reached) = self.ended?;
        let clock = self.plan.clock;
        let here = (reached - clock.time(tick)).abs() <= 1e-9 * clock.length(self.stride) && self.all_due(tick);
        Some(here && job.readable)
    }

    /// A rank other than 0: steps its units until rank 0 calls the run off. `at` is shown each base step.
    ///
    /// # Errors
    /// The ranks have lost each other.
    pub fn serve(&mut self, mut tick: u64, mut at: impl FnMut(f64, u64)) -> Result<(), Failure> {
        loop {
            at(self.time(tick), tick);
            self.read(tick)?;
            let Some(job) = &mut self.job else { return Ok(()) };
            if job.over {
                return Ok(());
            }
            // Rank 0 closes the run at its last step.
            job.idle |= tick >= self.plan.clock.steps;
            if let Advance::To(next) = self.advance_on_ranks(tick) {
                tick = next;
            }
        }
    }

    /// The states of the units that are here, and of what follows their outputs.
    fn pack_states(&mut self, tick: u64) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut packer = Packer(&mut bytes);
        match self.save_here(tick) {
            Err(failure) => {
                let names = self.names();
                let trouble = self.job.as_ref().map(|job| job.trouble_of(&failure, (tick, 0), &names));
                let told = trouble.unwrap_or_else(|| Trouble {
                    at: (tick, 0, 0),
                    rank: 0,
                    code: crate::exit::code_of_failure(&failure),
                    text: failure.to_string(),
                });
                packer.byte(1);
                packer.bytes(&serde_json::to_vec(&told).unwrap_or_default());
            }
            Ok(units) => {
                packer.byte(0);
                packer.whole(units.len() as u64);
                for (index, unit) in units {
                    packer.whole(index as u64);
                    packer.bytes(&unit.bytes);
                }
                for (_, numbers) in self.links.tracks_of() {
                    packer.reals(&numbers.to_numbers());
                }
            }
        }
        bytes
    }

    /// Rank 0: puts what the others have sent to what is saved here.
    pub(in crate::coupling) fn take_states(&mut self, units: &mut Vec<(usize, UnitState)>) -> Result<(), Failure> {
        let Some(job) = &mut self.job else { return Ok(()) };
        let Some(states) = job.states.take() else {
            return Err(Failure::Environment("the other ranks were not asked for their states".into()));
        };
        let owner = job.owner.clone();
        for (rank, bytes) in &states {
            let mut unpacker = Unpacker(bytes);
            if unpacker.byte()? != 0 {
                let told: Trouble = serde_json::from_slice(unpacker.bytes()?).map_err(|e| Broken(e.to_string()))?;
                return Err(Trouble { rank: *rank, ..told }.failure());
            }
            for _ in 0..unpacker.whole()? {
                let index = unpacker.whole()? as usize;
                let bytes = unpacker.bytes()?.to_vec();
                let component =
                    self.plan.components.get(index).ok_or_else(|| Broken("a unit that is not there".into()))?;
                let (name, guid) = (component.name.clone(), self.plan.model(index).guid.clone());
                units.push((index, UnitState { name, guid, bytes }));
            }
            // All tracks come; those count whose outputs are read there.
            let mut numbers = Vec::new();
            for (source, track) in self.links.tracks_of() {
                unpacker.reals(7, &mut numbers)?;
                if owner[source] == *rank
                    && let Ok(numbers) = <[f64; 7]>::try_from(numbers.as_slice())
                {
                    track.take_numbers(numbers);
                }
            }
        }
        units.sort_by_key(|(index, _)| *index);
        Ok(())
    }

    /// The end of a run: ends the units, and with other ranks takes what they have to report. Gives what went wrong.
    pub fn finish(&mut self) -> Vec<String> {
        let mut said: Vec<String> = self.terminate().iter().map(ToString::to_string).collect();
        let Some(mut job) = self.job.take() else { return said };
        let here = |unit: &usize| job.is_here(*unit);
        let report = Report {
            units: (0..self.members.len())
                .filter(here)
                .map(|u| {
                    let (calls, seconds) = self.effort(u);
                    (u, calls, seconds, self.threads[u])
                })
                .collect(),
            early: self.early_returns().map(|(unit, count)| (unit.to_owned(), count)).collect(),
            ends: said.clone(),
        };
        said.extend(job.close(report).err().map(|e| e.to_string()));
        for report in job.reports() {
            for &(unit, calls, seconds, threads) in &report.units {
                self.elsewhere[unit] = (calls, seconds);
                self.threads[unit] = threads;
            }
            self.early_elsewhere.extend(report.early.iter().cloned());
            said.extend(report.ends.iter().cloned());
        }
        self.job = Some(job);
        said
    }

    /// Lets notes go and come.
    pub(in crate::coupling) fn listen(&mut self) -> Result<(), Failure> {
        self.job.as_mut().map_or(Ok(()), |job| job.listen())
    }
}

/// What a round has brought to rank 0.
#[derive(Default)]
struct Come {
    troubles: Vec<Trouble>,
    ended: Option<(usize, f64)>,
}

fn tell(watch: &Watch) -> Told {
    let schedules = watch.schedules.iter().map(|s| [s.every, s.from, s.to]).collect();
    let o = &watch.outputs;
    let pairs =
        |references: &[u32], variables: &[usize]| references.iter().copied().zip(variables.iter().copied()).collect();
    let scalars = [
        pairs(&o.reals.references, &o.reals.variables),
        pairs(&o.integers.references, &o.integers.variables),
        pairs(&o.booleans.references, &o.booleans.variables),
        pairs(&o.strings.references, &o.strings.variables),
        o.real_arrays.iter().map(|a| (a.reference, a.array)).collect(),
        o.integer_arrays.iter().map(|a| (a.reference, a.array)).collect(),
    ];
    (watch.member, schedules, scalars)
}

fn take((member, schedules, [reals, integers, booleans, strings, real_arrays, integer_arrays]): Told) -> Watch {
    let schedules = schedules.into_iter().map(|[every, from, to]| Schedule { every, from, to }).collect();
    let mut outputs = Outputs::default();
    let scalars =
        [(Class::Real, reals), (Class::Integer, integers), (Class::Boolean, booleans), (Class::String, strings)];
    for (class, list) in scalars {
        list.into_iter().for_each(|(reference, variable)| _ = outputs.scalar(class, reference, variable));
    }
    for (kind, list) in [(Kind::Real, real_arrays), (Kind::Integer, integer_arrays)] {
        list.into_iter().for_each(|(reference, array)| _ = outputs.array(kind, reference, array));
    }
    Watch { member, schedules, outputs }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_watch_is_told_whole() {
        let mut outputs = Outputs::default();
        outputs.scalar(Class::Boolean, 9, 1);
        outputs.scalar(Class::Real, 3, 7);
        outputs.array(Kind::Integer, 5, 2);
        let watch = Watch { member: 4, schedules: vec![Schedule::every(3)], outputs };
        let again = take(serde_json::from_slice(&serde_json::to_vec(&tell(&watch)).unwrap()).unwrap());
        assert_eq!((again.member, &again.schedules), (4, &watch.schedules));
        assert_eq!(tell(&again), tell(&watch));
    }
}
