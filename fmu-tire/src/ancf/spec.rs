//! Specification of the flexible tire, as JSON.

use super::AncfError;
use super::laminate::{Laminate, Layer};
use super::material::Orthotropic;
use super::profile::Profile;
use super::surface::LugPlan;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The layered HMMWV tire (plies of cord and rubber), as JSON.
pub const HMMWV_LAYERED: &str = include_str!("../../data/hmmwv_ancf_layered.json");
/// The HMMWV tire with one equivalent layer per section, as JSON.
pub const HMMWV_LUMPED: &str = include_str!("../../data/hmmwv_ancf_lumped.json");

/// Elements from bead to bead at most.
const MOST_ACROSS: u64 = 120;

/// Flexible tire of ANCF shells. SI units, angles in rad; the axle is Y of the wheel's frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlexibleTire {
    /// Where the data come from. Not used by the solver.
    #[serde(default)]
    pub source: String,
    /// The rim that carries the beads.
    pub rim: Rim,
    /// Form of the cross-section.
    pub shape: Shape,
    /// Elements around the circumference, 8 to 720.
    pub divisions: u32,
    /// Sections from the bead to the crown; the other side mirrors them.
    pub sections: Vec<Section>,
    /// Materials that layers name.
    pub materials: Vec<MaterialSpec>,
    /// Inflation pressure above the surroundings (Pa).
    pub pressure: f64,
    /// Structural damping: the stress is that of strain + damping x strain rate (s). Usual 0.005 to 0.15.
    pub damping: f64,
    /// Surface of the tire, and its own contact with a rigid plane.
    #[serde(default)]
    pub contact: Contact,
    /// Bars on the tread; null for a smooth tire.
    #[serde(default)]
    pub lugs: Option<Lugs>,
    /// Time integration.
    #[serde(default)]
    pub integrator: Integrator,
}

/// Rim.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rim {
    /// Radius from which the profile's radial offsets count (m).
    pub radius: f64,
    /// Width between the beads; of the toroid's form only, else for information (m).
    pub width: f64,
}

/// Form of the cross-section.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// Rows [t (1), radial offset from the rim radius (m), axial position (m)], t from 0 at one bead to 1 at the other; cubic splines.
    Profile(Vec<[f64; 3]>),
    /// Half an ellipse over the rim's width.
    Toroid {
        /// Height above the rim radius (m).
        height: f64,
    },
}

/// Elements with the same layers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Name, for messages: bead, sidewall, tread.
    pub name: String,
    /// Elements across, on one side of the tire; 60 in all sections.
    pub elements: u32,
    /// Layers from the inside to the outside.
    pub layers: Vec<LayerSpec>,
}

/// One layer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerSpec {
    /// Thickness (m).
    pub thickness: f64,
    /// Angle of the fibres from the circumferential direction, about the outward normal (rad).
    pub angle: f64,
    /// Name of the material.
    pub material: String,
}

/// An orthotropic material from engineering constants; 1 along the fibre, 2 in the plane, 3 normal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialSpec {
    /// Name.
    pub name: String,
    /// Density (kg/m3).
    pub density: f64,
    /// Young's moduli E1, E2, E3 (Pa).
    pub young: [f64; 3],
    /// Poisson's ratios nu12, nu13, nu23 (1).
    pub poisson: [f64; 3],
    /// Shear moduli G12, G13, G23 (Pa).
    pub shear: [f64; 3],
}

/// Surface and penalty contact with a rigid plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Contact {
    /// Coefficient of friction (1).
    pub friction: f64,
    /// Coefficient of restitution, for the terrain's contact (1).
    pub restitution: f64,
    /// Young's modulus of the surface, for the terrain's contact (Pa).
    pub young_modulus: f64,
    /// Poisson's ratio of the surface, for the terrain's contact (1).
    pub poisson_ratio: f64,
    /// Normal stiffness of a node on the plane (N/m).
    pub normal_stiffness: f64,
    /// Normal damping of a node on the plane (N s/m).
    pub normal_damping: f64,
    /// Tangential stiffness of a sticking node (N/m).
    pub tangential_stiffness: f64,
}

