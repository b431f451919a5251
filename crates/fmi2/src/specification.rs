//! How every unit reads its specification: the fixed String parameter `specification`.
//!
//! Empty = `resources/specification.json` of the FMU (or the model's built-in default where there is no resources
//! folder); text that starts with `{` = inline JSON; else an absolute path. Paths inside a specification are relative to its
//! folder: the file's, else the resources folder.

use crate::{Host, UnitError};
use serde::de::DeserializeOwned;
use serde_json::error::Category;
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// A parsed specification with what is needed to resolve paths in it and to save it in a state.
#[derive(Clone, Debug)]
pub struct Specification<T> {
    /// The value.
    pub value: T,
    /// The JSON text it came from.
    pub text: String,
    /// The folder that relative paths in it refer to, if there is one.
    pub folder: Option<PathBuf>,
    /// Where it came from, for messages.
    pub origin: String,
}

/// Reads the specification that `parameter` (the value of the `specification` variable) points to.
///
/// # Errors
/// [`UnitError::Input`] with the origin, the JSON path, line and column of the fault.
pub fn load<T: DeserializeOwned>(parameter: &str, default: &str, host: &Host) -> Result<Specification<T>, UnitError> {
    let given = parameter.trim_start();
    let (text, origin, folder) = if given.starts_with('{') {
        (given.to_string(), "inline specification".to_string(), host.resources.map(Path::to_path_buf))
    } else if given.is_empty() {
        match host.resources.map(|r| r.join("specification.json")).filter(|p| p.is_file()) {
            Some(path) => (read(&path)?, path.display().to_string(), host.resources.map(Path::to_path_buf)),
            None => (default.to_string(), "built-in default specification".to_string(), None),
        }
    } else {
        let path = PathBuf::from(parameter);
        if !path.is_absolute() {
            return Err(UnitError::input(format!(
                "specification '{parameter}': a unit takes an absolute path (the master resolves relative ones against the \
                 description's folder), inline JSON starting with '{{', or nothing for its default"
            )));
        }
        (read(&path)?, path.display().to_string(), path.parent().map(Path::to_path_buf))
    };
    let value = parse(&text, &origin)?;
    Ok(Specification { value, text, folder, origin })
}

/// Parses JSON text; `origin` names it in messages.
///
/// # Errors
/// [`UnitError::Input`] with the JSON path of the fault.
pub fn parse<T: DeserializeOwned>(text: &str, origin: &str) -> Result<T, UnitError> {
    let mut de = serde_json::Deserializer::from_str(text);
    let value = serde_path_to_error::deserialize(&mut de).map_err(|e| {
        let path = e.path().to_string();
        let place = if path == "." { "the top level".to_string() } else { format!("'{path}'") };
        let e = e.into_inner();
        match e.classify() {
            Category::Data => {
                UnitError::input(format!("{origin}, line {}: at {place}: {}", e.line(), in_json_terms(&bare(&e))))
            }
            _ => syntax(origin, &e),
        }
    })?;
    de.end().map_err(|e| syntax(origin, &e))?;
    Ok(value)
}

/// JSON that is no JSON: where it breaks off.
fn syntax(origin: &str, e: &serde_json::Error) -> UnitError {
    let text = match e.classify() {
        Category::Eof => "the JSON text ends too early: a closing } or ] or a quote is missing".to_string(),
        _ => format!("not valid JSON: {}", bare(e)),
    };
    UnitError::input(format!("{origin}, line {} column {}: {text}", e.line(), e.column()))
}

/// serde_json's words without its " at line 1 column 2".
fn bare(e: &serde_json::Error) -> String {
    let text = e.to_string();
    text.rsplit_once(" at line ").map_or(text.clone(), |(words, _)| words.to_string())
}

/// Names of Rust types to names of JSON's.
fn in_json_terms(text: &str) -> String {
    let mut text = text.to_string();
    for (rust, json) in [
        ("expected f64", "expected a number"),
        ("expected f32", "expected a number"),
        ("expected u8", "expected a whole number from 0"),
        ("expected u32", "expected a whole number from 0"),
        ("expected u64", "expected a whole number from 0"),
        ("expected usize", "expected a whole number from 0"),
        ("expected i32", "expected a whole number"),
        ("expected i64", "expected a whole number"),
        ("expected a borrowed string", "expected a text"),
        ("expected a string", "expected a text"),
        ("expected a sequence", "expected a list"),
        ("expected struct ", "expected an object: "),
        ("expected a map", "expected an object"),
        ("invalid type: string", "invalid type: text"),
        ("invalid type: floating point", "invalid type: number"),
        ("invalid type: sequence", "invalid type: list"),
        ("invalid type: map", "invalid type: object"),
        ("unknown variant", "unknown value"),
    ] {
        text = text.replace(rust, json);
    }
    text
}

