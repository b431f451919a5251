//! One `fmi2Instantiate`: safe methods over the function table; its steps: `stepping.rs`.

mod stepping;

pub use stepping::Stepped;

use std::ffi::{CStr, CString, c_int, c_void};
use std::path::Path;
use std::ptr::NonNull;
use std::sync::Arc;

use terramech_fmi2::types::*;

use super::environment::{Ear, Environment, progress};
use super::functions::Functions;
use super::pulse::Name;
use super::values::{Batch, Outputs, Sets};
use super::{CallError, Cause, Library, LoadError, Pulse, Status, Team};

/// Largest array we take (elements): beyond it the size is a fault of the unit, not a bed.
const MOST_ELEMENTS: usize = 1 << 31;
/// An instance of a unit.
///
/// # Protocol
/// `new`, then `set` of start values, `setup`, `enter_initialization`, any number of `read` and `set`, `exit_initialization`,
/// then `read`, `set` and `step`, at the end `terminate`; dropping frees it. After an error the instance takes no further call: each
/// gives [`Status::NotCalled`].
pub struct Instance {
    pub(super) component: NonNull<c_void>,
    pub(super) library: Arc<Library>,
    /// The library's, one pointer nearer.
    functions: Functions,
    pulse: Arc<Pulse>,
    // Boxes: the unit keeps pointers to both.
    ear: Box<Ear>,
    _callbacks: Box<Fmi2CallbackFunctions>,
    pub(super) alive: bool,
    pub(super) running: bool,
    variable_steps: bool,
    /// Steps that the unit broke off and went on with.
    early_returns: u64,
    /// Calls so far.
    calls: u64,
    pointers: Vec<Fmi2String>,
    /// The state kept by [`Instance::keep`]; null or the unit's.
    pub(super) kept: Fmi2FmuState,
}

// SAFETY: FMI 2.0 asks that an instance is not called by two threads at the same time, not that it is always the same thread;
// every call needs `&mut self`. The pointers in `pointers` are used within one call only.
unsafe impl Send for Instance {}

/// What `Instance::new` is made from.
pub struct Made<'a> {
    /// Instance name.
    pub name: &'a str,
    /// `guid` of the model description.
    pub guid: &'a str,
    /// The unpacked `resources` folder.
    pub resources: &'a Path,
    /// Whether to log more than errors and warnings.
    pub logging: bool,
    /// `canHandleVariableCommunicationStepSize`: a step that the unit broke off may be gone on with by smaller ones.
    pub variable_steps: bool,
}

/// A path for C. One with a zero byte, which no file has, is empty and refused by the unit.
fn c_text(path: &Path) -> CString {
    CString::new(path.to_string_lossy().as_bytes()).unwrap_or_default()
}

