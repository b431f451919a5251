//! A panic inside a unit is told through the environment's log, once, with its place: not also on stderr by Rust's own hook.
//!
//! A unit library has its own copy of the standard library, so this hook hears the library's own panics alone. While a call is under way,
//! whatever thread panics (a unit's workers hand their panics on to the calling thread), its words are kept for the call that
//! catches it; a panic outside every call goes to the hook that was there before.

use std::panic::PanicHookInfo;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, Once, PoisonError};

/// Calls under way.
static CALLS: AtomicUsize = AtomicUsize::new(0);
/// What the last panic said, until a call takes it.
static SAID: Mutex<Option<String>> = Mutex::new(None);

/// Sets the hook, once a library.
pub fn listen() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if CALLS.load(Ordering::Acquire) == 0 {
                return before(info);
            }
            *SAID.lock().unwrap_or_else(PoisonError::into_inner) = Some(words(info));
        }));
    });
}

fn words(info: &PanicHookInfo) -> String {
    let payload = info.payload();
    let text = payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("(no text)");
    info.location().map_or_else(|| text.to_owned(), |at| format!("{text} ({}:{})", at.file(), at.line()))
}

/// A call under way, until it is dropped.
pub struct Call(());

impl Call {
    /// Begins a call.
    pub fn begin() -> Self {
        CALLS.fetch_add(1, Ordering::AcqRel);
        Self(())
    }
}

/// What the last panic during a call has said.
pub fn said() -> Option<String> {
    SAID.lock().unwrap_or_else(PoisonError::into_inner).take()
}

impl Drop for Call {
    fn drop(&mut self) {
        CALLS.fetch_sub(1, Ordering::AcqRel);
    }
}
