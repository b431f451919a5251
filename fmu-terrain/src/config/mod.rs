//! The specification, common to all terrains: `soil`, `bed` and `bodies` are read by every model; `dem_p`, `dem_c`, `scm` and
//! `rigid` are checked by every model and used by one, so that a study swaps the terrain by changing one attribute.
//!
//! [`Terrain`] is what serde reads; [`Terrain::check`] reports every fault at once.

pub mod dem_p;
pub mod obstacles;
mod other;
pub mod pairs;
pub mod platform;

pub use crate::rigid::config::Rigid;
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

/// How grains are placed before they fall.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlacingOf {
    /// One in each cell of a grid, at random within it.
    #[default]
    Grid,
    /// Hexagonal closest packing.
    Hcp,
    /// At random with a least distance.
    PoissonDisk,
}

/// What is done to the settled bed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum CompactionOf {
    /// The box is shaken.
    Vibrate {
        /// Amplitude (m).
        amplitude: f64,
        /// Frequency (Hz).
        frequency: f64,
        /// How long (s).
        time: f64,
        /// Along x instead of up and down.
        #[serde(default)]
        sideways: bool,
    },
    /// A plate presses on the whole surface.
    Press {
        /// Pressure (Pa).
        pressure: f64,
        /// How long (s).
        time: f64,
    },
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

/// The box, and how it is filled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Bed {
    /// Length of the box along x (m).
    pub length: f64,
    /// Width of the box along y (m).
    pub width: f64,
    /// How much soil.
    pub fill: Fill,
    /// Seed of the random placing: another one gives another bed of the same kind.
    pub seed: u64,
    /// Spacing of the grid that grains are poured from, over the largest diameter, 1 to 10 (1). Larger: more random, longer
    /// to settle.
    pub spacing: f64,
    /// How grains are placed before they fall.
    pub placing: PlacingOf,
    /// Factor on all friction (sliding, rolling, spinning) while the bed is poured, 0 to 1 (1). The smaller, the denser the bed; its grains have the
    /// specification's friction from then on. Find it by the bulk density that `terramech soil` prints.
    #[serde(skip_serializing_if = "is_one")]
    pub laying: f64,
    /// What is done to the settled bed, one after the other; it settles again after each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub compaction: Vec<CompactionOf>,
    /// Length of tiles that the bed is laid of (m), about: one is settled in a box without ends and laid as often as the box is long.
    /// It makes large beds in minutes. Null: the bed is settled whole. Used by terrain_dem_p.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tile: Option<f64>,
    /// The box follows the bodies along +x: where one of them comes nearer to the foremost tile than this (m), soil behind is taken away and
    /// laid anew in front, a tile at a time. Needs tile; the box must be longer than the bodies, three tiles and this. Used by terrain_dem_p.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub follow: Option<f64>,
    /// Gravity x, y, z (m/s2).
    pub gravity: [f64; 3],
    /// Surface of the four side walls; null: as the soil, without adhesion.
    pub walls: Option<Surface>,
    /// Surface of the floor; null: as the soil.
    pub floor: Option<Surface>,
    /// When the bed counts as settled.
    pub settle: Settle,
    /// Time over which adhesion grows once the bed rests (s). Poured with it, grains would hang in loose clumps; the bed
    /// contracts as it grows, which the log reports.
    pub adhesion_time: f64,
    /// How adhesion comes into the bed that was settled without it.
    pub adhesion_onset: AdhesionOnset,
    /// Rigid run-up before the box, at -x.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub platform: Option<Platform>,
}

/// Whether a factor need not be written.
#[allow(clippy::trivially_copy_pass_by_ref)] // serde hands a reference.
fn is_one(x: &f64) -> bool {
    *x == 1.0
}

impl Default for Bed {
    fn default() -> Self {
        Self {
            length: 0.4,
            width: 0.15,
            fill: Fill::Depth(0.06),
            seed: 1,
            spacing: 1.05,
            placing: PlacingOf::Grid,
            laying: 1.0,
            compaction: Vec::new(),
            tile: None,
            follow: None,
            gravity: [0.0, 0.0, -9.81],
            walls: None,
            floor: None,
            settle: Settle::default(),
            adhesion_time: 0.1,
            adhesion_onset: AdhesionOnset::Growth,
            platform: None,
        }
    }
}

/// How adhesion comes into a settled bed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AdhesionOnset {
    /// It grows over bed.adhesion_time: the bed contracts and settles again.
    #[default]
    Growth,
    /// At once, the overlap of every contact counting from an offset with which nothing moves. Used by terrain_dem_p.
    Offset,
}

/// How much soil: one of the two.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fill {
    /// Depth of the settled bed (m): it is filled to a little more, settled and levelled off.
    Depth(f64),
    /// Number of grains.
    Count(usize),
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

