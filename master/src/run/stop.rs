//! Ctrl-C: a flag that the run looks at between steps and answers units with that report long work.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The request to stop. Clones share it.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Not asked yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the run to stop after the step it is in.
    pub fn ask(&self) {
        self.0.store(true, Ordering::Release);
    }

    /// Whether it was asked.
    pub fn is_asked(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }

    /// Lets Ctrl-C (and SIGTERM) ask; the second time ends the process at once, for a unit that never returns. Of several ranks one `tells`.
    ///
    /// # Errors
    /// The system refuses the handler.
    pub fn on_interrupt(&self, tells: bool) -> Result<(), ctrlc::Error> {
        let stop = self.clone();
        ctrlc::set_handler(move || {
            if stop.is_asked() {
                eprintln!("\nstopped at once; results are written up to half a second ago");
                crate::archive::remove_temporaries();
                std::process::exit(super::ExitCode::Stopped as i32);
            }
            stop.ask();
            if tells {
                eprintln!("\nstopping after this step; once more stops at once");
            }
        })
    }
}
