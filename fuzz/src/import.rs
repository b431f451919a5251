//! A system of the Open Simulation Platform: `OspSystemStructure.xml`, then after a zero byte each, if there are, the descriptions of variable groups
//! of its units. What is taken over can be written, and is read again without a fault of form.

use std::fs;

use crate::documents;
use terramech::description::{self, Audience};
use terramech::fault::Faults;
use terramech::osp;

/// Names of the documents, in order.
const NAMES: [&str; 3] = ["OspSystemStructure.xml", "rig_OspModelDescription.xml", "tire_OspModelDescription.xml"];

/// Imports it. Gives whether it was taken over.
pub fn read(bytes: &[u8]) -> bool {
    let folder = documents::lay(bytes, &NAMES);
    let folder = folder.path();
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
