//! Specification of the unit: which vehicle, where it starts, who drives.

use super::config::{Payload, VehicleSpec};
use super::part::{Part, Place};
use crate::driver::DriverSpec;
use crate::powertrain::Mode;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::UnitError;
use terramech_fmi2::specification::Faults;

/// Specification of the unit `vehicle`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UnitSpec {
    /// The vehicle: in place, a file, or one that comes with the library: `hmmwv/vehicle.json`,
    /// `hmmwv/vehicle_2550.json` (with the payload that brings it to 2,550 kg), `hmmwv/vehicle_2018.json`.
    #[serde(default = "hmmwv")]
    pub vehicle: Part<VehicleSpec>,
    /// Masses fixed to the chassis besides the vehicle's own.
    #[serde(default)]
    pub payload: Vec<Payload>,
    /// Place and motion at the start.
    #[serde(default)]
    pub start: StartSpec,
    /// The vehicle held and lowered onto the ground at the start.
    #[serde(default)]
    pub hold: HoldSpec,
    /// Driver.
    #[serde(default)]
    pub driver: DriverSpec,
    /// Tires of the model `vehicle_handling`; the model `vehicle` checks and leaves them.
    #[serde(default)]
    pub tires: super::tires::TiresSpec,
    /// Longest inner step (s), above 0, at most 0.01.
    #[serde(default = "inner_step")]
    pub step: f64,
    /// Angular natural frequency (rad/s) of the critically damped servo that turns the steering to its input, 5 to 500.
    #[serde(default = "steering_frequency")]
    pub steering_frequency: f64,
}

fn hmmwv() -> Part<VehicleSpec> {
    Part::File("hmmwv/vehicle.json".into())
}
fn inner_step() -> f64 {
    1e-3
}
fn steering_frequency() -> f64 {
    100.0
}

impl Default for UnitSpec {
    fn default() -> Self {
        Self {
            vehicle: hmmwv(),
            payload: Vec::new(),
            start: StartSpec::default(),
            hold: HoldSpec::default(),
            driver: DriverSpec::default(),
            tires: super::tires::TiresSpec::default(),
            step: inner_step(),
            steering_frequency: steering_frequency(),
        }
    }
}

/// Place and motion at the start. The height follows from `ground_height` and the tires' radii.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StartSpec {
    /// X of the chassis's reference point (m).
    pub x: f64,
    /// Y of the chassis's reference point (m).
    pub y: f64,
    /// Heading about Z (rad), 0 along X.
    pub heading: f64,
    /// Forward speed (m/s), wheels rolling.
    pub speed: f64,
    /// Gap between undeformed tires and ground (m), -0.5 to 10: positive for a drop, negative for tires that start with that deflection.
    pub clearance: f64,
    /// Selector of the gearbox.
    pub gear: Mode,
}

/// Brakes locked and chassis damped until the wheels carry the weight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct HoldSpec {
    /// Longest time held (s); 0: the vehicle is not held.
    pub duration: f64,
    /// Damping of the chassis against the ground (1/s, per chassis mass).
    pub damping: f64,
    /// Released earlier once the wheels' vertical forces sum to the weight within this share for 0.2 s.
    pub tolerance: f64,
}

impl Default for HoldSpec {
    fn default() -> Self {
        Self { duration: 0.0, damping: 10.0, tolerance: 0.02 }
    }
}

impl UnitSpec {
    /// Reads the files it names and checks everything; all faults at once.
    ///
    /// # Errors
    /// [`UnitError::Input`] with file and JSON path of each fault.
    pub fn complete(&mut self, place: &Place, origin: &str) -> Result<(), UnitError> {
        let mut f = Faults::new();
        self.vehicle.resolve(place, "vehicle", &mut f, |v, inner, path, f| v.resolve(inner, &format!("{path}: "), f));
        self.driver.resolve(place, "driver", &mut f);
        self.tires.resolve(place, "tires", &mut f);
        if let Err(e) = self.tires.build() {
            f.add(e.to_string());
        }
        if let Part::Inline(v) = &self.vehicle {
            v.check("vehicle.", &mut f);
        }
        Payload::check_all(&self.payload, "", &mut f);
        self.driver.check("driver", &mut f);
        self.check_numbers(&mut f);
        f.into_result(origin)
    }

    fn check_numbers(&self, f: &mut Faults) {
        let s = &self.start;
        for (name, x) in [("x", s.x), ("y", s.y), ("heading", s.heading), ("speed", s.speed)] {
            f.check(x.is_finite(), &format!("start.{name}"), x, "a finite number");
        }
        f.within("start.clearance", s.clearance, -0.5, 10.0);
        f.not_negative("hold.duration", self.hold.duration);
        f.not_negative("hold.damping", self.hold.damping);
        f.within("hold.tolerance", self.hold.tolerance, 0.0, 1.0);
        f.check(self.step > 0.0 && self.step <= 0.01, "step", self.step, "above 0, at most 0.01 s");
        f.within("steering_frequency", self.steering_frequency, 5.0, 500.0);
    }
}
