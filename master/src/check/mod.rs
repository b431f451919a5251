//! From a description and the models of its FMUs to a validated [`plan::Plan`], or every fault at once.
//!
//! [`plan()`] reads and opens everything and joins it. Each part of the check has its file: `library` opens FMUs, `values`
//! turns parameters into settings, `connections` and `arrays` resolve connections, `bonds` what power passes through them, `steps` times, `recording` what is
//! written, [`order`] the exchange in initialisation mode.

mod algorithm;
mod arrays;
mod bonds;
mod connections;
mod drive;
mod library;
pub mod order;
pub mod plan;
mod recording;
mod steps;
mod system;
mod values;

use std::path::{Path, PathBuf};

pub use algorithm::cannot_be_saved;
pub use library::open_fmu;

use crate::description::{self, Description};
use crate::fault::{Faults, Place};
use plan::{Component, InputFile, Plan};
use system::System;

/// What the command line adds to a description.
#[derive(Clone, Debug)]
pub struct Options {
    /// Folders searched for FMUs with bare names.
    pub fmu_path: Vec<PathBuf>,
    /// Stop time in s, as decimal text, instead of the description's.
    pub stop_time: Option<String>,
    /// `unit.variable=value`, each variable once and none that a connection feeds; wins over every parameter binding.
    pub set: Vec<String>,
    /// Parameter sets (`.ssv`) whose names are `unit.variable`; later ones win, and all over the description.
    pub params: Vec<PathBuf>,
    /// `component=FMU`: other FMUs than the description's.
    pub swap: Vec<String>,
    /// Inputs over time: a CSV file with a header like that of `results.csv`.
    pub inputs: Option<PathBuf>,
    /// Conditions that end the run.
    pub stop_when: Vec<String>,
    /// Coupling algorithm instead of the description's.
    pub algorithm: Option<String>,
    /// Whether each FMU must hold a library for this machine. Only looking at a system does not need one.
    pub need_library: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            fmu_path: Vec::new(),
            stop_time: None,
            set: Vec::new(),
            params: Vec::new(),
            swap: Vec::new(),
            inputs: None,
            stop_when: Vec::new(),
            algorithm: None,
            need_library: true,
        }
    }
}

/// Reads a description (`.ssd`, `.ssp`, or the folder of an unpacked one), opens its FMUs and checks all of it.
///
/// # Errors
/// Every fault found, with file, line, element, what was given and what is allowed.
pub fn plan(path: &Path, options: &Options) -> Result<Plan, Faults> {
    let mut faults = Faults::new();
    let Some(mut description) = description::read(path, &mut faults) else { return Err(faults) };
    let own: Vec<(String, String)> =
        description.components.iter().map(|c| (c.name.clone(), c.source.clone())).collect();
    for text in &options.swap {
        description.swap(text, &mut faults);
    }
    for file in &options.params {
        description.apply_parameters(file, &mut faults);
    }
    build(&description, path, options, faults).map_err(|mut faults| {
        let swapped = own.iter().zip(&description.components).filter(|((_, source), c)| *source != c.source);
        for ((name, source), c) in swapped {
            blame_swap(name, source, &c.source, &mut faults);
        }
        faults
    })
}

/// An FMU with other connectors makes many faults, none of which says why.
fn blame_swap(name: &str, before: &str, now: &str, faults: &mut Faults) {
    let names = [format!("\"{name}.",), format!("\"{name}\"")];
    let concerns = |text: &str| names.iter().any(|n| text.contains(n.as_str()));
    let count = faults.faults().iter().filter(|f| concerns(&f.to_string())).count();
    if count > 0 {
        let all = faults.len();
        let file = Path::new(now).file_name().unwrap_or_default().to_string_lossy();
        faults.lead_with(format!(
            "--swap {name}={file}: {count} of the {all} faults below concern component \"{name}\", which is this FMU instead of {before}; \
             a swap needs an FMU with the same connectors and parameters"
        ));
    }
}

