//! RATTLE: one step of the constrained system.
//!
//! ```text
//! M u_h     = M u_n + h/2 f(x_n, u_n)     + G_n' l      x_n+1 = x_n + h u_h (orientations by the exponential map), g(x_n+1) = 0
//! M u_n+1   = M u_h + h/2 f(x_n+1, u_p)   + G_n+1' m    G_n+1 u_n+1 = -g_t
//! ```
//!
//! with `u_p = 2 u_h - u_n`, so that forces that depend on velocity keep the second order without an implicit solve. The first
//! line is solved by Newton with the factor that the end of the step before left behind; gaps fall by a factor of about 1e3 an iteration.
//! The gyroscopic torque `-w x I w` counts as a force, in body axes. Friction holds or slips in both lines.

use super::factor::Reach;
use super::forces::View;
use super::friction::{Friction, box_solve};
use super::{Loads, MbsError, Motion, Pose, System};
use terramech_mechanics::{Mat3, Vec3};

/// Gap (m or rad) at which positions count as closed.
pub const GAP: f64 = 1e-9;
const ITERATIONS: usize = 20;

/// What a step took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Newton iterations of the position constraints.
    pub iterations: usize,
    /// Largest gap left (m or rad).
    pub gap: f64,
}

/// Scratch of a step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Work {
    u_start: Vec<[f64; 6]>,
    u: Vec<[f64; 6]>,
    du: Vec<[f64; 6]>,
    r: Vec<[f64; 6]>,
    y: Vec<f64>,
    dy: Vec<f64>,
    ry: Vec<f64>,
    d: Vec<f64>,
    w: Vec<f64>,
    jw: Vec<f64>,
    start: Vec<(Vec3, terramech_mechanics::Quat)>,
    friction: Responses,
}

/// What a unit torque of each friction element that is on does: kept as long as the factor is, that is from the end of a step through the first half of
/// the next.
#[derive(Clone, Debug, Default)]
struct Responses {
    /// The factor they belong to.
    factor: u64,
    /// The elements.
    on: Vec<usize>,
    u: Vec<Vec<[f64; 6]>>,
    y: Vec<Vec<f64>>,
    rows: Vec<Vec<f64>>,
    /// Slip of element i by a unit torque of element j.
    d: Vec<f64>,
    // Scratch.
    slip: Vec<f64>,
    limit: Vec<f64>,
    p: Vec<f64>,
}

/// A force law outside the system: tires, engine, wind. Called twice a step, with equal inputs for equal states.
pub type ForceLaw<'a> = &'a mut dyn FnMut(&View, &mut Loads);

impl System {
    /// One step of `h` seconds with forces from `law` besides gravity and the system's own springs. Drives hold their values at the
    /// end of the step. On an error the state is that of the start.
    ///
    /// # Errors
    /// Joints that open further than the iteration can close; a dead position; velocities that are not finite.
    pub fn step(&mut self, h: f64, law: ForceLaw) -> Result<StepReport, MbsError> {
        let mut work = std::mem::take(&mut self.work);
        work.start.clear();
        work.start.extend(self.motions.iter().map(|m| (m.p, m.q)));
        let result = self.step_with(h, law, &mut work);
        if result.is_err() {
            for (i, m) in self.motions.iter_mut().enumerate() {
                (m.p, m.q) = work.start[i];
                if let Some(u) = work.u_start.get(i) {
                    m.u = *u;
                }
            }
            self.prepared = false;
        }
        self.work = work;
        result
    }

