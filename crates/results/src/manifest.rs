//! `manifest.json`: what was run, on what, from which inputs, how long it took and how it ended.

use crate::error::{Error, Result};
use crate::folder::RunFolder;
use crate::time::utc_now;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Facts of a run. Write it once at the start (state [`ExitState::Running`]) and again at the end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of this file's layout.
    pub format: u32,
    /// Version of terramech.
    pub terramech: String,
    /// How the run ended.
    pub state: ExitState,
    /// The command line, word by word.
    pub command: Vec<String>,
    /// Start, UTC, as in RFC 3339.
    pub started: String,
    /// Wall time from start to end (s).
    pub wall_seconds: f64,
    /// Simulated time (s).
    pub simulated_seconds: f64,
    /// The machine.
    pub machine: Machine,
    /// Which kernels ran: "portable", "avx2", ... (`TERRAMECH_ISA`).
    pub instruction_path: String,
    /// Threads shared out to the units, on each rank.
    pub threads: usize,
    /// Number of MPI ranks; 1 in one process.
    #[serde(default = "one")]
    pub ranks: usize,
    /// Every file that went in.
    pub inputs: Vec<Input>,
    /// The units.
    pub units: Vec<UnitFacts>,
    /// Where the wall time went.
    pub timings: Timings,
}

fn one() -> usize {
    1
}

impl Manifest {
    /// A manifest for a run that starts now on this machine, its lists empty.
    pub fn start(version: impl Into<String>, command: Vec<String>) -> Manifest {
        Manifest {
            format: 1,
            terramech: version.into(),
            state: ExitState::Running,
            command,
            started: utc_now(),
            wall_seconds: 0.0,
            simulated_seconds: 0.0,
            machine: Machine::detect(),
            instruction_path: "portable".into(),
            threads: 1,
            ranks: 1,
            inputs: Vec::new(),
            units: Vec::new(),
            timings: Timings::default(),
        }
    }

    /// Writes `manifest.json`.
    ///
    /// # Errors
    /// Those of [`RunFolder::write_json`].
    pub fn write(&self, folder: &RunFolder) -> Result<()> {
        folder.write_json("manifest.json", self)
    }

    /// Reads a `manifest.json`.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Json`].
    pub fn read(path: impl AsRef<Path>) -> Result<Manifest> {
        let path = path.as_ref();
        let text = std::fs::read(path).map_err(Error::io("read", path))?;
        serde_json::from_slice(&text).map_err(|source| Error::Json { path: path.to_owned(), source })
    }

    /// Simulated time over wall time; 0 before the run has an end.
    pub fn real_time_factor(&self) -> f64 {
        if self.wall_seconds > 0.0 { self.simulated_seconds / self.wall_seconds } else { 0.0 }
    }
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum ExitState {
    /// Not ended (or killed: a finished run says so).
    Running,
    /// Reached its stop time.
    Done,
    /// Stopped by the user or a unit before its stop time.
    Stopped {
        /// Who stopped it, and why.
        reason: String,
    },
    /// Failed.
    Failed {
        /// Exit code of the command: 1 input, 2 unit, 3 numerics, 4 environment.
        code: i32,
        /// The message the user saw.
        message: String,
    },
}

/// The machine a run used. Names no host and no user.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Cores this process may use.
    pub cores: usize,
    /// Name of the processor.
    pub cpu: String,
    /// Operating system and kernel.
    pub os: String,
    /// Architecture, as Rust names it ("x86_64").
    pub arch: String,
}

impl Machine {
    /// Asks the running system; what it does not tell is "unknown".
    pub fn detect() -> Machine {
        let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let value = |text: &str, key: &str, separator: char| {
            text.lines()
                .filter_map(|line| line.split_once(separator))
                .find(|(k, _)| k.trim() == key)
                .map(|(_, v)| v.trim().trim_matches('"').to_owned())
        };
        let os = value(&read("/etc/os-release"), "PRETTY_NAME", '=').unwrap_or_else(|| std::env::consts::OS.into());
        let kernel = read("/proc/sys/kernel/osrelease");
        let os = if kernel.is_empty() { os } else { format!("{os}, kernel {}", kernel.trim()) };
        Machine {
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            cpu: value(&read("/proc/cpuinfo"), "model name", ':').unwrap_or_else(|| "unknown".into()),
            os,
            arch: std::env::consts::ARCH.into(),
        }
    }
}

/// One input file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// Path as the run was given it.
    pub path: String,
    /// SHA-256 of its content, lower-case hex.
    pub sha256: String,
    /// Size (bytes).
    pub bytes: u64,
}

impl Input {
    /// Hashes a file.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn of(path: impl AsRef<Path>) -> Result<Input> {
        let path = path.as_ref();
        let (sha256, bytes) = crate::hash::sha256_file(path)?;
        Ok(Input { path: path.display().to_string(), sha256, bytes })
    }
}

/// What identifies a unit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnitFacts {
    /// Name of the component in the system description.
    pub name: String,
    /// Model name.
    pub model: String,
    /// GUID of the model.
    pub guid: String,
    /// Version the unit declares; empty = none.
    pub version: String,
    /// Threads it was given.
    pub threads: usize,
    /// The rank it ran on; 0 in one process.
    #[serde(default)]
    pub rank: usize,
}

/// Where the wall time of the coupled run (without initialisation) went.
///
/// Units run side by side, so that shares add up to 1 or more; what a unit waits for others is in no share.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Timings {
    /// Simulated seconds before they begin: more than 0 in a run that was resumed.
    #[serde(default)]
    pub since: f64,
    /// Wall time of initialisation: settling, assembly (s).
    pub initialise_seconds: f64,
    /// Wall time of the coupled run (s).
    pub run_seconds: f64,
    /// One entry a unit.
    pub units: Vec<UnitTiming>,
    /// Reading outputs, carrying and setting inputs (s).
    pub coupling_seconds: f64,
    /// Of rank 0: waiting for the others (s); 0 in one process.
    #[serde(default)]
    pub waiting_seconds: f64,
    /// `coupling_seconds / run_seconds`.
    pub coupling_share: f64,
    /// Recording (s).
    pub io_seconds: f64,
    /// `io_seconds / run_seconds`.
    pub io_share: f64,
}

impl Timings {
    /// Fills in all shares from the seconds.
    pub fn with_shares(mut self) -> Timings {
        let total = self.run_seconds;
        let share = |seconds: f64| if total > 0.0 { seconds / total } else { 0.0 };
        self.coupling_share = share(self.coupling_seconds);
        self.io_share = share(self.io_seconds);
        for unit in &mut self.units {
            unit.share = share(unit.seconds);
        }
        self
    }
}

/// Time inside one unit's `doStep`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UnitTiming {
    /// Name of the component.
    pub name: String,
    /// Number of `doStep` calls.
    pub calls: u64,
    /// Wall time inside them (s).
    pub seconds: f64,
    /// `seconds / run_seconds`.
    pub share: f64,
}
