//! The variable table of a model: the one source of its `modelDescription.xml` and of every check on a get or set.

use std::fmt;

/// Role of a variable (FMI 2.0, 2.2.7).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// Set from outside, constant during the run unless tunable.
    Parameter,
    /// Computed from parameters at initialisation.
    CalculatedParameter,
    /// Given by another unit.
    Input,
    /// For other units.
    Output,
}

impl Causality {
    /// The word of the schema.
    pub fn word(self) -> &'static str {
        match self {
            Self::Parameter => "parameter",
            Self::CalculatedParameter => "calculatedParameter",
            Self::Input => "input",
            Self::Output => "output",
        }
    }
    /// Whether the environment may set it.
    pub fn settable(self) -> bool {
        matches!(self, Self::Parameter | Self::Input)
    }
}

/// When a value may change (FMI 2.0, 2.2.7).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variability {
    /// Fixed at initialisation.
    Fixed,
    /// Parameter that may change between steps.
    Tunable,
    /// Changes at communication points only.
    Discrete,
    /// Any time.
    Continuous,
}

impl Variability {
    /// The word of the schema.
    pub fn word(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Tunable => "tunable",
            Self::Discrete => "discrete",
            Self::Continuous => "continuous",
        }
    }
}

/// Type and start value.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// 64-bit float.
    Real(f64),
    /// 32-bit integer.
    Integer(i32),
    /// Truth value.
    Boolean(bool),
    /// UTF-8 text without zero bytes.
    String(String),
    /// Array of reals, empty at start.
    RealArray,
    /// Array of integers, empty at start.
    IntegerArray,
}

impl Start {
    /// Name of the type: the schema's for scalars.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Real(_) => "Real",
            Self::Integer(_) => "Integer",
            Self::Boolean(_) => "Boolean",
            Self::String(_) => "String",
            Self::RealArray => "RealArray",
            Self::IntegerArray => "IntegerArray",
        }
    }
    /// Whether it is an array of our extension.
    pub fn is_array(&self) -> bool {
        matches!(self, Self::RealArray | Self::IntegerArray)
    }
}

/// One variable. Its value reference is its index in the [`Table`], over all types, so that references of arrays and
/// scalars are disjoint.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Structured name, `wheel[1].force.x`.
    pub name: String,
    /// Role.
    pub causality: Causality,
    /// When it may change.
    pub variability: Variability,
    /// Type and start value.
    pub start: Start,
    /// SI unit ("1" for dimensionless reals, "" for other types).
    pub unit: &'static str,
    /// One sentence.
    pub description: String,
    /// Least value allowed (reals and integers).
    pub min: Option<f64>,
    /// Greatest value allowed.
    pub max: Option<f64>,
    /// Knowns this output depends on at initialisation (value references). Outputs and calculated parameters only.
    pub initial_dependencies: Vec<u32>,
    /// Computed by [`crate::Unit::refresh`] at each get, not at each step.
    pub on_demand: bool,
    /// Left out of a saved state (threads, paths), so that a state moves between machines.
    pub not_in_state: bool,
}

/// A typed handle: the value reference.
pub trait Var: Copy {
    /// The value reference.
    fn vr(self) -> u32;
}

macro_rules! handles {
    ($($(#[$doc:meta])* $name:ident),*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub struct $name(pub(crate) u32);
        impl Var for $name { fn vr(self) -> u32 { self.0 } }
    )*};
}
handles! {
    /// Handle of a real.
    RealVar,
    /// Handle of an integer.
    IntegerVar,
    /// Handle of a Boolean.
    BooleanVar,
    /// Handle of a string.
    StringVar,
    /// Handle of an array of reals.
    RealArrayVar,
    /// Handle of an array of integers.
    IntegerArrayVar
}

/// The table; variables get their value references in the order of declaration.
#[derive(Clone, Debug, Default)]
pub struct Table {
    variables: Vec<Variable>,
}

impl fmt::Display for Variable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} {})", self.name, self.causality.word(), self.start.type_name())
    }
}

impl Table {
    /// An empty table.
    pub fn new() -> Self {
        Self::default()
    }

    /// All variables; the index is the value reference.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Finds a variable by name (linear; for tests and messages).
    pub fn find(&self, name: &str) -> Option<(u32, &Variable)> {
        self.variables.iter().position(|v| v.name == name).map(|i| (i as u32, &self.variables[i]))
    }

    fn push(
        &mut self,
        name: &str,
        causality: Causality,
        variability: Variability,
        start: Start,
        unit: &'static str,
        description: &str,
    ) -> u32 {
        debug_assert!(self.find(name).is_none(), "variable {name} declared twice");
        self.variables.push(Variable {
            name: name.into(),
            causality,
            variability,
            start,
            unit,
            description: description.into(),
            min: None,
            max: None,
            initial_dependencies: Vec::new(),
            on_demand: false,
            not_in_state: false,
        });
        (self.variables.len() - 1) as u32
    }

