//! Array connections.

use std::collections::HashMap;

use super::plan::{ArrayConnection, ArrayPort, When};
use super::system::System;
use crate::fault::{FaultKind, Faults};
use crate::model_description::{ArrayVariable, Causality, Item, Variability};
use crate::unit::{Relation, relate};

/// Resolves all array connections.
pub fn resolve(system: &System<'_>, faults: &mut Faults) -> Vec<ArrayConnection> {
    let mut resolved = Vec::new();
    let mut fed: HashMap<ArrayPort, (String, u32)> = HashMap::new();
    for c in &system.description.extras.arrays {
        let element = format!("ArrayConnection {} -> {}", c.from, c.to);
        let from = system.array(&c.from, &c.place, &element, faults);
        let to = system.array(&c.to, &c.place, &element, faults);
        let (Some(from), Some(to)) = (from, to) else { continue };
        if let Some((first, first_line)) = fed.insert(to, (c.from.to_string(), c.place.line)) {
            let kind =
                FaultKind::DoubledInput { target: c.to.to_string(), first, first_line, second: c.from.to_string() };
            faults.add(&c.place, &element, kind);
            continue;
        }
        let (Some(a), Some(b)) = (system.model(from.component), system.model(to.component)) else { continue };
        let (source, target) = (&a.arrays[from.array], &b.arrays[to.array]);
        let mut sound = true;
        let mut causality = |array: &ArrayVariable, name: String, fits: bool, allowed: &'static str| {
            if !fits {
                let given = array.causality.to_string();
                faults.add(&c.place, &element, FaultKind::CausalityMismatch { variable: name, given, allowed });
                sound = false;
            }
        };
        let is_source = source.causality != Causality::Input;
        causality(
            source,
            c.from.to_string(),
            is_source,
            "output or calculatedParameter (it is the source of a connection)",
        );
        let is_input = target.causality == Causality::Input;
        causality(target, c.to.to_string(), is_input, "input (it is the target of a connection)");
        if source.kind != target.kind {
            let kind = FaultKind::TypeMismatch {
                from: c.from.to_string(),
                from_type: format!("an array of {}", source.kind),
                to: c.to.to_string(),
                to_type: format!("an array of {}", target.kind),
            };
            faults.add(&c.place, &element, kind);
            sound = false;
        }
        let (x, y) = (a.unit_of(Item::Array(from.array)), b.unit_of(Item::Array(to.array)));
        // Arrays are copied as they are, so another scale is refused as well.
        if matches!(relate(x, y), Relation::Different | Relation::Convert(_)) {
            let kind = FaultKind::UnitMismatch {
                from: c.from.to_string(),
                from_unit: x.map(ToString::to_string).unwrap_or_default(),
                to: c.to.to_string(),
                to_unit: y.map(ToString::to_string).unwrap_or_default(),
            };
            faults.add(&c.place, &element, kind);
            sound = false;
        }
        if sound {
            let when = if source.variability == Variability::Fixed { When::Initially } else { When::Always };
            resolved.push(ArrayConnection { from, to, kind: source.kind, when, place: c.place.clone() });
        }
    }
    resolved
}
