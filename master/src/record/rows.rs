//! `results.csv`.

use terramech_results::{Column, CsvWriter, Kind as ColumnKind, RunFolder, Value};

use crate::coupling::{Failure, Schedule, System, WatchId};
use crate::loading::{Class, Outputs, Slot};

/// The table. A row is written whenever one of its columns is due, and then holds all of them.
pub struct Rows {
    writer: CsvWriter,
    columns: Vec<(WatchId, Slot)>,
    schedules: Vec<Schedule>,
}

impl Rows {
    /// `kept` is what an earlier part of the run has written (bytes).
    pub fn new(system: &mut System, folder: &RunFolder, kept: Option<u64>) -> Result<Self, Failure> {
        let plan = std::sync::Arc::clone(system.plan());
        let scalars = &plan.recording.scalars;
        let mut schedules: Vec<Schedule> = scalars.iter().map(|s| Schedule::every(s.every)).collect();
        schedules.sort_by_key(|s| s.every);
        schedules.dedup();
        let mut columns = Vec::with_capacity(scalars.len());
        let mut heads = Vec::with_capacity(scalars.len());
        let mut at = 0;
        while at < scalars.len() {
            // Columns are in component order: one watch for each run of the same component.
            let unit = scalars[at].port.component;
            let end = scalars[at..].iter().position(|s| s.port.component != unit).map_or(scalars.len(), |n| at + n);
            let mut slots = Vec::new();
            let id = system.watch(unit, schedules.clone(), |outputs| {
                slots.extend(
                    scalars[at..end]
                        .iter()
                        .map(|s| outputs.scalar(Class::from(s.port.kind), s.port.value_reference, s.port.variable)),
                );
            });
            columns.extend(slots.into_iter().map(|slot| (id, slot)));
            at = end;
        }
        for s in scalars {
            heads.push(Column {
                name: plan.port_name(&s.port),
                unit: s.unit.as_ref().map(|u| u.name.clone()).unwrap_or_default(),
                kind: match Class::from(s.port.kind) {
                    Class::Real => ColumnKind::Real,
                    Class::Integer => ColumnKind::Integer,
                    Class::Boolean => ColumnKind::Boolean,
                    Class::String => ColumnKind::Text,
                },
            });
        }
        for (name, _) in system.energies() {
            heads.push(Column::real(format!("coupling.{name}.residual"), "J"));
            heads.push(Column::real(format!("coupling.{name}.passed"), "J"));
        }
        let writer = match kept {
            None => CsvWriter::create(folder, &heads)?,
            Some(length) => CsvWriter::go_on(folder, &heads, length)?,
        };
        Ok(Self { writer, columns, schedules })
    }

    pub fn observe(&mut self, system: &System, tick: u64) -> Result<(), Failure> {
        if !self.schedules.iter().any(|s| s.is_due(tick)) {
            return Ok(());
        }
        let values = self.columns.iter().map(|(id, slot)| value(system.watched(*id), *slot));
        let energies = system.energies().flat_map(|(_, e)| [Value::Real(e.residual), Value::Real(e.passed)]);
        Ok(self.writer.row(system.clock().time(tick), values.chain(energies))?)
    }

    /// Brings all rows to disk; gives the bytes of the file.
    pub fn save(&mut self) -> Result<u64, Failure> {
        self.writer.flush()?;
        Ok(self.writer.written())
    }

    pub fn finish(&mut self) -> Result<(), Failure> {
        Ok(self.writer.flush()?)
    }
}

fn value(outputs: &Outputs, slot: Slot) -> Value<'_> {
    match slot {
        Slot::Scalar(Class::Integer, i) => Value::Integer(outputs.integers.values[i]),
        Slot::Scalar(Class::Boolean, i) => Value::Boolean(outputs.booleans.values[i] != 0),
        Slot::Scalar(Class::String, i) => Value::Text(&outputs.strings.values[i]),
        _ => Value::Real(outputs.number(slot)),
    }
}
