//! `results.csv`: time and scalars, one row a recorded instant.
//!
//! Header `time [s],component.variable [unit],...`; a quantity without unit carries `[1]`, a text `[-]`. Fields are quoted as
//! RFC 4180 says where they need it; lines end with `\n`. Reals are written in the shortest form that reads back to the
//! same bits; Booleans are 0 and 1, so that every plotting tool reads them.

use crate::error::{Error, Result};
use crate::folder::RunFolder;
use std::fmt::Write as _;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Type of a recorded scalar, as in FMI.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// 64-bit floating point.
    Real,
    /// 32-bit integer (also enumerations).
    Integer,
    /// Written as 0 or 1.
    Boolean,
    /// Text; its header carries `[-]`.
    Text,
}

/// One recorded scalar.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// `component.variable`.
    pub name: String,
    /// SI unit as FMI writes it ("m/s", "N.m"); empty = dimensionless.
    pub unit: String,
    /// Type of its values.
    pub kind: Kind,
}

impl Column {
    /// A column of reals.
    pub fn real(name: impl Into<String>, unit: impl Into<String>) -> Column {
        Column { name: name.into(), unit: unit.into(), kind: Kind::Real }
    }

    /// The header field, not yet quoted: `name [unit]`.
    pub fn header(&self) -> String {
        let unit = match (self.kind, self.unit.as_str()) {
            (Kind::Text, _) => "-",
            (_, "") => "1",
            (_, unit) => unit,
        };
        format!("{} [{unit}]", self.name)
    }
}

/// A value of one column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value<'a> {
    /// For [`Kind::Real`].
    Real(f64),
    /// For [`Kind::Integer`].
    Integer(i32),
    /// For [`Kind::Boolean`].
    Boolean(bool),
    /// For [`Kind::Text`].
    Text(&'a str),
}

impl Value<'_> {
    fn kind(&self) -> Kind {
        match self {
            Value::Real(_) => Kind::Real,
            Value::Integer(_) => Kind::Integer,
            Value::Boolean(_) => Kind::Boolean,
            Value::Text(_) => Kind::Text,
        }
    }
}

/// Writes `results.csv` row by row.
///
/// Only whole rows reach the disk, at the latest half a second (wall clock) after the row before them, on
/// [`flush`](CsvWriter::flush) and on drop: what a stopped run recorded is readable.
#[derive(Debug)]
pub struct CsvWriter<W: Write = File> {
    out: W,
    path: PathBuf,
    kinds: Vec<Kind>,
    buffer: String,
    flushed: Instant,
    /// Bytes handed to the system.
    written: u64,
}

const FLUSH_BYTES: usize = 1 << 16;
const FLUSH_AFTER: Duration = Duration::from_millis(500);

impl CsvWriter<File> {
    /// Creates `results.csv` in the run's folder and writes its header.
    ///
    /// # Errors
    /// Those of [`RunFolder::stream`].
    pub fn create(folder: &RunFolder, columns: &[Column]) -> Result<CsvWriter> {
        let (file, path) = folder.stream("results.csv")?;
        CsvWriter::new(file, path, columns)
    }

    /// Goes on with the `results.csv` of an earlier part of the run, of which the first `length` bytes are kept.
    ///
    /// # Errors
    /// Those of [`RunFolder::append`].
    pub fn go_on(folder: &RunFolder, columns: &[Column], length: u64) -> Result<CsvWriter> {
        let (out, path) = folder.append("results.csv", length)?;
        let kinds = columns.iter().map(|c| c.kind).collect();
        Ok(CsvWriter { out, path, kinds, buffer: String::new(), flushed: Instant::now(), written: length })
    }
}

impl<W: Write> CsvWriter<W> {
    /// Writes a header to `out`; `path` is what errors name.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(out: W, path: impl Into<PathBuf>, columns: &[Column]) -> Result<CsvWriter<W>> {
        let mut buffer = String::from("time [s]");
        for column in columns {
            buffer.push(',');
            push_text(&mut buffer, &column.header());
        }
        buffer.push('\n');
        let kinds = columns.iter().map(|c| c.kind).collect();
        let mut writer = CsvWriter { out, path: path.into(), kinds, buffer, flushed: Instant::now(), written: 0 };
        writer.flush()?;
        Ok(writer)
    }

    /// Records the values of all columns at `time` (s).
    ///
    /// # Errors
    /// [`Error::Row`] when number or type of the values do not fit the header (nothing is written then), [`Error::Io`].
    pub fn row<'a>(&mut self, time: f64, values: impl IntoIterator<Item = Value<'a>>) -> Result<()> {
        let start = self.buffer.len();
        push_real(&mut self.buffer, time);
        let mut count = 0;
        for value in values {
            if self.kinds.get(count) != Some(&value.kind()) {
                self.buffer.truncate(start);
                let reason = match self.kinds.get(count) {
                    Some(kind) => format!("column {}: {kind:?} expected, {value:?} given", count + 1),
                    None => format!("more than {} values given", self.kinds.len()),
                };
                return Err(Error::Row { path: self.path.clone(), time, reason });
            }
            self.buffer.push(',');
            match value {
                Value::Real(x) => push_real(&mut self.buffer, x),
                Value::Integer(i) => write!(self.buffer, "{i}").unwrap_or_default(),
                Value::Boolean(b) => self.buffer.push(if b { '1' } else { '0' }),
                Value::Text(t) => push_text(&mut self.buffer, t),
            }
            count += 1;
        }
        if count < self.kinds.len() {
            self.buffer.truncate(start);
            let reason = format!("{count} values given, {} expected", self.kinds.len());
            return Err(Error::Row { path: self.path.clone(), time, reason });
        }
        self.buffer.push('\n');
        if self.buffer.len() >= FLUSH_BYTES || self.flushed.elapsed() >= FLUSH_AFTER { self.flush() } else { Ok(()) }
    }

    /// Bytes that the file has after the last [`flush`](CsvWriter::flush).
    pub fn written(&self) -> u64 {
        self.written
    }

    /// Hands all rows so far to the system.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn flush(&mut self) -> Result<()> {
        let written = self.out.write_all(self.buffer.as_bytes()).and_then(|()| self.out.flush());
        self.written += self.buffer.len() as u64;
        self.buffer.clear();
        self.flushed = Instant::now();
        written.map_err(Error::io("write", &self.path))
    }
}

