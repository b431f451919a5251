//! A world of threads in one process.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use super::{Aside, Broken, Message, Out, World};

/// One end of each channel: to and from every rank.
struct Ends<T> {
    to: Vec<Sender<T>>,
    from: Vec<Receiver<T>>,
}

/// A rank of a world of threads.
struct Thread {
    rank: usize,
    messages: Ends<Vec<u8>>,
    notes: Ends<Vec<u8>>,
}

/// A world of so many ranks, one for each thread of the caller's.
pub fn threads(size: usize) -> Vec<Box<dyn World + Send>> {
    let (messages, notes) = (ends(size), ends(size));
    let ranks = messages.into_iter().zip(notes).enumerate();
    ranks.map(|(rank, (messages, notes))| Box::new(Thread { rank, messages, notes }) as _).collect()
}

/// Channels between all pairs.
fn ends<T>(size: usize) -> Vec<Ends<T>> {
    let mut ends: Vec<Ends<T>> = (0..size).map(|_| Ends { to: Vec::new(), from: Vec::new() }).collect();
    for from in 0..size {
        for to in 0..size {
            let (sender, receiver) = channel();
            ends[from].to.push(sender);
            // `from` ascends, so that the receivers of each rank are in the order of the senders.
            ends[to].from.push(receiver);
        }
    }
    ends
}

/// How long a rank waits before it looks for notes again.
const LOOK: Duration = Duration::from_millis(1);

fn gone(rank: usize) -> Broken {
    Broken(format!("rank {rank} has gone"))
}

impl World for Thread {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.messages.to.len()
    }

    fn neighbours(&self) -> usize {
        self.size()
    }

    fn round_around(
        &mut self,
        (out, late, work): Out<'_, '_>,
        into: &mut [Message],
        mut aside: Option<&mut dyn Aside>,
    ) -> Result<(), Broken> {
        let send = |out: &[Message]| {
            out.iter().try_for_each(|(to, bytes)| self.messages.to[*to].send(bytes.clone()).map_err(|_| gone(*to)))
        };
        send(out)?;
        work(late);
        send(late)?;
        for (from, bytes) in into {
            *bytes = loop {
                match self.messages.from[*from].recv_timeout(LOOK) {
                    Ok(message) => break message,
                    Err(std::sync::mpsc::RecvTimeoutError::Timeout) => {
                        aside.as_deref_mut().map_or(Ok(()), |aside| self.notes(aside))?;
                    }
                    Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => return Err(gone(*from)),
                }
            };
        }
        aside.map_or(Ok(()), |aside| self.notes(aside))
    }

    fn notes(&mut self, aside: &mut dyn Aside) -> Result<(), Broken> {
        while let Some((to, note)) = aside.say() {
            self.notes.to[to].send(note).map_err(|_| gone(to))?;
        }
        for (from, notes) in self.notes.from.iter().enumerate() {
            // A rank that has ended has nothing to say any more; one that is missed is told by the round.
            while let Ok(note) = notes.try_recv() {
                aside.hear(from, &note);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Says one thing, keeps what it hears.
    #[derive(Default)]
    struct Ear {
        say: Option<Message>,
        heard: Vec<Message>,
    }

    impl Aside for Ear {
        fn hear(&mut self, from: usize, note: &[u8]) {
            self.heard.push((from, note.to_vec()));
        }

        fn say(&mut self) -> Option<Message> {
            self.say.take()
        }
    }

    #[test]
    fn rounds_keep_their_order_and_notes_come_between() {
        let ranks: Vec<_> = threads(3)
            .into_iter()
            .map(|mut world| {
                std::thread::spawn(move || {
                    let (me, size) = (world.rank(), world.size());
                    let others: Vec<usize> = (0..size).filter(|r| *r != me).collect();
                    let mut ear = Ear { say: (me != 0).then(|| (0, vec![me as u8])), ..Ear::default() };
                    for k in 0..20_u8 {
                        let out: Vec<Message> = others.iter().map(|r| (*r, vec![k; me + 1])).collect();
                        let mut into: Vec<Message> = others.iter().map(|r| (*r, Vec::new())).collect();
                        world.round(&out, &mut into, Some(&mut ear)).unwrap();
                        for (from, bytes) in into {
                            assert_eq!(bytes, vec![k; from + 1]);
                        }
                    }
                    ear.heard.sort();
                    ear.heard
                })
            })
            .collect();
        let notes: Vec<_> = ranks.into_iter().map(|r| r.join().unwrap()).collect();
        assert_eq!(notes[0], [(1, vec![1]), (2, vec![2])]);
        assert!(notes[1].is_empty() && notes[2].is_empty());
    }

    #[test]
    fn a_rank_that_has_gone_is_told() {
        let mut world = threads(2).into_iter();
        let mut first = world.next().unwrap();
        drop(world);
        let mut into = [(1, Vec::new())];
        assert_eq!(first.round(&[], &mut into, Some(&mut Ear::default())), Err(Broken("rank 1 has gone".into())));
    }
}
