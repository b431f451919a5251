//! The validated plan of a run: everything resolved to indices, value references and whole numbers of base steps.
//!
//! A plan is what `check` makes and `run` executes; the run side need not look at a name again. Vectors keep the order of
//! the description, and indices point into them: `component` into [`Plan::components`], `fmu` into [`Plan::fmus`].

use std::path::PathBuf;
use std::sync::Arc;

use serde::Serialize;

use crate::archive::Unpacked;
use crate::decimal::Clock;
use crate::description::algorithm::Scheme;
use crate::fault::{Fault, Place};
use crate::model_description::{Kind, ModelDescription, Value};
use crate::unit::{Linear, Unit};
use crate::world::Ranks;

/// A validated system.
#[derive(Clone, Debug, Serialize)]
pub struct Plan {
    /// Name of the system.
    pub name: String,
    /// The description file as given.
    pub file: PathBuf,
    /// The distinct FMUs; several components may share one.
    pub fmus: Vec<Fmu>,
    /// The instances, in file order.
    pub components: Vec<Component>,
    /// Scalar connections, in file order.
    pub connections: Vec<Connection>,
    /// Array connections, in file order.
    pub arrays: Vec<ArrayConnection>,
    /// How the connected values are exchanged in initialisation mode.
    pub initialisation: Vec<InitialStage>,
    /// Start, base step, number of steps.
    pub clock: Clock,
    /// What is written while the run goes.
    pub recording: Recording,
    /// How the units are coupled in time.
    pub algorithm: Algorithm,
    /// Power bonds whose energy residual is summed.
    pub bonds: Vec<PowerBond>,
    /// Headline results.
    pub summary: Vec<SummaryItem>,
    /// Inputs that follow a table over time.
    pub drives: Vec<Drive>,
    /// Conditions that end the run.
    pub stop_when: Vec<StopCondition>,
    /// Every input file read, for the manifest.
    pub inputs: Vec<InputFile>,
    /// Remarks of the check.
    pub notes: Vec<Fault>,
    /// The folder of the description: relative paths in values count from it.
    pub folder: PathBuf,
    /// Keeps an unpacked `.ssp` on disk.
    #[serde(skip)]
    pub archive: Option<Arc<Unpacked>>,
}

impl Plan {
    /// The model of a component.
    pub fn model(&self, component: usize) -> &ModelDescription {
        &self.fmus[self.components[component].fmu].model
    }

    /// `component.variable` of a port.
    pub fn port_name(&self, port: &Port) -> String {
        format!("{}.{}", self.components[port.component].name, self.model(port.component).variables[port.variable].name)
    }

    /// `component.array` of an array port.
    pub fn array_name(&self, port: &ArrayPort) -> String {
        format!("{}.{}", self.components[port.component].name, self.model(port.component).arrays[port.array].name)
    }
}

/// An opened FMU.
#[derive(Clone, Debug, Serialize)]
pub struct Fmu {
    /// The archive or folder.
    pub path: PathBuf,
    /// SHA-256 of the archive, lower-case hexadecimal; `None` for a folder.
    pub sha256: Option<String>,
    /// The library for this machine inside the unpacked FMU; `None` where the check was told not to ask for one.
    pub library: Option<PathBuf>,
    /// Its description.
    #[serde(skip)]
    pub model: Arc<ModelDescription>,
    /// The unpacked files; removed with the last clone.
    #[serde(skip)]
    pub unpacked: Arc<Unpacked>,
}

/// One instance.
#[derive(Clone, Debug, Serialize)]
pub struct Component {
    /// Instance name; nested systems give dotted names.
    pub name: String,
    /// Index into [`Plan::fmus`].
    pub fmu: usize,
    /// Values to set after instantiation, before initialisation mode; one per variable, in order of first mention.
    pub settings: Vec<Setting>,
    /// Communication step in base steps, at least 1.
    pub multiple: u64,
    /// Threads asked for in the description; `None`: the run shares them out.
    pub threads: Option<u32>,
    /// Its place under MPI; `None`: the run chooses. A run in one process ignores it.
    pub ranks: Option<Ranks>,
    /// Where it is described.
    pub place: Place,
}

