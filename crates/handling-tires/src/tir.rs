//! Tire property files (`.tir`): sections in brackets, `KEY = value $ comment`.

use std::collections::BTreeMap;

/// What is wrong with a `.tir` file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TirError {
    /// A line that is neither section, comment nor assignment.
    #[error("line {line}: '{text}'; expected [SECTION], KEY = value, or a comment ($ or !)")]
    Line {
        /// Line, from 1.
        line: usize,
        /// Its text.
        text: String,
    },
    /// Keys that the model needs are missing.
    #[error("missing keys: {0}")]
    Missing(String),
    /// A key with a value that cannot be.
    #[error("key {key} is {value}; allowed: {allowed}")]
    Value {
        /// The key.
        key: String,
        /// The value given.
        value: String,
        /// What is allowed.
        allowed: &'static str,
    },
}

/// Keys and values of a file, whatever the section.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tir {
    values: BTreeMap<String, String>,
}

impl Tir {
    /// Parses a file's text.
    ///
    /// # Errors
    /// [`TirError::Line`].
    pub fn parse(text: &str) -> Result<Self, TirError> {
        let mut values = BTreeMap::new();
        for (k, raw) in text.lines().enumerate() {
            let line = raw.split('$').next().unwrap_or("").trim();
            if line.is_empty() || line.starts_with('!') || line.starts_with('[') {
                continue;
            }
            match line.split_once('=') {
                Some((key, value)) => {
                    values.insert(key.trim().to_uppercase(), value.trim().trim_matches('\'').trim().to_string());
                }
                // Tables of shapes follow some sections as bare numbers.
                None if line.split_whitespace().all(|w| w.parse::<f64>().is_ok()) || line.starts_with('{') => {}
                None => return Err(TirError::Line { line: k + 1, text: raw.trim().into() }),
            }
        }
        Ok(Self { values })
    }
    /// Text of a key.
    pub fn text(&self, key: &str) -> Option<&str> {
        self.values.get(key).map(String::as_str)
    }
    /// A number; `None` if missing or no number.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.text(key).and_then(|t| t.parse().ok()).filter(|x: &f64| x.is_finite())
    }
}
