//! The folder of one run: who may write there, and how files come into being whole.

use crate::error::{Error, Result};
use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Name of the list of a run's files, which also marks the folder as ours and is locked while a run writes.
const LEDGER: &str = ".terramech-run";
const LEDGER_HEAD: &str = "terramech run folder 1: the files listed below are replaced by the next run\n";

/// The folder a run writes into.
///
/// Protocol: [`open`](RunFolder::open) (which changes nothing that an earlier run left), then, when there is something to write,
/// [`begin`](RunFolder::begin) (which deletes the files of an earlier run) or [`go_on`](RunFolder::go_on) (which keeps them, to be
/// appended to); then any number of writes from any thread. [`create`](RunFolder::create) is the first two in one. The lock on the
/// folder lasts as long as the value. A folder that was made by `open` and never begun is removed again.
///
/// Every file is entered in a list (`.terramech-run`) before it is written; the next run deletes what is listed and
/// nothing else, so files that a user put beside them stay. Whole files are written aside (`.NAME.part`) and renamed;
/// streams ([`stream`](RunFolder::stream)) grow in place.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    ledger: Mutex<Ledger>,
}

#[derive(Debug)]
struct Ledger {
    file: File,
    names: BTreeSet<String>,
    /// What an earlier run left, until this one begins.
    earlier: Option<String>,
    /// Whether the list, and whether the folder, were made by `open`.
    made: (bool, bool),
    begun: bool,
}

impl Drop for Ledger {
    /// Gives the lock back by name. Closing the file is not enough: a child that another thread is just starting holds a copy of it until
    /// it runs its own program, and the next run in this folder would find it in use.
    fn drop(&mut self) {
        let _ = self.file.unlock();
    }
}

impl RunFolder {
    /// Creates the folder (and its parents), or takes over one that is empty or holds an earlier run, whose files go.
    ///
    /// # Errors
    /// [`Error::FolderNotOurs`] for a non-empty folder without an earlier run, [`Error::NotAFolder`],
    /// [`Error::FolderInUse`] while another process writes there, [`Error::Io`].
    pub fn create(path: impl AsRef<Path>) -> Result<RunFolder> {
        let folder = Self::open(path)?;
        folder.begin()?;
        Ok(folder)
    }

