//! FMI 2.0 C types, by hand (`fmi2TypesPlatform.h`, `fmi2FunctionTypes.h`, platform "default").

use std::ffi::{c_char, c_int, c_void};

/// Opaque instance pointer.
pub type Fmi2Component = *mut c_void;
/// Opaque pointer of the environment, handed back to its callbacks.
pub type Fmi2ComponentEnvironment = *mut c_void;
/// Opaque saved state.
pub type Fmi2FmuState = *mut c_void;
/// Handle of a variable.
pub type Fmi2ValueReference = u32;
/// C `double`.
pub type Fmi2Real = f64;
/// C `int`.
pub type Fmi2Integer = c_int;
/// C `int`, 0 is false, every other value true.
pub type Fmi2Boolean = c_int;
/// Zero-terminated UTF-8.
pub type Fmi2String = *const c_char;
/// One byte of a serialised state.
pub type Fmi2Byte = c_char;

/// `fmi2False`.
pub const FMI2_FALSE: Fmi2Boolean = 0;
/// `fmi2True`.
pub const FMI2_TRUE: Fmi2Boolean = 1;

/// Result of a call, as C's `fmi2Status`. A plain integer, since a foreign library may return anything.
pub type Fmi2Status = c_int;
/// The call succeeded.
pub const FMI2_OK: Fmi2Status = 0;
/// It succeeded with a remark in the log.
pub const FMI2_WARNING: Fmi2Status = 1;
/// `fmi2DoStep` only: the step was computed in part; `fmi2GetRealStatus(fmi2LastSuccessfulTime)` tells how far.
pub const FMI2_DISCARD: Fmi2Status = 2;
/// The instance cannot go on.
pub const FMI2_ERROR: Fmi2Status = 3;
/// All instances of the library are unusable; never returned by our units.
pub const FMI2_FATAL: Fmi2Status = 4;
/// The step goes on in the background; never returned by our units.
pub const FMI2_PENDING: Fmi2Status = 5;

/// The name of a status for messages.
pub fn status_name(status: Fmi2Status) -> &'static str {
    match status {
        FMI2_OK => "fmi2OK",
        FMI2_WARNING => "fmi2Warning",
        FMI2_DISCARD => "fmi2Discard",
        FMI2_ERROR => "fmi2Error",
        FMI2_FATAL => "fmi2Fatal",
        FMI2_PENDING => "fmi2Pending",
        _ => "a status outside the standard",
    }
}

/// `fmi2ModelExchange`.
pub const FMI2_MODEL_EXCHANGE: c_int = 0;
/// `fmi2CoSimulation`.
pub const FMI2_CO_SIMULATION: c_int = 1;

/// `fmi2DoStepStatus`.
pub const FMI2_DO_STEP_STATUS: c_int = 0;
/// `fmi2PendingStatus`.
pub const FMI2_PENDING_STATUS: c_int = 1;
/// `fmi2LastSuccessfulTime`.
pub const FMI2_LAST_SUCCESSFUL_TIME: c_int = 2;
/// `fmi2Terminated`.
pub const FMI2_TERMINATED: c_int = 3;

/// The environment's log function; variadic in C, called with `message` as its format.
pub type Fmi2CallbackLogger = unsafe extern "C" fn(
    environment: Fmi2ComponentEnvironment,
    instance_name: Fmi2String,
    status: Fmi2Status,
    category: Fmi2String,
    message: Fmi2String,
    ...
);
/// `calloc`-like.
pub type Fmi2CallbackAllocateMemory = unsafe extern "C" fn(n: usize, size: usize) -> *mut c_void;
/// `free`-like.
pub type Fmi2CallbackFreeMemory = unsafe extern "C" fn(object: *mut c_void);
/// Told when an asynchronous step ends.
pub type Fmi2StepFinished = unsafe extern "C" fn(environment: Fmi2ComponentEnvironment, status: Fmi2Status);

/// The callbacks handed to `fmi2Instantiate`; they must outlive the instance.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Fmi2CallbackFunctions {
    /// Log function.
    pub logger: Option<Fmi2CallbackLogger>,
    /// Allocation of memory (our units use their own).
    pub allocate_memory: Option<Fmi2CallbackAllocateMemory>,
    /// Release of memory.
    pub free_memory: Option<Fmi2CallbackFreeMemory>,
    /// End of an asynchronous step.
    pub step_finished: Option<Fmi2StepFinished>,
    /// Handed back to every callback.
    pub component_environment: Fmi2ComponentEnvironment,
}

/// `terramech_setProgress`'s callback: `phase` names the work, `fraction` is in [0, 1] (negative: unknown). A
/// non-zero answer asks the unit to stop cleanly.
pub type ProgressReport = unsafe extern "C" fn(env: *mut c_void, phase: *const c_char, fraction: f64) -> c_int;

/// Takes message `k` of a round; the bytes stay valid during the call.
pub type TeamDeliver = unsafe extern "C" fn(receiver: *mut c_void, k: usize, bytes: *const u8, size: usize);

/// One round of a team: hands over `n_out` messages and takes one from each of `n_in` members, each given to `deliver`. 0: done.
pub type TeamRound = unsafe extern "C" fn(
    env: *mut c_void,
    n_out: usize,
    to: *const usize,
    bytes: *const *const u8,
    sizes: *const usize,
    n_in: usize,
    from: *const usize,
    deliver: TeamDeliver,
    receiver: *mut c_void,
) -> c_int;

/// `terramech_setTeam`'s table: what the members of a unit that is spread over several processes do together. The functions are called from the thread inside a call of
/// the unit alone. Table and environment stay valid until the instance is freed.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct TeamTable {
    /// Handed back to the functions.
    pub env: *mut c_void,
    /// This member; 0 is the lead, which is stepped, the others serve it.
    pub index: usize,
    /// How many there are.
    pub size: usize,
    /// A round.
    pub round: TeamRound,
}