    fn step_with(&mut self, h: f64, law: ForceLaw, w: &mut Work) -> Result<StepReport, MbsError> {
        let n = self.motions.len();
        let ny = self.reduction.ny;
        w.u_start.clear();
        w.u_start.extend(self.motions.iter().map(|m| m.u));
        w.u.clone_from(&w.u_start);
        w.w.clone_from(&self.shaft_speeds);
        w.du.resize(n, [0.0; 6]);
        w.r.resize(n, [0.0; 6]);
        w.y.resize(ny, 0.0);
        w.dy.resize(ny, 0.0);
        w.ry.resize(ny, 0.0);
        w.d.resize(self.g.len().max(self.layout.rows()), 0.0);
        self.friction_torque.fill(0.0);
        self.prepare()?;
        // Gaps are measured against the drives at the end of the step; the Jacobian keeps those at its start.
        self.drives.clone_from(&self.next_drives);
        self.forces(self.time, &w.u, &w.w, law);
        self.done.add(self.powers, 0.5 * h);
        self.momenta(0.5 * h, w);
        // Newton's first iterate from the motion with the old velocities.
        self.drift(h, &w.u_start, &w.start);
        self.gaps(&mut w.d);
        for (k, (p, a, b)) in self.rows.iter().enumerate() {
            let r0 = self.layout.first_row[k];
            for r in r0..r0 + p.rows() {
                if p.of_velocity() {
                    w.d[r] = 0.0;
                    continue;
                }
                let (g, ua, ub) = (&self.g[r], &w.u_start[*a], &w.u_start[*b]);
                let gu: f64 = (0..6).map(|t| g[t] * ua[t] + g[t + 6] * ub[t]).sum();
                w.d[r] = gu - w.d[r] / h;
            }
        }
        self.solve(w);
        self.friction(0.5 * h, h, w)?;
        let mut report = StepReport::default();
        loop {
            self.drift(h, &w.u, &w.start);
            report.gap = self.gaps(&mut w.d);
            report.iterations += 1;
            if report.gap <= GAP {
                break;
            }
            if report.iterations >= ITERATIONS || !report.gap.is_finite() {
                let (residual, k) = super::assembly::largest(&self.rows, &self.poses, &self.drives);
                let joint = self.joints[self.joint_of[k]].clone();
                let (time, iterations) = (self.time, report.iterations);
                return Err(MbsError::NoConvergence { joint, residual, time, iterations, step: h });
            }
            w.d.iter_mut().for_each(|x| *x /= -h);
            w.r.iter_mut().for_each(|x| *x = [0.0; 6]);
            w.ry.fill(0.0);
            let (f, reach) = (&mut self.factor, Reach::Rows);
            f.solve(&self.layout, &self.g, &self.inverse, reach, &w.r, &w.ry, &w.d, &mut w.du, &mut w.dy);
            for (u, d) in w.u.iter_mut().zip(&w.du) {
                (0..6).for_each(|t| u[t] += d[t]);
            }
            w.y.iter_mut().zip(&w.dy).for_each(|(y, d)| *y += d);
        }
        self.reduction.speeds(&w.y, &w.u[self.carrier][3..], &mut w.w);
        // End of the step: new Jacobian and factor, forces at the predicted velocities.
        self.refactor()?;
        for (p, (u, s)) in w.du.iter_mut().zip(w.u.iter().zip(&w.u_start)) {
            *p = std::array::from_fn(|t| 2.0 * u[t] - s[t]);
        }
        w.jw.clear();
        w.jw.extend(w.w.iter().zip(&self.shaft_speeds).map(|(half, start)| 2.0 * half - start));
        let (du, jw) = (std::mem::take(&mut w.du), std::mem::take(&mut w.jw));
        self.forces(self.time + h, &du, &jw, law);
        (w.du, w.jw) = (du, jw);
        self.done.add(self.powers, 0.5 * h);
        self.momenta(0.5 * h, w);
        for (k, (p, ..)) in self.rows.iter().enumerate() {
            let r = self.layout.first_row[k];
            p.rate(&self.drives, &mut w.d[r..r + p.rows()]);
        }
        self.solve(w);
        // The impulses of the first half are about the same.
        self.done.drives += 2.0 * self.row_impulses.iter().zip(&w.d).map(|(l, rate)| l * rate).sum::<f64>();
        self.friction(0.5 * h, h, w)?;
        if let Some(b) = w.u.iter().position(|u| u.iter().any(|x| !x.is_finite())) {
            return Err(MbsError::NotFinite { body: self.bodies[b].name.clone(), time: self.time });
        }
        self.reduction.speeds(&w.y, &w.u[self.carrier][3..], &mut self.shaft_speeds);
        for (m, u) in self.motions.iter_mut().zip(&w.u) {
            m.u = *u;
        }
        self.time += h;
        Ok(report)
    }

    /// Acceleration (`v` and `w` in body axes, m/s2 and rad/s2), mean over the last step of `h` seconds.
    pub fn mean_acceleration(&self, body: super::BodyId, h: f64) -> [f64; 6] {
        match self.work.u_start.get(body.0) {
            Some(s) => std::array::from_fn(|t| (self.motions[body.0].u[t] - s[t]) / h),
            None => [0.0; 6],
        }
    }

    /// All applied forces into `self.loads`, gyroscopic torques included.
    pub(crate) fn forces(&mut self, time: f64, u: &[[f64; 6]], shafts: &[f64], law: ForceLaw) {
        let mut loads = std::mem::take(&mut self.loads);
        loads.clear(self.motions.len(), shafts.len());
        self.powers = [0.0; 2];
        for s in &self.springs {
            let power = s.apply(&self.poses, u, &mut loads);
            (0..2).for_each(|k| self.powers[k] += power[k]);
        }
        for i in 1..self.bodies.len() {
            let b = &self.bodies[i];
            let l = &mut loads.bodies[i];
            let omega = Vec3::new(u[i][3], u[i][4], u[i][5]);
            let gyro = omega.cross(&times(&b.inertia, &omega));
            for t in 0..3 {
                l[t] += b.mass * self.gravity[t];
                l[t + 3] -= gyro[t];
            }
        }
        law(&View { time, poses: &self.poses, u, shafts, motions: &self.motions }, &mut loads);
        self.loads = loads;
    }

