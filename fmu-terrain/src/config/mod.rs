//! The specification, common to all terrains: `soil`, `bed` and `bodies` are read by every model; `dem_p`, `dem_c`, `scm` and
//! `rigid` are checked by every model and used by one, so that a study swaps the terrain by changing one attribute.
//!
//! [`Terrain`] is what serde reads; [`Terrain::check`] reports every fault at once.

mod bed;
pub mod dem_p;
pub mod obstacles;
mod other;
pub mod pairs;
pub mod platform;

pub use crate::dem::Settle;
pub use crate::rigid::config::Rigid;
pub use bed::{AdhesionOnset, Bed, CompactionOf, Fill, PlacingOf};
pub use dem_p::DemP;
pub use obstacles::{Obstacle, ObstacleShape};
pub use other::{Contacts, DemC, Scm, Solver};
pub use pairs::{MaterialName, PairValues};
pub use platform::Platform;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::UnitError;
use terramech_fmi2::specification::Faults;

/// Most grains of a bed: about 20 GB of state.
pub const GREATEST_COUNT: usize = 50_000_000;

/// Bodies that a terrain takes.
pub const BODIES: usize = 8;

/// Terrain: soil in a box, and bodies in it. SI units; x forward, y left, z up; the floor of the box is at z = 0 and its
/// centre at x = y = 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Terrain {
    /// The soil's grains.
    pub soil: Soil,
    /// The box and what is in it.
    pub bed: Bed,
    /// Surface of bodies that do not say their own.
    pub bodies: Bodies,
    /// Rigid bodies that are free to move; used by terrain_dem_p.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub obstacles: Vec<Obstacle>,
    /// What is handed out for recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub output: Option<Output>,
    /// Penalty granular model: used by terrain_dem_p.
    pub dem_p: DemP,
    /// Complementarity granular model: used by terrain_dem_c.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dem_c: Option<DemC>,
    /// Soil contact model: used by terrain_scm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scm: Option<Scm>,
    /// Rigid ground: used by terrain_rigid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rigid: Option<Rigid>,
}

/// What is handed out for recording.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Least x, y, z of the grains in the arrays grain.* (m).
    pub low: [f64; 3],
    /// Greatest x, y, z (m).
    pub high: [f64; 3],
}

/// Material and size of the grains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Soil {
    /// Radii of the grains.
    pub radius: Radius,
    /// Density of a grain (kg/m3), which is the bulk density over the packing fraction.
    pub density: f64,
    /// Coulomb friction between grains (1).
    pub friction: f64,
    /// Coefficient of restitution, 0 to 1 (1).
    pub restitution: f64,
    /// Young's modulus (Pa). Usually far below the mineral's, so that the step can be large: overlaps of 1 % of the radius
    /// do no harm.
    pub young_modulus: f64,
    /// Poisson's ratio, above -1, at most 0.5 (1).
    pub poisson_ratio: f64,
    /// Rolling friction: limit torque over effective radius and normal force (1).
    pub rolling_friction: f64,
    /// Spinning (torsional) friction, likewise (1).
    pub spinning_friction: f64,
    /// What pulls grains together.
    pub adhesion: Adhesion,
    /// Grains of other kinds, mixed in or in layers; their shares are of the number of grains.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub species: Vec<SpeciesOf>,
}

impl Default for Soil {
    fn default() -> Self {
        Self {
            radius: Radius::Uniform { least: 0.0054, greatest: 0.0066 },
            density: 2500.0,
            friction: 0.7,
            restitution: 0.2,
            young_modulus: 2e6,
            poisson_ratio: 0.3,
            rolling_friction: 0.1,
            spinning_friction: 0.05,
            adhesion: Adhesion::default(),
            species: Vec::new(),
        }
    }
}

