//! What is wrong with what the user gave: every fault with its file, line and element, the value given and what is allowed.
//!
//! Readers and checks do not stop at the first fault: they put each into a [`Faults`] list and go on with what is still
//! sound, so that a user sees all mistakes of a description at once. Things that are odd but do not stop a run are *notes*.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

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
    /// What is wrong, with the values.
    pub kind: FaultKind,
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

/// What can be wrong. The variants carry the values, the texts say what is allowed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FaultKind {
    /// A file or folder cannot be read.
    #[error("cannot be read: {reason}")]
    Unreadable {
        /// What the system said.
        reason: String,
    },
    /// The machine, not the input: no space for the temporary folder, no permission to write it.
    #[error("the machine does not let us work: {reason}")]
    Environment {
        /// What the system said.
        reason: String,
    },
    /// An archive that is cut, damaged or made to harm.
    #[error("archive refused{}: {reason}", entry.as_ref().map(|e| format!(", entry \"{e}\"")).unwrap_or_default())]
    Archive {
        /// The entry, where one is to blame.
        entry: Option<String>,
        /// Why.
        reason: String,
    },
    /// The text is not well-formed XML in an encoding we read.
    #[error("not well-formed XML: {reason}")]
    Xml {
        /// What the parser said.
        reason: String,
    },
    /// A document type definition, the door to entity expansion.
    #[error("a document type definition (DOCTYPE) is refused: it could expand entities without bound; remove it")]
    Doctype,
    /// A limit of size, depth or count.
    #[error("too much: {given} {what}, at most {allowed} are read")]
    TooMuch {
        /// What was counted.
        what: &'static str,
        /// How many there are (at least).
        given: u64,
        /// The limit.
        allowed: u64,
    },
    /// The root element is another than the file must have.
    #[error("the root element is \"{given}\", not \"{allowed}\"")]
    WrongRoot {
        /// Its local name.
        given: String,
        /// What it must be.
        allowed: &'static str,
    },
    /// A child element that must be there is not.
    #[error("has no element \"{name}\"")]
    MissingElement {
        /// Its local name.
        name: &'static str,
    },
    /// An attribute that must be there is not.
    #[error("has no attribute \"{name}\"")]
    MissingAttribute {
        /// Its name.
        name: &'static str,
    },
    /// A value that cannot be read or is not allowed.
    #[error("{what}=\"{given}\" is not allowed; allowed: {allowed}")]
    BadValue {
        /// Attribute or quantity.
        what: String,
        /// The text given.
        given: String,
        /// What is allowed, in words.
        allowed: String,
    },
    /// Two things of one name.
    #[error("{what} \"{name}\" is there twice (first at line {first})")]
    Duplicate {
        /// What it is.
        what: &'static str,
        /// The name.
        name: String,
        /// Line of the first.
        first: u32,
    },
    /// A version of a standard that we do not read.
    #[error("version \"{given}\" is not supported; allowed: {allowed}")]
    WrongVersion {
        /// What the file says.
        given: String,
        /// What we read.
        allowed: &'static str,
    },
    /// The FMU offers model exchange, not co-simulation.
    #[error("the FMU offers {given}, no co-simulation; export it again as an FMI 2.0 co-simulation FMU")]
    NoCoSimulation {
        /// What it offers.
        given: &'static str,
    },
    /// The FMU holds no library for this machine.
    #[error("the FMU holds no library for this machine: needed {needed}; it has {given}")]
    WrongPlatform {
        /// The file it must hold.
        needed: String,
        /// The platforms it has.
        given: String,
    },
    /// A source that leads to no file.
    #[error("no such {what}: \"{source_uri}\"; looked for {searched}")]
    NotFound {
        /// FMU, parameter set, ...
        what: &'static str,
        /// As the description gives it.
        source_uri: String,
        /// The paths tried.
        searched: String,
    },
    /// A component that the system does not have.
    #[error("there is no component \"{given}\"{}", did_you_mean(.close))]
    UnknownComponent {
        /// The name given.
        given: String,
        /// Names that look alike.
        close: Vec<String>,
    },
    /// A connector that the element does not declare.
    #[error("\"{element}\" has no connector \"{given}\"{}", did_you_mean(.close))]
    UnknownConnector {
        /// Component or system.
        element: String,
        /// The name given.
        given: String,
        /// Names that look alike.
        close: Vec<String>,
    },
    /// A variable that the unit does not have.
    #[error("\"{component}\" (model {model}) has no variable \"{given}\"{}", did_you_mean(.close))]
    UnknownVariable {
        /// The component.
        component: String,
        /// Its model's name.
        model: String,
        /// The name given.
        given: String,
        /// Names that look alike.
        close: Vec<String>,
    },
    /// Two connections to one input.
    #[error(
        "\"{target}\" is fed twice: by \"{first}\" (line {first_line}) and by \"{second}\"; an input takes one connection"
    )]
    DoubledInput {
        /// The input.
        target: String,
        /// First source.
        first: String,
        /// Its line.
        first_line: u32,
        /// Second source.
        second: String,
    },
    /// Units of different dimension.
    #[error(
        "units do not match: \"{from}\" is in {from_unit}, \"{to}\" in {to_unit}; connect the same physical quantity, or set suppressUnitConversion=\"true\" if that is meant"
    )]
    UnitMismatch {
        /// The source.
        from: String,
        /// Its unit and dimension.
        from_unit: String,
        /// The target.
        to: String,
        /// Its unit and dimension.
        to_unit: String,
    },
    /// A connection that needs a conversion we cannot do.
    #[error("types do not match: \"{from}\" is {from_type}, \"{to}\" is {to_type}")]
    TypeMismatch {
        /// The source.
        from: String,
        /// Its type.
        from_type: String,
        /// The target.
        to: String,
        /// Its type.
        to_type: String,
    },
    /// A variable used as what it is not.
    #[error("\"{variable}\" has causality {given}; allowed here: {allowed}")]
    CausalityMismatch {
        /// The variable.
        variable: String,
        /// Its causality.
        given: String,
        /// What this place takes.
        allowed: &'static str,
    },
    /// A connection whose ends both give or both take.
    #[error(
        "\"{first}\" and \"{second}\" are both {both}; a connection leads from an output (or calculatedParameter) to an input (or parameter)"
    )]
    SameDirection {
        /// One end.
        first: String,
        /// The other end.
        second: String,
        /// "sources" or "targets".
        both: &'static str,
    },
    /// An array where a scalar must be, or the other way round.
    #[error("\"{variable}\" is {given}, but {needed} is needed here")]
    ArrayAgainstScalar {
        /// The variable.
        variable: String,
        /// "an array" or "a scalar".
        given: &'static str,
        /// "a scalar" or "an array".
        needed: &'static str,
    },
    /// A loop of initial dependencies.
    #[error("the initial values depend on themselves: {}", .path.join(" -> "))]
    Loop {
        /// The variables, `component.variable`; the last is the first again.
        path: Vec<String>,
    },
    /// A time that is not a whole number of base steps.
    #[error("{what} = {given} s is not a whole multiple of the base step {base} s; the nearest are {nearest} s")]
    NotAMultiple {
        /// Which time.
        what: String,
        /// Its value, s.
        given: String,
        /// The base step, s.
        base: String,
        /// Nearest multiples, s.
        nearest: String,
    },
    /// A value outside min and max.
    #[error("\"{variable}\" = {given} is outside its range {range}")]
    OutOfRange {
        /// The variable.
        variable: String,
        /// The value.
        given: String,
        /// The range.
        range: String,
    },
    /// A value of the wrong kind for its variable.
    #[error("\"{variable}\" takes {allowed}, given was {given}")]
    WrongKind {
        /// The variable.
        variable: String,
        /// The value and its kind.
        given: String,
        /// The kind it takes.
        allowed: String,
    },
    /// An enumeration item that is not there.
    #[error("enumeration \"{enumeration}\" has no item \"{given}\"; it has {allowed}")]
    UnknownItem {
        /// The enumeration.
        enumeration: String,
        /// What was given.
        given: String,
        /// Its items.
        allowed: String,
    },
    /// Something the standard allows and this program does not do.
    #[error("{what} is not supported; {instead}")]
    Unsupported {
        /// What.
        what: String,
        /// What to do instead.
        instead: &'static str,
    },
    /// A remark; never stops a run.
    #[error("{0}")]
    Note(String),
}

