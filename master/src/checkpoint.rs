//! Checkpoints: the whole coupled system as one file.
//!
//! Layout of `checkpoint/STEP.tmc`: 8 bytes magic with the version, 8 bytes length of the header (little-endian), the header (JSON, reals as
//! their bits), the states of the units one after the other, 32 bytes SHA-256 over all before. A file is written aside, brought to disk and
//! renamed, and the ones before it are kept, so that there is always a whole one.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use terramech_results::RunFolder;

use crate::check::plan::Plan;
use crate::coupling::{CouplingState, Failure, UnitState};
use crate::record::Saved;

const MAGIC: &[u8; 8] = b"TMCHECK2";
/// Subfolder of a run's folder.
const FOLDER: &str = "checkpoint";
/// Bytes a header may have.
const MOST_HEADER: u64 = 1 << 30;

/// How a run was started, to be started again the same way.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct How {
    /// The description, absolute.
    pub system: PathBuf,
    /// `--stop-time`.
    pub stop_time: Option<String>,
    /// `--set`.
    pub set: Vec<String>,
    /// `--fmu-path`, absolute.
    pub fmu_path: Vec<PathBuf>,
    /// `--algorithm`.
    pub algorithm: Option<String>,
    /// `--params`, absolute.
    #[serde(default)]
    pub params: Vec<PathBuf>,
    /// `--swap`.
    #[serde(default)]
    pub swap: Vec<String>,
    /// `--inputs`, absolute.
    #[serde(default)]
    pub inputs: Option<PathBuf>,
    /// `--stop-when`.
    #[serde(default)]
    pub stop_when: Vec<String>,
    /// `--pieces`.
    #[serde(default)]
    pub pieces: bool,
    /// `--checkpoint-every`.
    pub every: Option<String>,
    /// `--keep-checkpoints`.
    pub keep: usize,
}

/// What stands before the states of the units.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Version of the program that wrote it.
    pub program: String,
    /// Instruction path of the units.
    pub isa: String,
    /// How the run was started.
    pub how: How,
    /// What the run was made of; see [`fingerprint`].
    pub fingerprint: Vec<(String, String)>,
    /// Base step.
    pub tick: u64,
    /// Simulated time in s, for people.
    pub time: f64,
    /// Wall time of the run so far (s).
    pub wall_seconds: f64,
    /// Name, GUID and number of bytes of each unit.
    pub(crate) units: Vec<(String, String, u64)>,
    /// What the coupling remembers.
    pub coupling: CouplingState,
    /// What the algorithm remembers, as bits.
    pub algorithm: Vec<u64>,
    /// Where the recording stands.
    pub recording: Saved,
    /// Files beside this one that hold parts of states, and their bytes.
    #[serde(default)]
    pub pieces: Vec<(String, u64)>,
}

/// A checkpoint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// All but the states of the units.
    pub header: Header,
    /// The states of the units, in the order of the plan.
    pub units: Vec<UnitState>,
}

/// What must be the same for a run to be resumed: name and hash of each input file, the step, the coupling.
pub fn fingerprint(plan: &Plan) -> Vec<(String, String)> {
    let mut parts: Vec<(String, String)> =
        // By name only: the run may be resumed from another folder.
        plan.inputs
            .iter()
            .map(|i| (i.path.file_name().unwrap_or_default().to_string_lossy().into_owned(), i.sha256.clone()))
            .collect();
    parts.push(("base step".into(), plan.clock.step.to_string()));
    parts.push(("start time".into(), plan.clock.start.to_string()));
    parts.push(("algorithm".into(), plan.algorithm.scheme.name().into()));
    for (index, c) in plan.components.iter().enumerate() {
        let settings: Vec<String> = c
            .settings
            .iter()
            .map(|s| (&plan.model(index).variables[s.variable].name, &s.value))
            // A path is told by the hash of its file.
            .filter(|(name, _)| &***name != "specification")
            .map(|(name, value)| format!("{name}={value}"))
            .collect();
        parts.push((format!("unit {}", c.name), format!("{} {}", plan.model(index).guid, settings.join(" "))));
    }
    parts
}

impl Checkpoint {
    /// The file's content.
    ///
    /// # Errors
    /// A header that cannot be written as JSON.
    pub fn encode(&self) -> Result<Vec<u8>, Failure> {
        let mut header = self.header.clone();
        header.units = self.units.iter().map(|u| (u.name.clone(), u.guid.clone(), u.bytes.len() as u64)).collect();
        let json = serde_json::to_vec(&header).map_err(|e| Failure::Environment(format!("checkpoint: {e}")))?;
        let size = json.len() + self.units.iter().map(|u| u.bytes.len()).sum::<usize>() + 48;
        let mut bytes = Vec::with_capacity(size);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&(json.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&json);
        self.units.iter().for_each(|u| bytes.extend_from_slice(&u.bytes));
        let hash = Sha256::digest(&bytes);
        bytes.extend_from_slice(&hash);
        Ok(bytes)
    }

