//! What may be typed.

use std::path::PathBuf;

use clap::{Parser, Subcommand};

/// Couples units (FMUs) as a system description says, and records the run.
#[derive(Debug, Parser)]
#[command(
    name = "terramech",
    version,
    after_help = "Exit codes: 0 done; 1 wrong input; 2 a unit failed; 3 numerical failure; 4 environment (disk, threads); 130 stopped by Ctrl-C"
)]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a system
    Run(Run),
    /// Check a system or an FMU and tell every fault: files, connections, and what the units say of their parameters and
    /// specifications; simulates nothing
    Check(Check),
    /// Put a system with its FMUs and specifications into one .ssp archive
    Pack(Pack),
    /// Make a system description of an OspSystemStructure.xml (Open Simulation Platform)
    Import(Import),
    /// Show the variables and connections of a system or an FMU
    Inspect(Inspect),
    /// Test the soil of a specification as on an engineer's bench: bulk density, angle of repose, direct shear, plate sinkage (Bekker), with plots
    Soil(Soil),
}

/// How a system is found and changed.
#[derive(Debug, clap::Args)]
pub struct System {
    /// System description: a .ssd file, a .ssp archive, or the folder of an unpacked one (for `check` also an FMU)
    // `run --resume` conflicts with it, and clap does not ask for what a given argument excludes.
    #[arg(required = true)]
    pub system: Option<PathBuf>,
    /// Stop time in s instead of the description's
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub stop_time: Option<String>,
    /// Set a parameter or start value, as unit.variable=value; may be repeated
    #[arg(long, value_name = "UNIT.VARIABLE=VALUE")]
    pub set: Vec<String>,
    /// Set parameters from an SSP parameter set, named unit.variable; may be repeated, later ones win, --set over all
    #[arg(long, value_name = "FILE.ssv")]
    pub params: Vec<PathBuf>,
    /// Use another FMU for a component, as component=FMU; may be repeated
    #[arg(long, value_name = "COMPONENT=FMU")]
    pub swap: Vec<String>,
    /// Inputs over time: a CSV file with columns "time [s]", "unit.variable [unit]", ...
    #[arg(long, value_name = "FILE.csv")]
    pub inputs: Option<PathBuf>,
    /// End the run when a condition holds, such as "rig.drawbar_pull < 0"; may be repeated
    #[arg(long, value_name = "CONDITION")]
    pub stop_when: Vec<String>,
    /// A folder to search for FMUs with bare names; may be repeated
    #[arg(long, value_name = "DIR")]
    pub fmu_path: Vec<PathBuf>,
    /// Coupling algorithm instead of the description's: jacobi, gauss-seidel, iterated or ecco
    #[arg(long, value_name = "NAME")]
    pub algorithm: Option<String>,
}

/// `terramech run`.
#[derive(Debug, clap::Args)]
pub struct Run {
    /// The system.
    #[command(flatten)]
    pub system: System,
    /// Folder for the results: new, empty, or of an earlier run, whose files are replaced
    #[arg(long, value_name = "DIR", required_unless_present = "resume")]
    pub out: Option<PathBuf>,
    /// Go on with the run in this folder from its last checkpoint, to the same bits; --stop-time may be given anew
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "system", "set", "params", "swap", "inputs", "fmu_path", "algorithm"])]
    pub resume: Option<PathBuf>,
    /// Write a checkpoint every so many simulated seconds (one is written on Ctrl-C in any case, where all units can save their state)
    #[arg(long, value_name = "S")]
    pub checkpoint_every: Option<String>,
    /// How many checkpoints are kept
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub keep_checkpoints: u16,
    /// Threads for all units together [default: the cores this process may use]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096))]
    pub threads: Option<u16>,
    /// Give the run up when a call into a unit takes longer than this without a report of progress (wall time; 0: never)
    #[arg(long, value_name = "S", default_value_t = 1800.0)]
    pub call_limit: f64,
    /// Under mpirun: where a unit runs, as NAME=RANK, NAME=2..5 (ranks 2 to 5) or NAME=auto; * in the name stands for any text; may be repeated
    #[arg(long, value_name = "NAME=RANKS")]
    pub place: Vec<String>,
    /// Under mpirun: weigh units that have no place by the time they took in an earlier run
    #[arg(long, value_name = "MANIFEST.json")]
    pub place_by: Option<PathBuf>,
    /// Under mpirun: units that are spread over ranks write their parts of checkpoints and ParaView files (.pvtp) side by side, instead of sending them to rank 0
    #[arg(long)]
    pub pieces: bool,
    /// Show neither progress nor the closing table
    #[arg(long)]
    pub quiet: bool,
}

