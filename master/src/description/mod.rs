//! SSP system descriptions: read from `.ssd` files, `.ssp` archives and their `.ssv`/`.ssm` parts, flattened, and written.
//!
//! Nested systems are flattened while reading: components get dotted names, connections through system connectors lead from
//! component to component, and parameter bindings of all levels end as one value per variable with the standard's
//! precedence. So whoever works with a [`Description`] sees a flat system. What only this program has stands in annotations
//! of type `org.terramech`; their vocabulary lives in [`annotations`] alone.

pub mod algorithm;
pub mod annotations;
mod bind;
mod change;
mod flatten;
pub(crate) mod parameters;
mod raw;
mod read;
pub mod uri;
mod write;

use std::path::PathBuf;
use std::sync::Arc;

use crate::archive::Unpacked;
use crate::decimal::Decimal;
use crate::fault::Place;
use crate::model_description::Kind;
use crate::unit::{Linear, Unit};
use annotations::{ComponentExtras, SystemExtras};

pub use read::read;
pub use write::{Audience, write};

/// A flat system.
#[derive(Clone, Debug, Default)]
pub struct Description {
    /// Name of the system structure.
    pub name: String,
    /// The description file as the user knows it.
    pub place: Place,
    /// The folder against which relative paths are resolved.
    pub folder: PathBuf,
    /// The components, in file order.
    pub components: Vec<Component>,
    /// The connections, in file order.
    pub connections: Vec<Connection>,
    /// Units of the description file.
    pub units: Vec<Unit>,
    /// Enumerations of the description file: name, then items with values.
    pub enumerations: Vec<Enumeration>,
    /// Start time, s.
    pub start: Option<Decimal>,
    /// Stop time, s.
    pub stop: Option<Decimal>,
    /// Base communication step, s (`osp:FixedStepAlgorithm@baseStepSize`).
    pub base_step: Option<Decimal>,
    /// Whether one of these times is written but cannot be read, which is told already.
    pub times_are_bad: bool,
    /// Our annotations of the system.
    pub extras: SystemExtras,
    /// The files that were read, in order; inside an archive the archive stands for them.
    pub files: Vec<PathBuf>,
    /// Keeps an unpacked `.ssp` on disk while sources inside it are used.
    pub archive: Option<Arc<Unpacked>>,
}

/// A component: one FMU instance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Component {
    /// Name; dotted if it came from a nested system.
    pub name: String,
    /// `source`, a URI, as written.
    pub source: String,
    /// Declared connectors.
    pub connectors: Vec<Connector>,
    /// Values bound to variables, one per variable, precedence settled.
    pub values: Vec<Assignment>,
    /// `osp:StepSizeHint@value`, s.
    pub step_hint: Option<Decimal>,
    /// Our annotations.
    pub extras: ComponentExtras,
    /// Where it is written.
    pub place: Place,
}

/// A connector.
#[derive(Clone, Debug, PartialEq)]
pub struct Connector {
    /// Name, the variable's own.
    pub name: String,
    /// Direction.
    pub kind: ConnectorKind,
    /// Type, if written.
    pub value_type: Option<ConnectorType>,
    /// Where it is written.
    pub place: Place,
}

/// `kind` of a connector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // the names are the standard's
pub enum ConnectorKind {
    Input,
    Output,
    Parameter,
    CalculatedParameter,
    Inout,
}

impl ConnectorKind {
    /// The word in the file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Output => "output",
            Self::Parameter => "parameter",
            Self::CalculatedParameter => "calculatedParameter",
            Self::Inout => "inout",
        }
    }

    /// Reads a word.
    pub fn of(word: &str) -> Option<Self> {
        [Self::Input, Self::Output, Self::Parameter, Self::CalculatedParameter, Self::Inout]
            .into_iter()
            .find(|kind| kind.name() == word)
    }
}

/// Type of a connector.
#[derive(Clone, Debug, PartialEq)]
pub enum ConnectorType {
    /// Real with an optional unit name.
    Real(Option<String>),
    /// Integer, Boolean or String.
    Plain(Kind),
    /// Enumeration of that name.
    Enumeration(String),
    /// Binary, which FMI 2.0 does not have.
    Binary,
}

impl ConnectorType {
    /// The base type; `None` for binary.
    pub fn kind(&self) -> Option<Kind> {
        match self {
            Self::Real(_) => Some(Kind::Real),
            Self::Plain(kind) => Some(*kind),
            Self::Enumeration(_) => Some(Kind::Enumeration),
            Self::Binary => None,
        }
    }
}

/// A value given to a variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Assignment {
    /// Name of the variable in its component.
    pub variable: String,
    /// The value as given.
    pub value: Given,
    /// Its unit, if given.
    pub unit: Option<Unit>,
    /// A linear map of a parameter mapping, applied after unit conversion.
    pub linear: Option<Linear>,
    /// Whether no unit conversion is wanted.
    pub suppress_unit_conversion: bool,
    /// Whether a variable that does not exist is a fault: so for values written at the component itself. Parameter files
    /// may hold more than a system has (SSP 1.0, `ParameterBinding`: such values are ignored); those become a note.
    pub must_exist: bool,
    /// Where it is written.
    pub place: Place,
}

/// A value as written in a parameter set.
#[derive(Clone, Debug, PartialEq)]
pub enum Given {
    /// `Real`.
    Real(f64),
    /// `Integer`.
    Integer(i32),
    /// `Boolean`.
    Boolean(bool),
    /// `String`.
    String(String),
    /// `Enumeration`, by item name (or number).
    Item(String),
}

/// An enumeration of the description file.
#[derive(Clone, Debug, PartialEq)]
pub struct Enumeration {
    /// Name.
    pub name: String,
    /// Items: name and value.
    pub items: Vec<(String, i32)>,
}

/// A connection from component to component, in the direction of the data.
#[derive(Clone, Debug, PartialEq)]
pub struct Connection {
    /// Where the value comes from.
    pub from: End,
    /// Where it goes.
    pub to: End,
    /// What happens on the way.
    pub transformation: Option<Transformation>,
    /// Whether no unit conversion is wanted.
    pub suppress_unit_conversion: bool,
    /// Where it is written (the part that ends at `to`).
    pub place: Place,
}

/// One end of a connection.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct End {
    /// Index into [`Description::components`].
    pub component: usize,
    /// Name of the connector.
    pub connector: String,
}

/// A transformation of a connection or mapping.
#[derive(Clone, Debug, PartialEq)]
pub enum Transformation {
    /// `target = factor * source + offset`, after unit conversion.
    Linear(Linear),
    /// A table of Booleans (as 0 and 1).
    Booleans(Vec<(i32, i32)>),
    /// A table of integers.
    Integers(Vec<(i32, i32)>),
    /// A table of enumeration items, by name.
    Items(Vec<(String, String)>),
}

#[cfg(test)]
mod tests;
