//! What units talk to during a run: their messages go to `log.jsonl` and, where grave, to the terminal; their progress to the
//! display.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use terramech_results::{Level, LogEntry, LogWriter};

use super::watchdog::Watchdog;
use super::{Display, Stop};
use crate::coupling::{Failure, Note, Relay};
use crate::decimal::Clock;
use crate::loading::{Environment, LogLine, Pulse};

/// How many warnings are shown on the terminal; a unit may warn at every step.
const SHOWN_WARNINGS: u64 = 20;
/// How many base steps pass between two looks at the wall clock, at most.
const GLANCE: u64 = 16;

/// Messages that are kept until there is a file for them.
const WAITING: usize = 10_000;

/// The log, and what is said before it has a file: a run that does not start leaves an earlier run's log as it is.
enum Log {
    Waiting(Vec<LogEntry>),
    Open(LogWriter),
}

pub struct Host {
    log: Mutex<Log>,
    display: Mutex<Display>,
    stop: Stop,
    /// Simulated time as bits; NaN before there is one.
    time: AtomicU64,
    warnings: AtomicU64,
    pub watchdog: Arc<Watchdog>,
    /// On a rank other than 0: what it has to tell rank 0.
    outbox: Option<Mutex<VecDeque<Note>>>,
}

impl Host {
    pub fn new(display: Display, stop: Stop) -> Self {
        let time = AtomicU64::new(f64::NAN.to_bits());
        let log = Mutex::new(Log::Waiting(Vec::new()));
        let (warnings, watchdog) = (AtomicU64::new(0), Arc::default());
        Self { log, display: Mutex::new(display), stop, time, warnings, watchdog, outbox: None }
    }

    /// The host of a rank other than 0: shows nothing, writes nothing, and tells rank 0 all of it.
    pub fn elsewhere(stop: Stop) -> Self {
        Self { outbox: Some(Mutex::default()), ..Self::new(Display::quiet(), stop) }
    }

    fn outbox(&self) -> Option<MutexGuard<'_, VecDeque<Note>>> {
        self.outbox.as_ref().map(|o| o.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Gives the log its file and writes what was said so far.
    pub fn open_log(&self, mut writer: LogWriter) -> Result<(), Failure> {
        let mut log = self.log.lock().unwrap_or_else(PoisonError::into_inner);
        if let Log::Waiting(entries) = &*log {
            for entry in entries {
                writer.put(entry)?;
            }
        }
        *log = Log::Open(writer);
        Ok(())
    }

    fn display(&self) -> MutexGuard<'_, Display> {
        self.display.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self, unit: &str, category: &str, level: Level, text: &str) {
        let time = f64::from_bits(self.time.load(Ordering::Relaxed));
        let entry = LogEntry::now(Some(time), unit, category, level, text);
        match self.outbox() {
            None => self.put(entry),
            Some(outbox) if outbox.len() >= WAITING => {}
            Some(mut outbox) => outbox.push_back(Note::Log(entry)),
        }
    }

    fn put(&self, entry: LogEntry) {
        let mut log = self.log.lock().unwrap_or_else(PoisonError::into_inner);
        match &mut *log {
            Log::Waiting(entries) if entries.len() >= WAITING => {}
            Log::Waiting(entries) => entries.push(entry),
            // A full disk is told by the results, which are written all the time; a lost remark must not end a run.
            Log::Open(writer) => {
                let _ = writer.put(&entry);
            }
        }
    }

    /// Shows a warning, unless there were many.
    fn warn(&self, unit: &str, text: &str) {
        match self.warnings.fetch_add(1, Ordering::Relaxed) {
            n if n < SHOWN_WARNINGS => self.display().message(&format!("{unit}: warning: {text}")),
            SHOWN_WARNINGS => self.display().message("further warnings go to log.jsonl only"),
            _ => {}
        }
    }

    /// A remark of the master.
    pub fn note(&self, text: &str) {
        self.write("master", "note", Level::Warning, text);
        self.display().message(&format!("note: {text}"));
    }

    /// The last words of a run, shown in any case.
    pub fn say(&self, text: &str) {
        self.write("master", "error", Level::Error, text);
        self.display().finish();
        eprintln!("{text}");
    }

    /// Initialisation begins.
    pub fn initialising(&self) {
        self.display().initialising();
    }

    /// Stepping begins at base step `from`.
    pub fn running(&self, clock: Clock, from: u64) {
        self.display().running(clock, from);
    }

    /// The run stands at this time (s).
    pub fn at(&self, time: f64, tick: u64) {
        self.time.store(time.to_bits(), Ordering::Relaxed);
        if tick.is_multiple_of(GLANCE) || self.display().is_slow() {
            self.display().step(time, tick);
        }
    }

    /// The simulated time (s); `None` before there is one.
    pub fn time(&self) -> Option<f64> {
        let time = f64::from_bits(self.time.load(Ordering::Relaxed));
        (!time.is_nan()).then_some(time)
    }

    /// Nothing more is shown.
    pub fn finish(&self) {
        self.display().finish();
    }
}

impl Environment for Host {
    fn log(&self, line: LogLine<'_>) {
        let level = if line.is_error() {
            Level::Error
        } else if line.is_warning() {
            Level::Warning
        } else if line.category.to_ascii_lowercase().contains("debug") {
            Level::Debug
        } else {
            Level::Info
        };
        self.write(line.unit, line.category, level, line.text);
        // Errors end the run and are told then, with the call they belong to.
        if level == Level::Warning {
            self.warn(line.unit, line.text);
        }
    }

    fn follow(&self, pulse: &Arc<Pulse>) {
        self.watchdog.follow(pulse);
    }

    fn progress(&self, unit: &str, phase: &str, fraction: f64) -> bool {
        match self.outbox() {
            None => self.display().phase(unit, phase, fraction),
            Some(mut outbox) => {
                // Of each unit the last counts.
                let told = Note::Progress { unit: unit.into(), phase: phase.into(), fraction };
                let same = |n: &&mut Note| matches!(n, Note::Progress { unit: u, .. } if u == unit);
                match outbox.iter_mut().find(same) {
                    Some(note) => *note = told,
                    None => outbox.push_back(told),
                }
            }
        }
        !self.stop.is_asked()
    }
}

impl Relay for Host {
    fn say(&self) -> Option<Note> {
        self.outbox()?.pop_front()
    }

    fn hear(&self, _: usize, note: Note) {
        match note {
            Note::Log(entry) => {
                if entry.level == Level::Warning {
                    self.warn(&entry.unit, &entry.message);
                }
                self.put(entry);
            }
            Note::Progress { unit, phase, fraction } => self.display().phase(&unit, &phase, fraction),
            Note::Stop => self.stop.ask(),
        }
    }

    fn is_stop_asked(&self) -> bool {
        self.stop.is_asked()
    }
}
