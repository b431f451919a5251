//! Tire units: the rigid wheel ([`rigid`]), the flexible tire ([`ancf`]), and Fiala's and Pacejka's tires for handling
//! ([`terramech_handling_tires`]).
//!
//! A tire stands between the vehicle and the terrain: it takes the state of a wheel, publishes its surface as a mesh for the
//! terrain, and turns the terrain's forces into the wrench on the wheel.
//!
//! ```
//! use terramech_fmi2::instance::Instance;
//! let mut tire = Instance::new(fmu_tire::rigid::model(), None, Box::new(|_, text| println!("{text}")));
//! let radius = tire.model().table.find("radius").unwrap().0;
//! tire.setup(0.0, None).unwrap();
//! tire.enter_initialization().unwrap();
//! assert_eq!(tire.real(radius).unwrap(), 0.058);
//! ```
#![forbid(unsafe_code)]

pub mod ancf;
pub mod rigid;

use terramech_fmi2::Model;

/// All models of this library; the GUID selects among them.
pub fn models() -> Vec<Model> {
    [rigid::model(), ancf::model()].into_iter().chain(terramech_handling_tires::unit::models()).collect()
}
