//! The function table: every C signature of FMI 2.0 for co-simulation and of our extensions, once, for the exporting
//! and for the loading side.

use crate::types::*;
use std::ffi::{c_char, c_int, c_void};

macro_rules! functions {
    ($( $(#[$doc:meta])* $type:ident = $symbol:literal ( $($arg:ident : $ty:ty),* ) -> $ret:ty; )*) => {
        $( $(#[$doc])* pub type $type = unsafe extern "C" fn($($arg: $ty),*) -> $ret; )*
        /// Symbol names in the order of the standard, extensions last.
        pub const SYMBOLS: &[&str] = &[$($symbol),*];
    };
}

type C = Fmi2Component;
type S = Fmi2Status;
type Vr = Fmi2ValueReference;

functions! {
    /// Platform of the types: "default".
    GetTypesPlatform = "fmi2GetTypesPlatform"() -> *const c_char;
    /// Version of the standard: "2.0".
    GetVersion = "fmi2GetVersion"() -> *const c_char;
    /// Switches logging on or off, for all or the named categories.
    SetDebugLogging = "fmi2SetDebugLogging"(c: C, on: Fmi2Boolean, n: usize, categories: *const Fmi2String) -> S;
    /// Makes an instance; NULL when it cannot.
    Instantiate = "fmi2Instantiate"(name: Fmi2String, kind: c_int, guid: Fmi2String, resources: Fmi2String, callbacks: *const Fmi2CallbackFunctions, visible: Fmi2Boolean, logging: Fmi2Boolean) -> C;
    /// Ends an instance.
    FreeInstance = "fmi2FreeInstance"(c: C) -> ();
    /// Start and stop time, tolerance.
    SetupExperiment = "fmi2SetupExperiment"(c: C, tolerance_defined: Fmi2Boolean, tolerance: Fmi2Real, start: Fmi2Real, stop_defined: Fmi2Boolean, stop: Fmi2Real) -> S;
    /// Enters initialization mode.
    EnterInitializationMode = "fmi2EnterInitializationMode"(c: C) -> S;
    /// Leaves initialization mode.
    ExitInitializationMode = "fmi2ExitInitializationMode"(c: C) -> S;
    /// Ends the run.
    Terminate = "fmi2Terminate"(c: C) -> S;
    /// Back to the state after instantiation.
    Reset = "fmi2Reset"(c: C) -> S;
    /// Reads reals.
    GetReal = "fmi2GetReal"(c: C, vr: *const Vr, n: usize, value: *mut Fmi2Real) -> S;
    /// Reads integers.
    GetInteger = "fmi2GetInteger"(c: C, vr: *const Vr, n: usize, value: *mut Fmi2Integer) -> S;
    /// Reads Booleans.
    GetBoolean = "fmi2GetBoolean"(c: C, vr: *const Vr, n: usize, value: *mut Fmi2Boolean) -> S;
    /// Reads strings; they stay valid until the next call of this instance.
    GetString = "fmi2GetString"(c: C, vr: *const Vr, n: usize, value: *mut Fmi2String) -> S;
    /// Writes reals.
    SetReal = "fmi2SetReal"(c: C, vr: *const Vr, n: usize, value: *const Fmi2Real) -> S;
    /// Writes integers.
    SetInteger = "fmi2SetInteger"(c: C, vr: *const Vr, n: usize, value: *const Fmi2Integer) -> S;
    /// Writes Booleans.
    SetBoolean = "fmi2SetBoolean"(c: C, vr: *const Vr, n: usize, value: *const Fmi2Boolean) -> S;
    /// Writes strings.
    SetString = "fmi2SetString"(c: C, vr: *const Vr, n: usize, value: *const Fmi2String) -> S;
    /// Copies the state.
    GetFmuState = "fmi2GetFMUstate"(c: C, state: *mut Fmi2FmuState) -> S;
    /// Restores a state.
    SetFmuState = "fmi2SetFMUstate"(c: C, state: Fmi2FmuState) -> S;
    /// Frees a state.
    FreeFmuState = "fmi2FreeFMUstate"(c: C, state: *mut Fmi2FmuState) -> S;
    /// Bytes that a state takes.
    SerializedFmuStateSize = "fmi2SerializedFMUstateSize"(c: C, state: Fmi2FmuState, size: *mut usize) -> S;
    /// State to bytes.
    SerializeFmuState = "fmi2SerializeFMUstate"(c: C, state: Fmi2FmuState, bytes: *mut Fmi2Byte, size: usize) -> S;
    /// Bytes to state.
    DeSerializeFmuState = "fmi2DeSerializeFMUstate"(c: C, bytes: *const Fmi2Byte, size: usize, state: *mut Fmi2FmuState) -> S;
    /// Directional derivative (our units provide none).
    GetDirectionalDerivative = "fmi2GetDirectionalDerivative"(c: C, unknown: *const Vr, n_unknown: usize, known: *const Vr, n_known: usize, dv_known: *const Fmi2Real, dv_unknown: *mut Fmi2Real) -> S;
    /// Derivatives of inputs (our units take none).
    SetRealInputDerivatives = "fmi2SetRealInputDerivatives"(c: C, vr: *const Vr, n: usize, order: *const Fmi2Integer, value: *const Fmi2Real) -> S;
    /// Derivatives of outputs (our units give none).
    GetRealOutputDerivatives = "fmi2GetRealOutputDerivatives"(c: C, vr: *const Vr, n: usize, order: *const Fmi2Integer, value: *mut Fmi2Real) -> S;
    /// One communication step.
    DoStep = "fmi2DoStep"(c: C, time: Fmi2Real, size: Fmi2Real, no_set_prior: Fmi2Boolean) -> S;
    /// Ends an asynchronous step (our units have none).
    CancelStep = "fmi2CancelStep"(c: C) -> S;
    /// Status of a step.
    GetStatus = "fmi2GetStatus"(c: C, kind: c_int, value: *mut S) -> S;
    /// `fmi2LastSuccessfulTime`.
    GetRealStatus = "fmi2GetRealStatus"(c: C, kind: c_int, value: *mut Fmi2Real) -> S;
    /// No kind is defined by the standard.
    GetIntegerStatus = "fmi2GetIntegerStatus"(c: C, kind: c_int, value: *mut Fmi2Integer) -> S;
    /// `fmi2Terminated`.
    GetBooleanStatus = "fmi2GetBooleanStatus"(c: C, kind: c_int, value: *mut Fmi2Boolean) -> S;
    /// `fmi2PendingStatus`.
    GetStringStatus = "fmi2GetStringStatus"(c: C, kind: c_int, value: *mut Fmi2String) -> S;
    /// Elements of an array now.
    GetArraySize = "terramech_getArraySize"(c: C, vr: Vr, n: *mut usize) -> S;
    /// Reads a real array; `n` as [`GetArraySize`] says.
    GetRealArray = "terramech_getRealArray"(c: C, vr: Vr, value: *mut Fmi2Real, n: usize) -> S;
    /// Writes a real array and sets its size.
    SetRealArray = "terramech_setRealArray"(c: C, vr: Vr, value: *const Fmi2Real, n: usize) -> S;
    /// Reads an integer array.
    GetIntegerArray = "terramech_getIntegerArray"(c: C, vr: Vr, value: *mut Fmi2Integer, n: usize) -> S;
    /// Writes an integer array and sets its size.
    SetIntegerArray = "terramech_setIntegerArray"(c: C, vr: Vr, value: *const Fmi2Integer, n: usize) -> S;
    /// Sets or (NULL) removes the progress report.
    SetProgress = "terramech_setProgress"(c: C, report: Option<ProgressReport>, env: *mut c_void) -> S;
    /// Makes the instance a member of a team; after instantiation, before anything else.
    SetTeam = "terramech_setTeam"(c: C, team: *const TeamTable) -> S;
    /// A member other than the lead does what the lead asks, until the lead is freed.
    ServeTeam = "terramech_serveTeam"(c: C) -> S;
    /// Measures what the specification describes, without any coupling, and writes what was found into a folder; after instantiation and its parameters.
    Measure = "terramech_measure"(c: C, folder: Fmi2String) -> S;
    /// Where the members of a team may leave their parts of saved states: a prefix of files, or NULL for states that hold everything.
    SetPieces = "terramech_setPieces"(c: C, prefix: Fmi2String) -> S;
    /// The members of a team write points with fields (`n` arrays and names) as `PREFIX_K.vtp`, and `PREFIX.pvtp`.
    WritePieces = "terramech_writePieces"(c: C, prefix: Fmi2String, position: Vr, n: usize, vr: *const Vr, name: *const Fmi2String) -> S;
}
