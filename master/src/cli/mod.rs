//! The command line: what was typed becomes a validated plan, then a run.

mod args;
mod commands;
mod run;
mod soil;

use std::ffi::OsString;

use clap::Parser;

use crate::run::ExitCode;

/// Runs the command `terramech` with these arguments (the program's name first) and gives its exit code.
///
/// Results go to stdout, messages and progress to stderr.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    match args::Args::try_parse_from(&arguments) {
        Ok(args) => commands::carry_out(args, &arguments),
        Err(e) => {
            // clap writes help and version to stdout, mistakes to stderr.
            let _ = e.print();
            if e.use_stderr() { ExitCode::Input } else { ExitCode::Done }
        }
    }
}
