//! Engine with speed-torque map, torque converter and automatic gearbox on shafts with inertia.
//!
//! Speeds are relative to the engine and gearbox block, which is fixed to the chassis; the reaction of every torque acts on it.

use super::gearbox::GearState;
use super::torque_converter::{ConverterSpec, TorqueConverter};
use super::{EngineOutputs, Powers, RPM};
use crate::driveline::DrivelineBuilt;
use crate::mbs::shafts::GearId;
use crate::mbs::{BodyId, Loads, MbsError, Model, ShaftId, System, Table, View};
use crate::suspension::elements::check_table;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::Vec3;

/// Specification of the powertrain with shafts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShaftPowertrain {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// Engine.
    pub engine: EngineSpec,
    /// Torque converter.
    pub converter: ConverterSpec,
    /// Gearbox.
    pub gearbox: GearboxSpec,
}

/// Engine: torque = throttle x full(speed) + losses(speed), end values held outside the tables.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EngineSpec {
    /// Inertia of the block about the crankshaft's axis (kg m2), at least 0.
    pub block_inertia: f64,
    /// Inertia of crankshaft and flywheel (kg m2), above 0.
    pub inertia: f64,
    /// Points (speed in revolutions per minute, torque N m) at full throttle, speed rising.
    pub full_throttle: Vec<[f64; 2]>,
    /// Points (speed in revolutions per minute, torque N m) of losses, negative for a turning engine.
    pub losses: Vec<[f64; 2]>,
    /// Speed at the start (revolutions per minute).
    #[serde(default)]
    pub start_speed: f64,
}

/// Automatic gearbox; ratios are output over input speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GearboxSpec {
    /// Inertia of the block (kg m2), at least 0.
    pub block_inertia: f64,
    /// Inertia on the engine's side of the converter (kg m2), at least 0.
    pub input_inertia: f64,
    /// Inertia of the shaft from the converter into the gears (kg m2), above 0.
    pub ingear_inertia: f64,
    /// Inertia at the output (kg m2), at least 0.
    pub output_inertia: f64,
    /// Forward ratios, first gear first, rising.
    pub forward: Vec<f64>,
    /// Reverse ratio, negative.
    pub reverse: f64,
    /// Shift up above this speed of the ingear shaft (revolutions per minute).
    pub up_shift: f64,
    /// Shift down below this speed (revolutions per minute).
    pub down_shift: f64,
    /// Least time between shifts (s).
    pub latency: f64,
}

impl ShaftPowertrain {
    /// Collects faults.
    pub fn check(&self, path: &str, f: &mut Faults) {
        let (e, g) = (&self.engine, &self.gearbox);
        f.not_negative(&format!("{path}.engine.block_inertia"), e.block_inertia);
        f.positive(&format!("{path}.engine.inertia"), e.inertia);
        check_table(&format!("{path}.engine.full_throttle"), &e.full_throttle, f);
        check_table(&format!("{path}.engine.losses"), &e.losses, f);
        f.not_negative(&format!("{path}.engine.start_speed"), e.start_speed);
        self.converter.check(&format!("{path}.converter"), f);
        let p = format!("{path}.gearbox");
        f.not_negative(&format!("{p}.block_inertia"), g.block_inertia);
        f.not_negative(&format!("{p}.input_inertia"), g.input_inertia);
        f.positive(&format!("{p}.ingear_inertia"), g.ingear_inertia);
        f.not_negative(&format!("{p}.output_inertia"), g.output_inertia);
        let rising = g.forward.windows(2).all(|w| w[1] > w[0]) && g.forward.first().is_some_and(|x| *x > 0.0);
        f.check(rising, &format!("{p}.forward"), format!("{:?}", g.forward), "one ratio at least, above 0 and rising");
        f.check(g.reverse < 0.0 && g.reverse.is_finite(), &format!("{p}.reverse"), g.reverse, "a negative number");
        f.positive(&format!("{p}.up_shift"), g.up_shift);
        f.within(&format!("{p}.down_shift"), g.down_shift, 0.0, g.up_shift);
        f.not_negative(&format!("{p}.latency"), g.latency);
    }