    /// Momenta `M u + dt f` of bodies, hubs and shafts into `w.r`, `w.ry`.
    fn momenta(&self, dt: f64, w: &mut Work) {
        for i in 1..self.bodies.len() {
            let (b, u, f) = (&self.bodies[i], &w.u[i], &self.loads.bodies[i]);
            let l = times(&b.inertia, &Vec3::new(u[3], u[4], u[5]));
            for t in 0..3 {
                w.r[i][t] = b.mass * u[t] + dt * f[t];
                w.r[i][t + 3] = l[t] + dt * f[t + 3];
            }
        }
        w.ry.fill(0.0);
        w.jw.clear();
        let j = self.network.inertia();
        w.jw.extend((0..j.len()).map(|s| j[s] * w.w[s] + dt * self.loads.shafts[s]));
        let mut torque = [0.0; 3];
        self.reduction.gather(&w.jw, &mut w.ry, &mut torque);
        if self.carrier != 0 {
            for t in 0..3 {
                w.r[self.carrier][t + 3] += torque[t] + dt * self.loads.carrier[t];
            }
        }
    }

    /// Positions `start + h u`, and their poses.
    fn drift(&mut self, h: f64, u: &[[f64; 6]], start: &[(Vec3, terramech_mechanics::Quat)]) {
        for i in 1..self.motions.len() {
            let (m, u) = (&mut self.motions[i], &u[i]);
            m.p = start[i].0 + Vec3::new(u[0], u[1], u[2]) * h;
            m.q = Self::turned(&start[i].1, &(Vec3::new(u[3], u[4], u[5]) * h));
            self.poses[i] = m.pose();
        }
    }

    /// Gaps into `d`; the largest.
    fn gaps(&self, d: &mut [f64]) -> f64 {
        let mut worst = 0.0_f64;
        for (k, (p, a, b)) in self.rows.iter().enumerate() {
            let r = self.layout.first_row[k];
            let out = &mut d[r..r + p.rows()];
            p.residual(&self.poses[*a], &self.poses[*b], &self.drives, out);
            for x in out {
                worst = if x.is_nan() { f64::INFINITY } else { worst.max(x.abs()) };
            }
        }
        worst
    }

    fn solve(&mut self, w: &mut Work) {
        self.factor.solve(&self.layout, &self.g, &self.inverse, Reach::All, &w.r, &w.ry, &w.d, &mut w.u, &mut w.y);
        self.row_impulses.clear();
        self.row_impulses.extend_from_slice(self.factor.impulses());
    }

    /// Adds the impulses of friction elements over `dt`, if any is on.
    fn friction(&mut self, dt: f64, h: f64, w: &mut Work) -> Result<(), MbsError> {
        let n = self.friction_limit.iter().filter(|l| **l > 0.0).count();
        if n == 0 {
            return Ok(());
        }
        let mut f = std::mem::take(&mut w.friction);
        let on = (0..self.frictions.len()).filter(|&i| self.friction_limit[i] > 0.0);
        if f.factor != self.factor_id || !f.on.iter().copied().eq(on.clone()) {
            f.on.clear();
            f.on.extend(on);
            f.factor = self.factor_id;
            self.responses(&mut f, w);
        }
        f.slip.clear();
        f.slip.extend(f.on.iter().map(|&i| self.friction_slip(i, &w.u, &w.y)));
        f.limit.clear();
        f.limit.extend(f.on.iter().map(|&i| self.friction_limit[i] * dt));
        f.p.clear();
        f.p.resize(n, 0.0);
        box_solve(&f.d, &f.slip, &f.limit, &mut f.p);
        for (i, &k) in f.on.iter().enumerate() {
            let p = f.p[i];
            self.friction_torque[k] += p / h;
            self.row_impulses.iter_mut().zip(&f.rows[i]).for_each(|(l, r)| *l += r * p);
            for (u, d) in w.u.iter_mut().zip(&f.u[i]) {
                (0..6).for_each(|t| u[t] += d[t] * p);
            }
            w.y.iter_mut().zip(&f.y[i]).for_each(|(y, d)| *y += d * p);
        }
        for (i, &k) in f.on.iter().enumerate() {
            self.done.friction += f.p[i] * self.friction_slip(k, &w.u, &w.y);
        }
        w.friction = f;
        Ok(())
    }

