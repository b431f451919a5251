//! The block `dem_p`, and what the granular engine makes of a specification.

use super::pairs::PairValues;
use super::{AdhesionOnset, BODIES, CompactionOf, Fill, PlacingOf, Soil, SpeciesOf, Surface, Terrain};
use crate::dem::{self, Coefficients, Material, Recipe, Sample, Setup, Wall};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;

/// Penalty granular model: spheres that overlap a little and push apart, explicit in time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DemP {
    /// Inner step (s). It must not be above the critical one; a communication step is cut into equal steps of at most
    /// this. Null: 0.8 of the critical one.
    pub step: Option<f64>,
    /// Force law.
    pub law: Law,
    /// Where stiffness and damping come from.
    pub form: Form,
    /// Stiffness and damping for the form coefficients.
    pub coefficients: CoefficientValues,
    /// Values that replace what the pair rules give (the lesser friction, restitution and adhesion).
    pub pairs: Vec<PairValues>,
    /// How the tangential displacement is followed.
    pub tangential: Tangential,
    /// What contacts between grains are computed with: `double`, or `mixed`: single precision behind the overlap, while positions,
    /// velocities, memories and sums stay in double. For Hertz-Mindlin from properties with history; other laws are always computed in
    /// double. A load then is right to about 1e-6 of itself; `docs/benchmarks/dem.md` tells what it gains.
    pub precision: Precision,
    /// Whether the normal force before adhesion is clamped at zero. It raises the restitution of strongly damped contacts.
    pub clamp_normal: bool,
    /// Damping ratio of rolling and spinning resistance (1); 1 is critical, a grain comes to rest without rocking.
    pub rolling_damping: f64,
    /// Time in which the adhesion of a new contact grows (s); 0 = at once.
    pub adhesion_time: f64,
    /// Overlap at which the adhesion of a contact is fully grown, over the least radius (1); 0 = at once.
    pub adhesion_overlap: f64,
    /// Skin of the pair lists over the mean radius, 0.01 to 1 (1). Larger: fewer rebuilds, longer lists.
    pub skin: f64,
    /// Largest overlap expected, over the radius, 0.001 to 0.4 (1): the critical step holds up to it.
    pub expected_overlap: f64,
    /// Critical step over sqrt(m*/k_n) at that overlap, at most 0.5 (1).
    pub step_factor: f64,
    /// Soil far from every body sleeps: it stays as it is, and costs nothing. Null: nothing sleeps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sleep: Option<SleepOf>,
}

/// What may sleep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SleepOf {
    /// Distance along x from every body, at least ten greatest radii (m). What it does to the forces on a wheel is measured in
    /// docs/benchmarks/dem.md.
    pub distance: f64,
    /// Mean kinetic energy of the grains over m g r below which soil is calm (1).
    pub energy: f64,
}

impl Default for SleepOf {
    fn default() -> Self {
        Self { distance: 0.5, energy: 1e-4 }
    }
}

impl Default for DemP {
    fn default() -> Self {
        let s = Setup::default();
        Self {
            step: None,
            law: Law::HertzMindlin,
            form: Form::Properties,
            coefficients: CoefficientValues::default(),
            pairs: Vec::new(),
            tangential: Tangential::History,
            precision: Precision::Double,
            clamp_normal: false,
            rolling_damping: s.rolling_damping,
            adhesion_time: 0.0,
            adhesion_overlap: 0.0,
            skin: s.skin,
            expected_overlap: s.expected_overlap,
            step_factor: s.step_factor,
            sleep: None,
        }
    }
}

/// Force law. Formulas: the theory pages, and `fmu-terrain/src/dem/law/`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// Linear spring.
    Hooke,
    /// Hertz normal, Mindlin tangential stiffness.
    HertzMindlin,
    /// Hertz with the dissipation of Flores et al.; needs a restitution above 0.
    Flores,
    /// The source paper's driver: regularised Coulomb friction, which creeps.
    PlainCoulomb,
}

/// Where stiffness and damping come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// Young's modulus, Poisson's ratio, restitution.
    Properties,
    /// The numbers in `coefficients`.
    Coefficients,
}

/// What contacts between grains are computed with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Precision {
    /// Double precision.
    Double,
    /// Single precision behind the overlap.
    Mixed,
}

/// How the tangential displacement is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Tangential {
    /// Damping only.
    None,
    /// This step's slip only.
    OneStep,
    /// Accumulated per pair, cut back to the Coulomb limit.
    History,
}

/// Stiffness and damping, the same for all materials. Their units depend on the law: Hooke N/m and 1/s; Hertz-Mindlin and
/// Flores Pa/m^0.5 and 1/(m^1.5 s); plain-coulomb N/m^1.5 and N s/m^1.5.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CoefficientValues {
    /// Normal stiffness.
    pub kn: f64,
    /// Normal damping.
    pub gn: f64,
    /// Tangential stiffness.
    pub kt: f64,
    /// Tangential damping.
    pub gt: f64,
}

