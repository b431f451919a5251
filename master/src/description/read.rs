//! Opening a description: an `.ssd` file, an `.ssp` archive, or the folder of an unpacked one.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Description;
use super::annotations::{of_type, time};
use super::flatten::flatten;
use super::parameters::{Context, read_document, units};
use super::raw::{self, OSP};
use super::uri::Roots;
use crate::archive::{self, Unpacked};
use crate::fault::{FaultKind, Faults, shown};
use crate::xml::Element;

/// The name that SSP gives the description inside an archive.
const INSIDE: &str = "SystemStructure.ssd";

/// Reads a description. Faults and notes go into `faults`; with faults, what could be read is returned all the same, so
/// that a check can go on and tell more, and `None` only where there is nothing to go on with.
pub fn read(path: &Path, faults: &mut Faults) -> Option<Description> {
    if crate::inspect::is_fmu(path) {
        let kind = FaultKind::Unsupported {
            what: "running an FMU by itself".into(),
            instead: "this is an FMU, no system description: couple it in a .ssd file, or look at it with `terramech inspect` and \
                      `terramech check`",
        };
        faults.push(crate::fault::of_file(&shown(path), kind));
        return None;
    }
    let is_archive = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ssp"));
    let mut archive: Option<Arc<Unpacked>> = None;
    let (file, name): (PathBuf, PathBuf) = if path.is_dir() {
        (path.join(INSIDE), shown(path).join(INSIDE))
    } else if is_archive {
        match archive::open(path) {
            Ok(unpacked) => {
                let place = (unpacked.folder().join(INSIDE), unpacked.shown(INSIDE));
                archive = Some(Arc::new(unpacked));
                place
            }
            Err(fault) => {
                faults.push(fault);
                return None;
            }
        }
    } else {
        (path.to_path_buf(), shown(path))
    };
    if (path.is_dir() || archive.is_some()) && !file.exists() {
        let folder = file.parent().unwrap_or(path);
        faults
            .push(crate::fault::of_file(&shown(path), FaultKind::NoDescription { held: held(folder, path.is_dir()) }));
        return None;
    }
    let document = match read_document(&file, &name) {
        Ok(document) => document,
        Err(fault) => {
            faults.push(fault);
            return None;
        }
    };
    let root = match document.root_named("SystemStructureDescription") {
        Ok(root) => root,
        Err(fault) => {
            faults.push(fault);
            return None;
        }
    };
    let version = root.required("version", faults).unwrap_or("1.0");
    if !(version.starts_with("1.") || version.starts_with("2.")) {
        let kind = FaultKind::WrongVersion {
            given: version.to_owned(),
            allowed: "SSP 1.x (2.x is read as far as it is alike)",
        };
        faults.add(&root.place(), root.label(), kind);
        return None;
    }
    let folder = file.parent().unwrap_or(Path::new("")).to_path_buf();
    let inside = archive.as_deref().map(Unpacked::folder);
    let mut description = Description {
        name: root.required("name", faults).unwrap_or_default().to_owned(),
        place: document.place().clone(),
        enumerations: raw::enumerations(root, faults),
        ..Description::default()
    };
    let known = units(root, faults);
    description.units = known.values().cloned().collect();
    description.units.sort_by(|a, b| a.name.cmp(&b.name));
    experiment(root, &mut description, faults);
    let Some(system) = root.child("System") else {
        faults.add(&root.place(), root.label(), FaultKind::MissingElement { name: "System" });
        return None;
    };
    if let Some(e) = document.elements().find(|e| e.name().ends_with("Geometry")) {
        faults.note(&e.place(), e.label(), "geometry and everything else that only draws is left out");
    }
    let roots = Roots { base: &folder, archive: inside, search: &[] };
    let mut context = Context { roots, units: known, files: vec![] };
    let system = raw::system(system, &mut context, faults);
    description.files = match &archive {
        Some(_) => vec![path.to_path_buf()],
        None => std::iter::once(file.clone()).chain(context.files).collect(),
    };
    flatten(&system, &mut description, faults);
    description.folder = folder;
    description.archive = archive;
    Some(description)
}

/// What a folder without a description holds, and what to give instead.
fn held(folder: &Path, by_name: bool) -> String {
    const SHOWN: usize = 6;
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.retain(|name| !name.starts_with('.'));
    names.sort();
    let ending = |name: &String, ending: &str| name.to_ascii_lowercase().ends_with(ending);
    let descriptions: Vec<&String> = names.iter().filter(|n| ending(n, ".ssd") || ending(n, ".ssp")).collect();
    if let (true, Some(first)) = (by_name, descriptions.first()) {
        let all = descriptions.iter().map(|n| n.as_str()).collect::<Vec<_>>().join(", ");
        return format!("{all}: give the file itself, {}", folder.join(first).display());
    }
    if by_name && names.iter().any(|n| n == "OspSystemStructure.xml") {
        return "OspSystemStructure.xml: make a description of it with `terramech import`".into();
    }
    match names.len() {
        0 => "nothing".into(),
        n if n > SHOWN => format!("{} and {} more", names[..SHOWN].join(", "), n - SHOWN),
        _ => names.join(", "),
    }
}

fn experiment(root: Element<'_>, description: &mut Description, faults: &mut Faults) {
    let Some(e) = root.child("DefaultExperiment") else { return };
    let before = faults.len();
    description.start = time(e, "startTime", false, faults);
    description.stop = time(e, "stopTime", false, faults);
    let algorithm = of_type(e.child("Annotations"), OSP).filter(|a| a.name() == "Algorithm");
    if let Some(fixed) = algorithm.and_then(|a| a.child("FixedStepAlgorithm"))
        && fixed.required("baseStepSize", faults).is_some()
    {
        description.base_step = time(fixed, "baseStepSize", true, faults);
    }
    description.times_are_bad = faults.len() > before;
}
