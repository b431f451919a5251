//! Reading files that nobody vouches for: a device or a pipe would be read for ever, so only regular files are, and no more of them than is allowed.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::fault::{Fault, FaultKind, of_file};

/// Opens a regular file (links are followed); gives its length (bytes) too.
///
/// # Errors
/// What the system says; [`io::ErrorKind::InvalidInput`] where it is no regular file.
pub fn open(path: &Path) -> io::Result<(File, u64)> {
    // Asked before it is opened: opening a pipe waits for a writer.
    let found = std::fs::metadata(path)?;
    if !found.is_file() {
        let what = if found.is_dir() { "a folder" } else { "a device or a pipe" };
        return Err(io::Error::new(io::ErrorKind::InvalidInput, format!("it is {what}, no file")));
    }
    Ok((File::open(path)?, found.len()))
}

/// The content of a regular file of at most `most` bytes; `name` is what messages call it.
///
/// # Errors
/// [`FaultKind::Unreadable`], [`FaultKind::TooMuch`].
pub fn read(path: &Path, name: &Path, most: u64) -> Result<Vec<u8>, Fault> {
    let unreadable = |e: io::Error| of_file(name, FaultKind::Unreadable { reason: e.to_string() });
    let too_much = |given| of_file(name, FaultKind::TooMuch { what: "bytes", given, allowed: most });
    let (file, length) = open(path).map_err(unreadable)?;
    if length > most {
        return Err(too_much(length));
    }
    let mut bytes = Vec::with_capacity(length as usize + 1);
    // It may grow while it is read.
    file.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > most { Err(too_much(bytes.len() as u64)) } else { Ok(bytes) }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn devices_folders_and_long_files_are_refused() {
        let read = |path: &Path, most| read(path, path, most).map_err(|fault| fault.to_string());
        assert!(read(Path::new("/dev/zero"), 10).unwrap_err().contains("device"));
        let folder = tempfile::tempdir().unwrap();
        assert!(read(folder.path(), 10).unwrap_err().contains("folder"));
        let file = folder.path().join("x");
        std::fs::write(&file, "0123456789").unwrap();
        assert_eq!(read(&file, 10).unwrap(), b"0123456789");
        assert!(read(&file, 9).unwrap_err().contains('9'));
    }
}