    pub(super) fn build(&self, m: &mut Model, driveline: &DrivelineBuilt) -> ShaftEngine {
        let (e, g) = (&self.engine, &self.gearbox);
        let output = match driveline {
            DrivelineBuilt::Shafts { input, .. } => *input,
            // Checked where the vehicle is read.
            DrivelineBuilt::Simple(_) => m.shafts.shaft("gearbox output", g.output_inertia),
        };
        let x = Vec3::x();
        if e.block_inertia + g.block_inertia > 0.0 {
            let block = m.shafts.shaft("engine and gearbox block", e.block_inertia + g.block_inertia);
            m.shafts.fix("block mount", block, x);
        }
        let crank = m.shafts.shaft("crankshaft", e.inertia + g.input_inertia);
        let ingear = m.shafts.shaft("ingear shaft", g.ingear_inertia);
        let gear = m.shafts.gear("gearbox", ingear, output, g.forward[0], x, x);
        ShaftEngine {
            crank,
            ingear,
            output,
            gear,
            carrier: m.carrier,
            full: Table::scaled(&e.full_throttle, RPM, 1.0).expect("checked"),
            losses: Table::scaled(&e.losses, RPM, 1.0).expect("checked"),
            converter: self.converter.law(),
            spec: g.clone(),
        }
    }
}

/// The powertrain with shafts at run time.
#[derive(Clone, Debug)]
pub struct ShaftEngine {
    /// Crankshaft.
    pub crank: ShaftId,
    /// Shaft between converter and gears.
    pub ingear: ShaftId,
    /// Gearbox output.
    pub output: ShaftId,
    gear: GearId,
    carrier: BodyId,
    full: Table,
    losses: Table,
    converter: TorqueConverter,
    spec: GearboxSpec,
}

impl ShaftEngine {
    fn ratio(&self, gear: i32) -> Option<f64> {
        match gear {
            0 => None,
            g if g < 0 => Some(self.spec.reverse),
            g => Some(self.spec.forward[(g as usize - 1).min(self.spec.forward.len() - 1)]),
        }
    }

    pub(super) fn engage(&self, gear: &GearState, system: &mut System) -> Result<(), MbsError> {
        system.set_gear(self.gear, self.ratio(gear.gear), Vec3::x())
    }

    /// The gear for the system's speed, its shafts turning along, the engine at the converter's output speed.
    pub(super) fn roll(&self, gear: &mut GearState, system: &mut System) -> Result<(), MbsError> {
        system.roll_shafts();
        let output = system.shaft_speed(self.output) / RPM;
        gear.select(output, &self.spec.forward, |_| self.spec.up_shift);
        self.engage(gear, system)?;
        system.roll_shafts();
        system.set_shaft_speed(self.crank, system.shaft_speed(self.ingear).max(system.shaft_speed(self.crank)));
        Ok(())
    }

    pub(super) fn shift(&mut self, gear: &mut GearState, h: f64, system: &mut System) -> Result<(), MbsError> {
        let g = &self.spec;
        let speed = system.shaft_speed(self.ingear) / RPM;
        if gear.decide(h, speed, g.up_shift, g.down_shift, g.latency, g.forward.len()) {
            self.engage(gear, system)?;
        }
        Ok(())
    }

    /// Engine torque, converter's input and output torque at speeds relative to the block.
    fn torques(&self, throttle: f64, w_crank: f64, w_ingear: f64) -> (f64, f64, f64) {
        let engine = throttle * self.full.at(w_crank) + self.losses.at(w_crank);
        let (input, output) = self.converter.torques(w_crank, w_ingear);
        (engine, input, output)
    }

    pub(super) fn apply(&self, throttle: f64, view: &View, loads: &mut Loads) -> Powers {
        let block = view.u[self.carrier.index()][3];
        let (crank, ingear) = (view.shaft(self.crank) - block, view.shaft(self.ingear) - block);
        let (engine, input, output) = self.torques(throttle, crank, ingear);
        loads.shaft(self.crank, engine + input);
        loads.shaft(self.ingear, output);
        loads.carrier.x -= engine + input + output;
        Powers { engine: engine * crank, transmission: input * crank + output * ingear }
    }

    pub(super) fn outputs(&self, throttle: f64, gear: &GearState, system: &System) -> EngineOutputs {
        let block = system.motion(self.carrier).w_body().x;
        let speed = system.shaft_speed(self.crank) - block;
        let (torque, input, turbine) = self.torques(throttle, speed, system.shaft_speed(self.ingear) - block);
        let output = self.ratio(gear.gear).map_or(0.0, |r| turbine / r);
        EngineOutputs { speed, torque, converter_input: -input, turbine, output }
    }
}
