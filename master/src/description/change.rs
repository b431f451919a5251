//! What the command line changes in a description before it is checked: other FMUs, parameter files.

use std::collections::HashMap;
use std::path::Path;

use super::parameters::{parameter_file, read_document, units};
use super::{Assignment, Description};
use crate::fault::{FaultKind, Faults, Place, shown};
use crate::suggest::close;

impl Description {
    /// Another FMU for a component: `component=path`, the path counted from the working folder.
    pub fn swap(&mut self, text: &str, faults: &mut Faults) {
        let place = Place::file("--swap");
        let Some((name, path)) = text.split_once('=').filter(|(_, path)| !path.trim().is_empty()) else {
            let (what, allowed) = ("--swap".into(), "component=FMU, such as terrain=other.fmu".into());
            faults.add(&place, "", FaultKind::BadValue { what, given: text.to_owned(), allowed });
            return;
        };
        let (name, path) = (name.trim(), Path::new(path.trim()));
        if !self.components.iter().any(|c| c.name == name) {
            let close = close(name, self.components.iter().map(|c| c.name.as_str()));
            faults.add(&place, text, FaultKind::UnknownComponent { given: name.to_owned(), close });
            return;
        }
        if !path.exists() {
            let searched = path.display().to_string();
            let kind = FaultKind::NotFound { what: "FMU", source_uri: searched.clone(), searched };
            faults.add(&place, text, kind);
            return;
        }
        let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        for c in self.components.iter_mut().filter(|c| c.name == name) {
            c.source = whole.to_string_lossy().into_owned();
        }
    }

    /// The parameters of an SSP parameter set (`.ssv`), named `component.variable`; they replace the description's.
    pub fn apply_parameters(&mut self, path: &Path, faults: &mut Faults) {
        let document = match read_document(path, &shown(path)) {
            Ok(document) => document,
            Err(fault) => return faults.push(fault),
        };
        let root = match document.root_named("ParameterSet") {
            Ok(root) => root,
            Err(fault) => return faults.push(fault),
        };
        self.files.push(path.to_owned());
        let own: HashMap<_, _> =
            self.units.iter().map(|u| (u.name.clone(), u.clone())).chain(units(root, faults)).collect();
        let mut position: Vec<HashMap<String, usize>> = self
            .components
            .iter()
            .map(|c| c.values.iter().enumerate().map(|(i, v)| (v.variable.clone(), i)).collect())
            .collect();
        for bound in parameter_file(root, &own, faults) {
            let element = format!("Parameter \"{}\"", bound.name);
            // "a.b.c" may be component "a" or component "a.b": the longest name that fits wins.
            let found = bound.name.match_indices('.').rev().find_map(|(at, _)| {
                let component = self.components.iter().position(|c| c.name == bound.name[..at])?;
                Some((component, bound.name[at + 1..].to_owned()))
            });
            let Some((component, variable)) = found else {
                let given = bound.name.split('.').next().unwrap_or_default().to_owned();
                let close = close(&given, self.components.iter().map(|c| c.name.as_str()));
                faults.add(&bound.place, element, FaultKind::UnknownComponent { given, close });
                continue;
            };
            let assignment = Assignment {
                variable: variable.clone(),
                value: bound.value,
                unit: bound.unit,
                linear: bound.linear,
                suppress_unit_conversion: bound.suppress_unit_conversion,
                must_exist: true,
                place: bound.place,
            };
            let values = &mut self.components[component].values;
            match position[component].get(&variable) {
                Some(&at) => values[at] = assignment,
                None => {
                    position[component].insert(variable, values.len());
                    values.push(assignment);
                }
            }
        }
    }
}
