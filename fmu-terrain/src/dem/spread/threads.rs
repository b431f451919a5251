//! A team of threads in one process.

use super::{Links, Message};
use crate::dem::error::DemError;
use std::sync::mpsc::{Receiver, Sender, channel};

/// A member: senders to all, receivers from all, by member.
struct Thread {
    index: usize,
    to: Vec<Sender<Vec<u8>>>,
    from: Vec<Receiver<Vec<u8>>>,
}

/// A team of so many members, one for each thread of the caller's.
pub fn team_of_threads(size: usize) -> Vec<Box<dyn Links>> {
    let mut members: Vec<Thread> = (0..size).map(|index| Thread { index, to: Vec::new(), from: Vec::new() }).collect();
    for from in 0..size {
        for to in 0..size {
            let (sender, receiver) = channel();
            members[from].to.push(sender);
            // `from` ascends: the receivers of each member are in the order of the senders.
            members[to].from.push(receiver);
        }
    }
    members.into_iter().map(|m| Box::new(m) as Box<dyn Links>).collect()
}

impl Links for Thread {
    fn index(&self) -> usize {
        self.index
    }

    fn size(&self) -> usize {
        self.to.len()
    }

    fn round(&mut self, out: Vec<Message>, from: &[usize]) -> Result<Vec<Vec<u8>>, DemError> {
        let gone = |k: usize| DemError::Team(format!("member {k} has gone"));
        for (to, bytes) in out {
            self.to[to].send(bytes).map_err(|_| gone(to))?;
        }
        from.iter().map(|&k| self.from[k].recv().map_err(|_| gone(k))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_learn_what_all_have() {
        for size in 1..9 {
            std::thread::scope(|scope| {
                for mut links in team_of_threads(size) {
                    scope.spawn(move || {
                        let mine = vec![links.index() as u8; links.index() + 1];
                        let expected: Vec<Vec<u8>> = (0..size).map(|k| vec![k as u8; k + 1]).collect();
                        assert_eq!(links.all(mine).unwrap(), expected);
                        let last = links.index() + 1 == size;
                        assert!(links.any(last).unwrap() && !links.any(false).unwrap());
                    });
                }
            });
        }
    }
}