impl<W: Write> Drop for CsvWriter<W> {
    fn drop(&mut self) {
        // A caller who wants to know of a full disk calls `flush` before.
        let _ = self.flush();
    }
}

/// Appends the shortest text that reads back to the same bits.
fn push_real(out: &mut String, x: f64) {
    let start = out.len();
    // `{:?}` is shortest and turns to exponents below 1e-5 and from 1e16 on, where plain digits grow long.
    write!(out, "{x:?}").unwrap_or_default();
    if out[start..].ends_with(".0") {
        out.truncate(out.len() - 2);
    }
}

fn push_text(out: &mut String, text: &str) {
    let edge = |c: Option<char>| c.is_some_and(char::is_whitespace);
    if text.contains([',', '"', '\n', '\r']) || edge(text.chars().next()) || edge(text.chars().next_back()) {
        out.push('"');
        out.push_str(&text.replace('"', "\"\""));
        out.push('"');
    } else {
        out.push_str(text);
    }
}

/// Values of one column read back.
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    /// Reals, integers and Booleans.
    Numbers(Vec<f64>),
    /// Text.
    Text(Vec<String>),
}

/// One column read back.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// `component.variable`.
    pub name: String,
    /// Unit; empty = dimensionless.
    pub unit: String,
    /// One value for each row.
    pub data: Data,
}

/// A whole CSV file read back, for reports and tests.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CsvTable {
    /// Time of each row (s).
    pub time: Vec<f64>,
    /// The columns after time, in the order of the file.
    pub columns: Vec<Recorded>,
}

impl CsvTable {
    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Csv`].
    pub fn read(path: impl AsRef<Path>) -> Result<CsvTable> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(Error::io("read", path))?;
        CsvTable::parse(&text, path)
    }

    /// Reads text; `path` is what errors name. A last row without line end (a run cut off) is left out.
    ///
    /// # Errors
    /// [`Error::Csv`].
    pub fn parse(text: &str, path: &Path) -> Result<CsvTable> {
        let fault = |line: usize, reason: String| Error::Csv { path: path.to_owned(), line, reason };
        let mut records = Records { rest: text, line: 1 };
        let (_, head) = records.next().ok_or_else(|| fault(1, "no header".into()))?;
        let mut names = Vec::new();
        for field in &head {
            let parts = field.strip_suffix(']').and_then(|f| f.rsplit_once(" ["));
            let (name, unit) = parts.ok_or_else(|| fault(1, format!("{field:?} is not of the form 'name [unit]'")))?;
            names.push((name.to_owned(), unit.to_owned()));
        }
        if names[0] != ("time".to_owned(), "s".to_owned()) {
            return Err(fault(1, format!("the first column is {:?}, not 'time [s]'", head[0])));
        }
        let mut time = Vec::new();
        let mut columns: Vec<Recorded> = names
            .drain(1..)
            .map(|(name, unit)| {
                let data = if unit == "-" { Data::Text(Vec::new()) } else { Data::Numbers(Vec::new()) };
                let unit = if unit == "-" || unit == "1" { String::new() } else { unit };
                Recorded { name, unit, data }
            })
            .collect();
        for (line, fields) in records {
            if fields.len() != head.len() {
                return Err(fault(line, format!("{} fields, the header has {}", fields.len(), head.len())));
            }
            let number = |text: &str| text.parse::<f64>().map_err(|_| fault(line, format!("{text:?} is not a number")));
            time.push(number(&fields[0])?);
            for (column, field) in columns.iter_mut().zip(fields.into_iter().skip(1)) {
                match &mut column.data {
                    Data::Numbers(values) => values.push(number(&field)?),
                    Data::Text(values) => values.push(field),
                }
            }
        }
        Ok(CsvTable { time, columns })
    }

    /// The numbers of a column by its full name.
    pub fn numbers(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|c| c.name == name).and_then(|c| match &c.data {
            Data::Numbers(values) => Some(values.as_slice()),
            Data::Text(_) => None,
        })
    }
}

/// The complete records of a CSV text, each with its line number.
struct Records<'a> {
    rest: &'a str,
    line: usize,
}

impl Iterator for Records<'_> {
    type Item = (usize, Vec<String>);

    fn next(&mut self) -> Option<Self::Item> {
        let line = self.line;
        let mut fields = vec![String::new()];
        let mut quoted = false;
        let mut chars = self.rest.char_indices().peekable();
        while let Some((at, c)) = chars.next() {
            let field = fields.last_mut()?;
            match c {
                '"' if quoted && chars.peek().is_some_and(|(_, next)| *next == '"') => {
                    field.push('"');
                    chars.next();
                }
                '"' => quoted = !quoted,
                ',' if !quoted => fields.push(String::new()),
                '\n' => {
                    self.line += 1;
                    if !quoted {
                        self.rest = &self.rest[at + 1..];
                        return Some((line, fields));
                    }
                    field.push('\n');
                }
                // A file that passed through another system's editor.
                '\r' if !quoted && chars.peek().is_some_and(|(_, next)| *next == '\n') => {}
                c => field.push(c),
            }
        }
        None
    }
}
