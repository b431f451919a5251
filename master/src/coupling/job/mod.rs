//! A run on several ranks: what a [`System`](super::System) of one rank needs of the others.
//!
//! Every rank holds the whole plan and the units that were placed on it, and goes through the same communication steps. What crosses goes straight from the rank of the sender to
//! that of the receiver, all of a step in **one message for each pair of ranks**; with rank 0 every rank exchanges one, since it records and decides. Values of a remote unit
//! lie in the same buffers as those of a unit that is here, and everything after them is the same code with the same operands: the results are the same bits for every placement.
//!
//! # One communication step
//!
//! ```text
//! each rank:  reads the outputs of its units | hands over values | reads what rank 0 watches, terms of power bonds | hands these over, takes what comes | sets inputs, steps its units
//! rank 0:     the same, and records and decides while the others step
//! ```
//!
//! Values are handed over as soon as a rank has read its outputs, while slower ones still compute, and travel while it reads what is recorded. What rank 0 decides from a round (a condition holds, a unit failed or ended the run)
//! the others learn in the next, so that no second message is needed: they may step once more, which nobody sees. A rank that cannot go on sends empty messages until rank 0 has called
//! the run off; who expected values from it does the same. So no rank waits for a message that never comes.
//!
//! Before the first step there is time: there ranks agree after each part ([`Job::agree`]), and a failure anywhere ends it everywhere.

mod bytes;
mod cargo;
mod note;
mod steps;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::Failure;
use super::connect::Links;
use crate::exit::{ExitCode, code_of_failure};
use crate::loading::{Shared, Team};
use crate::world::{Aside, Message, Ranks, World};

pub use note::Note;

use bytes::{Packer, Unpacker};
use cargo::Cargo;

/// Who hears and says notes on this rank: its host.
pub trait Relay: Send + Sync {
    /// The next note for rank 0.
    fn say(&self) -> Option<Note>;

    /// A note has come from a rank.
    fn hear(&self, from: usize, note: Note);

    /// Whether somebody asked the run to stop.
    fn is_stop_asked(&self) -> bool;
}

/// Why a rank cannot go on, as data. The least of all ranks counts, so that the same is told for every placement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Trouble {
    /// Base step, part of it (0: outputs, 1: inputs, 2: the step from there), and unit.
    at: (u64, u8, usize),
    rank: usize,
    code: ExitCode,
    text: String,
}

impl Trouble {
    fn failure(self) -> Failure {
        Failure::OnRank { rank: self.rank, text: self.text, code: self.code }
    }
}

/// What a unit's rank reports at the end.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Report {
    /// Unit, steps, wall time in them (s), threads.
    pub units: Vec<(usize, u64, f64, u32)>,
    /// Unit and number of steps that it broke off and went on from.
    pub early: Vec<(String, u64)>,
    /// What went wrong in `fmi2Terminate`.
    pub ends: Vec<String>,
}

/// How far the ranks have come together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Before the first step: they agree after each part.
    Starting,
    /// Rounds.
    Stepping,
    /// Over.
    Closed,
}

/// The notes of this rank.
struct Notes {
    relay: Arc<dyn Relay>,
    rank: usize,
    /// Number sent to rank 0, or heard from each.
    told: u64,
    heard: Vec<u64>,
    /// Ranks that are still to be told to stop: those who listen.
    stop: Vec<usize>,
}

impl Aside for Notes {
    fn hear(&mut self, from: usize, note: &[u8]) {
        self.heard[from] += 1;
        // One that cannot be read is of no use to anybody.
        if let Ok(note) = serde_json::from_slice(note) {
            self.relay.hear(from, note);
        }
    }

    fn say(&mut self) -> Option<Message> {
        let (to, note) = if self.rank == 0 {
            if !self.relay.is_stop_asked() {
                return None;
            }
            (self.stop.pop()?, Note::Stop)
        } else {
            (0, self.relay.say()?)
        };
        self.told += u64::from(to == 0);
        Some((to, serde_json::to_vec(&note).unwrap_or_default()))
    }
}

