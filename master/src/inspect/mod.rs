//! Showing what a description or an FMU holds: as tables, as a Mermaid graph, as JSON.
//!
//! Everything here makes text from a [`Plan`] or a [`ModelDescription`](crate::model_description::ModelDescription); nothing is printed.

mod graph;
mod json;
mod table;

use std::path::Path;

use crate::check::plan::{Fmu, Plan};
use crate::check::{self, Options};
use crate::fault::Faults;

pub use graph::mermaid;
pub use json::{model_json, plan_json};
pub use table::{Table, model_tables, plan_tables};

/// What was given to look at.
#[derive(Debug)]
pub enum Subject {
    /// A system description.
    System(Box<Plan>),
    /// A single FMU.
    Fmu(Box<Fmu>),
}

/// How to show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Tables for a terminal.
    Tables,
    /// A Mermaid graph of components and connections (of the variables, for an FMU: one node).
    Mermaid,
    /// JSON.
    Json,
}

/// Whether a path is an FMU by its name, or a folder with a model description.
pub fn is_fmu(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("fmu")) || path.join("modelDescription.xml").is_file()
}

/// Opens a system description or an FMU (an archive that ends in `.fmu`, or a folder with a `modelDescription.xml`).
///
/// # Errors
/// Every fault found.
pub fn open(path: &Path, options: &Options) -> Result<Subject, Faults> {
    if !is_fmu(path) {
        return Ok(Subject::System(Box::new(check::plan(path, options)?)));
    }
    let mut faults = Faults::new();
    match check::open_fmu(path, options.need_library, &mut faults) {
        Some(fmu) => Ok(Subject::Fmu(Box::new(fmu))),
        None => Err(faults),
    }
}

/// The text to show.
pub fn show(subject: &Subject, form: Form) -> String {
    match (subject, form) {
        (Subject::System(plan), Form::Tables) => plan_tables(plan),
        (Subject::System(plan), Form::Mermaid) => mermaid(plan),
        (Subject::System(plan), Form::Json) => json::text(&plan_json(plan)),
        (Subject::Fmu(fmu), Form::Tables) => model_tables(&fmu.model),
        (Subject::Fmu(fmu), Form::Mermaid) => graph::of_model(&fmu.model),
        (Subject::Fmu(fmu), Form::Json) => json::text(&model_json(&fmu.model)),
    }
}

#[cfg(test)]
mod tests;
