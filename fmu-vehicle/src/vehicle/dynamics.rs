//! A vehicle in motion: inputs, forces, gear, outputs, state.

use super::build::{SteeringMotion, Vehicle};
use super::energy::{self, Outside, power_of};
use crate::driveline::DrivelineBuilt;
use crate::mbs::{Loads, MbsError, StepReport, View};
use crate::powertrain::{EngineOutputs, GearState, Powers};
use terramech_mechanics::{RigidState, Vec3};

/// What the driver does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DriverInputs {
    /// -1 full right to 1 full left.
    pub steering: f64,
    /// 0 to 1.
    pub throttle: f64,
    /// 0 to 1.
    pub braking: f64,
}

/// Force (N) and moment (N m) on a wheel about its centre, in W.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WheelWrench {
    /// Force (N).
    pub force: Vec3,
    /// Moment (N m).
    pub moment: Vec3,
}

/// Motion of the chassis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChassisState {
    /// The reference frame of the chassis.
    pub state: RigidState,
    /// Acceleration of the chassis's centre of mass (m/s2, in W), mean over the last inner step.
    pub acceleration: Vec3,
    /// Angular acceleration (rad/s2, in W).
    pub angular_acceleration: Vec3,
}

/// More forces on the wheels, as functions of their states: tires inside the vehicle. Gets the view and adds to the loads.
pub type WheelForces<'a> = &'a mut dyn FnMut(&View, &mut Loads);

impl Vehicle {
    /// One inner step of `h` s with the inputs and wrenches set.
    ///
    /// # Errors
    /// As [`crate::mbs::System::step`].
    pub fn step(&mut self, h: f64) -> Result<StepReport, MbsError> {
        self.step_with(h, &mut |_, _| {})
    }

    /// As [`Self::step`] with more forces.
    ///
    /// # Errors
    /// As [`crate::mbs::System::step`].
    pub fn step_with(&mut self, h: f64, more: WheelForces) -> Result<StepReport, MbsError> {
        let input_speed = self.driveshaft_speed();
        let gear_before = self.gear.gear;
        if let Some(e) = &mut self.engine {
            e.shift(&mut self.gear, h, &mut self.system, input_speed)?;
        }
        let shifted = (self.gear.gear != gear_before).then(|| self.unaccounted());
        self.steer(h);
        let braking = self.inputs.braking.clamp(0.0, 1.0);
        for (f, max) in self.brakes.iter().flatten() {
            let limit = if self.brakes_locked { 1e9 } else { braking * max };
            self.system.set_friction(*f, limit);
        }
        let throttle = self.inputs.throttle.clamp(0.0, 1.0);
        let (wheels, wrenches, engine, line) = (&self.wheels, &self.wrenches, &self.engine, &self.driveline);
        let (gear, chassis, drag, damping) = (&self.gear, self.chassis, self.drag, self.damping);
        let chassis_mass = self.system.body_mass(chassis);
        let mut outside = self.outside;
        let report = self.system.step(h, &mut |view: &View, loads: &mut Loads| {
            let on_wheels = power_of(wheels.iter().map(|c| c.spindle), view, loads, |loads| {
                for (c, w) in wheels.iter().zip(wrenches) {
                    let pose = view.pose(c.spindle);
                    loads.force_at(c.spindle, pose, &w.force, &Vec3::zeros());
                    loads.torque(c.spindle, pose, &w.moment);
                }
                more(view, loads);
            });
            let mut powers = Powers::default();
            if let (Some(e), Some(l)) = (engine, line) {
                powers = e.apply(throttle, gear, l, view, loads);
            }
            let mut dragging = 0.0;
            if drag > 0.0 || damping > 0.0 {
                let u = &view.u[chassis.index()];
                let v = Vec3::new(u[0], u[1], u[2]);
                let f = v * (-drag * v.norm() - damping * chassis_mass);
                loads.force_at(chassis, view.pose(chassis), &f, &Vec3::zeros());
                dragging = f.dot(&v);
            }
            outside.add(powers, on_wheels, dragging, 0.5 * h);
        })?;
        self.outside = outside;
        if let Some(before) = shifted {
            self.book_shift(before);
        }
        self.last_step = h;
        if let Some(e) = &self.engine {
            self.engine_outputs = e.outputs(throttle, &self.gear, &self.system, self.driveshaft_speed());
        }
        Ok(report)
    }