/// The other ranks, as seen from this one.
pub struct Job {
    world: Shared,
    rank: usize,
    size: usize,
    /// Ranks that serve the lead of a unit, and take no part in anything else.
    serve: Vec<bool>,
    /// Units that are spread, with their team where the lead is here.
    teams: Vec<(usize, Vec<usize>, Option<Box<Team>>)>,
    /// Whether those who serve here have been told to begin.
    begun: bool,
    notes: Rc<RefCell<Notes>>,
    /// The rank of each unit.
    owner: Vec<usize>,
    stage: Stage,
    /// What goes to and comes from each rank in a step.
    out: Vec<Message>,
    /// The message to rank 0, on the others: it is told more than values.
    to_first: Vec<Message>,
    into: Vec<Message>,
    cargo_out: BTreeMap<usize, Vec<Cargo>>,
    cargo_in: BTreeMap<usize, Vec<Cargo>>,
    trouble: Option<Trouble>,
    /// Whether this rank goes through rounds without values: it, or one it needs, cannot go on.
    idle: bool,
    /// Whether rank 0 has called the run off; of rank 0, and of the others.
    called_off: bool,
    over: bool,
    /// Whether all units that ended the run could still be read.
    readable: bool,
    /// Of rank 0: whether the round now is one to save at; then the states that came.
    save: bool,
    states: Option<Vec<Message>>,
    reports: Vec<Report>,
}

impl Job {
    /// The ranks of a world, with those of each unit.
    pub fn new(world: Box<dyn World>, ranks: &[Ranks], relay: Arc<dyn Relay>) -> Self {
        let (rank, size) = (world.rank(), world.size());
        let world: Shared = Rc::new(RefCell::new(world));
        let mut serve = vec![false; size];
        for ranks in ranks {
            ranks.all().skip(1).for_each(|r| serve[r] = true);
        }
        let stop = (1..size).filter(|r| !serve[*r]).collect();
        let notes = Rc::new(RefCell::new(Notes { relay, rank, told: 0, heard: vec![0; size], stop }));
        let mut teams = Vec::new();
        for (unit, ranks) in ranks.iter().enumerate().filter(|(_, r)| r.count() > 1) {
            let all: Vec<usize> = ranks.all().collect();
            // While its members work together what the lead has to tell, such as how far a bed has settled, goes to rank 0.
            let aside = || Rc::clone(&notes) as Rc<RefCell<dyn Aside>>;
            let team = (all[0] == rank).then(|| Team::new(Rc::clone(&world), all.clone(), Some(aside())));
            teams.push((unit, all, team));
        }
        Self {
            notes,
            owner: ranks.iter().map(|r| r.first as usize).collect(),
            world,
            rank,
            size,
            serve,
            teams,
            begun: false,
            stage: Stage::Starting,
            out: Vec::new(),
            to_first: Vec::new(),
            into: Vec::new(),
            cargo_out: BTreeMap::new(),
            cargo_in: BTreeMap::new(),
            trouble: None,
            idle: false,
            called_off: false,
            over: false,
            readable: true,
            save: false,
            states: None,
            reports: Vec::new(),
        }
    }

    /// This rank.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Number of ranks.
    pub fn size(&self) -> usize {
        self.size
    }

    /// The team of a unit whose lead is here.
    pub(super) fn team(&self, unit: usize) -> Option<&Team> {
        self.teams.iter().find(|t| t.0 == unit)?.2.as_deref()
    }

    /// How many ranks a unit is spread over; 0: it is not.
    pub fn members_of(&self, unit: usize) -> usize {
        self.teams.iter().find(|t| t.0 == unit).map_or(0, |t| t.1.len())
    }

    /// Whether a unit is spread over several ranks: it is called from this thread alone.
    pub fn is_spread(&self, unit: usize) -> bool {
        self.teams.iter().any(|t| t.0 == unit)
    }

    /// How it went for those who serve units that are led here.
    pub(super) fn served(&mut self) -> Result<(), Failure> {
        let mut failed = None;
        for (_, ranks, _) in self.teams.iter().filter(|t| t.2.is_some()) {
            let mut into: Vec<Message> = ranks[1..].iter().map(|r| (*r, Vec::new())).collect();
            self.world.borrow_mut().round(&[], &mut into, Some(&mut *self.notes.borrow_mut()))?;
            for (rank, bytes) in into {
                if let Some((text, code)) = serde_json::from_slice::<Option<(String, ExitCode)>>(&bytes).ok().flatten()
                {
                    failed.get_or_insert(Failure::OnRank { rank, text, code });
                }
            }
        }
        failed.map_or(Ok(()), Err)
    }

