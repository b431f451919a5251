//! `summary.json`: the few numbers a study is about, as a JSON list.

use crate::error::{Error, Result};
use crate::folder::RunFolder;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// One headline result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Headline {
    /// `component.variable`, or a name of its own.
    pub name: String,
    /// The value, in `unit`; not a number when it could not be computed (`null` in the file).
    #[serde(with = "finite_or_null")]
    pub value: f64,
    /// SI unit; empty = dimensionless.
    pub unit: String,
    /// Averaging window from, to (s); absent = the value at the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window: Option<[f64; 2]>,
    /// What a reader sees instead of `name`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// A measured value to stand beside it, same unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<f64>,
    /// Where the measured value comes from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
}

impl Headline {
    /// A headline without window, label or measured value.
    pub fn new(name: impl Into<String>, value: f64, unit: impl Into<String>) -> Headline {
        Headline {
            name: name.into(),
            value,
            unit: unit.into(),
            window: None,
            label: None,
            measured: None,
            source: None,
        }
    }

    /// The mean of a recorded quantity over `window` = from, to (s), by the trapezoidal rule.
    ///
    /// Not a number when the window holds fewer than two rows.
    pub fn mean(
        name: impl Into<String>,
        unit: impl Into<String>,
        time: &[f64],
        y: &[f64],
        window: [f64; 2],
    ) -> Headline {
        let inside: Vec<(f64, f64)> =
            time.iter().copied().zip(y.iter().copied()).filter(|(t, _)| (window[0]..=window[1]).contains(t)).collect();
        let area: f64 = inside.windows(2).map(|w| 0.5 * (w[1].0 - w[0].0) * (w[0].1 + w[1].1)).sum();
        let span = inside.last().map_or(0.0, |l| l.0 - inside[0].0);
        let value = if span > 0.0 { area / span } else { f64::NAN };
        Headline { window: Some(window), ..Headline::new(name, value, unit) }
    }

    /// With a label.
    pub fn label(mut self, label: impl Into<String>) -> Headline {
        self.label = Some(label.into());
        self
    }

    /// With a measured value and its source.
    pub fn measured(mut self, value: f64, source: impl Into<String>) -> Headline {
        self.measured = Some(value);
        self.source = Some(source.into());
        self
    }
}

/// Writes `summary.json`.
///
/// # Errors
/// Those of [`RunFolder::write_json`].
pub fn write_summary(folder: &RunFolder, headlines: &[Headline]) -> Result<()> {
    folder.write_json("summary.json", &headlines)
}

/// Reads a `summary.json`.
///
/// # Errors
/// [`Error::Io`], [`Error::Json`].
pub fn read_summary(path: impl AsRef<Path>) -> Result<Vec<Headline>> {
    let path = path.as_ref();
    let text = std::fs::read(path).map_err(Error::io("read", path))?;
    serde_json::from_slice(&text).map_err(|source| Error::Json { path: path.to_owned(), source })
}

/// JSON knows no NaN: `null` stands for it both ways.
mod finite_or_null {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(x: &f64, s: S) -> Result<S::Ok, S::Error> {
        x.is_finite().then_some(*x).serialize(s)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<f64, D::Error> {
        Ok(Option::<f64>::deserialize(d)?.unwrap_or(f64::NAN))
    }
}
