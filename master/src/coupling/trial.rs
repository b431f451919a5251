//! What `check` asks of the units themselves: faults of specifications and parameters, without the long work.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::initialise::{Libraries, member};
use super::{Failure, Moment};
use crate::check::plan::Plan;
use crate::loading::{Cause, Class, Environment, LogLine, Outputs};
use crate::model_description::Causality;

/// Hears nothing and stops long work as soon as it reports itself.
#[derive(Default)]
struct Impatient {
    stopped: AtomicBool,
}

impl Environment for Impatient {
    fn log(&self, _: LogLine<'_>) {}
    fn progress(&self, _: &str, _: &str, _: f64) -> bool {
        self.stopped.store(true, Ordering::Relaxed);
        false
    }
}

/// Makes each unit, sets its parameters, enters initialisation mode and frees it again; gives all failures, in the order of the plan.
///
/// Our units read their specification on entering initialisation mode, and check modes and files when a first value is
/// asked for. So their outputs are read as well; settling and inflation begin with a report of progress, which is answered by "stop".
/// Of a foreign unit nothing is read: without its inputs it may have no values. One that needs the tool that made it is not started.
pub fn try_units(plan: &Plan) -> Vec<Failure> {
    let mut libraries = Libraries::default();
    let mut failures = Vec::new();
    for index in 0..plan.components.len() {
        if !plan.model(index).co_simulation.needs_execution_tool {
            failures.extend(try_unit(plan, index, &mut libraries).err());
        }
    }
    failures
}

fn try_unit(plan: &Plan, index: usize, libraries: &mut Libraries) -> Result<(), Failure> {
    let patience = Arc::new(Impatient::default());
    let environment: Arc<dyn Environment> = Arc::clone(&patience) as Arc<dyn Environment>;
    let mut instance = member(plan, index, 1, false, libraries, &environment)?.instance;
    instance.enter_initialization().or_else(|e| {
        // A unit may do its long work here; being stopped is no fault of it.
        if patience.stopped.load(Ordering::Relaxed) && e.cause == Cause::Unknown {
            Ok(())
        } else {
            Err(Failure::unit(e, Moment::Initialising, ""))
        }
    })?;
    let model = plan.model(index);
    if !model.is_ours {
        return Ok(());
    }
    // One by one: a value that would need long work must not hide the others.
    for (i, v) in model.variables.iter().enumerate() {
        if !matches!(v.causality, Causality::Output | Causality::CalculatedParameter) || !instance.is_alive() {
            continue;
        }
        let mut outputs = Outputs::default();
        outputs.scalar(Class::from(v.kind), v.value_reference, i);
        match instance.read(&mut outputs) {
            // Any other failure may come from inputs that are not there yet.
            Err(e) if e.cause == Cause::Input => return Err(Failure::unit(e, Moment::Initialising, "")),
            _ => {}
        }
    }
    Ok(())
}
