//! A time series: numbered `.vtp` frames and the `.pvd` that lists them.

use super::polydata::{PolyData, Precision};
use crate::error::{Error, Result};
use crate::folder::RunFolder;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, Event};
use std::io;

/// Writes `vtk/NAME_000000.vtp`, ... and keeps `vtk/NAME.pvd` up to date.
///
/// The list is replaced whole after each frame, so that ParaView opens it at any moment of the run and finds only frames
/// that are complete.
#[derive(Debug, Clone)]
pub struct VtkSeries {
    name: String,
    precision: Precision,
    /// Whether each frame is a list of pieces that others write.
    pieces: usize,
    frames: Vec<(f64, String)>,
}

impl VtkSeries {
    /// A series; `name` becomes a file name: letters other than ASCII letters, digits, `-` and `_` turn into `_`.
    pub fn new(name: &str) -> VtkSeries {
        let name = name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect();
        VtkSeries { name, precision: Precision::Single, pieces: 0, frames: Vec::new() }
    }

    /// The same series with fields in 64 bits.
    pub fn double(self) -> VtkSeries {
        VtkSeries { precision: Precision::Double, ..self }
    }

    /// The same series with each frame in so many pieces (`.pvtp`), which others write: [`VtkSeries::path`] tells where, [`VtkSeries::adopt`] takes them in.
    pub fn in_pieces(self, pieces: usize) -> VtkSeries {
        VtkSeries { pieces, ..self }
    }

    /// Path of the series in the run's folder: frame 12 is `PATH_000012.vtp`, or of pieces `PATH_000012.pvtp` and `PATH_000012_K.vtp`.
    pub fn path(&self) -> String {
        format!("vtk/{}", self.name)
    }

    fn prefix(&self, frame: usize) -> String {
        format!("{}_{frame:06}", self.path())
    }

    /// The same series with frames at these times (s) written already, by an earlier part of the run in this folder, whole or in pieces.
    pub fn after(mut self, folder: &RunFolder, times: &[f64]) -> VtkSeries {
        let file = |i: usize| {
            let [list, whole] = ["pvtp", "vtp"].map(|ending| format!("{}_{i:06}.{ending}", self.name));
            if folder.path().join("vtk").join(&list).exists() { list } else { whole }
        };
        self.frames = times.iter().enumerate().map(|(i, t)| (*t, file(i))).collect();
        self
    }

    fn file(&self, frame: usize) -> String {
        format!("{}_{frame:06}.{}", self.name, if self.pieces > 0 { "pvtp" } else { "vtp" })
    }

    /// Number of frames written.
    pub fn frames(&self) -> usize {
        self.frames.len()
    }

    /// Writes the frame at `time` (s).
    ///
    /// # Errors
    /// Those of [`PolyData::encode`] and [`RunFolder::write_with`].
    pub fn write(&mut self, folder: &RunFolder, time: f64, data: &PolyData) -> Result<()> {
        let file = self.file(self.frames.len());
        folder.write(&format!("vtk/{file}"), &data.encode(&self.name, self.precision)?)?;
        // What an earlier part of the run, which was cut, may have left in pieces.
        folder.remove(&format!("{}.pvtp", self.prefix(self.frames.len())))?;
        self.add(folder, time, file)
    }

    /// Takes in the frame at `time` (s) whose pieces and list others have written.
    ///
    /// # Errors
    /// Those of [`RunFolder::adopt`] and [`RunFolder::write_with`].
    pub fn adopt(&mut self, folder: &RunFolder, time: f64) -> Result<()> {
        let frame = self.frames.len();
        let file = self.file(frame);
        folder.adopt(&format!("vtk/{file}"))?;
        for piece in 0..self.pieces {
            folder.adopt(&format!("{}_{piece}.vtp", self.prefix(frame)))?;
        }
        self.add(folder, time, file)
    }

    fn add(&mut self, folder: &RunFolder, time: f64, file: String) -> Result<()> {
        self.frames.push((time, file));
        let pvd = format!("vtk/{}.pvd", self.name);
        let list = self.list().map_err(Error::io("encode", pvd.as_ref()))?;
        folder.write(&pvd, &list)
    }

    fn list(&self) -> io::Result<Vec<u8>> {
        let mut xml = Writer::new_with_indent(Vec::new(), b' ', 1);
        xml.write_event(Event::Decl(BytesDecl::new("1.0", None, None)))?;
        let head = [("type", "Collection"), ("version", "1.0"), ("byte_order", "LittleEndian")];
        xml.write_event(Event::Start(BytesStart::new("VTKFile").with_attributes(head)))?;
        xml.write_event(Event::Start(BytesStart::new("Collection")))?;
        for (time, file) in &self.frames {
            let time = time.to_string();
            let attributes = [("timestep", time.as_str()), ("group", ""), ("part", "0"), ("file", file.as_str())];
            xml.write_event(Event::Empty(BytesStart::new("DataSet").with_attributes(attributes)))?;
        }
        xml.write_event(Event::End(BytesEnd::new("Collection")))?;
        xml.write_event(Event::End(BytesEnd::new("VTKFile")))?;
        Ok(xml.into_inner())
    }
}
