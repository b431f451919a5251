//! A `.vtp` file: points, optional cells, fields on both.

use super::blocks;
use crate::error::{Error, Result};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, Event};
use std::io;

/// What the points carry beside themselves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cells<'a> {
    /// One vertex cell a point, so that ParaView shows grains without a filter.
    Vertices,
    /// Triangles, three point indices each (3M), counted from 0.
    Triangles(&'a [i32]),
}

/// The values of a field, all components of the first point, then of the second, ...
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Values<'a> {
    /// Written in the data set's [`Precision`].
    Real(&'a [f64]),
    /// Written as 32-bit integers.
    Integer(&'a [i32]),
}

/// A named field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field<'a> {
    /// Name as ParaView shows it.
    pub name: &'a str,
    /// Values a point: 1 scalar, 3 vector, 6 or 9 tensor.
    pub components: usize,
    /// The values.
    pub values: Values<'a>,
}

impl<'a> Field<'a> {
    /// A scalar a point.
    pub fn scalar(name: &'a str, values: &'a [f64]) -> Field<'a> {
        Field { name, components: 1, values: Values::Real(values) }
    }

    /// A vector a point (3N).
    pub fn vector(name: &'a str, values: &'a [f64]) -> Field<'a> {
        Field { name, components: 3, values: Values::Real(values) }
    }

    /// An integer a point.
    pub fn integer(name: &'a str, values: &'a [i32]) -> Field<'a> {
        Field { name, components: 1, values: Values::Integer(values) }
    }
}

/// How reals are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// 32 bits: 7 digits, for pictures.
    #[default]
    Single,
    /// 64 bits: for data somebody computes with.
    Double,
}

/// Points with cells and fields, borrowed from the caller.
#[derive(Debug, Clone, PartialEq)]
pub struct PolyData<'a> {
    /// Positions x0, y0, z0, x1, ... (3N, m).
    pub points: &'a [f64],
    /// What connects them.
    pub cells: Cells<'a>,
    /// Fields with one value set a point.
    pub point_data: Vec<Field<'a>>,
    /// Fields with one value set a cell.
    pub cell_data: Vec<Field<'a>>,
}

impl<'a> PolyData<'a> {
    /// Points, each shown as a vertex.
    pub fn points(points: &'a [f64], point_data: Vec<Field<'a>>) -> PolyData<'a> {
        PolyData { points, cells: Cells::Vertices, point_data, cell_data: Vec::new() }
    }

    /// A triangle mesh.
    pub fn triangles(points: &'a [f64], triangles: &'a [i32], point_data: Vec<Field<'a>>) -> PolyData<'a> {
        PolyData { points, cells: Cells::Triangles(triangles), point_data, cell_data: Vec::new() }
    }

    /// The content of a `.vtp` file.
    ///
    /// # Errors
    /// [`Error::Length`] when a field does not fit the points or cells, [`Error::Vertex`] when a triangle names a point
    /// that does not exist. `name` is what errors call the data set.
    pub fn encode(&self, name: &str, precision: Precision) -> Result<Vec<u8>> {
        self.check(name)?;
        self.write(precision).map_err(Error::io("encode", name.as_ref()))
    }

    /// The content of a `.pvtp` file: the files of `pieces`, in its folder, as one data set. All of them have the fields of this one, which is one of them.
    ///
    /// # Errors
    /// Those of writing XML.
    pub fn list(&self, name: &str, precision: Precision, pieces: &[String]) -> Result<Vec<u8>> {
        self.write_list(precision, pieces).map_err(Error::io("encode", name.as_ref()))
    }

    fn write_list(&self, precision: Precision, pieces: &[String]) -> io::Result<Vec<u8>> {
        let mut file = File { xml: Writer::new_with_indent(Vec::new(), b' ', 1), blob: Vec::new(), precision };
        file.xml.write_event(Event::Decl(BytesDecl::new("1.0", None, None)))?;
        let head =
            [("type", "PPolyData"), ("version", "1.0"), ("byte_order", "LittleEndian"), ("header_type", "UInt64")];
        file.open("VTKFile", &head)?;
        file.open("PPolyData", &[("GhostLevel", "0")])?;
        for (section, fields) in [("PPointData", &self.point_data), ("PCellData", &self.cell_data)] {
            file.open(section, &active(fields))?;
            fields.iter().try_for_each(|field| file.told(field))?;
            file.close(section)?;
        }
        file.open("PPoints", &[])?;
        file.told(&Field::vector("Points", &[]))?;
        file.close("PPoints")?;
        for piece in pieces {
            let tag = BytesStart::new("Piece").with_attributes([("Source", piece.as_str())]);
            file.xml.write_event(Event::Empty(tag))?;
        }
        file.close("PPolyData")?;
        file.close("VTKFile")?;
        let mut out = file.xml.into_inner();
        out.push(b'\n');
        Ok(out)
    }

    fn counts(&self) -> (usize, usize) {
        let points = self.points.len() / 3;
        match self.cells {
            Cells::Vertices => (points, points),
            Cells::Triangles(t) => (points, t.len() / 3),
        }
    }

    fn check(&self, name: &str) -> Result<()> {
        let (points, cells) = self.counts();
        Error::length(format!("{name}: point coordinates"), self.points.len(), 3 * points)?;
        if let Cells::Triangles(indices) = self.cells {
            Error::length(format!("{name}: triangle indices"), indices.len(), 3 * cells)?;
            if let Some(at) = indices.iter().position(|i| usize::try_from(*i).map_or(true, |i| i >= points)) {
                let vertex = i64::from(indices[at]);
                return Err(Error::Vertex { what: name.into(), triangle: at / 3, vertex, count: points });
            }
        }
        for (fields, count) in [(&self.point_data, points), (&self.cell_data, cells)] {
            for field in fields {
                let given = match field.values {
                    Values::Real(v) => v.len(),
                    Values::Integer(v) => v.len(),
                };
                Error::length(format!("{name}: field {}", field.name), given, count * field.components)?;
            }
        }
        Ok(())
    }

    fn write(&self, precision: Precision) -> io::Result<Vec<u8>> {
        let (points, cells) = self.counts();
        let vertices = matches!(self.cells, Cells::Vertices);
        let mut file = File { xml: Writer::new_with_indent(Vec::new(), b' ', 1), blob: Vec::new(), precision };
        file.xml.write_event(Event::Decl(BytesDecl::new("1.0", None, None)))?;
        file.open(
            "VTKFile",
            &[
                ("type", "PolyData"),
                ("version", "1.0"),
                ("byte_order", "LittleEndian"),
                ("header_type", "UInt64"),
                ("compressor", "vtkZLibDataCompressor"),
            ],
        )?;
        file.open("PolyData", &[])?;
        let (n, c) = (points.to_string(), cells.to_string());
        let (verts, polys) = if vertices { (c.as_str(), "0") } else { ("0", c.as_str()) };
        file.open(
            "Piece",
            &[
                ("NumberOfPoints", &n),
                ("NumberOfVerts", verts),
                ("NumberOfLines", "0"),
                ("NumberOfStrips", "0"),
                ("NumberOfPolys", polys),
            ],
        )?;
        file.fields("PointData", &self.point_data)?;
        file.fields("CellData", &self.cell_data)?;
        file.open("Points", &[])?;
        file.array(&Field::vector("Points", self.points))?;
        file.close("Points")?;
        let corners = if vertices { 1 } else { 3 };
        // Indices were checked against an i32 count of points or are one; a bed beyond 2^31 grains has other troubles.
        let own: Vec<i32>;
        let connectivity = match self.cells {
            Cells::Vertices => {
                own = (0..points as i32).collect();
                own.as_slice()
            }
            Cells::Triangles(indices) => indices,
        };
        let offsets: Vec<i32> = (1..=cells as i32).map(|i| i * corners).collect();
        let section = if vertices { "Verts" } else { "Polys" };
        file.open(section, &[])?;
        file.array(&Field::integer("connectivity", connectivity))?;
        file.array(&Field::integer("offsets", &offsets))?;
        file.close(section)?;
        for name in ["Piece", "PolyData"] {
            file.close(name)?;
        }
        file.finish()
    }
}