/// The plan of a system of one FMU, to try it by itself: from t = 0 one step of 1 s.
///
/// # Errors
/// As [`plan()`].
pub fn plan_of_fmu(path: &Path, options: &Options) -> Result<Plan, Faults> {
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let component = description::Component {
        name: name.clone(),
        source: whole.to_string_lossy().into_owned(),
        place: Place::file(path),
        ..Default::default()
    };
    let one = crate::decimal::Decimal::parse("1").ok();
    let description = Description {
        name,
        place: Place::file(path),
        components: vec![component],
        stop: one,
        base_step: one,
        ..Default::default()
    };
    build(&description, path, options, Faults::new())
}

/// [`plan()`] for a description that is read already; `faults` holds what reading it found.
///
/// # Errors
/// As [`plan()`].
pub fn build(description: &Description, path: &Path, options: &Options, mut faults: Faults) -> Result<Plan, Faults> {
    let faults_ref = &mut faults;
    let system: System<'_> = library::open(description, options, faults_ref);
    let mut files = Vec::new();
    connections::check_connectors(&system, faults_ref);
    let (settings, overrides) = values::settings(&system, &options.set, &mut files, faults_ref);
    let mut connections = connections::resolve(&system, faults_ref);
    values::refuse_connected(&system, &overrides, &connections, faults_ref);
    let drives = drive::drives(&system, options.inputs.as_deref(), &connections, faults_ref);
    let stop_when = drive::conditions(&system, &options.stop_when, faults_ref);
    files.extend(options.inputs.clone());
    let arrays = arrays::resolve(&system, faults_ref);
    connections::extrapolate(&system, &mut connections, faults_ref);
    let times = steps::times(&system, options.stop_time.as_deref(), faults_ref);
    let bonds = bonds::bonds(&system, &connections, &arrays, faults_ref);
    let recording = recording::recording(&system, &connections, times.as_ref(), faults_ref);
    let summary = recording::summary(&system, times.as_ref(), options.stop_time.is_some(), faults_ref);

    let multiples = times.as_ref().map(|t| t.multiples.clone()).unwrap_or_default();
    let components: Vec<Component> = description
        .components
        .iter()
        .zip(settings)
        .enumerate()
        .filter_map(|(index, (c, settings))| {
            Some(Component {
                name: c.name.clone(),
                fmu: system.fmu_of[index]?,
                settings,
                multiple: multiples.get(index).copied().unwrap_or(1),
                threads: c.extras.threads,
                ranks: c.extras.ranks,
                place: c.place.clone(),
            })
        })
        .collect();
    let mut initialisation = Vec::new();
    if components.len() == description.components.len() {
        let place = &description.place;
        initialisation = order::stages(&system.fmus, &components, &connections, &arrays, place, faults_ref);
    }
    let algorithm = algorithm::algorithm(
        &system,
        options.algorithm.as_deref(),
        times.as_ref(),
        &bonds,
        &connections,
        &initialisation,
        faults_ref,
    );
    let inputs = inputs(description, &system, files, faults_ref);
    let notes = faults.take_notes();
    let Some(times) = times else { return Err(faults) };
    faults.check(Plan {
        name: description.name.clone(),
        file: path.to_path_buf(),
        fmus: system.fmus,
        components,
        connections,
        arrays,
        initialisation,
        clock: times.clock,
        recording,
        algorithm,
        bonds,
        summary,
        drives,
        stop_when,
        inputs,
        notes,
        folder: description.folder.clone(),
        archive: description.archive.clone(),
    })
}

/// Hashes of all files that went in.
fn inputs(description: &Description, system: &System<'_>, more: Vec<PathBuf>, faults: &mut Faults) -> Vec<InputFile> {
    let mut inputs = Vec::new();
    for path in description.files.iter().chain(&more) {
        match crate::archive::sha256_of_file(path) {
            Ok(sha256) => inputs.push(InputFile { path: path.clone(), sha256 }),
            Err(e) => {
                let kind = crate::fault::FaultKind::Unreadable { reason: e.to_string() };
                faults.add(&Place::file(path), "", kind);
            }
        }
    }
    let archives = system.fmus.iter().filter_map(|fmu| Some((fmu.path.clone(), fmu.sha256.clone()?)));
    inputs.extend(archives.map(|(path, sha256)| InputFile { path, sha256 }));
    inputs
}

#[cfg(test)]
mod tests;