    /// Creates the folder (and its parents), or takes over one that is empty or holds an earlier run, whose files stay for now.
    ///
    /// # Errors
    /// As [`create`](RunFolder::create).
    pub fn open(path: impl AsRef<Path>) -> Result<RunFolder> {
        let path = path.as_ref().to_owned();
        if path.exists() && !path.is_dir() {
            return Err(Error::NotAFolder { path });
        }
        let made_folder = !path.exists();
        fs::create_dir_all(&path).map_err(Error::io("create", &path))?;
        let ledger_path = path.join(LEDGER);
        let ours = fs::symlink_metadata(&ledger_path).is_ok_and(|m| m.is_file());
        if !ours {
            let mut entries = fs::read_dir(&path).map_err(Error::io("list", &path))?;
            if let Some(entry) = entries.next() {
                let example = entry.map(|e| e.file_name().to_string_lossy().into_owned()).unwrap_or_default();
                return Err(Error::FolderNotOurs { path, example });
            }
        }
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&ledger_path)
            .map_err(Error::io("open", &ledger_path))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(Error::FolderInUse { path }),
            // A file system without locks: the folder works, unguarded against a second run.
            Ok(()) | Err(TryLockError::Error(_)) => {}
        }
        let mut text = String::new();
        file.read_to_string(&mut text).map_err(Error::io("read", &ledger_path))?;
        let earlier = if text.is_empty() {
            file.write_all(LEDGER_HEAD.as_bytes()).map_err(Error::io("write", &ledger_path))?;
            None
        } else {
            let Some(list) = text.strip_prefix(LEDGER_HEAD) else {
                return Err(Error::FolderNotOurs { path, example: LEDGER.into() });
            };
            Some(list.to_owned())
        };
        let made = (!ours, made_folder);
        let ledger = Ledger { file, names: BTreeSet::new(), earlier, made, begun: false };
        Ok(RunFolder { path, ledger: Mutex::new(ledger) })
    }

    /// Deletes what an earlier run left; from now on this run writes.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn begin(&self) -> Result<()> {
        let mut ledger = self.ledger.lock().unwrap_or_else(PoisonError::into_inner);
        ledger.begun = true;
        if let Some(list) = ledger.earlier.take() {
            let path = self.path.join(LEDGER);
            remove_earlier(&self.path, &list)?;
            // The head stays where it is: a crash here must not leave a folder that nobody recognises.
            ledger.file.set_len(LEDGER_HEAD.len() as u64).map_err(Error::io("write", &path))?;
            ledger.file.seek(SeekFrom::End(0)).map_err(Error::io("write", &path))?;
        }
        Ok(())
    }

    /// Whether this run writes already.
    pub fn has_begun(&self) -> bool {
        self.ledger.lock().unwrap_or_else(PoisonError::into_inner).begun
    }

    /// Keeps what an earlier run left and goes on writing it.
    pub fn go_on(&self) {
        let mut ledger = self.ledger.lock().unwrap_or_else(PoisonError::into_inner);
        ledger.begun = true;
        if let Some(list) = ledger.earlier.take() {
            ledger.names.extend(list.lines().filter(|n| is_plain(n)).map(str::to_owned));
        }
    }

    /// [`write`](RunFolder::write), and on the disk before it gets its name: for what must survive a power failure.
    ///
    /// # Errors
    /// As `write`.
    pub fn write_durably(&self, name: &str, content: &[u8]) -> Result<()> {
        let path = self.claim(name)?;
        let part = part_of(&path);
        let write = || -> io::Result<()> {
            let mut out = File::create(&part)?;
            out.write_all(content)?;
            out.sync_all()?;
            fs::rename(&part, &path)
        };
        write().map_err(|source| {
            let _ = fs::remove_file(&part);
            Error::Io { action: "write", path, source }
        })
    }

    /// Removes a file of the run, if it is there.
    ///
    /// # Errors
    /// [`Error::BadName`], [`Error::ForeignFile`], [`Error::Io`].
    pub fn remove(&self, name: &str) -> Result<()> {
        let path = self.claim(name)?;
        match fs::remove_file(&path) {
            Err(source) if source.kind() != io::ErrorKind::NotFound => {
                Err(Error::Io { action: "remove", path, source })
            }
            _ => Ok(()),
        }
    }

    /// Opens a file of an earlier run to append to it, cut to its first `length` bytes.
    ///
    /// # Errors
    /// [`Error::BadName`], [`Error::Io`], also where the file is shorter than that.
    pub fn append(&self, name: &str, length: u64) -> Result<(File, PathBuf)> {
        let path = self.claim(name)?;
        let open = || -> io::Result<File> {
            let mut file = OpenOptions::new().write(true).open(&path)?;
            let there = file.metadata()?.len();
            if there < length {
                let text = format!("it has {there} bytes, {length} are expected");
                return Err(io::Error::new(io::ErrorKind::UnexpectedEof, text));
            }
            file.set_len(length)?;
            file.seek(SeekFrom::End(0))?;
            Ok(file)
        };
        let file = open().map_err(Error::io("append to", &path))?;
        Ok((file, path))
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The full path of a file of the run.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Writes a whole file aside and puts it in place in one step, replacing an earlier version of it.
    ///
    /// `name` is relative to the folder, with `/`; missing subfolders are made.
    ///
    /// # Errors
    /// [`Error::BadName`], [`Error::ForeignFile`], [`Error::Io`]; on failure the earlier version is untouched.
    pub fn write_with(&self, name: &str, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        let path = self.claim(name)?;
        let part = part_of(&path);
        let write = || -> io::Result<()> {
            let mut out = BufWriter::new(File::create(&part)?);
            fill(&mut out)?;
            out.into_inner()?;
            fs::rename(&part, &path)
        };
        write().map_err(|source| {
            // What is half-written goes; a second failure here would only hide the first.
            let _ = fs::remove_file(&part);
            Error::Io { action: "write", path, source }
        })
    }

    /// [`write_with`](RunFolder::write_with) for bytes at hand.
    ///
    /// # Errors
    /// As `write_with`.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<()> {
        self.write_with(name, |out| out.write_all(content))
    }

    /// Writes `value` as indented JSON, aside and renamed.
    ///
    /// # Errors
    /// [`Error::Json`] and those of [`write_with`](RunFolder::write_with).
    pub fn write_json<T: serde::Serialize>(&self, name: &str, value: &T) -> Result<()> {
        let mut text =
            serde_json::to_vec_pretty(value).map_err(|source| Error::Json { path: self.file(name), source })?;
        text.push(b'\n');
        self.write(name, &text)
    }

    /// Opens a file that grows during the run (CSV, log), empty at first.
    ///
    /// # Errors
    /// [`Error::BadName`], [`Error::ForeignFile`], [`Error::Io`].
    pub fn stream(&self, name: &str) -> Result<(File, PathBuf)> {
        let path = self.claim(name)?;
        let file = File::create(&path).map_err(Error::io("create", &path))?;
        Ok((file, path))
    }

    /// Enters a file in the list of the run's files that somebody else has written for it.
    ///
    /// # Errors
    /// [`Error::BadName`], [`Error::Io`].
    pub fn adopt(&self, name: &str) -> Result<()> {
        if !is_plain(name) {
            return Err(Error::BadName { given: name.to_owned() });
        }
        let mut ledger = self.ledger.lock().unwrap_or_else(PoisonError::into_inner);
        if ledger.names.insert(name.to_owned()) {
            ledger
                .file
                .write_all(format!("{name}\n").as_bytes())
                .map_err(Error::io("write", &self.path.join(LEDGER)))?;
        }
        Ok(())
    }

    /// Enters `name` in the list of the run's files and makes its folder.
    fn claim(&self, name: &str) -> Result<PathBuf> {
        if !is_plain(name) {
            return Err(Error::BadName { given: name.to_owned() });
        }
        let path = self.path.join(name);
        let mut ledger = self.ledger.lock().unwrap_or_else(PoisonError::into_inner);
        if ledger.names.contains(name) {
            return Ok(path);
        }
        if fs::symlink_metadata(&path).is_ok() {
            return Err(Error::ForeignFile { path });
        }
        ledger.file.write_all(format!("{name}\n").as_bytes()).map_err(Error::io("write", &self.path.join(LEDGER)))?;
        ledger.names.insert(name.to_owned());
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(Error::io("create", parent))?;
        }
        Ok(path)
    }
}

