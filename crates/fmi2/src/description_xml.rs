//! Writes `modelDescription.xml` (FMI 2.0) from a model's variable table.

use crate::variables::{Causality, Start, Variability, Variable};
use crate::{LogCategory, Model};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesStart, Event};
use std::collections::BTreeSet;

/// Name of our `VendorAnnotations` tool.
pub const TOOL: &str = "org.terramech";

/// A unit's base units: exponents of kg, m, s, rad. Every unit a table may use.
fn base_unit(unit: &str) -> Option<[(&'static str, i32); 4]> {
    let (kg, m, s, rad) = match unit {
        "1" => (0, 0, 0, 0),
        "kg" => (1, 0, 0, 0),
        "m" => (0, 1, 0, 0),
        "s" => (0, 0, 1, 0),
        "rad" => (0, 0, 0, 1),
        "1/s" => (0, 0, -1, 0),
        "m/s" => (0, 1, -1, 0),
        "m/s2" => (0, 1, -2, 0),
        "rad/s" => (0, 0, -1, 1),
        "rad/s2" => (0, 0, -2, 1),
        "N" => (1, 1, -2, 0),
        "N.m" => (1, 2, -2, 0),
        "N/m" => (1, 0, -2, 0),
        "m/N" => (-1, 0, 2, 0),
        "N.s" => (1, 1, -1, 0),
        "N.s/m" => (1, 0, -1, 0),
        "N/s" => (1, 1, -3, 0),
        "Pa" => (1, -1, -2, 0),
        "J" => (1, 2, -2, 0),
        "W" => (1, 2, -3, 0),
        "kg/m3" => (1, -3, 0, 0),
        "kg.m2" => (1, 2, 0, 0),
        "m2" => (0, 2, 0, 0),
        "m3" => (0, 3, 0, 0),
        _ => return None,
    };
    Some([("kg", kg), ("m", m), ("s", s), ("rad", rad)])
}

/// What the GUID is made of: everything a connected tool may rely on, in a fixed order.
pub(crate) fn canonical(model: &Model) -> String {
    let mut text = format!("{}\n", model.name);
    for v in model.table.variables() {
        text += &format!(
            "{}|{}|{}|{}|{}|{:?}|{:?}|{:?}\n",
            v.name,
            v.causality.word(),
            v.variability.word(),
            v.start.type_name(),
            v.unit,
            v.min,
            v.max,
            v.initial_dependencies
        );
    }
    text
}

/// The document, indented, ending with a line feed.
///
/// # Panics
/// When the table names a unit this module does not know (a bug found by any test that writes the description).
pub fn write(model: &Model) -> String {
    let mut w = Writer::new_with_indent(Vec::new(), b' ', 2);
    document(&mut w, model).expect("writing into memory does not fail");
    String::from_utf8(w.into_inner()).expect("written as UTF-8") + "\n"
}

type W = Writer<Vec<u8>>;

fn empty(w: &mut W, name: &str, attributes: &[(&str, String)]) -> std::io::Result<()> {
    w.write_event(Event::Empty(element(name, attributes)))
}

fn element(name: &str, attributes: &[(&str, String)]) -> BytesStart<'static> {
    let mut e = BytesStart::new(name.to_string());
    for (key, value) in attributes {
        e.push_attribute((*key, value.as_str()));
    }
    e
}

fn group(
    w: &mut W,
    name: &str,
    attributes: &[(&str, String)],
    body: impl FnOnce(&mut W) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let e = element(name, attributes);
    w.write_event(Event::Start(e.borrow()))?;
    body(w)?;
    w.write_event(Event::End(e.to_end()))
}

