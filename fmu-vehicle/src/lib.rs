//! Vehicle units: the single-wheel rig ([`rig`]) and the multibody vehicle ([`vehicle`]).
//!
//! A vehicle gives the states of its wheels and takes the wrenches on them; it knows nothing of tires and soil.
//!
//! ```
//! use terramech_fmi2::instance::Instance;
//! let mut rig = Instance::new(fmu_vehicle::rig::model(), None, Box::new(|_, text| println!("{text}")));
//! let z = rig.model().table.find("wheel[1].position.z").unwrap().0;
//! rig.setup(0.0, None).unwrap();
//! rig.enter_initialization().unwrap();
//! // Radius 58 mm and a gap of 5 mm above the ground at 0.
//! assert!((rig.real(z).unwrap() - 0.063).abs() < 1e-15);
//! ```
#![forbid(unsafe_code)]

pub mod driveline;
pub mod driver;
pub mod mbs;
pub mod powertrain;
pub mod rig;
pub mod steering;
pub mod suspension;
pub mod vehicle;

use terramech_fmi2::Model;

/// All models of this library; the GUID selects among them.
pub fn models() -> Vec<Model> {
    std::iter::once(rig::model()).chain(vehicle::models()).chain([vehicle::handling_model()]).collect()
}