    /// Tells those who serve units that are led here to begin, or to go.
    pub(super) fn begin_teams(&mut self, go: bool) -> Result<(), Failure> {
        if std::mem::replace(&mut self.begun, true) {
            return Ok(());
        }
        for (_, ranks, _) in self.teams.iter().filter(|t| t.2.is_some()) {
            let out: Vec<Message> = ranks[1..].iter().map(|r| (*r, vec![u8::from(go)])).collect();
            self.world.borrow_mut().round(&out, &mut [], Some(&mut *self.notes.borrow_mut()))?;
        }
        Ok(())
    }

    /// The rank of each unit.
    pub fn owner(&self) -> &[usize] {
        &self.owner
    }

    /// Whether a unit is on this rank.
    pub fn is_here(&self, unit: usize) -> bool {
        self.owner[unit] == self.rank()
    }

    /// What the ranks reported at the end.
    pub(super) fn reports(&self) -> &[Report] {
        &self.reports
    }

    /// Lets notes go and come.
    pub(super) fn listen(&mut self) -> Result<(), Failure> {
        Ok(self.world.borrow_mut().notes(&mut *self.notes.borrow_mut())?)
    }

    /// The other ranks.
    fn others(&self) -> impl Iterator<Item = usize> + use<> {
        let (rank, serve) = (self.rank, self.serve.clone());
        (0..self.size).filter(move |r| *r != rank && !serve[*r])
    }

    /// From all others to rank 0: there their messages in the order of the ranks, elsewhere nothing.
    fn gather(&mut self, mine: Vec<u8>) -> Result<Vec<Message>, Failure> {
        let (out, mut into) = if self.rank() == 0 {
            (Vec::new(), self.others().map(|r| (r, Vec::new())).collect())
        } else {
            (vec![(0, mine)], Vec::new())
        };
        self.world.borrow_mut().round(&out, &mut into, Some(&mut *self.notes.borrow_mut()))?;
        Ok(into)
    }

    /// From rank 0 to all others; gives it on all.
    pub(super) fn broadcast(&mut self, mine: Vec<u8>) -> Result<Vec<u8>, Failure> {
        if self.rank() == 0 {
            let out: Vec<Message> = self.others().map(|r| (r, mine.clone())).collect();
            self.world.borrow_mut().round(&out, &mut [], Some(&mut *self.notes.borrow_mut()))?;
            return Ok(mine);
        }
        let mut into = [(0, Vec::new())];
        self.world.borrow_mut().round(&[], &mut into, Some(&mut *self.notes.borrow_mut()))?;
        let [(_, bytes)] = into;
        Ok(bytes)
    }

    /// All ranks have done their part, or one has failed and all give it up. Only before the first step.
    ///
    /// # Errors
    /// The failure of the first unit, in the order of the plan, with its rank; on other ranks than 0 that there was one.
    pub fn agree(&mut self, units: &[String], mine: Result<(), Failure>) -> Result<(), Failure> {
        let mine = mine.err().map(|f| self.trouble_of(&f, (0, 0), units));
        let json = |trouble: &Option<Trouble>| serde_json::to_vec(trouble).unwrap_or_default();
        let all = self.gather(json(&mine))?;
        let told = all.iter().filter_map(|(_, bytes)| serde_json::from_slice::<Option<Trouble>>(bytes).ok().flatten());
        let first = told.chain(mine).min_by_key(|t| (t.at, t.rank));
        let verdict = self.broadcast(vec![u8::from(first.is_some())])?;
        if verdict == [0] {
            return Ok(());
        }
        self.stage = Stage::Closed;
        Err(first.map_or(Failure::Environment("called off by rank 0".into()), Trouble::failure))
    }

    /// A failure as data.
    fn trouble_of(&self, failure: &Failure, at: (u64, u8), units: &[String]) -> Trouble {
        let name = match failure {
            Failure::Unit(unit) => Some(&unit.error.unit),
            Failure::NotFinite { unit, .. } => Some(unit),
            _ => None,
        };
        let unit = name.and_then(|n| units.iter().position(|u| u == n)).unwrap_or(units.len());
        Trouble { at: (at.0, at.1, unit), rank: self.rank(), code: code_of_failure(failure), text: failure.to_string() }
    }

