//! Getting and setting of variables, with the checks that hold for all of them.

use super::{Call, Instance, Mode, Refused};
use crate::Host;
use crate::unit::{LogCategory, Stage};
use crate::values::{READ, Value, WRITE, all_finite};
use crate::variables::{Causality, Variability, Variable};

impl Instance {
    /// Checks a get of `vr` and brings its value up to date.
    fn before_get(&mut self, function: &str, vr: u32, type_name: &str) -> Call {
        let v = self.variable(function, vr, type_name)?;
        let (settable, on_demand) = (v.causality.settable(), v.on_demand);
        let stage = match self.mode {
            Mode::Instantiated if settable => return Ok(()),
            Mode::Instantiated => {
                return Err(Refused::error(format!(
                    "{function}: '{}' has no value before initialization mode",
                    self.model.table.variables()[vr as usize].name
                )));
            }
            Mode::Initialization => Stage::Initialization,
            Mode::Poisoned => return self.require(function, &[Mode::Initialization, Mode::StepComplete]),
            _ => Stage::Stepping,
        };
        if !settable && (on_demand || stage == Stage::Initialization) {
            let r = self.unit.refresh(&mut self.values, host!(self), vr, stage);
            self.take(function, r)?;
        }
        Ok(())
    }

    /// Checks a set of `vr`.
    fn before_set(&self, function: &str, vr: u32, type_name: &str) -> Call<&Variable> {
        let v = self.variable(function, vr, type_name)?;
        if !v.causality.settable() {
            return Err(Refused::error(format!("{function}: {v} cannot be set; allowed: inputs and parameters")));
        }
        let late = match self.mode {
            Mode::Instantiated | Mode::Initialization => false,
            Mode::StepComplete => v.causality == Causality::Parameter && v.variability == Variability::Fixed,
            _ => {
                self.require(function, &[Mode::Instantiated, Mode::Initialization, Mode::StepComplete])?;
                false
            }
        };
        if late {
            return Err(Refused::error(format!(
                "{function}: fixed parameter '{}' cannot be set after initialization mode",
                v.name
            )));
        }
        if let Some(reason) = self.values.lock_of(vr) {
            return Err(Refused::error(format!("{function}: '{}' comes too late: {reason}", v.name)));
        }
        Ok(v)
    }

    fn not_finite(&self, function: &str, vr: u32, x: f64, at: Option<usize>) -> Refused {
        let at = at.map(|i| format!(" at element {i}")).unwrap_or_default();
        let name = &self.model.table.variables()[vr as usize].name;
        Refused::error(format!("{function}: '{name}'{at} is {x}; allowed: finite values"))
    }

