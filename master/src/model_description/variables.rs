//! `ModelVariables`, and our arrays under `VendorAnnotations`.

use super::types::Names;
use super::{ArrayVariable, Causality, Initial, Item, Kind, ModelDescription, Value, Variability, Variable};
use crate::fault::{FaultKind, Faults};
use crate::xml::{Element, boolean};

/// Reads the scalars into the model.
pub fn read(list: Element<'_>, names: &Names, model: &mut ModelDescription, faults: &mut Faults) {
    for e in list.all("ScalarVariable") {
        // A variable that cannot be read keeps its place: ModelStructure counts them.
        let variable = scalar(e, names, model, faults).unwrap_or_else(|| unreadable(e));
        let key = (variable.kind, variable.value_reference);
        let index = model.variables.len();
        model.variables.push(variable);
        model.by_reference.entry(key).or_insert(index);
        model.enter(Item::Scalar(index), e, faults);
    }
}

/// The stand-in of a variable that has faults; the model is refused anyway.
fn unreadable(e: Element<'_>) -> Variable {
    Variable {
        name: e.attribute("name").unwrap_or_default().into(),
        value_reference: 0,
        kind: Kind::Real,
        causality: Causality::Local,
        variability: Variability::Continuous,
        initial: None,
        start: None,
        min: None,
        max: None,
        unit: None,
        declared_type: None,
        description: None,
        line: e.line(),
    }
}

fn scalar(e: Element<'_>, names: &Names, model: &mut ModelDescription, faults: &mut Faults) -> Option<Variable> {
    let name = e.required("name", faults);
    let value_reference = reference(e, faults);
    let causality = e.parsed("causality", Causality::ALLOWED, faults, Causality::of).unwrap_or(Causality::Local);
    let variability =
        e.parsed("variability", Variability::ALLOWED, faults, Variability::of).unwrap_or(Variability::Continuous);
    let initial = e
        .parsed("initial", Initial::ALLOWED, faults, Initial::of)
        .or_else(|| initial_by_default(causality, variability));
    let Some((kind, body)) = e.children().find_map(|c| Kind::of(c.name()).map(|kind| (kind, c))) else {
        let kind = FaultKind::MissingElement { name: "Real, Integer, Boolean, String or Enumeration" };
        faults.add(&e.place(), e.label(), kind);
        return None;
    };
    let declared_type = match body.attribute("declaredType") {
        None if kind == Kind::Enumeration => {
            faults.add(&body.place(), body.label(), FaultKind::MissingAttribute { name: "declaredType" });
            None
        }
        None => None,
        Some(given) => match names.type_of(given).filter(|&index| model.types[index].kind == kind) {
            Some(index) => Some(index),
            None => {
                body.bad_value("declaredType", given, &format!("a SimpleType of kind {kind}"), faults);
                None
            }
        },
    };
    let inherited = declared_type.map(|index| &model.types[index]);
    let (type_unit, type_min, type_max) =
        inherited.map_or((None, None, None), |inherited| (inherited.unit, inherited.min, inherited.max));
    let unit = match body.attribute("unit") {
        Some(unit) => Some(names.unit(unit, body, model, faults)),
        None => type_unit,
    };
    let start = body.attribute("start").and_then(|text| {
        let value = value_of(kind, text);
        if value.is_none() {
            body.bad_value("start", text, allowed_value(kind), faults);
        }
        value
    });
    let min = body.real("min", faults).or(type_min);
    let max = body.real("max", faults).or(type_max);
    if let (Some(low), Some(high)) = (min, max)
        && low > high
    {
        body.bad_value("min", &low.to_string(), &format!("at most max = {high}"), faults);
    }
    let variable = Variable {
        name: name?.into(),
        value_reference: value_reference?,
        kind,
        causality,
        variability,
        initial,
        start,
        min,
        max,
        unit,
        declared_type,
        description: e.attribute("description").map(Into::into),
        line: e.line(),
    };
    if variable.start.is_none() && (causality == Causality::Parameter || causality == Causality::Input) {
        faults.note(&e.place(), e.label(), format!("a variable of causality {causality} should have a start value"));
    }
    Some(variable)
}

fn reference(e: Element<'_>, faults: &mut Faults) -> Option<u32> {
    e.required("valueReference", faults)?;
    e.parsed("valueReference", "a whole number from 0 to 4294967295", faults, |text| text.parse().ok())
}

