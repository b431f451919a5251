//! `cargo xtask systems`: the system descriptions of vehicle studies, written from the variable tables of the units.
//!
//! A vehicle on four tires on a terrain has hundreds of connectors and connections, the same in every study: they are written here once. What differs between
//! studies stands in their specifications (JSON, by hand) and in [`Study`]. A test compares the committed files with what the code writes.

use crate::process::root;
use anyhow::{Context, Result, bail};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use terramech_fmi2::Model;

mod handling;
mod on_soil;
mod study;

pub use study::Study;

/// Wheels of a study.
const WHEELS: usize = 4;
const XYZ: [&str; 3] = ["x", "y", "z"];

/// All studies that are written.
pub fn studies() -> Vec<Study> {
    handling::studies().into_iter().chain(on_soil::studies()).collect()
}

/// Writes every description that differs.
///
/// # Errors
/// A variable that no model has, or a file that cannot be written.
pub fn systems() -> Result<()> {
    for study in studies() {
        let path = root().join(study.file);
        let text = study.text()?;
        if std::fs::read_to_string(&path).ok().as_deref() != Some(&text) {
            std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
            eprintln!("   {}", path.display());
        }
    }
    Ok(())
}

/// A component as it is written.
struct Component {
    name: String,
    model: Model,
    parameters: Vec<(String, String)>,
    /// Connectors in use.
    used: BTreeSet<u32>,
}

impl Component {
    fn new(name: impl Into<String>, model: &str, parameters: Vec<(String, String)>) -> Result<Self> {
        let name = name.into();
        let model = crate::pack::libraries()
            .into_iter()
            .flat_map(|l| l.models)
            .find(|m| m.name == model)
            .with_context(|| format!("there is no model '{model}'"))?;
        let mut c = Self { name, model, parameters, used: BTreeSet::new() };
        for (p, _) in c.parameters.clone() {
            c.take(&p)?;
        }
        Ok(c)
    }
    fn take(&mut self, connector: &str) -> Result<()> {
        let Some((vr, v)) = self.model.table.find(connector) else {
            bail!("{} has no variable '{connector}'", self.model.name);
        };
        // Arrays have no connectors in SSP 1.0.
        if !v.start.is_array() {
            self.used.insert(vr);
        }
        Ok(())
    }
}

impl Component {
    fn write(&self, o: &mut String, units: &mut BTreeSet<&'static str>) -> Result<()> {
        writeln!(
            o,
            r#"      <ssd:Component name="{}" type="application/x-fmu-sharedlibrary" source="{}.fmu">"#,
            self.name,
            self.model.file_name()
        )?;
        o.push_str("        <ssd:Connectors>\n");
        for vr in &self.used {
            let v = &self.model.table.variables()[*vr as usize];
            let unit = if v.unit.is_empty() { String::new() } else { format!(" unit=\"{}\"", v.unit) };
            if !v.unit.is_empty() {
                units.insert(v.unit);
            }
            writeln!(
                o,
                r#"          <ssd:Connector name="{}" kind="{}"><ssc:{}{unit}/></ssd:Connector>"#,
                v.name,
                v.causality.word(),
                v.start.type_name()
            )?;
        }
        o.push_str("        </ssd:Connectors>\n");
        if !self.parameters.is_empty() {
            o.push_str("        <ssd:ParameterBindings>\n          <ssd:ParameterBinding>\n            <ssd:ParameterValues>\n");
            writeln!(o, r#"              <ssv:ParameterSet version="1.0" name="{}">"#, self.name)?;
            o.push_str("                <ssv:Parameters>\n");
            for (name, value) in &self.parameters {
                writeln!(o, r#"                  <ssv:Parameter name="{name}">{value}</ssv:Parameter>"#)?;
            }
            o.push_str("                </ssv:Parameters>\n              </ssv:ParameterSet>\n            </ssd:ParameterValues>\n");
            o.push_str("          </ssd:ParameterBinding>\n        </ssd:ParameterBindings>\n");
        }
        o.push_str("      </ssd:Component>\n");
        Ok(())
    }
}

/// Exponents of a unit's base units, as attributes.
fn base_unit(unit: &str) -> Result<&'static str> {
    Ok(match unit {
        "1" => "",
        "J" => r#" kg="1" m="2" s="-2""#,
        "N" => r#" kg="1" m="1" s="-2""#,
        "N.m" => r#" kg="1" m="2" s="-2""#,
        "Pa" => r#" kg="1" m="-1" s="-2""#,
        "kg" => r#" kg="1""#,
        "kg.m2" => r#" kg="1" m="2""#,
        "m" => r#" m="1""#,
        "m2" => r#" m="2""#,
        "m/s" => r#" m="1" s="-1""#,
        "m/s2" => r#" m="1" s="-2""#,
        "rad" => r#" rad="1""#,
        "rad/s" => r#" rad="1" s="-1""#,
        "rad/s2" => r#" rad="1" s="-2""#,
        "s" => r#" s="1""#,
        other => bail!("unit '{other}' has no base units here"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn committed_systems_are_what_the_code_writes() {
        for study in studies() {
            let found = std::fs::read_to_string(root().join(study.file)).unwrap_or_default();
            assert!(found == study.text().unwrap(), "{} is out of date: run `cargo xtask systems`", study.file);
        }
    }
}
