//! The threads of one engine: a pool of its own, or the calling thread alone.
//!
//! rayon's global pool is one per library and blind to the host's, so each engine builds its own. What a task computes
//! never depends on which thread runs it.

use super::error::DemError;
use rayon::prelude::*;
use terramech_simd::FlushDenormals;

/// Threads that share the slabs of a step.
pub struct Team {
    pool: Option<rayon::ThreadPool>,
}

impl Team {
    /// A team of this many threads, at least 1. One thread needs no pool.
    ///
    /// # Errors
    /// The system refuses more threads.
    pub fn new(threads: usize) -> Result<Self, DemError> {
        if threads <= 1 {
            return Ok(Self { pool: None });
        }
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|k| format!("dem-{k}"))
            .build()
            .map(|pool| Self { pool: Some(pool) })
            .map_err(|e| DemError::parameter("threads", threads, format!("what the system grants ({e})")))
    }

    /// How many threads.
    pub fn threads(&self) -> usize {
        self.pool.as_ref().map_or(1, rayon::ThreadPool::current_num_threads)
    }

    /// Runs `work` inside the pool, so that the loops in it need no hand-over each.
    pub fn enter<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }

    /// Runs `task` on each entry, in any order, denormals flushed.
    pub fn each<A: Send>(&self, tasks: Vec<A>, task: impl Fn(A) + Sync) {
        match &self.pool {
            Some(_) => tasks.into_par_iter().with_max_len(1).for_each(|a| {
                let _mode = FlushDenormals::new();
                task(a);
            }),
            None => {
                let _mode = FlushDenormals::new();
                tasks.into_iter().for_each(task);
            }
        }
    }

    /// As [`Team::each`], making one value per entry, in their order.
    pub fn map_each<A: Send, T: Send>(&self, tasks: Vec<A>, task: impl Fn(A) -> T + Sync + Send) -> Vec<T> {
        match &self.pool {
            Some(_) => {
                let flushed = |a| {
                    let _mode = FlushDenormals::new();
                    task(a)
                };
                tasks.into_par_iter().with_max_len(1).map(flushed).collect()
            }
            None => {
                let _mode = FlushDenormals::new();
                tasks.into_iter().map(task).collect()
            }
        }
    }

    /// As [`Team::map_each`], from shared entries.
    pub fn map<A: Sync, T: Send>(&self, a: &[A], task: impl Fn(usize, &A) -> T + Sync) -> Vec<T> {
        match &self.pool {
            Some(_) => a.par_iter().enumerate().with_max_len(1).map(|(k, x)| task(k, x)).collect(),
            None => a.iter().enumerate().map(|(k, x)| task(k, x)).collect(),
        }
    }
}