/// A value to set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setting {
    /// Index into the model's variables.
    pub variable: usize,
    /// Value reference.
    pub value_reference: u32,
    /// Which `fmi2Set...` (an enumeration is set as an Integer).
    pub kind: Kind,
    /// The value, in the variable's own unit.
    pub value: Value,
}

/// One end of a scalar connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
pub struct Port {
    /// Index into [`Plan::components`].
    pub component: usize,
    /// Index into the model's variables.
    pub variable: usize,
    /// Value reference.
    pub value_reference: u32,
    /// Which `fmi2Get...` or `fmi2Set...`.
    pub kind: Kind,
}

/// A scalar connection: output to input, or calculated parameter to parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Connection {
    /// Where the value is read.
    pub from: Port,
    /// Where it is set.
    pub to: Port,
    /// What happens to it on the way.
    pub transform: Transform,
    /// When it crosses.
    pub when: When,
    /// Order of extrapolation between communication points: 0 (hold), 1 or 2.
    pub extrapolation: u8,
    /// Where it is described.
    pub place: Place,
}

/// When a connection is served.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum When {
    /// In initialisation mode and at every communication point.
    Always,
    /// In initialisation mode only: the source is fixed or the target is a parameter.
    Initially,
}

/// What a connection does to a value. Real to Real unless said otherwise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Transform {
    /// The value as it is; source and target are of one kind, or a Boolean or Enumeration goes to an Integer as its number.
    Copy,
    /// Unit conversion and linear transformation in one; also Integer to Real.
    Linear(Linear),
    /// Integer, Enumeration or Boolean (0, 1) through a table; values not in it go over unchanged.
    Table(Vec<(i32, i32)>),
}

/// One end of an array connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
pub struct ArrayPort {
    /// Index into [`Plan::components`].
    pub component: usize,
    /// Index into the model's arrays.
    pub array: usize,
    /// Value reference.
    pub value_reference: u32,
}

/// An array connection, copied as it is (units are checked to be the same).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArrayConnection {
    /// Where it is read.
    pub from: ArrayPort,
    /// Where it is set.
    pub to: ArrayPort,
    /// [`Kind::Real`] or [`Kind::Integer`].
    pub kind: Kind,
    /// When it crosses.
    pub when: When,
    /// Where it is described.
    pub place: Place,
}

/// One stage of the exchange in initialisation mode: read all its sources, then set all its targets. After the last
/// stage the units leave initialisation mode. Every connection is in exactly one stage.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct InitialStage {
    /// Indices into [`Plan::connections`].
    pub connections: Vec<usize>,
    /// Indices into [`Plan::arrays`].
    pub arrays: Vec<usize>,
}

/// What is recorded.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Recording {
    /// Columns of `results.csv`: connected sources and what the description chose, in component and variable order.
    pub scalars: Vec<RecordedScalar>,
    /// Datasets under `vtk/`.
    pub vtk: Vec<VtkDataset>,
}

/// A column of `results.csv`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordedScalar {
    /// What is read.
    pub port: Port,
    /// Unit for the header.
    pub unit: Option<Unit>,
    /// Period in base steps.
    pub every: u64,
}

/// A time series of VTK files.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VtkDataset {
    /// Name of the series, `vtk/NAME.pvd`.
    pub name: String,
    /// Period in base steps.
    pub every: u64,
    /// Point positions, 3 reals each.
    pub position: ArrayPort,
    /// Triangles, 3 indices each; `None`: a cloud of points.
    pub triangle: Option<ArrayPort>,
    /// Point data.
    pub fields: Vec<VtkField>,
}

/// Point data of a [`VtkDataset`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VtkField {
    /// Name in the file.
    pub name: String,
    /// The values; their number divided by the points' gives the components.
    pub array: ArrayPort,
    /// [`Kind::Real`] or [`Kind::Integer`].
    pub kind: Kind,
    /// For sparse data (`contact.force` of the vertices in `contact.index`): the points the values belong to; others are 0.
    pub index: Option<ArrayPort>,
}

