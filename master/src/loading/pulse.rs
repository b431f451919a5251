//! Which call an instance is in, for a watchdog on another thread.

use std::sync::atomic::{AtomicPtr, AtomicU64, Ordering};

/// The calls of one instance. Three plain stores a call: cheap beside the call itself. Only one thread at a time is inside an
/// instance, so that counting needs no locked instruction.
#[derive(Debug)]
pub struct Pulse {
    unit: String,
    /// Odd while a call is under way.
    count: AtomicU64,
    /// Reports of progress.
    signs: AtomicU64,
    /// Points to the static name of the last call.
    call: AtomicPtr<&'static str>,
}

/// A name of a function that a pulse can point to.
pub type Name = &'static &'static str;

impl Pulse {
    /// For the instance of that name.
    pub fn new(unit: &str) -> Self {
        let call = AtomicPtr::new(std::ptr::from_ref::<&'static str>(&"").cast_mut());
        Self { unit: unit.to_owned(), count: AtomicU64::new(0), signs: AtomicU64::new(0), call }
    }

    /// Instance name.
    pub fn unit(&self) -> &str {
        &self.unit
    }

    /// Call number `number` begins, counted from 1 by the caller: a store costs less than to read, add and store.
    #[inline]
    pub(super) fn begin(&self, call: Name, number: u64) {
        self.call.store(std::ptr::from_ref(call).cast_mut(), Ordering::Relaxed);
        self.count.store(number.wrapping_mul(2).wrapping_sub(1), Ordering::Release);
    }

    /// It ends.
    #[inline]
    pub(super) fn end(&self, number: u64) {
        self.count.store(number.wrapping_mul(2), Ordering::Release);
    }

    /// Number of the call under way, or else of the last one.
    pub(super) fn last(&self) -> u64 {
        self.count.load(Ordering::Relaxed).div_ceil(2)
    }

    pub(super) fn sign(&self) {
        self.signs.fetch_add(1, Ordering::Relaxed);
    }

    /// The call under way, with a number that changes whenever the unit shows life; `None` between calls.
    pub fn look(&self) -> Option<(&'static str, u64)> {
        let count = self.count.load(Ordering::Acquire);
        // SAFETY: only ever set from references to static names, in `new` and `begin`.
        let call = unsafe { *self.call.load(Ordering::Relaxed) };
        let signs = self.signs.load(Ordering::Relaxed);
        (count % 2 == 1).then(|| (call, count.wrapping_mul(1 << 32).wrapping_add(signs)))
    }
}
