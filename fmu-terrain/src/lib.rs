//! Terrain units: granular soil by the discrete element method.
//!
//! [`dem`] is the granular engine, without FMI; [`mesh`] finds where grains touch triangle meshes; [`config`] and
//! [`variables`] are common to all terrains; [`soil`] holds virtual soil tests; [`dem_p`] is the model `terrain_dem_p`, [`rigid`] the model `terrain_rigid`.
//!
//! ```
//! use terramech_fmi2::instance::Instance;
//! let mut terrain = Instance::new(fmu_terrain::dem_p::model(), None, Box::new(|_, text| println!("{text}")));
//! let vr = |t: &Instance, name: &str| t.model().table.find(name).unwrap().0;
//! let (specification, height) = (vr(&terrain, "specification"), vr(&terrain, "height"));
//! terrain.set_string(specification, r#"{"bed": {"length": 0.1, "width": 0.06, "fill": {"depth": 0.03}}}"#).unwrap();
//! terrain.setup(0.0, None).unwrap();
//! terrain.enter_initialization().unwrap();
//! assert!((terrain.real(height).unwrap() - 0.027).abs() < 0.004);
//! terrain.exit_initialization().unwrap();
//! terrain.do_step(0.0, 1e-3).unwrap();
//! ```
#![forbid(unsafe_code)]

pub mod config;
pub mod dem;
pub mod dem_c;
pub mod dem_p;
pub mod error;
pub mod mesh;
pub mod rigid;
pub mod soil;
pub mod soil_engine;
pub mod variables;

use terramech_fmi2::Model;

/// All models of this library; the GUID selects among them.
pub fn models() -> Vec<Model> {
    vec![dem_p::model(), dem_c::model(), rigid::model()]
}