fn document(w: &mut W, model: &Model) -> std::io::Result<()> {
    w.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let vars = model.table.variables();
    let root = [
        ("fmiVersion", "2.0".to_string()),
        ("modelName", model.name.into()),
        ("guid", model.guid()),
        ("description", model.description.into()),
        ("author", "Terramech".into()),
        ("version", env!("CARGO_PKG_VERSION").into()),
        ("copyright", "The Terramech authors".into()),
        ("license", "MIT OR Apache-2.0".into()),
        ("generationTool", concat!("terramech ", env!("CARGO_PKG_VERSION")).into()),
        ("variableNamingConvention", "structured".into()),
        ("numberOfEventIndicators", "0".into()),
    ];
    group(w, "fmiModelDescription", &root, |w| {
        empty(
            w,
            "CoSimulation",
            &[
                ("modelIdentifier", model.name.to_string()),
                ("canHandleVariableCommunicationStepSize", "true".into()),
                ("canInterpolateInputs", model.interpolates_inputs.to_string()),
                ("maxOutputDerivativeOrder", "0".into()),
                ("canRunAsynchronuously", "false".into()),
                ("canBeInstantiatedOnlyOncePerProcess", "false".into()),
                ("canNotUseMemoryManagementFunctions", "true".into()),
                ("canGetAndSetFMUstate", "true".into()),
                ("canSerializeFMUstate", "true".into()),
                ("providesDirectionalDerivative", "false".into()),
            ],
        )?;
        units(w, vars)?;
        group(w, "LogCategories", &[], |w| {
            for c in LogCategory::ALL {
                empty(w, "Category", &[("name", c.name().into()), ("description", c.describe().into())])?;
            }
            Ok(())
        })?;
        empty(
            w,
            "DefaultExperiment",
            &[
                ("startTime", "0".to_string()),
                ("stopTime", model.default_stop.to_string()),
                ("stepSize", model.default_step.to_string()),
            ],
        )?;
        annotations(w, model)?;
        group(w, "ModelVariables", &[], |w| {
            for (vr, v) in scalars(vars) {
                scalar(w, vr, v)?;
            }
            Ok(())
        })?;
        structure(w, vars)
    })
}

fn scalars(vars: &[Variable]) -> impl Iterator<Item = (usize, &Variable)> {
    vars.iter().enumerate().filter(|(_, v)| !v.start.is_array())
}

fn units(w: &mut W, vars: &[Variable]) -> std::io::Result<()> {
    let used: BTreeSet<&str> =
        vars.iter().filter(|v| matches!(v.start, Start::Real(_) | Start::RealArray)).map(|v| v.unit).collect();
    group(w, "UnitDefinitions", &[], |w| {
        for unit in used {
            let base =
                base_unit(unit).unwrap_or_else(|| panic!("unit '{unit}' has no base unit in description_xml.rs"));
            let exponents: Vec<(&str, String)> =
                base.into_iter().filter(|(_, e)| *e != 0).map(|(n, e)| (n, e.to_string())).collect();
            group(w, "Unit", &[("name", unit.into())], |w| empty(w, "BaseUnit", &exponents))?;
        }
        Ok(())
    })
}

fn annotations(w: &mut W, model: &Model) -> std::io::Result<()> {
    let vars = model.table.variables();
    group(w, "VendorAnnotations", &[], |w| {
        // The schema allows a Tool one child, and one Tool a name: a wrapper holds the list.
        let tool = element("Tool", &[("name", TOOL.into())]);
        w.write_event(Event::Start(tool.borrow()))?;
        group(w, "Extension", &[("version", "1".into())], |w| {
            empty(w, "Weight", &[("value", model.weight.to_string())])?;
            if model.spreads {
                empty(w, "Team", &[])?;
            }
            for (vr, v) in vars.iter().enumerate().filter(|(_, v)| v.start.is_array()) {
                let kind = if v.start == Start::RealArray { "Real" } else { "Integer" };
                let mut a = vec![
                    ("name", v.name.clone()),
                    ("valueReference", vr.to_string()),
                    ("type", kind.into()),
                    ("causality", v.causality.word().into()),
                    ("variability", v.variability.word().into()),
                ];
                if !v.unit.is_empty() {
                    a.push(("unit", v.unit.into()));
                }
                a.push(("description", v.description.clone()));
                dependencies_of(w, "Array", &a, vars, v)?;
            }
            // ModelStructure speaks of scalars only: a scalar that depends on an array says so here.
            for (_, v) in scalars(vars).filter(|(_, v)| depends_on_array(vars, v)) {
                dependencies_of(w, "Scalar", &[("name", v.name.clone())], vars, v)?;
            }
            Ok(())
        })?;
        w.write_event(Event::End(tool.to_end()))
    })
}

