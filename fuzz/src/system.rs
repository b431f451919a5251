//! A system: `.ssd`, then after a zero byte each, if there are, the `.ssv` and `.ssm` files that it may name. It is checked with units beside it,
//! and what passes can be written again and shown.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use terramech::check::{self, Options};
use terramech::description::{self, Audience};
use terramech::fault::Faults;
use terramech::inspect;

/// Names of the documents, in order.
const NAMES: [&str; 3] = ["SystemStructure.ssd", "values.ssv", "names.ssm"];

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

/// Checks it.
pub fn read(bytes: &[u8]) {
    let folder = folder();
    let mut documents = bytes.splitn(NAMES.len(), |byte| *byte == 0);
    for name in NAMES {
        let path = folder.join(name);
        match documents.next() {
            Some(document) => fs::write(path, document).expect("a file"),
            None => drop(fs::remove_file(path)),
        }
    }
    let options = Options { need_library: false, ..Options::default() };
    let mut faults = Faults::new();
    if let Some(description) = description::read(folder, &mut faults) {
        drop(description::write(&description, Audience::Terramech));
        drop(description::write(&description, Audience::OtherTools));
    }
    match check::plan(folder, &options) {
        Ok(plan) => drop((inspect::plan_json(&plan), inspect::plan_tables(&plan), inspect::mermaid(&plan))),
        Err(faults) => assert!(!faults.to_string().is_empty()),
    }
}
