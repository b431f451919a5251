//! The table by which the members of a unit that is spread over several ranks talk to each other.

use std::cell::RefCell;
use std::ffi::{c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::rc::Rc;

use terramech_fmi2::types::{TeamDeliver, TeamTable};

use crate::world::{Message, World};

/// A world that a run and the teams of its units use in turn, on one thread.
pub type Shared = Rc<RefCell<Box<dyn World>>>;

/// The members of one unit: their ranks, in order. Instances hold its address.
pub struct Team {
    world: Shared,
    ranks: Vec<usize>,
    index: usize,
}

impl Team {
    /// Of these ranks, one of which is this one.
    pub fn new(world: Shared, ranks: Vec<usize>) -> Box<Self> {
        let me = world.borrow().rank();
        let index = ranks.iter().position(|r| *r == me).unwrap_or(0);
        Box::new(Self { world, ranks, index })
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
        self.world.borrow_mut().round(out, into, None)
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
