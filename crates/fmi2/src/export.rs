//! The C side: [`crate::export!`] emits one function per symbol of the standard, each of which lands here.
//!
//! Every call checks its pointers, catches panics (a caught panic poisons that instance alone and returns `fmi2Error`),
//! logs what was refused, and never lets anything unwind into C.

mod pointers;

use pointers::{copy_array, path_of, refuse, slice, slice_mut, text};

use crate::instance::{Instance, LogSink, Refused};
use crate::panics;
use crate::types::*;
use crate::{LogCategory, Model, Pieces};
use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CString, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::rc::Rc;

/// What a component pointer points to.
struct Handle {
    instance: Instance,
    /// Strings handed out by the last `fmi2GetString`.
    strings: Vec<CString>,
    /// Log categories that are switched on.
    enabled: Enabled,
}

type Enabled = Rc<RefCell<Vec<&'static str>>>;

/// Writes the exports of a library with the given models: `export!(models)` where `models: fn() -> Vec<Model>`.
///
/// Call it in a cdylib of its own, not in a library that others link: two with these symbols cannot be linked into one program.
#[macro_export]
macro_rules! export {
    ($models:path) => {
        #[doc(hidden)]
        #[allow(unsafe_code, missing_docs, non_snake_case, clippy::missing_safety_doc)]
        mod terramech_exports {
            use $crate::export as x;
            use $crate::types::*;
            type C = Fmi2Component;
            type S = Fmi2Status;
            type Vr = Fmi2ValueReference;
            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetTypesPlatform() -> *const std::ffi::c_char { c"default".as_ptr() }
            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetVersion() -> *const std::ffi::c_char { c"2.0".as_ptr() }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2Instantiate(name: Fmi2String, kind: std::ffi::c_int, guid: Fmi2String, resources: Fmi2String, callbacks: *const Fmi2CallbackFunctions, _visible: Fmi2Boolean, logging: Fmi2Boolean) -> C {
                // SAFETY: forwarded as called; the standard's contract on the pointers is the caller's.
                unsafe { x::instantiate($models, name, kind, guid, resources, callbacks, logging) }
            }
            $crate::export!(@forward
                fmi2SetDebugLogging = set_debug_logging(c: C, on: Fmi2Boolean, n: usize, categories: *const Fmi2String) -> S;
                fmi2FreeInstance = free_instance(c: C) -> ();
                fmi2SetupExperiment = setup_experiment(c: C, tolerance_defined: Fmi2Boolean, tolerance: Fmi2Real, start: Fmi2Real, stop_defined: Fmi2Boolean, stop: Fmi2Real) -> S;
                fmi2EnterInitializationMode = enter_initialization_mode(c: C) -> S;
                fmi2ExitInitializationMode = exit_initialization_mode(c: C) -> S;
                fmi2Terminate = terminate(c: C) -> S;
                fmi2Reset = reset(c: C) -> S;
                fmi2GetReal = get_real(c: C, vr: *const Vr, n: usize, value: *mut Fmi2Real) -> S;
                fmi2GetInteger = get_integer(c: C, vr: *const Vr, n: usize, value: *mut Fmi2Integer) -> S;
                fmi2GetBoolean = get_boolean(c: C, vr: *const Vr, n: usize, value: *mut Fmi2Boolean) -> S;
                fmi2GetString = get_string(c: C, vr: *const Vr, n: usize, value: *mut Fmi2String) -> S;
                fmi2SetReal = set_real(c: C, vr: *const Vr, n: usize, value: *const Fmi2Real) -> S;
                fmi2SetInteger = set_integer(c: C, vr: *const Vr, n: usize, value: *const Fmi2Integer) -> S;
                fmi2SetBoolean = set_boolean(c: C, vr: *const Vr, n: usize, value: *const Fmi2Boolean) -> S;
                fmi2SetString = set_string(c: C, vr: *const Vr, n: usize, value: *const Fmi2String) -> S;
                fmi2GetFMUstate = get_fmu_state(c: C, state: *mut Fmi2FmuState) -> S;
                fmi2SetFMUstate = set_fmu_state(c: C, state: Fmi2FmuState) -> S;
                fmi2FreeFMUstate = free_fmu_state(c: C, state: *mut Fmi2FmuState) -> S;
                fmi2SerializedFMUstateSize = serialized_fmu_state_size(c: C, state: Fmi2FmuState, size: *mut usize) -> S;
                fmi2SerializeFMUstate = serialize_fmu_state(c: C, state: Fmi2FmuState, bytes: *mut Fmi2Byte, size: usize) -> S;
                fmi2DeSerializeFMUstate = deserialize_fmu_state(c: C, bytes: *const Fmi2Byte, size: usize, state: *mut Fmi2FmuState) -> S;
                fmi2GetDirectionalDerivative = get_directional_derivative(c: C, unknown: *const Vr, n_unknown: usize, known: *const Vr, n_known: usize, dv_known: *const Fmi2Real, dv_unknown: *mut Fmi2Real) -> S;
                fmi2SetRealInputDerivatives = set_real_input_derivatives(c: C, vr: *const Vr, n: usize, order: *const Fmi2Integer, value: *const Fmi2Real) -> S;
                fmi2GetRealOutputDerivatives = get_real_output_derivatives(c: C, vr: *const Vr, n: usize, order: *const Fmi2Integer, value: *mut Fmi2Real) -> S;
                fmi2DoStep = do_step(c: C, time: Fmi2Real, size: Fmi2Real, no_set_prior: Fmi2Boolean) -> S;
                fmi2CancelStep = cancel_step(c: C) -> S;
                fmi2GetStatus = get_status(c: C, kind: std::ffi::c_int, value: *mut S) -> S;
                fmi2GetRealStatus = get_real_status(c: C, kind: std::ffi::c_int, value: *mut Fmi2Real) -> S;
                fmi2GetIntegerStatus = get_integer_status(c: C, kind: std::ffi::c_int, value: *mut Fmi2Integer) -> S;
                fmi2GetBooleanStatus = get_boolean_status(c: C, kind: std::ffi::c_int, value: *mut Fmi2Boolean) -> S;
                fmi2GetStringStatus = get_string_status(c: C, kind: std::ffi::c_int, value: *mut Fmi2String) -> S;
                terramech_getArraySize = get_array_size(c: C, vr: Vr, n: *mut usize) -> S;
                terramech_getRealArray = get_real_array(c: C, vr: Vr, value: *mut Fmi2Real, n: usize) -> S;
                terramech_setRealArray = set_real_array(c: C, vr: Vr, value: *const Fmi2Real, n: usize) -> S;
                terramech_getIntegerArray = get_integer_array(c: C, vr: Vr, value: *mut Fmi2Integer, n: usize) -> S;
                terramech_setIntegerArray = set_integer_array(c: C, vr: Vr, value: *const Fmi2Integer, n: usize) -> S;
                terramech_setProgress = set_progress(c: C, report: Option<ProgressReport>, env: *mut std::ffi::c_void) -> S;
                terramech_setTeam = set_team(c: C, team: *const TeamTable) -> S;
                terramech_serveTeam = serve_team(c: C) -> S;
                terramech_measure = measure(c: C, folder: Fmi2String) -> S;
                terramech_setPieces = set_pieces(c: C, prefix: Fmi2String) -> S;
                terramech_writePieces = write_pieces(c: C, prefix: Fmi2String, position: Vr, n: usize, vr: *const Vr, name: *const Fmi2String) -> S;
            );
        }
    };
    (@forward $($symbol:ident = $function:ident ($($arg:ident : $ty:ty),*) -> $ret:ty;)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $symbol($($arg: $ty),*) -> $ret {
            // SAFETY: forwarded as called; the standard's contract on the pointers is the caller's.
            unsafe { x::$function($($arg),*) }
        }
    )*};
}