fn read(path: &Path) -> Result<String, UnitError> {
    std::fs::read_to_string(path)
        .map_err(|e| UnitError::input(format!("specification file {}: cannot be read: {e}", path.display())))
}

/// Collects all faults of a specification, so that the user gets them at once.
#[derive(Debug, Default)]
pub struct Faults(Vec<String>);

impl Faults {
    /// No fault yet.
    pub fn new() -> Self {
        Self::default()
    }
    /// Unless `ok`: the element at JSON path `path` has value `given`, where `allowed`.
    pub fn check(&mut self, ok: bool, path: &str, given: impl Display, allowed: &str) {
        if !ok {
            self.0.push(format!("'{path}' is {given}; allowed: {allowed}"));
        }
    }
    /// A finite value greater than 0.
    pub fn positive(&mut self, path: &str, given: f64) {
        self.check(given.is_finite() && given > 0.0, path, given, "a finite number greater than 0");
    }
    /// A finite value of at least 0.
    pub fn not_negative(&mut self, path: &str, given: f64) {
        self.check(given.is_finite() && given >= 0.0, path, given, "a finite number of at least 0");
    }
    /// A value within [least, greatest].
    pub fn within(&mut self, path: &str, given: f64, least: f64, greatest: f64) {
        self.check(given >= least && given <= greatest, path, given, &format!("{least} to {greatest}"));
    }
    /// Any other fault.
    pub fn add(&mut self, text: impl Into<String>) {
        self.0.push(text.into());
    }
    /// Ok without faults.
    ///
    /// # Errors
    /// One [`UnitError::Input`] with all faults, one a line.
    pub fn into_result(self, origin: &str) -> Result<(), UnitError> {
        match self.0.len() {
            0 => Ok(()),
            1 => Err(UnitError::input(format!("{origin}: {}", self.0[0]))),
            n => Err(UnitError::input(format!("{origin}: {n} faults:\n  {}", self.0.join("\n  ")))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(serde::Deserialize, Debug)]
    #[serde(deny_unknown_fields)]
    struct Soil {
        #[allow(dead_code)]
        density: f64,
    }
    #[derive(serde::Deserialize, Debug)]
    #[serde(deny_unknown_fields)]
    struct Spec {
        #[allow(dead_code)]
        soil: Soil,
    }

    #[test]
    fn a_fault_names_its_path() {
        let e = parse::<Spec>(r#"{"soil": {"density": "heavy"}}"#, "bed.json").unwrap_err().to_string();
        assert!(e.contains("bed.json") && e.contains("soil.density") && e.contains("line 1"), "{e}");
        let e = parse::<Spec>(r#"{"soil": {"density": 1, "colour": 2}}"#, "bed.json").unwrap_err().to_string();
        assert!(e.contains("colour") && e.contains("density"), "{e}");
        let e = parse::<Spec>("{\"soil\":\n {\"density\": 1,}}", "bed.json").unwrap_err().to_string();
        assert!(e.contains("bed.json, line 2 column") && e.contains("not valid JSON"), "{e}");
        let e = parse::<Spec>("{\"soil\": {\"density\": 1", "bed.json").unwrap_err().to_string();
        assert!(e.contains("ends too early"), "{e}");
        let e = parse::<Spec>("{\"soil\": {\"density\": \"heavy\"}}", "bed.json").unwrap_err().to_string();
        assert!(e.contains("text \"heavy\"") && e.contains("expected a number"), "{e}");
    }

    #[test]
    fn relative_paths_are_refused_with_what_is_allowed() {
        let e = Host::silent(|h| load::<Spec>("bed.json", "{}", h)).unwrap_err().to_string();
        assert!(e.contains("absolute path") && e.contains("bed.json"), "{e}");
    }

    #[test]
    fn all_faults_at_once() {
        let mut f = Faults::new();
        f.positive("soil.density", -1.0);
        f.within("soil.poisson_ratio", 0.7, 0.0, 0.5);
        let e = f.into_result("bed.json").unwrap_err().to_string();
        assert!(e.contains("2 faults") && e.contains("density") && e.contains("0 to 0.5"), "{e}");
    }
}
