//! Threads of one instance: rayon's global pool is blind to the host's, so each tire has its own.
//!
//! Tasks write to places of their own and sums run in a fixed order, so that no thread count changes a bit.

use super::AncfError;
use rayon::prelude::*;
use std::sync::Arc;
use terramech_simd::FlushDenormals;

/// Threads that share element work; one by default.
#[derive(Debug, Clone, Default)]
pub struct Team(Option<Arc<rayon::ThreadPool>>);

impl Team {
    /// A team of `threads`, at least one.
    ///
    /// # Errors
    /// [`AncfError::Input`] if the system gives no more threads.
    pub fn new(threads: usize) -> Result<Self, AncfError> {
        if threads <= 1 {
            return Ok(Self(None));
        }
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|k| format!("tire {k}"))
            .build()
            .map(|pool| Self(Some(Arc::new(pool))))
            .map_err(|e| AncfError::Input(vec![format!("'threads' is {threads}: {e}")]))
    }

    /// Calls `work(k, chunk)` for the k-th chunk of `size` of the data, the last one shorter.
    pub fn chunks<T: Send>(&self, data: &mut [T], size: usize, work: impl Fn(usize, &mut [T]) + Sync) {
        match &self.0 {
            None => data.chunks_mut(size).enumerate().for_each(|(k, chunk)| work(k, chunk)),
            Some(pool) => pool.install(|| {
                data.par_chunks_mut(size).enumerate().for_each(|(k, chunk)| {
                    let _mode = FlushDenormals::new();
                    work(k, chunk);
                });
            }),
        }
    }
}
