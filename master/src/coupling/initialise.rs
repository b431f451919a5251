//! From a plan to running units: loading, parameters, initialisation mode.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Instant;

use super::connect::{For, Links};
use super::job::Job;
use super::pool::{Answer, Member, Pool, Task};
use super::share::share_threads;
use super::system::{drive, finite};
use super::{Failure, Moment, System};
use crate::check::plan::Plan;
use crate::exit::code_of_failure;
use crate::loading::{Environment, Instance, Library, Made, Sets, Shared, Team};
use crate::model_description::{Causality, Kind, Value};
use crate::world::{Ranks, World};

/// Loads the libraries, makes the instances and sets their parameters: what a run does before initialisation mode.
///
/// `budget` is the number of threads this process may use; `logging` lets units log more than errors and warnings. With a `job` only the units of this rank are made, and all ranks
/// agree on how it went.
///
/// # Errors
/// [`Failure::Load`], [`Failure::Unit`] for a parameter that is refused, [`Failure::Input`] for what this program cannot couple.
pub fn assemble(
    plan: Arc<Plan>,
    budget: usize,
    logging: bool,
    environment: &Arc<dyn Environment>,
    job: Option<Box<Job>>,
) -> Result<System, Failure> {
    let made = make(&plan, budget, logging, environment, job.as_deref());
    if let Some(mut job) = job {
        let names: Vec<String> = plan.components.iter().map(|c| c.name.clone()).collect();
        // Who serves a unit that is led here must be there.
        let served = job.served();
        let made = made.and_then(|made| served.map(|()| made));
        let (made, result) = match made {
            Ok(made) => (Some(made), Ok(())),
            Err(failure) => (None, Err(failure)),
        };
        job.agree(&names, result)?;
        let Some((members, threads, pool)) = made else {
            return Err(Failure::Environment("the ranks agree on units that were not made".into()));
        };
        job.begin_teams(true)?;
        return Ok(System::new(plan, members, threads, pool, Some(job)));
    }
    let (members, threads, pool) = made?;
    Ok(System::new(plan, members, threads, pool, None))
}

/// A rank that serves the lead of a unit, from the beginning to the end of a run.
///
/// # Errors
/// The unit cannot be made here, which the lead tells, or has failed in its service, which ends the lead too.
pub fn serve_lead(
    plan: &Plan,
    unit: usize,
    threads: usize,
    environment: &Arc<dyn Environment>,
    world: Box<dyn World>,
    ranks: Ranks,
) -> Result<(), Failure> {
    let world: Shared = Rc::new(RefCell::new(world));
    let team = Team::new(Rc::clone(&world), ranks.all().collect(), None);
    let threads = u32::try_from(threads.max(1)).unwrap_or(u32::MAX);
    let made = member(plan, unit, threads, true, &mut Libraries::default(), environment).and_then(|mut made| {
        made.instance.join(&team).map_err(|e| Failure::unit(e, Moment::Before, "a team of ranks"))?;
        Ok(made)
    });
    let told = made.as_ref().err().map(|f| (f.to_string(), code_of_failure(f)));
    let told = serde_json::to_vec(&told).unwrap_or_default();
    let lead = ranks.first as usize;
    world.borrow_mut().round(&[(lead, told)], &mut [], None)?;
    let mut go = [(lead, Vec::new())];
    world.borrow_mut().round(&[], &mut go, None)?;
    let mut made = made?;
    if go[0].1 != [1] {
        return Ok(());
    }
    made.instance.serve().map_err(|e| Failure::unit(e, Moment::Before, "in the service of its lead"))
}

/// The units of this rank, the threads of all units that are here, and the workers.
type Crew = (Vec<Option<Box<Member>>>, Vec<u32>, Pool);