fn panic_text(payload: &(dyn Any + Send)) -> &str {
    payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("(no text)")
}

/// Runs `f` on the handle behind `c`: null check, panic to poison, refusals to the log.
///
/// # Safety
/// `c` is null or came from [`instantiate`] and was not freed; one call at a time per component (FMI's own rule).
unsafe fn call(c: Fmi2Component, function: &str, f: impl FnOnce(&mut Handle) -> Result<(), Refused>) -> Fmi2Status {
    // SAFETY: see above.
    let Some(handle) = (unsafe { c.cast::<Handle>().as_mut() }) else { return FMI2_ERROR };
    let guard = panics::Call::begin();
    let result = catch_unwind(AssertUnwindSafe(|| f(handle)));
    drop(guard);
    match result {
        Ok(Ok(())) => FMI2_OK,
        Ok(Err(refused)) => {
            let _ = catch_unwind(AssertUnwindSafe(|| handle.instance.log(refused.category, &refused.message)));
            refused.status
        }
        Err(payload) => {
            handle.instance.poison();
            let text = format!(
                "{function}: the unit panicked: {}. This instance takes fmi2SetFMUstate, fmi2Reset and fmi2FreeInstance only; others are untouched.",
                panics::said().unwrap_or_else(|| panic_text(payload.as_ref()).to_owned())
            );
            let _ = catch_unwind(AssertUnwindSafe(|| handle.instance.log(LogCategory::Error, &text)));
            FMI2_ERROR
        }
    }
}

