//! Which grains are placed, and how many; [`super::place`] says where.
//!
//! Each grain lies at random within a cell of its own of a grid, one layer of cells above the other, so that nothing
//! overlaps; gravity does the rest. The spacing trades time for randomness: at 1.15 diameters the packing starts at a
//! third of the volume and falls by about two fifths of its height.

use super::error::DemError;
use super::grains::Grain;
use super::place::{Placing, places};
use super::rng::Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Radii of the grains (m).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Radii {
    /// All the same.
    Equal(f64),
    /// Uniform between least and greatest.
    Uniform(f64, f64),
    /// Normal of this mean and standard deviation, cut off at least and greatest (drawn again beyond).
    Normal {
        /// Mean before cutting off.
        mean: f64,
        /// Standard deviation before cutting off.
        deviation: f64,
        /// Least.
        least: f64,
        /// Greatest.
        greatest: f64,
    },
    /// Each of these radii with its share of the number of grains; shares need not sum to 1.
    List(Vec<(f64, f64)>),
}

impl Radii {
    /// Least and greatest.
    pub fn range(&self) -> (f64, f64) {
        match self {
            Self::Equal(r) => (*r, *r),
            Self::Uniform(a, b) => (*a, *b),
            Self::Normal { least, greatest, .. } => (*least, *greatest),
            Self::List(list) => {
                list.iter().fold((f64::INFINITY, 0.0), |(a, b), (r, _)| (f64::min(a, *r), f64::max(b, *r)))
            }
        }
    }

    /// Mean volume of a grain (m3).
    pub fn mean_volume(&self) -> f64 {
        let cubes = match self {
            // Mean of r^3 over [a, b] is (a + b)(a^2 + b^2)/4.
            Self::Equal(_) | Self::Uniform(..) => {
                let (a, b) = self.range();
                (a + b) * (a * a + b * b) / 4.0
            }
            Self::Normal { mean, deviation, least, greatest } => {
                // By quadrature: the tails are cut off.
                let (mut sum, mut weights) = (0.0, 0.0);
                for k in 0..2000 {
                    let r = least + (greatest - least) * (f64::from(k) + 0.5) / 2000.0;
                    let w = if *deviation > 0.0 { (-0.5 * ((r - mean) / deviation).powi(2)).exp() } else { 1.0 };
                    sum += w * r.powi(3);
                    weights += w;
                }
                sum / weights
            }
            Self::List(list) => {
                let all: f64 = list.iter().map(|(_, share)| share).sum();
                list.iter().map(|(r, share)| share * r.powi(3)).sum::<f64>() / all
            }
        };
        4.0 / 3.0 * PI * cubes
    }

    fn draw(&self, rng: &mut Rng) -> f64 {
        match self {
            Self::Equal(r) => *r,
            Self::Uniform(a, b) => rng.between(*a, *b),
            Self::Normal { mean, deviation, least, greatest } => {
                for _ in 0..1000 {
                    // Box and Muller; 1 - u is never 0.
                    let (u, v) = (1.0 - rng.unit(), rng.unit());
                    let r = mean + deviation * (-2.0 * u.ln()).sqrt() * (2.0 * PI * v).cos();
                    if (*least..=*greatest).contains(&r) {
                        return r;
                    }
                }
                mean.clamp(*least, *greatest)
            }
            Self::List(list) => {
                let all: f64 = list.iter().map(|(_, share)| share).sum();
                let mut left = rng.unit() * all;
                for (r, share) in list {
                    left -= share;
                    if left < 0.0 {
                        return *r;
                    }
                }
                list.last().map_or(f64::NAN, |(r, _)| *r)
            }
        }
    }
}

/// Grains of another kind, mixed in or in a layer above.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Species {
    /// Share of the number of grains (1).
    pub share: f64,
    /// Radii.
    pub radii: Radii,
    /// Density of a grain (kg/m3).
    pub density: f64,
    /// Material index.
    pub material: usize,
    /// In a layer of its own, above all that comes before it in the list; else mixed into the sample's own grains.
    pub layer: bool,
}

/// How much.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Fill {
    /// Enough for this depth when settled (m); the surplus is levelled off.
    Depth(f64),
    /// This many grains.
    Count(usize),
}

/// What to place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Box along x (m), centred on the origin.
    pub length: f64,
    /// Box along y (m).
    pub width: f64,
    /// How much.
    pub fill: Fill,
    /// Radii.
    pub radii: Radii,
    /// Density of a grain (kg/m3) (bulk density over packing fraction).
    pub density: f64,
    /// Material index.
    pub material: usize,
    /// Seed: another one gives another bed of the same kind.
    pub seed: u64,
    /// Grid spacing over the largest diameter, above 1.
    pub spacing: f64,
}

/// Packing fraction that no poured bed of frictional spheres exceeds by much: what a depth is filled for.
const DENSE: f64 = 0.62;

