//! The values of an instance's variables: what the environment sets and gets, and what the unit reads and writes.

use crate::variables::*;
use std::ops::{Index, IndexMut};

/// One value.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) enum Value {
    Real(f64),
    Integer(i32),
    Boolean(bool),
    String(String),
    RealArray(Vec<f64>),
    IntegerArray(Vec<i32>),
}

/// All values of one instance, addressed by typed handles: `v[vars.force]` for reals, integers and Booleans,
/// methods for strings and arrays.
///
/// A handle of another model's table is a bug of the unit; it panics, which poisons that instance alone.
#[derive(Clone, Debug)]
pub struct Values {
    pub(crate) values: Vec<Value>,
    /// Why a variable can no longer be set, if so.
    pub(crate) locks: Vec<Option<&'static str>>,
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
        Self { values, locks: vec![None; n], changed: vec![false; n] }
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
        }
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
index!(RealVar, f64, Real);
index!(IntegerVar, i32, Integer);
index!(BooleanVar, bool, Boolean);
