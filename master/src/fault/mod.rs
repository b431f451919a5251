//! What is wrong with what the user gave: every fault with its file, line and element, the value given and what is allowed.
//!
//! Readers and checks do not stop at the first fault: they put each into a [`Faults`] list and go on with what is still
//! sound, so that a user sees all mistakes of a description at once. Things that are odd but do not stop a run are *notes*.

mod kind;

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use kind::FaultKind;
use serde::{Serialize, Serializer};

/// How many faults a list keeps; further ones are counted only, so that a hostile file cannot fill the memory.
const KEPT: usize = 500;

/// A place in a file. Cheap to clone: the path is shared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file as the user knows it (an entry of an archive is `archive.fmu/entry`).
    pub file: Arc<Path>,
    /// Line, counted from 1; 0 where the fault concerns the whole file.
    pub line: u32,
}

impl Place {
    /// The whole of a file.
    pub fn file(path: impl AsRef<Path>) -> Self {
        Self { file: Arc::from(path.as_ref()), line: 0 }
    }

    /// A line of the same file.
    pub fn at(&self, line: u32) -> Self {
        Self { file: Arc::clone(&self.file), line }
    }
}

impl Default for Place {
    fn default() -> Self {
        Self::file("")
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.line == 0 {
            write!(f, "{}", self.file.display())
        } else {
            write!(f, "{}:{}", self.file.display(), self.line)
        }
    }
}

impl Serialize for Place {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// One fault (or note): where, which element, what.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// File and line.
    pub place: Place,
    /// The element in the words of the file, such as `Connection tire.force.x -> rig.force.x`; empty for the whole file.
    pub element: String,
    /// What is wrong, with the values. Boxed, so that results that can hold a fault stay small.
    pub kind: Box<FaultKind>,
}

impl Fault {
    /// A fault at a place; `element` may be empty.
    pub fn new(place: Place, element: impl Into<String>, kind: FaultKind) -> Self {
        Self { place, element: element.into(), kind: Box::new(kind) }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.place)?;
        if !self.element.is_empty() {
            write!(f, "{}: ", self.element)?;
        }
        write!(f, "{}", self.kind)
    }
}

impl std::error::Error for Fault {}

impl Serialize for Fault {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// The collected faults and notes of one command.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    faults: Vec<Fault>,
    notes: Vec<Fault>,
    not_kept: usize,
    /// Said before all faults.
    lead: Option<String>,
}

impl Faults {
    /// An empty list.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a fault.
    pub fn add(&mut self, place: &Place, element: impl Into<String>, kind: FaultKind) {
        self.push(Fault::new(place.clone(), element, kind));
    }

    /// Adds a fault that was made elsewhere.
    pub fn push(&mut self, fault: Fault) {
        if self.faults.len() < KEPT { self.faults.push(fault) } else { self.not_kept += 1 }
    }

    /// Adds what was found elsewhere; `user` says which element of the description led there.
    pub fn take_over(&mut self, other: Self, user: &str) {
        let with_user = |mut fault: Fault| {
            fault.element =
                if fault.element.is_empty() { user.to_owned() } else { format!("{user}: {}", fault.element) };
            fault
        };
        for fault in other.faults {
            self.push(with_user(fault));
        }
        self.not_kept += other.not_kept;
        // Remarks concern the file itself, whoever uses it.
        self.notes.extend(other.notes.into_iter().take(KEPT.saturating_sub(self.notes.len())));
    }

    /// Adds a remark that does not stop a run.
    pub fn note(&mut self, place: &Place, element: impl Into<String>, text: impl Into<String>) {
        if self.notes.len() < KEPT {
            self.notes.push(Fault::new(place.clone(), element, FaultKind::Note(text.into())));
        }
    }

    /// Says something before all faults: what they may have in common.
    pub fn lead_with(&mut self, text: String) {
        self.lead = Some(match self.lead.take() {
            Some(before) => format!("{before}\n{text}"),
            None => text,
        });
    }

    /// Whether nothing is wrong (notes do not count).
    pub fn is_empty(&self) -> bool {
        self.faults.is_empty()
    }

    /// How many faults there are, those not kept included.
    pub fn len(&self) -> usize {
        self.faults.len() + self.not_kept
    }

    /// The faults, in the order found.
    pub fn faults(&self) -> &[Fault] {
        &self.faults
    }

    /// The notes, in the order found.
    pub fn notes(&self) -> &[Fault] {
        &self.notes
    }

    /// Takes the notes out.
    pub fn take_notes(&mut self) -> Vec<Fault> {
        std::mem::take(&mut self.notes)
    }

    /// `Ok` with a value if nothing is wrong, else the list.
    pub fn check<T>(self, value: T) -> Result<T, Faults> {
        if self.is_empty() { Ok(value) } else { Err(self) }
    }

    /// The command's exit code: 1 where the input is wrong, 4 where the machine alone is to blame.
    pub fn exit_code(&self) -> u8 {
        let machine = |fault: &Fault| matches!(*fault.kind, FaultKind::Environment { .. });
        if !self.faults.is_empty() && self.faults.iter().all(machine) { 4 } else { 1 }
    }
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(lead) = &self.lead {
            writeln!(f, "{lead}")?;
        }
        for (i, fault) in self.faults.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{fault}")?;
        }
        if self.not_kept > 0 {
            write!(f, "\n... and {} more", self.not_kept)?;
        }
        Ok(())
    }
}

impl std::error::Error for Faults {}

impl From<Fault> for Faults {
    fn from(fault: Fault) -> Self {
        let mut faults = Self::new();
        faults.push(fault);
        faults
    }
}

/// A fault about a whole file.
pub(crate) fn of_file(path: &Path, kind: FaultKind) -> Fault {
    Fault::new(Place::file(path), "", kind)
}

/// A path for messages and manifests: as given, without a leading `./`.
pub(crate) fn shown(path: &Path) -> PathBuf {
    path.strip_prefix("./").unwrap_or(path).to_path_buf()
}
