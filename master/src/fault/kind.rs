//! The kinds of faults and their texts.

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
    /// An archive or folder that is no FMU.
    #[error("it holds no modelDescription.xml: it is no FMU, or was packed with a folder around it")]
    NoModelDescription,
    /// A folder or archive that holds no system description under the name that SSP gives it.
    #[error(
        "it holds no SystemStructure.ssd, the name that SSP gives a system inside a folder or archive; it holds {held}"
    )]
    NoDescription {
        /// What is there instead.
        held: String,
    },
    /// The library for this machine cannot be loaded.
    #[error("its library {library} cannot be loaded: {reason}")]
    BadLibrary {
        /// The file inside the FMU.
        library: String,
        /// What is wrong with it.
        reason: String,
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
    /// A value for a variable that a connection feeds.
    #[error(
        "\"{target}\" is fed by the connection from \"{source_name}\" ({place}), which would overwrite the value; remove one of the two"
    )]
    SetButConnected {
        /// The variable.
        target: String,
        /// The connection's source.
        source_name: String,
        /// Where the connection is written.
        place: String,
    },
    /// A variable that is set twice on the command line.
    #[error("\"{target}\" is set twice: to \"{first}\" and to \"{second}\"; give one value")]
    SetTwice {
        /// The variable.
        target: String,
        /// First value.
        first: String,
        /// Second value.
        second: String,
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
