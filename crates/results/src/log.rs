//! `log.jsonl`: what units and master said, one JSON object a line.

use crate::error::{Error, Result};
use crate::folder::RunFolder;
use crate::time::utc_now;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Write;
use std::path::PathBuf;

/// How grave a message is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// For whoever debugs a unit.
    Debug,
    /// Course of the run.
    Info,
    /// The run goes on, its result may not be what was meant.
    Warning,
    /// A call failed.
    Error,
}

/// One message.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogEntry {
    /// Wall clock, UTC, as in RFC 3339.
    pub wall: String,
    /// Simulated time (s); `null` before the run has one.
    pub time: Option<f64>,
    /// Name of the component; "master" for the master itself.
    pub unit: String,
    /// FMI log category.
    pub category: String,
    /// How grave.
    pub level: Level,
    /// The text.
    pub message: String,
}

impl LogEntry {
    /// A message of now.
    pub fn now(time: Option<f64>, unit: &str, category: &str, level: Level, message: &str) -> Self {
        Self {
            wall: utc_now(),
            time: time.filter(|t| t.is_finite()),
            unit: unit.into(),
            category: category.into(),
            level,
            message: message.into(),
        }
    }
}

/// Writes `log.jsonl`; each message reaches the system at once, since the last one before a crash matters most.
#[derive(Debug)]
pub struct LogWriter {
    out: File,
    path: PathBuf,
}

impl LogWriter {
    /// Creates `log.jsonl` in the run's folder.
    ///
    /// # Errors
    /// Those of [`RunFolder::stream`].
    pub fn create(folder: &RunFolder) -> Result<LogWriter> {
        let (out, path) = folder.stream("log.jsonl")?;
        Ok(LogWriter { out, path })
    }

    /// Goes on with the `log.jsonl` of an earlier part of the run.
    ///
    /// # Errors
    /// Those of [`RunFolder::append`].
    pub fn go_on(folder: &RunFolder) -> Result<LogWriter> {
        let there = std::fs::metadata(folder.file("log.jsonl")).map_or(0, |m| m.len());
        if there == 0 {
            return Self::create(folder);
        }
        let (out, path) = folder.append("log.jsonl", there)?;
        Ok(LogWriter { out, path })
    }

    /// Writes one message, stamped with the wall clock.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Json`].
    pub fn write(&mut self, time: Option<f64>, unit: &str, category: &str, level: Level, message: &str) -> Result<()> {
        self.put(&LogEntry::now(time, unit, category, level, message))
    }

    /// Writes a message that was made earlier.
    ///
    /// # Errors
    /// As [`write`](LogWriter::write).
    pub fn put(&mut self, entry: &LogEntry) -> Result<()> {
        let mut line = serde_json::to_vec(entry).map_err(|source| Error::Json { path: self.path.clone(), source })?;
        line.push(b'\n');
        self.out.write_all(&line).map_err(Error::io("write", &self.path))
    }
}
