//! The fuzz targets on their corpus, and on what they found: read or refused, without a panic.

#[path = "../../fuzz/src/archive.rs"]
mod archive;
#[path = "../../fuzz/src/checkpoint.rs"]
mod checkpoint;
#[path = "../../fuzz/src/documents.rs"]
mod documents;
#[path = "../../fuzz/src/import.rs"]
mod import;
#[path = "../../fuzz/src/model_description.rs"]
mod model_description;
#[path = "../../fuzz/src/system.rs"]
mod system;

use std::fs;
use std::path::Path;

fn every(target: &str, read: impl Fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus").join(target);
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let bytes = fs::read(entry.unwrap().path()).unwrap();
        read(&bytes);
        // And what a cut in the middle makes of it.
        read(&bytes[..bytes.len() / 2]);
        count += 1;
    }
    assert!(count > 1, "{target}");
}

#[test]
fn model_descriptions() {
    every("model_description", model_description::read);
}

#[test]
fn systems() {
    every("system", system::read);
}

#[test]
fn archives() {
    every("archive", archive::read);
}

#[test]
fn checkpoints() {
    every("checkpoint", checkpoint::read);
}

#[test]
fn systems_of_osp() {
    every("import", |bytes| {
        import::read(bytes);
    });
    let whole = fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus/import/groups")).unwrap();
    assert!(import::read(&whole), "the corpus starts from a system that is taken over");
}
