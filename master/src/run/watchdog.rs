//! A unit that never returns ends the run: its name and the call are told, and what was recorded stays readable.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::loading::Pulse;

/// Between two looks.
const LOOK: Duration = Duration::from_millis(100);

/// The calls that are watched.
#[derive(Debug, Default)]
pub struct Watchdog {
    pulses: Mutex<Vec<Arc<Pulse>>>,
    done: AtomicBool,
}

impl Watchdog {
    /// Watches another instance.
    pub fn follow(&self, pulse: &Arc<Pulse>) {
        self.pulses.lock().unwrap_or_else(PoisonError::into_inner).push(Arc::clone(pulse));
    }

    /// Nothing is watched any more.
    pub fn finish(&self) {
        self.done.store(true, Ordering::Release);
    }

    /// Looks after the calls on a thread of its own: one that shows no life for `limit` is handed to `alarm` (unit, call), once.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(
        self: &Arc<Self>,
        limit: Duration,
        alarm: impl FnOnce(&str, &'static str) + Send + 'static,
    ) -> std::io::Result<()> {
        let dog = Arc::clone(self);
        let look = move || {
            let mut seen: Vec<Option<(u64, Instant)>> = Vec::new();
            while !dog.done.load(Ordering::Acquire) {
                std::thread::sleep(LOOK);
                let pulses = dog.pulses.lock().unwrap_or_else(PoisonError::into_inner).clone();
                seen.resize(pulses.len(), None);
                for (pulse, seen) in pulses.iter().zip(&mut seen) {
                    match (pulse.look(), &*seen) {
                        (None, _) => *seen = None,
                        (Some((call, sign)), Some((before, since))) if sign == *before => {
                            if since.elapsed() >= limit {
                                return alarm(pulse.unit(), call);
                            }
                        }
                        (Some((_, sign)), _) => *seen = Some((sign, Instant::now())),
                    }
                }
            }
        };
        std::thread::Builder::new().name("watchdog".into()).spawn(look).map(drop)
    }
}
