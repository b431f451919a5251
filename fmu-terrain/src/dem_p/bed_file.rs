//! Settled beds as files: the engine's whole state, versioned and hashed.

use crate::config::Terrain;
use crate::dem::{BedReport, DemState};
use serde::{Deserialize, Serialize};
use std::fs;
use std::io::Write;
use std::path::Path;
use terramech_fmi2::{UnitError, state};

const MAGIC: &[u8; 8] = b"TMBED__4";

/// A bed as it is kept.
#[derive(Serialize, Deserialize)]
pub struct BedFile {
    /// The specification it was made from, as JSON.
    pub specification: String,
    /// How it came out.
    pub report: BedReport,
    /// Name of the engine it was settled with.
    pub engine: String,
    /// What that engine keeps beside the grains.
    pub own: Vec<u8>,
    /// Everything else.
    pub state: DemState,
}

/// Writes a bed. The file appears whole or not at all.
///
/// # Errors
/// [`UnitError::Input`]: the path is not absolute. [`UnitError::Environment`]: it cannot be written.
pub fn write(path: &str, bed: &BedFile) -> Result<(), UnitError> {
    let path = absolute("bed_save", path)?;
    let bytes = state::seal(MAGIC, &state::to_bytes(bed)?);
    let fault =
        |e: std::io::Error| UnitError::environment(format!("bed_save {}: cannot be written: {e}", path.display()));
    let part = path.with_extension("part");
    fs::File::create(&part).and_then(|mut f| f.write_all(&bytes).and_then(|()| f.sync_all())).map_err(fault)?;
    fs::rename(&part, path).map_err(fault)
}

/// Checks that a bed can be written, before minutes of settling.
///
/// # Errors
/// As [`write()`].
pub fn check_writable(path: &str) -> Result<(), UnitError> {
    let path = absolute("bed_save", path)?;
    let fault =
        |e: std::io::Error| UnitError::environment(format!("bed_save {}: cannot be written: {e}", path.display()));
    if path.is_dir() {
        return Err(fault(std::io::ErrorKind::IsADirectory.into()));
    }
    let part = path.with_extension("part");
    fs::File::create(&part).and_then(|_| fs::remove_file(&part)).map_err(fault)
}

/// Reads a bed and checks that it fits the specification's box.
///
/// # Errors
/// [`UnitError::Input`]: cannot be read, another kind or version, cut short, damaged, or a bed of another box.
pub fn read(path: &str, spec: &Terrain) -> Result<BedFile, UnitError> {
    let path = absolute("bed_load", path)?;
    let name = path.display();
    let bytes = fs::read(path).map_err(|e| UnitError::input(format!("bed_load {name}: cannot be read: {e}")))?;
    let fault = |e: UnitError| UnitError::input(format!("bed_load {name}: {e}"));
    let bed: BedFile = state::from_bytes(state::open(MAGIC, &bytes).map_err(fault)?).map_err(fault)?;
    let made: Terrain = serde_json::from_str(&bed.specification)
        .map_err(|e| UnitError::input(format!("bed_load {name}: its specification cannot be read: {e}")))?;
    // Grains, walls and density are in the file; a specification that says otherwise would be ignored in silence.
    let same = [
        ("bed.length", made.bed.length == spec.bed.length),
        ("bed.width", made.bed.width == spec.bed.width),
        ("bed.gravity", made.bed.gravity == spec.bed.gravity),
        ("soil.radius", made.soil.radius == spec.soil.radius),
        ("soil.density", made.soil.density == spec.soil.density),
    ];
    let other: Vec<&str> = same.iter().filter(|(_, same)| !same).map(|(what, _)| *what).collect();
    if !other.is_empty() {
        return Err(UnitError::input(format!(
            "bed_load {name}: the bed was made with another {}; allowed: the values of the specification it was made from",
            other.join(", ")
        )));
    }
    Ok(bed)
}

fn absolute<'a>(what: &str, path: &'a str) -> Result<&'a Path, UnitError> {
    let p = Path::new(path);
    if p.is_absolute() {
        Ok(p)
    } else {
        Err(UnitError::input(format!("{what} is '{path}'; allowed: an absolute path, or nothing")))
    }
}