    /// A continuous real input.
    pub fn input_real(&mut self, name: &str, start: f64, unit: &'static str, description: &str) -> RealVar {
        RealVar(self.push(name, Causality::Input, Variability::Continuous, Start::Real(start), unit, description))
    }
    /// A discrete integer input.
    pub fn input_integer(&mut self, name: &str, start: i32, description: &str) -> IntegerVar {
        IntegerVar(self.push(name, Causality::Input, Variability::Discrete, Start::Integer(start), "", description))
    }
    /// A discrete Boolean input.
    pub fn input_boolean(&mut self, name: &str, start: bool, description: &str) -> BooleanVar {
        BooleanVar(self.push(name, Causality::Input, Variability::Discrete, Start::Boolean(start), "", description))
    }
    /// A discrete string input.
    pub fn input_string(&mut self, name: &str, start: &str, description: &str) -> StringVar {
        StringVar(self.push(
            name,
            Causality::Input,
            Variability::Discrete,
            Start::String(start.into()),
            "",
            description,
        ))
    }
    /// A discrete string output.
    pub fn output_string(&mut self, name: &str, description: &str) -> StringVar {
        let start = Start::String(String::new());
        StringVar(self.push(name, Causality::Output, Variability::Discrete, start, "", description))
    }
    /// A continuous real output.
    pub fn output_real(&mut self, name: &str, unit: &'static str, description: &str) -> RealVar {
        RealVar(self.push(name, Causality::Output, Variability::Continuous, Start::Real(0.0), unit, description))
    }
    /// A discrete integer output.
    pub fn output_integer(&mut self, name: &str, description: &str) -> IntegerVar {
        IntegerVar(self.push(name, Causality::Output, Variability::Discrete, Start::Integer(0), "", description))
    }
    /// A discrete Boolean output.
    pub fn output_boolean(&mut self, name: &str, description: &str) -> BooleanVar {
        BooleanVar(self.push(name, Causality::Output, Variability::Discrete, Start::Boolean(false), "", description))
    }
    /// A fixed real parameter.
    pub fn parameter_real(&mut self, name: &str, start: f64, unit: &'static str, description: &str) -> RealVar {
        RealVar(self.push(name, Causality::Parameter, Variability::Fixed, Start::Real(start), unit, description))
    }
    /// A fixed integer parameter.
    pub fn parameter_integer(&mut self, name: &str, start: i32, description: &str) -> IntegerVar {
        IntegerVar(self.push(name, Causality::Parameter, Variability::Fixed, Start::Integer(start), "", description))
    }
    /// A fixed Boolean parameter.
    pub fn parameter_boolean(&mut self, name: &str, start: bool, description: &str) -> BooleanVar {
        BooleanVar(self.push(name, Causality::Parameter, Variability::Fixed, Start::Boolean(start), "", description))
    }
    /// A fixed string parameter.
    pub fn parameter_string(&mut self, name: &str, start: &str, description: &str) -> StringVar {
        StringVar(self.push(
            name,
            Causality::Parameter,
            Variability::Fixed,
            Start::String(start.into()),
            "",
            description,
        ))
    }
    /// A real computed from parameters and specification at initialisation.
    pub fn calculated_real(&mut self, name: &str, unit: &'static str, description: &str) -> RealVar {
        RealVar(self.push(
            name,
            Causality::CalculatedParameter,
            Variability::Fixed,
            Start::Real(0.0),
            unit,
            description,
        ))
    }
    /// An input array of reals.
    pub fn input_real_array(&mut self, name: &str, unit: &'static str, description: &str) -> RealArrayVar {
        RealArrayVar(self.push(name, Causality::Input, Variability::Continuous, Start::RealArray, unit, description))
    }
    /// An output array of reals.
    pub fn output_real_array(&mut self, name: &str, unit: &'static str, description: &str) -> RealArrayVar {
        RealArrayVar(self.push(name, Causality::Output, Variability::Continuous, Start::RealArray, unit, description))
    }
    /// An input array of integers.
    pub fn input_integer_array(&mut self, name: &str, description: &str) -> IntegerArrayVar {
        IntegerArrayVar(self.push(name, Causality::Input, Variability::Discrete, Start::IntegerArray, "", description))
    }
    /// An output array of integers.
    pub fn output_integer_array(&mut self, name: &str, description: &str) -> IntegerArrayVar {
        IntegerArrayVar(self.push(name, Causality::Output, Variability::Discrete, Start::IntegerArray, "", description))
    }
    /// Three reals `name.{x,y,z}` of one kind; `make` is one of the methods above, as
    /// `t.xyz("force", |t, n| t.output_real(n, "N", "..."))`.
    pub fn xyz(&mut self, name: &str, mut make: impl FnMut(&mut Self, &str) -> RealVar) -> [RealVar; 3] {
        ["x", "y", "z"].map(|axis| make(self, &format!("{name}.{axis}")))
    }
    /// Four reals `name.{w,x,y,z}`: a quaternion, scalar first.
    pub fn wxyz(&mut self, name: &str, mut make: impl FnMut(&mut Self, &str) -> RealVar) -> [RealVar; 4] {
        ["w", "x", "y", "z"].map(|axis| make(self, &format!("{name}.{axis}")))
    }

