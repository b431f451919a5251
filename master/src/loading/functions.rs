//! The function table of one library.

use libloading::os::unix::Library as Handle;
use terramech_fmi2::functions as f;

macro_rules! table {
    (needed { $($need:ident: $need_type:ident = $need_symbol:literal;)* } optional { $($opt:ident: $opt_type:ident = $opt_symbol:literal;)* }) => {
        /// Functions resolved once when the library is opened. Those that no run can do without are mandatory; the
        /// standard asks for all, but many exporters leave out what they do not support.
        #[derive(Clone, Copy, Debug)]
        pub struct Functions { $(pub $need: f::$need_type,)* $(pub $opt: Option<f::$opt_type>,)* }

        impl Functions {
            /// Resolves all symbols; the error is the first mandatory one that is missing.
            ///
            /// # Safety
            /// Functions of these names in the library have the signatures of FMI 2.0 (and of our extensions).
            pub unsafe fn resolve(library: &Handle) -> Result<Self, &'static str> {
                Ok(Self {
                    // SAFETY: the signature is the standard's, by the caller's promise; the pointer is copied out of the
                    // symbol, and the library it points into is never unloaded.
                    $($need: unsafe { library.get::<f::$need_type>($need_symbol.as_bytes()) }.map(|s| *s).map_err(|_| $need_symbol)?,)*
                    // SAFETY: as above.
                    $($opt: unsafe { library.get::<f::$opt_type>($opt_symbol.as_bytes()) }.map(|s| *s).ok(),)*
                })
            }
        }
    };
}

table! {
    needed {
        instantiate: Instantiate = "fmi2Instantiate";
        free_instance: FreeInstance = "fmi2FreeInstance";
        setup_experiment: SetupExperiment = "fmi2SetupExperiment";
        enter_initialization: EnterInitializationMode = "fmi2EnterInitializationMode";
        exit_initialization: ExitInitializationMode = "fmi2ExitInitializationMode";
        terminate: Terminate = "fmi2Terminate";
        get_real: GetReal = "fmi2GetReal";
        get_integer: GetInteger = "fmi2GetInteger";
        get_boolean: GetBoolean = "fmi2GetBoolean";
        get_string: GetString = "fmi2GetString";
        set_real: SetReal = "fmi2SetReal";
        set_integer: SetInteger = "fmi2SetInteger";
        set_boolean: SetBoolean = "fmi2SetBoolean";
        set_string: SetString = "fmi2SetString";
        do_step: DoStep = "fmi2DoStep";
    }
    optional {
        get_types_platform: GetTypesPlatform = "fmi2GetTypesPlatform";
        get_version: GetVersion = "fmi2GetVersion";
        get_state: GetFmuState = "fmi2GetFMUstate";
        set_state: SetFmuState = "fmi2SetFMUstate";
        free_state: FreeFmuState = "fmi2FreeFMUstate";
        state_size: SerializedFmuStateSize = "fmi2SerializedFMUstateSize";
        serialize_state: SerializeFmuState = "fmi2SerializeFMUstate";
        deserialize_state: DeSerializeFmuState = "fmi2DeSerializeFMUstate";
        get_status: GetStatus = "fmi2GetStatus";
        get_real_status: GetRealStatus = "fmi2GetRealStatus";
        get_boolean_status: GetBooleanStatus = "fmi2GetBooleanStatus";
        set_input_derivatives: SetRealInputDerivatives = "fmi2SetRealInputDerivatives";
        get_array_size: GetArraySize = "terramech_getArraySize";
        get_real_array: GetRealArray = "terramech_getRealArray";
        set_real_array: SetRealArray = "terramech_setRealArray";
        get_integer_array: GetIntegerArray = "terramech_getIntegerArray";
        set_integer_array: SetIntegerArray = "terramech_setIntegerArray";
        set_progress: SetProgress = "terramech_setProgress";
        set_team: SetTeam = "terramech_setTeam";
        serve_team: ServeTeam = "terramech_serveTeam";
        measure: Measure = "terramech_measure";
        set_pieces: SetPieces = "terramech_setPieces";
        write_pieces: WritePieces = "terramech_writePieces";
    }
}
