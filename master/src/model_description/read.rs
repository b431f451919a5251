//! The root of the file and what stands directly under it.

use std::path::Path;

use super::{CoSimulation, DefaultExperiment, Item, ModelDescription, TOOL, structure, types, variables};
use crate::decimal::Decimal;
use crate::fault::{FaultKind, Faults};
use crate::xml::{Document, Element, Limits};

/// Reads a model description; `file` is its name in messages. Notes go into `faults` as well, faults make it `None`.
pub fn read(bytes: &[u8], file: &Path, faults: &mut Faults) -> Option<ModelDescription> {
    let before = faults.len();
    let document = match Document::read(bytes, file, Limits::default()) {
        Ok(document) => document,
        Err(fault) => {
            faults.push(fault);
            return None;
        }
    };
    let root = match document.root_named("fmiModelDescription") {
        Ok(root) => root,
        Err(fault) => {
            faults.push(fault);
            return None;
        }
    };
    // Another version has another structure: anything said below it would be noise.
    let version = root.required("fmiVersion", faults)?;
    if version != "2.0" {
        let kind = FaultKind::WrongVersion { given: version.to_owned(), allowed: "FMI 2.0 (co-simulation)" };
        faults.add(&root.place(), root.label(), kind);
        return None;
    }
    let mut model = ModelDescription {
        fmi_version: version.to_owned(),
        model_name: root.required("modelName", faults).unwrap_or_default().to_owned(),
        guid: root.required("guid", faults).unwrap_or_default().to_owned(),
        description: root.attribute("description").map(str::to_owned),
        generation_tool: root.attribute("generationTool").map(str::to_owned),
        co_simulation: co_simulation(root, faults),
        default_experiment: root.child("DefaultExperiment").map(|e| default_experiment(e, faults)).unwrap_or_default(),
        weight: 1.0,
        spreads: false,
        ..Default::default()
    };
    if let Some(list) = root.child("LogCategories") {
        let names = list.all("Category").filter_map(|e| e.required("name", faults).map(str::to_owned));
        model.log_categories = names.collect();
    }
    let names = types::read(root, &mut model, faults);
    match root.child("ModelVariables") {
        Some(list) => variables::read(list, &names, &mut model, faults),
        None => faults.add(&root.place(), root.label(), FaultKind::MissingElement { name: "ModelVariables" }),
    }
    match root.child("ModelStructure") {
        Some(element) => structure::read(element, &mut model, faults),
        None => faults.note(&root.place(), root.label(), "has no ModelStructure: every dependency is assumed"),
    }
    for tool in root.children().filter(|e| e.name() == "VendorAnnotations").flat_map(|e| e.all("Tool")) {
        if tool.attribute("name") == Some(TOOL) {
            model.is_ours = true;
            // FMI's schema allows a `Tool` one child: ours is `Extension`, which holds the list.
            let list = tool.child("Extension").unwrap_or(tool);
            if let Some(weight) = list.child("Weight") {
                let allowed = "a number above 0";
                let read = |text: &str| text.parse().ok().filter(|w: &f64| w.is_finite() && *w > 0.0);
                model.weight = weight.parsed("value", allowed, faults, read).unwrap_or(1.0);
            }
            model.spreads |= list.child("Team").is_some();
            variables::read_arrays(list, &names, &mut model, faults);
        }
    }
    (faults.len() == before).then_some(model)
}

fn co_simulation(root: Element<'_>, faults: &mut Faults) -> CoSimulation {
    let also_model_exchange = root.child("ModelExchange").is_some();
    let Some(e) = root.child("CoSimulation") else {
        let given =
            if also_model_exchange { "model exchange only" } else { "neither model exchange nor co-simulation" };
        faults.add(&root.place(), root.label(), FaultKind::NoCoSimulation { given });
        return CoSimulation::default();
    };
    let identifier = e.required("modelIdentifier", faults).unwrap_or_default();
    // The identifier becomes a file name: as a C identifier it can lead nowhere else.
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if !identifier.is_empty() && !identifier.chars().all(plain) {
        e.bad_value("modelIdentifier", identifier, "a C identifier (letters, digits, underscore)", faults);
    }
    let mut flag = |name| e.boolean(name, faults).unwrap_or(false);
    CoSimulation {
        model_identifier: identifier.to_owned(),
        needs_execution_tool: flag("needsExecutionTool"),
        can_handle_variable_communication_step_size: flag("canHandleVariableCommunicationStepSize"),
        can_interpolate_inputs: flag("canInterpolateInputs"),
        can_run_asynchronously: flag("canRunAsynchronuously"), // the standard's own spelling
        can_be_instantiated_only_once_per_process: flag("canBeInstantiatedOnlyOncePerProcess"),
        can_not_use_memory_management_functions: flag("canNotUseMemoryManagementFunctions"),
        can_get_and_set_fmu_state: flag("canGetAndSetFMUstate"),
        can_serialize_fmu_state: flag("canSerializeFMUstate"),
        provides_directional_derivative: flag("providesDirectionalDerivative"),
        max_output_derivative_order: e
            .parsed("maxOutputDerivativeOrder", "a whole number", faults, |text| text.parse().ok())
            .unwrap_or(0),
        also_model_exchange,
    }
}

fn default_experiment(e: Element<'_>, faults: &mut Faults) -> DefaultExperiment {
    DefaultExperiment {
        start_time: e.real("startTime", faults),
        stop_time: e.real("stopTime", faults),
        tolerance: e.real("tolerance", faults),
        // Only a suggestion: one that is not a decimal step is left out.
        step_size: e
            .attribute("stepSize")
            .filter(|text| Decimal::parse(text).is_ok_and(Decimal::is_positive))
            .map(str::to_owned),
    }
}

impl ModelDescription {
    /// Enters a name; a fault if it is taken.
    pub(super) fn enter(&mut self, item: Item, e: Element<'_>, faults: &mut Faults) {
        let name = self.name_of(item).into();
        match self.by_name.entry(name) {
            std::collections::hash_map::Entry::Vacant(entry) => {
                entry.insert(item);
            }
            std::collections::hash_map::Entry::Occupied(entry) => {
                let (name, first) = (entry.key().to_string(), *entry.get());
                let first = match first {
                    Item::Scalar(index) => self.variables[index].line,
                    Item::Array(index) => self.arrays[index].line,
                };
                faults.add(&e.place(), e.label(), FaultKind::Duplicate { what: "variable", name, first });
            }
        }
    }
}
