//! Powertrain by maps alone: engine speed follows the driveshaft through the gear; no inertia, no converter.

use super::gearbox::GearState;
use super::{EngineOutputs, Powers, RPM};
use crate::driveline::DrivelineBuilt;
use crate::mbs::{BodyId, Loads, Model, Table, View};
use crate::suspension::elements::check_table;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;

/// Specification of the map powertrain; ratios are output over input speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapPowertrain {
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// Greatest engine speed (revolutions per minute).
    pub max_speed: f64,
    /// Points (revolutions per minute, N m) at full throttle.
    pub full_throttle: Vec<[f64; 2]>,
    /// Points (revolutions per minute, N m) at zero throttle.
    pub zero_throttle: Vec<[f64; 2]>,
    /// Forward ratios, rising.
    pub forward: Vec<f64>,
    /// Reverse ratio, negative.
    pub reverse: f64,
    /// Down and up shift speeds (revolutions per minute) of each forward gear.
    pub shift_points: Vec<[f64; 2]>,
    /// Least time between shifts (s).
    #[serde(default)]
    pub latency: f64,
}

impl MapPowertrain {
    /// Collects faults.
    pub fn check(&self, path: &str, f: &mut Faults) {
        f.positive(&format!("{path}.max_speed"), self.max_speed);
        check_table(&format!("{path}.full_throttle"), &self.full_throttle, f);
        check_table(&format!("{path}.zero_throttle"), &self.zero_throttle, f);
        let rising = self.forward.windows(2).all(|w| w[1] > w[0]) && self.forward.first().is_some_and(|x| *x > 0.0);
        f.check(
            rising,
            &format!("{path}.forward"),
            format!("{:?}", self.forward),
            "one ratio at least, above 0 and rising",
        );
        f.check(self.reverse < 0.0, &format!("{path}.reverse"), self.reverse, "a negative number");
        f.check(
            self.shift_points.len() == self.forward.len() && self.shift_points.iter().all(|p| p[0] < p[1]),
            &format!("{path}.shift_points"),
            format!("{:?}", self.shift_points),
            "for each forward gear a down and a higher up shift speed",
        );
        f.not_negative(&format!("{path}.latency"), self.latency);
    }

    pub(super) fn build(&self, m: &Model) -> MapEngine {
        MapEngine {
            carrier: m.carrier,
            full: Table::scaled(&self.full_throttle, RPM, 1.0).expect("checked"),
            zero: Table::scaled(&self.zero_throttle, RPM, 1.0).expect("checked"),
            spec: self.clone(),
        }
    }
}

/// The map powertrain at run time.
#[derive(Clone, Debug)]
pub struct MapEngine {
    full: Table,
    zero: Table,
    /// What the reaction of the torque acts on.
    carrier: BodyId,
    spec: MapPowertrain,
}

impl MapEngine {
    fn ratio(&self, gear: i32) -> Option<f64> {
        match gear {
            0 => None,
            g if g < 0 => Some(self.spec.reverse),
            g => Some(self.spec.forward[(g as usize - 1).min(self.spec.forward.len() - 1)]),
        }
    }

    /// Engine speed and torque for the driveshaft's speed.
    fn engine(&self, throttle: f64, gear: &GearState, driveshaft: f64) -> (f64, f64) {
        let w = self.ratio(gear.gear).map_or(0.0, |r| driveshaft / r).clamp(0.0, self.spec.max_speed * RPM);
        (w, throttle * self.full.at(w) + (1.0 - throttle) * self.zero.at(w))
    }

    pub(super) fn roll(&self, gear: &mut GearState, driveshaft: f64) {
        gear.select(driveshaft / RPM, &self.spec.forward, |k| self.spec.shift_points[k][1]);
    }

    pub(super) fn shift(&mut self, gear: &mut GearState, h: f64, driveshaft: f64) {
        let speed = self.ratio(gear.gear).map_or(0.0, |r| driveshaft / r) / RPM;
        let p = self.spec.shift_points[(gear.gear.max(1) as usize - 1).min(self.spec.shift_points.len() - 1)];
        gear.decide(h, speed, p[1], p[0], self.spec.latency, self.spec.forward.len());
    }

    pub(super) fn apply(
        &self,
        throttle: f64,
        gear: &GearState,
        line: &DrivelineBuilt,
        view: &View,
        loads: &mut Loads,
    ) -> Powers {
        let Some(ratio) = self.ratio(gear.gear) else { return Powers::default() };
        match line {
            DrivelineBuilt::Shafts { input, .. } => {
                let (_, torque) = self.engine(throttle, gear, view.shaft(*input));
                loads.shaft(*input, torque / ratio);
                loads.carrier.x -= torque / ratio;
                let engine = torque / ratio * (view.shaft(*input) - view.u[self.carrier.index()][3]);
                Powers { engine, transmission: 0.0 }
            }
            DrivelineBuilt::Simple(s) => {
                let speed = s.input_speed(view);
                let (_, torque) = self.engine(throttle, gear, speed);
                let engine = torque / ratio * speed;
                Powers { engine, transmission: s.apply(torque / ratio, view, loads) - engine }
            }
        }
    }

    pub(super) fn outputs(&self, throttle: f64, gear: &GearState, driveshaft: f64) -> EngineOutputs {
        let (speed, torque) = self.engine(throttle, gear, driveshaft);
        let output = self.ratio(gear.gear).map_or(0.0, |r| torque / r);
        EngineOutputs { speed, torque, converter_input: torque, turbine: torque, output }
    }
}
