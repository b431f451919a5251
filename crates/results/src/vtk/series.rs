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
    frames: Vec<(f64, String)>,
}

impl VtkSeries {
    /// A series; `name` becomes a file name: letters other than ASCII letters, digits, `-` and `_` turn into `_`.
    pub fn new(name: &str) -> VtkSeries {
        let name = name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect();
        VtkSeries { name, precision: Precision::Single, frames: Vec::new() }
    }

    /// The same series with fields in 64 bits.
    pub fn double(self) -> VtkSeries {
        VtkSeries { precision: Precision::Double, ..self }
    }

    /// The same series with frames at these times (s) written already, by an earlier part of the run.
    pub fn after(mut self, times: &[f64]) -> VtkSeries {
        self.frames = times.iter().enumerate().map(|(i, t)| (*t, self.file(i))).collect();
        self
    }

    fn file(&self, frame: usize) -> String {
        format!("{}_{frame:06}.vtp", self.name)
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
