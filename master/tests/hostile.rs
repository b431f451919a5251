//! Damaged and hostile files, made by changing good ones at random (with a fixed seed): every one is read or refused, none makes the
//! program panic or run away.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use terramech::check::{self, Options};
use terramech::fault::Faults;
use terramech::{archive, model_description};

/// Marsaglia's xorshift: the same changes on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self, below: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % below.max(1) as u64) as usize
    }
}

/// Text that upsets readers.
const NASTY: [&[u8]; 16] = [
    b"<",
    b">",
    b"\"",
    b"&#0;",
    b"&lt",
    b"]]>",
    b"<!DOCTYPE x [<!ENTITY a \"b\">]>",
    b"\xff\xfe",
    b"NaN",
    b"-1",
    b"1e999",
    b"99999999999999999999",
    b"..",
    b"\0",
    b"<a><a><a><a><a><a>",
    b"xmlns=",
];

/// A few changes: flipped bits, cuts, pieces doubled or moved, nasty text.
fn changed(good: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..=random.next(4) {
        let at = random.next(bytes.len());
        let length = random.next(60).min(bytes.len() - at);
        match random.next(6) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << random.next(8),
            1 => bytes.truncate(at),
            2 => drop(bytes.drain(at..at + length)),
            3 => {
                let piece = bytes[at..at + length].to_vec();
                let to = random.next(bytes.len());
                bytes.splice(to..to, piece);
            }
            4 => {
                let nasty = NASTY[random.next(NASTY.len())];
                bytes.splice(at..at, nasty.iter().copied());
            }
            // A number in quotes to another.
            _ => {
                if let Some(quote) = bytes[at..].iter().position(|b| *b == b'"').map(|n| at + n + 1) {
                    let nasty = NASTY[8 + random.next(4)];
                    let end = bytes[quote..].iter().position(|b| *b == b'"').map_or(quote, |n| quote + n);
                    bytes.splice(quote..end, nasty.iter().copied());
                }
            }
        }
    }
    bytes
}

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
