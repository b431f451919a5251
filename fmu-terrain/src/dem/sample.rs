//! Placing grains: a jittered grid, poured in layers.
//!
//! Each grain lies at random within a cell of its own of a grid, one layer of cells above the other, so that nothing
//! overlaps; gravity does the rest. The spacing trades time for randomness: at 1.15 diameters the packing starts at a
//! third of the volume and falls by about two fifths of its height.

use super::error::DemError;
use super::grains::Grain;
use super::rng::Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Radii of the grains (m).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Radii {
    /// All the same.
    Equal(f64),
    /// Uniform between least and greatest.
    Uniform(f64, f64),
}

impl Radii {
    /// Least and greatest.
    pub fn range(self) -> (f64, f64) {
        match self {
            Self::Equal(r) => (r, r),
            Self::Uniform(a, b) => (a, b),
        }
    }

    /// Mean volume of a grain (m3).
    pub fn mean_volume(self) -> f64 {
        let (a, b) = self.range();
        // Mean of r^3 over [a, b] is (a + b)(a^2 + b^2)/4.
        4.0 / 3.0 * PI * (a + b) * (a * a + b * b) / 4.0
    }

    fn draw(self, rng: &mut Rng) -> f64 {
        match self {
            Self::Equal(r) => r,
            Self::Uniform(a, b) => rng.between(a, b),
        }
    }
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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

/// Grains for [`Sample`], layer by layer.
///
/// # Errors
/// Sizes outside their ranges; a box narrower than a grain.
pub fn sample(s: &Sample) -> Result<Vec<Grain>, DemError> {
    let (least, greatest) = s.radii.range();
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
            (DENSE * s.length * s.width * depth / s.radii.mean_volume()).ceil() as usize
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
    let mut grains = Vec::with_capacity(count);
    for i in 0..count {
        let mut rng = Rng::new(s.seed, i as u64);
        let radius = s.radii.draw(&mut rng);
        let at = [i % nx, i / nx % ny, i / (nx * ny)];
        let corner = [-0.5 * s.length, -0.5 * s.width, 0.0];
        let position = std::array::from_fn(|k| {
            let middle = corner[k] + (at[k] as f64 + 0.5) * cell[k];
            middle + (0.5 * cell[k] - radius).max(0.0) * rng.between(-1.0, 1.0)
        });
        grains.push(Grain { material: s.material, ..Grain::at(position, radius, s.density) });
    }
    Ok(grains)
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
