//! States of an instance: kept for a way back, or as bytes for a checkpoint.

use terramech_fmi2::types::*;

use super::pulse::Name;
use super::{CallError, Instance, Status};

/// Largest state we take (bytes): beyond it the size is a fault of the unit.
const MOST_BYTES: usize = 1 << 40;

impl Instance {
    /// Keeps the present state, replacing what was kept before (`fmi2GetFMUstate`).
    ///
    /// # Errors
    /// [`CallError`].
    pub fn keep(&mut self) -> Result<(), CallError> {
        let name = &"fmi2GetFMUstate";
        let Some(get) = self.library.functions.get_state else { return Err(self.missing(name)) };
        let mut state = self.kept;
        // SAFETY: null, or a state of this instance, which the unit overwrites.
        let result = self.call(name, |_, c| unsafe { get(c, &raw mut state) });
        self.kept = state;
        result
    }

    /// Lets an instance that has failed take [`Instance::go_back`]; our units go on from a restored state.
    pub fn revive(&mut self) {
        self.alive = true;
    }

    /// Goes back to the kept state, as often as wanted (`fmi2SetFMUstate`). Also after a discarded step.
    ///
    /// # Errors
    /// [`CallError`].
    pub fn go_back(&mut self) -> Result<(), CallError> {
        let name = &"fmi2SetFMUstate";
        let (Some(set), false) = (self.library.functions.set_state, self.kept.is_null()) else {
            return Err(self.missing(name));
        };
        let state = self.kept;
        // SAFETY: a state of this instance, not freed.
        self.call(name, |_, c| unsafe { set(c, state) })
    }

    /// Frees the kept state.
    pub fn forget(&mut self) {
        if !self.kept.is_null() {
            self.free_state(self.kept);
            self.kept = std::ptr::null_mut();
        }
    }

    /// The present state as bytes.
    ///
    /// # Errors
    /// [`CallError`]; [`Status::Missing`] where the library has no such functions.
    pub fn save(&mut self) -> Result<Vec<u8>, CallError> {
        let f = self.library.functions;
        let (Some(get), Some(size_of), Some(serialize)) = (f.get_state, f.state_size, f.serialize_state) else {
            return Err(self.missing(&"fmi2SerializeFMUstate"));
        };
        let mut state: Fmi2FmuState = std::ptr::null_mut();
        // SAFETY: null asks for a new state.
        self.call(&"fmi2GetFMUstate", |_, c| unsafe { get(c, &raw mut state) })?;
        let mut bytes = Vec::new();
        let mut size = 0_usize;
        // SAFETY: the state was made above; the size goes to our stack.
        let mut result = self.call(&"fmi2SerializedFMUstateSize", |_, c| unsafe { size_of(c, state, &raw mut size) });
        if result.is_ok() && size > MOST_BYTES {
            let text = format!("its state is said to take {size} bytes; at most {MOST_BYTES} are taken");
            result = Err(self.refused("fmi2SerializedFMUstateSize", Status::Nonsense, text));
        }
        if result.is_ok() {
            bytes.resize(size, 0_u8);
            // SAFETY: the buffer has as many bytes as the call is told; the state was made above.
            result = self
                .call(&"fmi2SerializeFMUstate", |_, c| unsafe { serialize(c, state, bytes.as_mut_ptr().cast(), size) });
        }
        self.free_state(state);
        result.map(|()| bytes)
    }

    /// Takes a state from bytes, also on a fresh instance; it then runs.
    ///
    /// # Errors
    /// [`CallError`].
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), CallError> {
        let f = self.library.functions;
        let (Some(set), Some(deserialize)) = (f.set_state, f.deserialize_state) else {
            return Err(self.missing(&"fmi2DeSerializeFMUstate"));
        };
        let mut state: Fmi2FmuState = std::ptr::null_mut();
        // SAFETY: pointer and length belong together; null asks for a new state.
        self.call(&"fmi2DeSerializeFMUstate", |_, c| unsafe {
            deserialize(c, bytes.as_ptr().cast(), bytes.len(), &raw mut state)
        })?;
        // SAFETY: the state was made above.
        let result = self.call(&"fmi2SetFMUstate", |_, c| unsafe { set(c, state) });
        self.free_state(state);
        result?;
        self.running = true;
        Ok(())
    }

    fn free_state(&mut self, mut state: Fmi2FmuState) {
        // An instance that has failed frees its states with itself.
        if let (Some(free), true, false) = (self.library.functions.free_state, self.is_alive(), state.is_null()) {
            // SAFETY: a state of this instance, freed once: our copy of the pointer is dropped.
            let _ = self.call(&"fmi2FreeFMUstate", |_, c| unsafe { free(c, &raw mut state) });
        }
    }

    fn missing(&self, call: Name) -> CallError {
        self.refused(call, Status::Missing, String::new())
    }
}