fn make(
    plan: &Plan,
    budget: usize,
    logging: bool,
    environment: &Arc<dyn Environment>,
    job: Option<&Job>,
) -> Result<Crew, Failure> {
    let is_here = |unit: &usize| job.is_none_or(|job| job.is_here(*unit));
    refuse_what_we_cannot(plan, is_here)?;
    let count = plan.components.len();
    let here: Vec<usize> = (0..count).filter(is_here).collect();
    let asked: Vec<Option<u32>> = here.iter().map(|&i| plan.components[i].threads).collect();
    let weights: Vec<f64> = here.iter().map(|&i| plan.model(i).weight).collect();
    let mut threads = vec![1; count];
    for (&unit, shared) in here.iter().zip(share_threads(budget.max(1), &asked, &weights)) {
        threads[unit] = shared;
    }

    let mut libraries = Libraries::default();
    let mut members: Vec<Option<Box<Member>>> = (0..count).map(|_| None).collect();
    for &unit in &here {
        let mut made = member(plan, unit, threads[unit], logging, &mut libraries, environment)?;
        if let Some(team) = job.and_then(|job| job.team(unit)) {
            made.instance.join(team).map_err(|e| Failure::unit(e, Moment::Before, "a team of ranks"))?;
        }
        members[unit] = Some(Box::new(made));
    }
    // With other ranks somebody must be free to talk to them while units settle.
    let least = usize::from(job.is_some() && !here.is_empty());
    let helpers = (budget.max(1).min(here.len().max(1)) - 1).max(least);
    let pool = Pool::new(helpers)
        .map_err(|e| Failure::Environment(format!("{helpers} threads for units side by side: {e}")))?;
    Ok((members, threads, pool))
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

fn refuse_what_we_cannot(plan: &Plan, is_here: impl Fn(&usize) -> bool) -> Result<(), Failure> {
    let mut instances = vec![0_usize; plan.fmus.len()];
    for (_, component) in plan.components.iter().enumerate().filter(|(unit, _)| is_here(unit)) {
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
        let entered = self.enter(&plan);
        self.agree(entered)?;
        for stage in &plan.initialisation {
            let mut links = Links::new(&plan, stage.connections.iter().copied(), stage.arrays.iter().copied(), false);
            let read = self.read_stage(&plan, &mut links);
            self.agree(read)?;
            if let Some(job) = &mut self.job {
                job.share(&mut links)?;
            }
            let carried = self.carry_stage(&plan, &links);
            self.agree(carried)?;
        }
        let all = (0..plan.components.len()).map(|i| (i, Task::Exit)).collect();
        let left = self.together(all).map(drop);
        self.agree(left)?;
        self.clockwork.initialise = begin.elapsed().as_secs_f64();
        Ok(())
    }

    /// Initialisation mode begins.
    fn enter(&mut self, plan: &Plan) -> Result<(), Failure> {
        self.together((0..plan.components.len()).map(|i| (i, Task::Enter)).collect())?;
        let mut sets = Sets::default();
        for (unit, member) in self.members.iter_mut().enumerate() {
            let Some(member) = member.as_deref_mut() else { continue };
            drive(plan, unit, &mut member.instance, &mut sets, plan.clock.start.to_f64())
                .map_err(|e| Failure::unit(e, Moment::Initialising, "inputs over time"))?;
        }
        Ok(())
    }

    /// Reads the sources of a stage.
    fn read_stage(&mut self, plan: &Plan, links: &mut Links) -> Result<(), Failure> {
        let is_here = |unit: &usize| self.members[*unit].is_some();
        let outputs = links.outputs.iter_mut().enumerate().filter(|(i, o)| !o.is_empty() && is_here(i));
        let reads = outputs.map(|(i, o)| (i, Task::Read(Box::new(std::mem::take(o))))).collect();
        for (unit, answer) in self.together(reads)? {
            if let Answer::Read(outputs) = answer {
                finite(plan, unit, &outputs, plan.clock.start.to_f64())?;
                links.outputs[unit] = *outputs;
            }
        }
        Ok(())
    }

    /// Sets the targets of a stage.
    fn carry_stage(&mut self, plan: &Plan, links: &Links) -> Result<(), Failure> {
        let mut sets = Sets::default();
        let step = For { span: (0, 0), all_fresh: true };
        for unit in links.targets() {
            let Some(member) = self.members[unit].as_deref_mut() else { continue };
            links
                .carry(plan, unit, &mut member.instance, &mut sets, step, |_| true)
                .map_err(|r| Failure::unit(r.error, Moment::Initialising, r.about))?;
        }
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
