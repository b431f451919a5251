//! What observers want to read, and when.

use crate::loading::Outputs;

/// At which base steps a value is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Schedule {
    /// Period in base steps, at least 1.
    pub every: u64,
    /// First base step.
    pub from: u64,
    /// Last base step.
    pub to: u64,
}

impl Schedule {
    /// Every `every` base steps of the whole run.
    pub fn every(every: u64) -> Self {
        Self { every: every.max(1), from: 0, to: u64::MAX }
    }

    /// Whether base step `tick` is one of them.
    pub fn is_due(&self, tick: u64) -> bool {
        (self.from..=self.to).contains(&tick) && tick.is_multiple_of(self.every)
    }

    /// The first instant after `tick` that must be met: the next of a period of its own, and where a window opens or closes. What is wanted at every base
    /// step is wanted at every communication point, however far apart.
    pub fn next_fixed(&self, tick: u64) -> Option<u64> {
        let after = |at: u64| (at > tick).then_some(at);
        let period = || (tick + 1).max(self.from).next_multiple_of(self.every);
        let own = (self.every > 1).then(period).filter(|next| *next <= self.to);
        [own, after(self.from), after(self.to)].into_iter().flatten().min()
    }

    /// Whether one of them lies in `tick..tick + length`: a unit that communicates every `length` base steps is
    /// read at `tick` for all of them.
    pub fn is_due_within(&self, tick: u64, length: u64) -> bool {
        let first = tick.max(self.from).next_multiple_of(self.every);
        first < tick.saturating_add(length) && first <= self.to
    }
}

/// Variables of one unit that are read for an observer.
#[derive(Debug)]
pub(super) struct Watch {
    pub member: usize,
    pub schedules: Vec<Schedule>,
    pub outputs: Outputs,
}

/// Handle of what an observer watches; see [`System::watch`](super::System::watch).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WatchId(pub(super) usize);

#[cfg(test)]
mod tests {
    use super::Schedule;

    #[test]
    fn a_slow_unit_is_read_at_its_own_communication_point() {
        let s = Schedule { every: 4, from: 0, to: 12 };
        assert!(s.is_due(4) && !s.is_due(5) && !s.is_due(16));
        assert!(s.is_due_within(3, 2) && !s.is_due_within(5, 3) && s.is_due_within(5, 4) && !s.is_due_within(13, 10));
        assert!(s.is_due_within(0, 1));
    }

    #[test]
    fn a_varying_step_meets_periods_and_windows() {
        let s = Schedule { every: 4, from: 0, to: 12 };
        assert_eq!([0, 3, 4, 11, 12].map(|t| s.next_fixed(t)), [Some(4), Some(4), Some(8), Some(12), None]);
        let window = Schedule { every: 1, from: 5, to: 9 };
        assert_eq!([0, 5, 8, 9].map(|t| window.next_fixed(t)), [Some(5), Some(9), Some(9), None]);
        assert_eq!(Schedule::every(1).next_fixed(3), Some(u64::MAX));
    }
}
