//! `modelDescription.xml` of FMI 2.0 as typed data, looked up by name or value reference.
//!
//! [`read`] takes the text of the file and returns a [`ModelDescription`] or every fault it has. What other tools tolerate
//! (unknown elements and attributes, a missing start value, a unit that is not defined) becomes a note. Our extension
//! variables, the arrays announced under `VendorAnnotations/Tool[@name="org.terramech"]`, stand beside the scalars.

mod read;
mod structure;
pub(crate) mod types;
pub(crate) mod variables;

use std::collections::HashMap;

use serde::Serialize;

use crate::unit::Unit;

pub use read::read;

/// The tool name that marks our vendor annotations, and the type of our SSP annotations.
pub const TOOL: &str = "org.terramech";

/// One FMU's description.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ModelDescription {
    /// `fmiVersion`, always 2.0 here.
    pub fmi_version: String,
    /// `modelName`.
    pub model_name: String,
    /// `guid`, which `fmi2Instantiate` must be given.
    pub guid: String,
    /// `description`.
    pub description: Option<String>,
    /// `generationTool`.
    pub generation_tool: Option<String>,
    /// The co-simulation side.
    pub co_simulation: CoSimulation,
    /// Units, in file order; variables point into it.
    pub units: Vec<Unit>,
    /// Types, in file order; variables point into it.
    pub types: Vec<TypeDefinition>,
    /// Log categories.
    pub log_categories: Vec<String>,
    /// `DefaultExperiment`.
    pub default_experiment: DefaultExperiment,
    /// Scalars in file order: `ModelStructure` counts them from 1, this program from 0.
    pub variables: Vec<Variable>,
    /// Our arrays.
    pub arrays: Vec<ArrayVariable>,
    /// Whether the model announces itself as one of ours (it has a `Tool` annotation of that name).
    pub is_ours: bool,
    /// Share of the cores relative to other units, from our annotation (1 where nothing is said).
    pub weight: f64,
    /// Whether its units can be spread over several processes (our annotation `Team`).
    pub spreads: bool,
    /// `ModelStructure/InitialUnknowns`: scalar -> what its initial value depends on.
    #[serde(skip)]
    pub initial_unknowns: HashMap<usize, Dependencies>,
    /// Scalars whose initial value depends on arrays, which `ModelStructure` cannot say: those arrays (from our annotation).
    #[serde(skip)]
    pub array_dependencies: HashMap<usize, Vec<Item>>,
    /// `ModelStructure/Outputs`: scalar -> what it depends on at communication points.
    #[serde(skip)]
    pub outputs: HashMap<usize, Dependencies>,
    #[serde(skip)]
    by_name: HashMap<Box<str>, Item>,
    #[serde(skip)]
    by_reference: HashMap<(Kind, u32), usize>,
}

/// A scalar or an array of a model, by its index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Item {
    /// Index into [`ModelDescription::variables`].
    Scalar(usize),
    /// Index into [`ModelDescription::arrays`].
    Array(usize),
}

impl ModelDescription {
    /// The scalar or array of that name.
    pub fn find(&self, name: &str) -> Option<Item> {
        self.by_name.get(name).copied()
    }

    /// The scalar of that name.
    pub fn variable(&self, name: &str) -> Option<&Variable> {
        match self.find(name)? {
            Item::Scalar(index) => self.variables.get(index),
            Item::Array(_) => None,
        }
    }

    /// The array of that name.
    pub fn array(&self, name: &str) -> Option<&ArrayVariable> {
        match self.find(name)? {
            Item::Array(index) => self.arrays.get(index),
            Item::Scalar(_) => None,
        }
    }

    /// The first scalar (in file order) of that kind and value reference; later ones are its aliases.
    pub fn by_reference(&self, kind: Kind, value_reference: u32) -> Option<&Variable> {
        self.by_reference.get(&(kind, value_reference)).map(|&index| &self.variables[index])
    }

    /// Name of a scalar or array.
    pub fn name_of(&self, item: Item) -> &str {
        match item {
            Item::Scalar(index) => &self.variables[index].name,
            Item::Array(index) => &self.arrays[index].name,
        }
    }

    /// Causality of a scalar or array.
    pub fn causality_of(&self, item: Item) -> Causality {
        match item {
            Item::Scalar(index) => self.variables[index].causality,
            Item::Array(index) => self.arrays[index].causality,
        }
    }

    /// Unit of a scalar or array.
    pub fn unit_of(&self, item: Item) -> Option<&Unit> {
        let unit = match item {
            Item::Scalar(index) => self.variables[index].unit,
            Item::Array(index) => self.arrays[index].unit,
        };
        unit.map(|index| &self.units[index])
    }

    /// All names, scalars first.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.variables.iter().map(|v| &*v.name).chain(self.arrays.iter().map(|a| &*a.name))
    }

    /// The type a variable declares.
    pub fn type_of(&self, variable: &Variable) -> Option<&TypeDefinition> {
        variable.declared_type.map(|index| &self.types[index])
    }
}

/// Attributes of `CoSimulation`. Everything is false or zero where the file says nothing, as in the standard.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[allow(missing_docs)] // the names are the standard's
pub struct CoSimulation {
    pub model_identifier: String,
    pub needs_execution_tool: bool,
    pub can_handle_variable_communication_step_size: bool,
    pub can_interpolate_inputs: bool,
    pub max_output_derivative_order: u32,
    pub can_run_asynchronously: bool,
    pub can_be_instantiated_only_once_per_process: bool,
    pub can_not_use_memory_management_functions: bool,
    pub can_get_and_set_fmu_state: bool,
    pub can_serialize_fmu_state: bool,
    pub provides_directional_derivative: bool,
    /// Whether the FMU offers model exchange as well.
    pub also_model_exchange: bool,
}

