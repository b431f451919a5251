//! Finding and opening the FMUs of a description; each file once, however many components use it.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Options;
use super::plan::Fmu;
use super::system::System;
use crate::archive::{self, Unpacked};
use crate::description::uri::{Roots, find};
use crate::description::{ConnectorType, Description};
use crate::fault::{Fault, FaultKind, Faults, Place, of_file};
use crate::model_description::{self, ModelDescription};

/// Opens all FMUs.
pub fn open<'d>(description: &'d Description, options: &Options, faults: &mut Faults) -> System<'d> {
    let roots = Roots {
        base: &description.folder,
        archive: description.archive.as_deref().map(Unpacked::folder),
        search: &options.fmu_path,
    };
    let mut fmus: Vec<Fmu> = Vec::new();
    let mut opened: HashMap<PathBuf, Option<usize>> = HashMap::new();
    let mut fmu_of = Vec::with_capacity(description.components.len());
    let mut users: Vec<Vec<usize>> = Vec::new();
    for (component, c) in description.components.iter().enumerate() {
        let path = match find(&c.source, roots) {
            Ok(path) => path,
            Err(searched) => {
                let kind = FaultKind::NotFound { what: "FMU", source_uri: c.source.clone(), searched };
                faults.add(&c.place, format!("Component \"{}\"", c.name), kind);
                fmu_of.push(None);
                continue;
            }
        };
        let key = path.canonicalize().unwrap_or_else(|_| path.clone());
        let index = *opened.entry(key).or_insert_with(|| {
            let mut own = Faults::new();
            let fmu = open_fmu(&path, options.need_library, &mut own);
            faults.take_over(own, &format!("Component \"{}\" ({})", c.name, c.place));
            let fmu = fmu?;
            fmus.push(fmu);
            users.push(Vec::new());
            Some(fmus.len() - 1)
        });
        if let Some(index) = index {
            users[index].push(component);
        }
        fmu_of.push(index);
    }
    for (fmu, users) in fmus.iter().zip(&users) {
        let side = &fmu.model.co_simulation;
        if side.can_be_instantiated_only_once_per_process && users.len() > 1 {
            let second = &description.components[users[1]];
            let names: Vec<_> = users.iter().map(|&u| description.components[u].name.as_str()).collect();
            let kind = FaultKind::Unsupported {
                what: format!("more than one instance of {} in one process ({})", fmu.path.display(), names.join(", ")),
                instead: "the FMU says canBeInstantiatedOnlyOncePerProcess: use a copy of it per instance, or one instance",
            };
            faults.add(&second.place, format!("Component \"{}\"", second.name), kind);
        }
        if side.needs_execution_tool {
            let text = "the FMU needs the tool that made it (needsExecutionTool) installed on this machine";
            faults.note(&Place::file(&fmu.path), "", text);
        }
    }
    let by_name = description.components.iter().enumerate().map(|(i, c)| (c.name.as_str(), i)).collect();
    let mut connector_units = HashMap::new();
    for (component, c) in description.components.iter().enumerate() {
        for connector in &c.connectors {
            if let Some(ConnectorType::Real(Some(unit))) = &connector.value_type {
                connector_units.insert((component, connector.name.as_str()), unit.as_str());
            }
        }
    }
    System { description, fmus, fmu_of, by_name, connector_units }
}

/// Opens one FMU: archive or folder, model description, library for this machine.
pub fn open_fmu(path: &Path, need_library: bool, faults: &mut Faults) -> Option<Fmu> {
    let unpacked = match archive::open(path) {
        Ok(unpacked) => unpacked,
        Err(fault) => {
            faults.push(fault);
            return None;
        }
    };
    let name = unpacked.shown("modelDescription.xml");
    let model = read_model(&unpacked.folder().join("modelDescription.xml"), &name, faults)?;
    let broken = |library: PathBuf| match need_library.then(|| crate::loading::whole(&library)) {
        Some(Err(reason)) => {
            let library = library.strip_prefix(unpacked.folder()).unwrap_or(&library).display().to_string();
            Err(FaultKind::BadLibrary { library, reason })
        }
        _ => Ok(library),
    };
    let library = match library_of(unpacked.folder(), &model.co_simulation.model_identifier).and_then(broken) {
        Ok(library) => Some(library),
        Err(kind) if need_library => {
            faults.push(of_file(&crate::fault::shown(path), kind));
            return None;
        }
        Err(_) => None,
    };
    Some(Fmu {
        path: path.to_path_buf(),
        sha256: unpacked.sha256().map(str::to_owned),
        library,
        model: Arc::new(model),
        unpacked: Arc::new(unpacked),
    })
}

fn read_model(file: &Path, name: &Path, faults: &mut Faults) -> Option<ModelDescription> {
    let limit = crate::xml::Limits::default().bytes;
    let read = || -> Result<Vec<u8>, Fault> {
        if !file.exists() {
            return Err(of_file(name.parent().unwrap_or(name), FaultKind::NoModelDescription));
        }
        crate::files::read(file, name, limit)
    };
    match read() {
        Ok(bytes) => model_description::read(&bytes, name, faults),
        Err(fault) => {
            faults.push(fault);
            None
        }
    }
}

/// Name of this machine's folder under `binaries`, and the ending of its libraries.
const fn platform() -> (&'static str, &'static str) {
    if cfg!(target_os = "windows") {
        (if cfg!(target_pointer_width = "64") { "win64" } else { "win32" }, "dll")
    } else if cfg!(target_os = "macos") {
        ("darwin64", "dylib")
    } else {
        (if cfg!(target_pointer_width = "64") { "linux64" } else { "linux32" }, "so")
    }
}

fn library_of(folder: &Path, identifier: &str) -> Result<PathBuf, FaultKind> {
    let (platform, ending) = platform();
    let inside = format!("binaries/{platform}/{identifier}.{ending}");
    let library = folder.join(&inside);
    if library.is_file() {
        return Ok(library);
    }
    let mut given: Vec<String> = fs::read_dir(folder.join("binaries"))
        .map(|list| list.filter_map(|e| Some(e.ok()?.file_name().to_string_lossy().into_owned())).collect())
        .unwrap_or_default();
    given.sort();
    let given = if given.is_empty() { "no binaries at all".to_owned() } else { given.join(", ") };
    Err(FaultKind::WrongPlatform { needed: inside, given })
}