/// `terramech check`.
#[derive(Debug, clap::Args)]
pub struct Check {
    /// The system.
    #[command(flatten)]
    pub system: System,
    /// Only read files: load no library (for FMUs nobody vouches for)
    #[arg(long)]
    pub no_units: bool,
    /// Also initialise the units and estimate the communication step up to which their coupling is stable
    #[arg(long, conflicts_with = "no_units")]
    pub stability: bool,
}

/// `terramech pack`.
#[derive(Debug, clap::Args)]
pub struct Pack {
    /// System description: a .ssd file, a .ssp archive, or the folder of an unpacked one
    pub system: PathBuf,
    /// The archive
    #[arg(long, value_name = "FILE.ssp")]
    pub out: PathBuf,
    /// A folder to search for FMUs with bare names; may be repeated
    #[arg(long, value_name = "DIR")]
    pub fmu_path: Vec<PathBuf>,
    /// Leave out our annotations (array connections, recording), for tools that refuse what they do not know
    #[arg(long)]
    pub for_other_tools: bool,
}

/// `terramech import`.
#[derive(Debug, clap::Args)]
pub struct Import {
    /// OspSystemStructure.xml, or its folder
    pub system: PathBuf,
    /// The description
    #[arg(long, value_name = "FILE.ssd")]
    pub out: PathBuf,
    /// A folder to search for FMUs with bare names; may be repeated
    #[arg(long, value_name = "DIR")]
    pub fmu_path: Vec<PathBuf>,
}

/// `terramech soil`.
#[derive(Debug, clap::Args)]
pub struct Soil {
    /// Specification of a granular terrain (JSON), as the parameter `specification` of its unit
    pub specification: PathBuf,
    /// Folder for soil.json, plots and report.html: new, empty, or of an earlier sheet, whose files are replaced
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// The terrain's FMU
    #[arg(long, value_name = "FMU", default_value = "terrain-dem-p.fmu")]
    pub fmu: PathBuf,
    /// A folder to search for the FMU; may be repeated
    #[arg(long, value_name = "DIR")]
    pub fmu_path: Vec<PathBuf>,
    /// Threads [default: the cores this process may use]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096))]
    pub threads: Option<u16>,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
}

/// `terramech inspect`.
#[derive(Debug, clap::Args)]
pub struct Inspect {
    /// A system description (.ssd, .ssp, folder) or an FMU (.fmu, folder)
    pub path: PathBuf,
    /// A folder to search for FMUs with bare names; may be repeated
    #[arg(long, value_name = "DIR")]
    pub fmu_path: Vec<PathBuf>,
    /// As JSON
    #[arg(long)]
    pub json: bool,
    /// As a Mermaid graph
    #[arg(long, conflicts_with = "json")]
    pub mermaid: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    /// In optimised builds clap does not look at what refers to what.
    #[test]
    fn every_command_is_consistent() {
        for command in Args::command().get_subcommands() {
            let ids: Vec<_> = command.get_arguments().map(|a| a.get_id().to_string()).collect();
            for argument in command.get_arguments() {
                for other in command.get_arg_conflicts_with(argument) {
                    assert!(ids.contains(&other.get_id().to_string()), "{} of {}", other.get_id(), command.get_name());
                }
            }
        }
        let parse = |words: &[&str]| Args::try_parse_from(std::iter::once("terramech").chain(words.iter().copied()));
        assert!(parse(&["run", "--resume", "out"]).is_ok());
        assert!(parse(&["run", "--out", "out"]).is_err());
        for command in ["check", "pack", "inspect"] {
            assert!(parse(&[command]).is_err(), "{command}");
        }
        assert!(parse(&["check", "a.ssd"]).is_ok());
    }
}