fn depends_on_array(vars: &[Variable], v: &Variable) -> bool {
    v.initial_dependencies.iter().any(|&d| vars[d as usize].start.is_array())
}

fn dependencies_of(
    w: &mut W,
    name: &str,
    a: &[(&str, String)],
    vars: &[Variable],
    v: &Variable,
) -> std::io::Result<()> {
    if v.initial_dependencies.is_empty() {
        return empty(w, name, a);
    }
    group(w, name, a, |w| {
        for &d in &v.initial_dependencies {
            empty(w, "InitialDependency", &[("name", vars[d as usize].name.clone())])?;
        }
        Ok(())
    })
}

fn scalar(w: &mut W, vr: usize, v: &Variable) -> std::io::Result<()> {
    // Outputs and calculated parameters are computed; everything else starts exactly at its start value.
    let exact = v.causality.settable();
    let mut a = vec![
        ("name", v.name.clone()),
        ("valueReference", vr.to_string()),
        ("description", v.description.clone()),
        ("causality", v.causality.word().into()),
        ("variability", v.variability.word().into()),
    ];
    if v.causality != Causality::Input {
        a.push(("initial", if exact { "exact" } else { "calculated" }.into()));
    }
    group(w, "ScalarVariable", &a, |w| {
        let mut t = Vec::new();
        if let Start::Real(_) = v.start {
            t.push(("unit", v.unit.to_string()));
        }
        if let Some(min) = v.min {
            t.push(("min", min.to_string()));
        }
        if let Some(max) = v.max {
            t.push(("max", max.to_string()));
        }
        if exact {
            t.push((
                "start",
                match &v.start {
                    Start::Real(x) => x.to_string(),
                    Start::Integer(x) => x.to_string(),
                    Start::Boolean(x) => x.to_string(),
                    Start::String(x) => x.clone(),
                    Start::RealArray | Start::IntegerArray => unreachable!("scalars only"),
                },
            ));
        }
        empty(w, v.start.type_name(), &t)
    })
}

fn structure(w: &mut W, vars: &[Variable]) -> std::io::Result<()> {
    // The standard counts scalar variables from 1 in the order of the document.
    let mut index = vec![0usize; vars.len()];
    for (i, (vr, _)) in scalars(vars).enumerate() {
        index[vr] = i + 1;
    }
    let unknowns = |w: &mut W, with_dependencies: bool, pick: &dyn Fn(&Variable) -> bool| -> std::io::Result<()> {
        for (vr, v) in scalars(vars).filter(|(_, v)| pick(v)) {
            let mut a = vec![("index", index[vr].to_string())];
            // Without `dependencies` other tools assume that it depends on everything: right when it hangs on an array.
            if with_dependencies && !depends_on_array(vars, v) {
                let mut on: Vec<usize> = v.initial_dependencies.iter().map(|&d| index[d as usize]).collect();
                on.sort_unstable();
                a.push(("dependencies", on.iter().map(usize::to_string).collect::<Vec<_>>().join(" ")));
            } else if !with_dependencies {
                // Explicit coupling: outputs at a communication point come from the step before, never from inputs of now.
                a.push(("dependencies", String::new()));
            }
            empty(w, "Unknown", &a)?;
        }
        Ok(())
    };
    let output = |v: &Variable| v.causality == Causality::Output;
    let computed = |v: &Variable| !v.causality.settable() && v.variability != Variability::Tunable;
    group(w, "ModelStructure", &[], |w| {
        if vars.iter().any(|v| output(v) && !v.start.is_array()) {
            group(w, "Outputs", &[], |w| unknowns(w, false, &output))?;
        }
        if vars.iter().any(|v| computed(v) && !v.start.is_array()) {
            group(w, "InitialUnknowns", &[], |w| unknowns(w, true, &computed))?;
        }
        Ok(())
    })
}
