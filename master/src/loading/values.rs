//! Batches of values: one call per unit and base type, into buffers that are used again.

use std::collections::HashMap;

use crate::model_description::Kind;

/// The C types behind FMI's base types: an enumeration is an Integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Class {
    /// `fmi2Real`.
    Real,
    /// `fmi2Integer`.
    Integer,
    /// `fmi2Boolean`.
    Boolean,
    /// `fmi2String`.
    String,
}

impl From<Kind> for Class {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Real => Self::Real,
            Kind::Integer | Kind::Enumeration => Self::Integer,
            Kind::Boolean => Self::Boolean,
            Kind::String => Self::String,
        }
    }
}

/// Variables of one class that are read by one call.
#[derive(Clone, Debug, Default)]
pub struct Batch<T> {
    /// Value references, as C wants them.
    pub references: Vec<u32>,
    /// The values of the last read, in the same order.
    pub values: Vec<T>,
    /// Indices into the model's variables, for messages.
    pub variables: Vec<usize>,
}

impl<T: Default> Batch<T> {
    fn add(&mut self, reference: u32, variable: usize) -> usize {
        self.references.push(reference);
        self.variables.push(variable);
        self.values.push(T::default());
        self.references.len() - 1
    }
}

impl Batch<f64> {
    /// Whether all values are finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        match self.values.as_slice() {
            [x] => x.is_finite(),
            values => terramech_simd::all_finite(values),
        }
    }
}

/// An array with a buffer that keeps its room when the array changes its size.
#[derive(Clone, Debug)]
pub struct Array<T> {
    /// Value reference.
    pub reference: u32,
    /// Index into the model's arrays, for messages.
    pub array: usize,
    /// The elements of the last read.
    pub values: Vec<T>,
}

/// Where a value lies in an [`Outputs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// In a batch.
    Scalar(Class, usize),
    /// In `real_arrays`.
    RealArray(usize),
    /// In `integer_arrays`.
    IntegerArray(usize),
}

/// A set of variables of one unit that are read together. Adding one twice gives the same slot.
#[derive(Clone, Debug, Default)]
pub struct Outputs {
    /// Reals.
    pub reals: Batch<f64>,
    /// Integers and enumerations.
    pub integers: Batch<i32>,
    /// Booleans: 0 is false.
    pub booleans: Batch<i32>,
    /// Strings.
    pub strings: Batch<String>,
    /// Arrays of reals.
    pub real_arrays: Vec<Array<f64>>,
    /// Arrays of integers.
    pub integer_arrays: Vec<Array<i32>>,
    known: HashMap<(Option<Class>, u32), Slot>,
    /// Whether there is something else than Reals.
    mixed: bool,
}

impl Outputs {
    /// Whether there is nothing to read.
    pub fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// Whether there are Reals and nothing else, so that one call reads all.
    #[inline]
    pub fn is_plain(&self) -> bool {
        !self.mixed && !self.reals.references.is_empty()
    }

    /// Adds a scalar: its class, value reference and index into the model's variables.
    pub fn scalar(&mut self, class: Class, reference: u32, variable: usize) -> Slot {
        if let Some(&slot) = self.known.get(&(Some(class), reference)) {
            return slot;
        }
        let at = match class {
            Class::Real => self.reals.add(reference, variable),
            Class::Integer => self.integers.add(reference, variable),
            Class::Boolean => self.booleans.add(reference, variable),
            Class::String => self.strings.add(reference, variable),
        };
        let slot = Slot::Scalar(class, at);
        self.known.insert((Some(class), reference), slot);
        self.mixed |= class != Class::Real;
        slot
    }

    /// Adds an array: whether it holds integers, its value reference and index into the model's arrays.
    pub fn array(&mut self, kind: Kind, reference: u32, array: usize) -> Slot {
        if let Some(&slot) = self.known.get(&(None, reference)) {
            return slot;
        }
        let slot = if Class::from(kind) == Class::Integer {
            self.integer_arrays.push(Array { reference, array, values: Vec::new() });
            Slot::IntegerArray(self.integer_arrays.len() - 1)
        } else {
            self.real_arrays.push(Array { reference, array, values: Vec::new() });
            Slot::RealArray(self.real_arrays.len() - 1)
        };
        self.known.insert((None, reference), slot);
        self.mixed = true;
        slot
    }

