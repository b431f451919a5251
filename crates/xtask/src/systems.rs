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

/// Wheels of a study.
const WHEELS: usize = 4;
const XYZ: [&str; 3] = ["x", "y", "z"];

/// A vehicle on four tires on a terrain.
pub struct Study {
    /// File, relative to the project's root.
    pub file: &'static str,
    /// One sentence.
    pub description: &'static str,
    /// Model and specification of the vehicle.
    pub vehicle: [&'static str; 2],
    /// Model and specification of the tires ("" for the default).
    pub tire: [&'static str; 2],
    /// Points at which each tire asks the ground.
    pub probes: usize,
    /// Model and specification of the terrain.
    pub terrain: [&'static str; 2],
    /// Communication step and end (s).
    pub time: [f64; 2],
    /// Time between rows of the results (s).
    pub every: f64,
    /// Headline results.
    pub summary: &'static [Headline],
}

/// A headline: name, element, connector, window of the mean (s).
pub type Headline = (&'static str, &'static str, &'static str, [f64; 2]);

/// All studies that are written.
pub fn studies() -> Vec<Study> {
    handling::studies()
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

/// Names of a state's scalars after its prefix.
fn state() -> Vec<String> {
    let mut names: Vec<String> = XYZ.map(|a| format!("position.{a}")).to_vec();
    names.extend(["w", "x", "y", "z"].map(|a| format!("orientation.{a}")));
    for v in ["velocity", "angular_velocity"] {
        names.extend(XYZ.map(|a| format!("{v}.{a}")));
    }
    names
}

fn wrench() -> Vec<String> {
    ["force", "moment"].iter().flat_map(|v| XYZ.map(|a| format!("{v}.{a}"))).collect()
}

/// The scalars of a vehicle that are recorded.
fn recorded_vehicle() -> Vec<String> {
    let mut names: Vec<String> = XYZ.map(|a| format!("chassis.position.{a}")).to_vec();
    names.extend(
        ["speed", "lateral_acceleration", "yaw_rate", "roll", "pitch", "engine.speed", "gear"].map(String::from),
    );
    names.extend(["steering", "throttle", "braking"].map(|n| format!("driver_used.{n}")));
    for i in 1..=WHEELS {
        names.extend(["spin", "force.z", "axle_torque"].map(|n| format!("wheel[{i}].{n}")));
    }
    names
}

impl Study {
    /// The file's text.
    ///
    /// # Errors
    /// A variable that no model has.
    pub fn text(&self) -> Result<String> {
        let text = |s: &str| format!("<ssv:String value=\"{s}\"/>");
        let integer = |n: usize| format!("<ssv:Integer value=\"{n}\"/>");
        let spec = |file: &str| if file.is_empty() { vec![] } else { vec![("specification".to_string(), text(file))] };
        let mut components = vec![Component::new("vehicle", self.vehicle[0], spec(self.vehicle[1]))?];
        for i in 1..=WHEELS {
            let mut p = spec(self.tire[1]);
            p.push(("side".into(), format!("<ssv:Real value=\"{}\" unit=\"1\"/>", if i % 2 == 1 { 1 } else { -1 })));
            if self.probes > 1 {
                p.push(("probe_count".into(), integer(self.probes)));
            }
            components.push(Component::new(format!("tire{i}"), self.tire[0], p)?);
        }
        components.push(Component::new("terrain", self.terrain[0], spec(self.terrain[1]))?);
        let terrain = components.len() - 1;

        let mut links: Vec<(usize, String, usize, String)> = Vec::new();
        let mut arrays: Vec<(usize, String, usize, String)> = Vec::new();
        for i in 1..=WHEELS {
            let w = |n: &str| format!("wheel[{i}].{n}");
            links.extend(state().iter().map(|n| (0, w(n), i, format!("wheel.{n}"))));
            links.extend(wrench().iter().map(|n| (i, format!("wheel.{n}"), 0, w(n))));
            links.push((i, "radius".into(), 0, w("tire_radius")));
            links.push((i, "hub.mass".into(), 0, w("hub_mass")));
            for a in ["xx", "yy", "zz"] {
                links.push((i, format!("hub.inertia.{a}"), 0, w(&format!("hub_inertia.{a}"))));
            }
            arrays.push((i, "probe.position".into(), terrain, format!("body[{i}].probe.position")));
            for n in ["height", "normal", "friction"] {
                arrays.push((terrain, format!("body[{i}].probe.{n}"), i, format!("probe.{n}")));
            }
        }
        links.push((terrain, "height".into(), 0, "ground_height".into()));
        for (a, from, b, to) in links.iter().chain(&arrays) {
            components[*a].take(from)?;
            components[*b].take(to)?;
        }
        let mut recorded: Vec<(usize, String)> = recorded_vehicle().into_iter().map(|n| (0, n)).collect();
        for i in 1..=WHEELS {
            let names = ["load", "deflection", "slip.kappa", "slip.tan_alpha"];
            recorded.extend(names.map(|n| (i, n.to_string())));
        }
        for (c, n) in &recorded {
            components[*c].take(n)?;
        }
        for (_, element, connector, _) in self.summary {
            let c = components.iter_mut().find(|c| c.name == *element).context("summary of no element")?;
            c.take(connector)?;
        }
        self.write(&components, &links, &arrays, &recorded)
    }

    fn write(
        &self,
        components: &[Component],
        links: &[(usize, String, usize, String)],
        arrays: &[(usize, String, usize, String)],
        recorded: &[(usize, String)],
    ) -> Result<String> {
        let name = std::path::Path::new(self.file).file_stem().context("a file name")?.to_string_lossy();
        let mut o = format!(
            r#"<?xml version="1.0" encoding="UTF-8"?>
<!-- Written by `cargo xtask systems`. -->
<ssd:SystemStructureDescription version="1.0" name="{name}"
    xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
    xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
    xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"
    description="{}">
  <ssd:System name="{}">
    <ssd:Elements>
"#,
            self.description,
            name.replace('-', "_")
        );
        let mut units: BTreeSet<&str> = BTreeSet::new();
        for c in components {
            c.write(&mut o, &mut units)?;
        }
        o += "    </ssd:Elements>\n    <ssd:Connections>\n";
        let link = |o: &mut String, tag: &str, (a, from, b, to): &(usize, String, usize, String)| {
            writeln!(
                o,
                r#"<{tag} startElement="{}" startConnector="{from}" endElement="{}" endConnector="{to}"/>"#,
                components[*a].name, components[*b].name
            )
        };
        for l in links {
            o += "      ";
            link(&mut o, "ssd:Connection", l)?;
        }
        o += "    </ssd:Connections>\n    <ssd:Annotations>\n      <ssc:Annotation type=\"org.terramech\">\n";
        o += "        <tm:System xmlns:tm=\"http://terramech.org/SSP1/Annotations\">\n";
        for l in arrays {
            o += "          ";
            link(&mut o, "tm:ArrayConnection", l)?;
        }
        writeln!(o, "          <tm:Recording every=\"{}\">", self.every)?;
        for (c, n) in recorded {
            writeln!(o, r#"            <tm:Scalars element="{}" connector="{n}"/>"#, components[*c].name)?;
        }
        o += "          </tm:Recording>\n          <tm:Summary>\n";
        for (label, element, connector, [a, b]) in self.summary {
            writeln!(
                o,
                r#"            <tm:Item name="{label}" element="{element}" connector="{connector}" from="{a}" to="{b}"/>"#
            )?;
        }
        o += "          </tm:Summary>\n        </tm:System>\n      </ssc:Annotation>\n    </ssd:Annotations>\n  </ssd:System>\n  <ssd:Units>\n";
        for u in units {
            writeln!(o, r#"    <ssc:Unit name="{u}"><ssc:BaseUnit{}/></ssc:Unit>"#, base_unit(u)?)?;
        }
        let [step, stop] = self.time;
        write!(
            o,
            r#"  </ssd:Units>
  <ssd:DefaultExperiment startTime="0" stopTime="{stop}">
    <ssd:Annotations>
      <ssc:Annotation type="com.opensimulationplatform">
        <osp:Algorithm xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations">
          <osp:FixedStepAlgorithm baseStepSize="{step}"/>
        </osp:Algorithm>
      </ssc:Annotation>
    </ssd:Annotations>
  </ssd:DefaultExperiment>
</ssd:SystemStructureDescription>
"#
        )?;
        Ok(o)
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
