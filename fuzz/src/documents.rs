//! A folder with documents of one input, and unpacked FMUs beside them.

use std::fs;
use std::rc::Rc;

/// The FMUs.
const UNITS: [(&str, &str); 3] = [
    ("rig", include_str!("../../master/tests/data/rig/modelDescription.xml")),
    ("tire", include_str!("../../master/tests/data/tire/modelDescription.xml")),
    ("terrain", include_str!("../../master/tests/data/terrain/modelDescription.xml")),
];

thread_local! {
    /// Of each thread its own: tests of several targets run side by side.
    static FOLDER: Rc<tempfile::TempDir> = Rc::new(folder());
}

/// A folder of a system, with unpacked FMUs in it.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in UNITS {
        let unit = folder.path().join(name);
        fs::create_dir_all(&unit).expect("a folder");
        fs::write(unit.join("modelDescription.xml"), text).expect("a file");
    }
    folder
}

/// Lays the parts of `bytes` between zero bytes down under these names; what has no part is not there.
pub fn lay(bytes: &[u8], names: &[&str]) -> Rc<tempfile::TempDir> {
    let folder = FOLDER.with(Rc::clone);
    let mut documents = bytes.splitn(names.len(), |byte| *byte == 0);
    for name in names {
        let path = folder.path().join(name);
        match documents.next() {
            Some(document) => fs::write(path, document).expect("a file"),
            None => drop(fs::remove_file(path)),
        }
    }
    folder
}
