//! Figures that are kept, one line of JSON each.

use crate::Outcome;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::io::Write as _;

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

    /// The figure of a key: known, or made and kept; none where it is neither known nor asked for.
    pub fn get(&mut self, key: &str, make: impl FnOnce() -> Outcome<Value>) -> Outcome<Option<Value>> {
        if let Some(value) = self.known.get(key) {
            return Ok(Some(value.clone()));
        }
        if !key.starts_with(&self.only) {
            return Ok(None);
        }
        let mut value = make().map_err(|e| format!("{key}: {e}"))?;
        value["key"] = key.into();
        println!("{value}");
        let mut file = fs::OpenOptions::new().create(true).append(true).open(&self.path)?;
        writeln!(file, "{value}")?;
        self.known.insert(key.to_string(), value.clone());
        Ok(Some(value))
    }
}