/// The environment's callbacks as a log sink. Messages go through C's variadic format, so `%` is doubled.
fn sink(callbacks: Fmi2CallbackFunctions, name: &str, enabled: Enabled) -> LogSink {
    let name = CString::new(name).unwrap_or_default();
    let log = move |category: LogCategory, message: &str| {
        let Some(logger) = callbacks.logger else { return };
        // Errors and warnings always reach the environment; the rest when it asked for it.
        let urgent = category.is_error() || category == LogCategory::Warning;
        if !urgent && !enabled.borrow().contains(&category.name()) {
            return;
        }
        let status = match category {
            _ if category.is_error() => FMI2_ERROR,
            LogCategory::Warning => FMI2_WARNING,
            _ => FMI2_OK,
        };
        let (Ok(message), Ok(category)) =
            (CString::new(message.replace('%', "%%").replace('\0', " ")), CString::new(category.name()))
        else {
            return;
        };
        // SAFETY: the callback is valid as long as the instance (the standard's contract); all strings are
        // zero-terminated and the format consumes no further arguments, since every % is doubled.
        unsafe { logger(callbacks.component_environment, name.as_ptr(), status, category.as_ptr(), message.as_ptr()) };
    };
    Box::new(log)
}

/// `fmi2Instantiate`.
///
/// # Safety
/// Pointers as the standard says.
pub unsafe fn instantiate(
    models: fn() -> Vec<Model>,
    name: Fmi2String,
    kind: c_int,
    guid: Fmi2String,
    resources: Fmi2String,
    callbacks: *const Fmi2CallbackFunctions,
    logging: Fmi2Boolean,
) -> Fmi2Component {
    // SAFETY: null or valid by the standard.
    let Some(callbacks) = (unsafe { callbacks.as_ref() }).copied() else { return std::ptr::null_mut() };
    // SAFETY: null or zero-terminated by the standard.
    let (name, guid, resources) = unsafe { (text(name), text(guid), text(resources)) };
    let all: Vec<&'static str> = LogCategory::ALL.iter().map(|c| c.name()).collect();
    let enabled: Enabled = Rc::new(RefCell::new(if logging != FMI2_FALSE { all } else { Vec::new() }));
    let mut log = sink(callbacks, name.unwrap_or("(unnamed)"), enabled.clone());
    panics::listen();
    let guard = panics::Call::begin();
    let made = catch_unwind(AssertUnwindSafe(|| -> Result<Instance, String> {
        if name.is_none_or(str::is_empty) {
            return Err("fmi2Instantiate: the instance name is missing, empty or not UTF-8".into());
        }
        if kind != FMI2_CO_SIMULATION {
            return Err(format!("fmi2Instantiate: kind {kind} asked for; this unit offers co-simulation (1) only"));
        }
        let guid = guid.ok_or("fmi2Instantiate: the GUID is missing or not UTF-8")?;
        let mut models = models();
        let known: Vec<String> = models.iter().map(|m| format!("{} {}", m.name, m.guid())).collect();
        let found = models.iter().position(|m| m.guid() == guid);
        let model = models.swap_remove(found.ok_or_else(|| {
            format!("fmi2Instantiate: no model of this library has the GUID '{guid}'; it has: {}", known.join(", "))
        })?);
        let folder = match resources {
            Some(uri) if !uri.is_empty() => Some(resource_folder(uri)?),
            _ => None,
        };
        let log = sink(callbacks, name.unwrap_or_default(), enabled.clone());
        Ok(Instance::new(model, folder.as_deref(), log))
    }));
    drop(guard);
    match made {
        Ok(Ok(instance)) => Box::into_raw(Box::new(Handle { instance, strings: Vec::new(), enabled })).cast(),
        Ok(Err(message)) => {
            log(LogCategory::Error, &message);
            std::ptr::null_mut()
        }
        Err(payload) => {
            log(LogCategory::Error, &format!("fmi2Instantiate: panicked: {}", panic_text(payload.as_ref())));
            std::ptr::null_mut()
        }
    }
}