    /// Reads a real.
    ///
    /// # Errors
    /// Unknown reference, wrong type, wrong mode, late work that fails, a value that is not finite.
    pub fn real(&mut self, vr: u32) -> Call<f64> {
        // Thousands of these a step: nothing needs to be brought up to date, and the table has been asked before.
        if self.mode == Mode::StepComplete && self.values.quick.get(vr as usize).is_some_and(|q| q & READ != 0) {
            let x = self.values.reals[vr as usize];
            if x.is_finite() {
                return Ok(x);
            }
        }
        self.before_get("fmi2GetReal", vr, "Real")?;
        let x = self.values.reals[vr as usize];
        if x.is_finite() {
            return Ok(x);
        }
        self.mode = Mode::Poisoned;
        Err(Refused { category: LogCategory::Numerical, ..self.not_finite("fmi2GetReal", vr, x, None) })
    }
    /// Reads several reals; both slices are equally long.
    ///
    /// # Errors
    /// As [`Instance::real`].
    pub fn reals(&mut self, vr: &[u32], to: &mut [f64]) -> Call {
        if self.mode == Mode::StepComplete && self.values.read_run(vr, to) {
            return Ok(());
        }
        for (vr, to) in vr.iter().zip(to) {
            *to = self.real(*vr)?;
        }
        Ok(())
    }
    /// Writes several reals; both slices are equally long.
    ///
    /// # Errors
    /// As [`Instance::set_real`]; those before the faulty one are set then.
    pub fn set_reals(&mut self, vr: &[u32], values: &[f64]) -> Call {
        if self.mode == Mode::StepComplete && self.values.write_run(vr, values) {
            return Ok(());
        }
        vr.iter().zip(values).try_for_each(|(vr, x)| self.set_real(*vr, *x))
    }
    /// Writes a real.
    ///
    /// # Errors
    /// Unknown reference, wrong type, not settable, too late, not finite, outside its range.
    pub fn set_real(&mut self, vr: u32, x: f64) -> Call {
        if self.mode == Mode::StepComplete
            && self.values.quick.get(vr as usize).is_some_and(|q| q & WRITE != 0)
            && x.is_finite()
        {
            self.store_real(vr, x);
            return Ok(());
        }
        let v = self.before_set("fmi2SetReal", vr, "Real")?;
        if !x.is_finite() {
            return Err(self.not_finite("fmi2SetReal", vr, x, None));
        }
        in_range("fmi2SetReal", v, x)?;
        self.store_real(vr, x);
        Ok(())
    }
    /// Reads an integer.
    ///
    /// # Errors
    /// As [`Instance::real`].
    pub fn integer(&mut self, vr: u32) -> Call<i32> {
        self.before_get("fmi2GetInteger", vr, "Integer")?;
        match self.values.values[vr as usize] {
            Value::Integer(x) => Ok(x),
            _ => unreachable!("checked against the table"),
        }
    }
    /// Writes an integer.
    ///
    /// # Errors
    /// As [`Instance::set_real`].
    pub fn set_integer(&mut self, vr: u32, x: i32) -> Call {
        let v = self.before_set("fmi2SetInteger", vr, "Integer")?;
        in_range("fmi2SetInteger", v, x.into())?;
        self.store(vr, Value::Integer(x));
        Ok(())
    }
    /// Reads a Boolean.
    ///
    /// # Errors
    /// As [`Instance::real`].
    pub fn boolean(&mut self, vr: u32) -> Call<bool> {
        self.before_get("fmi2GetBoolean", vr, "Boolean")?;
        match self.values.values[vr as usize] {
            Value::Boolean(x) => Ok(x),
            _ => unreachable!("checked against the table"),
        }
    }
    /// Writes a Boolean.
    ///
    /// # Errors
    /// As [`Instance::set_real`].
    pub fn set_boolean(&mut self, vr: u32, x: bool) -> Call {
        self.before_set("fmi2SetBoolean", vr, "Boolean")?;
        self.store(vr, Value::Boolean(x));
        Ok(())
    }
    /// Reads a string.
    ///
    /// # Errors
    /// As [`Instance::real`].
    pub fn string(&mut self, vr: u32) -> Call<&str> {
        self.before_get("fmi2GetString", vr, "String")?;
        match &self.values.values[vr as usize] {
            Value::String(x) => Ok(x),
            _ => unreachable!("checked against the table"),
        }
    }
    /// Writes a string.
    ///
    /// # Errors
    /// As [`Instance::set_real`].
    pub fn set_string(&mut self, vr: u32, x: &str) -> Call {
        self.before_set("fmi2SetString", vr, "String")?;
        self.store(vr, Value::String(x.into()));
        Ok(())
    }
    /// Gives the derivative of an input, of order 1 or higher, for the step that comes.
    ///
    /// # Errors
    /// A model that does not interpolate, no Real input, an order below 1, a value that is not finite.
    pub fn set_derivative(&mut self, vr: u32, order: i32, x: f64) -> Call {
        let function = "fmi2SetRealInputDerivatives";
        if !self.model.interpolates_inputs {
            return Err(Refused::error(format!(
                "{function}: this unit does not interpolate its inputs (canInterpolateInputs is false)"
            )));
        }
        let v = self.before_set(function, vr, "Real")?;
        if v.causality != Causality::Input || order < 1 {
            return Err(Refused::error(format!("{function}: order {order} of {v}; allowed: inputs, orders from 1")));
        }
        if !x.is_finite() {
            return Err(self.not_finite(function, vr, x, None));
        }
        self.values.set_derivative(vr, order, x);
        Ok(())
    }
    fn store_real(&mut self, vr: u32, x: f64) {
        self.values.reals[vr as usize] = x;
        self.values.mark_changed(vr);
    }
    fn store(&mut self, vr: u32, value: Value) {
        self.values.values[vr as usize] = value;
        self.values.mark_changed(vr);
    }