impl Default for Contact {
    fn default() -> Self {
        Self {
            friction: 0.9,
            restitution: 0.1,
            young_modulus: 2e6,
            poisson_ratio: 0.3,
            normal_stiffness: 2e6,
            normal_damping: 13.0,
            tangential_stiffness: 1e6,
        }
    }
}

/// Bars on the tread, from one shoulder to the other: the last section's elements raised along their directors. The ground feels them; the
/// shells carry them (their mass belongs to the layers).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Lugs {
    /// How many around; a divisor of `divisions`.
    pub count: u32,
    /// Height above the shell, at most 0.2 (m).
    pub height: f64,
    /// Elements along the circumference that one covers; less than `divisions` over `count`.
    pub elements: u32,
    /// Whether the right half is set off by half a pitch.
    #[serde(default)]
    pub staggered: bool,
}

/// Time integration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Integrator {
    /// Numerical damping of the HHT method, -1/3 to 0 (1).
    pub alpha: f64,
    /// Largest inner step, 1e-7 to 0.1 (s).
    pub step: f64,
    /// Newton stops when no material point will move further than this (m).
    pub tolerance: f64,
    /// Newton iterations before the tangent is renewed, and again before the step is halved; 2 to 1000.
    pub iterations: u32,
}

impl Default for Integrator {
    fn default() -> Self {
        Self { alpha: -0.2, step: 4e-5, tolerance: 1e-7, iterations: 12 }
    }
}

impl FlexibleTire {
    /// A tire of one layer with an elliptic section, for tests: `across` elements from bead to bead (even).
    pub fn toroid(
        rim_radius: f64,
        width: f64,
        height: f64,
        thickness: f64,
        material: Orthotropic,
        divisions: u32,
        across: u32,
    ) -> Self {
        Self {
            source: String::new(),
            rim: Rim { radius: rim_radius, width },
            shape: Shape::Toroid { height },
            divisions,
            sections: vec![Section {
                name: "all".into(),
                elements: across / 2,
                layers: vec![LayerSpec { thickness, angle: 0.0, material: "rubber".into() }],
            }],
            materials: vec![MaterialSpec {
                name: "rubber".into(),
                density: material.density,
                young: material.young,
                poisson: material.poisson,
                shear: material.shear,
            }],
            pressure: 2e5,
            damping: 0.01,
            contact: Contact::default(),
            lugs: None,
            integrator: Integrator::default(),
        }
    }

    /// Elements from bead to bead.
    pub fn across(&self) -> usize {
        2 * self.sections.iter().map(|s| s.elements as usize).sum::<usize>()
    }

