//! An archive: unpacked or refused within limits, and what it unpacks to is opened as an FMU. Where the first byte is odd, the rest is a shared library
//! instead, judged by its headers and never loaded.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use terramech::archive::{self, Limits};
use terramech::fault::Faults;
use terramech::{check, loading};

fn folder() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    FOLDER.get_or_init(|| tempfile::tempdir().expect("a temporary folder")).path()
}

/// Small, so that a run does many.
const LIMITS: Limits = Limits { entries: 64, total: 4 << 20, entry: 2 << 20, ratio: 500, depth: 24, path: 1024 };

/// Opens it.
pub fn read(bytes: &[u8]) {
    let Some((kind, bytes)) = bytes.split_first() else { return };
    let file = folder().join(if kind % 2 == 0 { "x.fmu" } else { "x.so" });
    fs::write(&file, bytes).expect("a file");
    if kind % 2 != 0 {
        if let Err(reason) = loading::whole(&file) {
            assert!(!reason.is_empty());
        }
        return;
    }
    match archive::open_within(&file, LIMITS) {
        Ok(unpacked) => drop(check::open_fmu(unpacked.folder(), false, &mut Faults::new())),
        Err(fault) => assert!(fault.to_string().contains("x.fmu")),
    }
}
