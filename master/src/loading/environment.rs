//! What a unit says while it is called: logs and progress, through C callbacks.

use std::collections::VecDeque;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};

use terramech_fmi2::types::*;

use super::{Cause, Pulse};

/// How many messages of a unit are kept to explain a failure.
const KEPT: usize = 12;

/// A message of a unit.
#[derive(Clone, Copy, Debug)]
pub struct LogLine<'a> {
    /// Instance name.
    pub unit: &'a str,
    /// The C status it was logged with.
    pub status: Fmi2Status,
    /// Log category of the model description.
    pub category: &'a str,
    /// The text, formatted.
    pub text: &'a str,
}

impl LogLine<'_> {
    /// Whether it tells of a failure.
    pub fn is_error(&self) -> bool {
        self.status >= FMI2_ERROR && self.status != FMI2_PENDING
    }

    /// Whether it is a warning.
    pub fn is_warning(&self) -> bool {
        self.status == FMI2_WARNING || self.status == FMI2_DISCARD
    }
}

/// Where the messages of units go. Called from any thread, at any time during a call into a unit.
pub trait Environment: Send + Sync {
    /// A message.
    fn log(&self, line: LogLine<'_>);

    /// Long work goes on: `fraction` in [0, 1], negative = unknown. Answer `false` to ask the unit to stop.
    fn progress(&self, unit: &str, phase: &str, fraction: f64) -> bool;

    /// An instance is about to be made; its calls can be followed from now on.
    fn follow(&self, _pulse: &Arc<Pulse>) {}
}

/// What the callbacks of one instance point to; lives in a box that outlives the instance.
pub(super) struct Ear {
    pub unit: String,
    pub environment: Arc<dyn Environment>,
    pub pulse: Arc<Pulse>,
    /// What was said, with the number of the call it was said in, so that a failure is explained by what was said during it.
    said: Mutex<VecDeque<(u64, Cause, String)>>,
}

impl Ear {
    pub fn new(unit: &str, environment: Arc<dyn Environment>) -> Box<Self> {
        let pulse = Arc::new(Pulse::new(unit));
        environment.follow(&pulse);
        Box::new(Self { unit: unit.to_owned(), pulse, environment, said: Mutex::new(VecDeque::with_capacity(KEPT)) })
    }

    /// What was said as error or warning during the call `name`, and the cause of the last error that names one.
    pub fn said(&self, name: &str) -> (Vec<String>, Cause) {
        let call = self.pulse.last();
        let said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        let of_call = said.iter().filter(|(of, _, _)| *of == call);
        let cause = of_call.clone().map(|(_, cause, _)| *cause).rfind(|c| *c != Cause::Unknown);
        // The message of the master names the call already.
        let bare =
            |text: &String| text.strip_prefix(name).and_then(|t| t.strip_prefix(": ")).unwrap_or(text).to_owned();
        (of_call.map(|(_, _, text)| bare(text)).collect(), cause.unwrap_or_default())
    }

    fn hear(&self, status: Fmi2Status, category: &str, text: &str) {
        let line = LogLine { unit: &self.unit, status, category, text };
        if line.is_error() || line.is_warning() {
            let mut said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
            if said.len() == KEPT {
                said.pop_front();
            }
            said.push_back((self.pulse.last(), Cause::of(category), text.to_owned()));
        }
        self.environment.log(line);
    }

    /// The callbacks for `fmi2Instantiate`.
    pub fn callbacks(&self) -> Box<Fmi2CallbackFunctions> {
        Box::new(Fmi2CallbackFunctions {
            logger: Some(terramech_logger),
            allocate_memory: Some(calloc),
            free_memory: Some(free),
            step_finished: Some(step_finished),
            component_environment: std::ptr::from_ref(self).cast_mut().cast(),
        })
    }
}

unsafe extern "C" {
    /// Formats a message and hands it to [`terramech_log_text`]; in `log.c`.
    fn terramech_logger(
        environment: Fmi2ComponentEnvironment,
        instance_name: Fmi2String,
        status: Fmi2Status,
        category: Fmi2String,
        message: Fmi2String,
        ...
    );
    fn calloc(n: usize, size: usize) -> *mut c_void;
    fn free(object: *mut c_void);
}

/// Asynchronous steps are awaited by asking `fmi2GetStatus`; nothing hangs on this call.
unsafe extern "C" fn step_finished(_: Fmi2ComponentEnvironment, _: Fmi2Status) {}

/// A zero-terminated text for Rust; null gives the stand-in.
///
/// # Safety
/// `p` is null or zero-terminated.
unsafe fn text<'a>(p: *const c_char, stand_in: &'a str) -> std::borrow::Cow<'a, str> {
    if p.is_null() {
        return stand_in.into();
    }
    // SAFETY: the caller's promise.
    unsafe { CStr::from_ptr(p) }.to_string_lossy()
}

/// Called by `log.c` with the formatted text.
#[unsafe(no_mangle)]
extern "C" fn terramech_log_text(
    environment: *mut c_void,
    status: c_int,
    category: *const c_char,
    message: *const c_char,
) {
    // SAFETY: the environment is the `Ear` of the instance, which outlives it; a unit that hands over null is ignored.
    let Some(ear) = (unsafe { environment.cast::<Ear>().cast_const().as_ref() }) else { return };
    // SAFETY: null or zero-terminated by the standard; the message is log.c's own.
    let (category, message) = unsafe { (text(category, ""), text(message, "")) };
    // A panic must not run through the unit's frames.
    let _ = catch_unwind(AssertUnwindSafe(|| ear.hear(status, &category, &message)));
}

/// `terramech_setProgress`'s callback.
pub(super) unsafe extern "C" fn progress(env: *mut c_void, phase: *const c_char, fraction: f64) -> c_int {
    // SAFETY: set together with the `Ear` of the instance, which outlives it.
    let Some(ear) = (unsafe { env.cast::<Ear>().cast_const().as_ref() }) else { return 0 };
    ear.pulse.sign();
    // SAFETY: null or zero-terminated by the extension's contract.
    let phase = unsafe { text(phase, "working") };
    let go_on =
        catch_unwind(AssertUnwindSafe(|| ear.environment.progress(&ear.unit, &phase, fraction))).unwrap_or(true);
    c_int::from(!go_on)
}
