//! Reading a vehicle: by name, by file, or in place.

use super::config::VehicleSpec;
use super::part::{Part, Place};
use terramech_fmi2::UnitError;
use terramech_fmi2::specification::Faults;

impl VehicleSpec {
    /// Reads, resolves and checks a vehicle that comes with the library, such as `hmmwv/vehicle.json`, or any file `place` has.
    ///
    /// # Errors
    /// All faults at once, with file and JSON path.
    pub fn read(name: &str, place: &Place) -> Result<Self, UnitError> {
        let mut part: Part<Self> = Part::File(name.into());
        let mut faults = Faults::new();
        part.resolve(place, "vehicle", &mut faults, |v, inner, path, f| v.resolve(inner, &format!("{path}: "), f));
        if let Part::Inline(v) = &part {
            v.check(&format!("{name}: "), &mut faults);
        }
        faults.into_result("vehicle")?;
        match part {
            Part::Inline(v) => Ok(*v),
            Part::File(name) => Err(UnitError::input(format!("vehicle '{name}' could not be read"))),
        }
    }
}
