//! Powertrain templates: engine, converter, gearbox.

pub mod gearbox;
mod map;
mod shafts;
mod torque_converter;

pub use gearbox::{GearState, Mode};
pub use map::MapPowertrain;
pub use shafts::ShaftPowertrain;
pub use torque_converter::{ConverterSpec, TorqueConverter};

use crate::driveline::DrivelineBuilt;
use crate::mbs::{Loads, MbsError, Model, System, View};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;

/// Revolutions per minute to rad/s.
pub const RPM: f64 = std::f64::consts::PI / 30.0;

/// A powertrain, by the name of its template.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Powertrain {
    /// Engine map, torque converter and automatic gearbox with shaft inertias.
    Shafts(ShaftPowertrain),
    /// Engine map and automatic gearbox without inertia.
    Map(MapPowertrain),
}

impl Powertrain {
    /// Collects what is wrong with its numbers.
    pub fn check(&self, path: &str, f: &mut Faults) {
        match self {
            Self::Shafts(s) => s.check(&format!("{path}.shafts"), f),
            Self::Map(s) => s.check(&format!("{path}.map"), f),
        }
    }
    /// Inertia (kg m2) at the gearbox's output.
    pub fn output_inertia(&self) -> f64 {
        match self {
            Self::Shafts(s) => s.gearbox.output_inertia,
            Self::Map(_) => 0.0,
        }
    }
    /// Adds it to a model, behind its driveline.
    pub fn build(&self, m: &mut Model, driveline: &DrivelineBuilt) -> Engine {
        match self {
            Self::Shafts(s) => Engine::Shafts(s.build(m, driveline)),
            Self::Map(s) => Engine::Map(s.build(m)),
        }
    }
}

/// A powertrain at run time.
#[derive(Clone, Debug)]
pub enum Engine {
    /// See [`ShaftPowertrain`].
    Shafts(shafts::ShaftEngine),
    /// See [`MapPowertrain`].
    Map(map::MapEngine),
}

/// What a powertrain shows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EngineOutputs {
    /// Engine speed (rad/s).
    pub speed: f64,
    /// Engine torque, losses included (N m).
    pub torque: f64,
    /// Torque into the converter (N m), that of the engine without one.
    pub converter_input: f64,
    /// Torque of the converter's turbine (N m).
    pub turbine: f64,
    /// Torque at the gearbox's output (N m), without inertia.
    pub output: f64,
}

/// Powers of a powertrain (W).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Powers {
    /// Of the engine's torque, losses included.
    pub engine: f64,
    /// Of the torque converter, or of a driveline by fractions: minus what it takes away.
    pub transmission: f64,
}

impl Engine {
    /// Decides on the gear at the start of a step of `h` s.
    ///
    /// # Errors
    /// [`MbsError::Shafts`].
    pub fn shift(
        &mut self,
        gear: &mut GearState,
        h: f64,
        system: &mut System,
        input_speed: f64,
    ) -> Result<(), MbsError> {
        match self {
            Self::Shafts(e) => e.shift(gear, h, system),
            Self::Map(e) => {
                e.shift(gear, h, input_speed);
                Ok(())
            }
        }
    }
    /// Sets the multibody system's gear to that of a restored state.
    ///
    /// # Errors
    /// [`MbsError::Shafts`].
    pub fn engage(&self, gear: &GearState, system: &mut System) -> Result<(), MbsError> {
        match self {
            Self::Shafts(e) => e.engage(gear, system),
            Self::Map(_) => Ok(()),
        }
    }
    /// Chooses the gear for the speed the system has, and gives its shafts that speed.
    ///
    /// # Errors
    /// [`MbsError::Shafts`].
    pub fn roll(&self, gear: &mut GearState, system: &mut System, input_speed: f64) -> Result<(), MbsError> {
        match self {
            Self::Shafts(e) => e.roll(gear, system),
            Self::Map(e) => {
                e.roll(gear, input_speed);
                system.roll_shafts();
                Ok(())
            }
        }
    }
    /// Adds its torques at the given throttle; gives their powers.
    pub fn apply(
        &self,
        throttle: f64,
        gear: &GearState,
        line: &DrivelineBuilt,
        view: &View,
        loads: &mut Loads,
    ) -> Powers {
        match self {
            Self::Shafts(e) => e.apply(throttle, view, loads),
            Self::Map(e) => e.apply(throttle, gear, line, view, loads),
        }
    }
    /// Speeds and torques for a system's state.
    pub fn outputs(&self, throttle: f64, gear: &GearState, system: &System, input_speed: f64) -> EngineOutputs {
        match self {
            Self::Shafts(e) => e.outputs(throttle, gear, system),
            Self::Map(e) => e.outputs(throttle, gear, input_speed),
        }
    }
}