/// Grains for [`Sample`] on a grid, layer by layer.
///
/// # Errors
/// Sizes outside their ranges; a box narrower than a grain.
pub fn sample(s: &Sample) -> Result<Vec<Grain>, DemError> {
    sample_mixed(s, Placing::Grid, &[])
}

/// Grains for [`Sample`] placed in some way, with other species mixed in: what is left of their shares is the sample's own.
///
/// # Errors
/// As [`sample()`]; shares that are negative or sum to more than 1.
pub fn sample_mixed(s: &Sample, how: Placing, others: &[Species]) -> Result<Vec<Grain>, DemError> {
    let ranges = others.iter().map(|o| o.radii.range());
    let (least, greatest) = ranges.fold(s.radii.range(), |(a, b), (c, d)| (a.min(c), b.max(d)));
    let shared: f64 = others.iter().map(|o| o.share).sum();
    if !(others.iter().all(|o| o.share >= 0.0) && shared <= 1.0) {
        return Err(DemError::parameter("shares of species", shared, "each at least 0, their sum at most 1"));
    }
    let own = (1.0 - shared) * s.radii.mean_volume();
    let mean_volume = others.iter().map(|o| o.share * o.radii.mean_volume()).fold(own, |a, b| a + b);
    let positive = |what: &str, x: f64| {
        if x.is_finite() && x > 0.0 {
            Ok(())
        } else {
            Err(DemError::parameter(what, x, "a finite number greater than 0"))
        }
    };
    positive("least radius", least)?;
    positive("density", s.density)?;
    positive("length", s.length)?;
    positive("width", s.width)?;
    if !(greatest >= least && greatest.is_finite()) {
        return Err(DemError::parameter("greatest radius", greatest, format!("at least the least one, {least} m")));
    }
    if !(s.spacing >= 1.0 && s.spacing <= 10.0) {
        return Err(DemError::parameter("spacing", s.spacing, "1 to 10"));
    }
    let count = match s.fill {
        Fill::Count(n) => n,
        Fill::Depth(depth) => {
            positive("depth", depth)?;
            (DENSE * s.length * s.width * depth / mean_volume).ceil() as usize
        }
    };
    let pitch = 2.0 * greatest * s.spacing;
    let along = |what: &str, extent: f64| match (extent / pitch).floor() as usize {
        0 if extent < 2.0 * greatest => {
            Err(DemError::parameter(what, extent, format!("at least a grain's diameter, {} m", 2.0 * greatest)))
        }
        n => Ok(n.max(1)),
    };
    let (nx, ny) = (along("length", s.length)?, along("width", s.width)?);
    let cell = [s.length / nx as f64, s.width / ny as f64, pitch];
    let places = places(s, how, count, greatest, pitch)?;
    let mut grains = Vec::with_capacity(count);
    for i in 0..count {
        let mut rng = Rng::new(s.seed, i as u64);
        let (radii, density, material) = kind(s, others, (i as f64 + 0.5) / count as f64, &mut rng);
        let radius = radii.draw(&mut rng);
        if let Some(&position) = places.get(i) {
            grains.push(Grain { material, ..Grain::at(position, radius, density) });
            continue;
        }
        let at = [i % nx, i / nx % ny, i / (nx * ny)];
        let corner = [-0.5 * s.length, -0.5 * s.width, 0.0];
        let position = std::array::from_fn(|k| {
            let middle = corner[k] + (at[k] as f64 + 0.5) * cell[k];
            middle + (0.5 * cell[k] - radius).max(0.0) * rng.between(-1.0, 1.0)
        });
        grains.push(Grain { material, ..Grain::at(position, radius, density) });
    }
    Ok(grains)
}

