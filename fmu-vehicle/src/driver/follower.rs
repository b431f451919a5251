//! Path follower: steering by a PID on the lateral error, speed by a PID with throttle and brake.
//!
//! Proportional and derivative parts of the steering see the error of a point ahead of the vehicle; the integral sees that of the vehicle itself. A point
//! `L` ahead that is kept on a circle of radius R would lead the vehicle along the radius sqrt(R^2 - L^2); so it comes to run on the circle.

use super::path::{Path, PathSpec};
use crate::vehicle::DriverInputs;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{RigidState, Vec3};

/// Gains of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pid {
    /// Proportional gain (1/m for steering, s/m for speed).
    pub kp: f64,
    /// Integral gain.
    #[serde(default)]
    pub ki: f64,
    /// Derivative gain.
    #[serde(default)]
    pub kd: f64,
}

/// A path follower.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Follower {
    /// The path.
    pub path: PathSpec,
    /// Wanted speed (m/s).
    pub speed: f64,
    /// Ramp of the wanted speed from that at the start (s).
    #[serde(default)]
    pub speed_ramp: f64,
    /// Distance of the look-ahead point ahead of the chassis's reference point (m).
    #[serde(default = "look_ahead")]
    pub look_ahead: f64,
    /// Steering controller: `kp`, `kd` on the error of the point ahead, `ki` on that of the chassis's reference point.
    #[serde(default = "steering_pid")]
    pub steering_pid: Pid,
    /// Speed controller.
    #[serde(default = "speed_pid")]
    pub speed_pid: Pid,
    /// Below this throttle a negative demand becomes braking.
    #[serde(default = "throttle_threshold")]
    pub throttle_threshold: f64,
}

fn look_ahead() -> f64 {
    5.0
}
fn steering_pid() -> Pid {
    Pid { kp: 0.5, ki: 0.0, kd: 0.0 }
}
fn speed_pid() -> Pid {
    Pid { kp: 0.4, ki: 0.0, kd: 0.0 }
}
fn throttle_threshold() -> f64 {
    0.2
}

/// What a follower remembers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct FollowerState {
    segment: usize,
    own_segment: usize,
    steering: Memory,
    speed: Memory,
    start_speed: Option<f64>,
    throttle: f64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Memory {
    integral: f64,
    before: Option<f64>,
}

impl Pid {
    fn check(&self, path: &str, f: &mut Faults) {
        for (name, x) in [("kp", self.kp), ("ki", self.ki), ("kd", self.kd)] {
            f.not_negative(&format!("{path}.{name}"), x);
        }
    }
    /// The output for the error `e`, whose integral is that of `slow`.
    fn out(&self, e: f64, slow: f64, h: f64, m: &mut Memory) -> f64 {
        let rate = m.before.map_or(0.0, |b| (e - b) / h);
        m.before = Some(e);
        let trial = m.integral + slow * h;
        let u = self.kp * e + self.ki * trial + self.kd * rate;
        // No wind-up: the integral grows only while the output is within its range.
        if u.abs() < 1.0 {
            m.integral = trial;
        }
        u.clamp(-1.0, 1.0)
    }
}

impl Follower {
    pub(super) fn check(&self, path: &str, f: &mut Faults) {
        self.path.check(&format!("{path}.path"), f);
        f.not_negative(&format!("{path}.speed"), self.speed);
        f.not_negative(&format!("{path}.speed_ramp"), self.speed_ramp);
        f.positive(&format!("{path}.look_ahead"), self.look_ahead);
        self.steering_pid.check(&format!("{path}.steering_pid"), f);
        self.speed_pid.check(&format!("{path}.speed_pid"), f);
        f.within(&format!("{path}.throttle_threshold"), self.throttle_threshold, 0.0, 1.0);
    }

    pub(super) fn drive(
        &self,
        time: f64,
        h: f64,
        chassis: &RigidState,
        path: &Path,
        m: &mut FollowerState,
    ) -> DriverInputs {
        let x = chassis.orientation * Vec3::x();
        let n = x.xy().norm().max(1e-12);
        let ahead = [chassis.position.x + self.look_ahead * x.x / n, chassis.position.y + self.look_ahead * x.y / n];
        let error = path.lateral_error(ahead, &mut m.segment);
        let own = path.lateral_error([chassis.position.x, chassis.position.y], &mut m.own_segment);
        let steering = self.steering_pid.out(error, own, h, &mut m.steering);
        let v = chassis.velocity.dot(&x);
        let start = *m.start_speed.get_or_insert(v);
        let wanted = if self.speed_ramp > 0.0 {
            start + (self.speed - start) * (time / self.speed_ramp).clamp(0.0, 1.0)
        } else {
            self.speed
        };
        let u = self.speed_pid.out(wanted - v, wanted - v, h, &mut m.speed);
        let (throttle, braking) = if u > 0.0 {
            (u, 0.0)
        } else if m.throttle > self.throttle_threshold {
            (1.0 + u, 0.0)
        } else {
            (0.0, -u)
        };
        m.throttle = throttle;
        DriverInputs { steering, throttle, braking }
    }
}
