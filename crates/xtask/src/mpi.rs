//! The command `terramech` with MPI in it, where this machine has what it needs. It lies beside the ordinary one, as `target/mpi/terramech`.

use crate::process::{cargo, root, step, target};
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What is missing for MPI, in words; `None`: nothing.
pub fn missing() -> Option<String> {
    let runs = |program: &str| {
        let mut command = Command::new(program);
        command.arg("--version").stdout(Stdio::null()).stderr(Stdio::null());
        command.status().is_ok_and(|s| s.success())
    };
    let mut parts = Vec::new();
    if !runs("mpirun") {
        parts.push("mpirun");
    }
    if !runs("mpicc") {
        parts.push("mpicc");
    }
    if !has_libclang() {
        parts.push("libclang");
    }
    if parts.is_empty() {
        return None;
    }
    let parts = parts.join(", ");
    Some(format!("{parts} not found; on Debian: `apt-get install openmpi-bin libopenmpi-dev libclang-dev`"))
}

/// Where the bindings' generator looks for it.
fn has_libclang() -> bool {
    let holds = |folder: &Path| {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        entries.into_iter().any(|e| e.file_name().to_string_lossy().starts_with("libclang"))
    };
    let mut folders: Vec<PathBuf> =
        ["/usr/lib", "/usr/lib64", "/usr/local/lib", "/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu"]
            .map(PathBuf::from)
            .to_vec();
    folders.extend(std::env::var_os("LIBCLANG_PATH").map(PathBuf::from));
    let llvm = std::fs::read_dir("/usr/lib").into_iter().flatten().flatten().map(|e| e.path());
    folders.extend(llvm.filter(|p| p.to_string_lossy().contains("llvm")).map(|p| p.join("lib")));
    folders.iter().any(|f| holds(f))
}

/// Builds it.
///
/// # Errors
/// It does not build.
pub fn build() -> Result<PathBuf> {
    // With --workspace the same features as of everything else here, so that only the master compiles again.
    let args = ["build", "--release", "--quiet", "--workspace", "--bin", "terramech", "--features", "terramech/mpi"];
    step("terramech with MPI", &mut cargo(args))?;
    let folder = target().join("mpi");
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let (built, kept) = (target().join("release/terramech"), folder.join("terramech"));
    // A copy: the next build without the feature takes the place of this one.
    std::fs::copy(&built, &kept).with_context(|| format!("cannot copy {} to {}", built.display(), kept.display()))?;
    Ok(kept)
}

/// `mpirun -n RANKS`, more of them than cores if need be.
pub fn mpirun(ranks: usize) -> Command {
    let mut command = Command::new("mpirun");
    command.current_dir(root()).args(["--oversubscribe", "-n", &ranks.to_string()]);
    // What Open MPI asks of whoever is root, as in a container.
    command.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
    command
}