/// When a bed counts as settled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Settle {
    /// Mean kinetic energy of the grains, the most energetic hundredth left out, over m g r (1): 1e-5 is 1.5 mm/s for
    /// r 12 mm.
    pub energy: f64,
    /// Not before this time (s): grains begin at rest and must fall first.
    pub least_time: f64,
    /// Give up after this time (s).
    pub most_time: f64,
}

impl Default for Settle {
    fn default() -> Self {
        Self { energy: 1e-5, least_time: 0.05, most_time: 5.0 }
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

impl Bed {
    fn check(&self, f: &mut Faults, soil: &Soil) {
        let (least, greatest) = soil.range();
        for (path, x) in [("bed.length", self.length), ("bed.width", self.width)] {
            let allowed = format!("a finite number of at least two diameters, {} m", 4.0 * greatest);
            f.check(x.is_finite() && x >= 4.0 * greatest, path, x, &allowed);
        }
        match self.fill {
            Fill::Depth(d) => {
                f.positive("bed.fill.depth", d);
                // Told here: placing them would run out of memory, which ends the whole process.
                let r = 0.5 * (least + greatest);
                let grains = 0.6 * self.length * self.width * d / (4.0 / 3.0 * std::f64::consts::PI * r.powi(3));
                f.check(
                    grains <= GREATEST_COUNT as f64 || grains.is_nan(),
                    "bed.length x bed.width x bed.fill.depth",
                    format!("{} m x {} m x {d} m, about {grains:.1e} grains of radius {r} m", self.length, self.width),
                    &format!("at most {GREATEST_COUNT} grains; take a smaller box or larger soil.radius"),
                );
            }
            Fill::Count(n) => {
                f.check((1..=GREATEST_COUNT).contains(&n), "bed.fill.count", n, &format!("1 to {GREATEST_COUNT}"));
            }
        }
        f.within("bed.spacing", self.spacing, 1.0, 10.0);
        f.within("bed.laying", self.laying, 0.0, 1.0);
        for (k, what) in self.compaction.iter().enumerate() {
            let at = |name: &str| format!("bed.compaction[{k}].{name}");
            match what {
                CompactionOf::Vibrate { amplitude, frequency, time, .. } => {
                    f.positive(&at("vibrate.amplitude"), *amplitude);
                    f.positive(&at("vibrate.frequency"), *frequency);
                    f.within(&at("vibrate.time"), *time, 0.0, 60.0);
                }
                CompactionOf::Press { pressure, time } => {
                    f.positive(&at("press.pressure"), *pressure);
                    f.within(&at("press.time"), *time, 0.0, 60.0);
                }
            }
        }
        if let Some(tile) = self.tile {
            let allowed = format!("twelve greatest radii, {} m, to a third of bed.length", 12.0 * greatest);
            f.check(tile >= 12.0 * greatest && tile <= self.length / 3.0, "bed.tile", tile, &allowed);
        }
        if let Some(buffer) = self.follow {
            f.check(self.tile.is_some(), "bed.follow", buffer, "only together with bed.tile");
            f.check(
                self.platform.is_none(),
                "bed.follow",
                buffer,
                "not together with bed.platform, which stays behind",
            );
            let tile = self.tile.unwrap_or(0.0);
            let allowed =
                format!("above {} m, two greatest diameters, up to bed.length less three tiles", 4.0 * greatest);
            let inside = buffer > 4.0 * greatest && buffer <= self.length - 3.0 * tile;
            f.check(inside, "bed.follow", buffer, &allowed);
        }
        let g = self.gravity;
        f.check(g.iter().all(|x| x.is_finite()) && g[2] < 0.0, "bed.gravity", format!("{g:?}"), "finite, z below 0");
        for (path, s) in [("bed.walls", &self.walls), ("bed.floor", &self.floor)] {
            if let Some(s) = s {
                s.check(f, path);
            }
        }
        f.positive("bed.settle.energy", self.settle.energy);
        f.not_negative("bed.settle.least_time", self.settle.least_time);
        f.check(
            self.settle.most_time.is_finite() && self.settle.most_time > self.settle.least_time,
            "bed.settle.most_time",
            self.settle.most_time,
            "finite, above least_time",
        );
        f.not_negative("bed.adhesion_time", self.adhesion_time);
        if let Some(p) = &self.platform {
            p.check(f);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bed_beyond_memory_is_refused_with_its_count() {
        let bed = Bed { length: 1000.0, width: 1000.0, ..Bed::default() };
        let e = Terrain { bed, ..Terrain::default() }.check("bed.json").unwrap_err().to_string();
        assert!(e.contains("bed.length") && e.contains("50000000 grains"), "{e}");
    }
}