impl Instance {
    /// `fmi2Instantiate` for co-simulation.
    ///
    /// # Errors
    /// [`LoadError::Instantiate`] with what the unit said, [`LoadError::Text`].
    pub fn new(library: &Arc<Library>, made: &Made<'_>, environment: Arc<dyn Environment>) -> Result<Self, LoadError> {
        let text = |what: &'static str, given: String| {
            CString::new(given.clone()).map_err(|_| LoadError::Text { unit: made.name.to_owned(), what, given })
        };
        let name = text("the name", made.name.to_owned())?;
        let guid = text("the GUID", made.guid.to_owned())?;
        let resources = text("the resource location", file_uri(made.resources))?;
        let ear = Ear::new(made.name, environment);
        let callbacks = ear.callbacks();
        ear.pulse.begin(&"fmi2Instantiate", 1);
        // SAFETY: all texts are zero-terminated and live through the call; the callbacks and the ear they point to live in
        // boxes as long as the instance.
        let component = unsafe {
            (library.functions.instantiate)(
                name.as_ptr(),
                FMI2_CO_SIMULATION,
                guid.as_ptr(),
                resources.as_ptr(),
                &raw const *callbacks,
                FMI2_FALSE,
                c_int::from(made.logging),
            )
        };
        ear.pulse.end(1);
        let Some(component) = NonNull::new(component) else {
            return Err(LoadError::Instantiate { unit: made.name.to_owned(), said: ear.said("fmi2Instantiate").0 });
        };
        let mut instance = Self {
            component,
            library: Arc::clone(library),
            functions: library.functions,
            pulse: Arc::clone(&ear.pulse),
            ear,
            _callbacks: callbacks,
            alive: true,
            running: false,
            variable_steps: made.variable_steps,
            early_returns: 0,
            calls: 1,
            pointers: Vec::new(),
            kept: std::ptr::null_mut(),
        };
        if let Some(set_progress) = library.functions.set_progress {
            let ear = std::ptr::from_ref(&*instance.ear).cast_mut().cast();
            // SAFETY: the ear outlives the instance.
            let _ = instance.call(&"terramech_setProgress", |_, c| unsafe { set_progress(c, Some(progress), ear) });
            // A unit that refuses reports runs without: the extension is not the standard's business.
            instance.alive = true;
        }
        Ok(instance)
    }

    /// Instance name.
    pub fn name(&self) -> &str {
        &self.ear.unit
    }

    /// Whether it still takes calls.
    #[inline]
    pub fn is_alive(&self) -> bool {
        self.alive && !self.library.is_condemned()
    }

    /// `fmi2SetupExperiment`, times in s; no tolerance is given, since the units bring their own integrators.
    ///
    /// # Errors
    /// [`CallError`].
    pub fn setup(&mut self, start: f64, stop: Option<f64>) -> Result<(), CallError> {
        // SAFETY: no pointers but the component.
        self.call(&"fmi2SetupExperiment", |f, c| unsafe {
            (f.setup_experiment)(c, FMI2_FALSE, 0.0, start, c_int::from(stop.is_some()), stop.unwrap_or(0.0))
        })
    }

    /// `terramech_setTeam`: makes it a member of a team, which must outlive it. Calls from here on come from the thread that the team's world belongs to.
    ///
    /// # Errors
    /// [`CallError`]; a library without the function.
    pub fn join(&mut self, team: &Team) -> Result<(), CallError> {
        let table = team.table();
        self.call(&"terramech_setTeam", |f, c| match f.set_team {
            // SAFETY: the table lives through the call, its environment longer than the instance (the caller's promise).
            Some(set_team) => unsafe { set_team(c, &raw const table) },
            None => terramech_fmi2::types::FMI2_ERROR,
        })
    }

    /// `terramech_serveTeam`: does what the lead of the team asks, until that is freed.
    ///
    /// # Errors
    /// [`CallError`].
    pub fn serve(&mut self) -> Result<(), CallError> {
        self.call(&"terramech_serveTeam", |f, c| match f.serve_team {
            // SAFETY: no pointers but the component.
            Some(serve) => unsafe { serve(c) },
            None => terramech_fmi2::types::FMI2_ERROR,
        })
    }

    /// Whether its library has `terramech_measure`.
    pub fn measures(&self) -> bool {
        self.functions.measure.is_some()
    }

    /// `terramech_measure`: what its specification describes, without any coupling; into a folder.
    ///
    /// # Errors
    /// [`CallError`]; a library without the function.
    pub fn measure(&mut self, folder: &Path) -> Result<(), CallError> {
        let folder = c_text(folder);
        self.call(&"terramech_measure", |f, c| match f.measure {
            // SAFETY: a text that lives through the call.
            Some(measure) => unsafe { measure(c, folder.as_ptr()) },
            None => terramech_fmi2::types::FMI2_ERROR,
        })
    }

    /// `terramech_setPieces`: where its team may leave parts of saved states; without the function states hold everything.
    ///
    /// # Errors
    /// [`CallError`].
    pub fn set_pieces(&mut self, prefix: Option<&Path>) -> Result<(), CallError> {
        if self.functions.set_pieces.is_none() {
            return Ok(());
        }
        let prefix = prefix.map(c_text);
        let text = prefix.as_ref().map_or(std::ptr::null(), |prefix| prefix.as_ptr());
        self.call(&"terramech_setPieces", |f, c| match f.set_pieces {
            // SAFETY: null, or a text that lives through the call.
            Some(set_pieces) => unsafe { set_pieces(c, text) },
            None => terramech_fmi2::types::FMI2_ERROR,
        })
    }

    /// `terramech_writePieces`: points with fields, each a value reference and a name, by all members of its team.
    ///
    /// # Errors
    /// [`CallError`]; a library without the function.
    pub fn write_pieces(&mut self, prefix: &Path, position: u32, fields: &[(u32, String)]) -> Result<(), CallError> {
        let prefix = c_text(prefix);
        let vrs: Vec<u32> = fields.iter().map(|f| f.0).collect();
        let texts: Vec<CString> = fields.iter().map(|f| CString::new(f.1.as_str()).unwrap_or_default()).collect();
        let names: Vec<Fmi2String> = texts.iter().map(|text| text.as_ptr()).collect();
        self.call(&"terramech_writePieces", |f, c| match f.write_pieces {
            // SAFETY: texts and lists with the lengths that are told, which live through the call.
            Some(write) => unsafe { write(c, prefix.as_ptr(), position, vrs.len(), vrs.as_ptr(), names.as_ptr()) },
            None => terramech_fmi2::types::FMI2_ERROR,
        })
    }

    /// `fmi2EnterInitializationMode`.
    ///
    /// # Errors
    /// [`CallError`].
    pub fn enter_initialization(&mut self) -> Result<(), CallError> {
        // SAFETY: no pointers but the component.
        self.call(&"fmi2EnterInitializationMode", |f, c| unsafe { (f.enter_initialization)(c) })
    }

    /// `fmi2ExitInitializationMode`.
    ///
    /// # Errors
    /// [`CallError`].
    pub fn exit_initialization(&mut self) -> Result<(), CallError> {
        // SAFETY: no pointers but the component.
        self.call(&"fmi2ExitInitializationMode", |f, c| unsafe { (f.exit_initialization)(c) })?;
        self.running = true;
        Ok(())
    }

    /// `fmi2Terminate`, if the instance runs.
    ///
    /// # Errors
    /// [`CallError`].
    pub fn terminate(&mut self) -> Result<(), CallError> {
        if !std::mem::take(&mut self.running) || !self.is_alive() {
            return Ok(());
        }
        // SAFETY: no pointers but the component.
        self.call(&"fmi2Terminate", |f, c| unsafe { (f.terminate)(c) })
    }

    /// Reads all of `outputs`, by one call per type and two per array.
    ///
    /// # Errors
    /// [`CallError`].
    #[inline]
    pub fn read(&mut self, outputs: &mut Outputs) -> Result<(), CallError> {
        let o = outputs;
        macro_rules! scalars {
            ($batch:expr, $call:literal, $function:ident) => {
                if !$batch.references.is_empty() {
                    let batch = &mut $batch;
                    debug_assert_eq!(batch.references.len(), batch.values.len());
                    // SAFETY: both arrays have as many elements as the call is told.
                    self.call(&$call, |f, c| unsafe {
                        (f.$function)(c, batch.references.as_ptr(), batch.references.len(), batch.values.as_mut_ptr())
                    })?;
                }
            };
        }
        scalars!(o.reals, "fmi2GetReal", get_real);
        scalars!(o.integers, "fmi2GetInteger", get_integer);
        scalars!(o.booleans, "fmi2GetBoolean", get_boolean);
        if !o.strings.references.is_empty() {
            self.read_strings(&o.strings.references, &mut o.strings.values)?;
        }
        for array in &mut o.real_arrays {
            self.read_array(array.reference, &mut array.values, &"terramech_getRealArray", |f| f.get_real_array)?;
        }
        for array in &mut o.integer_arrays {
            self.read_array(array.reference, &mut array.values, &"terramech_getIntegerArray", |f| f.get_integer_array)?;
        }
        Ok(())
    }

    fn read_strings(&mut self, references: &[u32], values: &mut [String]) -> Result<(), CallError> {
        let mut pointers = std::mem::take(&mut self.pointers);
        pointers.clear();
        pointers.resize(references.len(), std::ptr::null());
        // SAFETY: both arrays have as many elements as the call is told.
        let result = self.call(&"fmi2GetString", |f, c| unsafe {
            (f.get_string)(c, references.as_ptr(), references.len(), pointers.as_mut_ptr())
        });
        if result.is_ok() {
            for (pointer, value) in pointers.iter().zip(values) {
                value.clear();
                if !pointer.is_null() {
                    // SAFETY: not null; zero-terminated and valid until the next call of this instance by the standard.
                    value.push_str(&unsafe { CStr::from_ptr(*pointer) }.to_string_lossy());
                }
            }
        }
        self.pointers = pointers;
        result
    }

    fn read_array<T: Clone + Default>(
        &mut self,
        reference: u32,
        values: &mut Vec<T>,
        name: Name,
        function: impl Fn(&Functions) -> Option<unsafe extern "C" fn(Fmi2Component, u32, *mut T, usize) -> Fmi2Status>,
    ) -> Result<(), CallError> {
        let functions = self.library.functions;
        let (Some(size_of), Some(get)) = (functions.get_array_size, function(&functions)) else {
            return Err(self.refused(name, Status::Missing, String::new()));
        };
        let mut n = 0_usize;
        // SAFETY: the size goes to our stack.
        self.call(&"terramech_getArraySize", |_, c| unsafe { size_of(c, reference, &raw mut n) })?;
        if n > MOST_ELEMENTS {
            let text = format!("array {reference} is said to have {n} elements; at most {MOST_ELEMENTS} are taken");
            return Err(self.refused("terramech_getArraySize", Status::Nonsense, text));
        }
        values.resize(n, T::default());
        // SAFETY: the buffer has n elements.
        self.call(name, |_, c| unsafe { get(c, reference, values.as_mut_ptr(), n) })
    }

    /// Sets all of `sets`, by one call per type.
    ///
    /// # Errors
    /// [`CallError`].
    pub fn set(&mut self, sets: &Sets) -> Result<(), CallError> {
        macro_rules! scalars {
            ($list:expr, $call:literal, $function:ident) => {
                let (references, values) = &$list;
                if !references.is_empty() {
                    debug_assert_eq!(references.len(), values.len());
                    // SAFETY: both arrays have as many elements as the call is told.
                    self.call(&$call, |f, c| unsafe {
                        (f.$function)(c, references.as_ptr(), references.len(), values.as_ptr())
                    })?;
                }
            };
        }
        scalars!(sets.reals, "fmi2SetReal", set_real);
        scalars!(sets.integers, "fmi2SetInteger", set_integer);
        scalars!(sets.booleans, "fmi2SetBoolean", set_boolean);
        let (references, values) = &sets.strings;
        if !references.is_empty() {
            let texts: Vec<CString> =
                values.iter().map(|v| CString::new(v.replace('\0', " ")).unwrap_or_default()).collect();
            let pointers: Vec<Fmi2String> = texts.iter().map(|t| t.as_ptr()).collect();
            // SAFETY: both arrays have as many elements as the call is told; the texts live through it.
            self.call(&"fmi2SetString", |f, c| unsafe {
                (f.set_string)(c, references.as_ptr(), references.len(), pointers.as_ptr())
            })?;
        }
        let (references, orders, values) = &sets.derivatives;
        if let (Some(set), false) = (self.functions.set_input_derivatives, references.is_empty()) {
            debug_assert!(references.len() == orders.len() && references.len() == values.len());
            // SAFETY: the arrays have as many elements as the call is told.
            self.call(&"fmi2SetRealInputDerivatives", |_, c| unsafe {
                set(c, references.as_ptr(), references.len(), orders.as_ptr(), values.as_ptr())
            })?;
        }
        Ok(())
    }

    /// Whether derivatives of inputs can be set, as far as the library tells.
    pub fn takes_derivatives(&self) -> bool {
        self.functions.set_input_derivatives.is_some()
    }

    /// Sets reals by one call; both slices are equally long.
    ///
    /// # Errors
    /// [`CallError`].
    #[inline]
    pub fn set_reals(&mut self, references: &[u32], values: &[f64]) -> Result<(), Box<CallError>> {
        let n = references.len().min(values.len());
        if n == 0 {
            return Ok(());
        }
        // SAFETY: both arrays have at least as many elements as the call is told.
        self.quick(&"fmi2SetReal", |f, c| unsafe { (f.set_real)(c, references.as_ptr(), n, values.as_ptr()) })
    }

    /// Reads reals by one call.
    ///
    /// # Errors
    /// [`CallError`].
    #[inline]
    pub fn read_reals(&mut self, batch: &mut Batch<f64>) -> Result<(), Box<CallError>> {
        let n = batch.references.len().min(batch.values.len());
        // SAFETY: both arrays have at least as many elements as the call is told.
        self.quick(&"fmi2GetReal", |f, c| unsafe {
            (f.get_real)(c, batch.references.as_ptr(), n, batch.values.as_mut_ptr())
        })
    }

    /// [`Instance::call`] with an error of one pointer, which costs nothing to hand back where there is none.
    #[inline]
    fn quick(
        &mut self,
        name: Name,
        f: impl FnOnce(&Functions, Fmi2Component) -> Fmi2Status,
    ) -> Result<(), Box<CallError>> {
        if !self.is_alive() {
            return Err(Box::new(self.refused(name, Status::NotCalled, String::new())));
        }
        self.calls = self.calls.wrapping_add(1);
        self.pulse.begin(name, self.calls);
        let code = f(&self.functions, self.component.as_ptr());
        self.pulse.end(self.calls);
        if code == FMI2_OK { Ok(()) } else { self.judge_boxed(name, code) }
    }

    #[cold]
    fn judge_boxed(&mut self, name: Name, code: Fmi2Status) -> Result<(), Box<CallError>> {
        self.judge(name, code).map_err(Box::new)
    }

    /// Sets an array of reals; its size becomes that of `values`.
    ///
    /// # Errors
    /// [`CallError`].
    pub fn set_real_array(&mut self, reference: u32, values: &[f64]) -> Result<(), CallError> {
        let Some(set) = self.library.functions.set_real_array else {
            return Err(self.refused("terramech_setRealArray", Status::Missing, String::new()));
        };
        // SAFETY: pointer and length belong together.
        self.call(&"terramech_setRealArray", |_, c| unsafe { set(c, reference, values.as_ptr(), values.len()) })
    }

    /// Sets an array of integers; its size becomes that of `values`.
    ///
    /// # Errors
    /// [`CallError`].
    pub fn set_integer_array(&mut self, reference: u32, values: &[i32]) -> Result<(), CallError> {
        let Some(set) = self.library.functions.set_integer_array else {
            return Err(self.refused("terramech_setIntegerArray", Status::Missing, String::new()));
        };
        // SAFETY: pointer and length belong together.
        self.call(&"terramech_setIntegerArray", |_, c| unsafe { set(c, reference, values.as_ptr(), values.len()) })
    }

    /// One call into the unit: all calls but instantiate and free pass here.
    #[inline]
    pub(super) fn call(
        &mut self,
        name: Name,
        f: impl FnOnce(&Functions, Fmi2Component) -> Fmi2Status,
    ) -> Result<(), CallError> {
        if !self.is_alive() {
            return Err(self.refused(name, Status::NotCalled, String::new()));
        }
        self.calls = self.calls.wrapping_add(1);
        self.pulse.begin(name, self.calls);
        let code = f(&self.functions, self.component.as_ptr());
        self.pulse.end(self.calls);
        if code == FMI2_OK { Ok(()) } else { self.judge(name, code) }
    }

    /// A status other than fmi2OK.
    #[cold]
    fn judge(&mut self, name: Name, code: Fmi2Status) -> Result<(), CallError> {
        let Some(status) = Status::of(code) else { return Ok(()) };
        match status {
            Status::Fatal => self.library.condemn(),
            // After a discarded call the instance may still be asked how far it came.
            Status::Discard => {}
            _ => self.alive = false,
        }
        let (said, cause) = self.ear.said(name);
        Err(CallError { unit: self.ear.unit.clone(), call: name, status, said, cause })
    }

    pub(super) fn refused(&self, call: &'static str, status: Status, text: String) -> CallError {
        let said = if text.is_empty() { Vec::new() } else { vec![text] };
        CallError { unit: self.ear.unit.clone(), call, status, said, cause: Cause::Unknown }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // After fmi2Fatal the library may be in any state: its memory is left to the end of the process.
        if !self.library.is_condemned() {
            self.forget();
            // SAFETY: made by fmi2Instantiate, freed once, not used again; ear and callbacks are dropped after this.
            unsafe { (self.library.functions.free_instance)(self.component.as_ptr()) };
        }
    }
}

impl std::fmt::Debug for Instance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Instance").field("name", &self.name()).field("library", &self.library.path()).finish()
    }
}

/// `file:///...` of a folder. Escapes what a URI may not hold and nothing else, since some units do not undo escapes.
fn file_uri(folder: &Path) -> String {
    let absolute = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    let mut uri = String::from("file://");
    for &byte in absolute.to_string_lossy().as_bytes() {
        if byte.is_ascii_alphanumeric() || b"/-_.~!$&'()*+,;=:@".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            uri.push_str(&format!("%{byte:02X}"));
        }
    }
    uri
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_with_odd_letters_becomes_a_uri() {
        assert_eq!(file_uri(Path::new("/tmp/a b/ü%")), "file:///tmp/a%20b/%C3%BC%25");
    }
}
