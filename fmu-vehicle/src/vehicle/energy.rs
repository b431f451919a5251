//! The vehicle's energy: where it comes from and where it goes.
//!
//! ```text
//! engine work + wheel work = change of kinetic and potential energy + dissipated energy
//! ```
//!
//! closes to what the integrator makes or loses by itself (`fmu-vehicle/tests/vehicle_energy.rs`: 1e-8 of the work of the engine in a straight line, 5e-4 with steering and brakes).

use super::Vehicle;
use crate::mbs::{Loads, View};
use crate::powertrain::Powers;

/// Work on a vehicle since it was built (J).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Outside {
    /// Of the engine.
    engine: f64,
    /// Of converter and driveline: minus what they take away.
    transmission: f64,
    /// Of the forces on the wheels.
    wheels: f64,
    /// Of drag and of the damper that holds it.
    drag: f64,
    /// Of changes of gear: minus what meshing shafts of unequal speeds loses.
    shifts: f64,
    /// Kinetic energy and energy in gravity at the start.
    start: [f64; 2],
}

/// Numbers in a saved state.
pub(crate) const SAVED: usize = 7;

impl Outside {
    /// Adds powers (W) over a time (s): of the powertrain, of the forces on the wheels, of drag.
    pub(crate) fn add(&mut self, powers: Powers, wheels: f64, drag: f64, time: f64) {
        self.engine += time * powers.engine;
        self.transmission += time * powers.transmission;
        self.wheels += time * wheels;
        self.drag += time * drag;
    }

    pub(crate) fn to_array(self) -> [f64; SAVED] {
        [self.engine, self.transmission, self.wheels, self.drag, self.shifts, self.start[0], self.start[1]]
    }

    pub(crate) fn from_array(x: [f64; SAVED]) -> Self {
        let [engine, transmission, wheels, drag, shifts, kinetic, gravity] = x;
        Self { engine, transmission, wheels, drag, shifts, start: [kinetic, gravity] }
    }
}

/// Energies of a vehicle (J); works and what is dissipated count from [`Vehicle::start_energy`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energies {
    /// Work of the engine, losses included.
    pub engine: f64,
    /// Work of the forces on the wheels.
    pub wheels: f64,
    /// Kinetic energy of bodies and shafts.
    pub kinetic: f64,
    /// Energy in gravity and springs, less that at the start.
    pub potential: f64,
    /// Turned into heat by shock absorbers, torque converter, brakes, changes of gear and drag; less the work of the steering servo.
    pub dissipated: f64,
}

/// Power (W) of what `add` adds to the loads of some bodies.
pub(crate) fn power_of(
    bodies: impl Iterator<Item = crate::mbs::BodyId> + Clone,
    view: &View,
    loads: &mut Loads,
    add: impl FnOnce(&mut Loads),
) -> f64 {
    let power = |loads: &Loads| bodies.clone().map(|b| loads.power(b, view.u)).sum::<f64>();
    let before = power(loads);
    add(loads);
    power(loads) - before
}

impl Vehicle {
    /// Works count from here.
    pub fn start_energy(&mut self) {
        self.outside =
            Outside { start: [self.system.kinetic_energy(), self.system.gravity_energy()], ..Outside::default() };
        self.system.forget_work();
    }

    /// Its energies now.
    pub fn energies(&self) -> Energies {
        let (o, own) = (&self.outside, self.system.work_done());
        Energies {
            engine: o.engine,
            wheels: o.wheels,
            kinetic: self.system.kinetic_energy(),
            potential: self.system.gravity_energy() - o.start[1] - own.springs,
            dissipated: -(o.transmission + o.drag + o.shifts + own.shocks + own.friction + own.drives),
        }
    }

    /// Energy that has come in and is nowhere: the error of the integration (J).
    pub(crate) fn unaccounted(&self) -> f64 {
        let e = self.energies();
        e.engine + e.wheels - (e.kinetic - self.outside.start[0]) - e.potential - e.dissipated
    }

    /// What vanished in a step with a change of gear was lost by it.
    pub(crate) fn book_shift(&mut self, unaccounted_before: f64) {
        self.outside.shifts -= self.unaccounted() - unaccounted_before;
    }
}
