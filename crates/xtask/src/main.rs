//! Everything a newcomer or CI runs: `cargo xtask demo|test|pack|systems|soil|study|validate|bench`.

mod bench;
mod demo;
mod mpi;
mod pack;
mod process;
mod soil;
mod statistics;
mod study;
mod systems;
mod test;
mod validate;

use clap::{Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// Terramech's tasks.
#[derive(Parser)]
#[command(name = "cargo xtask")]
struct Args {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Build and pack the units, drive a wheel through granular soil, write the report.
    Demo {
        /// Folder for the results.
        #[arg(long, default_value = "out/single-wheel")]
        out: PathBuf,
    },
    /// Formatting, lints, documentation, Rust tests, packing, Python harness: what CI runs.
    Test,
    /// Build the units in release and write FMUs into target/fmus and their descriptions into modelDescriptions.
    Pack,
    /// Write the system descriptions of the vehicle studies in examples/ from the units' variables.
    Systems,
    /// Run the long validation and write its tables into docs/validation.
    Validate {
        /// Part to run (default: all).
        name: Option<String>,
    },
    /// Build, pack and run `terramech soil`: density, angle of repose, direct shear, plate sinkage; with plots.
    Soil {
        /// Those of `terramech soil`.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        args: Vec<String>,
    },
    /// Run the studies of vehicles and tires on soil in small size; writes tables and plots into docs/studies.
    Study {
        /// Study to run (default: all): straight-line, ruts, obstacle, turn, multi-pass, depth, checks.
        name: Option<String>,
        /// In the size of the publication: hours; one that was stopped goes on. Writes docs/studies/paper-NAME.md.
        #[arg(long)]
        paper: bool,
        /// With --paper: only look at the run in this folder.
        #[arg(long, value_name = "DIR", requires = "paper")]
        run: Option<PathBuf>,
    },
    /// Measure; prints a table.
    Bench {
        /// Benchmark to run.
        name: String,
        /// Also write the rows as a JSON list.
        #[arg(long)]
        json: Option<PathBuf>,
    },
}

fn main() -> ExitCode {
    let result = match Args::parse().task {
        Task::Demo { out } => demo::demo(&out),
        Task::Test => test::test(),
        Task::Pack => pack::pack().map(|_| ()),
        Task::Systems => systems::systems(),
        Task::Validate { name } => validate::validate(name.as_deref()),
        Task::Study { name, paper, run } => study::study(name.as_deref(), paper.then_some(run.as_deref())),
        Task::Soil { args } => soil::soil(&args),
        Task::Bench { name, json } => bench::bench(&name, json.as_deref()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {}", told(&e));
            ExitCode::FAILURE
        }
    }
}

/// An error with its causes, each once: some texts end with their cause already.
fn told(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if text.is_empty() {
            text = cause;
        } else if !text.ends_with(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context as _;

    #[test]
    fn a_cause_is_told_once() {
        let missing = || terramech_results::CsvTable::read("no/such.csv");
        let cause = std::io::Error::from_raw_os_error(2).to_string();
        let e = missing().context("the study").unwrap_err();
        assert_eq!(told(&e), format!("the study: cannot read no/such.csv: {cause}"));
        let e = anyhow::anyhow!("inner").context("outer");
        assert_eq!(told(&e), "outer: inner");
    }
}
