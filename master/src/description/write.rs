//! Writing a description as SSP 1.0: flat, every connector explicit, the literal prefixes that other tools match as text.

use super::{Assignment, Component, ConnectorType, Description, Given, Transformation};
use crate::description::raw::OSP;
use crate::unit::{BASE_UNITS, Unit};
use crate::xml::write::Writer;

/// For whom a description is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Audience {
    /// This program: with our annotations.
    Terramech,
    /// Other tools: without them. Array connections and what else only we know are lost; the caller says so.
    OtherTools,
}

/// The text of the `.ssd` file.
pub fn write(description: &Description, audience: Audience) -> String {
    let d = description;
    let ours = audience == Audience::Terramech;
    let mut w = Writer::default();
    w.open("ssd:SystemStructureDescription");
    for prefix in ["ssd", "ssc", "ssv", "ssm"] {
        let name = match prefix {
            "ssd" => "SystemStructureDescription",
            "ssc" => "SystemStructureCommon",
            "ssv" => "SystemStructureParameterValues",
            _ => "SystemStructureParameterMapping",
        };
        w.attribute(&format!("xmlns:{prefix}"), format_args!("http://ssp-standard.org/SSP1/{name}"));
    }
    w.attribute("xmlns:osp", "http://opensimulationplatform.com/SSP/OSPAnnotations");
    w.attribute("version", "1.0").attribute("name", &d.name);
    w.open("ssd:System").attribute("name", &d.name);
    if !d.components.is_empty() {
        w.open("ssd:Elements");
        d.components.iter().for_each(|c| component(c, &d.units, ours, &mut w));
        w.close();
    }
    if !d.connections.is_empty() {
        w.open("ssd:Connections");
        for c in &d.connections {
            w.open("ssd:Connection");
            w.attribute("startElement", &d.components[c.from.component].name);
            w.attribute("startConnector", &c.from.connector);
            w.attribute("endElement", &d.components[c.to.component].name);
            w.attribute("endConnector", &c.to.connector);
            if c.suppress_unit_conversion {
                w.attribute("suppressUnitConversion", true);
            }
            if let Some(t) = &c.transformation {
                transformation(t, &mut w);
            }
            w.close();
        }
        w.close();
    }
    if ours && d.extras != Default::default() {
        w.open("ssd:Annotations");
        d.extras.write(&mut w);
        w.close();
    }
    w.close();
    if !d.enumerations.is_empty() {
        w.open("ssd:Enumerations");
        for e in &d.enumerations {
            w.open("ssc:Enumeration").attribute("name", &e.name);
            for (name, value) in &e.items {
                w.open("ssc:Item").attribute("name", name).attribute("value", value).close();
            }
            w.close();
        }
        w.close();
    }
    // The schema wants a definition for each; a name alone says nothing that its users do not say.
    let defined: Vec<&Unit> = d.units.iter().filter(|u| u.base.is_some()).collect();
    if !defined.is_empty() {
        w.open("ssd:Units");
        defined.into_iter().for_each(|u| unit(u, &mut w));
        w.close();
    }
    experiment(d, &mut w);
    w.finish()
}

fn experiment(d: &Description, w: &mut Writer) {
    if d.start.is_none() && d.stop.is_none() && d.base_step.is_none() {
        return;
    }
    w.open("ssd:DefaultExperiment").optional("startTime", d.start).optional("stopTime", d.stop);
    if let Some(step) = d.base_step {
        // Nothing of ours inside this annotation: OSP tools read it strictly.
        w.open("ssd:Annotations").open("ssc:Annotation").attribute("type", OSP);
        w.open("osp:Algorithm").open("osp:FixedStepAlgorithm").attribute("baseStepSize", step);
        w.close().close().close().close();
    }
    w.close();
}

fn component(c: &Component, units: &[Unit], ours: bool, w: &mut Writer) {
    w.open("ssd:Component").attribute("name", &c.name);
    w.attribute("type", "application/x-fmu-sharedlibrary").attribute("source", &c.source);
    if !c.connectors.is_empty() {
        w.open("ssd:Connectors");
        for connector in &c.connectors {
            w.open("ssd:Connector").attribute("name", &connector.name).attribute("kind", connector.kind.name());
            match &connector.value_type {
                None => {}
                Some(ConnectorType::Real(unit)) => {
                    w.open("ssc:Real").optional("unit", unit.as_ref()).close();
                }
                Some(ConnectorType::Enumeration(name)) => {
                    w.open("ssc:Enumeration").attribute("name", name).close();
                }
                Some(ConnectorType::Binary) => {
                    w.open("ssc:Binary").close();
                }
                Some(ConnectorType::Plain(kind)) => {
                    w.open(match kind {
                        crate::model_description::Kind::Integer => "ssc:Integer",
                        crate::model_description::Kind::Boolean => "ssc:Boolean",
                        _ => "ssc:String",
                    });
                    w.close();
                }
            }
            w.close();
        }
        w.close();
    }
    if !c.values.is_empty() {
        values(c, units, w);
    }
    let has_extras = ours && c.extras != Default::default();
    if has_extras || c.step_hint.is_some() {
        w.open("ssd:Annotations");
        if let Some(hint) = c.step_hint {
            w.open("ssc:Annotation").attribute("type", OSP);
            w.open("osp:StepSizeHint").attribute("value", hint).close().close();
        }
        if has_extras {
            c.extras.write(w);
        }
        w.close();
    }
    w.close();
}