    /// The servo of each steering follows the input as a critically damped oscillator, so that a jump of the input at a
    /// communication point is a finite acceleration of the linkage.
    fn steer(&mut self, h: f64) {
        let target = self.inputs.steering.clamp(-1.0, 1.0);
        let w = self.steering_frequency;
        let decay = (-w * h).exp();
        for (m, s) in self.steering_motion.iter_mut().zip(&self.steering) {
            let e = m.value - target;
            let b = m.rate + w * e;
            m.value = target + (e + b * h) * decay;
            m.rate = (m.rate - w * b * h) * decay;
            self.system.set_drive(s.drive, s.full * m.value, s.full * m.rate);
        }
    }

    /// State of a wheel: its centre and the spindle's orientation.
    pub fn wheel_state(&self, wheel: usize) -> RigidState {
        self.system.rigid_state(self.wheels[wheel].spindle)
    }

    /// State of the chassis's reference frame and its accelerations.
    pub fn chassis_state(&self) -> ChassisState {
        let m = self.system.motion(self.chassis);
        let state = RigidState {
            position: m.p + m.q * self.reference,
            velocity: m.point_velocity(&self.reference),
            ..m.rigid_state()
        };
        let a = self.system.mean_acceleration(self.chassis, self.last_step);
        ChassisState {
            state,
            acceleration: Vec3::new(a[0], a[1], a[2]),
            angular_acceleration: m.q * Vec3::new(a[3], a[4], a[5]),
        }
    }

    /// Speed of the driveline's input shaft (rad/s).
    pub fn driveshaft_speed(&self) -> f64 {
        match &self.driveline {
            Some(DrivelineBuilt::Shafts { input, .. }) => self.system.shaft_speed(*input),
            Some(DrivelineBuilt::Simple(s)) => {
                let poses = [];
                let u: Vec<[f64; 6]> = self.system.all_bodies().map(|(b, _)| self.system.motion(b).u).collect();
                s.input_speed(&View { time: 0.0, poses: &poses, u: &u, shafts: &[], motions: &[] })
            }
            None => 0.0,
        }
    }

    /// Speeds and torques of the powertrain after the last step.
    pub fn engine(&self) -> EngineOutputs {
        self.engine_outputs
    }
    /// The gear now.
    pub fn gear(&self) -> i32 {
        self.gear.gear
    }
    /// Angular velocity of a wheel about its axis relative to the upright (rad/s).
    pub fn wheel_speed(&self, wheel: usize) -> f64 {
        let c = &self.wheels[wheel];
        let (s, u) = (self.system.motion(c.spindle), self.system.motion(c.upright));
        let axis = s.q * Vec3::y();
        axis.dot(&(s.w_world() - u.w_world()))
    }
    /// Torque of a wheel's brake (N m), mean over the last inner step.
    pub fn brake_torque(&self, wheel: usize) -> f64 {
        self.brakes[wheel].map_or(0.0, |(f, _)| self.system.friction_torque(f))
    }
    /// Torque (N m) that the axle shaft exerts on a wheel, mean over the last half inner step; 0 for a wheel that is not driven by a shaft.
    pub fn axle_torque(&self, wheel: usize) -> f64 {
        self.system.spin_impulse(self.wheels[wheel].spindle).map_or(0.0, |p| p / (0.5 * self.last_step))
    }

    /// State as plain numbers: the gear, work, the steering, the system's.
    pub fn save(&self) -> Vec<f64> {
        let mut x =
            vec![f64::from(self.gear.gear), self.gear.since, self.damping, f64::from(u8::from(self.brakes_locked))];
        x.extend(self.outside.to_array());
        x.extend(self.steering_motion.iter().flat_map(|m| [m.value, m.rate]));
        x.extend(self.system.save());
        x
    }

    /// Takes a state back, bit for bit.
    ///
    /// # Errors
    /// A message if the numbers belong to another vehicle.
    pub fn restore(&mut self, x: &[f64]) -> Result<(), String> {
        let first = 4 + energy::SAVED;
        let n = first + 2 * self.steering_motion.len();
        if x.len() < n {
            return Err(format!("{} numbers are too few for this vehicle", x.len()));
        }
        self.gear = GearState { gear: x[0] as i32, since: x[1] };
        self.damping = x[2];
        self.brakes_locked = x[3] != 0.0;
        self.outside = Outside::from_array(std::array::from_fn(|k| x[4 + k]));
        for (m, a) in self.steering_motion.iter_mut().zip(x[first..n].chunks_exact(2)) {
            *m = SteeringMotion { value: a[0], rate: a[1] };
        }
        self.system.restore(&x[n..]).map_err(|e| format!("{} numbers, this vehicle has {e}", x.len() - n))?;
        if let Some(e) = &self.engine {
            e.engage(&self.gear, &mut self.system).map_err(|e| e.to_string())?;
        }
        Ok(())
    }
}
