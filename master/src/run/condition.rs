//! Conditions that end a run.

use crate::check::plan::StopCondition;
use crate::coupling::{Schedule, System, WatchId};
use crate::loading::{Class, Slot};

/// The conditions of a run with what they look at.
pub struct Conditions(Vec<(StopCondition, WatchId, Slot)>);

impl Conditions {
    /// Call it before the first [`System::read`].
    pub fn new(system: &mut System) -> Self {
        let plan = std::sync::Arc::clone(system.plan());
        let watch = |c: &StopCondition| {
            let mut slot = Slot::Scalar(Class::Real, 0);
            let id = system.watch(c.port.component, vec![Schedule::every(1)], |outputs| {
                slot = outputs.scalar(Class::from(c.port.kind), c.port.value_reference, c.port.variable);
            });
            (c.clone(), id, slot)
        };
        Self(plan.stop_when.iter().map(watch).collect())
    }

    /// The first condition that holds.
    pub fn met(&self, system: &System) -> Option<&StopCondition> {
        let holds = |(c, id, slot): &&(StopCondition, WatchId, Slot)| {
            c.comparison.holds(system.watched(*id).number(*slot), c.value)
        };
        self.0.iter().find(holds).map(|(c, ..)| c)
    }
}
