//! A vehicle at rest: static equilibrium on its wheels, and its place in the world.

use super::build::{Hub, Vehicle, support_name};
use super::config::{Payload, VehicleSpec};
use crate::mbs::MbsError;
use crate::powertrain::Mode;
use terramech_mechanics::{Vec3, rotation};

/// Inner step of the search for equilibrium (s).
const STEP: f64 = 1e-3;
/// Drain of velocities (1/s): about critical for the body's modes of 1 to 2 Hz.
const DRAIN: f64 = 8.0;
/// Largest acceleration left (m/s2): loads are then exact to 1e-7.
const REST: f64 = 1e-6;
const MOST: usize = 20_000;

/// A vehicle at rest on level ground.
#[derive(Clone, Debug)]
pub struct Rest {
    /// The vehicle, wheel centres at the height of their tires' radii over z = 0.
    pub vehicle: Vehicle,
    /// Vertical load each wheel carries (N), at its centre: weight of wheel and tire included.
    pub loads: Vec<f64>,
    /// Largest acceleration left (m/s2).
    pub acceleration: f64,
}

impl Rest {
    /// Builds a vehicle and finds its static equilibrium: each wheel held at the height of its tire's radius by a frictionless support,
    /// the suspension under load.
    ///
    /// # Errors
    /// As [`Vehicle::build`]; [`MbsError::NoConvergence`] if the vehicle finds no rest.
    pub fn find(spec: &VehicleSpec, payload: &[Payload], hubs: &[Hub], mode: Mode) -> Result<Self, MbsError> {
        let mut vehicle = Vehicle::build(spec, payload, hubs, mode, false)?;
        let mut stand = Vehicle::build(spec, payload, hubs, Mode::Neutral, true)?;
        // The first wheel sets the height, the others differ from it by their radii.
        let z0 = stand.wheels[0].center.z - stand.radius[0];
        for i in 0..stand.wheels.len() {
            let offset = z0 + stand.radius[i] - stand.wheels[i].center.z;
            stand.system.set_drive(stand.supports[i], offset, 0.0);
        }
        stand.system.close()?;
        let found = stand.system.relax(STEP, DRAIN, REST, MOST, &mut |_, _| {})?;
        if found.acceleration > 1e-3 {
            return Err(MbsError::NoConvergence {
                joint: support_name(0),
                residual: found.acceleration,
                time: 0.0,
                iterations: found.steps,
                step: STEP,
            });
        }
        // One more step from rest gives the reactions.
        stand.system.step(STEP, &mut |_, _| {})?;
        let loads =
            (0..stand.wheels.len()).map(|i| stand.system.joint_impulses(&support_name(i))[0] / (0.5 * STEP)).collect();
        let bodies: Vec<_> = vehicle.system.all_bodies().map(|(b, _)| b).collect();
        for b in bodies {
            let m = *stand.system.motion(b);
            vehicle.system.set_motion(b, m);
        }
        vehicle.system.stop();
        vehicle.system.place(&Vec3::new(0.0, 0.0, -z0), &rotation::exp(&Vec3::zeros()));
        vehicle.system.close()?;
        Ok(Self { vehicle, loads, acceleration: found.acceleration })
    }
}

impl Vehicle {
    /// Moves the vehicle from where it is: turned by `heading` (rad) about Z through the origin, then shifted by `p` (m).
    pub fn place(&mut self, p: &Vec3, heading: f64) {
        self.system.place(p, &rotation::exp(&Vec3::new(0.0, 0.0, heading)));
    }

    /// Gives the vehicle a forward speed (m/s) along its heading, wheels rolling without slip on their tires' radii.
    ///
    /// # Errors
    /// [`MbsError::Singular`].
    pub fn launch(&mut self, speed: f64) -> Result<(), MbsError> {
        let q = self.system.motion(self.chassis).q;
        let x = q * Vec3::x();
        let forward = Vec3::new(x.x, x.y, 0.0).normalize() * speed;
        self.system.launch(&forward, &Vec3::zeros());
        for (c, r) in self.wheels.iter().zip(&self.radius) {
            let mut m = *self.system.motion(c.spindle);
            let axis = m.q * Vec3::y();
            m.set_velocity(&forward, &(axis * (speed / r)));
            self.system.set_motion(c.spindle, m);
        }
        self.system.roll_shafts();
        let input = self.driveshaft_speed();
        if let Some(e) = &self.engine {
            e.roll(&mut self.gear, &mut self.system, input)?;
        }
        self.system.project_velocities()
    }

    /// Locks the brakes (or releases them) whatever the driver does, and damps the chassis (1/s): a vehicle held and lowered.
    pub fn hold(&mut self, locked: bool, damping: f64) {
        self.brakes_locked = locked;
        self.damping = damping;
    }
}