    /// Elements of an array now.
    ///
    /// # Errors
    /// Unknown reference, not an array, wrong mode, late work that fails.
    pub fn array_size(&mut self, vr: u32) -> Call<usize> {
        let function = "terramech_getArraySize";
        let v = self.model.table.variables().get(vr as usize);
        let Some(v) = v.filter(|v| v.start.is_array()) else {
            return Err(Refused::error(format!(
                "{function}: value reference {vr} is not an array of model {}",
                self.model.name
            )));
        };
        self.before_get(function, vr, v.start.type_name())?;
        Ok(match &self.values.values[vr as usize] {
            Value::RealArray(x) => x.len(),
            Value::IntegerArray(x) => x.len(),
            _ => unreachable!("checked against the table"),
        })
    }
    /// Reads a real array.
    ///
    /// # Errors
    /// As [`Instance::array_size`], and values that are not finite.
    pub fn real_array(&mut self, vr: u32) -> Call<&[f64]> {
        let function = "terramech_getRealArray";
        self.before_get(function, vr, "RealArray")?;
        let bad = match &self.values.values[vr as usize] {
            Value::RealArray(x) => first_not_finite(x),
            _ => unreachable!("checked against the table"),
        };
        if let Some((i, x)) = bad {
            self.mode = Mode::Poisoned;
            return Err(Refused { category: LogCategory::Numerical, ..self.not_finite(function, vr, x, Some(i)) });
        }
        match &self.values.values[vr as usize] {
            Value::RealArray(x) => Ok(x),
            _ => unreachable!("checked against the table"),
        }
    }
    /// Writes a real array and sets its size.
    ///
    /// # Errors
    /// As [`Instance::set_real`].
    pub fn set_real_array(&mut self, vr: u32, x: &[f64]) -> Call {
        let function = "terramech_setRealArray";
        self.before_set(function, vr, "RealArray")?;
        if let Some((i, x)) = first_not_finite(x) {
            return Err(self.not_finite(function, vr, x, Some(i)));
        }
        match &mut self.values.values[vr as usize] {
            Value::RealArray(to) => {
                to.clear();
                to.extend_from_slice(x);
            }
            _ => unreachable!("checked against the table"),
        }
        self.values.mark_changed(vr);
        Ok(())
    }
    /// Reads an integer array.
    ///
    /// # Errors
    /// As [`Instance::array_size`].
    pub fn integer_array(&mut self, vr: u32) -> Call<&[i32]> {
        self.before_get("terramech_getIntegerArray", vr, "IntegerArray")?;
        match &self.values.values[vr as usize] {
            Value::IntegerArray(x) => Ok(x),
            _ => unreachable!("checked against the table"),
        }
    }
    /// Writes an integer array and sets its size.
    ///
    /// # Errors
    /// As [`Instance::set_real`].
    pub fn set_integer_array(&mut self, vr: u32, x: &[i32]) -> Call {
        self.before_set("terramech_setIntegerArray", vr, "IntegerArray")?;
        match &mut self.values.values[vr as usize] {
            Value::IntegerArray(to) => {
                to.clear();
                to.extend_from_slice(x);
            }
            _ => unreachable!("checked against the table"),
        }
        self.values.mark_changed(vr);
        Ok(())
    }
}

fn in_range(function: &str, v: &Variable, x: f64) -> Call {
    if v.min.is_some_and(|m| x < m) || v.max.is_some_and(|m| x > m) {
        let bound = |b: Option<f64>| b.map_or("unbounded".into(), |b| b.to_string());
        return Err(Refused::error(format!(
            "{function}: '{}' is {x} {}; allowed: {} to {}",
            v.name,
            v.unit,
            bound(v.min),
            bound(v.max)
        )));
    }
    Ok(())
}

fn first_not_finite(x: &[f64]) -> Option<(usize, f64)> {
    if all_finite(x) {
        return None;
    }
    x.iter().copied().enumerate().find(|(_, x)| !x.is_finite())
}
