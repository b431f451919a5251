//! From a specification to a multibody system.

use super::config::{Payload, VehicleSpec};
use super::dynamics::{DriverInputs, WheelWrench};
use super::energy::Outside;
use crate::driveline::DrivelineBuilt;
use crate::mbs::primitive::DriveId;
use crate::mbs::{BodyId, FrictionId, MbsError, Model, System};
use crate::powertrain::{Engine, EngineOutputs, GearState, Mode};
use crate::steering::SteeringBuilt;
use crate::suspension::{AxleContext, Corner};
use terramech_mechanics::{Mat3, Quat, Vec3};

/// What a tire adds to a wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hub {
    /// Mass (kg).
    pub mass: f64,
    /// Moments of inertia about the wheel centre (kg m2), wheel axes.
    pub inertia: [f64; 3],
    /// Radius (m) to place the vehicle with; 0: that of the specification.
    pub tire_radius: f64,
}

/// Progress of a steering: where the prescribed motion is, as a fraction of full, and its rate (1/s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SteeringMotion {
    pub value: f64,
    pub rate: f64,
}

/// A vehicle ready to move.
#[derive(Clone, Debug)]
pub struct Vehicle {
    /// The multibody system.
    pub system: System,
    pub(crate) chassis: BodyId,
    /// `p_CR`: the chassis's reference point from its centre of mass (payload included), chassis axes (m).
    pub(crate) reference: Vec3,
    /// Wheels left, right of axle 1, left, right of axle 2, ...
    pub(crate) wheels: Vec<Corner>,
    /// Radius of each tire (m).
    pub(crate) radius: Vec<f64>,
    pub(crate) brakes: Vec<Option<(FrictionId, f64)>>,
    pub(crate) steering: Vec<SteeringBuilt>,
    pub(crate) driveline: Option<DrivelineBuilt>,
    pub(crate) engine: Option<Engine>,
    pub(crate) drag: f64,
    /// Angular natural frequency of the steering servo (rad/s).
    pub(crate) steering_frequency: f64,
    /// Supports of the wheels in the search for equilibrium.
    pub(crate) supports: Vec<DriveId>,
    /// Inputs of the driver.
    pub inputs: DriverInputs,
    /// Wrench on each wheel about its centre.
    pub wrenches: Vec<WheelWrench>,
    // State besides the system's.
    pub(crate) gear: GearState,
    pub(crate) steering_motion: Vec<SteeringMotion>,
    /// Viscous drag on the chassis while it is lowered (1/s), otherwise 0.
    pub(crate) damping: f64,
    pub(crate) brakes_locked: bool,
    /// Of the last step, for outputs.
    pub(crate) last_step: f64,
    pub(crate) engine_outputs: EngineOutputs,
    /// Work of what acts on the system from outside.
    pub(crate) outside: Outside,
}

/// Mass, centre and inertia about it of a chassis with payloads.
fn chassis_with(spec: &VehicleSpec, payload: &[Payload]) -> (f64, Vec3, Mat3) {
    let c = &spec.chassis;
    let [xy, xz, yz] = c.products;
    let own = Mat3::new(c.inertia[0], xy, xz, xy, c.inertia[1], yz, xz, yz, c.inertia[2]);
    let parts: Vec<(f64, Vec3, Mat3)> = std::iter::once((c.mass, Vec3::from(c.com), own))
        .chain(
            spec.payload
                .iter()
                .chain(payload)
                .map(|p| (p.mass, p.position.into(), Mat3::from_diagonal(&p.inertia.into()))),
        )
        .collect();
    let mass: f64 = parts.iter().map(|p| p.0).sum();
    let com = parts.iter().map(|p| p.1 * p.0).sum::<Vec3>() / mass;
    let inertia = parts
        .iter()
        .map(|(m, p, i)| {
            let d = p - com;
            i + (Mat3::identity() * d.norm_squared() - d * d.transpose()) * *m
        })
        .sum();
    (mass, com, inertia)
}