    /// Reads a file's content; nothing of it is used unless all of it is whole.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn decode(bytes: &[u8]) -> Result<Self, String> {
        if bytes.len() < 48 {
            return Err(format!("{} bytes are too few: it was cut short", bytes.len()));
        }
        if bytes[..7] != MAGIC[..7] {
            return Err("it is no checkpoint (wrong magic number)".into());
        }
        if bytes[7] != MAGIC[7] {
            let (there, here) = (char::from(bytes[7]).escape_default(), char::from(MAGIC[7]));
            return Err(format!("its format is of version {there}, this program writes version {here}"));
        }
        let (body, hash) = bytes.split_at(bytes.len() - 32);
        if Sha256::digest(body)[..] != *hash {
            return Err("its checksum does not match: cut short or damaged".into());
        }
        let mut length = [0; 8];
        length.copy_from_slice(&body[8..16]);
        let length = u64::from_le_bytes(length);
        let rest = &body[16..];
        if length > MOST_HEADER || length > rest.len() as u64 {
            return Err(format!("its header is said to have {length} bytes"));
        }
        let (json, mut states) = rest.split_at(length as usize);
        let header: Header = serde_json::from_slice(json).map_err(|e| format!("its header cannot be read: {e}"))?;
        let mut units = Vec::with_capacity(header.units.len().min(states.len() + 1));
        for (name, guid, size) in &header.units {
            let size = usize::try_from(*size).ok().filter(|n| *n <= states.len());
            let size = size.ok_or_else(|| format!("the state of unit {name} is not whole"))?;
            let (state, more) = states.split_at(size);
            states = more;
            units.push(UnitState { name: name.clone(), guid: guid.clone(), bytes: state.to_vec() });
        }
        if !states.is_empty() {
            return Err(format!("{} bytes belong to no unit", states.len()));
        }
        Ok(Self { header, units })
    }

    /// Writes it into a run's folder and removes all but the last `keep`.
    ///
    /// # Errors
    /// [`Failure::Results`]; the checkpoints before it are untouched then.
    pub fn write(&mut self, folder: &RunFolder, keep: usize) -> Result<(), Failure> {
        self.header.pieces.clear();
        for (name, bytes) in pieces(folder.path(), |tick| tick == self.header.tick) {
            folder.adopt(&format!("{FOLDER}/{name}"))?;
            self.header.pieces.push((name, bytes));
        }
        folder.write_durably(&format!("{FOLDER}/{:012}.tmc", self.header.tick), &self.encode()?)?;
        let files = list(folder.path());
        for (_, path) in files.iter().rev().skip(keep.max(1)) {
            if let Some(name) = path.file_name() {
                folder.remove(&format!("{FOLDER}/{}", name.to_string_lossy()))?;
            }
        }
        // Pieces of those, and of one that was never finished.
        let kept: Vec<u64> = files.iter().rev().take(keep.max(1)).map(|f| f.0).collect();
        for (name, _) in pieces(folder.path(), |tick| !kept.contains(&tick)) {
            folder.adopt(&format!("{FOLDER}/{name}"))?;
            folder.remove(&format!("{FOLDER}/{name}"))?;
        }
        Ok(())
    }

    /// What is wrong with the files beside it.
    fn check_pieces(&self, folder: &Path) -> Result<(), String> {
        for (name, bytes) in &self.header.pieces {
            let path = folder.join(FOLDER).join(name);
            match std::fs::metadata(&path) {
                Ok(found) if found.len() == *bytes => {}
                Ok(found) => return Err(format!("{} has {} bytes of {bytes}", path.display(), found.len())),
                Err(e) => return Err(format!("{}: {e}", path.display())),
            }
        }
        Ok(())
    }

    /// The fault of resuming with a plan that is another than the checkpoint's.
    ///
    /// # Errors
    /// [`Failure::Input`] that names what differs.
    pub fn fits(&self, plan: &Plan) -> Result<(), Failure> {
        let now = fingerprint(plan);
        let then = &self.header.fingerprint;
        let differs = then.iter().find(|part| !now.contains(part)).or_else(|| now.iter().find(|p| !then.contains(p)));
        match differs {
            None => Ok(()),
            Some((what, _)) => Err(Failure::Input(format!(
                "this run cannot be resumed: {what} is not what it was when the checkpoint was written; allowed: the same files and settings"
            ))),
        }
    }
}

