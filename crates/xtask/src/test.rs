//! `cargo xtask test`: what CI runs. Installing system packages is not its business: it says what is missing.

use crate::process::{cargo, root, run, step, target};
use crate::{mpi, pack, process};
use anyhow::{Context, Result, bail};
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// All checks; stops at the first that fails.
///
/// # Errors
/// The step that failed.
pub fn test() -> Result<()> {
    step("format", &mut cargo(["fmt", "--all", "--check"]))?;
    let mut clippy = cargo(["clippy", "--release", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"]);
    step("lints", &mut clippy)?;
    let mut doc = cargo(["doc", "--release", "--workspace", "--no-deps", "--quiet"]);
    step("documentation", doc.env("RUSTDOCFLAGS", "-D warnings"))?;
    step("Rust tests", &mut cargo(["test", "--release", "--workspace", "--quiet"]))?;
    let missing = mpi::missing();
    let with_mpi = match &missing {
        None => Some(mpi::build()?),
        Some(_) => None,
    };
    pack::pack()?;
    harness(with_mpi)?;
    if let Some(missing) = missing {
        eprintln!("== left out: the tests over MPI: {missing}");
    }
    Ok(())
}

/// The Python harness in a virtual environment of its own.
fn harness(with_mpi: Option<PathBuf>) -> Result<()> {
    let folder = root().join("tests/fmpy");
    let python = virtual_environment("venv", &folder.join("requirements.txt"))?;
    let mut pytest = Command::new(python);
    pytest.current_dir(&folder).args(["-m", "pytest", "-q", "-p", "no:cacheprovider"]);
    pytest.env("TERRAMECH_FMUS", process::fmus()).env("TERRAMECH_BIN", target().join("release/terramech"));
    if let Some(path) = with_mpi {
        pytest.env("TERRAMECH_MPI_BIN", path);
    }
    step("Python harness", &mut pytest)
}

/// Makes or updates the virtual environment `target/NAME`; returns its interpreter.
pub fn virtual_environment(name: &str, requirements: &std::path::Path) -> Result<PathBuf> {
    let venv = target().join(name);
    let python = venv.join("bin/python");
    let wanted =
        std::fs::read_to_string(requirements).with_context(|| format!("cannot read {}", requirements.display()))?;
    let stamp = venv.join("requirements.txt");
    if python.is_file() && std::fs::read_to_string(&stamp).ok().as_deref() == Some(&wanted) {
        return Ok(python);
    }
    let found = Command::new("python3").args(["-c", "import venv, ensurepip"]).stderr(Stdio::null()).status();
    if !found.is_ok_and(|s| s.success()) {
        bail!(
            "the Python harness needs python3 with venv; on Debian: `apt-get install python3 python3-venv`, then run `cargo xtask test` again"
        );
    }
    step("Python environment", Command::new("python3").args(["-m", "venv", "--clear"]).arg(&venv))?;
    run(Command::new(&python)
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"])
        .arg(requirements))?;
    std::fs::write(stamp, wanted)?;
    Ok(python)
}
