//! The rig's mechanics: touchdown, vertical slide, carriage, wheel.

use super::config::{AtStop, Mode, RigSpecification, StartOf};
use super::motion::{Ramp, imposed_speeds, slip};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use terramech_mechanics::{RigidState, Vec3, rotation};

/// Gravity (m/s2).
pub const GRAVITY: f64 = 9.81;
/// Share of the load at which touchdown's speed limit ends and its damper alone leads to rest. Less and the last
/// millimetres of soft soil take long; more and stiff ground meets a damper too weak to stop the wheel at once.
const DAMPED_SHARE: f64 = 0.5;
/// Share of the load that the soil has to carry, on average, before the touchdown's damper fades out.
const CARRIED_SHARE: f64 = 0.95;
/// Time constant of that average (s): over the passing of single grains, well below the touchdown's duration.
const CARRIED_TIME: f64 = 0.02;

/// Everything that stays constant in a run: the specification with its overrides, and what tire and terrain handed over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rig {
    /// The specification, overridden by parameters.
    pub spec: RigSpecification,
    /// Undeformed radius (m).
    pub radius: f64,
    /// Greatest distance of the tire's surface from the axle (m).
    pub outer_radius: f64,
    /// Mass handed over by the tire (kg).
    pub hub_mass: f64,
    /// Its moment of inertia about the axle (kg m2).
    pub hub_spin_inertia: f64,
    /// Height of the settled ground (m).
    pub ground: f64,
}

/// Where a run is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Phase {
    /// The wheel comes down.
    Lowering,
    /// The touchdown's damper fades out.
    Releasing,
    /// Delay, ramp and drive.
    Running,
}

/// What moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Phase of the run.
    pub phase: Phase,
    /// Time since the phase began (s).
    pub clock: f64,
    /// Wheel centre along X and its speed (m), (m/s).
    pub x: f64,
    /// Carriage speed (m/s).
    pub v: f64,
    /// Height of the wheel centre (m).
    pub z: f64,
    /// Its speed (m/s).
    pub vz: f64,
    /// Angle of the wheel about its axle, in [0, 2 pi) (rad).
    pub spin: f64,
    /// Angular speed about the axle (rad/s).
    pub omega: f64,
    /// Heading about Z (rad).
    pub heading: f64,
    /// Its rate (rad/s).
    pub heading_rate: f64,
    /// Average of the soil's vertical force (N).
    pub carried: f64,
    /// The slide rests on its end stop.
    pub on_stop: bool,
    /// The resistance has stopped the carriage.
    pub stalled: bool,
}

/// What one communication step did, besides the motion at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Taken {
    /// Mean acceleration of the carriage (m/s2).
    pub acceleration: f64,
    /// Mean angular acceleration of the wheel about its axle (rad/s2).
    pub spin_acceleration: f64,
}

impl Rig {
    /// Mass that slides vertically (kg).
    pub fn sliding_mass(&self) -> f64 {
        self.spec.load.mass + self.hub_mass
    }
    /// Static vertical load on the soil (N).
    pub fn load(&self) -> f64 {
        let given = self.spec.load.force;
        if given > 0.0 { given } else { self.sliding_mass() * GRAVITY }
    }
    /// Height of the wheel centre at the end stop (m).
    fn stop_height(&self) -> f64 {
        let given = self.spec.slide.greatest_sinkage;
        self.ground + self.radius - if given > 0.0 { given } else { 1.5 * self.radius }
    }
    fn drive_ramp(&self) -> Ramp {
        let d = &self.spec.drive;
        match d.start {
            StartOf::AtRest => Ramp { delay: d.delay, duration: d.ramp },
            StartOf::Rolling => Ramp { delay: 0.0, duration: 0.0 },
        }
    }
    fn toe_ramp(&self) -> Ramp {
        Ramp { delay: self.spec.toe.delay, duration: self.spec.toe.ramp }
    }
    /// Speeds after the ramp; of the free carriage that with which it starts when it starts rolling.
    fn full_speeds(&self) -> (f64, f64) {
        let d = &self.spec.drive;
        match d.mode {
            Mode::ImposedSlip => imposed_speeds(d, self.radius),
            Mode::ImposedAngularSpeed => (d.angular_speed * self.radius, d.angular_speed),
        }
    }
    /// Damping of the touchdown (N s/m).
    fn touchdown_damping(&self) -> f64 {
        DAMPED_SHARE * self.load() / self.spec.slide.lowering_speed
    }
    /// Whether the carriage is its own master now.
    fn carriage_is_free(&self, m: &Motion) -> bool {
        let d = &self.spec.drive;
        let waiting = d.start == StartOf::AtRest && m.clock < d.delay;
        d.mode == Mode::ImposedAngularSpeed && m.phase == Phase::Running && !waiting
    }
    /// The growing resistance at the carriage (N).
    pub fn resistance(&self, m: &Motion) -> f64 {
        let d = &self.spec.drive;
        if d.mode != Mode::ImposedAngularSpeed || m.phase != Phase::Running {
            return 0.0;
        }
        let ramp = self.drive_ramp();
        d.resistance.rate * (m.clock - ramp.delay - ramp.duration - d.resistance.delay).max(0.0)
    }