/// The tail of an "unknown name" message.
fn did_you_mean(names: &[String]) -> String {
    match names {
        [] => String::new(),
        names => {
            format!("; did you mean {}?", names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(" or "))
        }
    }
}

/// The collected faults and notes of one command.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    faults: Vec<Fault>,
    notes: Vec<Fault>,
    not_kept: usize,
}

impl Faults {
    /// An empty list.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a fault.
    pub fn add(&mut self, place: &Place, element: impl Into<String>, kind: FaultKind) {
        self.push(Fault { place: place.clone(), element: element.into(), kind });
    }

    /// Adds a fault that was made elsewhere.
    pub fn push(&mut self, fault: Fault) {
        if self.faults.len() < KEPT { self.faults.push(fault) } else { self.not_kept += 1 }
    }

    /// Adds a remark that does not stop a run.
    pub fn note(&mut self, place: &Place, element: impl Into<String>, text: impl Into<String>) {
        if self.notes.len() < KEPT {
            self.notes.push(Fault {
                place: place.clone(),
                element: element.into(),
                kind: FaultKind::Note(text.into()),
            });
        }
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
        let machine = |fault: &Fault| matches!(fault.kind, FaultKind::Environment { .. });
        if !self.faults.is_empty() && self.faults.iter().all(machine) { 4 } else { 1 }
    }
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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
    Fault { place: Place::file(path), element: String::new(), kind }
}

/// A path for messages and manifests: as given, without a leading `./`.
pub(crate) fn shown(path: &Path) -> PathBuf {
    path.strip_prefix("./").unwrap_or(path).to_path_buf()
}