/// `DefaultExperiment`, each value as written (SI seconds).
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[allow(missing_docs)] // the names are the standard's
pub struct DefaultExperiment {
    pub start_time: Option<f64>,
    pub stop_time: Option<f64>,
    pub tolerance: Option<f64>,
    /// Kept as text as well as checked: the master wants it exactly.
    pub step_size: Option<String>,
}

/// The base types of FMI 2.0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[allow(missing_docs)]
pub enum Kind {
    Real,
    Integer,
    Boolean,
    String,
    Enumeration,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 5] = [Self::Real, Self::Integer, Self::Boolean, Self::String, Self::Enumeration];

    /// The element name in model and system descriptions.
    pub fn name(self) -> &'static str {
        match self {
            Self::Real => "Real",
            Self::Integer => "Integer",
            Self::Boolean => "Boolean",
            Self::String => "String",
            Self::Enumeration => "Enumeration",
        }
    }

    /// The kind of an element name.
    pub fn of(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// Writes an enum whose values are words of the standard, with the functions that read and write them.
macro_rules! words {
    ($(#[$doc:meta])* $name:ident { $($variant:ident = $text:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
        #[allow(missing_docs)]
        #[serde(rename_all = "camelCase")]
        pub enum $name { $($variant),+ }
        impl $name {
            /// Every word, for messages.
            pub const ALLOWED: &'static str = concat!($($text, " "),+);
            /// The word in the file.
            pub fn name(self) -> &'static str { match self { $(Self::$variant => $text),+ } }
            /// Reads a word.
            pub fn of(word: &str) -> Option<Self> { match word { $($text => Some(Self::$variant),)+ _ => None } }
        }
        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result { f.write_str(self.name()) }
        }
    };
}

words! {
    /// `causality` of a variable.
    Causality {
        Parameter = "parameter", CalculatedParameter = "calculatedParameter", Input = "input", Output = "output",
        Local = "local", Independent = "independent",
    }
}
words! {
    /// `variability` of a variable.
    Variability {
        Constant = "constant", Fixed = "fixed", Tunable = "tunable", Discrete = "discrete", Continuous = "continuous",
    }
}
words! {
    /// `initial` of a variable.
    Initial { Exact = "exact", Approx = "approx", Calculated = "calculated" }
}

/// A value of any base type.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// Real.
    Real(f64),
    /// Integer; also the value of an enumeration item.
    Integer(i32),
    /// Boolean.
    Boolean(bool),
    /// String.
    String(String),
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Real(value) => write!(f, "{value:?}"),
            Self::Integer(value) => write!(f, "{value}"),
            Self::Boolean(value) => write!(f, "{value}"),
            Self::String(value) => write!(f, "\"{value}\""),
        }
    }
}

/// One `ScalarVariable`, with what its declared type gives it already filled in.
#[derive(Clone, Debug, Serialize)]
pub struct Variable {
    /// Name, unique in the model.
    pub name: Box<str>,
    /// Value reference, unique per base type up to aliases.
    pub value_reference: u32,
    /// Base type.
    pub kind: Kind,
    /// Causality.
    pub causality: Causality,
    /// Variability.
    pub variability: Variability,
    /// Initial, the standard's default filled in; `None` for inputs and the independent variable.
    pub initial: Option<Initial>,
    /// Start value.
    pub start: Option<Value>,
    /// Smallest value (Real, Integer, Enumeration).
    pub min: Option<f64>,
    /// Largest value.
    pub max: Option<f64>,
    /// Index into [`ModelDescription::units`].
    pub unit: Option<usize>,
    /// Index into [`ModelDescription::types`].
    pub declared_type: Option<usize>,
    /// Text for people.
    pub description: Option<Box<str>>,
    /// Line in the file.
    #[serde(skip)]
    pub line: u32,
}

impl Variable {
    /// Whether the standard lets a start value be set before initialisation mode.
    pub fn takes_start(&self) -> bool {
        self.variability != Variability::Constant
            && (self.causality == Causality::Input || matches!(self.initial, Some(Initial::Exact | Initial::Approx)))
    }
}

/// `SimpleType`.
#[derive(Clone, Debug, Serialize)]
pub struct TypeDefinition {
    /// Name.
    pub name: String,
    /// Base type.
    pub kind: Kind,
    /// Physical quantity.
    pub quantity: Option<String>,
    /// Index into [`ModelDescription::units`].
    pub unit: Option<usize>,
    /// Smallest value.
    pub min: Option<f64>,
    /// Largest value.
    pub max: Option<f64>,
    /// Items of an enumeration: name and value.
    pub items: Vec<(String, i32)>,
}

/// One of our array variables.
#[derive(Clone, Debug, Serialize)]
pub struct ArrayVariable {
    /// Name, unique among scalars and arrays.
    pub name: Box<str>,
    /// Value reference, disjoint from those of scalars.
    pub value_reference: u32,
    /// [`Kind::Real`] or [`Kind::Integer`].
    pub kind: Kind,
    /// Input, output, or calculated parameter.
    pub causality: Causality,
    /// `continuous` where the file says nothing; `fixed` arrays (a triangle list) cross once, at initialisation.
    pub variability: Variability,
    /// Index into [`ModelDescription::units`].
    pub unit: Option<usize>,
    /// What its initial value depends on: the complete list, none if empty.
    pub initial_dependencies: Vec<Item>,
    /// Text for people.
    pub description: Option<Box<str>>,
    /// Line in the file.
    #[serde(skip)]
    pub line: u32,
}

/// What a value depends on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Dependencies {
    /// The file does not say: by the standard, everything known must be assumed.
    Assumed,
    /// These scalars, by index.
    Listed(Box<[usize]>),
}