/// `file:` URI (or, as some tools pass, a plain path) of the resources folder to a path.
fn resource_folder(uri: &str) -> Result<PathBuf, String> {
    let Some(rest) = uri.strip_prefix("file:") else { return Ok(PathBuf::from(uri)) };
    // file:///path, file://localhost/path and file:/path are all in use.
    let path = rest.strip_prefix("//localhost").or_else(|| rest.strip_prefix("//")).unwrap_or(rest);
    let mut bytes = Vec::with_capacity(path.len());
    let mut rest = path.as_bytes();
    while let [first, tail @ ..] = rest {
        rest = tail;
        if *first != b'%' {
            bytes.push(*first);
            continue;
        }
        let hex = tail.get(..2).and_then(|h| std::str::from_utf8(h).ok()).and_then(|h| u8::from_str_radix(h, 16).ok());
        bytes.push(hex.ok_or_else(|| format!("fmi2Instantiate: resource location '{uri}' has a broken % escape"))?);
        rest = &tail[2..];
    }
    String::from_utf8(bytes)
        .map(PathBuf::from)
        .map_err(|_| format!("fmi2Instantiate: resource location '{uri}' is not UTF-8"))
}

macro_rules! exports {
    ($( $(#[$doc:meta])* fn $name:ident($symbol:literal; $h:ident $(, $arg:ident : $ty:ty)*) $body:block )*) => {$(
        $(#[$doc])*
        ///
        /// # Safety
        /// Pointers as the standard says.
        pub unsafe fn $name(c: Fmi2Component $(, $arg: $ty)*) -> Fmi2Status {
            let body = |$h: &mut Handle| -> Result<(), Refused> { $body };
            // SAFETY: the caller's promise, passed on.
            unsafe { call(c, $symbol, body) }
        }
    )*};
}

type Vr = Fmi2ValueReference;

/// `fmi2FreeInstance`; null is allowed.
///
/// # Safety
/// `c` is null or came from [`instantiate`] and is not used again.
pub unsafe fn free_instance(c: Fmi2Component) {
    if !c.is_null() {
        // SAFETY: made by `Box::into_raw` in `instantiate`.
        let handle = unsafe { Box::from_raw(c.cast::<Handle>()) };
        let _ = catch_unwind(AssertUnwindSafe(move || drop(handle)));
    }
}

exports! {
    /// `fmi2SetDebugLogging`.
    fn set_debug_logging("fmi2SetDebugLogging"; h, on: Fmi2Boolean, n: usize, categories: *const Fmi2String) {
        // SAFETY: the caller's promise.
        let names = unsafe { slice("fmi2SetDebugLogging", "categories", categories, n)? };
        let mut picked = Vec::new();
        for &name in names {
            // SAFETY: null or zero-terminated.
            let name = unsafe { text(name) }.unwrap_or("(null)");
            let known = LogCategory::ALL.iter().find(|c| c.name() == name);
            picked.push(known.map(|c| c.name()).ok_or_else(|| {
                let all: Vec<_> = LogCategory::ALL.iter().map(|c| c.name()).collect();
                refuse(format!("fmi2SetDebugLogging: log category '{name}' is unknown; allowed: {}", all.join(", ")))
            })?);
        }
        if names.is_empty() {
            picked = LogCategory::ALL.iter().map(|c| c.name()).collect();
        }
        let mut enabled = h.enabled.borrow_mut();
        enabled.retain(|c| !picked.contains(c));
        if on != FMI2_FALSE {
            enabled.extend(picked);
        }
        Ok(())
    }
    /// `fmi2SetupExperiment`; the tolerance is not used by units with fixed inner steps.
    fn setup_experiment("fmi2SetupExperiment"; h, _tolerance_defined: Fmi2Boolean, _tolerance: Fmi2Real, start: Fmi2Real, stop_defined: Fmi2Boolean, stop: Fmi2Real) {
        h.instance.setup(start, (stop_defined != FMI2_FALSE).then_some(stop))
    }
    /// `fmi2EnterInitializationMode`.
    fn enter_initialization_mode("fmi2EnterInitializationMode"; h) { h.instance.enter_initialization() }
    /// `fmi2ExitInitializationMode`.
    fn exit_initialization_mode("fmi2ExitInitializationMode"; h) { h.instance.exit_initialization() }
    /// `fmi2Terminate`.
    fn terminate("fmi2Terminate"; h) { h.instance.terminate() }
    /// `fmi2Reset`.
    fn reset("fmi2Reset"; h) { h.instance.reset(); Ok(()) }
    /// `fmi2DoStep`.
    fn do_step("fmi2DoStep"; h, time: Fmi2Real, size: Fmi2Real, _no_set_prior: Fmi2Boolean) { h.instance.do_step(time, size) }
    /// `fmi2CancelStep`: only for asynchronous steps, which our units do not have.
    fn cancel_step("fmi2CancelStep"; _h) { Err(refuse("fmi2CancelStep: this unit computes its steps synchronously; there is nothing to cancel")) }
    /// `fmi2GetDirectionalDerivative`.
    fn get_directional_derivative("fmi2GetDirectionalDerivative"; _h, _u: *const Vr, _nu: usize, _k: *const Vr, _nk: usize, _dk: *const Fmi2Real, _du: *mut Fmi2Real) {
        Err(refuse("fmi2GetDirectionalDerivative: this unit provides no directional derivatives (providesDirectionalDerivative is false)"))
    }
    /// `fmi2SetRealInputDerivatives`.
    fn set_real_input_derivatives("fmi2SetRealInputDerivatives"; h, vr: *const Vr, n: usize, order: *const Fmi2Integer, value: *const Fmi2Real) {
        let f = "fmi2SetRealInputDerivatives";
        // SAFETY: the caller's promise.
        let (vr, order, value) = unsafe { (slice(f, "vr", vr, n)?, slice(f, "order", order, n)?, slice(f, "value", value, n)?) };
        vr.iter().zip(order).zip(value).try_for_each(|((vr, order), x)| h.instance.set_derivative(*vr, *order, *x))
    }
    /// `fmi2GetRealOutputDerivatives`.
    fn get_real_output_derivatives("fmi2GetRealOutputDerivatives"; _h, _vr: *const Vr, _n: usize, _order: *const Fmi2Integer, _value: *mut Fmi2Real) {
        Err(refuse("fmi2GetRealOutputDerivatives: this unit has no output derivatives (maxOutputDerivativeOrder is 0)"))
    }
    /// `fmi2GetStatus`.
    fn get_status("fmi2GetStatus"; _h, kind: c_int, _value: *mut Fmi2Status) {
        Err(refuse(format!("fmi2GetStatus: kind {kind}: this unit computes its steps synchronously and has no pending status")))
    }
    /// `fmi2GetRealStatus`.
    fn get_real_status("fmi2GetRealStatus"; h, kind: c_int, value: *mut Fmi2Real) {
        // SAFETY: the caller's promise.
        let value = unsafe { slice_mut("fmi2GetRealStatus", "value", value, 1)? };
        if kind != FMI2_LAST_SUCCESSFUL_TIME {
            return Err(refuse(format!("fmi2GetRealStatus: kind {kind}; allowed: fmi2LastSuccessfulTime (2)")));
        }
        value[0] = h.instance.last_successful_time();
        Ok(())
    }
    /// `fmi2GetIntegerStatus`.
    fn get_integer_status("fmi2GetIntegerStatus"; _h, kind: c_int, _value: *mut Fmi2Integer) {
        Err(refuse(format!("fmi2GetIntegerStatus: kind {kind}; the standard defines none")))
    }
    /// `fmi2GetBooleanStatus`.
    fn get_boolean_status("fmi2GetBooleanStatus"; h, kind: c_int, value: *mut Fmi2Boolean) {
        // SAFETY: the caller's promise.
        let value = unsafe { slice_mut("fmi2GetBooleanStatus", "value", value, 1)? };
        if kind != FMI2_TERMINATED {
            return Err(refuse(format!("fmi2GetBooleanStatus: kind {kind}; allowed: fmi2Terminated (3)")));
        }
        value[0] = h.instance.ended().into();
        Ok(())
    }
    /// `fmi2GetStringStatus`.
    fn get_string_status("fmi2GetStringStatus"; _h, kind: c_int, _value: *mut Fmi2String) {
        Err(refuse(format!("fmi2GetStringStatus: kind {kind}: this unit computes its steps synchronously and has no pending status")))
    }
    /// `fmi2GetReal`.
    fn get_real("fmi2GetReal"; h, vr: *const Vr, n: usize, value: *mut Fmi2Real) {
        // SAFETY: the caller's promise.
        let (vr, value) = unsafe { (slice("fmi2GetReal", "vr", vr, n)?, slice_mut("fmi2GetReal", "value", value, n)?) };
        h.instance.reals(vr, value)
    }
    /// `fmi2GetInteger`.
    fn get_integer("fmi2GetInteger"; h, vr: *const Vr, n: usize, value: *mut Fmi2Integer) {
        // SAFETY: the caller's promise.
        let (vr, value) = unsafe { (slice("fmi2GetInteger", "vr", vr, n)?, slice_mut("fmi2GetInteger", "value", value, n)?) };
        for (vr, to) in vr.iter().zip(value) { *to = h.instance.integer(*vr)?; }
        Ok(())
    }
    /// `fmi2GetBoolean`.
    fn get_boolean("fmi2GetBoolean"; h, vr: *const Vr, n: usize, value: *mut Fmi2Boolean) {
        // SAFETY: the caller's promise.
        let (vr, value) = unsafe { (slice("fmi2GetBoolean", "vr", vr, n)?, slice_mut("fmi2GetBoolean", "value", value, n)?) };
        for (vr, to) in vr.iter().zip(value) { *to = h.instance.boolean(*vr)?.into(); }
        Ok(())
    }
    /// `fmi2GetString`; the strings stay valid until the next call of this function on this instance.
    fn get_string("fmi2GetString"; h, vr: *const Vr, n: usize, value: *mut Fmi2String) {
        // SAFETY: the caller's promise.
        let (vr, value) = unsafe { (slice("fmi2GetString", "vr", vr, n)?, slice_mut("fmi2GetString", "value", value, n)?) };
        h.strings.clear();
        for vr in vr {
            let text = h.instance.string(*vr)?.replace('\0', " ");
            h.strings.push(CString::new(text).map_err(|e| refuse(format!("fmi2GetString: {e}")))?);
        }
        for (text, to) in h.strings.iter().zip(value) { *to = text.as_ptr(); }
        Ok(())
    }
    /// `fmi2SetReal`.
    fn set_real("fmi2SetReal"; h, vr: *const Vr, n: usize, value: *const Fmi2Real) {
        // SAFETY: the caller's promise.
        let (vr, value) = unsafe { (slice("fmi2SetReal", "vr", vr, n)?, slice("fmi2SetReal", "value", value, n)?) };
        h.instance.set_reals(vr, value)
    }
    /// `fmi2SetInteger`.
    fn set_integer("fmi2SetInteger"; h, vr: *const Vr, n: usize, value: *const Fmi2Integer) {
        // SAFETY: the caller's promise.
        let (vr, value) = unsafe { (slice("fmi2SetInteger", "vr", vr, n)?, slice("fmi2SetInteger", "value", value, n)?) };
        vr.iter().zip(value).try_for_each(|(vr, x)| h.instance.set_integer(*vr, *x))
    }
    /// `fmi2SetBoolean`.
    fn set_boolean("fmi2SetBoolean"; h, vr: *const Vr, n: usize, value: *const Fmi2Boolean) {
        // SAFETY: the caller's promise.
        let (vr, value) = unsafe { (slice("fmi2SetBoolean", "vr", vr, n)?, slice("fmi2SetBoolean", "value", value, n)?) };
        vr.iter().zip(value).try_for_each(|(vr, x)| h.instance.set_boolean(*vr, *x != FMI2_FALSE))
    }
    /// `fmi2SetString`.
    fn set_string("fmi2SetString"; h, vr: *const Vr, n: usize, value: *const Fmi2String) {
        // SAFETY: the caller's promise.
        let (vr, value) = unsafe { (slice("fmi2SetString", "vr", vr, n)?, slice("fmi2SetString", "value", value, n)?) };
        for (vr, x) in vr.iter().zip(value) {
            // SAFETY: null or zero-terminated.
            let x = unsafe { text(*x) }.ok_or_else(|| refuse(format!("fmi2SetString: the value for reference {vr} is null or not UTF-8")))?;
            h.instance.set_string(*vr, x)?;
        }
        Ok(())
    }
    /// `terramech_getArraySize`.
    fn get_array_size("terramech_getArraySize"; h, vr: Vr, n: *mut usize) {
        // SAFETY: the caller's promise.
        let n = unsafe { slice_mut("terramech_getArraySize", "n", n, 1)? };
        n[0] = h.instance.array_size(vr)?;
        Ok(())
    }
    /// `terramech_getRealArray`.
    fn get_real_array("terramech_getRealArray"; h, vr: Vr, value: *mut Fmi2Real, n: usize) {
        // SAFETY: the caller's promise.
        let value = unsafe { slice_mut("terramech_getRealArray", "value", value, n)? };
        copy_array("terramech_getRealArray", h.instance.real_array(vr)?, value)
    }
    /// `terramech_setRealArray`.
    fn set_real_array("terramech_setRealArray"; h, vr: Vr, value: *const Fmi2Real, n: usize) {
        // SAFETY: the caller's promise.
        let value = unsafe { slice("terramech_setRealArray", "value", value, n)? };
        h.instance.set_real_array(vr, value)
    }
    /// `terramech_getIntegerArray`.
    fn get_integer_array("terramech_getIntegerArray"; h, vr: Vr, value: *mut Fmi2Integer, n: usize) {
        // SAFETY: the caller's promise.
        let value = unsafe { slice_mut("terramech_getIntegerArray", "value", value, n)? };
        copy_array("terramech_getIntegerArray", h.instance.integer_array(vr)?, value)
    }
    /// `terramech_setIntegerArray`.
    fn set_integer_array("terramech_setIntegerArray"; h, vr: Vr, value: *const Fmi2Integer, n: usize) {
        // SAFETY: the caller's promise.
        let value = unsafe { slice("terramech_setIntegerArray", "value", value, n)? };
        h.instance.set_integer_array(vr, value)
    }
    /// `terramech_setProgress`.
    fn set_progress("terramech_setProgress"; h, report: Option<ProgressReport>, env: *mut c_void) {
        h.instance.set_progress(report.map(|report| {
            Box::new(move |phase: &str, fraction: f64| {
                let phase = CString::new(phase).unwrap_or_default();
                // SAFETY: report and env stay valid until replaced (the extension's contract).
                unsafe { report(env, phase.as_ptr(), fraction) == 0 }
            }) as crate::instance::ProgressSink
        }));
        Ok(())
    }
    /// `terramech_setTeam`.
    fn set_team("terramech_setTeam"; h, team: *const TeamTable) {
        // SAFETY: the caller's promise.
        let table = unsafe { slice("terramech_setTeam", "team", team, 1)? };
        h.instance.set_team(Box::new(crate::host_team::HostTeam(table[0])))
    }
    /// `terramech_serveTeam`.
    fn serve_team("terramech_serveTeam"; h) { h.instance.serve_team() }
    /// `terramech_measure`.
    fn measure("terramech_measure"; h, folder: Fmi2String) {
        // SAFETY: the caller's promise.
        let folder = unsafe { path_of("terramech_measure", folder)? };
        let folder = folder.ok_or_else(|| refuse("terramech_measure: no folder is given"))?;
        h.instance.measure(&folder)
    }
    /// `terramech_setPieces`.
    fn set_pieces("terramech_setPieces"; h, prefix: Fmi2String) {
        // SAFETY: the caller's promise.
        let prefix = unsafe { path_of("terramech_setPieces", prefix)? };
        h.instance.set_pieces(prefix);
        Ok(())
    }
    /// `terramech_writePieces`.
    fn write_pieces("terramech_writePieces"; h, prefix: Fmi2String, position: Vr, n: usize, vr: *const Vr, name: *const Fmi2String) {
        // SAFETY: the caller's promise.
        let prefix = unsafe { path_of("terramech_writePieces", prefix)? };
        let prefix = prefix.ok_or_else(|| refuse("terramech_writePieces: no prefix of files is given"))?;
        // SAFETY: as above.
        let (vr, name) = unsafe { (slice("terramech_writePieces", "vr", vr, n)?, slice("terramech_writePieces", "name", name, n)?) };
        let mut fields = Vec::with_capacity(n);
        for (&vr, &name) in vr.iter().zip(name) {
            // SAFETY: as above.
            let name = unsafe { text(name) };
            let name = name.ok_or_else(|| refuse(format!("terramech_writePieces: the name for reference {vr} is null or not UTF-8")))?;
            fields.push((vr, name.to_owned()));
        }
        h.instance.write_pieces(&Pieces { prefix, position, fields })
    }
    /// `fmi2GetFMUstate`: overwrites the state `*state` points to, or makes one when it is null.
    fn get_fmu_state("fmi2GetFMUstate"; h, state: *mut Fmi2FmuState) {
        // SAFETY: the caller's promise.
        let state = unsafe { slice_mut("fmi2GetFMUstate", "FMUstate", state, 1)? };
        let bytes = h.instance.save()?;
        // SAFETY: null, or made below and not freed.
        match unsafe { state[0].cast::<Vec<u8>>().as_mut() } {
            Some(old) => *old = bytes,
            None => state[0] = Box::into_raw(Box::new(bytes)).cast(),
        }
        Ok(())
    }
    /// `fmi2SetFMUstate`.
    fn set_fmu_state("fmi2SetFMUstate"; h, state: Fmi2FmuState) {
        // SAFETY: null, or made by `fmi2GetFMUstate` or `fmi2DeSerializeFMUstate` and not freed.
        let bytes = unsafe { state.cast::<Vec<u8>>().as_ref() }.ok_or_else(|| refuse("fmi2SetFMUstate: the state is null"))?;
        h.instance.restore(bytes)
    }
    /// `fmi2FreeFMUstate`; a null state is allowed.
    fn free_fmu_state("fmi2FreeFMUstate"; _h, state: *mut Fmi2FmuState) {
        // SAFETY: the caller's promise.
        let state = unsafe { slice_mut("fmi2FreeFMUstate", "FMUstate", state, 1)? };
        if !state[0].is_null() {
            // SAFETY: made by `Box::into_raw` above or below, freed once: the pointer is nulled.
            drop(unsafe { Box::from_raw(state[0].cast::<Vec<u8>>()) });
            state[0] = std::ptr::null_mut();
        }
        Ok(())
    }
    /// `fmi2SerializedFMUstateSize`.
    fn serialized_fmu_state_size("fmi2SerializedFMUstateSize"; _h, state: Fmi2FmuState, size: *mut usize) {
        // SAFETY: as in `fmi2SetFMUstate`.
        let bytes = unsafe { state.cast::<Vec<u8>>().as_ref() }.ok_or_else(|| refuse("fmi2SerializedFMUstateSize: the state is null"))?;
        // SAFETY: the caller's promise.
        let size = unsafe { slice_mut("fmi2SerializedFMUstateSize", "size", size, 1)? };
        size[0] = bytes.len();
        Ok(())
    }
    /// `fmi2SerializeFMUstate`.
    fn serialize_fmu_state("fmi2SerializeFMUstate"; _h, state: Fmi2FmuState, to: *mut Fmi2Byte, size: usize) {
        // SAFETY: as in `fmi2SetFMUstate`.
        let bytes = unsafe { state.cast::<Vec<u8>>().as_ref() }.ok_or_else(|| refuse("fmi2SerializeFMUstate: the state is null"))?;
        // SAFETY: the caller's promise; c_char and u8 have one size.
        let to = unsafe { slice_mut("fmi2SerializeFMUstate", "serializedState", to.cast::<u8>(), size)? };
        copy_array("fmi2SerializeFMUstate", bytes, to)
    }
    /// `fmi2DeSerializeFMUstate`: checks the bytes whole before it makes a state of them.
    fn deserialize_fmu_state("fmi2DeSerializeFMUstate"; h, bytes: *const Fmi2Byte, size: usize, state: *mut Fmi2FmuState) {
        // SAFETY: the caller's promise; c_char and u8 have one size.
        let bytes = unsafe { slice("fmi2DeSerializeFMUstate", "serializedState", bytes.cast::<u8>(), size)? };
        // SAFETY: the caller's promise.
        let state = unsafe { slice_mut("fmi2DeSerializeFMUstate", "FMUstate", state, 1)? };
        h.instance.check_state(bytes)?;
        // SAFETY: null, or made by `fmi2GetFMUstate` or here and not freed.
        match unsafe { state[0].cast::<Vec<u8>>().as_mut() } {
            Some(old) => *old = bytes.to_vec(),
            None => state[0] = Box::into_raw(Box::new(bytes.to_vec())).cast(),
        }
        Ok(())
    }
}
