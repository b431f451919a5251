//! Whether a file is a whole shared library for this machine, told from its headers before anything is mapped.
//!
//! The dynamic linker maps a library without comparing its headers with the file's length: a cut file ends the whole process by
//! SIGBUS as soon as a page behind its end is touched. So the tables and segments of an ELF file are compared with the
//! file first (System V ABI, "Object Files" and "Program Loading"; 64-bit, little-endian). Other formats are left to the system.

use std::path::Path;

/// `Ok` if the file can be handed to the dynamic linker.
///
/// # Errors
/// What is wrong, in words.
pub fn whole(path: &Path) -> Result<(), String> {
    if !cfg!(target_os = "linux") {
        return Ok(());
    }
    let cannot = |e: std::io::Error| format!("it cannot be read: {e}");
    let (mut from, length) = crate::files::open(path).map_err(cannot)?;
    let mut file = Vec::with_capacity(length as usize);
    std::io::Read::read_to_end(&mut from, &mut file).map_err(cannot)?;
    elf(&file)
}

/// This machine's `e_machine` and its name.
const MACHINE: (u64, &str) = if cfg!(target_arch = "aarch64") { (183, "AArch64") } else { (62, "x86-64") };
const LOAD: u64 = 1;
const DYNAMIC: u64 = 2;
/// Tags of the dynamic section whose values are addresses inside the library: hash tables, strings, symbols, relocations,
/// initialisers, versions.
const ADDRESSES: [u64; 13] = [4, 5, 6, 7, 12, 13, 23, 25, 26, 0x6fff_fef5, 0x6fff_fff0, 0x6fff_fffc, 0x6fff_fffe];

struct Segment {
    kind: u64,
    offset: u64,
    address: u64,
    in_file: u64,
    in_memory: u64,
}

fn number(file: &[u8], at: u64, width: usize) -> Option<u64> {
    let at = usize::try_from(at).ok()?;
    let bytes = file.get(at..at.checked_add(width)?)?;
    Some(bytes.iter().rev().fold(0, |n, &byte| n << 8 | u64::from(byte)))
}

fn elf(file: &[u8]) -> Result<(), String> {
    let cut = |what: &str| format!("{what} lies outside the file of {} bytes: it is cut short or damaged", file.len());
    if file.len() < 64 || file[..4] != *b"\x7fELF" {
        return Err(format!("it is no ELF shared library ({} bytes)", file.len()));
    }
    if (file[4], file[5]) != (2, 1) {
        let bits = if file[4] == 1 { "32-bit" } else { "not 64-bit little-endian" };
        return Err(format!("it is a {bits} library; this machine needs a 64-bit {} one", MACHINE.1));
    }
    let field = |at: u64, width: usize| number(file, at, width).unwrap_or(0);
    let machine = field(18, 2);
    if machine != MACHINE.0 {
        return Err(format!(
            "it is built for machine type {machine}; this machine needs {} ({})",
            MACHINE.0, MACHINE.1
        ));
    }
    if field(16, 2) != 3 {
        return Err(format!("its ELF type is {}, not 3 (a shared library)", field(16, 2)));
    }
    let (programs, sections) = (field(32, 8), field(40, 8));
    let (width, count) = (field(54, 2), field(56, 2));
    let inside = |from: u64, length: u64| from.checked_add(length).is_some_and(|end| end <= file.len() as u64);
    if width != 56 || count == 0 || !inside(programs, width * count) {
        return Err(cut("its table of program headers"));
    }
    if sections != 0 && !inside(sections, field(58, 2) * field(60, 2)) {
        return Err(cut("its table of section headers"));
    }
    let segments: Vec<Segment> = (0..count)
        .map(|i| {
            let at = |offset: u64| field(programs + i * width + offset, 8);
            let kind = field(programs + i * width, 4);
            Segment { kind, offset: at(8), address: at(16), in_file: at(32), in_memory: at(40) }
        })
        .collect();
    let loaded: Vec<&Segment> = segments.iter().filter(|s| s.kind == LOAD).collect();
    for s in segments.iter().filter(|s| s.kind == LOAD || s.kind == DYNAMIC) {
        if !inside(s.offset, s.in_file) || s.in_file > s.in_memory || s.address.checked_add(s.in_memory).is_none() {
            return Err(cut("a segment"));
        }
    }
    // What is mapped must be reachable, ascending, and not absurdly far apart: the linker reserves the whole span.
    let span = loaded.last().map_or(0, |s| s.address + s.in_memory);
    if loaded.is_empty() || loaded.windows(2).any(|w| w[1].address < w[0].address + w[0].in_memory) || span > 1 << 40 {
        return Err("its segments make no sense: it is damaged".into());
    }
    if loaded.iter().any(|s| s.offset % 4096 != s.address % 4096) {
        return Err("its segments are not aligned: it is damaged".into());
    }
    let mapped = |address: u64| loaded.iter().any(|s| address >= s.address && address <= s.address + s.in_memory);
    let Some(dynamic) = segments.iter().find(|s| s.kind == DYNAMIC) else {
        return Err("it has no dynamic segment: it is damaged or no shared library".into());
    };
    for entry in 0..dynamic.in_file / 16 {
        let at = dynamic.offset + 16 * entry;
        let (tag, value) = (field(at, 8), field(at + 8, 8));
        if tag == 0 {
            return Ok(());
        }
        if ADDRESSES.contains(&tag) && !mapped(value) {
            return Err(format!("entry {tag:#x} of its dynamic segment points nowhere: it is damaged"));
        }
    }
    Err("its dynamic segment has no end: it is damaged".into())
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    /// Any shared library of this machine: the C library that this test runs with.
    fn library() -> Vec<u8> {
        let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
        let path = maps.lines().filter_map(|l| l.split_whitespace().nth(5)).find(|p| p.contains("libc.so")).unwrap();
        std::fs::read(path).unwrap()
    }

    #[test]
    fn a_whole_library_passes_and_every_cut_of_it_is_told() {
        let bytes = library();
        elf(&bytes).unwrap();
        for part in [0, 10, 63, 64, 1000, bytes.len() / 4, bytes.len() / 2, bytes.len() - 1] {
            let reason = elf(&bytes[..part]).unwrap_err();
            assert!(reason.contains("bytes"), "{part}: {reason}");
        }
    }

    #[test]
    fn another_machine_is_told() {
        let mut bytes = library();
        bytes[18] = 40;
        assert!(elf(&bytes).unwrap_err().contains("machine type 40"));
        bytes[4] = 1;
        assert!(elf(&bytes).unwrap_err().contains("32-bit"));
    }

    #[test]
    fn no_flipped_byte_of_the_headers_makes_it_panic() {
        let bytes = library();
        for at in 0..64 + 56 * 16 {
            for flip in [0x01, 0x80, 0xff] {
                let mut bad = bytes.clone();
                bad[at] ^= flip;
                let _ = elf(&bad);
            }
        }
    }
}
