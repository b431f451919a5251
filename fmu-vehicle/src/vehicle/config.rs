//! Specification of a vehicle: chassis, axles, steering, driveline and powertrain, each in place or in a file of its own.

use super::part::{Part, Place};
use crate::driveline::Driveline;
use crate::powertrain::Powertrain;
use crate::steering::Steering;
use crate::suspension::Suspension;
use crate::suspension::elements::MassSpec;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;

/// A vehicle. Frame: X forward, Y left, Z up, origin at the chassis's reference point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VehicleSpec {
    /// Name.
    pub name: String,
    /// Where the numbers come from.
    #[serde(default)]
    pub source: String,
    /// Chassis.
    pub chassis: ChassisSpec,
    /// Masses fixed to the chassis that belong to this vehicle, besides those of the unit's specification.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub payload: Vec<Payload>,
    /// Axles from front to rear; wheels are numbered left, right of the first axle, left, right of the second, ...
    pub axles: Vec<AxleSpec>,
    /// Steerings; axles refer to them by number.
    #[serde(default)]
    pub steering: Vec<Part<Steering>>,
    /// Driveline; without one the wheels turn freely.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub driveline: Option<Part<Driveline>>,
    /// Powertrain; needs a driveline.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub powertrain: Option<Part<Powertrain>>,
    /// Aerodynamic drag on the chassis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drag: Option<DragSpec>,
}

/// Chassis with all that is fixed to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChassisSpec {
    /// Mass (kg), above 0.
    pub mass: f64,
    /// Centre of mass (m).
    pub com: [f64; 3],
    /// Moments of inertia xx, yy, zz about the centre of mass (kg m2).
    pub inertia: [f64; 3],
    /// Products of inertia xy, xz, yz (kg m2), as they stand in the matrix.
    #[serde(default)]
    pub products: [f64; 3],
}

/// An axle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxleSpec {
    /// Origin of the suspension's points in the chassis (m).
    pub origin: [f64; 3],
    /// Suspension.
    pub suspension: Part<Suspension>,
    /// Number of the steering its tie rods are fixed to, from 1; without one they are fixed to the chassis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steering: Option<usize>,
    /// Wheels of this axle, without tires.
    pub wheel: WheelSpec,
    /// Brakes of this axle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub brake: Option<BrakeSpec>,
}

/// A wheel without tire; mass and inertia are added to the spindle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WheelSpec {
    /// Mass (kg), at least 0.
    pub mass: f64,
    /// Moments of inertia about the wheel centre (kg m2); y is the axis of rotation.
    pub inertia: [f64; 3],
    /// Radius of the tire (m) that the vehicle is placed with unless the parameter `wheel[i].tire_radius` says otherwise.
    pub tire_radius: f64,
}

/// Brakes: dry friction between spindle and upright.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BrakeSpec {
    /// Torque limit of each wheel at braking input 1 (N m), at least 0.
    pub max_torque: f64,
}

/// A mass fixed to the chassis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Payload {
    /// Mass (kg), at least 0.
    pub mass: f64,
    /// Place of its centre of mass in the chassis frame (m).
    pub position: [f64; 3],
    /// Moments of inertia about it (kg m2).
    #[serde(default)]
    pub inertia: [f64; 3],
}

impl Payload {
    /// Collects what is wrong with a list of payloads that stands at `path`.
    pub fn check_all(list: &[Self], path: &str, f: &mut Faults) {
        for (k, p) in list.iter().enumerate() {
            f.not_negative(&format!("{path}payload[{k}].mass"), p.mass);
            for (i, x) in p.inertia.iter().enumerate() {
                f.not_negative(&format!("{path}payload[{k}].inertia[{i}]"), *x);
            }
            for (i, x) in p.position.iter().enumerate() {
                f.check(x.is_finite(), &format!("{path}payload[{k}].position[{i}]"), x, "a finite number");
            }
        }
    }
}

/// Drag force 1/2 rho Cd A v^2 at the chassis's centre of mass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DragSpec {
    /// Drag coefficient, at least 0.
    pub coefficient: f64,
    /// Frontal area (m2), at least 0.
    pub area: f64,
    /// Density of air (kg/m3), at least 0.
    pub air_density: f64,
}

impl VehicleSpec {
    /// Replaces names of files by their content.
    pub fn resolve(&mut self, place: &Place, path: &str, f: &mut Faults) {
        for (k, a) in self.axles.iter_mut().enumerate() {
            a.suspension.resolve(place, &format!("{path}axles[{k}].suspension"), f, |_, _, _, _| {});
        }
        for (k, s) in self.steering.iter_mut().enumerate() {
            s.resolve(place, &format!("{path}steering[{k}]"), f, |_, _, _, _| {});
        }
        if let Some(p) = &mut self.driveline {
            p.resolve(place, &format!("{path}driveline"), f, |_, _, _, _| {});
        }
        if let Some(p) = &mut self.powertrain {
            p.resolve(place, &format!("{path}powertrain"), f, |_, _, _, _| {});
        }
    }

    /// Collects everything that is wrong with a resolved vehicle.
    pub fn check(&self, path: &str, f: &mut Faults) {
        let c = &self.chassis;
        MassSpec { mass: c.mass, inertia: c.inertia }.check(&format!("{path}chassis"), f);
        Payload::check_all(&self.payload, path, f);
        f.check(!self.axles.is_empty(), &format!("{path}axles"), "empty", "at least one axle");
        for (k, a) in self.axles.iter().enumerate() {
            let p = format!("{path}axles[{k}]");
            if let Part::Inline(s) = &a.suspension {
                let (name, t) = s.template();
                t.check(&format!("{p}.suspension.{name}"), f);
            }
            if let Some(n) = a.steering {
                f.check(
                    n >= 1 && n <= self.steering.len(),
                    &format!("{p}.steering"),
                    n,
                    &format!("1 to {} (the number of steerings), or left out", self.steering.len()),
                );
            }
            f.not_negative(&format!("{p}.wheel.mass"), a.wheel.mass);
            for (i, x) in a.wheel.inertia.iter().enumerate() {
                f.not_negative(&format!("{p}.wheel.inertia[{i}]"), *x);
            }
            f.positive(&format!("{p}.wheel.tire_radius"), a.wheel.tire_radius);
            if let Some(b) = a.brake {
                f.not_negative(&format!("{p}.brake.max_torque"), b.max_torque);
            }
        }
        for (k, s) in self.steering.iter().enumerate() {
            if let Part::Inline(s) = s {
                let (name, t) = s.template();
                t.check(&format!("{path}steering[{k}].{name}"), f);
            }
        }
        if let Some(Part::Inline(d)) = &self.driveline {
            let (name, t) = d.template();
            t.check(&format!("{path}driveline.{name}"), self.axles.len(), f);
        }
        if let Some(Part::Inline(p)) = &self.powertrain {
            p.check(&format!("{path}powertrain"), f);
            match &self.driveline {
                None => f.add(format!("'{path}powertrain' needs a driveline")),
                Some(Part::Inline(d)) => {
                    if matches!((&**d, &**p), (Driveline::Simple(_), Powertrain::Shafts(_))) {
                        f.add(format!(
                            "'{path}powertrain.shafts' needs a driveline with shafts; 'simple' goes with 'map'"
                        ));
                    }
                }
                Some(_) => {}
            }
        }
        if let Some(d) = &self.drag {
            f.not_negative(&format!("{path}drag.coefficient"), d.coefficient);
            f.not_negative(&format!("{path}drag.area"), d.area);
            f.not_negative(&format!("{path}drag.air_density"), d.air_density);
        }
    }
}
