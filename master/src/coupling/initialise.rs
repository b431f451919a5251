//! From a plan to running units: loading, parameters, initialisation mode.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use super::connect::{For, Links};
use super::pool::{Answer, Member, Pool, Task};
use super::share::share_threads;
use super::system::{drive, finite};
use super::{Failure, Moment, System};
use crate::check::plan::Plan;
use crate::loading::{Environment, Instance, Library, Made, Sets};
use crate::model_description::{Causality, Kind, Value};

/// Loads the libraries, makes the instances and sets their parameters: what a run does before initialisation mode.
///
/// `budget` is the number of threads the whole run may use; `logging` lets units log more than errors and warnings.
///
/// # Errors
/// [`Failure::Load`], [`Failure::Unit`] for a parameter that is refused, [`Failure::Input`] for what this program cannot couple.
pub fn assemble(
    plan: Arc<Plan>,
    budget: usize,
    logging: bool,
    environment: &Arc<dyn Environment>,
) -> Result<System, Failure> {
    refuse_what_we_cannot(&plan)?;
    let count = plan.components.len();
    let asked: Vec<Option<u32>> = plan.components.iter().map(|c| c.threads).collect();
    let weights: Vec<f64> = (0..count).map(|i| plan.model(i).weight).collect();
    let threads = share_threads(budget.max(1), &asked, &weights);

    let mut libraries = Libraries::default();
    let mut members = Vec::with_capacity(count);
    for (i, &threads) in threads.iter().enumerate() {
        members.push(Some(Box::new(member(&plan, i, threads, logging, &mut libraries, environment)?)));
    }
    let helpers = budget.max(1).min(count.max(1)) - 1;
    let pool = Pool::new(helpers)
        .map_err(|e| Failure::Environment(format!("{helpers} threads for units side by side: {e}")))?;
    Ok(System::new(plan, members, threads, pool))
}

/// Libraries by path, each opened once.
#[derive(Default)]
pub(super) struct Libraries(HashMap<PathBuf, Arc<Library>>);

/// One unit with its parameters set, before initialisation mode.
pub(super) fn member(
    plan: &Plan,
    index: usize,
    threads: u32,
    logging: bool,
    libraries: &mut Libraries,
    environment: &Arc<dyn Environment>,
) -> Result<Member, Failure> {
    let component = &plan.components[index];
    let fmu = &plan.fmus[component.fmu];
    let model = plan.model(index);
    let Some(path) = fmu.library.clone() else {
        return Err(Failure::Input(format!("{}: the FMU holds no library for this machine", fmu.path.display())));
    };
    // The linker takes the path as it is: a relative one would be searched in the system's folders.
    let path = std::path::absolute(&path).unwrap_or(path);
    let library = match libraries.0.get(&path) {
        Some(library) => Arc::clone(library),
        None => {
            let library = Library::open(&path)?;
            libraries.0.insert(path, Arc::clone(&library));
            library
        }
    };
    let resources = fmu.unpacked.folder().join("resources");
    let variable_steps = model.co_simulation.can_handle_variable_communication_step_size;
    let made = Made { name: &component.name, guid: &model.guid, resources: &resources, logging, variable_steps };
    let mut instance = Instance::new(&library, &made, Arc::clone(environment))?;
    let before = |e| Failure::unit(e, Moment::Before, "");
    instance.set(&settings(plan, index, threads)).map_err(before)?;
    instance.setup(plan.clock.start.to_f64(), Some(plan.clock.stop())).map_err(before)?;
    Ok(Member { instance, calls: 0, seconds: 0.0, short: false })
}

fn refuse_what_we_cannot(plan: &Plan) -> Result<(), Failure> {
    let mut instances = vec![0_usize; plan.fmus.len()];
    for component in &plan.components {
        instances[component.fmu] += 1;
    }
    for (fmu, count) in plan.fmus.iter().zip(instances) {
        if count > 1 && fmu.model.co_simulation.can_be_instantiated_only_once_per_process {
            return Err(Failure::Input(format!(
                "{}: {count} components use this FMU, which declares canBeInstantiatedOnlyOncePerProcess; use it once",
                fmu.path.display()
            )));
        }
    }
    Ok(())
}