    /// Solves for the response to each friction element.
    fn responses(&mut self, f: &mut Responses, w: &mut Work) {
        let n = f.on.len();
        f.u.resize_with(n, Vec::new);
        f.y.resize_with(n, Vec::new);
        f.rows.resize_with(n, Vec::new);
        w.d.fill(0.0);
        for i in 0..n {
            w.r.iter_mut().for_each(|x| *x = [0.0; 6]);
            w.ry.fill(0.0);
            self.friction_row(f.on[i], &mut w.r, &mut w.ry);
            let (u, y) = (&mut f.u[i], &mut f.y[i]);
            u.resize(w.u.len(), [0.0; 6]);
            y.resize(w.y.len(), 0.0);
            // Between shafts alone: nothing pushes the bodies of the clusters but the hubs.
            let reach = match self.frictions[f.on[i]] {
                Friction::Shafts { .. } => Reach::Hubs,
                Friction::Bodies { .. } => Reach::All,
            };
            self.factor.solve(&self.layout, &self.g, &self.inverse, reach, &w.r, &w.ry, &w.d, u, y);
            f.rows[i].clear();
            f.rows[i].extend_from_slice(self.factor.impulses());
        }
        f.d.clear();
        for i in 0..n {
            for j in 0..n {
                f.d.push(self.friction_slip(f.on[i], &f.u[j], &f.y[j]));
            }
        }
    }

    /// Generalised direction of a unit torque of friction element `f`.
    fn friction_row(&self, f: usize, r: &mut [[f64; 6]], ry: &mut [f64]) {
        match &self.frictions[f] {
            Friction::Bodies { a, b, axis_a, axis_b } => {
                for t in 0..3 {
                    r[a.0][t + 3] -= axis_a[t];
                    r[b.0][t + 3] += axis_b[t];
                }
                r[0] = [0.0; 6];
            }
            Friction::Shafts { a, b } => {
                let mut unit = vec![0.0; self.network.len()];
                unit[a.0] = -1.0;
                unit[b.0] = 1.0;
                let mut torque = [0.0; 3];
                self.reduction.gather(&unit, ry, &mut torque);
                if self.carrier != 0 {
                    (0..3).for_each(|t| r[self.carrier][t + 3] += torque[t]);
                }
            }
        }
    }

    /// Relative speed (rad/s) of friction element `f`.
    fn friction_slip(&self, f: usize, u: &[[f64; 6]], y: &[f64]) -> f64 {
        match &self.frictions[f] {
            Friction::Bodies { a, b, axis_a, axis_b } => {
                (0..3).map(|t| axis_b[t] * u[b.0][t + 3] - axis_a[t] * u[a.0][t + 3]).sum()
            }
            Friction::Shafts { a, b } => {
                let mut w = vec![0.0; self.network.len()];
                self.reduction.speeds(y, &u[self.carrier][3..], &mut w);
                w[b.0] - w[a.0]
            }
        }
    }

    /// Makes the velocities satisfy the joints, changing them as little as the masses allow.
    ///
    /// # Errors
    /// [`MbsError::Singular`].
    pub fn project_velocities(&mut self) -> Result<(), MbsError> {
        self.drives.clone_from(&self.next_drives);
        self.prepared = false;
        self.prepare()?;
        let mut w = std::mem::take(&mut self.work);
        let n = self.motions.len();
        w.u.clear();
        w.u.extend(self.motions.iter().map(|m| m.u));
        w.w.clone_from(&self.shaft_speeds);
        w.r.resize(n, [0.0; 6]);
        w.y.resize(self.reduction.ny, 0.0);
        w.ry.resize(self.reduction.ny, 0.0);
        w.d.resize(self.layout.rows(), 0.0);
        self.loads.clear(n, self.network.len());
        self.momenta(0.0, &mut w);
        for (k, (p, ..)) in self.rows.iter().enumerate() {
            let r = self.layout.first_row[k];
            p.rate(&self.drives, &mut w.d[r..r + p.rows()]);
        }
        self.solve(&mut w);
        self.reduction.speeds(&w.y, &w.u[self.carrier][3..], &mut self.shaft_speeds);
        for (m, u) in self.motions.iter_mut().zip(&w.u) {
            m.u = *u;
        }
        self.work = w;
        Ok(())
    }

    /// Impulse (N s or N m s) of each row of joint `name` at the last solve, over half a step.
    pub fn joint_impulses(&self, name: &str) -> Vec<f64> {
        let mut out = Vec::new();
        for (k, (p, ..)) in self.rows.iter().enumerate() {
            if self.joints[self.joint_of[k]] == name {
                let r = self.layout.first_row[k];
                out.extend_from_slice(&self.row_impulses[r..r + p.rows()]);
            }
        }
        out
    }

    /// Poses of the present state.
    pub fn current_poses(&self) -> Vec<Pose> {
        self.motions.iter().map(Motion::pose).collect()
    }
}

fn times(m: &Mat3, v: &Vec3) -> Vec3 {
    m * v
}