    /// A scalar as a number; a string is not a number.
    pub fn number(&self, slot: Slot) -> f64 {
        match slot {
            Slot::Scalar(Class::Real, i) => self.reals.values[i],
            Slot::Scalar(Class::Integer, i) => f64::from(self.integers.values[i]),
            Slot::Scalar(Class::Boolean, i) => f64::from(u8::from(self.booleans.values[i] != 0)),
            _ => f64::NAN,
        }
    }

    /// Elements of a real array; empty for any other slot.
    pub fn reals_of(&self, slot: Slot) -> &[f64] {
        if let Slot::RealArray(i) = slot { &self.real_arrays[i].values } else { &[] }
    }

    /// Elements of an integer array; empty for any other slot.
    pub fn integers_of(&self, slot: Slot) -> &[i32] {
        if let Slot::IntegerArray(i) = slot { &self.integer_arrays[i].values } else { &[] }
    }

    /// The first value that is not finite: the variable or array element, and the value.
    #[inline]
    pub fn not_finite(&self) -> Option<(NotFinite, f64)> {
        let suspicious = |values: &[f64]| !terramech_simd::all_finite(values);
        let find = |values: &[f64]| values.iter().position(|x| !x.is_finite());
        if suspicious(&self.reals.values)
            && let Some(i) = find(&self.reals.values)
        {
            return Some((NotFinite::Variable(self.reals.variables[i]), self.reals.values[i]));
        }
        self.real_arrays.iter().filter(|a| suspicious(&a.values)).find_map(|a| {
            let i = find(&a.values)?;
            Some((NotFinite::Element(a.array, i), a.values[i]))
        })
    }
}

/// What is not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotFinite {
    /// A scalar, by index into the model's variables.
    Variable(usize),
    /// An element of an array: index into the model's arrays, and into the array.
    Element(usize, usize),
}

/// Scalars of one unit to be set together; emptied and filled again at each communication point.
#[derive(Clone, Debug, Default)]
pub struct Sets {
    /// References and values of reals.
    pub reals: (Vec<u32>, Vec<f64>),
    /// Of integers and enumerations.
    pub integers: (Vec<u32>, Vec<i32>),
    /// Of Booleans.
    pub booleans: (Vec<u32>, Vec<i32>),
    /// Of strings.
    pub strings: (Vec<u32>, Vec<String>),
    /// References, orders and values of derivatives of Real inputs, set after all others.
    pub derivatives: (Vec<u32>, Vec<i32>, Vec<f64>),
}

impl Sets {
    /// Empties the lists and keeps their room.
    pub fn clear(&mut self) {
        self.reals.0.clear();
        self.reals.1.clear();
        self.integers.0.clear();
        self.integers.1.clear();
        self.booleans.0.clear();
        self.booleans.1.clear();
        self.strings.0.clear();
        self.strings.1.clear();
        self.derivatives.0.clear();
        self.derivatives.1.clear();
        self.derivatives.2.clear();
    }

    /// Adds the derivative of an order of a Real input.
    pub fn derivative(&mut self, reference: u32, order: i32, value: f64) {
        self.derivatives.0.push(reference);
        self.derivatives.1.push(order);
        self.derivatives.2.push(value);
    }

    /// Adds a real.
    pub fn real(&mut self, reference: u32, value: f64) {
        self.reals.0.push(reference);
        self.reals.1.push(value);
    }

    /// Adds an integer or enumeration.
    pub fn integer(&mut self, reference: u32, value: i32) {
        self.integers.0.push(reference);
        self.integers.1.push(value);
    }

    /// Adds a Boolean.
    pub fn boolean(&mut self, reference: u32, value: bool) {
        self.booleans.0.push(reference);
        self.booleans.1.push(i32::from(value));
    }

    /// Adds a string.
    pub fn string(&mut self, reference: u32, value: impl Into<String>) {
        self.strings.0.push(reference);
        self.strings.1.push(value.into());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_is_found_among_few_and_many() {
        for n in [1, 2, 9] {
            for bad in [f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut outputs = Outputs::default();
                for i in 0..n {
                    outputs.scalar(Class::Real, i, i as usize);
                }
                outputs.reals.values.fill(-f64::MAX);
                outputs.reals.values[0] = -0.0;
                assert!(outputs.is_plain() && outputs.reals.is_finite() && outputs.not_finite().is_none());
                let last = n as usize - 1;
                outputs.reals.values[last] = bad;
                assert!(!outputs.reals.is_finite());
                assert!(matches!(outputs.not_finite(), Some((NotFinite::Variable(v), _)) if v == last));
            }
        }
    }
}
