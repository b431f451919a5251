//! Which call an instance is in, for a watchdog on another thread.

use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicU64, Ordering};

/// The calls of one instance. Two stores a call: cheap beside the call itself.
#[derive(Debug)]
pub struct Pulse {
    unit: String,
    /// Odd while a call is under way.
    count: AtomicU64,
    /// Reports of progress.
    signs: AtomicU64,
    call: Mutex<&'static str>,
}

impl Pulse {
    /// For the instance of that name.
    pub fn new(unit: &str) -> Self {
        Self { unit: unit.to_owned(), count: AtomicU64::new(0), signs: AtomicU64::new(0), call: Mutex::new("") }
    }

    /// Instance name.
    pub fn unit(&self) -> &str {
        &self.unit
    }

    pub(super) fn begin(&self, call: &'static str) {
        *self.call.lock().unwrap_or_else(PoisonError::into_inner) = call;
        self.count.fetch_add(1, Ordering::Release);
    }

    pub(super) fn end(&self) {
        self.count.fetch_add(1, Ordering::Release);
    }

    pub(super) fn sign(&self) {
        self.signs.fetch_add(1, Ordering::Relaxed);
    }

    /// The call under way, with a number that changes whenever the unit shows life; `None` between calls.
    pub fn look(&self) -> Option<(&'static str, u64)> {
        let count = self.count.load(Ordering::Acquire);
        let call = *self.call.lock().unwrap_or_else(PoisonError::into_inner);
        let signs = self.signs.load(Ordering::Relaxed);
        (count % 2 == 1).then(|| (call, count.wrapping_mul(1 << 32).wrapping_add(signs)))
    }
}
