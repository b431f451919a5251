//! The team that a host hands over as a table of C (`terramech_setTeam`), as a unit sees it.

use std::ffi::c_void;

use crate::types::TeamTable;
use crate::unit::{Team, UnitError};

/// The team of a table.
pub struct HostTeam(pub TeamTable);

// SAFETY: the table is used inside calls of its instance alone, which come from one thread at a time (the extension's contract).
unsafe impl Send for HostTeam {}

unsafe extern "C" fn deliver(receiver: *mut c_void, k: usize, bytes: *const u8, size: usize) {
    // SAFETY: `HostTeam::round` hands over its list, which lives through the round.
    let Some(into) = (unsafe { receiver.cast::<Vec<Vec<u8>>>().as_mut() }) else { return };
    if let Some(message) = into.get_mut(k)
        && size > 0
    {
        // SAFETY: so many bytes are there (the extension's contract).
        message.extend_from_slice(unsafe { std::slice::from_raw_parts(bytes, size) });
    }
}

impl Team for HostTeam {
    fn index(&self) -> usize {
        self.0.index
    }

    fn size(&self) -> usize {
        self.0.size
    }

    fn round(&mut self, out: &[(usize, Vec<u8>)], from: &[usize]) -> Result<Vec<Vec<u8>>, UnitError> {
        let to: Vec<usize> = out.iter().map(|m| m.0).collect();
        let bytes: Vec<*const u8> = out.iter().map(|m| m.1.as_ptr()).collect();
        let sizes: Vec<usize> = out.iter().map(|m| m.1.len()).collect();
        let mut came = vec![Vec::new(); from.len()];
        let TeamTable { env, round, .. } = self.0;
        let (n_in, receiver) = (from.len(), std::ptr::from_mut(&mut came).cast());
        // SAFETY: the table is valid as long as the instance; the lists have the lengths that are told.
        let status = unsafe {
            round(env, out.len(), to.as_ptr(), bytes.as_ptr(), sizes.as_ptr(), n_in, from.as_ptr(), deliver, receiver)
        };
        if status == 0 { Ok(came) } else { Err(UnitError::environment("the members of the team have lost each other")) }
    }
}
