//! `cargo xtask soil [SPECIFICATION.json] ...`: virtual soil tests on a specification.
//!
//! The master knows units only through their C interface, and the tests need the granular engine itself (walls that go away, plates
//! that keep a pressure): so they are no command of `terramech`, but a program of the unit crate, which this task builds and runs.

use crate::process::{cargo, run, target};
use anyhow::Result;
use std::process::Command;

/// Runs it with these arguments (see `fmu-terrain/examples/soil.rs`).
///
/// # Errors
/// It does not build, or ends with an error.
pub fn soil(args: &[String]) -> Result<()> {
    run(&mut cargo(["build", "--release", "--quiet", "-p", "fmu-terrain", "--example", "soil"]))?;
    run(Command::new(target().join("release/examples/soil")).args(args))
}
