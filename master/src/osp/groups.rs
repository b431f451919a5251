//! Variable groups: `OspModelDescription.xml` (format 1.0), beside the system or inside the FMU.

use std::path::Path;

use crate::check::plan::Fmu;
use crate::description::parameters::read_document;
use crate::fault::{Faults, shown};
use crate::xml::Element;

/// Groups inside groups of a port; more is no port.
const MOST_VARIABLES: usize = 100_000;

/// The groups of one FMU: name, then the names of its variables in order.
#[derive(Debug, Default)]
pub struct Groups(Vec<(String, Vec<String>)>);

impl Groups {
    /// Reads the file that describes the groups of an FMU: `MODEL_OspModelDescription.xml` or `FILE_OspModelDescription.xml` in the system's folder, else
    /// `OspModelDescription.xml` in the FMU's resources. None is no fault.
    pub fn of(fmu: &Fmu, base: &Path, faults: &mut Faults) -> Self {
        let stem = fmu.path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let beside = |name: &str| base.join(format!("{name}_OspModelDescription.xml"));
        // A model's name may hold anything, so only the plain last part of it becomes a path.
        let plain = Path::new(&fmu.model.model_name).file_name().map(|n| n.to_string_lossy().into_owned());
        let files = [
            plain.map(|name| beside(&name)),
            Some(beside(&stem)),
            Some(fmu.unpacked.folder().join("resources/OspModelDescription.xml")),
        ];
        let Some(file) = files.into_iter().flatten().find(|f| f.is_file()) else { return Self::default() };
        let mut groups = Self::default();
        match read_document(&file, &shown(&file)) {
            Ok(document) => match document.root_named("OspModelDescription") {
                Ok(root) => {
                    let mut left = MOST_VARIABLES;
                    for group in root.child("VariableGroups").into_iter().flat_map(Element::children) {
                        groups.add(group, &mut left);
                    }
                }
                Err(fault) => faults.push(fault),
            },
            Err(fault) => faults.push(fault),
        }
        groups
    }

    /// Adds a group and those inside it; gives its variables.
    fn add(&mut self, e: Element<'_>, left: &mut usize) -> Vec<String> {
        let mut variables = Vec::new();
        for child in e.children() {
            match child.attribute("ref") {
                Some(name) if child.name() == "Variable" => {
                    if *left > 0 {
                        *left -= 1;
                        variables.push(name.to_owned());
                    }
                }
                _ => variables.extend(self.add(child, left)),
            }
        }
        if let Some(name) = e.attribute("name") {
            self.0.push((name.to_owned(), variables.clone()));
        }
        variables
    }

    /// The variables of a group.
    ///
    /// # Errors
    /// What is allowed, in words.
    pub fn variables(&self, name: &str) -> Result<&[String], String> {
        let found = self.0.iter().find(|(n, _)| n == name).map(|(_, variables)| variables.as_slice());
        found.ok_or_else(|| {
            let names: Vec<&str> = self.0.iter().map(|(n, _)| n.as_str()).take(12).collect();
            match names.as_slice() {
                [] => "a group of an OspModelDescription.xml, and there is none for this FMU".into(),
                names => names.join(", "),
            }
        })
    }
}