    /// From now on values cross as `links` says.
    pub(super) fn begin(&mut self, links: &Links) {
        let me = self.rank();
        (self.cargo_out, self.cargo_in) = self.cargos(links);
        // With rank 0 every rank exchanges a message, with others where values cross.
        let meets = |cargos: &BTreeMap<usize, Vec<Cargo>>, r: usize| me == 0 || r == 0 || cargos.contains_key(&r);
        let out = self.others().filter(|&r| meets(&self.cargo_out, r)).map(|r| (r, Vec::new()));
        (self.to_first, self.out) = out.partition(|m| m.0 == 0);
        self.into = self.others().filter(|&r| meets(&self.cargo_in, r)).map(|r| (r, Vec::new())).collect();
        self.stage = Stage::Stepping;
    }

    /// What goes to each rank, and what comes from each.
    fn cargos(&self, links: &Links) -> (BTreeMap<usize, Vec<Cargo>>, BTreeMap<usize, Vec<Cargo>>) {
        let me = self.rank();
        let all = |cargos: &dyn Fn(usize) -> Vec<Cargo>| -> BTreeMap<usize, Vec<Cargo>> {
            self.others().map(|r| (r, cargos(r))).filter(|(_, c)| !c.is_empty()).collect()
        };
        (all(&|r| Cargo::between(links, &self.owner, me, r)), all(&|r| Cargo::between(links, &self.owner, r, me)))
    }

    /// Before the first step: the outputs of `links` that were read go to the ranks that need them.
    pub(super) fn share(&mut self, links: &mut Links) -> Result<(), Failure> {
        let (cargo_out, cargo_in) = self.cargos(links);
        let pack = |cargos: &Vec<Cargo>| {
            let mut bytes = Vec::new();
            cargos.iter().for_each(|c| c.pack(&links.outputs[c.unit], &mut Packer(&mut bytes)));
            bytes
        };
        let out: Vec<Message> = cargo_out.iter().map(|(&r, cargos)| (r, pack(cargos))).collect();
        let mut into: Vec<Message> = cargo_in.keys().map(|&r| (r, Vec::new())).collect();
        self.world.borrow_mut().round(&out, &mut into, Some(&mut *self.notes.borrow_mut()))?;
        for (from, bytes) in &into {
            let mut unpacker = Unpacker(bytes);
            for cargo in cargo_in.get(from).into_iter().flatten() {
                cargo.unpack(&mut links.outputs[cargo.unit], &mut unpacker)?;
            }
        }
        Ok(())
    }

    /// The end: rank 0 calls it off where that is still to be done, and takes what the others report.
    ///
    /// # Errors
    /// They have lost each other.
    pub(super) fn close(&mut self, mine: Report) -> Result<(), Failure> {
        match std::mem::replace(&mut self.stage, Stage::Closed) {
            Stage::Closed => return Ok(()),
            Stage::Starting => {
                self.stage = Stage::Starting;
                let given_up = Err(Failure::Environment("gave up before the first step".into()));
                let _ = self.agree(&[], given_up);
                self.stage = Stage::Closed;
                return Ok(());
            }
            Stage::Stepping => {}
        }
        if self.rank() == 0 {
            self.call_off()?;
        }
        // What is still to be said goes with the round, or before it.
        self.listen()?;
        let told = |told: u64, report: &Report| serde_json::to_vec(&(told, report)).unwrap_or_default();
        let mine = told(self.notes.borrow().told, &mine);
        let all = self.gather(mine)?;
        for (from, bytes) in &all {
            let (told, report): (u64, Report) = serde_json::from_slice(bytes).unwrap_or_default();
            while self.notes.borrow().heard[*from] < told {
                self.listen()?;
                std::thread::yield_now();
            }
            self.reports.push(report);
        }
        Ok(())
    }
}

impl Drop for Job {
    /// Whatever happens here, the others are not left waiting.
    fn drop(&mut self) {
        let _ = self.begin_teams(false);
        if !std::thread::panicking() && (self.rank() == 0 || self.stage == Stage::Starting) {
            let _ = self.close(Report::default());
        }
    }
}
