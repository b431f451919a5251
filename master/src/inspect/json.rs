//! JSON for scripts: the plan's own structure, with names beside the indices.

use serde_json::{Map, Value as Json, json};

use crate::check::plan::Plan;
use crate::model_description::{Item, ModelDescription};

/// Serialises what cannot fail: structs of numbers, texts and lists.
fn of(value: impl serde::Serialize) -> Json {
    serde_json::to_value(value).unwrap_or(Json::Null)
}

/// Indented text with a final newline.
pub fn text(value: &Json) -> String {
    format!("{value:#}\n")
}

/// A system: `name, file, time, components, connections, arrays, initialisation, recording, algorithm, bonds, summary, inputs, notes`.
pub fn plan_json(plan: &Plan) -> Json {
    let components = plan.components.iter().enumerate().map(|(index, c)| {
        let model = plan.model(index);
        let values: Map<String, Json> =
            c.settings.iter().map(|s| (model.variables[s.variable].name.to_string(), of(&s.value))).collect();
        json!({
            "name": c.name,
            "model": model.model_name,
            "fmu": plan.fmus[c.fmu].path,
            "sha256": plan.fmus[c.fmu].sha256,
            "multiple": c.multiple,
            "step": plan.clock.length(c.multiple),
            "threads": c.threads,
            "ranks": c.ranks,
            "values": values,
        })
    });
    let connections = plan.connections.iter().map(|c| {
        json!({
            "from": plan.port_name(&c.from),
            "to": plan.port_name(&c.to),
            "type": c.to.kind.name(),
            "unit": plan.model(c.to.component).unit_of(Item::Scalar(c.to.variable)).map(|u| &u.name),
            "transform": of(&c.transform),
            "when": of(c.when),
            "extrapolation": c.extrapolation,
            "place": of(&c.place),
        })
    });
    let arrays = plan.arrays.iter().map(|c| {
        json!({
            "from": plan.array_name(&c.from),
            "to": plan.array_name(&c.to),
            "type": c.kind.name(),
            "unit": plan.model(c.to.component).unit_of(Item::Array(c.to.array)).map(|u| &u.name),
            "when": of(c.when),
            "place": of(&c.place),
        })
    });
    let stages = plan.initialisation.iter().map(|stage| {
        let scalars = stage.connections.iter().map(|&c| plan.port_name(&plan.connections[c].to));
        let arrays = stage.arrays.iter().map(|&c| plan.array_name(&plan.arrays[c].to));
        scalars.chain(arrays).collect::<Vec<_>>()
    });
    let scalars = plan.recording.scalars.iter().map(
        |s| json!({ "variable": plan.port_name(&s.port), "unit": s.unit.as_ref().map(|u| &u.name), "every": s.every }),
    );
    let datasets = plan.recording.vtk.iter().map(|d| {
        let fields = d.fields.iter().map(|f| {
            json!({ "name": f.name, "array": plan.array_name(&f.array), "index": f.index.map(|i| plan.array_name(&i)) })
        });
        json!({
            "name": d.name,
            "every": d.every,
            "position": plan.array_name(&d.position),
            "triangle": d.triangle.map(|t| plan.array_name(&t)),
            "fields": fields.collect::<Vec<_>>(),
        })
    });
    let summary = plan.summary.iter().map(|i| {
        json!({
            "name": i.name,
            "variable": plan.port_name(&i.port),
            "unit": i.unit.as_ref().map(|u| &u.name),
            "from": plan.clock.time(i.from),
            "to": plan.clock.time(i.to),
            "measured": i.measured,
            "source": i.source,
        })
    });
    let bonds = plan.bonds.iter().map(|b| {
        let source = |connection: usize| plan.port_name(&plan.connections[connection].from);
        let pairs = b.pairs.iter().map(|p| json!({ "effort": source(p.effort), "flow": source(p.flow) }));
        json!({ "name": b.name, "efforts": if b.means { "mean" } else { "sample" }, "pairs": pairs.collect::<Vec<_>>() })
    });
    json!({
        "name": plan.name,
        "file": plan.file,
        "time": {
            "start": plan.clock.start, "stop": plan.clock.stop(), "step": plan.clock.step, "steps": plan.clock.steps,
        },
        "components": components.collect::<Vec<_>>(),
        "connections": connections.collect::<Vec<_>>(),
        "arrays": arrays.collect::<Vec<_>>(),
        "initialisation": stages.collect::<Vec<_>>(),
        "recording": { "scalars": scalars.collect::<Vec<_>>(), "vtk": datasets.collect::<Vec<_>>() },
        "algorithm": {
            "scheme": of(plan.algorithm.scheme),
            "order": plan.algorithm.order.iter().map(|&c| &plan.components[c].name).collect::<Vec<_>>(),
            "resolve_feed_through": plan.algorithm.resolve_feed_through,
        },
        "bonds": bonds.collect::<Vec<_>>(),
        "summary": summary.collect::<Vec<_>>(),
        "inputs": of(&plan.inputs),
        "notes": of(&plan.notes),
    })
}

/// A model: its attributes, and variables and arrays with their units by name.
pub fn model_json(model: &ModelDescription) -> Json {
    let mut json = of(model);
    // Kept as text for exact arithmetic; a number for readers.
    for key in ["start_time", "stop_time", "tolerance", "step_size"] {
        if let Some(x) = json["default_experiment"][key].as_str().and_then(|t| t.parse::<f64>().ok()) {
            json["default_experiment"][key] = of(x);
        }
    }
    let named = |json: &mut Json, list: &str, item: fn(usize) -> Item| {
        for (index, entry) in json[list].as_array_mut().into_iter().flatten().enumerate() {
            entry["unit"] = of(model.unit_of(item(index)).map(|u| &u.name));
        }
    };
    named(&mut json, "variables", Item::Scalar);
    named(&mut json, "arrays", Item::Array);
    for (index, entry) in json["variables"].as_array_mut().into_iter().flatten().enumerate() {
        entry["declared_type"] = of(model.type_of(&model.variables[index]).map(|t| &t.name));
    }
    for (index, entry) in json["arrays"].as_array_mut().into_iter().flatten().enumerate() {
        let names: Vec<&str> = model.arrays[index].initial_dependencies.iter().map(|&i| model.name_of(i)).collect();
        entry["initial_dependencies"] = of(names);
    }
    json
}
