//! Unpacking: first every header is judged, then every entry is inflated with its bytes counted.

use std::fs::{self, File};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use zip::read::ZipArchive;
use zip::result::ZipError;

use super::names::{Seen, parts};
use super::temporary::Temporary;
use super::{Limits, Unpacked};
use crate::fault::{Fault, FaultKind, of_file, shown};

/// Entries up to this size may have any ratio: a megabyte of zeros harms nobody.
const FREE: u64 = 1 << 20;

/// Hash of a file, lower-case hexadecimal, read in pieces.
///
/// # Errors
/// What the system says.
pub fn sha256_of_file(path: &Path) -> io::Result<String> {
    hash(&mut crate::files::open(path)?.0)
}

fn hash(file: &mut File) -> io::Result<String> {
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; 64 << 10];
    loop {
        let n = file.read(&mut buffer)?;
        if n == 0 {
            break;
        }
        hasher.update(&buffer[..n]);
    }
    Ok(hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// An entry that passed: its index in the archive, its path, and what the header says it unpacks to.
struct Entry {
    index: usize,
    path: PathBuf,
    is_folder: bool,
    size: u64,
    executable: bool,
}

/// Unpacks an archive into a new temporary folder.
pub fn unpack(path: &Path, limits: Limits) -> Result<Unpacked, Fault> {
    let archive_name = shown(path);
    let refuse = |entry: Option<&str>, reason: String| {
        let entry = entry.map(|name| name.chars().take(200).flat_map(char::escape_debug).collect());
        of_file(&archive_name, FaultKind::Archive { entry, reason })
    };
    let unreadable = |e: io::Error| of_file(&archive_name, FaultKind::Unreadable { reason: e.to_string() });
    let machine = |e: io::Error| of_file(&archive_name, FaultKind::Environment { reason: format!("unpacking: {e}") });

    let (mut file, length) = crate::files::open(path).map_err(unreadable)?;
    let sha256 = hash(&mut file).map_err(unreadable)?;
    file.seek(SeekFrom::Start(0)).map_err(unreadable)?;
    let count = declared_entries(&mut file, length).map_err(unreadable)?;
    if count > limits.entries as u64 {
        return Err(refuse(None, format!("it has {count} entries, at most {} are unpacked", limits.entries)));
    }
    file.seek(SeekFrom::Start(0)).map_err(unreadable)?;
    let mut archive = ZipArchive::new(BufReader::new(file)).map_err(|e| match e {
        ZipError::Io(e) if e.kind() != io::ErrorKind::UnexpectedEof => unreadable(e),
        e => refuse(None, format!("it is cut, damaged or no zip archive ({e})")),
    })?;
    if archive.len() > limits.entries {
        return Err(refuse(None, format!("it has {} entries, at most {} are unpacked", archive.len(), limits.entries)));
    }
    if archive.has_duplicate_names() {
        return Err(refuse(None, "a name is there twice".into()));
    }
    let entries = judge(&mut archive, &limits, &refuse)?;
    if archive.has_overlapping_entries().map_err(|e| refuse(None, format!("it is damaged ({e})")))? {
        return Err(refuse(None, "entries share the same packed bytes".into()));
    }

    let temporary = Temporary::new().map_err(machine)?;
    let mut budget = limits.total;
    for entry in &entries {
        let target = temporary.path().join(&entry.path);
        if entry.is_folder {
            fs::create_dir_all(&target).map_err(machine)?;
            continue;
        }
        if let Some(folder) = target.parent() {
            fs::create_dir_all(folder).map_err(machine)?;
        }
        let name = entry.path.to_string_lossy().into_owned();
        let damaged = |reason: String| refuse(Some(&name), reason);
        let source = archive.by_index(entry.index).map_err(|e| damaged(format!("it is damaged ({e})")))?;
        // `create_new`: a name that the file system folds into another one must not overwrite it.
        let mut out = File::create_new(&target).map_err(|e| match e.kind() {
            io::ErrorKind::AlreadyExists => damaged("the name is there twice".into()),
            _ => machine(e),
        })?;
        // One byte more than declared tells a header that lies.
        let mut source = source.take(entry.size + 1);
        let mut buffer = [0; 64 << 10];
        let mut written = 0_u64;
        loop {
            let n = source.read(&mut buffer).map_err(|e| damaged(format!("it is cut or damaged ({e})")))?;
            if n == 0 {
                break;
            }
            written += n as u64;
            if written > entry.size {
                return Err(damaged(format!("it unpacks to more than the {} bytes it declares", entry.size)));
            }
            if n as u64 > budget {
                return Err(damaged(format!("the archive unpacks to more than {} bytes", limits.total)));
            }
            budget -= n as u64;
            out.write_all(&buffer[..n]).map_err(machine)?;
        }
        if written != entry.size {
            return Err(damaged(format!("it declares {} bytes and unpacks to {written}", entry.size)));
        }
        make_executable(&out, entry.executable).map_err(machine)?;
    }
    let folder = temporary.path().to_path_buf();
    Ok(Unpacked { source: path.to_path_buf(), folder, sha256: Some(sha256), _temporary: Some(temporary) })
}

/// Names, kinds and declared sizes of all entries.
fn judge(
    archive: &mut ZipArchive<BufReader<File>>,
    limits: &Limits,
    refuse: &dyn Fn(Option<&str>, String) -> Fault,
) -> Result<Vec<Entry>, Fault> {
    let mut seen = Seen::default();
    let mut total = 0_u64;
    let mut entries = Vec::with_capacity(archive.len());
    for index in 0..archive.len() {
        let entry = archive.by_index_raw(index).map_err(|e| refuse(None, format!("entry {index} is damaged ({e})")))?;
        let Ok(name) = std::str::from_utf8(entry.name_raw()) else {
            let lossy = String::from_utf8_lossy(entry.name_raw()).into_owned();
            return Err(refuse(Some(&lossy), "its name is not UTF-8".into()));
        };
        let fault = |reason: String| refuse(Some(name), reason);
        let parts = parts(name, limits).map_err(fault)?;
        let is_folder = name.ends_with('/');
        // The upper half of the mode is the file's kind; 0 where the packer was not a Unix one.
        match entry.unix_mode().map_or(0, |mode| mode & 0o170_000) {
            0 | 0o100_000 | 0o040_000 => {}
            0o120_000 => return Err(fault("it is a symbolic link".into())),
            _ => return Err(fault("it is neither a file nor a folder".into())),
        }
        if entry.encrypted() {
            return Err(fault("it is encrypted".into()));
        }
        seen.add(&parts, is_folder).map_err(fault)?;
        let (size, packed) = (entry.size(), entry.compressed_size());
        if size > limits.entry {
            return Err(fault(format!("it declares {size} bytes, at most {} are unpacked", limits.entry)));
        }
        if size > FREE && size / limits.ratio > packed {
            return Err(fault(format!(
                "it declares {size} bytes from {packed} packed ones (at most {} to 1)",
                limits.ratio
            )));
        }
        total = total.saturating_add(size);
        if total > limits.total {
            return Err(fault(format!("the archive declares more than {} bytes", limits.total)));
        }
        let executable = entry.unix_mode().is_some_and(|mode| mode & 0o111 != 0);
        entries.push(Entry { index, path: parts.iter().collect(), is_folder, size, executable });
    }
    Ok(entries)
}

/// The number of entries that the end record declares (the largest of all that look like one), read before the archive's
/// index is built in memory.
fn declared_entries(file: &mut File, length: u64) -> io::Result<u64> {
    let tail = length.min((64 << 10) + 22 + 20 + 56);
    file.seek(SeekFrom::Start(length - tail))?;
    let mut bytes = Vec::with_capacity(tail as usize);
    file.take(tail).read_to_end(&mut bytes)?;
    let number = |at: usize, width: usize| {
        bytes.get(at..at + width).map_or(0, |b| b.iter().rev().fold(0_u64, |n, &byte| n << 8 | u64::from(byte)))
    };
    let mut count = 0;
    for at in 0..bytes.len().saturating_sub(3) {
        match &bytes[at..at + 4] {
            b"PK\x05\x06" => count = number(at + 10, 2).max(count),
            b"PK\x06\x06" => count = number(at + 32, 8).max(count),
            _ => {}
        }
    }
    Ok(count)
}

#[cfg(unix)]
fn make_executable(file: &File, executable: bool) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    // Only for the user, and no other bit of the archive's mode: set-uid must not survive.
    file.set_permissions(fs::Permissions::from_mode(if executable { 0o700 } else { 0o600 }))
}

#[cfg(not(unix))]
fn make_executable(_file: &File, _executable: bool) -> io::Result<()> {
    Ok(())
}