/// Radii, density and material of a grain, drawn by the shares; `height`: the share of grains below it, which decides its layer.
fn kind<'a>(s: &'a Sample, others: &'a [Species], height: f64, rng: &mut Rng) -> (&'a Radii, f64, usize) {
    let mixed = 1.0 - others.iter().filter(|o| o.layer).map(|o| o.share).sum::<f64>();
    let mut from = mixed;
    for o in others.iter().filter(|o| o.layer) {
        if height >= from && height < from + o.share {
            return (&o.radii, o.density, o.material);
        }
        from += o.share;
    }
    if others.iter().any(|o| !o.layer) {
        let mut left = rng.unit() * mixed;
        for o in others.iter().filter(|o| !o.layer) {
            left -= o.share;
            if left < 0.0 {
                return (&o.radii, o.density, o.material);
            }
        }
    }
    (&s.radii, s.density, s.material)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dem::vec3::{norm, sub};

    fn bed() -> Sample {
        Sample {
            length: 0.2,
            width: 0.15,
            fill: Fill::Depth(0.05),
            radii: Radii::Uniform(0.004, 0.007),
            density: 2500.0,
            material: 0,
            seed: 1,
            spacing: 1.1,
        }
    }

    #[test]
    fn grains_lie_in_the_box_and_apart() {
        let grains = sample(&bed()).unwrap();
        assert!(grains.len() > 500);
        for (i, a) in grains.iter().enumerate() {
            assert!(a.position[0].abs() <= 0.1 - a.radius + 1e-15 && a.position[1].abs() <= 0.075 - a.radius + 1e-15);
            assert!(a.position[2] >= a.radius - 1e-15);
            for b in &grains[..i] {
                assert!(norm(sub(a.position, b.position)) >= a.radius + b.radius - 1e-15);
            }
        }
    }

    #[test]
    fn every_way_of_placing_keeps_grains_apart_and_inside() {
        for (how, least_fraction) in [(Placing::Grid, 0.3), (Placing::Hcp, 0.5), (Placing::PoissonDisk, 0.2)] {
            let s = Sample { radii: Radii::Equal(0.006), spacing: 1.02, fill: Fill::Count(900), ..bed() };
            let grains = sample_mixed(&s, how, &[]).unwrap();
            assert_eq!(grains.len(), 900);
            let top = grains.iter().map(|g| g.position[2] + 0.006).fold(0.0, f64::max);
            let fraction = 900.0 * s.radii.mean_volume() / (0.2 * 0.15 * top);
            println!("{how:?}: volume fraction {fraction:.3}");
            assert!(fraction > least_fraction, "{how:?} {fraction}");
            for (i, a) in grains.iter().enumerate() {
                assert!(a.position[0].abs() <= 0.094 + 1e-12 && a.position[1].abs() <= 0.069 + 1e-12, "{how:?} {a:?}");
                assert!(a.position[2] >= 0.006 - 1e-12);
                for b in &grains[..i] {
                    assert!(norm(sub(a.position, b.position)) >= 0.012 - 1e-12, "{how:?}");
                }
            }
        }
    }

    #[test]
    fn radii_and_species_come_as_their_shares_say() {
        let count = |radii: Radii| Sample { radii, fill: Fill::Count(20_000), length: 2.0, width: 2.0, ..bed() };
        let normal = Radii::Normal { mean: 0.005, deviation: 0.001, least: 0.003, greatest: 0.007 };
        let list = Radii::List(vec![(0.004, 3.0), (0.006, 1.0)]);
        for radii in [normal, list.clone()] {
            let grains = sample(&count(radii.clone())).unwrap();
            let mean = grains.iter().map(|g| 4.0 / 3.0 * PI * g.radius.powi(3)).sum::<f64>() / 2e4;
            assert!((mean / radii.mean_volume() - 1.0).abs() < 0.02, "{radii:?}");
            let (least, greatest) = radii.range();
            assert!(grains.iter().all(|g| (least..=greatest).contains(&g.radius)));
        }
        let gravel = Species { share: 0.1, radii: Radii::Equal(0.008), density: 2700.0, material: 1, layer: false };
        let grains = sample_mixed(&count(list), Placing::Grid, &[gravel]).unwrap();
        let share = grains.iter().filter(|g| g.material == 1 && g.density == 2700.0).count() as f64 / 2e4;
        assert!((share - 0.1).abs() < 0.01, "{share}");
        // Three layers: own grains, then coarse, then heavy ones.
        let layer =
            |share, r, density, material| Species { share, radii: Radii::Equal(r), density, material, layer: true };
        let three = [layer(0.3, 0.006, 2600.0, 1), layer(0.2, 0.005, 4000.0, 2)];
        for how in [Placing::Grid, Placing::Hcp, Placing::PoissonDisk] {
            let few = Sample { length: 0.3, width: 0.3, ..count(Radii::Equal(0.005)) };
            let grains = sample_mixed(&Sample { fill: Fill::Count(4000), ..few }, how, &three).unwrap();
            let extent = |m: usize| {
                let z = grains.iter().filter(|g| g.material == m).map(|g| g.position[2]);
                z.fold([f64::INFINITY, 0.0_f64], |[a, b], z| [a.min(z), b.max(z)])
            };
            let of = [0, 1, 2].map(extent);
            assert!(of[0][1] < of[1][0] + 0.013 && of[1][1] < of[2][0] + 0.013, "{how:?} {of:?}");
            assert_eq!([0, 1, 2].map(|m| grains.iter().filter(|g| g.material == m).count()), [2000, 1200, 800]);
        }
    }

    #[test]
    fn the_seed_decides() {
        assert_eq!(sample(&bed()).unwrap(), sample(&bed()).unwrap());
        assert_ne!(sample(&bed()).unwrap(), sample(&Sample { seed: 2, ..bed() }).unwrap());
    }

    #[test]
    fn uniform_radii_have_the_stated_mean_volume() {
        let s = Sample { fill: Fill::Count(20_000), length: 2.0, width: 2.0, ..bed() };
        let grains = sample(&s).unwrap();
        let mean = grains.iter().map(|g| 4.0 / 3.0 * PI * g.radius.powi(3)).sum::<f64>() / 2e4;
        assert!((mean / s.radii.mean_volume() - 1.0).abs() < 0.01);
    }
}
