//! Forces: what acts on bodies and shafts besides constraints.

mod damper;
mod spring;

pub use damper::DamperLaw;
pub use spring::{SpringLaw, Stops};

use super::{BodyId, Motion, Pose, ShaftId};
use terramech_mechanics::Vec3;

/// A spring and damper between two points; either part may be absent. Tension is positive.
#[derive(Clone, Debug)]
pub struct SpringDamper {
    /// Name in outputs.
    pub name: String,
    /// First body.
    pub a: BodyId,
    /// Second body.
    pub b: BodyId,
    /// `p_AP` (m).
    pub p_ap: Vec3,
    /// `p_BP` (m).
    pub p_bp: Vec3,
    /// Force of length.
    pub spring: SpringLaw,
    /// Force of length and its rate.
    pub damper: DamperLaw,
    /// Bump and rebound stops.
    pub stops: Option<Stops>,
}

/// Length (m), its rate (m/s) and tension (N) of a spring-damper.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stroke {
    /// Length (m).
    pub length: f64,
    /// Rate of length (m/s).
    pub rate: f64,
    /// Tension (N), positive pulls the ends together.
    pub tension: f64,
    /// Of it the damper's (N).
    pub damping: f64,
}

impl SpringDamper {
    /// Its state for the bodies' poses and motions.
    #[inline]
    pub fn stroke(&self, poses: &[Pose], motions: &[[f64; 6]]) -> (Stroke, Vec3) {
        let (pa, pb) = (&poses[self.a.0], &poses[self.b.0]);
        let d = pb.point(&self.p_bp) - pa.point(&self.p_ap);
        let length = d.norm();
        let e = d / length;
        let rate =
            (velocity(pb, &motions[self.b.0], &self.p_bp) - velocity(pa, &motions[self.a.0], &self.p_ap)).dot(&e);
        let damping = self.damper.tension(length, rate);
        let mut tension = self.spring.tension(length) + damping;
        if let Some(s) = &self.stops {
            tension += s.tension(length);
        }
        (Stroke { length, rate, tension, damping }, e)
    }

    /// Adds its forces; gives the power (W) of spring and stops, and of the damper.
    #[inline]
    pub(crate) fn apply(&self, poses: &[Pose], motions: &[[f64; 6]], loads: &mut Loads) -> [f64; 2] {
        let (s, e) = self.stroke(poses, motions);
        let f = e * s.tension;
        loads.force_at(self.a, &poses[self.a.0], &f, &self.p_ap);
        loads.force_at(self.b, &poses[self.b.0], &-f, &self.p_bp);
        let all = -s.tension * s.rate;
        let damper = if self.damper.is_metal(s.length) { 0.0 } else { -s.damping * s.rate };
        [all - damper, damper]
    }
}

/// Velocity in W of a body-fixed point.
#[inline]
pub(crate) fn velocity(pose: &Pose, u: &[f64; 6], p_cp: &Vec3) -> Vec3 {
    Vec3::new(u[0], u[1], u[2]) + pose.r * Vec3::new(u[3], u[4], u[5]).cross(p_cp)
}

/// Applied forces of one evaluation.
#[derive(Clone, Debug, Default)]
pub struct Loads {
    /// Per body: force (N) in W and torque about the centre of mass (N m) in **body** axes.
    pub bodies: Vec<[f64; 6]>,
    /// Torque (N m) per shaft.
    pub shafts: Vec<f64>,
    /// Torque on the carrier of the shafts (N m), carrier axes: the reaction of engine and converter.
    pub carrier: Vec3,
}

impl Loads {
    /// Nothing acts.
    pub fn clear(&mut self, bodies: usize, shafts: usize) {
        self.bodies.clear();
        self.bodies.resize(bodies, [0.0; 6]);
        self.shafts.clear();
        self.shafts.resize(shafts, 0.0);
        self.carrier = Vec3::zeros();
    }
    /// A force (N, in W) at a body-fixed point `p_CP` (m).
    #[inline]
    pub fn force_at(&mut self, body: BodyId, pose: &Pose, f_w: &Vec3, p_cp: &Vec3) {
        let t = p_cp.cross(&pose.r.tr_mul(f_w));
        let l = &mut self.bodies[body.0];
        for k in 0..3 {
            l[k] += f_w[k];
            l[k + 3] += t[k];
        }
    }
    /// A torque (N m, in W) on a body.
    #[inline]
    pub fn torque(&mut self, body: BodyId, pose: &Pose, t_w: &Vec3) {
        let t = pose.r.tr_mul(t_w);
        for k in 0..3 {
            self.bodies[body.0][k + 3] += t[k];
        }
    }
    /// A torque (N m) on a shaft; whoever holds the other end must take its reaction.
    #[inline]
    pub fn shaft(&mut self, shaft: ShaftId, torque: f64) {
        self.shafts[shaft.0] += torque;
    }
}

/// What a force law may see.
pub struct View<'a> {
    /// Time (s).
    pub time: f64,
    /// Poses of all bodies; index 0 is the ground.
    pub poses: &'a [Pose],
    /// Velocities of all bodies: `v_WC_W`, `w_WB_B`.
    pub u: &'a [[f64; 6]],
    /// Speeds of all shafts (rad/s).
    pub shafts: &'a [f64],
    /// States at the start of the step, orientation as quaternion (positions are those of `poses` only at the first evaluation).
    pub motions: &'a [Motion],
}

impl View<'_> {
    /// Pose of a body.
    pub fn pose(&self, body: BodyId) -> &Pose {
        &self.poses[body.0]
    }
    /// `w_WB_W` (rad/s).
    pub fn w_world(&self, body: BodyId) -> Vec3 {
        let u = &self.u[body.0];
        self.poses[body.0].r * Vec3::new(u[3], u[4], u[5])
    }
    /// Velocity of a body-fixed point (m/s, in W).
    pub fn velocity(&self, body: BodyId, p_cp: &Vec3) -> Vec3 {
        velocity(&self.poses[body.0], &self.u[body.0], p_cp)
    }
    /// Speed of a shaft (rad/s).
    pub fn shaft(&self, shaft: ShaftId) -> f64 {
        self.shafts[shaft.0]
    }
}
