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
pub mod energy;
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

/// A model per number of axles, since an FMU's variables are fixed: wheels, name, default vehicle, description.
const MODELS: [(usize, &str, &str, &str); 3] = [
    (
        4,
        "vehicle",
        "hmmwv/vehicle.json",
        "Wheeled vehicle: multibody suspensions, steering, driveline, powertrain, driver",
    ),
    (6, "vehicle_6", "hmmwv/three_axles.json", "The model vehicle with three axles"),
    (8, "vehicle_8", "hmmwv/four_axles.json", "The model vehicle with four axles"),
];

/// For messages: which model has how many axles.
fn model_names() -> String {
    MODELS.map(|(wheels, name, ..)| format!("{name} ({} axles)", wheels / 2)).join(", ")
}

/// The specification that a fresh FMU of so many wheels carries: for four the HMMWV, external driver.
pub fn default_specification(wheels: usize) -> String {
    let mut spec = UnitSpec::default();
    if let Some((_, _, file, _)) = MODELS.iter().find(|m| m.0 == wheels) {
        spec.vehicle = Part::File((*file).into());
    }
    serde_json::to_string_pretty(&spec).expect("plain data serialises")
}

/// A model; with tires inside or without.
fn model_of(wheels: usize, with_tires: bool, name: &'static str, description: &'static str) -> Model {
    let (table, vars) = variables::declare(wheels, with_tires);
    let mut model = Model::new(name, description, table, move || Box::new(unit::VehicleUnit::new(vars.clone())));
    model.default_stop = 10.0;
    model.weight = 1.0;
    model.default_specification = default_specification(wheels);
    model.schema = schemars::schema_for!(UnitSpec).to_value();
    model.documentation = DOCUMENTATION.into();
    model
}

/// The models `vehicle` (two axles), `vehicle_6`, `vehicle_8`.
pub fn models() -> impl Iterator<Item = Model> {
    MODELS.into_iter().map(|(wheels, name, _, text)| model_of(wheels, false, name, text))
}

/// The model `vehicle`: two axles.
pub fn model() -> Model {
    models().next().expect("the list has it")
}

/// The model `vehicle_handling`: the vehicle with tires inside, on a rigid plane.
pub fn handling_model() -> Model {
    let text = "Wheeled vehicle with its own tires on a rigid plane: handling studies in any FMI tool";
    let mut model = model_of(4, true, "vehicle_handling", text);
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

The default specification is the HMMWV of Project Chrono (hmmwv/vehicle.json; with the payload that brings it to 2,550 kg on layered flexible tires: \
hmmwv/vehicle_2550.json; with the values of 2018: hmmwv/vehicle_2018.json). Further payload is given by mass and position. \
Vehicles of three and four axles are the models vehicle_6 and vehicle_8.";
