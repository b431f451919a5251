//! Tables with aligned columns.

use crate::check::plan::{Plan, Transform, When};
use crate::model_description::{Item, Kind, ModelDescription, Value};

/// A table: a title, a header, rows.
#[derive(Clone, Debug)]
pub struct Table {
    title: String,
    header: Vec<&'static str>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table.
    pub fn new(title: impl Into<String>, header: &[&'static str]) -> Self {
        Self { title: title.into(), header: header.to_vec(), rows: Vec::new() }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: Vec<String>) {
        self.rows.push(cells);
    }

    /// The text: title, header, a rule, rows; empty for a table without rows.
    pub fn text(&self) -> String {
        if self.rows.is_empty() {
            return String::new();
        }
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            let longest = cells.map(|cell| cell.chars().count()).max().unwrap_or(0);
            longest.max(self.header[column].chars().count())
        };
        let widths: Vec<usize> = (0..self.header.len()).map(width).collect();
        let mut text = format!("{}\n", self.title);
        let mut line = |cells: &mut dyn Iterator<Item = &str>| {
            let mut line = String::from("  ");
            for (cell, width) in cells.zip(&widths) {
                line.push_str(&format!("{cell:width$}  "));
            }
            text.push_str(line.trim_end());
            text.push('\n');
        };
        line(&mut self.header.iter().copied());
        let rules: Vec<String> = widths.iter().map(|&width| "-".repeat(width)).collect();
        line(&mut rules.iter().map(String::as_str));
        for row in &self.rows {
            line(&mut row.iter().map(String::as_str));
        }
        text
    }
}

/// Tables put one after the other, empty ones left out.
fn joined(tables: &[Table]) -> String {
    tables.iter().map(Table::text).filter(|text| !text.is_empty()).collect::<Vec<_>>().join("\n")
}

fn optional<T: ToString>(value: Option<T>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}

/// The tables of a system.
pub fn plan_tables(plan: &Plan) -> String {
    let clock = &plan.clock;
    let head = format!(
        "System {}: {} s to {} s in {} steps of {} s\n\n",
        plan.name,
        clock.start,
        clock.stop(),
        clock.steps,
        clock.step
    );
    let mut components =
        Table::new("Components", &["name", "model", "FMU", "step [s]", "threads", "rank", "values set"]);
    for c in &plan.components {
        let fmu = &plan.fmus[c.fmu];
        components.row(vec![
            c.name.clone(),
            fmu.model.model_name.clone(),
            fmu.path.display().to_string(),
            clock.length(c.multiple).to_string(),
            optional(c.threads),
            optional(c.ranks),
            c.settings.len().to_string(),
        ]);
    }
    let mut values = Table::new("Values", &["variable", "value", "unit"]);
    for (index, c) in plan.components.iter().enumerate() {
        let model = plan.model(index);
        for s in &c.settings {
            let name = format!("{}.{}", c.name, model.variables[s.variable].name);
            values.row(vec![name, short(&s.value), optional(model.unit_of(Item::Scalar(s.variable)).map(|u| &u.name))]);
        }
    }
    let mut connections = Table::new("Connections", &["from", "to", "type", "unit", "crosses"]);
    for c in &plan.connections {
        let unit = plan.model(c.to.component).unit_of(Item::Scalar(c.to.variable)).map(|u| &u.name);
        connections.row(vec![
            plan.port_name(&c.from),
            plan.port_name(&c.to),
            c.to.kind.to_string(),
            optional(unit),
            crossing(c.when, &c.transform, c.extrapolation),
        ]);
    }
    let mut arrays = Table::new("Array connections", &["from", "to", "type", "unit", "crosses"]);
    for c in &plan.arrays {
        let unit = plan.model(c.to.component).unit_of(Item::Array(c.to.array)).map(|u| &u.name);
        arrays.row(vec![
            plan.array_name(&c.from),
            plan.array_name(&c.to),
            format!("array of {}", c.kind),
            optional(unit),
            crossing(c.when, &Transform::Copy, 0),
        ]);
    }
    let mut stages = Table::new("Initialisation", &["stage", "what is set"]);
    for (number, stage) in plan.initialisation.iter().enumerate() {
        let scalars = stage.connections.iter().map(|&c| plan.port_name(&plan.connections[c].to));
        let arrays = stage.arrays.iter().map(|&c| plan.array_name(&plan.arrays[c].to));
        let names: Vec<String> = scalars.chain(arrays).collect();
        let more = if names.len() > 4 { format!(", ... ({} in all)", names.len()) } else { String::new() };
        stages.row(vec![(number + 1).to_string(), format!("{}{more}", names[..names.len().min(4)].join(", "))]);
    }
    let mut notes = Table::new("Notes", &["note"]);
    plan.notes.iter().for_each(|note| notes.row(vec![note.to_string()]));
    head + &joined(&[components, values, connections, arrays, stages, notes])
}

