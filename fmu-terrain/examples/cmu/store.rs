//! Figures that are kept, one line of JSON each.

use crate::Outcome;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::io::Write as _;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A figure to make: its key, and how.
pub type Job<'a> = (String, Box<dyn Fn() -> Result<Value, String> + Send + Sync + 'a>);

/// A file of figures by key.
pub struct Store {
    path: String,
    known: BTreeMap<String, Value>,
    only: String,
}

impl Store {
    /// Reads what is there; a last line that was cut short is left out.
    pub fn open(path: &str, only: String) -> Outcome<Self> {
        let text = fs::read_to_string(path).unwrap_or_default();
        let mut known = BTreeMap::new();
        for line in text.lines() {
            if let Ok(value) = serde_json::from_str::<Value>(line)
                && let Some(key) = value["key"].as_str()
            {
                known.insert(key.to_string(), value);
            }
        }
        Ok(Self { path: path.to_string(), known, only })
    }

    /// The figure of a key, where it is known.
    pub fn known(&self, key: &str) -> Option<&Value> {
        self.known.get(key)
    }

    /// The figure of a key: known, or made and kept; none where it is neither known nor asked for.
    pub fn get(&mut self, key: &str, make: impl FnOnce() -> Outcome<Value>) -> Outcome<Option<Value>> {
        if let Some(value) = self.known.get(key) {
            return Ok(Some(value.clone()));
        }
        if !key.starts_with(&self.only) {
            return Ok(None);
        }
        let value = make().map_err(|e| format!("{key}: {e}"))?;
        self.keep(key, value).map(Some)
    }

    /// Makes the figures that are not known and asked for, `workers` at a time: a run of some thousand grains gains little from a second
    /// thread, two runs side by side all of it. A figure that fails ends the rest, after those that are being made are kept.
    pub fn fill(&mut self, jobs: Vec<Job>, workers: usize) -> Outcome<()> {
        let jobs: Vec<Job> =
            jobs.into_iter().filter(|(key, _)| !self.known.contains_key(key) && key.starts_with(&self.only)).collect();
        let (next, failed, store) = (AtomicUsize::new(0), Mutex::new(None), Mutex::new(self));
        std::thread::scope(|scope| {
            for _ in 0..workers.max(1) {
                scope.spawn(|| {
                    while let Some((key, make)) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let kept = make().and_then(|value| {
                            let mut store = store.lock().map_err(|e| e.to_string())?;
                            store.keep(key, value).map_err(|e| e.to_string())
                        });
                        if let Err(e) = kept {
                            next.store(jobs.len(), Ordering::Relaxed);
                            if let Ok(mut failed) = failed.lock() {
                                *failed = Some(format!("{key}: {e}"));
                            }
                        }
                    }
                });
            }
        });
        failed.into_inner().map_err(|e| e.to_string())?.map_or(Ok(()), |e| Err(e.into()))
    }

    /// Writes a figure and knows it from then on.
    fn keep(&mut self, key: &str, mut value: Value) -> Outcome<Value> {
        value["key"] = key.into();
        println!("{value}");
        let mut file = fs::OpenOptions::new().create(true).append(true).open(&self.path)?;
        writeln!(file, "{value}")?;
        self.known.insert(key.to_string(), value.clone());
        Ok(value)
    }
}
