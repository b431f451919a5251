//! `cargo xtask soil SPECIFICATION.json ...`: builds and packs what `terramech soil` needs, and runs it.

use crate::pack;
use crate::process::{fmus, run, target};
use anyhow::Result;
use std::process::Command;

/// Runs it with these arguments.
///
/// # Errors
/// It does not build, or ends with an error.
pub fn soil(args: &[String]) -> Result<()> {
    pack::pack()?;
    run(Command::new(target().join("release/terramech")).arg("soil").args(args).arg("--fmu-path").arg(fmus()))
}
