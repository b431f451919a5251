//! The steps of the units, side by side where that pays.

use std::time::Duration;

use super::{SAMPLE, System};
use crate::coupling::pool::{Answer, Task};
use crate::coupling::{Advance, Failure, Moment};
use crate::loading::{CallError, Stepped};

/// Work below this (s) is not worth waking a thread for: handing a unit over and back costs some 10 microseconds.
const WORTH_A_THREAD: f64 = 30e-6;

/// How often notes of other ranks are looked for while units work.
const LOOK: Duration = Duration::from_millis(20);

impl System {
    /// Lets all units that communicate now do their step, side by side where that pays.
    ///
    /// # Errors
    /// The failure of the first unit, in the order of the plan; all have come back then.
    pub fn step(&mut self, tick: u64) -> Result<(), Failure> {
        if self.pool.helpers() == 0 && self.uniform {
            return self.step_in_place(tick);
        }
        let mut due = std::mem::take(&mut self.due);
        due.clear();
        let takes_part = |u: &usize| self.is_due(*u, tick) && self.fits(*u, tick) && self.members[*u].is_some();
        due.extend((0..self.members.len()).filter(takes_part));
        let mut away = 0_usize;
        if self.pool.helpers() > 0 && due.len() > 1 {
            if tick.is_multiple_of(SAMPLE) || tick < SAMPLE || !self.uniform {
                self.split = self.heaviest(&due);
            }
            // What is spread over ranks stays with the thread that talks to them.
            let spread = |unit: usize| self.job.as_ref().is_some_and(|job| job.is_spread(unit));
            let split = due.iter().copied().find(|u| spread(*u)).or(self.split);
            if let Some(heaviest) = split {
                for &unit in due.iter().filter(|&&u| u != heaviest && !spread(u)) {
                    if let Some(member) = self.members[unit].take() {
                        let (time, size) = self.span(unit, tick);
                        self.pool.hand_over(unit, member, Task::Step(time, size));
                        away += 1;
                    }
                }
                due.retain(|&u| u == heaviest || spread(u));
            }
        }
        let mut first: Option<(usize, CallError)> = None;
        let mut take = |unit: usize, answer: Result<Answer, CallError>, ended: &mut Option<(usize, f64)>| match answer {
            Ok(Answer::Stepped(Stepped::Ended(time))) if ended.is_none_or(|(other, _)| unit < other) => {
                *ended = Some((unit, time));
            }
            Err(error) if first.as_ref().is_none_or(|(other, _)| unit < *other) => first = Some((unit, error)),
            _ => {}
        };
        for &unit in &due {
            let (time, size) = self.span(unit, tick);
            if let Some(member) = self.members[unit].as_deref_mut() {
                take(unit, member.work(Task::Step(time, size)), &mut self.ended);
            }
        }
        self.due = due;
        let mut finished = std::mem::take(&mut self.finished);
        while away > 0 {
            if let Some((unit, mut member, task)) = self.pool.take_back() {
                take(unit, member.work(task), &mut self.ended);
                self.members[unit] = Some(member);
                away -= 1;
                continue;
            }
            self.pool.wait(&mut finished);
            for (unit, member, answer) in finished.drain(..) {
                take(unit, answer, &mut self.ended);
                self.members[unit] = Some(member);
                away -= 1;
            }
        }
        self.finished = finished;
        match first {
            Some((_, error)) => Err(Failure::unit(error, Moment::At(self.plan.clock.time(tick)), "")),
            None => Ok(()),
        }
    }

    /// Where the step from `tick` has led when all units were stepped side by side. A unit that ended the run at the end of its step leaves all of them there.
    pub(in crate::coupling) fn advanced(&self, tick: u64) -> Advance {
        let next = tick + self.stride;
        let Some((_, reached)) = self.ended else { return Advance::To(next) };
        let clock = self.plan.clock;
        let together = (reached - clock.time(next)).abs() <= 1e-9 * clock.length(self.stride) && self.all_due(next);
        Advance::Ended(together.then_some(next))
    }

    /// All units' steps on the caller's thread.
    fn step_in_place(&mut self, tick: u64) -> Result<(), Failure> {
        let time = self.time(tick);
        for (unit, (member, size)) in self.members.iter_mut().zip(&self.sizes).enumerate() {
            let Some(member) = member.as_deref_mut() else { continue };
            match member.step(time, *size) {
                Ok(Stepped::Ended(time)) => {
                    self.ended.get_or_insert((unit, time));
                }
                Ok(Stepped::Done) => {}
                Err(error) => return Err(Failure::unit(error, Moment::At(time), "")),
            }
        }
        Ok(())
    }

    /// The heaviest of these units, if it pays to hand the others over. The caller takes it: its step then pays for no wake-up and no
    /// cold cache.
    fn heaviest(&self, due: &[usize]) -> Option<usize> {
        let cost = |unit: usize| match self.effort(unit) {
            (0, _) => f64::INFINITY,
            (calls, seconds) => seconds / calls as f64,
        };
        let heaviest = due.iter().copied().max_by(|&a, &b| cost(a).total_cmp(&cost(b)))?;
        let others: f64 = due.iter().filter(|&&u| u != heaviest).map(|&u| cost(u)).sum();
        (others > WORTH_A_THREAD).then_some(heaviest)
    }

    /// Start and length (s) of a unit's step at a base step.
    pub(super) fn span(&self, unit: usize, tick: u64) -> (f64, f64) {
        (self.time(tick), self.sizes[unit])
    }

    /// Carries out one task per unit that is here side by side and gives the answers in the order of the tasks.
    pub(in crate::coupling) fn side_by_side(
        &mut self,
        tasks: Vec<(usize, Task)>,
    ) -> Vec<(usize, Result<Answer, CallError>)> {
        let order: Vec<usize> = tasks.iter().map(|(unit, _)| *unit).collect();
        let mut away = 0_usize;
        let (spread, others): (Vec<_>, Vec<_>) =
            tasks.into_iter().partition(|(unit, _)| self.job.as_ref().is_some_and(|job| job.is_spread(*unit)));
        for (unit, task) in others {
            if let Some(member) = self.members[unit].take() {
                self.pool.hand_over(unit, member, task);
                away += 1;
            }
        }
        let mut answers: Vec<(usize, Result<Answer, CallError>)> = Vec::with_capacity(order.len());
        for (unit, task) in spread {
            if let Some(member) = self.members[unit].as_deref_mut() {
                answers.push((unit, member.work(task)));
            }
        }
        let mut finished = Vec::new();
        while away > 0 {
            // With other ranks there is somebody to listen to, for minutes if a bed settles.
            if self.job.is_some() && self.pool.helpers() > 0 {
                self.pool.wait_for(&mut finished, LOOK);
                // A connection that is lost is told by the round that follows.
                let _ = self.listen();
            } else if let Some((unit, mut member, task)) = self.pool.take_back() {
                let answer = member.work(task);
                finished.push((unit, member, answer));
            } else {
                self.pool.wait(&mut finished);
            }
            for (unit, member, answer) in finished.drain(..) {
                self.members[unit] = Some(member);
                answers.push((unit, answer));
                away -= 1;
            }
        }
        answers.sort_by_key(|(unit, _)| order.iter().position(|u| u == unit));
        answers
    }
}