    /// The wheel just above the settled soil, before anything moves; a wheel that starts rolling has its speeds already.
    pub fn place(&self) -> Motion {
        let rolling = self.spec.drive.start == StartOf::Rolling;
        let (v, omega) = if rolling { self.full_speeds() } else { (0.0, 0.0) };
        Motion {
            phase: Phase::Lowering,
            clock: 0.0,
            x: self.spec.carriage.x,
            v,
            z: self.ground + self.outer_radius + self.spec.slide.gap,
            vz: 0.0,
            spin: 0.0,
            omega,
            heading: if self.toe_ramp().duration == 0.0 { self.spec.toe.angle } else { 0.0 },
            heading_rate: 0.0,
            carried: 0.0,
            on_stop: false,
            stalled: false,
        }
    }

    /// Moves on by a communication step of `size` (s) under the force (N) held on the wheel.
    pub fn advance(&self, m: &mut Motion, force: &Vec3, size: f64) -> Taken {
        let (v, omega) = (m.v, m.omega);
        // A step that is a multiple of the inner one up to round-off is cut into that many.
        let n = (size / self.spec.inner_step * (1.0 - 1e-9)).ceil().max(1.0);
        let h = size / n;
        for _ in 0..n as u64 {
            self.inner_step(m, force, h);
        }
        Taken { acceleration: (m.v - v) / size, spin_acceleration: (m.omega - omega) / size }
    }

    fn inner_step(&self, m: &mut Motion, force: &Vec3, h: f64) {
        self.slide(m, force.z, h);
        let start = m.clock;
        m.clock += h;
        let running = m.phase == Phase::Running;
        let ramp = self.drive_ramp();
        let toe = self.toe_ramp();
        let (v, omega) = self.full_speeds();
        // Times of the ramp's clock, which stands still until the wheel stands on the soil; a rolling start has no ramp.
        let (from, to) = if running { (start, m.clock) } else { (0.0, 0.0) };
        let covered = if ramp.duration == 0.0 { h } else { ramp.integral(to) - ramp.integral(from) };
        m.omega = omega * ramp.value(to);
        m.spin = (m.spin + omega * covered).rem_euclid(TAU);
        if self.carriage_is_free(m) {
            self.pull(m, force.x, h);
        } else {
            let hold = if self.spec.drive.mode == Mode::ImposedSlip || ramp.duration == 0.0 { v } else { 0.0 };
            m.v = hold * ramp.value(to);
            m.x += hold * covered;
        }
        m.heading = self.spec.toe.angle * toe.value(to);
        m.heading_rate = if running { self.spec.toe.angle * toe.rate(to) } else { 0.0 };
        self.next_phase(m);
    }

    /// Vertical motion.
    fn slide(&self, m: &mut Motion, lift: f64, h: f64) {
        let slide = &self.spec.slide;
        let (mass, load) = (self.sliding_mass(), self.load());
        let limit = slide.lowering_speed;
        if m.phase == Phase::Lowering {
            // A damper without the slide's inertia, which would sway on stiff ground. The hub's is there: a flexible tire
            // sends the hub's mass times its acceleration back, and a wheel without that mass answers with more each time.
            // It falls no faster than freely.
            let inertia = self.hub_mass / h;
            let given_way = (inertia * m.vz + lift - load) / (inertia + self.touchdown_damping());
            let given_way = given_way.clamp(-limit, limit);
            m.vz = given_way.max(m.vz - GRAVITY * h);
        } else {
            let fading = Ramp { delay: 0.0, duration: slide.release };
            let touchdown = if m.phase == Phase::Releasing { 1.0 - fading.value(m.clock) } else { 0.0 };
            let damping = slide.damping_rate * mass + touchdown * self.touchdown_damping();
            // Semi-implicit with an implicit damper: stable for any damping.
            m.vz = (m.vz + h * (lift - load) / mass) / (1.0 + h * damping / mass);
            if m.phase == Phase::Releasing {
                m.vz = m.vz.clamp(-limit, limit);
            }
        }
        m.z += h * m.vz;
        let stop = self.stop_height();
        m.on_stop = m.z <= stop;
        if m.on_stop {
            (m.z, m.vz) = (stop, 0.0);
        }
        m.carried += (lift - m.carried) * (1.0 - (-h / CARRIED_TIME).exp());
    }

