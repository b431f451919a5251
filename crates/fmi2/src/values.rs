//! The values of an instance's variables: what the environment sets and gets, and what the unit reads and writes.

use crate::variables::*;
use std::ops::{Index, IndexMut};

/// One value.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Value {
    /// `fmi2Real`.
    Real(f64),
    /// `fmi2Integer`.
    Integer(i32),
    /// `fmi2Boolean`.
    Boolean(bool),
    /// `fmi2String`.
    String(String),
    /// Array of reals.
    RealArray(Vec<f64>),
    /// Array of integers.
    IntegerArray(Vec<i32>),
}

impl Value {
    /// Whether both are of one type.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        std::mem::discriminant(self) == std::mem::discriminant(other)
    }
}

/// All values of one instance, addressed by typed handles: `v[vars.force]` for reals, integers and Booleans,
/// methods for strings and arrays.
///
/// A handle of another model's table is a bug of the unit; it panics, which poisons that instance alone.
#[derive(Clone, Debug)]
pub struct Values {
    /// By value reference. The numbers of Reals lie in `reals`: thousands of them are read and set each step, by whole runs.
    pub(crate) values: Vec<Value>,
    /// By value reference; 0 for other types.
    pub(crate) reals: Vec<f64>,
    /// What a get or set between steps may skip: see [`quick`].
    pub(crate) quick: Vec<u8>,
    /// Why a variable can no longer be set, if so.
    locks: Vec<Option<&'static str>>,
    /// Derivatives of inputs for the step that comes: variable, order, value.
    derivatives: Vec<(u32, i32, f64)>,
    /// Set since it was last cleared by [`Values::take_changed`]: units that react to single inputs need it.
    changed: Vec<bool>,
}

impl Values {
    /// Start values of a table.
    pub fn new(table: &Table) -> Self {
        let values: Vec<Value> = table
            .variables()
            .iter()
            .map(|v| match &v.start {
                Start::Real(x) => Value::Real(*x),
                Start::Integer(x) => Value::Integer(*x),
                Start::Boolean(x) => Value::Boolean(*x),
                Start::String(x) => Value::String(x.clone()),
                Start::RealArray => Value::RealArray(Vec::new()),
                Start::IntegerArray => Value::IntegerArray(Vec::new()),
            })
            .collect();
        let n = values.len();
        let reals = values.iter().map(|v| if let Value::Real(x) = v { *x } else { 0.0 }).collect();
        let quick = table.variables().iter().map(quick).collect();
        Self { values, reals, quick, locks: vec![None; n], derivatives: Vec::new(), changed: vec![false; n] }
    }

    /// A value as it stands.
    pub(crate) fn value(&self, vr: usize) -> Value {
        match &self.values[vr] {
            Value::Real(_) => Value::Real(self.reals[vr]),
            other => other.clone(),
        }
    }

    /// Replaces a value by another of its type.
    pub(crate) fn put_value(&mut self, vr: usize, value: Value) {
        if let Value::Real(x) = value {
            self.reals[vr] = x;
        }
        self.values[vr] = value;
    }

    /// The values of some variables that differ from those in `known`, which they become: what a lead tells the members of its team.
    pub fn changes(
        &self,
        of: impl IntoIterator<Item = u32>,
        known: &mut std::collections::BTreeMap<u32, Value>,
    ) -> Vec<(u32, Value)> {
        let mut changes = Vec::new();
        for vr in of {
            let same = match (&self.values[vr as usize], known.get(&vr)) {
                (Value::Real(_), Some(Value::Real(x))) => self.reals[vr as usize].to_bits() == x.to_bits(),
                (value, Some(known)) => value == known,
                (_, None) => false,
            };
            if !same {
                let value = self.value(vr as usize);
                known.insert(vr, value.clone());
                changes.push((vr, value));
            }
        }
        changes
    }