impl Vehicle {
    /// Assembles a checked and resolved specification. `hubs`: what the tires add, one per wheel or none. `supported` adds supports under
    /// the wheels, for the search for equilibrium.
    ///
    /// # Errors
    /// Joints that do not close, redundant constraints, impossible bodies.
    pub fn build(
        spec: &VehicleSpec,
        payload: &[Payload],
        hubs: &[Hub],
        mode: Mode,
        supported: bool,
    ) -> Result<Self, MbsError> {
        let mut m = Model::new();
        let (mass, com, inertia) = chassis_with(spec, payload);
        let chassis = m.body("chassis", mass, inertia, com, Quat::identity());
        m.hub(chassis);
        m.carrier = chassis;
        let steering: Vec<SteeringBuilt> = spec
            .steering
            .iter()
            .enumerate()
            .map(|(k, s)| s.get().template().1.build(&mut m, &format!("steering {}", k + 1), chassis))
            .collect();
        let mut corners: Vec<[Corner; 2]> = Vec::new();
        let (mut brakes, mut radius) = (Vec::new(), Vec::new());
        for (k, axle) in spec.axles.iter().enumerate() {
            let context = AxleContext {
                name: format!("axle {}", k + 1),
                origin: axle.origin.into(),
                chassis,
                tie_rod: axle.steering.map_or(chassis, |n| steering[n - 1].link),
            };
            let pair = axle.suspension.get().template().1.build(&mut m, &context);
            for (side, c) in pair.iter().enumerate() {
                let hub = hubs.get(2 * k + side).copied().unwrap_or_default();
                let own = Mat3::from_diagonal(&axle.wheel.inertia.into()) + Mat3::from_diagonal(&hub.inertia.into());
                m.add_mass(c.spindle, axle.wheel.mass + hub.mass, own);
                let axis = m.direction(c.spindle, &Vec3::y());
                brakes.push(axle.brake.map(|b| (m.friction(c.upright, c.spindle, &axis), b.max_torque)));
                radius.push(if hub.tire_radius > 0.0 { hub.tire_radius } else { axle.wheel.tire_radius });
            }
            corners.push(pair);
        }
        let powertrain = spec.powertrain.as_ref().map(super::Part::get);
        let line = spec.driveline.as_ref().map(|d| d.get().template().1);
        let driven = line.map_or(vec![], |d| d.driven());
        for (k, pair) in corners.iter().enumerate() {
            if !driven.contains(&(k + 1)) {
                // Axle shafts that nothing drives turn with their spindles.
                for c in pair {
                    m.add_mass(c.spindle, 0.0, Mat3::from_diagonal(&Vec3::new(0.0, c.axle_inertia, 0.0)));
                }
            }
        }
        let driveline = line.map(|d| d.build(&mut m, &corners, powertrain.map_or(0.0, |p| p.output_inertia())));
        let engine = powertrain.zip(driveline.as_ref()).map(|(p, d)| p.build(&mut m, d));
        let wheels: Vec<Corner> = corners.into_iter().flatten().collect();
        let supports = if supported {
            wheels.iter().enumerate().map(|(i, c)| m.support(&support_name(i), c.spindle, &c.center)).collect()
        } else {
            Vec::new()
        };
        let n = wheels.len();
        let mut system = m.build()?;
        let gear = GearState::start(mode);
        if let Some(e) = &engine {
            e.engage(&gear, &mut system)?;
        }
        if let Some(DrivelineBuilt::Shafts { locks, .. }) = &driveline {
            locks.iter().for_each(|(f, limit)| system.set_friction(*f, *limit));
        }
        let steering_motion = vec![SteeringMotion::default(); steering.len()];
        Ok(Self {
            system,
            chassis,
            reference: -com,
            wheels,
            radius,
            brakes,
            steering,
            driveline,
            engine,
            drag: spec.drag.map_or(0.0, |d| 0.5 * d.air_density * d.coefficient * d.area),
            steering_frequency: 100.0,
            supports,
            inputs: DriverInputs::default(),
            wrenches: vec![WheelWrench::default(); n],
            gear,
            steering_motion,
            damping: 0.0,
            brakes_locked: false,
            last_step: 1.0,
            engine_outputs: EngineOutputs::default(),
            outside: Outside::default(),
        })
    }

    /// Number of wheels.
    pub fn wheel_count(&self) -> usize {
        self.wheels.len()
    }
    /// A wheel's end of the suspension.
    pub fn corner(&self, wheel: usize) -> &Corner {
        &self.wheels[wheel]
    }
    /// The chassis.
    pub fn chassis(&self) -> BodyId {
        self.chassis
    }
    /// Radius of a wheel's tire (m).
    pub fn tire_radius(&self, wheel: usize) -> f64 {
        self.radius[wheel]
    }
}

/// Name of a wheel's support.
pub(crate) fn support_name(wheel: usize) -> String {
    format!("support of wheel {}", wheel + 1)
}