    /// The free carriage: pulled by the wheel, held back by the resistance, which never drives it backwards.
    fn pull(&self, m: &mut Motion, pull: f64, h: f64) {
        if m.stalled {
            m.v = 0.0;
            return;
        }
        let mass = self.spec.carriage.mass + self.sliding_mass();
        let resistance = self.resistance(m);
        m.v = (m.v + h * (pull - resistance) / mass).max(0.0);
        m.x += h * m.v;
        m.stalled = resistance > 0.0 && m.v == 0.0;
    }

    fn next_phase(&self, m: &mut Motion) {
        let next = match m.phase {
            Phase::Lowering => {
                let carried = m.carried >= CARRIED_SHARE * self.load();
                (carried || m.on_stop).then_some(Phase::Releasing)
            }
            Phase::Releasing => (m.clock >= self.spec.slide.release).then_some(Phase::Running),
            Phase::Running => None,
        };
        if let Some(next) = next {
            (m.phase, m.clock) = (next, 0.0);
        }
    }

    /// Whether the run is over.
    pub fn has_ended(&self, m: &Motion) -> bool {
        m.stalled && self.spec.drive.resistance.at_stop == AtStop::End
    }

    /// State of the wheel: p_WC, q_WB = Rz(heading) Ry(spin), velocities in the inertial frame.
    pub fn wheel_state(&self, m: &Motion) -> RigidState {
        let turn = rotation::exp(&(Vec3::z() * m.heading));
        let axle = turn * Vec3::y();
        RigidState {
            position: Vec3::new(m.x, self.spec.carriage.y, m.z),
            orientation: turn * rotation::exp(&(Vec3::y() * m.spin)),
            velocity: Vec3::new(m.v, 0.0, m.vz),
            angular_velocity: axle * m.omega + Vec3::z() * m.heading_rate,
        }
    }
    /// Force that the wheel with its slide puts on the carriage along X (N): the soil's force less the inertia of what
    /// slides; positive pulls the carriage forward.
    pub fn drawbar_pull(&self, force: &Vec3, taken: &Taken) -> f64 {
        force.x - self.sliding_mass() * taken.acceleration
    }
    /// `force` in the heading frame (N): along the heading, to its left, up.
    pub fn in_heading_frame(&self, m: &Motion, force: &Vec3) -> Vec3 {
        rotation::exp(&(Vec3::z() * -m.heading)) * force
    }
    /// Torque of the drive on the wheel about its axle (N m): what turns its inertia, less the soil's moment.
    pub fn wheel_torque(&self, m: &Motion, moment: &Vec3, taken: &Taken) -> f64 {
        let axle = rotation::exp(&(Vec3::z() * m.heading)) * Vec3::y();
        (self.spec.spin_inertia + self.hub_spin_inertia) * taken.spin_acceleration - axle.dot(moment)
    }
    /// Slip now (1).
    pub fn slip(&self, m: &Motion) -> f64 {
        slip(m.omega * self.radius, m.v)
    }
    /// Settled height less the lowest point of the undeformed wheel (m); negative in the air.
    pub fn sinkage(&self, m: &Motion) -> f64 {
        self.ground - (m.z - self.radius)
    }
    /// Where the run is, as a number: 1 lowering, 2 releasing, 3 delay, 4 ramp, 5 drive, 6 stopped by the resistance.
    pub fn phase_number(&self, m: &Motion) -> i32 {
        let ramp = self.drive_ramp();
        match m.phase {
            Phase::Lowering => 1,
            Phase::Releasing => 2,
            Phase::Running if m.stalled => 6,
            Phase::Running if m.clock < ramp.delay => 3,
            Phase::Running if m.clock < ramp.delay + ramp.duration => 4,
            Phase::Running => 5,
        }
    }
}
