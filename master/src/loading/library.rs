//! The shared library of an FMU.

use std::ffi::CStr;
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use libloading::os::unix::{Library as Handle, RTLD_LOCAL, RTLD_NOW};

use super::LoadError;
use super::functions::Functions;

/// An opened library with its function table. Cheap to share; every instance holds a clone.
///
/// A library stays mapped until the process ends: a unit's worker threads end on their own time after
/// `fmi2FreeInstance` (rayon's pools do), and unmapping the code they return through would crash the run at its very end.
#[derive(Debug)]
pub struct Library {
    path: PathBuf,
    pub(super) functions: Functions,
    /// Set by `fmi2Fatal`: nothing of this library may be called any more.
    condemned: AtomicBool,
    _handle: ManuallyDrop<Handle>,
}

impl Library {
    /// Opens a library and resolves its functions.
    ///
    /// Opening runs the library's initialisers: this is where foreign code first runs, so the caller has checked that the
    /// file is what the user meant to run.
    ///
    /// # Errors
    /// [`LoadError::Image`], [`LoadError::Open`], [`LoadError::Symbol`], [`LoadError::Platform`].
    pub fn open(path: &Path) -> Result<Arc<Self>, LoadError> {
        super::whole(path).map_err(|reason| LoadError::Image { path: path.to_owned(), reason })?;
        // RTLD_LOCAL keeps one unit's fmi2DoStep from answering for another's; RTLD_NOW tells of a missing
        // dependency here instead of in the middle of a run.
        // SAFETY: running a unit's code is what the user asked for; nothing else is assumed of its initialisers.
        let handle = unsafe { Handle::open(Some(path), RTLD_NOW | RTLD_LOCAL) }
            .map_err(|e| LoadError::Open { path: path.to_owned(), reason: reason(&e) })?;
        // SAFETY: the model description of the FMU declares FMI 2.0 for co-simulation.
        let functions = unsafe { Functions::resolve(&handle) }
            .map_err(|symbol| LoadError::Symbol { path: path.to_owned(), symbol })?;
        let library = Self {
            path: path.to_owned(),
            functions,
            condemned: AtomicBool::new(false),
            _handle: ManuallyDrop::new(handle),
        };
        // SAFETY: both functions take nothing and return a constant zero-terminated text.
        let answers = unsafe {
            [
                ("fmi2GetTypesPlatform", functions.get_types_platform.map(|f| f()), "default"),
                ("fmi2GetVersion", functions.get_version.map(|f| f()), "2.0"),
            ]
        };
        for (function, answer, allowed) in answers {
            let Some(answer) = answer.filter(|p| !p.is_null()) else { continue };
            // SAFETY: not null, zero-terminated by the standard.
            let given = unsafe { CStr::from_ptr(answer) }.to_string_lossy();
            if given != allowed {
                return Err(LoadError::Platform {
                    path: path.to_owned(),
                    function,
                    given: given.into_owned(),
                    allowed,
                });
            }
        }
        Ok(Arc::new(library))
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the library has our array functions.
    pub fn has_arrays(&self) -> bool {
        self.functions.get_array_size.is_some()
    }

    /// Whether `fmi2Fatal` has condemned all instances.
    pub(super) fn is_condemned(&self) -> bool {
        self.condemned.load(Ordering::Acquire)
    }

    pub(super) fn condemn(&self) {
        self.condemned.store(true, Ordering::Release);
    }
}

/// The linker's words: libloading shows its own and keeps them in the source.
fn reason(error: &libloading::Error) -> String {
    use std::error::Error;
    error.source().map_or_else(|| error.to_string(), ToString::to_string)
}