    /// Where lugs stand.
    ///
    /// # Errors
    /// [`AncfError::Input`] if they do not fit the mesh.
    pub(super) fn lug_plan(&self) -> Result<Option<LugPlan<'_>>, AncfError> {
        let across = self.across();
        let tread = self.sections.last().map_or(0, |s| s.elements as usize);
        let plan = |lugs| LugPlan::new(lugs, self.divisions as usize, across, across / 2 - tread);
        self.lugs.as_ref().map(plan).transpose()
    }

    /// The profile.
    ///
    /// # Errors
    /// [`AncfError::Input`], see [`Profile::new`].
    pub fn profile(&self) -> Result<Profile, AncfError> {
        match &self.shape {
            Shape::Profile(points) => Profile::new(points),
            Shape::Toroid { height } => Profile::half_ellipse(*height, self.rim.width),
        }
    }

    /// Laminates of the sections, in their order.
    ///
    /// # Errors
    /// [`AncfError::Input`] with all faults of the whole specification.
    pub fn laminates(&self) -> Result<Vec<Laminate>, AncfError> {
        let mut faults = self.own_faults();
        if self.sections.iter().map(|s| u64::from(s.elements)).sum::<u64>() > MOST_ACROSS / 2 {
            // What follows counts elements in machine numbers.
            return Err(AncfError::Input(faults));
        }
        let mut laminates = Vec::new();
        for section in &self.sections {
            let mut layers = Vec::new();
            for layer in &section.layers {
                match self.materials.iter().find(|m| m.name == layer.material) {
                    Some(m) => layers.push(Layer {
                        thickness: layer.thickness,
                        angle: layer.angle,
                        material: Orthotropic {
                            density: m.density,
                            young: m.young,
                            poisson: m.poisson,
                            shear: m.shear,
                        },
                    }),
                    None => faults.push(format!(
                        "section '{}': no material is called '{}'; there are: {}",
                        section.name,
                        layer.material,
                        self.materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>().join(", ")
                    )),
                }
            }
            let laminate = Laminate { layers };
            faults.extend(laminate.faults().into_iter().map(|f| format!("section '{}': {f}", section.name)));
            laminates.push(laminate);
        }
        for own in [self.profile().err(), self.lug_plan().err()] {
            if let Some(AncfError::Input(list)) = own {
                faults.extend(list);
            }
        }
        if faults.is_empty() { Ok(laminates) } else { Err(AncfError::Input(faults)) }
    }

    fn own_faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        let mut check = |ok: bool, name: &str, given: f64, allowed: &str| {
            if !ok || !given.is_finite() {
                faults.push(format!("'{name}' is {given}; allowed: {allowed}"));
            }
        };
        check(self.rim.radius > 0.0, "rim.radius", self.rim.radius, "positive, m");
        check(self.rim.width > 0.0, "rim.width", self.rim.width, "positive, m");
        check((8..=720).contains(&self.divisions), "divisions", f64::from(self.divisions), "8 to 720");
        check(self.pressure >= 0.0, "pressure", self.pressure, "not negative, Pa");
        check(self.damping >= 0.0, "damping", self.damping, "not negative, s");
        let c = &self.contact;
        check(c.friction >= 0.0, "contact.friction", c.friction, "not negative");
        check((0.0..=1.0).contains(&c.restitution), "contact.restitution", c.restitution, "0 to 1");
        check(c.young_modulus > 0.0, "contact.young_modulus", c.young_modulus, "positive, Pa");
        check(
            c.poisson_ratio > -1.0 && c.poisson_ratio <= 0.5,
            "contact.poisson_ratio",
            c.poisson_ratio,
            "above -1, at most 0.5",
        );
        check(c.normal_stiffness > 0.0, "contact.normal_stiffness", c.normal_stiffness, "positive, N/m");
        check(c.normal_damping >= 0.0, "contact.normal_damping", c.normal_damping, "not negative, N s/m");
        check(
            c.tangential_stiffness >= 0.0,
            "contact.tangential_stiffness",
            c.tangential_stiffness,
            "not negative, N/m",
        );
        let i = &self.integrator;
        check((-1.0 / 3.0..=0.0).contains(&i.alpha), "integrator.alpha", i.alpha, "-1/3 to 0");
        check((1e-7..=0.1).contains(&i.step), "integrator.step", i.step, "1e-7 to 0.1 s");
        check(i.tolerance > 0.0, "integrator.tolerance", i.tolerance, "positive, m");
        check((2..=1000).contains(&i.iterations), "integrator.iterations", f64::from(i.iterations), "2 to 1000");
        if self.sections.is_empty() || self.sections.iter().any(|s| s.elements == 0) {
            faults.push("'sections' must name at least one section, each with at least one element across".into());
        }
        // Before anything of that size is made: memory that is not there ends the whole process.
        let half: u64 = self.sections.iter().map(|s| u64::from(s.elements)).sum();
        if half > MOST_ACROSS / 2 {
            faults
                .push(format!("'sections' have {half} elements on one side of the tire; allowed: {}", MOST_ACROSS / 2));
        }
        for (k, material) in self.materials.iter().enumerate() {
            if self.materials[..k].iter().any(|m| m.name == material.name) {
                faults.push(format!("'materials': two are called '{}'; allowed: names of their own", material.name));
            }
        }
        faults
    }
}

/// Reads a specification.
///
/// # Errors
/// [`AncfError::Input`] with line and column of a fault of syntax, else with all faults of content.
pub fn parse(text: &str) -> Result<FlexibleTire, AncfError> {
    let spec: FlexibleTire =
        serde_json::from_str(text).map_err(|e| AncfError::Input(vec![format!("specification: {e}")]))?;
    spec.laminates()?;
    Ok(spec)
}
