//! The sand: grains whose heap has the measured angle of repose and whose bed the measured bulk density.

use crate::Outcome;
use crate::store::Store;
use fmu_terrain::config::Terrain;
use fmu_terrain::soil::{Soil, packing, repose};
use serde_json::{Value, json};

/// Measured angle of repose (deg).
pub const REPOSE: f64 = 29.0;
/// Measured bulk density (kg/m3).
pub const BULK: f64 = 1330.0;

/// Grains, and how the wheel rubs on them.
#[derive(Clone, Copy, Debug)]
pub struct Sand {
    /// Mean radius (m); radii are uniform within a tenth of it.
    pub radius: f64,
    /// Friction between grains.
    pub friction: f64,
    /// Rolling friction.
    pub rolling: f64,
    /// Density of a grain (kg/m3).
    pub density: f64,
    /// Friction between wheel and grains.
    pub wheel: f64,
    /// Factor on both frictions between grains while the bed is poured and settles: 1 loosest, 0 densest. The sand of the experiment
    /// was prepared to a density; spheres find theirs by how they slide while they are laid.
    pub laying: f64,
}

impl Sand {
    /// As a specification, without a bed.
    pub fn specification(&self, modulus: f64) -> Value {
        json!({
            "soil": {
                "radius": {"uniform": {"least": 0.9 * self.radius, "greatest": 1.1 * self.radius}},
                "density": self.density, "friction": self.friction, "restitution": 0.2,
                "young_modulus": modulus, "poisson_ratio": 0.3,
                "rolling_friction": self.rolling, "spinning_friction": 0.5 * self.rolling,
            },
            "bodies": {"surface": {"friction": self.wheel, "restitution": 0.2, "young_modulus": modulus}},
            "bed": {"laying": self.laying},
            "dem_p": {"expected_overlap": 0.08},
        })
    }
}

/// The sand of this grain friction whose angle of repose is the measured one, by halving between rolling frictions; the nearest
/// end where it is not between them.
pub fn with_repose(friction: f64, radius: f64, threads: usize, store: &mut Store) -> Outcome<Option<Sand>> {
    let sand = |rolling: f64| Sand { radius, friction, rolling, density: BULK / 0.6, wheel: 0.3, laying: 1.0 };
    let mut angle = |rolling: f64| -> Outcome<Option<f64>> {
        let made = store.get(&format!("repose {friction} {rolling}"), || {
            // Mean of two heaps: one of a few thousand grains scatters by a degree.
            let mut sum = 0.0;
            for seed in [1, 2] {
                let mut spec: Terrain = serde_json::from_value(sand(rolling).specification(2e6))?;
                spec.bed.seed = seed;
                sum += repose(&Soil::new(&spec), threads, &mut |_, _| true)?.angle.to_degrees();
            }
            Ok(json!({"angle_deg": 0.5 * sum}))
        })?;
        Ok(made.and_then(|m| m["angle_deg"].as_f64()))
    };
    let (mut low, mut high) = (0.0, 0.8);
    for _ in 0..4 {
        let middle = 0.5 * (low + high);
        let Some(at) = angle(middle)? else { return Ok(None) };
        if at > REPOSE { high = middle } else { low = middle }
    }
    let rolling = 0.5 * (low + high);
    Ok(Some(sand(rolling)))
}

/// The sand laid with this factor on its frictions: its grains weigh what gives the measured bulk density.
pub fn laid(sand: &Sand, laying: f64, threads: usize, store: &mut Store) -> Outcome<Option<Sand>> {
    let sand = Sand { laying, ..*sand };
    let made = store.get(&format!("packing {} {} {laying}", sand.friction, sand.rolling), || {
        let spec: Terrain = serde_json::from_value(sand.specification(2e6))?;
        let (_, fraction) = packing(&Soil::new(&spec), threads, &mut |_, _| true)?;
        Ok(json!({"fraction": fraction, "friction": sand.friction, "rolling": sand.rolling, "laying": laying}))
    })?;
    let fraction = made.and_then(|m| m["fraction"].as_f64());
    Ok(fraction.map(|f| Sand { density: BULK / f, ..sand }))
}