/// Radii of the grains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Radius {
    /// All the same (m).
    Equal(f64),
    /// Uniformly distributed between two radii.
    Uniform {
        /// Least (m).
        least: f64,
        /// Greatest (m).
        greatest: f64,
    },
    /// Normally distributed, cut off on both sides.
    Normal {
        /// Mean (m).
        mean: f64,
        /// Standard deviation (m).
        deviation: f64,
        /// Least (m).
        least: f64,
        /// Greatest (m).
        greatest: f64,
    },
    /// A list of radii with their shares of the number of grains.
    List(Vec<Sieved>),
}

/// A radius of a list.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sieved {
    /// Radius (m).
    pub radius: f64,
    /// Share of the number of grains; shares need not sum to 1.
    pub share: f64,
}

impl Radius {
    /// Least and greatest (m).
    pub fn range(&self) -> (f64, f64) {
        self.radii().range()
    }

    /// For the sampler.
    pub fn radii(&self) -> crate::dem::Radii {
        use crate::dem::Radii;
        match self {
            Self::Equal(r) => Radii::Equal(*r),
            Self::Uniform { least, greatest } => Radii::Uniform(*least, *greatest),
            Self::Normal { mean, deviation, least, greatest } => {
                Radii::Normal { mean: *mean, deviation: *deviation, least: *least, greatest: *greatest }
            }
            Self::List(list) => Radii::List(list.iter().map(|s| (s.radius, s.share)).collect()),
        }
    }

    fn check(&self, f: &mut Faults, path: &str) {
        let (least, greatest) = self.range();
        f.positive(path, least);
        f.check(
            greatest.is_finite() && greatest >= least && greatest <= 20.0 * least,
            &format!("{path}, the greatest"),
            greatest,
            "from the least radius to 20 times that",
        );
        match self {
            Self::Normal { mean, deviation, .. } => {
                f.check(
                    *mean >= least && *mean <= greatest,
                    &format!("{path}.normal.mean"),
                    mean,
                    "from least to greatest",
                );
                f.not_negative(&format!("{path}.normal.deviation"), *deviation);
            }
            Self::List(list) => {
                f.check(!list.is_empty(), &format!("{path}.list"), "empty", "at least one radius");
                list.iter().for_each(|s| f.not_negative(&format!("{path}.list.share"), s.share));
                f.check(list.iter().any(|s| s.share > 0.0), &format!("{path}.list.share"), 0, "some above 0");
            }
            _ => {}
        }
    }
}

/// Grains of another kind, mixed in or in a layer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpeciesOf {
    /// Share of the number of grains (1); what all species leave is the soil's own.
    pub share: f64,
    /// Radii of the grains.
    pub radius: Radius,
    /// Density of a grain (kg/m3).
    pub density: f64,
    /// Contact properties.
    #[serde(default)]
    pub surface: Surface,
    /// They lie in a layer above the soil and the layers listed before, instead of being mixed in. Levelling the bed takes from the
    /// uppermost.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub layer: bool,
}

/// Adhesion, the sum of its kinds. The least of the two materials holds for a pair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Adhesion {
    /// Cohesive pressure p (Pa): a pull of pi r^2 p per contact.
    pub pressure: f64,
    /// Constant pull per contact (N).
    pub constant: f64,
    /// Derjaguin-Muller-Toporov: pull over sqrt(R*) (N/m^0.5).
    pub dmt: f64,
    /// Perko: pull over R* (N/m).
    pub perko: f64,
}

/// Surface of a wall or body in contact with grains.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Surface {
    /// Coulomb friction (1); the lesser of grain and surface holds.
    pub friction: f64,
    /// Coefficient of restitution, 0 to 1 (1); the lesser holds.
    pub restitution: f64,
    /// Young's modulus (Pa).
    pub young_modulus: f64,
    /// Poisson's ratio (1).
    pub poisson_ratio: f64,
    /// Rolling friction (1); the lesser holds.
    pub rolling_friction: f64,
    /// Spinning friction (1); the lesser holds.
    pub spinning_friction: f64,
    /// Adhesion; the lesser holds.
    pub adhesion: Adhesion,
}