impl Default for CoefficientValues {
    /// The source paper's driver.
    fn default() -> Self {
        Self { kn: 1e6, gn: 60.0, kt: 4e5, gt: 40.0 }
    }
}

pub(super) fn coefficients(c: CoefficientValues) -> Coefficients {
    Coefficients { kn: c.kn, gn: c.gn, kt: c.kt, gt: c.gt }
}

impl DemP {
    pub(super) fn check(&self, f: &mut Faults, soil: &Soil) {
        if let Some(step) = self.step {
            f.positive("dem_p.step", step);
        }
        let c = &self.coefficients;
        f.positive("dem_p.coefficients.kn", c.kn);
        for (path, x) in [("gn", c.gn), ("kt", c.kt), ("gt", c.gt)] {
            f.not_negative(&format!("dem_p.coefficients.{path}"), x);
        }
        for (k, pair) in self.pairs.iter().enumerate() {
            pair.check(f, k);
        }
        f.within("dem_p.rolling_damping", self.rolling_damping, 0.0, 10.0);
        f.not_negative("dem_p.adhesion_time", self.adhesion_time);
        f.within("dem_p.adhesion_overlap", self.adhesion_overlap, 0.0, 0.5);
        f.within("dem_p.skin", self.skin, 0.01, 1.0);
        f.within("dem_p.expected_overlap", self.expected_overlap, 0.001, 0.4);
        f.check(
            self.step_factor > 0.0 && self.step_factor <= 0.5,
            "dem_p.step_factor",
            self.step_factor,
            "above 0, at most 0.5",
        );
        if let Some(s) = &self.sleep {
            let least = 10.0 * soil.range().1;
            let allowed = format!("a finite number of at least ten radii, {least} m");
            f.check(s.distance.is_finite() && s.distance >= least, "dem_p.sleep.distance", s.distance, &allowed);
            f.positive("dem_p.sleep.energy", s.energy);
        }
        if self.law == Law::Flores && self.form == Form::Properties {
            f.check(soil.restitution > 0.0, "soil.restitution", soil.restitution, "above 0 for the law flores");
        }
    }
}

/// Material of the soil.
pub const SOIL: usize = 0;
/// Material of the floor.
pub const FLOOR: usize = 1;
/// Material of the side walls.
pub const WALLS: usize = 2;
/// Material of the first body.
pub const FIRST_BODY: usize = 3;
/// Material of the first obstacle.
pub const FIRST_OBSTACLE: usize = FIRST_BODY + BODIES;

impl Terrain {
    /// The engine's setup; where `dem_p.step` is null, with 0.8 of the critical step. `surfaces`: friction, restitution,
    /// Young's modulus and Poisson's ratio of the first bodies, in place of `bodies.surface`.
    pub fn setup(&self, surfaces: &[[f64; 4]]) -> Setup {
        let p = &self.dem_p;
        let c = coefficients(p.coefficients);
        let s = &self.soil;
        let soil = Material {
            young_modulus: s.young_modulus,
            poisson_ratio: s.poisson_ratio,
            restitution: s.restitution,
            friction: s.friction,
            rolling_friction: s.rolling_friction,
            spinning_friction: s.spinning_friction,
            adhesion: adhesion(s.adhesion),
            coefficients: c,
        };
        let floor = self.bed.floor.map_or(soil, |s| material(&s, c));
        let walls = self.bed.walls.map_or(Material { adhesion: dem::Adhesion::default(), ..soil }, |s| material(&s, c));
        let mut materials = vec![soil, floor, walls];
        materials.extend([material(&self.bodies.surface, c); BODIES]);
        for (m, &[friction, restitution, young_modulus, poisson_ratio]) in
            materials[FIRST_BODY..].iter_mut().zip(surfaces)
        {
            let surface = Surface { friction, restitution, young_modulus, poisson_ratio, ..self.bodies.surface };
            *m = material(&surface, c);
        }
        materials.extend(self.obstacles.iter().map(|o| material(&o.surface, c)));
        materials.extend(self.soil.species.iter().map(|s| material(&s.surface, c)));
        let (least, _) = self.soil.range();
        let mut setup = Setup {
            step: p.step.unwrap_or(0.0),
            gravity: self.bed.gravity,
            materials,
            overrides: p.pairs.iter().flat_map(PairValues::overrides).collect(),
            law: match p.law {
                Law::Hooke => dem::LawKind::Hooke,
                Law::HertzMindlin => dem::LawKind::HertzMindlin,
                Law::Flores => dem::LawKind::Flores,
                Law::PlainCoulomb => dem::LawKind::PlainCoulomb,
            },
            form: match p.form {
                Form::Properties => dem::Form::Properties,
                Form::Coefficients => dem::Form::Coefficients,
            },
            precision: match p.precision {
                Precision::Double => dem::Precision::Double,
                Precision::Mixed => dem::Precision::Single,
            },
            tangential: match p.tangential {
                Tangential::None => dem::Tangential::None,
                Tangential::OneStep => dem::Tangential::OneStep,
                Tangential::History => dem::Tangential::History,
            },
            clamp_normal: p.clamp_normal,
            rolling_damping: p.rolling_damping,
            adhesion_time: p.adhesion_time,
            adhesion_overlap: p.adhesion_overlap * least,
            walls: Wall::open_box(self.bed.length, self.bed.width, FLOOR, WALLS),
            skin: p.skin,
            expected_overlap: p.expected_overlap,
            step_factor: p.step_factor,
            sleep: p.sleep.map(|s| dem::Sleep { distance: s.distance, energy: s.energy }),
            period: None,
            follow: self.bed.follow,
        };
        if p.step.is_none() {
            let lightest: Vec<_> = self.lightest().iter().map(dem::Grain::row).collect();
            setup.step = 0.8 * dem::limits::critical(&setup, &lightest).map_or(1e-5, |c| c.step);
        }
        setup
    }