/// The default of `initial` by causality and variability: FMI 2.0, section 2.2.7, the table of combinations.
fn initial_by_default(causality: Causality, variability: Variability) -> Option<Initial> {
    match (causality, variability) {
        (Causality::Input | Causality::Independent, _) => None,
        (Causality::Parameter, _) => Some(Initial::Exact),
        (Causality::CalculatedParameter, _) => Some(Initial::Calculated),
        (Causality::Output | Causality::Local, Variability::Constant) => Some(Initial::Exact),
        (Causality::Output | Causality::Local, _) => Some(Initial::Calculated),
    }
}

/// Reads a value of a kind from the text of an attribute. Reals must be finite.
pub fn value_of(kind: Kind, text: &str) -> Option<Value> {
    let trimmed = text.trim();
    match kind {
        Kind::Real => trimmed.parse().ok().filter(|v: &f64| v.is_finite()).map(Value::Real),
        Kind::Integer | Kind::Enumeration => trimmed.parse().ok().map(Value::Integer),
        Kind::Boolean => boolean(trimmed).map(Value::Boolean),
        Kind::String => Some(Value::String(text.to_owned())),
    }
}

/// What [`value_of`] takes, in words.
pub fn allowed_value(kind: Kind) -> &'static str {
    match kind {
        Kind::Real => "a finite number",
        Kind::Integer => "a whole number from -2147483648 to 2147483647",
        Kind::Enumeration => "the whole number of an item",
        Kind::Boolean => "true, false, 1 or 0",
        Kind::String => "a text",
    }
}

/// Reads the arrays announced under our `Tool` element.
pub fn read_arrays(tool: Element<'_>, names: &Names, model: &mut ModelDescription, faults: &mut Faults) {
    let mut read = Vec::new();
    for e in tool.all("Array") {
        let name = e.required("name", faults);
        let value_reference = reference(e, faults);
        let kind = match e.required("type", faults) {
            Some("Real") => Some(Kind::Real),
            Some("Integer") => Some(Kind::Integer),
            Some(given) => {
                e.bad_value("type", given, "Real or Integer", faults);
                None
            }
            None => None,
        };
        let causality = e.required("causality", faults).and_then(|given| {
            let causality = Causality::of(given)
                .filter(|c| matches!(c, Causality::Input | Causality::Output | Causality::CalculatedParameter));
            if causality.is_none() {
                e.bad_value("causality", given, "input, output or calculatedParameter", faults);
            }
            causality
        });
        let variability = e.parsed("variability", "fixed, discrete or continuous", faults, |word| {
            Variability::of(word)
                .filter(|v| matches!(v, Variability::Fixed | Variability::Discrete | Variability::Continuous))
        });
        let unit = e.attribute("unit").map(|unit| names.unit(unit, e, model, faults));
        let (Some(name), Some(value_reference), Some(kind), Some(causality)) = (name, value_reference, kind, causality)
        else {
            continue;
        };
        if model.by_reference.contains_key(&(kind, value_reference)) {
            e.bad_value("valueReference", &value_reference.to_string(), "one that no scalar of that type has", faults);
        }
        let fixed = causality == Causality::CalculatedParameter;
        model.arrays.push(ArrayVariable {
            name: name.into(),
            value_reference,
            kind,
            causality,
            variability: variability.unwrap_or(if fixed { Variability::Fixed } else { Variability::Continuous }),
            unit,
            initial_dependencies: Vec::new(),
            description: e.attribute("description").map(Into::into),
            line: e.line(),
        });
        let index = model.arrays.len() - 1;
        model.enter(Item::Array(index), e, faults);
        read.push((index, e));
    }
    // Dependencies may name arrays that come later.
    for (index, e) in read {
        model.arrays[index].initial_dependencies = dependencies(e, model, faults);
    }
    // ModelStructure speaks of scalars only; a scalar that depends on an array says so here. Its list there holds the rest.
    for e in tool.all("Scalar") {
        let Some(name) = e.required("name", faults) else { continue };
        match model.find(name) {
            Some(Item::Scalar(index)) => {
                let items = dependencies(e, model, faults);
                model.array_dependencies.insert(index, items);
            }
            _ => e.bad_value("name", name, "the name of a scalar variable of this model", faults),
        }
    }
}

fn dependencies(e: Element<'_>, model: &ModelDescription, faults: &mut Faults) -> Vec<Item> {
    let mut items = Vec::new();
    for d in e.all("InitialDependency") {
        let Some(name) = d.required("name", faults) else { continue };
        match model.find(name) {
            Some(item) => items.push(item),
            None => d.bad_value("name", name, "the name of a variable or array of this model", faults),
        }
    }
    items
}