impl Default for Surface {
    fn default() -> Self {
        Self {
            friction: 0.5,
            restitution: 0.1,
            young_modulus: 1e7,
            poisson_ratio: 0.3,
            rolling_friction: 1.0,
            spinning_friction: 1.0,
            adhesion: Adhesion::default(),
        }
    }
}

/// Bodies in the soil.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Bodies {
    /// Surface of a body; the parameters `body[k].material.*`, where they are set, replace its first four values.
    pub surface: Surface,
}

impl Terrain {
    /// Every fault at once.
    ///
    /// # Errors
    /// [`UnitError::Input`] naming each value by its JSON path.
    pub fn check(&self, origin: &str) -> Result<(), UnitError> {
        let mut f = Faults::new();
        self.soil.check(&mut f);
        self.bed.check(&mut f, &self.soil);
        self.bodies.surface.check(&mut f, "bodies.surface");
        self.dem_p.check(&mut f, &self.soil);
        let most = obstacles::GREATEST_OBSTACLES;
        f.check(self.obstacles.len() <= most, "obstacles", self.obstacles.len(), &format!("at most {most}"));
        self.obstacles.iter().enumerate().for_each(|(k, o)| o.check(&mut f, k));
        if let Some(o) = &self.output {
            let sound = (0..3).all(|c| o.low[c] < o.high[c]);
            f.check(sound, "output", format!("from {:?} to {:?}", o.low, o.high), "low below high, along each axis");
        }
        if let Some(x) = &self.dem_c {
            x.check(&mut f);
        }
        if let Some(x) = &self.scm {
            x.check(&mut f);
        }
        if let Some(x) = &self.rigid {
            x.check(&mut f);
        }
        f.into_result(origin)
    }
}

impl Soil {
    /// Least and greatest radius of all grains (m).
    pub fn range(&self) -> (f64, f64) {
        let others = self.species.iter().map(|s| s.radius.range());
        others.fold(self.radius.range(), |(a, b), (c, d)| (a.min(c), b.max(d)))
    }

    fn check(&self, f: &mut Faults) {
        self.radius.check(f, "soil.radius");
        let mut shares = 0.0;
        for (k, s) in self.species.iter().enumerate() {
            let at = format!("soil.species[{k}]");
            s.radius.check(f, &format!("{at}.radius"));
            f.positive(&format!("{at}.density"), s.density);
            f.within(&format!("{at}.share"), s.share, 0.0, 1.0);
            s.surface.check(f, &format!("{at}.surface"));
            shares += s.share;
        }
        f.check(shares <= 1.0, "soil.species, sum of shares", shares, "at most 1");
        f.positive("soil.density", self.density);
        let s = Surface {
            friction: self.friction,
            restitution: self.restitution,
            young_modulus: self.young_modulus,
            poisson_ratio: self.poisson_ratio,
            rolling_friction: self.rolling_friction,
            spinning_friction: self.spinning_friction,
            adhesion: self.adhesion,
        };
        s.check(f, "soil");
    }
}

impl Surface {
    fn check(&self, f: &mut Faults, path: &str) {
        let at = |name: &str| format!("{path}.{name}");
        f.within(&at("friction"), self.friction, 0.0, 100.0);
        f.within(&at("restitution"), self.restitution, 0.0, 1.0);
        f.positive(&at("young_modulus"), self.young_modulus);
        f.check(
            self.poisson_ratio > -1.0 && self.poisson_ratio <= 0.5,
            &at("poisson_ratio"),
            self.poisson_ratio,
            "above -1, at most 0.5",
        );
        f.within(&at("rolling_friction"), self.rolling_friction, 0.0, 100.0);
        f.within(&at("spinning_friction"), self.spinning_friction, 0.0, 100.0);
        let a = &self.adhesion;
        for (name, x) in [("pressure", a.pressure), ("constant", a.constant), ("dmt", a.dmt), ("perko", a.perko)] {
            f.not_negative(&at(&format!("adhesion.{name}")), x);
        }
    }
}
