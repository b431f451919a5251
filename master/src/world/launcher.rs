//! Whether this process was started as one of several by an MPI launcher, and the world they make.

use super::{Broken, World};

/// What a launcher says about the job in the environment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Launched {
    /// The launcher's variable.
    pub variable: &'static str,
    /// Number of processes.
    pub size: usize,
}

/// Variables in which launchers tell the number of processes, each with one that only a launched process has: Open MPI, MPICH and its kin (Hydra), Slurm's `srun` by itself.
const VARIABLES: [(&str, &str); 3] = [
    ("OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"),
    ("PMI_SIZE", "PMI_RANK"),
    ("SLURM_STEP_NUM_TASKS", "SLURM_PROCID"),
];

/// Whether this process was started by a launcher.
pub fn launched(environment: impl Fn(&str) -> Option<String>) -> Option<Launched> {
    VARIABLES.iter().find_map(|&(variable, rank)| {
        environment(rank)?;
        let size = environment(variable)?.trim().parse().ok()?;
        Some(Launched { variable, size })
    })
}

/// The world that this process was started in; `None` where it is alone.
///
/// # Errors
/// What is wrong, for a person: this program has no MPI in it, or another one than the launcher's.
pub fn start() -> Result<Option<Box<dyn World>>, Broken> {
    match launched(|name| std::env::var(name).ok()) {
        None => Ok(None),
        Some(Launched { size: 1, .. }) => Ok(None),
        Some(launched) => join(&launched).map(Some),
    }
}

#[cfg(feature = "mpi")]
fn join(launched: &Launched) -> Result<Box<dyn World>, Broken> {
    let world = super::mpi::initialise()?;
    if world.size() != launched.size {
        return Err(Broken(format!(
            "the launcher started {} processes ({}), but the MPI in this program sees {}: it was built with another MPI than the launcher's; build it where it runs (docs/mpi.md)",
            launched.size,
            launched.variable,
            world.size()
        )));
    }
    Ok(world)
}

#[cfg(not(feature = "mpi"))]
fn join(launched: &Launched) -> Result<Box<dyn World>, Broken> {
    Err(Broken(format!(
        "this process is one of {} that an MPI launcher started ({}), but this program was built without MPI: each of them would do the whole run; build it with `cargo build --release -p terramech --features mpi` (docs/mpi.md), or start it without the launcher",
        launched.size, launched.variable
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn launchers_are_known_by_what_they_leave_in_the_environment() {
        let of = |pairs: &[(&str, &str)]| {
            let pairs: Vec<(String, String)> = pairs.iter().map(|(a, b)| ((*a).into(), (*b).into())).collect();
            launched(move |name| pairs.iter().find(|(n, _)| n == name).map(|(_, v)| v.clone()))
        };
        assert_eq!(of(&[]), None);
        let open = of(&[("OMPI_COMM_WORLD_SIZE", "6"), ("OMPI_COMM_WORLD_RANK", "0")]);
        assert_eq!(open, Some(Launched { variable: "OMPI_COMM_WORLD_SIZE", size: 6 }));
        // A batch script of Slurm has the number of tasks of the job, but is no task itself.
        assert_eq!(of(&[("SLURM_STEP_NUM_TASKS", "6")]), None);
        assert_eq!(of(&[("PMI_SIZE", "x"), ("PMI_RANK", "0")]), None);
    }

    #[cfg(not(feature = "mpi"))]
    #[test]
    fn a_program_without_mpi_refuses_to_run_several_times() {
        let told = join(&Launched { variable: "PMI_SIZE", size: 6 }).err().map(|b| b.0).unwrap_or_default();
        assert!(told.contains("one of 6") && told.contains("--features mpi"), "{told}");
    }
}
