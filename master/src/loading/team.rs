//! The table by which the members of a unit that is spread over several ranks talk to each other.

use std::cell::{Cell, RefCell};
use std::ffi::{c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::rc::Rc;
use std::time::{Duration, Instant};

use terramech_fmi2::types::{TeamDeliver, TeamTable};

use crate::world::{Aside, Message, World};

/// A world that a run and the teams of its units use in turn, on one thread.
pub type Shared = Rc<RefCell<Box<dyn World>>>;

/// The members of one unit: their ranks, in order. Instances hold its address.
pub struct Team {
    world: Shared,
    ranks: Vec<usize>,
    index: usize,
    /// Notes of this rank, and when they last had their turn.
    aside: Option<Rc<RefCell<dyn Aside>>>,
    aired: Cell<Instant>,
}

/// Between two looks for notes while members work together.
const LOOK: Duration = Duration::from_millis(100);

impl Team {
    /// Of these ranks, one of which is this one. With `aside` notes go and come between rounds.
    pub fn new(world: Shared, ranks: Vec<usize>, aside: Option<Rc<RefCell<dyn Aside>>>) -> Box<Self> {
        let me = world.borrow().rank();
        let index = ranks.iter().position(|r| *r == me).unwrap_or(0);
        Box::new(Self { world, ranks, index, aside, aired: Cell::new(Instant::now()) })
    }

    /// What the unit is handed; valid as long as this lives.
    pub fn table(&self) -> TeamTable {
        TeamTable {
            env: std::ptr::from_ref(self).cast_mut().cast(),
            index: self.index,
            size: self.ranks.len(),
            round: team_round,
        }
    }

    fn round(&self, out: &[Message], into: &mut [Message]) -> Result<(), crate::world::Broken> {
        let mut world = self.world.borrow_mut();
        if let Some(aside) = self.aside.as_ref().filter(|_| self.aired.get().elapsed() >= LOOK) {
            world.notes(&mut *aside.borrow_mut())?;
            self.aired.set(Instant::now());
        }
        world.round(out, into, None)
    }
}

/// A list that C tells by pointer and length.
///
/// # Safety
/// `p` points to so many, or there are none.
unsafe fn list<'a, T>(p: *const T, n: usize) -> &'a [T] {
    // SAFETY: the caller's promise.
    if n == 0 || p.is_null() { &[] } else { unsafe { std::slice::from_raw_parts(p, n) } }
}

/// `TeamTable::round`.
unsafe extern "C" fn team_round(
    env: *mut c_void,
    n_out: usize,
    to: *const usize,
    bytes: *const *const u8,
    sizes: *const usize,
    n_in: usize,
    from: *const usize,
    deliver: TeamDeliver,
    receiver: *mut c_void,
) -> c_int {
    let round = || -> Option<()> {
        // SAFETY: the environment is the `Team` that the table was made of, which outlives the instance; the calls of a unit that is spread come from the thread that the
        // world belongs to.
        let team = unsafe { env.cast::<Team>().as_ref() }?;
        // SAFETY: lists with the lengths that are told, by the extension's contract.
        let (to, bytes, sizes, from) =
            unsafe { (list(to, n_out), list(bytes, n_out), list(sizes, n_out), list(from, n_in)) };
        let mut out: Vec<Message> = Vec::with_capacity(n_out);
        for ((&to, &bytes), &size) in to.iter().zip(bytes).zip(sizes) {
            // SAFETY: as above.
            out.push((*team.ranks.get(to)?, unsafe { list(bytes, size) }.to_vec()));
        }
        let mut into = Vec::with_capacity(n_in);
        for &from in from {
            into.push((*team.ranks.get(from)?, Vec::new()));
        }
        team.round(&out, &mut into).ok()?;
        for (k, (_, bytes)) in into.iter().enumerate() {
            // SAFETY: the unit's own function with its own receiver, called within its call.
            unsafe { deliver(receiver, k, bytes.as_ptr(), bytes.len()) };
        }
        Some(())
    };
    // A panic must not run through the unit's frames.
    match catch_unwind(AssertUnwindSafe(round)) {
        Ok(Some(())) => 0,
        _ => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::threads;

    /// Says its number until it is heard, or hears.
    #[derive(Default)]
    struct Voice {
        says: Option<Message>,
        heard: Vec<(usize, Vec<u8>)>,
    }

    impl Aside for Voice {
        fn hear(&mut self, from: usize, note: &[u8]) {
            self.heard.push((from, note.to_vec()));
        }
        fn say(&mut self) -> Option<Message> {
            self.says.take()
        }
    }

    #[test]
    fn what_a_lead_has_to_tell_gets_out_between_rounds() {
        let mut worlds = threads(3).into_iter();
        let (mut zero, one, two) = (worlds.next().unwrap(), worlds.next().unwrap(), worlds.next().unwrap());
        let lead = std::thread::spawn(move || {
            let voice = Rc::new(RefCell::new(Voice { says: Some((0, vec![7])), ..Voice::default() }));
            let aside = Rc::clone(&voice) as Rc<RefCell<dyn Aside>>;
            let team = Team::new(Rc::new(RefCell::new(one as Box<dyn World>)), vec![1, 2], Some(aside));
            for k in 0..3 {
                team.round(&[(2, vec![k])], &mut [(2, Vec::new())]).unwrap();
                std::thread::sleep(LOOK);
            }
        });
        let member = std::thread::spawn(move || {
            let team = Team::new(Rc::new(RefCell::new(two as Box<dyn World>)), vec![1, 2], None);
            for _ in 0..3 {
                team.round(&[(1, Vec::new())], &mut [(1, Vec::new())]).unwrap();
            }
        });
        lead.join().unwrap();
        member.join().unwrap();
        let mut voice = Voice::default();
        zero.notes(&mut voice).unwrap();
        assert_eq!(voice.heard, [(1, vec![7])]);
    }
}
