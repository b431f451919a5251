//! Driveline templates: from the gearbox's output shaft to the wheels.

mod four_wheel;
mod simple;
mod two_wheel;

pub use four_wheel::FourWheelShafts;
pub use simple::SimpleDriveline;
pub use two_wheel::TwoWheelShafts;

use crate::mbs::{BodyId, FrictionId, Loads, Model, ShaftId, View};
use crate::suspension::Corner;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::Vec3;

/// A driveline, by the name of its template.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Driveline {
    /// Shafts, conical gears and three open differentials.
    FourWheelShafts(FourWheelShafts),
    /// Shafts, one conical gear and one open differential.
    TwoWheelShafts(TwoWheelShafts),
    /// Torque split by fractions, without inertia.
    Simple(SimpleDriveline),
}

impl Driveline {
    /// The template behind the name.
    pub fn template(&self) -> (&'static str, &dyn DrivelineTemplate) {
        match self {
            Self::FourWheelShafts(s) => ("four_wheel_shafts", s),
            Self::TwoWheelShafts(s) => ("two_wheel_shafts", s),
            Self::Simple(s) => ("simple", s),
        }
    }
}

/// A driveline template.
pub trait DrivelineTemplate {
    /// Collects what is wrong with its numbers; `axles` is how many the vehicle has.
    fn check(&self, path: &str, axles: usize, faults: &mut Faults);
    /// The driven axles, counted from 1.
    fn driven(&self) -> Vec<usize>;
    /// Adds it to a model; `gearbox_inertia` (kg m2) is added to its input shaft.
    fn build(&self, model: &mut Model, corners: &[[Corner; 2]], gearbox_inertia: f64) -> DrivelineBuilt;
}

/// A driveline in a model.
#[derive(Clone, Debug)]
pub enum DrivelineBuilt {
    /// Shafts of the multibody system.
    Shafts {
        /// Where the gearbox's output acts.
        input: ShaftId,
        /// Differential locks with their torque limits (N m).
        locks: Vec<(FrictionId, f64)>,
    },
    /// Torques by fractions.
    Simple(SimpleRuntime),
}

/// The simple driveline at run time.
#[derive(Clone, Debug)]
pub struct SimpleRuntime {
    /// Per driven axle: its share of the torque, its gear ratio, its greatest torque bias, spindles left and right.
    pub(crate) axles: Vec<(f64, f64, f64, [BodyId; 2])>,
}

impl SimpleRuntime {
    fn speed(view: &View, body: BodyId) -> f64 {
        view.u[body.index()][4]
    }
    /// Speed of the input shaft (rad/s): the axles' mean.
    pub fn input_speed(&self, view: &View) -> f64 {
        let sum: f64 = self
            .axles
            .iter()
            .map(|(_, ratio, _, s)| (Self::speed(view, s[0]) + Self::speed(view, s[1])) / 2.0 / ratio)
            .sum();
        sum / self.axles.len() as f64
    }
    /// Torque (N m) at the input, spread to the wheels; a differential of limited slip favours the slower wheel by up to its bias.
    /// Gives the power at the wheels (W).
    pub fn apply(&self, torque: f64, view: &View, loads: &mut Loads) -> f64 {
        let mut power = 0.0;
        for (share, ratio, bias, s) in &self.axles {
            let axle = torque * share / ratio;
            let (l, r) = (Self::speed(view, s[0]), Self::speed(view, s[1]));
            // Full bias beyond a difference of 0.5 rad/s, none below 0.25.
            let blend = ((((l - r).abs()) - 0.25) / 0.25).clamp(0.0, 1.0);
            let slow = 0.5 + blend * (bias / (1.0 + bias) - 0.5);
            let (left, right) = if l.abs() <= r.abs() { (slow, 1.0 - slow) } else { (1.0 - slow, slow) };
            for (body, part) in [(s[0], left), (s[1], right)] {
                let t = view.pose(body).r * Vec3::new(0.0, axle * part, 0.0);
                loads.torque(body, view.pose(body), &t);
                power += axle * part * Self::speed(view, body);
            }
        }
        power
    }
}

/// Axle shafts of one axle, turned by its spindles.
pub(crate) fn axle_shafts(model: &mut Model, name: &str, corners: &[Corner; 2]) -> [ShaftId; 2] {
    [("left", 0), ("right", 1)].map(|(side, k)| {
        let c = &corners[k];
        let shaft = model.shafts.shaft(&format!("{name} {side} axle shaft"), c.axle_inertia);
        let axis = model.direction(c.spindle, &Vec3::y());
        model.couple(&format!("{name} {side} axle coupling"), c.spindle, &axis, shaft);
        shaft
    })
}
