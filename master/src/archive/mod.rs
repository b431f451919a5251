//! Opening `.fmu` and `.ssp` archives (zip) that nobody vouches for.
//!
//! [`open`] unpacks an archive into a temporary folder, or takes a folder that is unpacked already. Nothing is written
//! until all names and declared sizes have passed; while inflating, the bytes that really come out are counted again,
//! since a header can say anything. Whatever fails, the temporary folder is removed; one of a process that was killed
//! goes when the next one starts.

mod names;
mod temporary;
mod unpack;

use std::path::{Path, PathBuf};

use crate::fault::Fault;
use temporary::Temporary;

/// Limits of one archive. The defaults are above any honest FMU and bound time, memory and disk of a hostile one.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Entries, folders included.
    pub entries: usize,
    /// Bytes of all entries, unpacked.
    pub total: u64,
    /// Bytes of one entry, unpacked.
    pub entry: u64,
    /// Unpacked bytes per packed byte, for entries above 1 MiB (deflate itself ends near 1030).
    pub ratio: u64,
    /// Folders in a path.
    pub depth: usize,
    /// Bytes of a path.
    pub path: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self { entries: 20_000, total: 8 << 30, entry: 4 << 30, ratio: 500, depth: 24, path: 1024 }
    }
}

/// An archive's files in a folder. A temporary folder is removed when this is dropped.
#[derive(Debug)]
pub struct Unpacked {
    source: PathBuf,
    folder: PathBuf,
    sha256: Option<String>,
    _temporary: Option<Temporary>,
}

impl Unpacked {
    /// A folder that is unpacked already; nothing is looked at.
    pub fn folder_as_is(path: &Path) -> Self {
        Self { source: path.to_path_buf(), folder: path.to_path_buf(), sha256: None, _temporary: None }
    }

    /// The archive or folder that was opened.
    pub fn source(&self) -> &Path {
        &self.source
    }

    /// The folder with the files.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// SHA-256 of the archive, lower-case hexadecimal; `None` for a folder.
    pub fn sha256(&self) -> Option<&str> {
        self.sha256.as_deref()
    }

    /// The name of a file inside, for messages: `archive.fmu/modelDescription.xml`.
    pub fn shown(&self, inside: &str) -> PathBuf {
        crate::fault::shown(&self.source).join(inside)
    }
}

/// Opens an archive or an unpacked folder with the default [`Limits`].
///
/// # Errors
/// One fault that names the archive and, where one is to blame, the entry.
pub fn open(path: &Path) -> Result<Unpacked, Fault> {
    open_within(path, Limits::default())
}

/// [`open`] with other limits.
///
/// # Errors
/// As [`open`].
pub fn open_within(path: &Path, limits: Limits) -> Result<Unpacked, Fault> {
    if path.is_dir() { Ok(Unpacked::folder_as_is(path)) } else { unpack::unpack(path, limits) }
}

pub use temporary::remove_all as remove_temporaries;
pub use unpack::sha256_of_file;

#[cfg(test)]
mod tests;