/// A value on one line.
fn short(value: &Value) -> String {
    let text = value.to_string().replace('\n', " ");
    if text.chars().count() > 60 { text.chars().take(57).chain("...".chars()).collect() } else { text }
}

fn crossing(when: When, transform: &Transform, extrapolation: u8) -> String {
    let mut parts = vec![match when {
        When::Always => "every step".to_owned(),
        When::Initially => "once".to_owned(),
    }];
    match transform {
        Transform::Copy => {}
        Transform::Linear(map) => parts.push(format!("x {} + {}", map.factor, map.offset)),
        Transform::Table(table) => parts.push(format!("through a table of {}", table.len())),
    }
    if extrapolation > 0 {
        parts.push(format!("extrapolated, order {extrapolation}"));
    }
    parts.join(", ")
}

/// The tables of a model.
pub fn model_tables(model: &ModelDescription) -> String {
    let side = &model.co_simulation;
    let mut head = format!("Model {} (FMI {}, guid {})\n", model.model_name, model.fmi_version, model.guid);
    if let Some(text) = &model.description {
        head.push_str(&format!("{text}\n"));
    }
    let flags = [
        (side.can_handle_variable_communication_step_size, "variable communication step"),
        (side.can_get_and_set_fmu_state, "saves state"),
        (side.can_serialize_fmu_state, "serialises state"),
        (side.can_be_instantiated_only_once_per_process, "one instance per process"),
        (side.needs_execution_tool, "needs its tool"),
        (side.can_interpolate_inputs, "interpolates inputs"),
    ];
    let flags: Vec<&str> = flags.iter().filter(|(yes, _)| *yes).map(|(_, text)| *text).collect();
    head.push_str(&format!("Identifier {}; {}\n\n", side.model_identifier, flags.join(", ")));
    let header = ["name", "type", "causality", "variability", "unit", "start", "min", "max", "description"];
    let mut variables = Table::new("Variables", &header);
    for (index, v) in model.variables.iter().enumerate() {
        let kind = match (v.kind, model.type_of(v)) {
            (Kind::Enumeration, Some(t)) => {
                t.items.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join("|")
            }
            (kind, _) => kind.to_string(),
        };
        variables.row(vec![
            v.name.to_string(),
            kind,
            v.causality.to_string(),
            v.variability.to_string(),
            optional(model.unit_of(Item::Scalar(index)).map(|u| &u.name)),
            v.start.as_ref().map(short).unwrap_or_default(),
            optional(v.min),
            optional(v.max),
            v.description.as_deref().unwrap_or_default().to_owned(),
        ]);
    }
    let mut arrays =
        Table::new("Arrays", &["name", "type", "causality", "variability", "unit", "first depends on", "description"]);
    for (index, a) in model.arrays.iter().enumerate() {
        let depends: Vec<&str> = a.initial_dependencies.iter().map(|&item| model.name_of(item)).collect();
        arrays.row(vec![
            a.name.to_string(),
            format!("array of {}", a.kind),
            a.causality.to_string(),
            a.variability.to_string(),
            optional(model.unit_of(Item::Array(index)).map(|u| &u.name)),
            depends.join(", "),
            a.description.as_deref().unwrap_or_default().to_owned(),
        ]);
    }
    head + &joined(&[variables, arrays])
}
