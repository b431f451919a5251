//! `terramech pack`: a description with all that it names as one `.ssp` archive.
//!
//! The description is written flat (nested systems and parameter files are resolved while reading), FMUs and specifications go into
//! `resources/`. For other tools our annotations are left out; what is lost with them is told.

use std::collections::HashMap;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::check::{self, Options};
use crate::description::{self, Audience, Description, Given};
use crate::fault::{FaultKind, Faults, Place};

/// Name of the String parameter that holds a specification.
const SPECIFICATION: &str = "specification";

/// Files of the archive: where they are, by their name inside.
#[derive(Default)]
struct Resources {
    by_path: HashMap<PathBuf, String>,
    files: Vec<(String, PathBuf)>,
}

impl Resources {
    /// The name inside of a file; two files of one name are told apart by a number.
    fn add(&mut self, path: &Path) -> String {
        if let Some(name) = self.by_path.get(path) {
            return name.clone();
        }
        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let free = |name: &String| self.files.iter().all(|(taken, _)| taken != name);
        let name = (1..)
            .map(|n| if n == 1 { format!("resources/{file}") } else { format!("resources/{n}-{file}") })
            .find(free)
            .unwrap_or_default();
        self.by_path.insert(path.to_owned(), name.clone());
        self.files.push((name.clone(), path.to_owned()));
        name
    }
}

/// Packs the system at `path` into the archive `out`. Gives remarks on what is not in it.
///
/// # Errors
/// Every fault of the system, an FMU that is a folder, an archive that cannot be written.
pub fn pack(path: &Path, options: &Options, out: &Path, audience: Audience) -> Result<Vec<String>, Faults> {
    let mut faults = Faults::new();
    let Some(mut description) = description::read(path, &mut faults) else { return Err(faults) };
    let plan = check::build(&description, path, &Options { need_library: false, ..options.clone() }, faults)?;
    let mut faults = Faults::new();
    let mut resources = Resources::default();
    let folder = description.folder.clone();
    for (c, planned) in description.components.iter_mut().zip(&plan.components) {
        let fmu = &plan.fmus[planned.fmu].path;
        if fmu.is_dir() {
            let (what, instead) =
                (format!("packing the unpacked FMU {}", fmu.display()), "zip it to a .fmu file first");
            faults.add(&c.place, format!("Component \"{}\"", c.name), FaultKind::Unsupported { what, instead });
            continue;
        }
        c.source = resources.add(fmu);
        for value in c.values.iter_mut().filter(|v| v.variable == SPECIFICATION) {
            if let Given::String(text) = &mut value.value
                && !text.is_empty()
                && !text.trim_start().starts_with('{')
            {
                let file = folder.join(&*text);
                if file.is_file() {
                    *text = resources.add(&file);
                }
            }
        }
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    let text = description::write(&description, audience);
    write(out, &text, &resources.files).map_err(|e| {
        let mut faults = Faults::new();
        faults.add(&Place::file(out), "", FaultKind::Environment { reason: format!("cannot be written: {e}") });
        faults
    })?;
    Ok(remarks(&description, audience))
}

/// What other tools do not get.
fn remarks(description: &Description, audience: Audience) -> Vec<String> {
    let mut remarks = Vec::new();
    if description.components.iter().flat_map(|c| &c.values).any(|v| v.variable == SPECIFICATION) {
        remarks
            .push("files that specifications name (meshes) are not packed: put them into resources/ yourself".into());
    }
    let lost = description.extras.arrays.len();
    if audience == Audience::OtherTools && lost > 0 {
        remarks.push(format!(
            "{lost} array connections are left out: without them units meet through their scalars only (a cylinder as wheel)"
        ));
    }
    remarks
}

/// Written aside and renamed.
fn write(out: &Path, text: &str, files: &[(String, PathBuf)]) -> io::Result<()> {
    let aside = out.with_extension("ssp.part");
    let result = (|| {
        let mut zip = ZipWriter::new(fs::File::create(&aside)?);
        let packed = SimpleFileOptions::default();
        // FMUs are packed already.
        let stored = packed.compression_method(zip::CompressionMethod::Stored);
        zip.start_file("SystemStructure.ssd", packed)?;
        zip.write_all(text.as_bytes())?;
        for (name, path) in files {
            zip.start_file(name.as_str(), if name.ends_with(".fmu") { stored } else { packed })?;
            io::copy(&mut fs::File::open(path)?, &mut zip)?;
        }
        zip.finish()?;
        fs::rename(&aside, out)
    })();
    if result.is_err() {
        let _ = fs::remove_file(&aside);
    }
    result
}