fn values(c: &Component, units: &[Unit], w: &mut Writer) {
    // A mapping is written only where a value needs one; without it names are taken as they are.
    let is_mapped = |v: &Assignment| v.linear.is_some() || v.suppress_unit_conversion;
    w.open("ssd:ParameterBindings").open("ssd:ParameterBinding").open("ssd:ParameterValues");
    w.open("ssv:ParameterSet").attribute("version", "1.0").attribute("name", &c.name).open("ssv:Parameters");
    for v in &c.values {
        w.open("ssv:Parameter").attribute("name", &v.variable);
        match &v.value {
            Given::Real(x) => {
                w.open("ssv:Real").attribute("value", format_args!("{x:?}"));
                w.optional("unit", v.unit.as_ref().map(|u| &u.name));
            }
            Given::Integer(x) => {
                w.open("ssv:Integer").attribute("value", x);
            }
            Given::Boolean(x) => {
                w.open("ssv:Boolean").attribute("value", x);
            }
            Given::String(x) => {
                w.open("ssv:String").attribute("value", x);
            }
            Given::Item(x) => {
                w.open("ssv:Enumeration").attribute("value", x);
            }
        }
        w.close().close();
    }
    w.close();
    // Units that came with a parameter file and that the description does not define.
    let mut own: Vec<&Unit> = c.values.iter().filter_map(|v| v.unit.as_ref()).filter(|u| !units.contains(u)).collect();
    own.sort_by(|a, b| a.name.cmp(&b.name));
    own.dedup_by(|a, b| a.name == b.name);
    own.retain(|u| u.base.is_some());
    if !own.is_empty() {
        w.open("ssv:Units");
        own.into_iter().for_each(|u| unit(u, w));
        w.close();
    }
    w.close().close();
    if c.values.iter().any(is_mapped) {
        w.open("ssd:ParameterMapping").open("ssm:ParameterMapping").attribute("version", "1.0");
        for v in &c.values {
            w.open("ssm:MappingEntry").attribute("source", &v.variable).attribute("target", &v.variable);
            if v.suppress_unit_conversion {
                w.attribute("suppressUnitConversion", true);
            }
            if let Some(linear) = v.linear {
                transformation(&Transformation::Linear(linear), w);
            }
            w.close();
        }
        w.close().close();
    }
    w.close().close();
}

fn unit(u: &Unit, w: &mut Writer) {
    w.open("ssc:Unit").attribute("name", &u.name);
    if let Some(base) = &u.base {
        w.open("ssc:BaseUnit");
        for (exponent, name) in base.dimension.0.iter().zip(BASE_UNITS) {
            w.optional(name, (*exponent != 0).then_some(exponent));
        }
        w.optional("factor", (base.factor != 1.0).then_some(base.factor));
        w.optional("offset", (base.offset != 0.0).then_some(base.offset)).close();
    }
    w.close();
}

fn transformation(t: &Transformation, w: &mut Writer) {
    match t {
        Transformation::Linear(linear) => {
            w.open("ssc:LinearTransformation");
            w.attribute("factor", format_args!("{:?}", linear.factor));
            w.attribute("offset", format_args!("{:?}", linear.offset));
        }
        Transformation::Booleans(entries) => {
            w.open("ssc:BooleanMappingTransformation");
            for (from, to) in entries {
                w.open("ssc:MapEntry").attribute("source", *from != 0).attribute("target", *to != 0).close();
            }
        }
        Transformation::Integers(entries) => {
            w.open("ssc:IntegerMappingTransformation");
            for (from, to) in entries {
                w.open("ssc:MapEntry").attribute("source", from).attribute("target", to).close();
            }
        }
        Transformation::Items(entries) => {
            w.open("ssc:EnumerationMappingTransformation");
            for (from, to) in entries {
                w.open("ssc:MapEntry").attribute("source", from).attribute("target", to).close();
            }
        }
    }
    w.close();
}
