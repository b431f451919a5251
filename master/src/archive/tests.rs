//! Archives made by hand, byte by byte where a packer would refuse to lie.

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use zip::write::{SimpleFileOptions, ZipWriter};

use super::*;

struct Made {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

fn file(bytes: &[u8]) -> Made {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.fmu");
    fs::write(&path, bytes).unwrap();
    Made { _folder: folder, path }
}

/// A packed archive; `stored` entries are not deflated, so that their bytes can be found and changed.
fn packed(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let mut writer = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, content) in entries {
        writer.start_file(*name, SimpleFileOptions::default().unix_permissions(0o755)).unwrap();
        writer.write_all(content).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

/// Replaces all occurrences of a text by one of the same length.
fn replaced(mut bytes: Vec<u8>, from: &[u8], to: &[u8]) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let mut hits = 0;
    for at in 0..=bytes.len() - from.len() {
        if &bytes[at..at + from.len()] == from {
            bytes[at..at + from.len()].copy_from_slice(to);
            hits += 1;
        }
    }
    assert!(hits > 0);
    bytes
}

fn refused(bytes: &[u8], parts: &[&str]) {
    refused_within(bytes, Limits::default(), parts);
}

fn refused_within(bytes: &[u8], limits: Limits, parts: &[&str]) {
    let made = file(bytes);
    let fault = open_within(&made.path, limits).expect_err("accepted");
    let text = fault.to_string();
    assert!(text.contains("a.fmu"), "{text}");
    for part in parts {
        assert!(text.contains(part), "no \"{part}\" in: {text}");
    }
}

#[test]
fn an_honest_archive_is_unpacked_and_removed_again() {
    let bytes = packed(&[("modelDescription.xml", b"<a/>"), ("binaries/linux64/m.so", b"\x7fELF"), ("empty", b"")]);
    let made = file(&bytes);
    let unpacked = open(&made.path).unwrap();
    let folder = unpacked.folder().to_path_buf();
    assert_eq!(fs::read(folder.join("binaries/linux64/m.so")).unwrap(), b"\x7fELF");
    assert_eq!(fs::read(folder.join("empty")).unwrap(), b"");
    assert_eq!(unpacked.sha256().unwrap(), sha256_of_file(&made.path).unwrap());
    assert_eq!(unpacked.sha256().unwrap().len(), 64);
    drop(unpacked);
    assert!(!folder.exists());
    // A folder is taken as it is, and stays.
    let as_is = open(made.path.parent().unwrap()).unwrap();
    assert!(as_is.sha256().is_none());
    drop(as_is);
    assert!(made.path.exists());
}

#[test]
fn sha256_is_the_standard_one() {
    let made = file(b"abc");
    let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"; // FIPS 180-2, appendix B.1
    assert_eq!(sha256_of_file(&made.path).unwrap(), expected);
}

#[test]
fn cut_and_damaged_archives_are_refused() {
    let content: Vec<u8> = (0..40_000_u32).flat_map(|i| (i.wrapping_mul(2_654_435_761) >> 16).to_le_bytes()).collect();
    let whole = packed(&[("modelDescription.xml", &content), ("other", b"x")]);
    for length in [0, 1, 10, whole.len() / 2, whole.len() - 30, whole.len() - 1] {
        refused(&whole[..length], &["archive refused"]);
    }
    let mut flipped = whole.clone();
    flipped[20_000] ^= 0x10;
    refused(&flipped, &["modelDescription.xml", "damaged"]);
    refused(b"this is no archive at all", &["no zip archive"]);
    assert!(open(Path::new("nowhere.fmu")).unwrap_err().to_string().contains("cannot be read"));
}

#[test]
fn names_that_lead_out_or_astray_are_refused() {
    for (name, reason) in [
        ("../aaaa", ".."),
        ("a/../../b", ".."),
        ("/etc/aaa", "absolute"),
        ("C:/aaaaa", "drive"),
        ("a\\aaaaaa", "'\\\\'"),
        ("a//aaaaa", "empty part"),
        ("./aaaaaa", "\".\""),
        ("a\naaaaaa", "'\\n'"),
    ] {
        // Written under a harmless name of the same length, since packers mend such names.
        let harmless = "q".repeat(name.len());
        let bytes = replaced(packed(&[(&harmless, b"x")]), harmless.as_bytes(), name.as_bytes());
        refused(&bytes, &["archive refused", reason]);
    }
    let deep = vec!["a"; 40].join("/");
    refused(&packed(&[(&deep, b"x")]), &["40 levels, at most 24"]);
    refused(&packed(&[(&"a".repeat(2000), b"x")]), &["2000 bytes"]);
}

#[test]
fn names_that_meet_are_refused() {
    let two = packed(&[("qqqq.xml", b"1"), ("pppp.xml", b"2")]);
    refused(&replaced(two, b"pppp.xml", b"qqqq.xml"), &["there twice"]);
    refused(&packed(&[("Readme", b"1"), ("README", b"2")]), &["there twice"]);
    refused(&packed(&[("a", b"1"), ("a/b", b"2")]), &["inside another entry"]);
    refused(&packed(&[("a/b", b"1"), ("a", b"2")]), &["file and a folder"]);
}

#[test]
fn links_and_encrypted_entries_are_refused() {
    let mut writer = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    writer.add_symlink("resources", "/etc", SimpleFileOptions::default()).unwrap();
    refused(&writer.finish().unwrap().into_inner(), &["resources", "symbolic link"]);
    // Bit 0 of the general purpose flags, in the central and the local header.
    let mut bytes = packed(&[("a", b"x")]);
    for at in 0..bytes.len() - 10 {
        match &bytes[at..at + 4] {
            b"PK\x03\x04" => bytes[at + 6] |= 1,
            b"PK\x01\x02" => bytes[at + 8] |= 1,
            _ => {}
        }
    }
    refused(&bytes, &["encrypted"]);
}

#[test]
fn entries_that_lie_about_their_size_are_refused() {
    let honest = packed(&[("modelDescription.xml", &[b'x'; 5000])]);
    // The unpacked size stands at offset 24 of the central header, 22 of the local one.
    let with_size = |size: u32| {
        let mut bytes = honest.clone();
        for at in 0..bytes.len() - 28 {
            match &bytes[at..at + 4] {
                b"PK\x03\x04" => bytes[at + 22..at + 26].copy_from_slice(&size.to_le_bytes()),
                b"PK\x01\x02" => bytes[at + 24..at + 28].copy_from_slice(&size.to_le_bytes()),
                _ => {}
            }
        }
        bytes
    };
    refused(&with_size(100), &["modelDescription.xml"]);
    refused(&with_size(6000), &["modelDescription.xml"]);
    refused(&with_size(u32::MAX - 1), &["modelDescription.xml"]);
}

#[test]
fn bombs_are_refused_before_they_go_off() {
    let zeros = vec![0; 8 << 20];
    refused(&packed(&[("bomb", &zeros)]), &["bomb", "8388608 bytes from", "at most 500 to 1"]);
    let limits = Limits { total: 1000, ..Limits::default() };
    refused_within(&packed(&[("a", &[1; 600]), ("b", &[2; 600])]), limits, &["more than 1000 bytes"]);
    let limits = Limits { entry: 1000, ..Limits::default() };
    refused_within(&packed(&[("a", &[1; 1001])]), limits, &["1001 bytes, at most 1000"]);
    let limits = Limits { entries: 2, ..Limits::default() };
    refused_within(&packed(&[("a", b""), ("b", b""), ("c", b"")]), limits, &["3 entries, at most 2"]);
}

#[test]
fn any_single_changed_byte_neither_panics_nor_leaves_the_folder() {
    let whole = packed(&[("modelDescription.xml", &[b'x'; 200]), ("a/b", b"hello")]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.fmu");
    for at in 0..whole.len() {
        for bit in [0x01, 0x80] {
            let mut bytes = whole.clone();
            bytes[at] ^= bit;
            fs::write(&path, &bytes).unwrap();
            // Either refused or unpacked with all of its files inside the temporary folder.
            if let Ok(unpacked) = open(&path) {
                assert!(unpacked.folder().is_dir());
            }
        }
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[cfg(unix)]
#[test]
fn unpacked_files_are_the_users_alone() {
    use std::os::unix::fs::PermissionsExt;
    let mut writer = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    writer.start_file("tool", SimpleFileOptions::default().unix_permissions(0o4777)).unwrap();
    let made = file(&writer.finish().unwrap().into_inner());
    let unpacked = open(&made.path).unwrap();
    let mode = fs::metadata(unpacked.folder().join("tool")).unwrap().permissions().mode();
    assert_eq!(mode & 0o7777, 0o700);
}