/// Start values of a component, by type, with the threads it is given.
fn settings(plan: &Plan, component: usize, threads: u32) -> Sets {
    let mut sets = Sets::default();
    let model = plan.model(component);
    let mut threads_given = false;
    for s in &plan.components[component].settings {
        threads_given |= &*model.variables[s.variable].name == "threads";
        match (&s.value, s.kind) {
            (Value::Real(x), _) => sets.real(s.value_reference, *x),
            (Value::Integer(x), Kind::Real) => sets.real(s.value_reference, f64::from(*x)),
            (Value::Integer(x), _) => sets.integer(s.value_reference, *x),
            (Value::Boolean(x), _) => sets.boolean(s.value_reference, *x),
            (Value::String(x), _) => sets.string(s.value_reference, x.as_str()),
        }
    }
    // `threads` is every Terramech unit's parameter; one that the user has set is left alone.
    if let Some(v) = model.variable("threads")
        && !threads_given
        && v.kind == Kind::Integer
        && v.causality == Causality::Parameter
    {
        sets.integer(v.value_reference, i32::try_from(threads).unwrap_or(i32::MAX));
    }
    sets
}

impl System {
    /// Initialisation mode: enters it, exchanges values stage by stage in the plan's order, leaves it.
    ///
    /// Units work side by side within each part: settling a bed may happen in any of them.
    ///
    /// # Errors
    /// The failure of the first unit, in the order of the plan.
    pub fn initialise(&mut self) -> Result<(), Failure> {
        let begin = Instant::now();
        let plan = Arc::clone(&self.plan);
        let start = plan.clock.start.to_f64();
        let all = || 0..plan.components.len();
        self.together(all().map(|i| (i, Task::Enter)).collect())?;
        let mut sets = Sets::default();
        for (unit, member) in self.members.iter_mut().enumerate() {
            let Some(member) = member.as_deref_mut() else { continue };
            drive(&plan, unit, &mut member.instance, &mut sets, start)
                .map_err(|e| Failure::unit(e, Moment::Initialising, "inputs over time"))?;
        }
        for stage in &plan.initialisation {
            let mut links = Links::new(&plan, stage.connections.iter().copied(), stage.arrays.iter().copied(), false);
            let outputs = links.outputs.iter_mut().enumerate().filter(|(_, o)| !o.is_empty());
            let reads = outputs.map(|(i, o)| (i, Task::Read(Box::new(std::mem::take(o))))).collect();
            for (unit, answer) in self.together(reads)? {
                if let Answer::Read(outputs) = answer {
                    finite(&plan, unit, &outputs, start)?;
                    links.outputs[unit] = *outputs;
                }
            }
            let targets: Vec<usize> = links.targets().collect();
            for unit in targets {
                let Some(member) = self.members[unit].as_deref_mut() else { continue };
                links
                    .carry(&plan, unit, &mut member.instance, &mut sets, For { span: (0, 0), all_fresh: true }, |_| {
                        true
                    })
                    .map_err(|r| Failure::unit(r.error, Moment::Initialising, r.about))?;
            }
        }
        self.together(all().map(|i| (i, Task::Exit)).collect())?;
        self.clockwork.initialise = begin.elapsed().as_secs_f64();
        Ok(())
    }

    fn together(&mut self, tasks: Vec<(usize, Task)>) -> Result<Vec<(usize, Answer)>, Failure> {
        let mut answers = Vec::new();
        for (unit, answer) in self.side_by_side(tasks) {
            answers.push((unit, answer.map_err(|e| Failure::unit(e, Moment::Initialising, ""))?));
        }
        Ok(answers)
    }
}