    /// Takes what [`Values::changes`] gave, of the same model; what is of another type is left out.
    pub fn take_changes(&mut self, changes: Vec<(u32, Value)>) {
        for (vr, value) in changes {
            if self.values.get(vr as usize).is_some_and(|own| own.is_like(&value)) {
                self.put_value(vr as usize, value);
                self.changed[vr as usize] = true;
            }
        }
    }

    /// Why a variable can no longer be set, if so.
    pub(crate) fn lock_of(&self, vr: u32) -> Option<&'static str> {
        self.locks[vr as usize]
    }

    /// Whether it is locked, for each variable.
    pub(crate) fn locked(&self) -> Vec<bool> {
        self.locks.iter().map(Option::is_some).collect()
    }

    /// The Reals of consecutive references, if all of them are read as they stand and are finite; `false`: read one by one.
    pub(crate) fn read_run(&self, references: &[u32], to: &mut [f64]) -> bool {
        let Some(run) = run(references) else { return false };
        let (Some(quick), Some(from)) = (self.quick.get(run.clone()), self.reals.get(run)) else { return false };
        if quick.iter().fold(READ, |all, q| all & q) == 0 {
            return false;
        }
        to.copy_from_slice(from);
        all_finite(to)
    }

    /// The reverse of [`Values::read_run`]; `false`: nothing was set.
    pub(crate) fn write_run(&mut self, references: &[u32], from: &[f64]) -> bool {
        let Some(run) = run(references) else { return false };
        let Some(quick) = self.quick.get(run.clone()) else { return false };
        if quick.iter().fold(WRITE, |all, q| all & q) == 0 || !all_finite(from) {
            return false;
        }
        self.reals[run.clone()].copy_from_slice(from);
        self.changed[run].fill(true);
        true
    }

    /// Text of a string.
    pub fn string(&self, var: StringVar) -> &str {
        match &self.values[var.0 as usize] {
            Value::String(x) => x,
            _ => wrong(var),
        }
    }
    /// Writes a string output.
    pub fn set_string(&mut self, var: StringVar, text: String) {
        self.values[var.0 as usize] = Value::String(text);
    }
    /// Elements of a real array.
    pub fn reals(&self, var: RealArrayVar) -> &[f64] {
        match &self.values[var.0 as usize] {
            Value::RealArray(x) => x,
            _ => wrong(var),
        }
    }
    /// A real array to fill: resize and write, its allocation is kept.
    pub fn reals_mut(&mut self, var: RealArrayVar) -> &mut Vec<f64> {
        match &mut self.values[var.0 as usize] {
            Value::RealArray(x) => x,
            _ => wrong(var),
        }
    }
    /// Elements of an integer array.
    pub fn integers(&self, var: IntegerArrayVar) -> &[i32] {
        match &self.values[var.0 as usize] {
            Value::IntegerArray(x) => x,
            _ => wrong(var),
        }
    }
    /// An integer array to fill.
    pub fn integers_mut(&mut self, var: IntegerArrayVar) -> &mut Vec<i32> {
        match &mut self.values[var.0 as usize] {
            Value::IntegerArray(x) => x,
            _ => wrong(var),
        }
    }
    /// Reads several reals.
    pub fn get<const N: usize>(&self, vars: [RealVar; N]) -> [f64; N] {
        vars.map(|v| self[v])
    }
    /// Writes several reals.
    pub fn put<const N: usize>(&mut self, vars: [RealVar; N], values: [f64; N]) {
        for (var, x) in vars.into_iter().zip(values) {
            self[var] = x;
        }
    }
    /// Refuses further sets of `vars`, because `reason` ("the bed has been settled with it"). Late work calls this
    /// for what it has used.
    pub fn lock(&mut self, vars: impl IntoIterator<Item = u32>, reason: &'static str) {
        for vr in vars {
            self.locks[vr as usize] = Some(reason);
            self.quick[vr as usize] &= !WRITE;
        }
    }
    /// The time derivative of an input at the beginning of the step that comes (its unit/s^order), as the environment gave it; 0 where it gave none.
    pub fn derivative(&self, var: RealVar, order: i32) -> f64 {
        self.derivatives.iter().find(|d| (d.0, d.1) == (var.0, order)).map_or(0.0, |d| d.2)
    }
    pub(crate) fn set_derivative(&mut self, vr: u32, order: i32, value: f64) {
        self.derivatives.retain(|d| (d.0, d.1) != (vr, order));
        self.derivatives.push((vr, order, value));
    }
    pub(crate) fn forget_derivatives(&mut self) {
        self.derivatives.clear();
    }
    /// Whether the environment has set `var` since the last call of this method for it (or since instantiation).
    pub fn take_changed(&mut self, var: impl Var) -> bool {
        std::mem::take(&mut self.changed[var.vr() as usize])
    }
    pub(crate) fn mark_changed(&mut self, vr: u32) {
        self.changed[vr as usize] = true;
    }
}

