//! What a run records: scalars into `results.csv`, arrays into `vtk/`, headline values into `summary.json`.
//!
//! A [`Recorder`] asks the [`System`] for the variables it needs ([`System::watch`]) and is shown the system at every base step,
//! after all outputs were read and before any input is set: one row, one frame is one instant. It never calls a
//! unit itself and changes nothing that is computed. Rows are written in place; frames, which take milliseconds to compress, by a
//! thread of their own.

mod figures;
mod frames;
mod means;
mod rows;

use std::sync::Arc;
use std::time::Instant;

use serde::{Deserialize, Serialize};
use terramech_results::report::SideView;
use terramech_results::{Headline, RunFolder};

use crate::coupling::{Failure, System};

/// What a checkpoint keeps of the recording. Reals as their bits.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    /// Bytes of `results.csv`.
    rows: u64,
    /// Times of the frames written, for each dataset.
    frames: Vec<Vec<u64>>,
    /// State of each mean.
    means: Vec<[u64; 4]>,
}

fn reals(bits: &[u64]) -> Vec<f64> {
    bits.iter().map(|b| f64::from_bits(*b)).collect()
}

/// Observes a run.
pub struct Recorder {
    rows: rows::Rows,
    frames: frames::Frames,
    means: means::Means,
    seconds: f64,
}

impl Recorder {
    /// Registers what the plan wants recorded and opens the files, or goes on with those of an earlier part of the run. Call it before
    /// the first [`System::read`].
    ///
    /// # Errors
    /// [`Failure::Results`].
    pub fn new(system: &mut System, folder: &Arc<RunFolder>, saved: Option<&Saved>) -> Result<Self, Failure> {
        let rows = rows::Rows::new(system, folder, saved.map(|s| s.rows))?;
        let times: Option<Vec<Vec<f64>>> = saved.map(|s| s.frames.iter().map(|f| reals(f)).collect());
        let frames = frames::Frames::new(system, folder, times.as_deref())?;
        let mut means = means::Means::new(system);
        if let Some(saved) = saved {
            means.restore(&saved.means.iter().map(|m| m.map(f64::from_bits)).collect::<Vec<_>>());
        }
        Ok(Self { rows, frames, means, seconds: 0.0 })
    }

    /// Brings everything to disk and gives what is needed to go on from here.
    ///
    /// # Errors
    /// [`Failure::Results`].
    pub fn save(&mut self) -> Result<Saved, Failure> {
        let rows = self.rows.save()?;
        let frames = self.frames.save()?.iter().map(|times| times.iter().map(|t| t.to_bits()).collect()).collect();
        let means = self.means.save().into_iter().map(|m| m.map(f64::to_bits)).collect();
        Ok(Saved { rows, frames, means })
    }

    /// Records base step `tick`, if something is due.
    ///
    /// # Errors
    /// [`Failure::Results`]; also what writing an earlier frame found.
    pub fn observe(&mut self, system: &System, tick: u64) -> Result<(), Failure> {
        let begin = Instant::now();
        let result = self
            .rows
            .observe(system, tick)
            .and_then(|()| self.frames.observe(system, tick))
            .map(|()| self.means.observe(system, tick));
        self.seconds += begin.elapsed().as_secs_f64();
        result
    }

    /// Remarks about data that could not be written as wanted.
    pub fn remarks(&self) -> &[String] {
        self.frames.remarks()
    }

    /// Wall time spent in [`Recorder::observe`] so far (s).
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// The headline values, of what was recorded so far.
    pub fn headlines(&self) -> Vec<Headline> {
        self.means.headlines()
    }

    /// Side views of the last frames: grains with the meshes among them.
    pub fn figures(&self) -> Vec<SideView> {
        figures::side_views(&self.frames.last())
    }

    /// The whole system in the last frames, as a PNG with a caption, where there is something to be seen.
    pub fn scene(&self) -> Option<(Vec<u8>, String)> {
        figures::scene(&self.frames.last())
    }

    /// Brings everything to disk and closes the files.
    ///
    /// # Errors
    /// [`Failure::Results`].
    pub fn finish(&mut self) -> Result<(), Failure> {
        let rows = self.rows.finish();
        self.frames.finish()?;
        rows
    }
}