impl Drop for RunFolder {
    fn drop(&mut self) {
        let ledger = self.ledger.get_mut().unwrap_or_else(PoisonError::into_inner);
        if !ledger.begun && ledger.made.0 {
            // Nothing was written: leave no trace. A folder that is no longer empty stays.
            let _ = fs::remove_file(self.path.join(LEDGER));
            if ledger.made.1 {
                let _ = fs::remove_dir(&self.path);
            }
        }
    }
}

fn is_plain(name: &str) -> bool {
    !name.is_empty()
        && name != LEDGER
        && !name.contains(['\n', '\r', '\\'])
        && Path::new(name).components().all(|c| matches!(c, Component::Normal(_)))
}

fn part_of(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.part"))
}

/// Deletes the listed files of an earlier run, and the subfolders that this leaves empty.
///
/// A name that climbs out of the folder, or that passes through a symbolic link, is left alone: a list that somebody
/// edited must not delete what is elsewhere.
fn remove_earlier(folder: &Path, list: &str) -> Result<()> {
    let mut parents = BTreeSet::new();
    for name in list.lines().filter(|n| is_plain(n)) {
        let path = folder.join(name);
        let inside = path
            .ancestors()
            .skip(1)
            .take_while(|a| *a != folder)
            .all(|a| fs::symlink_metadata(a).is_ok_and(|m| m.is_dir()));
        if !inside {
            continue;
        }
        for file in [part_of(&path), path.clone()] {
            match fs::remove_file(&file) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(Error::Io { action: "replace", path: file, source });
                }
                _ => {}
            }
        }
        parents.extend(path.ancestors().skip(1).take_while(|a| *a != folder).map(Path::to_owned));
    }
    for parent in parents.iter().rev() {
        // Fails on purpose for a folder that still holds somebody's files.
        let _ = fs::remove_dir(parent);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_given_back_is_free_although_a_starting_child_holds_a_copy_of_its_lock() {
        let dir = tempfile::tempdir().unwrap();
        let folder = RunFolder::create(dir.path()).unwrap();
        let copy = folder.ledger.lock().unwrap().file.try_clone().unwrap();
        drop(folder);
        RunFolder::create(dir.path()).unwrap();
        drop(copy);
    }
}