fn wrong(var: impl Var) -> ! {
    panic!("value reference {} used with a handle of another type or table", var.vr())
}

macro_rules! index {
    ($handle:ident, $ty:ty, $variant:ident) => {
        impl Index<$handle> for Values {
            type Output = $ty;
            fn index(&self, var: $handle) -> &$ty {
                match &self.values[var.0 as usize] {
                    Value::$variant(x) => x,
                    _ => wrong(var),
                }
            }
        }
        impl IndexMut<$handle> for Values {
            fn index_mut(&mut self, var: $handle) -> &mut $ty {
                match &mut self.values[var.0 as usize] {
                    Value::$variant(x) => x,
                    _ => wrong(var),
                }
            }
        }
    };
}
impl Index<RealVar> for Values {
    type Output = f64;
    fn index(&self, var: RealVar) -> &f64 {
        match &self.values[var.0 as usize] {
            Value::Real(_) => &self.reals[var.0 as usize],
            _ => wrong(var),
        }
    }
}
impl IndexMut<RealVar> for Values {
    fn index_mut(&mut self, var: RealVar) -> &mut f64 {
        match &self.values[var.0 as usize] {
            Value::Real(_) => &mut self.reals[var.0 as usize],
            _ => wrong(var),
        }
    }
}
index!(IntegerVar, i32, Integer);
index!(BooleanVar, bool, Boolean);

/// A Real that is read as it stands between steps.
pub(crate) const READ: u8 = 1;
/// A Real without range that may be set between steps.
pub(crate) const WRITE: u8 = 2;

/// What a get or set of `v` between steps may skip: [`READ`], [`WRITE`].
fn quick(v: &Variable) -> u8 {
    if v.start.type_name() != "Real" {
        return 0;
    }
    let read = if v.on_demand { 0 } else { READ };
    let free = v.min.is_none() && v.max.is_none() && v.causality.settable();
    let late = v.causality == Causality::Parameter && v.variability == Variability::Fixed;
    read | if free && !late { WRITE } else { 0 }
}

/// The references as a range, if they are consecutive and so many that it pays.
fn run(references: &[u32]) -> Option<std::ops::Range<usize>> {
    const WORTH: usize = 4;
    let first = *references.first()?;
    if references.len() < WORTH {
        return None;
    }
    // Without branches, so that it takes a fraction of a nanosecond each.
    let broken = references.iter().enumerate().fold(0, |broken, (i, a)| broken | (a ^ first.wrapping_add(i as u32)));
    let first = first as usize;
    (broken == 0).then(|| first..first + references.len())
}

/// A finite number times zero is zero but for its sign; anything else is not a number. Two instructions for two numbers on any machine, and nothing that waits for
/// what was before.
pub(crate) fn all_finite(x: &[f64]) -> bool {
    x.iter().fold(0, |bad, x| bad | (x * 0.0).to_bits()) << 1 == 0
}
