//! Damaged and hostile files, made by changing good ones at random (with a fixed seed): every one is read or refused, none makes the
//! program panic or run away.

#[path = "support/changed.rs"]
mod changed;

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use changed::{Random, changed};
use terramech::check::{self, Options};
use terramech::fault::Faults;
use terramech::{archive, model_description};

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

#[test]
fn changed_model_descriptions_are_read_or_refused() {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for name in ["rig", "tire", "terrain"] {
        let good = fs::read(data().join(name).join("modelDescription.xml")).unwrap();
        for _ in 0..1500 {
            let mut faults = Faults::new();
            let bad = changed(&good, &mut random);
            let read = model_description::read(&bad, Path::new("m.xml"), &mut faults);
            assert!(read.is_some() || !faults.is_empty());
            // The message itself must be printable.
            assert!(faults.to_string().len() < 1 << 20);
        }
    }
}

#[test]
fn changed_descriptions_are_checked_or_refused() {
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    let folder = tempfile::tempdir().unwrap();
    for name in ["rig.json", "rig/modelDescription.xml", "tire/modelDescription.xml", "terrain/modelDescription.xml"] {
        let target = folder.path().join(name);
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::copy(data().join(name), target).unwrap();
    }
    let good = fs::read(data().join("system.ssd")).unwrap();
    let file = folder.path().join("system.ssd");
    let options = Options { need_library: false, ..Options::default() };
    for _ in 0..1000 {
        fs::write(&file, changed(&good, &mut random)).unwrap();
        match check::plan(&file, &options) {
            Ok(plan) => assert!(plan.clock.steps > 0),
            Err(faults) => assert!(!faults.is_empty() && !faults.to_string().is_empty()),
        }
    }
}

#[test]
fn changed_archives_are_unpacked_or_refused() {
    let mut random = Random(0xd1b5_4a32_d192_ed03);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("x.fmu");
    let mut zip = zip::ZipWriter::new(fs::File::create(&file).unwrap());
    let packed = zip::write::SimpleFileOptions::default();
    for (name, size) in [("modelDescription.xml", 900), ("resources/a.json", 50), ("binaries/linux64/x.so", 3000)] {
        zip.start_file(name, packed).unwrap();
        zip.write_all(&(0..size).map(|i| (i * i % 251) as u8).collect::<Vec<_>>()).unwrap();
    }
    zip.finish().unwrap();
    let good = fs::read(&file).unwrap();
    for _ in 0..1500 {
        fs::write(&file, changed(&good, &mut random)).unwrap();
        if let Err(fault) = archive::open(&file) {
            assert!(fault.to_string().contains("x.fmu"));
        }
    }
}