    /// The lightest grain of each species: what the critical step follows from.
    pub fn lightest(&self) -> Vec<dem::Grain> {
        let own = dem::Grain::at([0.0; 3], self.soil.radius.range().0, self.soil.density);
        let others = self.soil.species.iter().enumerate().map(|(k, s)| dem::Grain {
            material: FIRST_OBSTACLE + self.obstacles.len() + k,
            ..dem::Grain::at([0.0; 3], s.radius.range().0, s.density)
        });
        std::iter::once(own).chain(others).collect()
    }

    fn species(&self, k: usize, s: &SpeciesOf) -> dem::Species {
        let material = FIRST_OBSTACLE + self.obstacles.len() + k;
        dem::Species { share: s.share, radii: s.radius.radii(), density: s.density, material, layer: s.layer }
    }

    /// Radii for the sampler.
    pub fn radii(&self) -> dem::Radii {
        self.soil.radius.radii()
    }

    /// How the bed is made.
    pub fn recipe(&self) -> Recipe {
        let b = &self.bed;
        Recipe {
            sample: Sample {
                length: b.length,
                width: b.width,
                fill: match b.fill {
                    Fill::Depth(d) => dem::Fill::Depth(d),
                    Fill::Count(n) => dem::Fill::Count(n),
                },
                radii: self.radii(),
                density: self.soil.density,
                material: SOIL,
                seed: b.seed,
                spacing: b.spacing,
            },
            settle: b.settle,
            cohesion: match b.adhesion_onset {
                AdhesionOnset::Growth => dem::Onset::Growth(b.adhesion_time),
                AdhesionOnset::Offset => dem::Onset::Offset,
            },
            placing: match b.placing {
                PlacingOf::Grid => dem::Placing::Grid,
                PlacingOf::Hcp => dem::Placing::Hcp,
                PlacingOf::PoissonDisk => dem::Placing::PoissonDisk,
            },
            others: self.soil.species.iter().enumerate().map(|(k, s)| self.species(k, s)).collect(),
            laying: b.laying,
            compaction: b.compaction.iter().map(compaction).collect(),
            tile: b.tile,
        }
    }
}

pub(super) fn adhesion(a: super::Adhesion) -> dem::Adhesion {
    dem::Adhesion { constant: a.constant, dmt: a.dmt, perko: a.perko, pressure: a.pressure }
}

fn compaction(c: &CompactionOf) -> dem::Compaction {
    match *c {
        CompactionOf::Vibrate { amplitude, frequency, time, sideways } => {
            dem::Compaction::Vibrate { amplitude, frequency, time, sideways }
        }
        CompactionOf::Press { pressure, time } => dem::Compaction::Press { pressure, time },
    }
}

fn material(s: &Surface, coefficients: Coefficients) -> Material {
    Material {
        young_modulus: s.young_modulus,
        poisson_ratio: s.poisson_ratio,
        restitution: s.restitution,
        friction: s.friction,
        rolling_friction: s.rolling_friction,
        spinning_friction: s.spinning_friction,
        adhesion: adhesion(s.adhesion),
        coefficients,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_step_is_below_the_critical_one_and_follows_the_bodies() {
        let spec = Terrain::default();
        let soft = spec.setup(&[]).step;
        let stiff = spec.setup(&[[0.5, 0.1, 2e11, 0.3]]).step;
        assert!(soft > 1e-5 && stiff < soft && stiff > 0.5 * soft, "{soft} {stiff}");
    }
}
