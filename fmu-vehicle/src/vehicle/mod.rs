//! A vehicle made of templates, and the unit `vehicle`.
//!
//! A vehicle is JSON ([`config`]): chassis, axles with a suspension, steering, driveline and powertrain, each by the name of its
//! template, in place or in a file of its own. [`build`] assembles it, [`place`] finds its rest, [`dynamics`] moves it; [`mod@unit`] is the
//! interface.
//!
//! # Signs
//! X forward, Y left, Z up. Wheels roll forward with a positive speed about +Y. Steering +1 is full left. A spring's tension is
//! positive; roll is positive to the right, pitch positive nose down (right-handed about X and Y).

pub mod build;
pub mod config;
pub mod dynamics;
mod load;
pub mod part;
pub mod place;
pub mod specification;
pub mod tires;
pub mod unit;
pub mod variables;

pub use build::{Hub, Vehicle};
pub use config::{Payload, VehicleSpec};
pub use dynamics::{DriverInputs, WheelWrench};
pub use part::{Part, Place};
pub use specification::UnitSpec;

use terramech_fmi2::Model;

/// The specification that a fresh FMU carries: the HMMWV with external driver.
pub fn default_specification() -> String {
    serde_json::to_string_pretty(&UnitSpec::default()).expect("plain data serialises")
}

/// The model `vehicle`.
pub fn model() -> Model {
    let (table, vars) = variables::declare(false);
    let mut model = Model::new(
        "vehicle",
        "Wheeled vehicle: multibody suspensions, steering, driveline, powertrain, driver",
        table,
        move || Box::new(unit::VehicleUnit::new(vars.clone())),
    );
    model.default_stop = 10.0;
    model.weight = 1.0;
    model.default_specification = default_specification();
    model.schema = schemars::schema_for!(UnitSpec).to_value();
    model.documentation = DOCUMENTATION.into();
    model
}

/// The model `vehicle_handling`: the vehicle with tires inside, on a rigid plane.
pub fn handling_model() -> Model {
    let (table, vars) = variables::declare(true);
    let mut model = Model::new(
        "vehicle_handling",
        "Wheeled vehicle with its own tires on a rigid plane: handling studies in any FMI tool",
        table,
        move || Box::new(unit::VehicleUnit::new(vars.clone())),
    );
    model.default_stop = 10.0;
    model.weight = 1.0;
    model.default_specification = default_specification();
    model.schema = schemars::schema_for!(UnitSpec).to_value();
    model.documentation = format!("{DOCUMENTATION}\n\n{HANDLING}");
    model
}

const HANDLING: &str = "With the parameter tires = internal (the start value) the vehicle carries tires of the specification's element \
tires: rigid, fiala (the HMMWV's by default) or pac02, on a level plane at ground_height; wrenches on the wheels are added to theirs. With tires = \
external it is the model vehicle.";

const DOCUMENTATION: &str = "A wheeled vehicle: rigid bodies and joints solved directly, one-dimensional shafts, engine and gearbox by maps, a \
driver. It gives the states of its wheels and takes the wrenches on them; the tires hand over mass and inertia of what moves with \
the wheels by the parameters hub_mass and hub_inertia.

At the start the static equilibrium on level ground is found, and the vehicle is placed with its wheel centres at ground_height plus the tires' radii. \
load_mass tells what each wheel carries. With hold.duration above 0 the brakes are locked and the chassis is damped until the wheels \
carry the weight.

The default specification is the HMMWV of Project Chrono (hmmwv/vehicle.json; with the values of 2018: hmmwv/vehicle_2018.json). A payload is \
given by mass and position: 107.9 kg bring the vehicle with layered flexible tires to 2,550 kg.";
