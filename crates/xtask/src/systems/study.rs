//! A study of a vehicle on four tires on a terrain, and its text.

use super::{Component, WHEELS, XYZ, base_unit};
use anyhow::{Context, Result};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// What tires and ground exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Touch {
    /// The tires ask the ground at so many points each and make their own forces.
    Probes(usize),
    /// The tires' meshes go to the ground, forces on their vertices come back.
    Mesh,
}

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
    /// What tires and ground exchange.
    pub touch: Touch,
    /// Model and specification of the terrain.
    pub terrain: [&'static str; 2],
    /// Communication step and end (s).
    pub time: [f64; 2],
    /// Time between rows of the results (s).
    pub every: f64,
    /// Time between values that cost a sum over everything (s).
    pub seldom: f64,
    /// Time between frames for pictures (s); 0: none.
    pub frames: f64,
    /// Whether the terrain has obstacles that are to be drawn.
    pub obstacle: bool,
    /// Headline results.
    pub summary: &'static [Headline],
}

/// A headline: name, element, connector, window of the mean (s).
pub type Headline = (&'static str, &'static str, &'static str, [f64; 2]);

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
fn recorded_vehicle(touch: Touch) -> Vec<String> {
    let mut names: Vec<String> = XYZ.map(|a| format!("chassis.position.{a}")).to_vec();
    if touch == Touch::Mesh {
        names.extend(["w", "x", "y", "z"].map(|a| format!("chassis.orientation.{a}")));
        names.push("engine.torque".into());
        let energies = ["engine_work", "wheel_work", "kinetic_energy", "potential_energy", "dissipated_energy"];
        names.extend(energies.map(String::from));
    }
    names.extend(
        ["speed", "lateral_acceleration", "yaw_rate", "roll", "pitch", "engine.speed", "gear"].map(String::from),
    );
    names.extend(["steering", "throttle", "braking"].map(|n| format!("driver_used.{n}")));
    for i in 1..=WHEELS {
        names.extend(["spin", "force.z", "axle_torque"].map(|n| format!("wheel[{i}].{n}")));
        if touch == Touch::Mesh {
            names.extend(["force.x", "position.x", "position.z"].map(|n| format!("wheel[{i}].{n}")));
        }
    }
    names
}

/// A link between two components: from a variable of one to a variable of the other.
type Link = (usize, String, usize, String);

/// Everything between the components.
#[derive(Default)]
struct Wiring {
    links: Vec<Link>,
    arrays: Vec<Link>,
    /// Component, variable, period (s) where it is not the study's own.
    recorded: Vec<(usize, String, Option<f64>)>,
}

impl Study {
    /// The file's text.
    ///
    /// # Errors
    /// A variable that no model has.
    pub fn text(&self) -> Result<String> {
        let mut components = self.components()?;
        let wiring = self.wiring(components.len() - 1);
        for (a, from, b, to) in wiring.links.iter().chain(&wiring.arrays) {
            components[*a].take(from)?;
            components[*b].take(to)?;
        }
        for (c, n, _) in &wiring.recorded {
            components[*c].take(n)?;
        }
        for (_, element, connector, _) in self.summary {
            let c = components.iter_mut().find(|c| c.name == *element).context("summary of no element")?;
            c.take(connector)?;
        }
        self.write(&components, &wiring)
    }

    /// Vehicle, tires, terrain: in this order.
    fn components(&self) -> Result<Vec<Component>> {
        let text = |s: &str| format!("<ssv:String value=\"{s}\"/>");
        let spec = |file: &str| if file.is_empty() { vec![] } else { vec![("specification".to_string(), text(file))] };
        let mut components = vec![Component::new("vehicle", self.vehicle[0], spec(self.vehicle[1]))?];
        for i in 1..=WHEELS {
            let mut p = spec(self.tire[1]);
            if let Touch::Probes(n) = self.touch {
                let side = if i % 2 == 1 { 1 } else { -1 };
                p.push(("side".into(), format!("<ssv:Real value=\"{side}\" unit=\"1\"/>")));
                if n > 1 {
                    p.push(("probe_count".into(), format!("<ssv:Integer value=\"{n}\"/>")));
                }
            }
            components.push(Component::new(format!("tire{i}"), self.tire[0], p)?);
        }
        let mut p = spec(self.terrain[1]);
        if self.touch == Touch::Mesh {
            p.extend((1..=WHEELS).map(|i| (format!("body[{i}].shape"), text("mesh"))));
        }
        components.push(Component::new("terrain", self.terrain[0], p)?);
        Ok(components)
    }

    fn wiring(&self, terrain: usize) -> Wiring {
        let mut w = Wiring::default();
        let (links, arrays) = (&mut w.links, &mut w.arrays);
        for i in 1..=WHEELS {
            let w = |n: &str| format!("wheel[{i}].{n}");
            let body = |n: &str| format!("body[{i}].{n}");
            links.extend(state().iter().map(|n| (0, w(n), i, format!("wheel.{n}"))));
            links.extend(wrench().iter().map(|n| (i, format!("wheel.{n}"), 0, w(n))));
            links.push((i, "radius".into(), 0, w("tire_radius")));
            links.push((i, "hub.mass".into(), 0, w("hub_mass")));
            for a in ["xx", "yy", "zz"] {
                links.push((i, format!("hub.inertia.{a}"), 0, w(&format!("hub_inertia.{a}"))));
            }
            match self.touch {
                Touch::Probes(_) => {
                    arrays.push((i, "probe.position".into(), terrain, body("probe.position")));
                    let answers = ["height", "normal", "friction"].map(|n| format!("probe.{n}"));
                    arrays.extend(answers.into_iter().map(|n| (terrain, body(&n), i, n)));
                }
                Touch::Mesh => {
                    let of_surface = ["friction", "restitution", "young_modulus", "poisson_ratio"];
                    let of_surface = of_surface.map(|n| format!("material.{n}"));
                    links.extend(of_surface.into_iter().map(|n| (i, n.clone(), terrain, body(&n))));
                    let of_mesh = ["position", "velocity", "triangle"];
                    arrays.extend(of_mesh.map(|n| (i, format!("mesh.{n}"), terrain, body(n))));
                    let back = ["contact.index", "contact.force"];
                    arrays.extend(back.map(|n| (terrain, body(n), i, n.to_string())));
                }
            }
        }
        links.push((terrain, "height".into(), 0, "ground_height".into()));
        w.recorded = recorded_vehicle(self.touch).into_iter().map(|n| (0, n, None)).collect();
        for i in 1..=WHEELS {
            let names: &[&str] = match self.touch {
                Touch::Probes(_) => &["load", "deflection", "slip.kappa", "slip.tan_alpha"],
                Touch::Mesh => &["deflection", "patch_area"],
            };
            w.recorded.extend(names.iter().map(|n| (i, n.to_string(), None)));
            if self.touch == Touch::Mesh {
                w.recorded.extend(XYZ.map(|a| (terrain, format!("body[{i}].force.{a}"), None)));
                // Energies are sums over everything: seldom.
                let energies = ["strain_energy", "kinetic_energy", "dissipated_energy", "pressure_work", "ground_work"];
                w.recorded.extend(energies.map(|n| (i, n.to_string(), Some(self.seldom))));
            }
        }
        if self.touch == Touch::Mesh {
            let names = ["kinetic_energy", "dissipated_energy", "body_work", "contact_count", "height"];
            w.recorded.extend(names.map(|n| (terrain, n.to_string(), Some(self.seldom))));
        }
        w
    }

    fn write(&self, components: &[Component], wiring: &Wiring) -> Result<String> {
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
        let link = |o: &mut String, tag: &str, (a, from, b, to): &Link| {
            writeln!(
                o,
                r#"<{tag} startElement="{}" startConnector="{from}" endElement="{}" endConnector="{to}"/>"#,
                components[*a].name, components[*b].name
            )
        };
        for l in &wiring.links {
            o += "      ";
            link(&mut o, "ssd:Connection", l)?;
        }
        o += "    </ssd:Connections>\n    <ssd:Annotations>\n      <ssc:Annotation type=\"org.terramech\">\n";
        o += "        <tm:System xmlns:tm=\"http://terramech.org/SSP1/Annotations\">\n";
        for l in &wiring.arrays {
            o += "          ";
            link(&mut o, "tm:ArrayConnection", l)?;
        }
        if self.touch == Touch::Mesh {
            bonds(&mut o)?;
        }
        writeln!(o, "          <tm:Recording every=\"{}\">", self.every)?;
        for (c, n, every) in &wiring.recorded {
            let every = every.map_or_else(String::new, |x| format!(r#" every="{x}""#));
            writeln!(o, r#"            <tm:Scalars element="{}" connector="{n}"{every}/>"#, components[*c].name)?;
        }
        if self.frames > 0.0 {
            self.datasets(&mut o)?;
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

    /// Frames for pictures: grains, tires, obstacles.
    fn datasets(&self, o: &mut String) -> Result<()> {
        let every = self.frames;
        writeln!(
            o,
            r#"            <tm:Dataset name="bed" element="terrain" position="grain.position" every="{every}">
              <tm:Field name="id" array="grain.id"/>
              <tm:Field name="radius" array="grain.radius"/>
              <tm:Field name="velocity" array="grain.velocity"/>
            </tm:Dataset>"#
        )?;
        for i in 1..=WHEELS {
            writeln!(
                o,
                r#"            <tm:Dataset name="tire{i}" element="tire{i}" position="mesh.position" triangle="mesh.triangle" every="{every}">
              <tm:Field name="force" element="terrain" array="body[{i}].contact.force" index="body[{i}].contact.index"/>
              <tm:Field name="strain" array="mesh.vertex_strain"/>
            </tm:Dataset>"#
            )?;
        }
        if self.obstacle {
            writeln!(
                o,
                r#"            <tm:Dataset name="obstacle" element="terrain" position="obstacle.mesh.position" triangle="obstacle.mesh.triangle" every="{every}"/>"#
            )?;
        }
        Ok(())
    }
}

/// Wheel forces and velocities as power bonds: their energy residual is the coupling's.
fn bonds(o: &mut String) -> Result<()> {
    for i in 1..=WHEELS {
        writeln!(o, r#"          <tm:PowerBond name="wheel{i}" efforts="mean">"#)?;
        for (effort, flow) in [("force", "velocity"), ("moment", "angular_velocity")] {
            for a in XYZ {
                writeln!(
                    o,
                    r#"            <tm:Pair effortElement="tire{i}" effortConnector="wheel.{effort}.{a}" flowElement="vehicle" flowConnector="wheel[{i}].{flow}.{a}"/>"#
                )?;
            }
        }
        writeln!(o, "          </tm:PowerBond>")?;
    }
    Ok(())
}
