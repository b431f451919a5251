//! Threads that let units work side by side.
//!
//! A unit's instance is *handed over* to a worker with its job and handed back with the answer, so that no two threads
//! can hold it, and a unit that never returns leaves the others and the caller usable. Workers sleep while there
//! is nothing to do; the queues keep their room, so that a step allocates nothing.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::loading::{CallError, Instance, Outputs, Stepped};

/// A unit of the system that can be handed to a worker.
#[derive(Debug)]
pub struct Member {
    /// The instance.
    pub instance: Instance,
    /// Number of `fmi2DoStep` calls.
    pub calls: u64,
    /// Wall time inside them (s); where they are short, told by every 64th.
    pub seconds: f64,
    /// Whether the last one that was timed was short.
    pub short: bool,
}

/// Steps below this (s) are short: looking at the clock would cost a good part of them.
const SHORT: f64 = 5e-6;
/// Of short steps one in so many is timed.
const SAMPLE: u64 = 256;

/// What a worker does with a unit.
#[derive(Debug)]
pub enum Task {
    /// `fmi2DoStep` from a time over a size (s).
    Step(f64, f64),
    /// Reads values; may do late work (settle a bed) and take minutes.
    Read(Box<Outputs>),
    /// `fmi2EnterInitializationMode`.
    Enter,
    /// `fmi2ExitInitializationMode`; may do late work.
    Exit,
}

/// The answer to a [`Task`].
#[derive(Debug)]
pub enum Answer {
    /// A step was done, or ended the run.
    Stepped(Stepped),
    /// What was read.
    Read(Box<Outputs>),
    /// Done.
    Done,
}

impl Member {
    /// `fmi2DoStep`, with the time it takes.
    #[inline]
    pub fn step(&mut self, time: f64, size: f64) -> Result<Stepped, CallError> {
        self.calls += 1;
        if self.short && !self.calls.is_multiple_of(SAMPLE) {
            return self.instance.step(time, size);
        }
        let begin = Instant::now();
        let stepped = self.instance.step(time, size);
        let took = begin.elapsed().as_secs_f64();
        self.seconds += if self.short { SAMPLE as f64 * took } else { took };
        self.short = took < SHORT;
        stepped
    }

    /// [`Member::step`] where it need not be timed and ends as wanted; `None`: nothing was done.
    ///
    /// # Errors
    /// The status: see [`Instance::after`].
    #[inline]
    pub fn quick_step(&mut self, time: f64, size: f64) -> Option<Result<(), i32>> {
        let calls = self.calls + 1;
        if !self.short || calls.is_multiple_of(SAMPLE) {
            return None;
        }
        self.calls = calls;
        Some(self.instance.quick_step(time, size))
    }

    /// Carries out a task on the caller's thread.
    pub fn work(&mut self, task: Task) -> Result<Answer, CallError> {
        match task {
            Task::Step(time, size) => self.step(time, size).map(Answer::Stepped),
            Task::Read(mut outputs) => self.instance.read(&mut outputs).map(|()| Answer::Read(outputs)),
            Task::Enter => self.instance.enter_initialization().map(|()| Answer::Done),
            Task::Exit => self.instance.exit_initialization().map(|()| Answer::Done),
        }
    }
}

/// A finished job: the unit's index, the unit itself, the answer.
pub type Finished = (usize, Box<Member>, Result<Answer, CallError>);

#[derive(Default)]
struct Queues {
    jobs: VecDeque<(usize, Box<Member>, Task)>,
    finished: Vec<Finished>,
    closed: bool,
}

#[derive(Default)]
struct Shared {
    queues: Mutex<Queues>,
    work: Condvar,
    done: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queues> {
        // The lock is never held while foreign code runs, so a poisoned one still guards whole queues.
        self.queues.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The workers.
pub struct Pool {
    shared: Arc<Shared>,
    workers: Vec<JoinHandle<()>>,
}

impl Pool {
    /// A pool of `helpers` threads beside the caller's; 0 is legal, everything then runs in place.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn new(helpers: usize) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let mut workers = Vec::with_capacity(helpers);
        for i in 0..helpers {
            let shared = Arc::clone(&shared);
            // Units of unknown make may need deep stacks; 8 MiB is what a main thread has.
            let builder = std::thread::Builder::new().name(format!("unit-{i}")).stack_size(8 << 20);
            workers.push(builder.spawn(move || work(&shared))?);
        }
        Ok(Self { shared, workers })
    }

    /// Number of helper threads.
    pub fn helpers(&self) -> usize {
        self.workers.len()
    }

    /// Hands a unit over.
    pub fn hand_over(&self, index: usize, member: Box<Member>, task: Task) {
        self.shared.lock().jobs.push_back((index, member, task));
        self.shared.work.notify_one();
    }

    /// A job that nobody has begun yet, for the caller to do itself.
    pub fn take_back(&self) -> Option<(usize, Box<Member>, Task)> {
        self.shared.lock().jobs.pop_front()
    }

    /// Waits for at least one finished job and puts all finished ones into `into`.
    pub fn wait(&self, into: &mut Vec<Finished>) {
        let mut queues = self.shared.lock();
        while queues.finished.is_empty() {
            queues = self.shared.done.wait(queues).unwrap_or_else(PoisonError::into_inner);
        }
        into.append(&mut queues.finished);
    }

    /// [`Pool::wait`], but not longer than this: then there may be none.
    pub fn wait_for(&self, into: &mut Vec<Finished>, time: Duration) {
        let queues = self.shared.lock();
        let wait = self.shared.done.wait_timeout_while(queues, time, |q| q.finished.is_empty());
        into.append(&mut wait.unwrap_or_else(PoisonError::into_inner).0.finished);
    }
}

fn work(shared: &Shared) {
    loop {
        let mut queues = shared.lock();
        let (index, mut member, task) = loop {
            if let Some(job) = queues.jobs.pop_front() {
                break job;
            }
            if queues.closed {
                return;
            }
            queues = shared.work.wait(queues).unwrap_or_else(PoisonError::into_inner);
        };
        drop(queues);
        let answer = member.work(task);
        shared.lock().finished.push((index, member, answer));
        shared.done.notify_one();
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.shared.lock().closed = true;
        self.shared.work.notify_all();
        for worker in self.workers.drain(..) {
            // A worker that panicked has nothing left to tell.
            let _ = worker.join();
        }
    }
}