/// Checkpoints of a run's folder, oldest first: base step and file.
fn list(folder: &Path) -> Vec<(u64, PathBuf)> {
    let entries = std::fs::read_dir(folder.join(FOLDER)).into_iter().flatten().flatten();
    let mut files: Vec<(u64, PathBuf)> = entries
        .filter_map(|e| {
            let path = e.path();
            let tick = path.file_name()?.to_str()?.strip_suffix(".tmc")?.parse().ok()?;
            Some((tick, path))
        })
        .collect();
    files.sort();
    files
}

/// Files `STEP.UNIT.MEMBER` of checkpoints at some base steps, with their bytes, in order.
fn pieces(folder: &Path, of: impl Fn(u64) -> bool) -> Vec<(String, u64)> {
    let entries = std::fs::read_dir(folder.join(FOLDER)).into_iter().flatten().flatten();
    let mut files: Vec<(String, u64)> = entries
        .filter_map(|e| {
            let name = e.file_name().into_string().ok()?;
            let mut parts = name.split('.');
            let mut number = || parts.next()?.parse::<u64>().ok();
            let (tick, _unit, _member) = (number()?, number()?, number()?);
            // One that was never finished has one more.
            let is_piece = parts.next().is_none_or(|p| p == "part");
            (is_piece && of(tick)).then_some(())?;
            Some((name, e.metadata().ok()?.len()))
        })
        .collect();
    files.sort();
    files
}

/// The newest checkpoint that is whole, and what is wrong with newer ones.
///
/// # Errors
/// [`Failure::Input`] where there is none.
pub fn newest(folder: &Path) -> Result<(Checkpoint, Vec<String>), Failure> {
    let mut remarks = Vec::new();
    for (_, path) in list(folder).into_iter().rev() {
        let read = crate::files::read(&path, &path, u64::MAX).map_err(|fault| fault.to_string());
        let whole = read
            .and_then(|bytes| Checkpoint::decode(&bytes))
            .and_then(|checkpoint| checkpoint.check_pieces(folder).map(|()| checkpoint));
        match whole {
            Ok(checkpoint) => return Ok((checkpoint, remarks)),
            Err(e) => remarks.push(format!("{}: {e}; the checkpoint before it is used", path.display())),
        }
    }
    let found = if remarks.is_empty() { "it holds no checkpoint".to_owned() } else { remarks.join("; ") };
    Err(Failure::Input(format!(
        "{}: nothing to resume: {found}; write checkpoints with `terramech run --checkpoint-every S`",
        folder.display()
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checkpoint() -> Checkpoint {
        let unit = |name: &str, bytes: &[u8]| UnitState { name: name.into(), guid: "g".into(), bytes: bytes.to_vec() };
        let header = Header { tick: 7, fingerprint: vec![("a".into(), "b".into())], ..Header::default() };
        Checkpoint { header, units: vec![unit("a", b"state of a"), unit("b", b""), unit("c", &[0; 100])] }
    }

    #[test]
    fn what_was_written_is_read() {
        let bytes = checkpoint().encode().unwrap();
        let read = Checkpoint::decode(&bytes).unwrap();
        assert_eq!(read.units, checkpoint().units);
        assert_eq!((read.header.tick, read.header.fingerprint.len()), (7, 1));
    }

    #[test]
    fn every_cut_and_every_flipped_byte_is_told() {
        let bytes = checkpoint().encode().unwrap();
        for n in 0..bytes.len() {
            assert!(Checkpoint::decode(&bytes[..n]).is_err(), "cut to {n}");
            let mut bad = bytes.clone();
            bad[n] ^= 0x10;
            assert!(Checkpoint::decode(&bad).is_err(), "byte {n}");
        }
    }

    #[test]
    fn a_damaged_newest_one_gives_way_to_the_one_before() {
        let home = tempfile::tempdir().unwrap();
        let folder = RunFolder::create(home.path().join("r")).unwrap();
        for tick in [10, 20, 30] {
            let mut c = checkpoint();
            c.header.tick = tick;
            c.write(&folder, 2).unwrap();
        }
        let files = list(folder.path());
        assert_eq!(files.iter().map(|(t, _)| *t).collect::<Vec<_>>(), [20, 30]);
        let mut bytes = std::fs::read(&files[1].1).unwrap();
        bytes[60] ^= 1;
        std::fs::write(&files[1].1, bytes).unwrap();
        let (c, remarks) = newest(folder.path()).unwrap();
        assert_eq!(c.header.tick, 20);
        assert!(remarks[0].contains("000000000030.tmc") && remarks[0].contains("checksum"), "{remarks:?}");
        std::fs::write(&files[0].1, "").unwrap();
        assert!(newest(folder.path()).unwrap_err().to_string().contains("nothing to resume"));
    }
}
