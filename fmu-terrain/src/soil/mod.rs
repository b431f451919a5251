//! Virtual soil tests: what a specification's soil would measure on an engineer's bench.
//!
//! Each test makes a bed of the specification's grains in a box of its own size, a few tens of grains wide, and does what the
//! apparatus does; [`measure`] runs all of them. The numbers are those of small samples: repeat with other seeds before
//! quoting a third digit.
//!
//! | test | what is done | numbers |
//! |---|---|---|
//! | packing | a settled bed | bulk density, packing fraction |
//! | repose | one side wall of a column is taken away | angle of repose |
//! | shear | the upper half of a box is moved at three normal pressures | friction angle, cohesion |
//! | plate | strips of two widths are pushed in | Bekker k_c, k_phi, n |

mod apparatus;
mod plate;
mod repose;
mod shear;
mod sheet;

pub use plate::{Plates, Sinkage, plates};
pub use repose::{Repose, repose};
pub use shear::{Shear, Sheared, shear};
pub use sheet::sheet;

use crate::config::Terrain;
use crate::dem::{
    CpuEngine, DemError, Fill, GrainEngine as _, Recipe, Sample, Setup, Wall, grains::INV_M, prepare, settle::Progress,
};

/// A soil as the tests need it: setup without walls, and how a bed of it is made.
#[derive(Clone, Debug)]
pub struct Soil {
    /// Materials, law, step. A material without friction or adhesion is added behind the others.
    pub setup: Setup,
    /// Radii, species, settling, compaction; box and fill are each test's own.
    pub recipe: Recipe,
    /// Index of the frictionless material.
    smooth: usize,
    /// Greatest diameter (m).
    diameter: f64,
}

/// What was measured.
#[derive(Clone, Debug)]
pub struct Report {
    /// Mass over volume of a bed (kg/m3), the uppermost two diameters left out.
    pub bulk_density: f64,
    /// Volume of grains over volume (1).
    pub packing_fraction: f64,
    /// Angle of repose.
    pub repose: Repose,
    /// Direct shear.
    pub shear: Shear,
    /// Plate sinkage.
    pub plates: Plates,
}

impl Soil {
    /// The soil of a specification.
    pub fn new(spec: &Terrain) -> Self {
        let mut setup = spec.setup(&[]);
        let smooth = setup.materials.len();
        let soil = setup.materials[0];
        setup.materials.push(crate::dem::Material {
            friction: 0.0,
            rolling_friction: 0.0,
            spinning_friction: 0.0,
            adhesion: crate::dem::Adhesion::default(),
            ..soil
        });
        // One pair list for all pairs of the soil; walls are each test's own.
        setup.walls.clear();
        (setup.sleep, setup.follow) = (None, None);
        let recipe = Recipe { tile: None, ..spec.recipe() };
        Self { setup, recipe, smooth, diameter: 2.0 * spec.soil.range().1 }
    }

    /// A settled bed in a box of these sizes (m); smooth side walls where `smooth_sides`, a floor of soil.
    fn bed(
        &self,
        [length, width, depth]: [f64; 3],
        smooth_sides: bool,
        threads: usize,
        progress: Progress,
    ) -> Result<CpuEngine, DemError> {
        let sides = if smooth_sides { self.smooth } else { 0 };
        let setup = Setup { walls: Wall::open_box(length, width, 0, sides), ..self.setup.clone() };
        let sample = Sample { length, width, fill: Fill::Depth(depth), ..self.recipe.sample.clone() };
        let recipe = Recipe { sample, ..self.recipe.clone() };
        prepare(setup, &recipe, threads, progress).map(|(engine, _)| engine)
    }
}

/// Bulk density (kg/m3) and packing fraction (1) of a bed between the floor's first layer and two diameters below the
/// surface.
///
/// # Errors
/// As making a bed.
pub fn packing(soil: &Soil, threads: usize, progress: Progress) -> Result<(f64, f64), DemError> {
    let d = soil.diameter;
    let (base, depth) = (14.0 * d, 14.0 * d);
    let engine = soil.bed([base, base, depth], false, threads, progress)?;
    let rows = &engine.state().rows;
    // Away from walls and floor, where grains lie in layers.
    let (low, high) = ([-0.5 * base + 2.0 * d, -0.5 * base + 2.0 * d, 2.0 * d], 0.5 * base - 2.0 * d);
    let top = crate::dem::Surface::of(engine.state(), base, base).mean() - 2.0 * d;
    let size = [high - low[0], high - low[1], top - low[2]];
    let (mut mass, mut volume) = (0.0, 0.0);
    for r in rows.iter().filter(|r| r[INV_M] > 0.0) {
        // Parts of a grain count by how far it reaches in along each axis.
        let share =
            |c: usize, a: f64, b: f64| (((r[c] + r[3]).min(b) - (r[c] - r[3]).max(a)) / (2.0 * r[3])).clamp(0.0, 1.0);
        let part = share(0, low[0], high) * share(1, low[1], high) * share(2, low[2], top);
        mass += part / r[INV_M];
        volume += part * 4.0 / 3.0 * std::f64::consts::PI * r[3].powi(3);
    }
    let all = size.iter().product::<f64>();
    Ok((mass / all, volume / all))
}

/// All tests.
///
/// # Errors
/// What making beds and the engine meet.
pub fn measure(soil: &Soil, threads: usize, progress: Progress) -> Result<Report, DemError> {
    let (bulk_density, packing_fraction) = packing(soil, threads, progress)?;
    let g = soil.setup.gravity[2].abs();
    // Pressures as under 10, 20 and 40 diameters of soil, but at least 1 kPa: what light wheels put on it.
    let least = (10.0 * soil.diameter * bulk_density * g).max(1000.0);
    Ok(Report {
        bulk_density,
        packing_fraction,
        repose: repose(soil, threads, progress)?,
        shear: shear(soil, &[least, 2.0 * least, 4.0 * least], threads, progress)?,
        plates: plates(soil, threads, progress)?,
    })
}

/// Slope and intercept of the line of least squares.
fn line(points: impl Iterator<Item = (f64, f64)> + Clone) -> [f64; 2] {
    let n = points.clone().count() as f64;
    let (mx, my) = points.clone().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let (xy, xx) = points.fold((0.0, 0.0), |(a, b), (x, y)| (a + (x - mx) * (y - my), b + (x - mx) * (x - mx)));
    [xy / xx, my - xy / xx * mx]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found() {
        let [slope, at_zero] = line([(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)].into_iter());
        assert!((slope - 2.0).abs() < 1e-14 && (at_zero - 1.0).abs() < 1e-14);
    }
}
