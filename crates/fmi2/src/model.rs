//! A model: what a library offers under one GUID.

use crate::variables::Table;
use crate::{Unit, description_xml};
use uuid::Uuid;

/// Makes the physics of a fresh instance.
pub type Factory = Box<dyn Fn() -> Box<dyn Unit>>;

/// One model of a library: an FMU is the library plus this model's `modelDescription.xml`.
pub struct Model {
    /// Model name and model identifier (a C identifier), `terrain_dem_p`.
    pub name: &'static str,
    /// One sentence.
    pub description: &'static str,
    /// Its variables.
    pub table: Table,
    /// Communication step other tools may start with (s).
    pub default_step: f64,
    /// Stop time other tools may start with (s).
    pub default_stop: f64,
    /// Whether its units use derivatives of inputs ([`crate::Values::derivative`]).
    pub interpolates_inputs: bool,
    /// Share of the cores relative to other units, for the master's default (a granular terrain 100, a vehicle 1).
    pub weight: f64,
    /// Whether its units can be spread over the members of a team ([`crate::Unit::join`]).
    pub spreads: bool,
    /// `resources/specification.json`.
    pub default_specification: String,
    /// `resources/specification.schema.json`.
    pub schema: serde_json::Value,
    /// `documentation/index.html`'s body text, Markdown-free paragraphs.
    pub documentation: String,
    pub(crate) new: Factory,
}

impl Model {
    /// A model with defaults for everything but these; `new` makes its physics.
    pub fn new(
        name: &'static str,
        description: &'static str,
        table: Table,
        new: impl Fn() -> Box<dyn Unit> + 'static,
    ) -> Self {
        Self {
            name,
            description,
            table,
            default_step: 1e-3,
            default_stop: 1.0,
            interpolates_inputs: false,
            weight: 1.0,
            spreads: false,
            default_specification: "{}".into(),
            schema: serde_json::json!({}),
            documentation: String::new(),
            new: Box::new(new),
        }
    }

    /// The physics of a fresh instance.
    pub fn unit(&self) -> Box<dyn Unit> {
        (self.new)()
    }

    /// Name of the FMU and of the description files, without ending: `terrain_dem_p` becomes `terrain-dem-p`.
    pub fn file_name(&self) -> String {
        self.name.replace('_', "-")
    }

    /// The schema of the specification as a file's text.
    pub fn schema_text(&self) -> String {
        serde_json::to_string_pretty(&self.schema).expect("a schema is plain JSON") + "\n"
    }

    /// GUID: UUIDv5 of model name and variable table, so that a changed interface never loads by mistake.
    pub fn guid(&self) -> String {
        let namespace = Uuid::new_v5(&Uuid::NAMESPACE_DNS, b"org.terramech");
        let text = description_xml::canonical(self);
        format!("{{{}}}", Uuid::new_v5(&namespace, text.as_bytes()))
    }

    /// The `modelDescription.xml`.
    pub fn xml(&self) -> String {
        description_xml::write(self)
    }
}
