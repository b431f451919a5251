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

use terramech_results::report::SideView;
use terramech_results::{Headline, RunFolder};

use crate::coupling::{Failure, System};

/// Observes a run.
pub struct Recorder {
    rows: rows::Rows,
    frames: frames::Frames,
    means: means::Means,
    seconds: f64,
}

impl Recorder {
    /// Registers what the plan wants recorded and opens the files. Call it before the first [`System::read`].
    ///
    /// # Errors
    /// [`Failure::Results`].
    pub fn new(system: &mut System, folder: &Arc<RunFolder>) -> Result<Self, Failure> {
        Ok(Self {
            rows: rows::Rows::new(system, folder)?,
            frames: frames::Frames::new(system, folder)?,
            means: means::Means::new(system),
            seconds: 0.0,
        })
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