/// How the units are coupled in time.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Algorithm {
    /// Which scheme.
    pub scheme: Scheme,
    /// All components, in the order they step (Gauss-Seidel).
    pub order: Vec<usize>,
    /// Whether outputs that depend directly on inputs are read again before the step (Jacobi).
    pub resolve_feed_through: bool,
    /// Largest relative change of an input between the last two iterations (iterated); largest relative energy residual of a step (ECCO).
    pub tolerance: f64,
    /// Most iterations of a step (iterated).
    pub iterations: u32,
    /// Longest step in base steps (ECCO).
    pub longest: u64,
}

/// A power bond: pairs whose products are the power that crosses, force with velocity, moment with angular velocity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PowerBond {
    /// Name in results and messages.
    pub name: String,
    /// The pairs.
    pub pairs: Vec<BondPair>,
    /// Forces on the vertices of a mesh against their velocities.
    pub contacts: Vec<ContactPair>,
    /// Whether its efforts are means over the sender's last step, not values at its end.
    pub means: bool,
}

/// Two connections in opposite directions whose product is a power, by index into [`Plan::connections`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct BondPair {
    /// The connection that carries force or moment.
    pub effort: usize,
    /// The connection that carries velocity or angular velocity.
    pub flow: usize,
}

/// Array connections whose products are a power, by index into [`Plan::arrays`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct ContactPair {
    /// Forces on some vertices (3n).
    pub effort: usize,
    /// Which vertices those are (n).
    pub index: usize,
    /// Velocities of all vertices (3N).
    pub flow: usize,
}

/// An input that follows a table over time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Drive {
    /// What is set.
    pub port: Port,
    /// Times, ascending (s).
    #[serde(skip)]
    pub times: Arc<[f64]>,
    /// Values, one for each time, in the variable's unit.
    #[serde(skip)]
    pub values: Vec<f64>,
}

impl Drive {
    /// The value at a time (s): Reals on straight lines between rows, other kinds as the last row says; before the first row and after the
    /// last one held.
    pub fn at(&self, time: f64) -> f64 {
        let after = self.times.partition_point(|t| *t <= time);
        if after == 0 {
            return self.values[0];
        }
        let before = after - 1;
        if after == self.times.len() || self.port.kind != Kind::Real {
            return self.values[before];
        }
        let (t0, t1) = (self.times[before], self.times[after]);
        let part = (time - t0) / (t1 - t0);
        self.values[before] + part * (self.values[after] - self.values[before])
    }
}

/// A condition that ends the run when it holds at a communication point after the first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StopCondition {
    /// As given.
    pub text: String,
    /// What is compared.
    pub port: Port,
    /// How.
    pub comparison: Comparison,
    /// With what, in the variable's unit.
    pub value: f64,
}

/// A comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Comparison {
    /// <
    Below,
    /// <=
    AtMost,
    /// >
    Above,
    /// >=
    AtLeast,
    /// ==
    Equal,
    /// !=
    Unequal,
}

impl Comparison {
    /// Whether it holds.
    pub fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Self::Below => a < b,
            Self::AtMost => a <= b,
            Self::Above => a > b,
            Self::AtLeast => a >= b,
            Self::Equal => a == b,
            Self::Unequal => a != b,
        }
    }
}

/// A headline result: the mean of a variable over a window.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SummaryItem {
    /// Name in `summary.json`.
    pub name: String,
    /// What is averaged.
    pub port: Port,
    /// Its unit.
    pub unit: Option<Unit>,
    /// Window from, in base steps from the start.
    pub from: u64,
    /// Window to, in base steps from the start, at most [`Clock::steps`].
    pub to: u64,
    /// The measured value beside it, in the same unit.
    pub measured: Option<f64>,
    /// Where the measured value is from.
    pub source: Option<String>,
}

/// An input file of a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct InputFile {
    /// Path.
    pub path: PathBuf,
    /// SHA-256, lower-case hexadecimal.
    pub sha256: String,
}
