//! What can go wrong while a run's files are written or read, with the path and the cause.

use std::io;
use std::path::{Path, PathBuf};

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// A failure to write or read what a run leaves.
///
/// [`Error::is_users_mistake`] tells a wrong choice of folder or content from a failing disk.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused (disk full, no permission, ...).
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was tried, as a verb: "write", "create", ...
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// The output folder exists, is not empty and holds no earlier run.
    #[error(
        "output folder {} is not empty and holds no earlier terramech run (it contains {example:?}); choose a new or empty folder",
        path.display()
    )]
    FolderNotOurs {
        /// The folder given.
        path: PathBuf,
        /// One of the entries found in it.
        example: String,
    },
    /// The output path is taken by something that is not a folder.
    #[error("output folder {} is taken by something that is not a folder", path.display())]
    NotAFolder {
        /// The path given.
        path: PathBuf,
    },
    /// Another process is writing a run into this folder.
    #[error("output folder {} is in use by another run", path.display())]
    FolderInUse {
        /// The folder given.
        path: PathBuf,
    },
    /// A file that a run would write exists and was not written by a run.
    #[error("{} exists and was not written by an earlier run; move it away or choose another output folder", path.display())]
    ForeignFile {
        /// The file in the way.
        path: PathBuf,
    },
    /// A name inside the run folder that is absolute, climbs out of the folder or cannot be listed.
    #[error("{given:?} is no name for a file of a run: it must be relative, without '..', '.' or line breaks")]
    BadName {
        /// The name given.
        given: String,
    },
    /// A CSV row does not fit its header.
    #[error("{}: row at time {time}: {reason}", path.display())]
    Row {
        /// The CSV file.
        path: PathBuf,
        /// The row's time (s).
        time: f64,
        /// What does not fit.
        reason: String,
    },
    /// A CSV file that cannot be read.
    #[error("{}: line {line}: {reason}", path.display())]
    Csv {
        /// The CSV file.
        path: PathBuf,
        /// Line number, counted from 1.
        line: usize,
        /// What is wrong there.
        reason: String,
    },
    /// A JSON file that cannot be written or read.
    #[error("{}: {source}", path.display())]
    Json {
        /// The JSON file.
        path: PathBuf,
        /// What is wrong there.
        source: serde_json::Error,
    },
    /// Arrays handed to a writer do not fit each other.
    #[error("{what}: {given} values given, {expected} expected")]
    Length {
        /// Which array of which data set.
        what: String,
        /// Its length.
        given: usize,
        /// The length the other arrays ask for.
        expected: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("{what}: triangle {triangle} names vertex {vertex}, there are {count} (counted from 0)")]
    Vertex {
        /// Which data set.
        what: String,
        /// Index of the triangle.
        triangle: usize,
        /// The index it names.
        vertex: i64,
        /// Number of vertices.
        count: usize,
    },
}

impl Error {
    /// True when the user chose a wrong folder or handed over content that does not fit; false when the system failed.
    pub fn is_users_mistake(&self) -> bool {
        !matches!(self, Error::Io { .. })
    }

    pub(crate) fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Error {
        let path = path.to_owned();
        move |source| Error::Io { action, path, source }
    }

    pub(crate) fn length(what: impl Into<String>, given: usize, expected: usize) -> Result<()> {
        if given == expected { Ok(()) } else { Err(Error::Length { what: what.into(), given, expected }) }
    }
}
