//! Temporary folders that do not outlive their process, however it ends.
//!
//! A folder holds a lock file that the living process keeps locked. A process that is killed leaves its folder; the next one
//! that needs a folder finds the lock free and removes it. Where the process is about to exit on the spot, [`remove_all`] does it.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, Once, PoisonError};

/// Prefix of the folders.
const PREFIX: &str = "terramech-";
/// The file that is locked while the owner lives.
const LOCK: &str = ".terramech-lock";

/// Folders of this process.
static LIVING: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A temporary folder; removed when this is dropped.
#[derive(Debug)]
pub struct Temporary {
    path: PathBuf,
    _lock: Option<File>,
}

impl Temporary {
    /// A new folder in the system's place for such; the first one of a process also removes what dead ones left.
    pub fn new() -> io::Result<Self> {
        static SWEPT: Once = Once::new();
        let home = std::env::temp_dir();
        SWEPT.call_once(|| sweep(&home));
        let path = tempfile::Builder::new().prefix(PREFIX).tempdir_in(&home)?.keep();
        LIVING.lock().unwrap_or_else(PoisonError::into_inner).push(path.clone());
        Ok(Self { _lock: hold(&path), path })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.path);
        LIVING.lock().unwrap_or_else(PoisonError::into_inner).retain(|p| *p != self.path);
    }
}

/// Removes this process's folders; for an exit that runs no destructors.
pub fn remove_all() {
    for path in LIVING.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
        let _ = fs::remove_dir_all(path);
    }
}

/// The locked lock file. It gets its name when it is locked already, so that no other process finds it free.
/// `None` on a file system without locks: the folder works, unmarked.
fn hold(folder: &Path) -> Option<File> {
    let aside = folder.join(".terramech-lock.new");
    let file = File::create_new(&aside).ok()?;
    if file.try_lock().is_err() {
        let _ = fs::remove_file(aside);
        return None;
    }
    fs::rename(aside, folder.join(LOCK)).ok()?;
    Some(file)
}

/// Removes the folders in `home` whose owner is gone. What is not ours or not marked is left alone.
fn sweep(home: &Path) {
    let Ok(entries) = fs::read_dir(home) else { return };
    for entry in entries.flatten() {
        let ours = entry.file_name().to_string_lossy().starts_with(PREFIX);
        if !ours || !entry.file_type().is_ok_and(|t| t.is_dir()) {
            continue;
        }
        let folder = entry.path();
        let lock = folder.join(LOCK);
        if !fs::symlink_metadata(&lock).is_ok_and(|m| m.is_file()) {
            continue;
        }
        let Ok(file) = OpenOptions::new().read(true).write(true).open(&lock) else { continue };
        if file.try_lock().is_ok() {
            let _ = fs::remove_dir_all(&folder);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_dead_processes_go_and_living_ones_stay() {
        let home = tempfile::tempdir().unwrap();
        let folder = |name: &str| {
            let path = home.path().join(name);
            fs::create_dir(&path).unwrap();
            path
        };
        let (dead, living, foreign) = (folder("terramech-a"), folder("terramech-b"), folder("terramech-c"));
        drop(hold(&dead).unwrap());
        let _held = hold(&living).unwrap();
        fs::write(foreign.join("x"), "").unwrap();
        sweep(home.path());
        assert!(!dead.exists() && living.exists() && foreign.exists());
    }

    #[test]
    fn a_folder_goes_with_its_owner() {
        let temporary = Temporary::new().unwrap();
        let path = temporary.path().to_owned();
        assert!(path.join(LOCK).exists());
        drop(temporary);
        assert!(!path.exists());
    }
}
