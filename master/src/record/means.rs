//! Headline values: means over windows of time, formed at every communication point of the unit, not from recorded rows.

use terramech_results::Headline;

use crate::coupling::{Schedule, System, WatchId};
use crate::loading::{Class, Slot};

struct Mean {
    item: usize,
    unit: usize,
    id: WatchId,
    slot: Slot,
    schedule: Schedule,
    /// First and last time and value seen (s), and the integral between them by the trapezoidal rule.
    first: Option<f64>,
    last: Option<(f64, f64)>,
    integral: f64,
}

/// All headline values.
pub struct Means {
    means: Vec<Mean>,
    heads: Vec<Headline>,
}

impl Means {
    pub fn new(system: &mut System) -> Self {
        let plan = std::sync::Arc::clone(system.plan());
        let mut means = Vec::new();
        let mut heads = Vec::new();
        for (item, s) in plan.summary.iter().enumerate() {
            let schedule = Schedule { every: 1, from: s.from, to: s.to };
            let mut slot = Slot::Scalar(Class::Real, 0);
            let id = system.watch(s.port.component, vec![schedule], |outputs| {
                slot = outputs.scalar(Class::from(s.port.kind), s.port.value_reference, s.port.variable);
            });
            means.push(Mean {
                item,
                unit: s.port.component,
                id,
                slot,
                schedule,
                first: None,
                last: None,
                integral: 0.0,
            });
            let unit = s.unit.as_ref().map(|u| u.name.clone()).unwrap_or_default();
            let mut head = Headline::new(&s.name, f64::NAN, unit);
            head.measured = s.measured;
            head.source.clone_from(&s.source);
            heads.push(head);
        }
        Self { means, heads }
    }

    pub fn observe(&mut self, system: &System, tick: u64) {
        for mean in &mut self.means {
            if mean.schedule.is_due(tick) && system.is_due(mean.unit, tick) {
                let (t, x) = (system.clock().time(tick), system.watched(mean.id).number(mean.slot));
                if let Some((t0, x0)) = mean.last {
                    mean.integral += 0.5 * (t - t0) * (x + x0);
                }
                mean.first.get_or_insert(t);
                mean.last = Some((t, x));
            }
        }
    }

    /// For a checkpoint: of each mean first time, last time and value, integral; not a number where there is none.
    pub fn save(&self) -> Vec<[f64; 4]> {
        let none = f64::NAN;
        self.means
            .iter()
            .map(|m| {
                let (t, x) = m.last.unwrap_or((none, none));
                [m.first.unwrap_or(none), t, x, m.integral]
            })
            .collect()
    }

    /// The reverse of [`Means::save`].
    pub fn restore(&mut self, saved: &[[f64; 4]]) {
        for (mean, &[first, t, x, integral]) in self.means.iter_mut().zip(saved) {
            mean.first = (!first.is_nan()).then_some(first);
            mean.last = (!t.is_nan()).then_some((t, x));
            mean.integral = integral;
        }
    }

    /// Means so far; a window that the run did not reach gives no number, one it left early its part.
    pub fn headlines(&self) -> Vec<Headline> {
        let mut heads = self.heads.clone();
        for mean in &self.means {
            let (Some(first), Some((last, x))) = (mean.first, mean.last) else { continue };
            let head = &mut heads[mean.item];
            if last > first {
                head.value = mean.integral / (last - first);
                head.window = Some([first, last]);
            } else {
                head.value = x;
            }
        }
        heads
    }
}