    /// Every unit's `specification` and `threads`, the same in all of them (the design's unit contract).
    pub fn common_parameters(&mut self) -> CommonVars {
        let specification = self.parameter_string(
            "specification",
            "",
            "Specification: empty = resources/specification.json; text that starts with { = inline JSON; else an absolute path",
        );
        let threads = self.parameter_integer("threads", 1, "Threads this unit may compute on");
        self.range(threads, Some(1.0), Some(1024.0));
        self.not_in_state(specification);
        self.not_in_state(threads);
        CommonVars { specification, threads }
    }

    /// The 13 reals of a rigid state under `prefix` (such as `wheel`; empty for none).
    pub fn state(&mut self, prefix: &str, output: bool, what: &str) -> StateVars {
        let dot = if prefix.is_empty() { "" } else { "." };
        let make = |t: &mut Self, name: &str, unit, start, text: &str| {
            let text = format!("{text} of {what}, in the inertial frame");
            if output { t.output_real(name, unit, &text) } else { t.input_real(name, start, unit, &text) }
        };
        StateVars {
            position: self.xyz(&format!("{prefix}{dot}position"), |t, n| make(t, n, "m", 0.0, "Position")),
            orientation: self.wxyz(&format!("{prefix}{dot}orientation"), |t, n| {
                let start = if n.ends_with('w') { 1.0 } else { 0.0 };
                make(t, n, "1", start, "Orientation (unit quaternion, body to inertial)")
            }),
            velocity: self.xyz(&format!("{prefix}{dot}velocity"), |t, n| make(t, n, "m/s", 0.0, "Velocity")),
            angular_velocity: self
                .xyz(&format!("{prefix}{dot}angular_velocity"), |t, n| make(t, n, "rad/s", 0.0, "Angular velocity")),
        }
    }

    /// The six reals of a wrench under `prefix`, about the point that `what` names.
    pub fn wrench(&mut self, prefix: &str, output: bool, what: &str) -> WrenchVars {
        let make = |t: &mut Self, name: &str, unit, text: &str| {
            let text = format!("{text} {what}, in the inertial frame");
            if output { t.output_real(name, unit, &text) } else { t.input_real(name, 0.0, unit, &text) }
        };
        WrenchVars {
            force: self.xyz(&format!("{prefix}.force"), |t, n| make(t, n, "N", "Force on")),
            moment: self.xyz(&format!("{prefix}.moment"), |t, n| make(t, n, "N.m", "Moment on")),
        }
    }

    /// Sets the allowed range.
    pub fn range(&mut self, var: impl Var, min: Option<f64>, max: Option<f64>) {
        let v = &mut self.variables[var.vr() as usize];
        (v.min, v.max) = (min, max);
    }
    /// Declares what an output or calculated parameter depends on at initialisation. Undeclared means: on nothing.
    pub fn depends_initially(&mut self, var: impl Var, on: &[u32]) {
        self.variables[var.vr() as usize].initial_dependencies.extend_from_slice(on);
    }
    /// Makes a parameter tunable: it may be set between steps.
    pub fn tunable(&mut self, var: impl Var) {
        self.variables[var.vr() as usize].variability = Variability::Tunable;
    }
    /// Makes an array fixed: it does not change after initialisation.
    pub fn fixed(&mut self, var: impl Var) {
        self.variables[var.vr() as usize].variability = Variability::Fixed;
    }
    /// Computed at each get instead of at each step.
    pub fn on_demand(&mut self, var: impl Var) {
        self.variables[var.vr() as usize].on_demand = true;
    }
    /// Leaves a parameter out of saved states.
    pub fn not_in_state(&mut self, var: impl Var) {
        self.variables[var.vr() as usize].not_in_state = true;
    }
}

/// Handles of the parameters every unit has.
#[derive(Clone, Copy, Debug)]
pub struct CommonVars {
    /// See [`crate::specification`].
    pub specification: StringVar,
    /// Threads this unit may use.
    pub threads: IntegerVar,
}

/// Handles of a rigid state.
#[derive(Clone, Copy, Debug)]
pub struct StateVars {
    /// Position (m).
    pub position: [RealVar; 3],
    /// Unit quaternion, scalar first, body to inertial.
    pub orientation: [RealVar; 4],
    /// Velocity (m/s).
    pub velocity: [RealVar; 3],
    /// Angular velocity in the inertial frame (rad/s).
    pub angular_velocity: [RealVar; 3],
}

impl StateVars {
    /// All 13 value references.
    pub fn all(&self) -> Vec<u32> {
        let parts: [&[RealVar]; 4] = [&self.position, &self.orientation, &self.velocity, &self.angular_velocity];
        parts.concat().iter().map(|v| v.vr()).collect()
    }
}

/// Handles of a wrench.
#[derive(Clone, Copy, Debug)]
pub struct WrenchVars {
    /// Force (N).
    pub force: [RealVar; 3],
    /// Moment (N m).
    pub moment: [RealVar; 3],
}

impl WrenchVars {
    /// All six value references.
    pub fn all(&self) -> Vec<u32> {
        [self.force, self.moment].concat().iter().map(|v| v.vr()).collect()
    }
}
