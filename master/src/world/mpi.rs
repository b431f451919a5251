//! The world over MPI, by the crate `mpi`. Nothing else in this project knows it.
//!
//! All calls come from the thread that has initialised it (`MPI_THREAD_FUNNELED`). Messages are handed over without waiting (`MPI_Isend`) and taken by matched probes, since their sizes
//! change from step to step. Whoever waits looks a few hundred times and then leaves the core to others for longer and longer: MPI itself would spin, and a machine with more ranks than
//! cores would crawl.

use std::time::Duration;

use mpi::Threading;
use mpi::environment::Universe;
use mpi::request::{LocalScope, RequestCollection};
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;

use super::{Aside, Broken, Message, Out, World};

/// Tag of what is sent in rounds.
const ROUND: mpi::Tag = 1;
/// Tag of notes.
const NOTE: mpi::Tag = 2;

/// A rank of an MPI job.
struct Mpi {
    world: SimpleCommunicator,
    neighbours: usize,
    /// Whether this machine has more ranks than cores.
    crowded: bool,
    /// Last: MPI ends with it.
    _universe: Universe,
}

/// Initialises MPI.
///
/// # Errors
/// It is initialised already, or has no threads at all.
pub fn initialise() -> Result<Box<dyn World>, Broken> {
    let (universe, threading) = mpi::initialize_with_threading(Threading::Funneled)
        .ok_or_else(|| Broken("MPI has been initialised already in this process".into()))?;
    if threading < Threading::Funneled {
        return Err(Broken(
            "this MPI supports no program with threads (MPI_THREAD_SINGLE); build one with MPI_THREAD_FUNNELED".into(),
        ));
    }
    let world = universe.world();
    let neighbours = world.split_shared(world.rank()).size() as usize;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    Ok(Box::new(Mpi { world, neighbours, crowded: neighbours > cores, _universe: universe }))
}

/// Waiting that leaves the core to others.
struct Patience {
    looks: u32,
    /// Looks before it begins to sleep.
    most: u32,
}

impl Patience {
    /// Where every rank has a core, half a second of looking is cheaper than waking up late; where ranks share cores, somebody else needs it.
    fn new(crowded: bool) -> Self {
        Self { looks: 0, most: if crowded { 2000 } else { 2_000_000 } }
    }

    fn wait(&mut self) {
        self.looks += 1;
        match self.looks {
            0..300 => std::hint::spin_loop(),
            looks if looks < self.most => std::thread::yield_now(),
            // By now some milliseconds have passed: another 50 microseconds do not matter.
            _ => std::thread::sleep(Duration::from_micros(50)),
        }
    }
}

impl Mpi {
    /// Takes what has come under a tag, from this rank or from any.
    fn take(&self, from: Option<usize>, tag: mpi::Tag, into: &mut Vec<u8>) -> Option<usize> {
        let found = match from {
            Some(rank) => self.world.process_at_rank(rank as i32).immediate_matched_probe_with_tag(tag),
            None => self.world.any_process().immediate_matched_probe_with_tag(tag),
        };
        let (message, status) = found?;
        let count = status.count(u8::equivalent_datatype()) as usize;
        into.clear();
        into.resize(count, 0);
        message.matched_receive_into(&mut into[..]);
        Some(status.source_rank() as usize)
    }

    fn hand_over<'m>(&self, out: &'m [Message], scope: &LocalScope<'m>, sends: &mut RequestCollection<'m, [u8]>) {
        for (to, bytes) in out {
            let process = self.world.process_at_rank(*to as i32);
            sends.add(process.immediate_send_with_tag(scope, &bytes[..], ROUND));
        }
    }

    fn exchange_notes(&self, aside: &mut dyn Aside) {
        while let Some((to, note)) = aside.say() {
            self.world.process_at_rank(to as i32).send_with_tag(&note[..], NOTE);
        }
        let mut note = Vec::new();
        while let Some(from) = self.take(None, NOTE, &mut note) {
            aside.hear(from, &note);
        }
    }
}

impl World for Mpi {
    fn rank(&self) -> usize {
        self.world.rank() as usize
    }

    fn size(&self) -> usize {
        self.world.size() as usize
    }

    fn neighbours(&self) -> usize {
        self.neighbours
    }

    fn round_around(
        &mut self,
        (out, late, work): Out<'_, '_>,
        into: &mut [Message],
        mut aside: Option<&mut dyn Aside>,
    ) -> Result<(), Broken> {
        let this: &Self = self;
        let too_long = |out: &[Message]| out.iter().map(|m| m.1.len()).find(|n| i32::try_from(*n).is_err());
        let told = |n: usize| Broken(format!("a message of {n} bytes; MPI takes at most {}", i32::MAX));
        if let Some(n) = too_long(out) {
            return Err(told(n));
        }
        let mut wrong = None;
        mpi::request::multiple_scope(out.len() + late.len(), |scope, sends: &mut RequestCollection<'_, [u8]>| {
            this.hand_over(out, scope, sends);
            work(late);
            wrong = too_long(late);
            if wrong.is_none() {
                this.hand_over(late, scope, sends);
            }
            let mut patience = Patience::new(this.crowded);
            let mut missing = if wrong.is_none() { into.len() } else { 0 };
            let mut here = vec![false; into.len()];
            while missing > 0 {
                let mut came = false;
                for (arrived, (from, buffer)) in here.iter_mut().zip(into.iter_mut()) {
                    if !*arrived && this.take(Some(*from), ROUND, buffer).is_some() {
                        (*arrived, came) = (true, true);
                        missing -= 1;
                    }
                }
                if let Some(aside) = aside.as_deref_mut() {
                    this.exchange_notes(aside);
                }
                if came {
                    patience = Patience::new(this.crowded);
                } else if missing > 0 {
                    patience.wait();
                }
            }
            // The others take these when they come to their round.
            let mut done = Vec::new();
            let mut patience = Patience::new(this.crowded);
            while sends.incomplete() > 0 {
                sends.test_some(&mut done);
                if let Some(aside) = aside.as_deref_mut() {
                    this.exchange_notes(aside);
                }
                if sends.incomplete() > 0 {
                    patience.wait();
                }
            }
        });
        wrong.map_or(Ok(()), |n| Err(told(n)))
    }

    fn notes(&mut self, aside: &mut dyn Aside) -> Result<(), Broken> {
        self.exchange_notes(aside);
        Ok(())
    }
}
