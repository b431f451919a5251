//! What the members of a spread unit write side by side into the run's folder (`terramech run --pieces`): their parts of checkpoints, and frames for ParaView. Nothing of it
//! goes through rank 0, which lists what was written.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Failure, Moment, System};

/// A series of frames that the members of a unit write.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Show {
    /// The unit.
    pub unit: usize,
    /// Period in base steps, from the first on.
    pub every: u64,
    /// Path in the run's folder; the number of the frame follows.
    pub name: String,
    /// Value reference of the positions.
    pub position: u32,
    /// Value references and names of the fields.
    pub fields: Vec<(u32, String)>,
}

/// Where units write, and what.
#[derive(Debug, Default)]
pub(super) struct Pieces {
    /// The run's folder, absolute.
    folder: Option<PathBuf>,
    /// In how many pieces each unit writes; 0: it does not.
    members: Vec<usize>,
    shows: Vec<Show>,
}

impl System {
    /// Tells the run's folder, and whether spread units write into it side by side. Call it before anything is restored.
    pub fn write_into(&mut self, folder: &Path, in_pieces: bool) {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        let job = self.job.as_ref().filter(|_| in_pieces);
        let units = 0..self.members.len();
        let members = units.map(|unit| job.map_or(0, |job| job.members_of(unit))).collect();
        self.pieces = Pieces { folder: Some(folder), members, shows: Vec::new() };
    }

    /// In how many pieces a unit writes; 0: it does not.
    pub fn pieces_of(&self, unit: usize) -> usize {
        self.pieces.members.get(unit).copied().unwrap_or(0)
    }

    /// Asks for a series that a unit writes in pieces. Call it before the first `read`.
    pub fn show(&mut self, show: Show) {
        self.pieces.shows.push(show);
    }

    pub(super) fn shows(&self) -> &[Show] {
        &self.pieces.shows
    }

    pub(super) fn take_shows(&mut self, shows: Vec<Show>) {
        self.pieces.shows = shows;
    }

    /// Has the frames of a base step written by the units that are led here, after what observers watch.
    pub(super) fn write_shows(&mut self, tick: u64) -> Result<(), Failure> {
        let time = self.time(tick);
        let Pieces { folder: Some(folder), shows, .. } = &self.pieces else { return Ok(()) };
        for show in shows.iter().filter(|s| tick.is_multiple_of(s.every)) {
            // On this rank or on another.
            let Some(member) = self.members[show.unit].as_deref_mut() else { continue };
            let prefix = folder.join(format!("{}_{:06}", show.name, tick / show.every));
            let written = member.instance.write_pieces(&prefix, show.position, &show.fields);
            written.map_err(|e| Failure::unit(e, Moment::At(time), "writing its grains in pieces"))?;
        }
        Ok(())
    }

    /// Prefix of the files in which a unit that is spread leaves parts of its state.
    pub(super) fn state_prefix(&self, unit: usize, tick: u64) -> Option<PathBuf> {
        let folder = self.pieces.folder.as_ref().filter(|_| self.pieces_of(unit) > 0)?;
        Some(folder.join(format!("checkpoint/{tick:012}.{unit}")))
    }

    /// The same, for a state that was saved in pieces and is restored: in the same folder, whatever their names.
    pub(super) fn restored_prefix(&self) -> Option<PathBuf> {
        Some(self.pieces.folder.as_ref()?.join("checkpoint/restored"))
    }
}
