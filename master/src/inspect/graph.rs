//! Mermaid graphs: components as boxes, the connections between two of them as one arrow with their names bundled.

use std::collections::BTreeMap;

use crate::check::plan::Plan;
use crate::model_description::{Causality, ModelDescription};

/// Names on one arrow before the rest is counted.
const NAMES: usize = 6;

/// The graph of a system.
pub fn mermaid(plan: &Plan) -> String {
    let mut text = String::from("flowchart LR\n");
    for (index, c) in plan.components.iter().enumerate() {
        let model = &plan.fmus[c.fmu].model.model_name;
        text.push_str(&format!("    c{index}[\"{}<br/><i>{}</i>\"]\n", escaped(&c.name), escaped(model)));
    }
    let mut arrows: BTreeMap<(usize, usize, bool), Vec<&str>> = BTreeMap::new();
    for c in &plan.connections {
        let name = &*plan.model(c.from.component).variables[c.from.variable].name;
        arrows.entry((c.from.component, c.to.component, false)).or_default().push(name);
    }
    for c in &plan.arrays {
        let name = &*plan.model(c.from.component).arrays[c.from.array].name;
        arrows.entry((c.from.component, c.to.component, true)).or_default().push(name);
    }
    for ((from, to, is_array), names) in arrows {
        let arrow = if is_array { "==>" } else { "-->" };
        text.push_str(&format!("    c{from} {arrow}|\"{}\"| c{to}\n", bundled(&names)));
    }
    text
}

/// The graph of one model: inputs on the left, outputs on the right.
pub fn of_model(model: &ModelDescription) -> String {
    let mut text = format!("flowchart LR\n    m[\"{}\"]\n", escaped(&model.model_name));
    let names = |causality: Causality| -> Vec<&str> {
        let scalars = model.variables.iter().filter(|v| v.causality == causality).map(|v| &*v.name);
        scalars.chain(model.arrays.iter().filter(|a| a.causality == causality).map(|a| &*a.name)).collect()
    };
    for (causality, is_in) in [
        (Causality::Parameter, true),
        (Causality::Input, true),
        (Causality::Output, false),
        (Causality::CalculatedParameter, false),
    ] {
        let names = names(causality);
        if !names.is_empty() {
            let node = format!("{causality}([\"{}\"])", bundled(&names));
            text.push_str(&if is_in { format!("    {node} --> m\n") } else { format!("    m --> {node}\n") });
        }
    }
    text
}

/// `wheel[1].force.x`, `.y`, `.z` become `wheel[1].force.*`; then the first few names.
fn bundled(names: &[&str]) -> String {
    let mut groups: Vec<(&str, Vec<&str>)> = Vec::new();
    for name in names {
        let (stem, leaf) = name.rsplit_once('.').unwrap_or((name, ""));
        match groups.last_mut() {
            Some((last, leaves)) if *last == stem && !leaf.is_empty() => leaves.push(leaf),
            _ => groups.push((stem, vec![leaf])),
        }
    }
    let named = groups.iter().map(|(stem, leaves)| match leaves.as_slice() {
        [""] => escaped(stem),
        [leaf] => escaped(&format!("{stem}.{leaf}")),
        leaves => escaped(&format!("{stem}.{{{}}}", leaves.join(","))),
    });
    let mut shown: Vec<String> = named.take(NAMES).collect();
    if groups.len() > NAMES {
        shown.push(format!("... {} more", groups.len() - NAMES));
    }
    shown.join("<br/>")
}

/// Mermaid takes HTML entities inside quoted labels.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('"', "&quot;").replace('<', "&lt;").replace('>', "&gt;").replace('#', "&#35;")
}
