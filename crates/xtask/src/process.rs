//! Running cargo and other programs from the project's root.

use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// The project's root: this crate is two folders below it.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("crates/xtask lies in the project").to_path_buf()
}

/// Where cargo builds.
pub fn target() -> PathBuf {
    match std::env::var_os("CARGO_TARGET_DIR") {
        Some(dir) => root().join(dir),
        None => root().join("target"),
    }
}

/// Where the packed FMUs lie.
pub fn fmus() -> PathBuf {
    target().join("fmus")
}

/// `cargo ARGS` in the root.
pub fn cargo<I: AsRef<str>>(args: impl IntoIterator<Item = I>) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root());
    for arg in args {
        command.arg(arg.as_ref());
    }
    command
}

/// Runs a command to its end.
///
/// # Errors
/// When it cannot be started or fails; the command line is named.
pub fn run(command: &mut Command) -> Result<()> {
    let line = line(command);
    let status = command.status().with_context(|| format!("cannot start `{line}`"))?;
    if !status.success() {
        bail!("`{line}` failed ({status})");
    }
    Ok(())
}

/// Runs a command as a named step, with its wall time.
///
/// # Errors
/// As [`run`].
pub fn step(name: &str, command: &mut Command) -> Result<()> {
    eprintln!("== {name}: {}", line(command));
    let start = Instant::now();
    run(command)?;
    eprintln!("== {name}: done in {:.1} s", start.elapsed().as_secs_f64());
    Ok(())
}

fn line(command: &Command) -> String {
    let mut words = vec![command.get_program().to_string_lossy().into_owned()];
    words.extend(command.get_args().map(|a| a.to_string_lossy().into_owned()));
    words[0] = Path::new(&words[0]).file_name().map_or(words[0].clone(), |n| n.to_string_lossy().into_owned());
    words.join(" ")
}
