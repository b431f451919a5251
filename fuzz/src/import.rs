//! A system of the Open Simulation Platform: `OspSystemStructure.xml`, then after a zero byte each, if there are, the descriptions of variable groups
//! of its units. What is taken over can be written, and is read again without a fault of form.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use terramech::description::{self, Audience};
use terramech::fault::Faults;
use terramech::osp;

/// Names of the documents, in order.
const NAMES: [&str; 3] = ["OspSystemStructure.xml", "rig_OspModelDescription.xml", "tire_OspModelDescription.xml"];

/// The FMUs.
const UNITS: [(&str, &str); 3] = [
    ("rig", include_str!("../../master/tests/data/rig/modelDescription.xml")),
    ("tire", include_str!("../../master/tests/data/tire/modelDescription.xml")),
    ("terrain", include_str!("../../master/tests/data/terrain/modelDescription.xml")),
];

/// The folder of the system, with unpacked FMUs in it.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    FOLDER
        .get_or_init(|| {
            let folder = tempfile::tempdir().expect("a temporary folder");
            for (name, text) in UNITS {
                let unit = folder.path().join(name);
                fs::create_dir_all(&unit).expect("a folder");
                fs::write(unit.join("modelDescription.xml"), text).expect("a file");
            }
            folder
        })
        .path()
}

/// Imports it. Gives whether it was taken over.
pub fn read(bytes: &[u8]) -> bool {
    let folder = folder();
    let mut documents = bytes.splitn(NAMES.len(), |byte| *byte == 0);
    for name in NAMES {
        let path = folder.join(name);
        match documents.next() {
            Some(document) => fs::write(path, document).expect("a file"),
            None => drop(fs::remove_file(path)),
        }
    }
    let (imported, _) = match osp::read(folder, &[], folder) {
        Ok(imported) => imported,
        Err(faults) => {
            assert!(!faults.to_string().is_empty());
            return false;
        }
    };
    let out = folder.join("SystemStructure.ssd");
    fs::write(&out, description::write(&imported, Audience::Terramech)).expect("a file");
    let mut faults = Faults::new();
    assert!(description::read(folder, &mut faults).is_some(), "what was written is not read: {faults}");
    fs::remove_file(out).expect("the file just written");
    true
}
