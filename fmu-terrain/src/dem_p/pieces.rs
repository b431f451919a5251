//! What the members of a spread terrain write side by side: parts of a saved state, frames for ParaView.

use super::outputs;
use crate::config::Terrain;
use crate::dem::DemState;
use crate::variables::Variables;
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use terramech_fmi2::{Pieces, UnitError, Values, Var, state};
use terramech_results::vtk::{Cells, Field, PolyData, Precision, Values as Column};

const MAGIC: &[u8; 8] = b"TMPIECE1";

/// The part of one member, as the saved bytes of the lead name it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// Name of its file, in the folder of the prefix.
    file: String,
    /// The hash that it ends with.
    hash: [u8; 32],
}

/// `PREFIX` and more.
fn path_of(prefix: &Path, more: &str) -> PathBuf {
    let mut name = prefix.file_name().map(OsString::from).unwrap_or_default();
    name.push(more);
    prefix.with_file_name(name)
}

/// Writes a file aside and renames it; `durably`: once it is on the disk.
fn write(path: &Path, bytes: &[u8], durably: bool) -> Result<(), UnitError> {
    let aside = path_of(path, ".part");
    let write = || -> std::io::Result<()> {
        path.parent().map_or(Ok(()), fs::create_dir_all)?;
        let mut file = File::create(&aside)?;
        file.write_all(bytes)?;
        if durably {
            file.sync_all()?;
        }
        fs::rename(&aside, path)
    };
    write().map_err(|e| {
        // What is half-written goes; a second failure here would only hide the first.
        let _ = fs::remove_file(&aside);
        UnitError::environment(format!("{}: cannot be written: {e}", path.display()))
    })
}

/// Writes the part of member `index` of a saved state.
///
/// # Errors
/// [`UnitError::Environment`].
pub fn keep(prefix: &Path, index: usize, part: &DemState) -> Result<Piece, UnitError> {
    let path = path_of(prefix, &format!(".{index}"));
    let file = path.file_name().and_then(|n| n.to_str()).unwrap_or_default().to_owned();
    let bytes = state::seal(MAGIC, &state::to_bytes(part)?);
    write(&path, &bytes, true)?;
    Ok(Piece { file, hash: bytes.last_chunk().copied().unwrap_or_default() })
}

/// The whole state whose parts lie in the folder of `prefix`.
///
/// # Errors
/// [`UnitError::State`]: no prefix was told, a file that is not there, or is another than was written.
pub fn whole(prefix: Option<&Path>, pieces: &[Piece]) -> Result<DemState, UnitError> {
    let prefix =
        prefix.ok_or_else(|| UnitError::state("parts of it are in files, and nobody has told where they are"))?;
    let mut parts = Vec::with_capacity(pieces.len());
    for piece in pieces {
        let path = prefix.with_file_name(&piece.file);
        let fault = |what: String| UnitError::state(format!("{}: {what}", path.display()));
        let bytes = fs::read(&path).map_err(|e| fault(format!("cannot be read: {e}")))?;
        let body = state::open(MAGIC, &bytes).map_err(|e| fault(e.to_string()))?;
        if bytes.last_chunk() != Some(&piece.hash) {
            return Err(fault("it was not written with this state".into()));
        }
        parts.push(state::from_bytes(body).map_err(|e| fault(e.to_string()))?);
    }
    DemState::joined(parts).ok_or_else(|| UnitError::state("it has no parts"))
}

/// Writes the grains of member `index` of `size`; the lead writes the list of all as well.
///
/// # Errors
/// [`UnitError::Input`]: arrays of something else than grains; [`UnitError::Environment`].
pub fn show(
    v: &mut Values,
    vars: &Variables,
    (state, spec): (&DemState, &Terrain),
    pieces: &Pieces,
    [index, size]: [usize; 2],
) -> Result<(), UnitError> {
    let reals = [vars.grain_position, vars.grain_velocity, vars.grain_radius, vars.grain_force];
    let mut points = Vec::new();
    let mut columns = Vec::with_capacity(pieces.fields.len());
    for (vr, name) in
        std::iter::once((pieces.position, "")).chain(pieces.fields.iter().map(|(vr, name)| (*vr, name.as_str())))
    {
        outputs::grain(v, vars, state, spec, vr);
        let real = reals.iter().find(|var| var.vr() == vr);
        match real {
            Some(var) if name.is_empty() => points.clone_from(v.reals_mut(*var)),
            Some(var) => {
                let components = if vr == vars.grain_radius.vr() { 1 } else { 3 };
                columns.push((name, components, Numbers::Real(v.reals_mut(*var).clone())));
            }
            None if vr == vars.grain_id.vr() && !name.is_empty() => {
                columns.push((name, 1, Numbers::Integer(v.integers_mut(vars.grain_id).clone())));
            }
            None => return Err(UnitError::input("in pieces only the arrays grain.* are written, at grain.position")),
        }
    }
    let point_data = columns.iter().map(|(name, components, numbers)| Field {
        name,
        components: *components,
        values: match numbers {
            Numbers::Real(x) => Column::Real(x),
            Numbers::Integer(x) => Column::Integer(x),
        },
    });
    let data =
        PolyData { points: &points, cells: Cells::Vertices, point_data: point_data.collect(), cell_data: Vec::new() };
    let fault = |e: terramech_results::Error| UnitError::environment(e.to_string());
    let name = |k: usize| format!("_{k}.vtp");
    let path = path_of(&pieces.prefix, &name(index));
    write(&path, &data.encode("grains", Precision::Single).map_err(fault)?, false)?;
    if index == 0 {
        let stem = pieces.prefix.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        let files: Vec<String> = (0..size).map(|k| format!("{stem}{}", name(k))).collect();
        let list = data.list("grains", Precision::Single, &files).map_err(fault)?;
        write(&path_of(&pieces.prefix, ".pvtp"), &list, false)?;
    }
    Ok(())
}

enum Numbers {
    Real(Vec<f64>),
    Integer(Vec<i32>),
}
