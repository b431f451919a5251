//! Processes that carry out one run together: the **ranks** of a world, counted from 0. Rank 0 records, shows and decides; every rank steps the units that were placed on it.
//!
//! What a run needs of the machinery between them is small and stands in the trait [`World`]: rounds of messages, and notes that may come at any time. Two things implement it: MPI
//! (`mpi.rs`, the one module that knows it; feature `mpi`), and [`threads`](fn@threads) of one process, by which tests show without MPI what a run does on several ranks.

mod launcher;
mod meet;
#[cfg(feature = "mpi")]
mod mpi;
mod placement;
mod threads;

pub use launcher::{Launched, launched, start};
pub use meet::{Card, meet};
pub use placement::{Place, Placer, Rank, Ranks, place};
pub use threads::threads;

use std::fmt;

/// What is told to a world's user when it breaks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Broken(pub String);

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A message of a round: the other rank, and the bytes. The buffer is used again by the next round.
pub type Message = (usize, Vec<u8>);

/// What a rank hands over: messages that are there, others, and the work that fills those.
pub type Out<'m, 'f> = (&'m [Message], &'m mut [Message], &'f mut dyn FnMut(&mut [Message]));

/// What is said and heard beside the rounds: notes, which may go and come at any time.
pub trait Aside {
    /// A note has come.
    fn hear(&mut self, from: usize, note: &[u8]);

    /// The next note that waits to be sent.
    fn say(&mut self) -> Option<Message>;
}

/// The ranks of a run, seen from one of them. All calls come from the thread that made it.
pub trait World {
    /// This rank.
    fn rank(&self) -> usize;

    /// How many there are.
    fn size(&self) -> usize;

    /// Ranks that share this machine with this one, itself included; what threads are shared out by.
    fn neighbours(&self) -> usize;

    /// One round: hands over all of `out` and waits for one message from each rank named in `into`, which replaces what was in its buffer. Messages between two ranks arrive
    /// in the order in which they were handed over. Notes go and come while it waits, if there is somebody to hear them.
    ///
    /// # Errors
    /// The connection is lost.
    fn round(&mut self, out: &[Message], into: &mut [Message], aside: Option<&mut dyn Aside>) -> Result<(), Broken> {
        self.round_around((out, &mut [], &mut |_| ()), into, aside)
    }

    /// A round around some work: hands over the first messages, does the work, which fills the other ones, while those are on their way, and goes on as [`World::round`].
    ///
    /// # Errors
    /// The connection is lost.
    fn round_around(
        &mut self,
        out: Out<'_, '_>,
        into: &mut [Message],
        aside: Option<&mut dyn Aside>,
    ) -> Result<(), Broken>;

    /// Sends the notes that wait and takes those that have come. Sending one may wait until the other rank listens.
    ///
    /// # Errors
    /// The connection is lost.
    fn notes(&mut self, aside: &mut dyn Aside) -> Result<(), Broken>;
}
