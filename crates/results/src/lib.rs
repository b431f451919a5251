//! What a run leaves on disk: manifest, summary, CSV, log, VTK, report.
//!
//! The crate knows files and nothing else: no FMI, no master, no units. A master opens a [`RunFolder`], writes a
//! [`Manifest`], streams scalars into a [`CsvWriter`], messages into a [`LogWriter`] and frames into [`VtkSeries`], and at the
//! end writes the summary and the manifest again.
//!
//! Designed so that a run that stops for any reason leaves what it recorded readable: streams end in whole rows, every other
//! file is written aside and renamed, and the time series of pictures lists complete frames only. Nothing that a
//! user put into the folder is ever overwritten or deleted.
//!
//! Quantities are in SI units; arrays of points are x0, y0, z0, x1, ...
//!
//! ```
//! use terramech_results::{
//!     Column, CsvTable, CsvWriter, ExitState, Field, Headline, Manifest, PolyData, Report, RunFolder, Value, VtkSeries,
//!     write_summary,
//! };
//! # fn main() -> terramech_results::Result<()> {
//! # let dir = std::env::temp_dir().join(format!("terramech-results-doc-{}", std::process::id()));
//! let folder = RunFolder::create(&dir)?;
//! let mut manifest = Manifest::start("0.1.0", std::env::args().collect());
//! manifest.write(&folder)?;
//!
//! let mut csv = CsvWriter::create(&folder, &[Column::real("rig.drawbar_pull", "N"), Column::real("rig.slip", "")])?;
//! csv.row(0.0, [Value::Real(0.1), Value::Real(0.5)])?;
//! csv.flush()?;
//!
//! let mut bed = VtkSeries::new("bed");
//! bed.write(&folder, 0.0, &PolyData::points(&[0.0, 0.0, 0.1], vec![Field::scalar("radius", &[0.003])]))?;
//!
//! manifest.state = ExitState::Done;
//! manifest.write(&folder)?;
//! let summary = [Headline::new("rig.drawbar_pull", 0.1, "N")];
//! write_summary(&folder, &summary)?;
//! let recorded = CsvTable::read(folder.file("results.csv"))?;
//! Report::of_run("Single wheel", &recorded, &summary, &manifest, vec![]).write(&folder)?;
//! # drop(folder);
//! # std::fs::remove_dir_all(&dir).ok();
//! # Ok(())
//! # }
//! ```

pub mod csv;
pub mod error;
pub mod folder;
pub mod hash;
pub mod log;
pub mod manifest;
pub mod report;
pub mod summary;
pub mod time;
pub mod vtk;

pub use csv::{Column, CsvTable, CsvWriter, Data, Kind, Recorded, Value};
pub use error::{Error, Result};
pub use folder::RunFolder;
pub use hash::{sha256, sha256_file};
pub use log::{Level, LogEntry, LogWriter};
pub use manifest::{ExitState, Input, Machine, Manifest, Timings, UnitFacts, UnitTiming};
pub use report::Report;
pub use summary::{Headline, read_summary, write_summary};
pub use vtk::{Cells, Field, PolyData, Precision, Values, VtkSeries};
