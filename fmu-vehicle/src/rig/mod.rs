//! Model `rig`: a single driven wheel on a carriage.
//!
//! A carriage travels on rails along X. It carries a vertical slide with the load, and on it one wheel that a drive turns.
//! The wheel's heading may be turned about Z: the slip angle. The rig knows nothing of tire and soil: it gives the wheel's
//! state and takes a wrench.
//!
//! # A run
//! The wheel is placed a small gap above the settled ground. **Touchdown**: the slide gives way under the load, at most at a
//! set speed, against a damper, until the soil carries the load; the damper then fades out. No drop and no bounce, on soft
//! or rigid ground. Then a **delay**, a smooth **ramp** of all speeds, and the **drive**. An end stop bounds the slide where
//! no soil carries it.
//!
//! # Signs
//! Angular speed about +Y (left) rolls forward along +X. Slip is (omega R - v)/max(|omega R|, |v|) with v the carriage's
//! speed, at any slip angle. A heading turned to the left by a positive angle meets a soil force to the left of its heading.
//!
//! # Masses
//! What slides vertically weighs `load.mass` plus the tire's `hub_mass`, and moves by the soil's force less the load. Forces
//! come held over a communication step H, one step late (two, if a tire stands between); a contact stiffness K then acts
//! as a negative damping of about K H (2 K H), which the soil's own damping, or `slide.damping_rate`, has to outweigh.

pub mod average;
pub mod config;
pub mod dynamics;
pub mod motion;
mod unit;
pub mod variables;

pub use unit::RigUnit;

use terramech_fmi2::Model;

/// The specification that a fresh FMU carries: about the load of the single-wheel experiment, at slip 0.2.
pub fn default_specification() -> String {
    serde_json::to_string_pretty(&config::RigSpecification::default()).expect("plain data serialises")
}

/// The model.
pub fn model() -> Model {
    let (table, vars) = variables::declare();
    let mut model =
        Model::new("rig", "Single-wheel rig: carriage, vertical slide with load, driven wheel", table, move || {
            Box::new(RigUnit::new(vars.clone()))
        });
    model.default_stop = 2.0;
    model.weight = 0.5;
    model.default_specification = default_specification();
    model.schema = schemars::schema_for!(config::RigSpecification).to_value();
    model.documentation = DOCUMENTATION.into();
    model
}

const DOCUMENTATION: &str = "A carriage travels on rails along X. It carries a vertical slide with the load, and on it one wheel \
that a drive turns about its axle; its heading may be turned about Z by the slip angle (toe).

A run: the wheel is placed a small gap above the settled ground (ground_height), lowered at a set speed against a damper until \
the soil carries the load, released, and after a delay all speeds ramp up smoothly. Modes: imposed_slip, from the carriage's \
or the wheel's speed, and imposed_angular_speed, where the carriage is free and pulls against a resistance that grows until it \
stops (a whole pull-slip curve in one run; the unit then ends the run or holds).

load.force is the whole static load on the soil, weights included; with load.force 0 it is the weight of load.mass and the \
tire's hub mass. Every real element of the specification that a study varies is also a parameter of the same path, which \
overrides it.

drawbar_pull is the force of wheel and slide on the carriage along X: the soil's less the inertia of what slides; positive \
pulls forward. wheel_force is the soil's force in the heading frame. slip is (omega R - v)/max(|omega R|, |v|) with v the \
carriage's speed. sinkage is the settled height less the lowest point of the undeformed wheel. Each comes raw and as a \
running average over filter_window.";
