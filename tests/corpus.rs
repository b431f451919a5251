//! The fuzz target of specifications on its corpus, and on what it found: read or refused, without a panic.

#[path = "../fuzz/src/specification.rs"]
mod specification;

use std::path::Path;

#[test]
fn specifications() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/specification");
    for entry in std::fs::read_dir(folder).unwrap() {
        let bytes = std::fs::read(entry.unwrap().path()).unwrap();
        specification::read(&bytes);
        specification::read(&bytes[..bytes.len() / 2]);
    }
}
