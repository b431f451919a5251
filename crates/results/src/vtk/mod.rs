//! Pictures in time for ParaView: `.vtp` poly data and its `.pvd` time series.
//!
//! Files are VTK XML, version 1.0: `Float32` fields by default, zlib blocks appended as raw bytes, 64-bit header words.
//! The layout is described in the "VTK XML formats" page of the VTK documentation.

mod blocks;
mod polydata;
mod series;

pub use polydata::{Cells, Field, PolyData, Precision, Values};
pub use series::VtkSeries;