/// Type of a field's values in a file.
fn kind(field: &Field, precision: Precision) -> &'static str {
    match (field.values, precision) {
        (Values::Real(_), Precision::Single) => "Float32",
        (Values::Real(_), Precision::Double) => "Float64",
        (Values::Integer(_), _) => "Int32",
    }
}

/// The first scalar and vector are active when a file is opened: what "Glyph" and colouring start from.
fn active<'a>(fields: &[Field<'a>]) -> Vec<(&'static str, &'a str)> {
    let first = |components: usize| fields.iter().find(|f| f.components == components).map(|f| f.name);
    [("Scalars", first(1)), ("Vectors", first(3))].into_iter().filter_map(|(k, v)| Some((k, v?))).collect()
}

/// The file under way: the XML head, and the compressed arrays that follow it.
struct File {
    xml: Writer<Vec<u8>>,
    blob: Vec<u8>,
    precision: Precision,
}

impl File {
    fn open(&mut self, name: &str, attributes: &[(&str, &str)]) -> io::Result<()> {
        let tag = BytesStart::new(name).with_attributes(attributes.iter().copied());
        self.xml.write_event(Event::Start(tag))
    }

    fn close(&mut self, name: &str) -> io::Result<()> {
        self.xml.write_event(Event::End(BytesEnd::new(name)))
    }

    fn fields(&mut self, section: &str, fields: &[Field]) -> io::Result<()> {
        self.open(section, &active(fields))?;
        for field in fields {
            self.array(field)?;
        }
        self.close(section)
    }

    /// What all pieces have, without its values.
    fn told(&mut self, field: &Field) -> io::Result<()> {
        let tag = BytesStart::new("PDataArray").with_attributes([
            ("type", kind(field, self.precision)),
            ("Name", field.name),
            ("NumberOfComponents", field.components.to_string().as_str()),
        ]);
        self.xml.write_event(Event::Empty(tag))
    }

    fn array(&mut self, field: &Field) -> io::Result<()> {
        let offset = self.blob.len().to_string();
        let bytes: Vec<u8> = match (field.values, self.precision) {
            (Values::Real(v), Precision::Single) => v.iter().flat_map(|x| (*x as f32).to_le_bytes()).collect(),
            (Values::Real(v), Precision::Double) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            (Values::Integer(v), _) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
        };
        blocks::append(&mut self.blob, &bytes)?;
        let tag = BytesStart::new("DataArray").with_attributes([
            ("type", kind(field, self.precision)),
            ("Name", field.name),
            ("NumberOfComponents", field.components.to_string().as_str()),
            ("format", "appended"),
            ("offset", offset.as_str()),
        ]);
        self.xml.write_event(Event::Empty(tag))
    }

    fn finish(self) -> io::Result<Vec<u8>> {
        let mut out = self.xml.into_inner();
        // Raw bytes are no XML: VTK's reader stops parsing at the underscore and counts offsets from the byte after it.
        out.extend_from_slice(b"\n <AppendedData encoding=\"raw\">\n_");
        out.extend_from_slice(&self.blob);
        out.extend_from_slice(b"\n </AppendedData>\n</VTKFile>\n");
        Ok(out)
    }
}
