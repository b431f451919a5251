//! An assembled system: structure, state, and what can be asked of it.

use super::assembly;
use super::energy::Work as EnergyWork;
use super::factor::{Factor, InverseMass};
use super::friction::Friction;
use super::layout::Layout;
use super::primitive::{Drive, DriveId};
use super::shafts::{GearId, Reduction};
use super::{
    Body, BodyId, FrictionId, GROUND, Loads, MbsError, Model, Motion, Pose, Primitive, ShaftId, ShaftNetwork,
    SpringDamper,
};
use crate::mbs::forces::Stroke;
use terramech_mechanics::{Mat3, Quat, RigidState, Vec3, rotation};

/// A multibody system ready to move. State: time, motions of bodies, shaft speeds, drives; the rest is structure or scratch.
#[derive(Clone, Debug)]
pub struct System {
    pub(crate) bodies: Vec<Body>,
    pub(crate) joints: Vec<String>,
    /// Rows with their bodies A and B.
    pub(crate) rows: Vec<(Primitive, usize, usize)>,
    /// Joint of each entry of `rows`.
    pub(crate) joint_of: Vec<usize>,
    pub(crate) springs: Vec<SpringDamper>,
    pub(crate) frictions: Vec<Friction>,
    /// Torque limit (N m) of each friction element now.
    pub(crate) friction_limit: Vec<f64>,
    /// Mean torque (N m) of each friction element over the last step.
    pub(crate) friction_torque: Vec<f64>,
    pub(crate) network: ShaftNetwork,
    pub(crate) reduction: Reduction,
    pub(crate) carrier: usize,
    pub(crate) gravity: Vec3,
    pub(crate) layout: Layout,
    pub(crate) inverse: Vec<InverseMass>,
    pub(crate) hub_mass: Vec<f64>,
    /// Work of its own forces so far.
    pub(crate) done: EnergyWork,
    /// Powers (W) of springs and shocks at the last evaluation of the forces.
    pub(crate) powers: [f64; 2],
    // State.
    pub(crate) time: f64,
    pub(crate) motions: Vec<Motion>,
    pub(crate) shaft_speeds: Vec<f64>,
    pub(crate) drives: Vec<Drive>,
    /// Drives at the end of the next step.
    pub(crate) next_drives: Vec<Drive>,
    // Scratch; `prepared` says that poses, Jacobian and factor belong to the state.
    pub(crate) prepared: bool,
    pub(crate) poses: Vec<Pose>,
    pub(crate) g: Vec<[f64; 12]>,
    pub(crate) factor: Factor,
    /// Counts factorisations.
    pub(crate) factor_id: u64,
    /// Impulses of the rows over the last half step, friction included.
    pub(crate) row_impulses: Vec<f64>,
    pub(crate) loads: Loads,
    pub(crate) work: super::integrator::Work,
}

impl System {
    pub(crate) fn new(model: Model) -> Result<Self, MbsError> {
        let mut motions = model.motions;
        let rows: Vec<(Primitive, usize, usize)> =
            model.constraints.iter().map(|(_, p, a, b)| (p.clone(), *a, *b)).collect();
        let joint_of: Vec<usize> = model.constraints.iter().map(|c| c.0).collect();
        let inverse: Vec<InverseMass> = std::iter::once(InverseMass::default())
            .chain(model.bodies[1..].iter().map(|b| {
                let i = b.inertia.try_inverse().unwrap_or_else(Mat3::identity);
                InverseMass { m: 1.0 / b.mass, i: [i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]] }
            }))
            .collect();
        let drives = vec![Drive::default(); model.drives];
        assembly::close(&rows, &joint_of, &model.joints, &inverse, &drives, &mut motions)?;
        assembly::check_redundancy(&rows, &joint_of, &model.joints, &inverse, &drives, &motions)?;
        let mut hub: Vec<bool> = model.bodies.iter().map(|b| b.hub).collect();
        if model.carrier != GROUND {
            hub[model.carrier.0] = true;
        }
        let reduction = model.shafts.reduce()?;
        let n = model.shafts.len();
        let mut s = Self {
            friction_limit: vec![0.0; model.frictions.len()],
            friction_torque: vec![0.0; model.frictions.len()],
            bodies: model.bodies,
            joints: model.joints,
            rows,
            joint_of,
            springs: model.springs,
            frictions: model.frictions,
            network: model.shafts,
            reduction,
            carrier: model.carrier.0,
            gravity: model.gravity,
            layout: Layout::default(),
            inverse,
            hub_mass: Vec::new(),
            done: EnergyWork::default(),
            powers: [0.0; 2],
            time: 0.0,
            motions,
            shaft_speeds: vec![0.0; n],
            next_drives: drives.clone(),
            drives,
            prepared: false,
            poses: Vec::new(),
            g: Vec::new(),
            factor: Factor::default(),
            factor_id: 0,
            row_impulses: Vec::new(),
            loads: Loads::default(),
            work: Default::default(),
        };
        // A cluster that only stands because hubs move (a rod pair on a body welded to the chassis) is solved among the hubs.
        loop {
            s.layout = Layout::new(&s.bodies, &hub, &s.rows, s.reduction.ny);
            s.make_hub_mass();
            s.find_poses();
            s.jacobian();
            match s.factor.factor(&s.layout, &s.g, &s.inverse, &s.hub_mass) {
                Ok(()) => break,
                Err(e) => match e.0 {
                    Some(c) => s.layout.clusters[c].bodies.iter().for_each(|b| hub[b.body] = true),
                    None => {
                        return Err(MbsError::Singular {
                            joint: s.joints.first().cloned().unwrap_or_default(),
                            time: 0.0,
                        });
                    }
                },
            }
        }
        Ok(s)
    }

    pub(crate) fn make_hub_mass(&mut self) {
        let (nb, l, r) = (self.layout.nb, &self.layout, &self.reduction);
        let m = &mut self.hub_mass;
        m.clear();
        m.resize(nb * nb, 0.0);
        for (b, col) in l.hub_col.iter().enumerate() {
            if let Some(c) = *col {
                for t in 0..3 {
                    m[(c + t) * nb + c + t] = self.bodies[b].mass;
                    for v in 0..3 {
                        m[(c + 3 + t) * nb + c + 3 + v] = self.bodies[b].inertia[(t, v)];
                    }
                }
            }
        }
        let s = l.shaft_col;
        for p in 0..r.ny {
            for q in 0..r.ny {
                m[(s + p) * nb + s + q] = r.m_yy[p * r.ny + q];
            }
        }
        if let Some(c) = l.hub_col[self.carrier] {
            for t in 0..3 {
                for v in 0..3 {
                    m[(c + 3 + t) * nb + c + 3 + v] += r.m_ww[t][v];
                }
                for p in 0..r.ny {
                    m[(c + 3 + t) * nb + s + p] = r.m_yw[p][t];
                    m[(s + p) * nb + c + 3 + t] = r.m_yw[p][t];
                }
            }
        }
    }

    pub(crate) fn find_poses(&mut self) {
        self.poses.clear();
        self.poses.extend(self.motions.iter().map(Motion::pose));
    }

    pub(crate) fn jacobian(&mut self) {
        self.g.resize(self.layout.rows(), [0.0; 12]);
        for (k, (p, a, b)) in self.rows.iter().enumerate() {
            let r = self.layout.first_row[k];
            p.jacobian(&self.poses[*a], &self.poses[*b], &self.drives, &mut self.g[r..r + p.rows()]);
        }
    }

    /// Poses, Jacobian and factor for the state, unless they are there.
    pub(crate) fn prepare(&mut self) -> Result<(), MbsError> {
        if self.prepared {
            return Ok(());
        }
        self.find_poses();
        self.refactor()
    }

    /// Jacobian and factor for the poses there are.
    pub(crate) fn refactor(&mut self) -> Result<(), MbsError> {
        self.jacobian();
        self.factor_id += 1;
        if let Err(e) = self.factor.factor(&self.layout, &self.g, &self.inverse, &self.hub_mass) {
            let row = e.0.map_or(self.layout.hub_rows.start, |c| self.layout.clusters[c].row0);
            let k = (0..self.rows.len()).find(|&k| self.layout.first_row[k] == row).unwrap_or(0);
            let joint = self.joint_of.get(k).map(|&j| self.joints[j].clone()).unwrap_or_default();
            return Err(MbsError::Singular { joint, time: self.time });
        }
        self.prepared = true;
        Ok(())
    }

    /// Time (s).
    pub fn time(&self) -> f64 {
        self.time
    }
    /// Sets the clock (s).
    pub fn set_time(&mut self, time: f64) {
        self.time = time;
    }
    /// Replaces gravity (m/s2, in W).
    pub fn set_gravity(&mut self, g: Vec3) {
        self.gravity = g;
    }
    /// State of a body.
    pub fn motion(&self, body: BodyId) -> &Motion {
        &self.motions[body.0]
    }
    /// Replaces the state of a body; whoever does so for jointed bodies calls [`System::close`] afterwards.
    pub fn set_motion(&mut self, body: BodyId, m: Motion) {
        self.motions[body.0] = m;
        self.prepared = false;
    }
    /// Interface state of a body.
    pub fn rigid_state(&self, body: BodyId) -> RigidState {
        self.motions[body.0].rigid_state()
    }
    /// All bodies, the ground first.
    pub fn all_bodies(&self) -> impl Iterator<Item = (BodyId, &Body)> {
        self.bodies.iter().enumerate().map(|(i, b)| (BodyId(i), b))
    }
    /// Mass of a body (kg).
    pub fn body_mass(&self, body: BodyId) -> f64 {
        self.bodies[body.0].mass
    }
    /// Mass of all bodies (kg).
    pub fn mass(&self) -> f64 {
        self.bodies[1..].iter().map(|b| b.mass).sum()
    }
    /// Centre of mass of all bodies (m, in W).
    pub fn center_of_mass(&self) -> Vec3 {
        let sum: Vec3 = (1..self.bodies.len()).map(|i| self.motions[i].p * self.bodies[i].mass).sum();
        sum / self.mass()
    }
    /// Speed of a shaft (rad/s).
    pub fn shaft_speed(&self, shaft: ShaftId) -> f64 {
        self.shaft_speeds[shaft.0]
    }
    /// Sets speeds of shafts; made consistent by the next step.
    pub fn set_shaft_speed(&mut self, shaft: ShaftId, w: f64) {
        self.shaft_speeds[shaft.0] = w;
    }
    /// Shafts, gears and differentials.
    pub fn shafts(&self) -> &ShaftNetwork {
        &self.network
    }
    /// Prescribes value and rate that a drive has at the **end** of the next step (or at the next [`System::close`]).
    pub fn set_drive(&mut self, drive: DriveId, value: f64, rate: f64) {
        self.next_drives[drive.0] = Drive { value, rate };
    }
    /// Torque limit (N m) of a friction element from now on; 0 releases it.
    pub fn set_friction(&mut self, f: FrictionId, limit: f64) {
        self.friction_limit[f.0] = limit.max(0.0);
    }
    /// Mean torque (N m) of a friction element over the last step.
    pub fn friction_torque(&self, f: FrictionId) -> f64 {
        self.friction_torque[f.0]
    }
    /// Impulse (N m s) of the shaft that turns with `body` on it at the last solve, over half a step; `None` without such a shaft.
    pub fn spin_impulse(&self, body: BodyId) -> Option<f64> {
        let k = self.rows.iter().position(|(p, _, b)| *b == body.0 && p.of_velocity())?;
        self.row_impulses.get(self.layout.first_row[k]).copied()
    }
    /// Gives shafts the speeds that follow from the bodies they turn with; independent ones keep theirs.
    pub fn roll_shafts(&mut self) {
        let mut y = vec![0.0; self.reduction.ny];
        for (s, w) in self.shaft_speeds.iter().enumerate() {
            if let Some(col) = self.reduction.independent.iter().position(|&i| i == s) {
                y[col] = *w;
            }
        }
        for (p, _, b) in &self.rows {
            if let Primitive::Spin { axis_b, shaft } = p {
                y[*shaft] = axis_b.dot(&self.motions[*b].w_body());
            }
        }
        let carrier = self.motions[self.carrier].u;
        self.reduction.speeds(&y, &carrier[3..], &mut self.shaft_speeds);
    }
    /// Changes the ratio of a coaxial gear along `d`; `None` is neutral. Speeds follow from the balance of momentum.
    ///
    /// # Errors
    /// [`MbsError::Shafts`].
    pub fn set_gear(&mut self, gear: GearId, ratio: Option<f64>, d: Vec3) -> Result<(), MbsError> {
        self.network.set_ratio(gear, ratio, d);
        self.reduction = self.network.reduce()?;
        self.layout.nb = self.layout.shaft_col + self.reduction.ny;
        self.make_hub_mass();
        self.prepared = false;
        Ok(())
    }
    /// Length, rate and tension of spring-damper `i`, in the order of making.
    pub fn stroke(&self, i: usize) -> Stroke {
        let poses: Vec<Pose> = self.motions.iter().map(Motion::pose).collect();
        let u: Vec<[f64; 6]> = self.motions.iter().map(|m| m.u).collect();
        self.springs[i].stroke(&poses, &u).0
    }
    /// Spring-dampers by name.
    pub fn springs(&self) -> &[SpringDamper] {
        &self.springs
    }
    /// Moves the whole system rigidly: by the rotation `q` about the origin, then by `p` (m). Only for systems not tied to the ground.
    pub fn place(&mut self, p: &Vec3, q: &Quat) {
        for m in &mut self.motions[1..] {
            let (v, w) = (q * m.v(), m.w_body());
            m.p = q * m.p + p;
            m.q = Quat::new_normalize((q * m.q).into_inner());
            m.u = [v.x, v.y, v.z, w.x, w.y, w.z];
        }
        self.prepared = false;
    }
    /// All velocities to zero.
    pub fn stop(&mut self) {
        self.motions.iter_mut().for_each(|m| m.u = [0.0; 6]);
        self.shaft_speeds.fill(0.0);
    }
    /// Gives the system the velocity field of a rigid body: `v` (m/s) at the origin and `w` (rad/s), in W. Shafts are left as they are.
    pub fn launch(&mut self, v: &Vec3, w: &Vec3) {
        for m in &mut self.motions[1..] {
            let at = v + w.cross(&m.p);
            m.set_velocity(&at, w);
        }
    }
    /// Kinetic energy of bodies and shafts (J).
    pub fn kinetic_energy(&self) -> f64 {
        let bodies: f64 = (1..self.bodies.len())
            .map(|i| {
                let (m, b) = (&self.motions[i], &self.bodies[i]);
                0.5 * (b.mass * m.v().norm_squared() + m.w_body().dot(&(b.inertia * m.w_body())))
            })
            .sum();
        let shafts: f64 = self.network.inertia().iter().zip(&self.shaft_speeds).map(|(j, w)| 0.5 * j * w * w).sum();
        bodies + shafts
    }
    /// Work of springs, shocks, friction and prescribed motions so far (J).
    pub fn work_done(&self) -> EnergyWork {
        self.done
    }
    /// Work counts anew from here.
    pub fn forget_work(&mut self) {
        self.done = EnergyWork::default();
    }
    /// Energy in gravity (J), zero at z = 0.
    pub fn gravity_energy(&self) -> f64 {
        -(1..self.bodies.len()).map(|i| self.bodies[i].mass * self.gravity.dot(&self.motions[i].p)).sum::<f64>()
    }
    /// Momentum (kg m/s) and angular momentum about the origin (kg m2/s) of the bodies, in W.
    pub fn momentum(&self) -> (Vec3, Vec3) {
        (1..self.bodies.len()).fold((Vec3::zeros(), Vec3::zeros()), |(p, l), i| {
            let (m, b) = (&self.motions[i], &self.bodies[i]);
            let mv = m.v() * b.mass;
            (p + mv, l + m.p.cross(&mv) + m.q * (b.inertia * m.w_body()))
        })
    }
    /// The largest gap of any joint now: (m or rad, joint).
    pub fn largest_gap(&self) -> (f64, &str) {
        let poses: Vec<Pose> = self.motions.iter().map(Motion::pose).collect();
        let (gap, k) = assembly::largest(&self.rows, &poses, &self.drives);
        (gap, self.joint_of.get(k).map_or("", |&j| &self.joints[j]))
    }
    /// Closes the joints again from the present positions (drives may have moved) without regard to velocities.
    ///
    /// # Errors
    /// [`MbsError::DoesNotClose`].
    pub fn close(&mut self) -> Result<(), MbsError> {
        self.prepared = false;
        self.drives.clone_from(&self.next_drives);
        assembly::close(&self.rows, &self.joint_of, &self.joints, &self.inverse, &self.drives, &mut self.motions)
    }
    /// State as plain numbers: time, 13 a body, shafts, drives, work done.
    pub fn save(&self) -> Vec<f64> {
        let mut x = vec![self.time];
        x.extend(self.motions[1..].iter().flat_map(Motion::to_array));
        x.extend(&self.shaft_speeds);
        x.extend(self.drives.iter().flat_map(|d| [d.value, d.rate]));
        x.extend(self.done.to_array());
        x
    }
    /// Takes a state back, bit for bit.
    ///
    /// # Errors
    /// The number of values expected, if it differs.
    pub fn restore(&mut self, x: &[f64]) -> Result<(), usize> {
        let (nb, ns, nd) = (self.motions.len() - 1, self.shaft_speeds.len(), self.drives.len());
        let work = 1 + 13 * nb + ns + 2 * nd;
        let n = work + self.done.to_array().len();
        if x.len() != n {
            return Err(n);
        }
        self.time = x[0];
        for (m, a) in self.motions[1..].iter_mut().zip(x[1..].chunks_exact(13)) {
            *m = Motion::from_array(a.try_into().expect("chunks of 13"));
        }
        self.shaft_speeds.copy_from_slice(&x[1 + 13 * nb..1 + 13 * nb + ns]);
        for (d, a) in self.drives.iter_mut().zip(x[1 + 13 * nb + ns..work].chunks_exact(2)) {
            *d = Drive { value: a[0], rate: a[1] };
        }
        self.done = EnergyWork::from_array(std::array::from_fn(|k| x[work + k]));
        self.next_drives.clone_from(&self.drives);
        self.prepared = false;
        Ok(())
    }
    /// Turns a small rotation vector in body axes into a quaternion factor.
    #[inline]
    pub(crate) fn turned(q: &Quat, theta: &Vec3) -> Quat {
        let s = theta.norm_squared();
        if s > 0.04 {
            return Quat::new_normalize((q * rotation::exp(theta)).into_inner());
        }
        // Series of sin(a/2)/a and cos(a/2) to 1e-17 for a < 0.2: no library calls in the inner loop.
        let t = 0.25 * s;
        let half_sinc = 0.5 * (1.0 - t / 6.0 * (1.0 - t / 20.0 * (1.0 - t / 42.0)));
        let c = 1.0 - t / 2.0 * (1.0 - t / 12.0 * (1.0 - t / 30.0 * (1.0 - t / 56.0)));
        let e = nalgebra::Quaternion::new(c, theta.x * half_sinc, theta.y * half_sinc, theta.z * half_sinc);
        let p = q.into_inner() * e;
        // One Newton step of the inverse square root: the norm is 1 to round-off already.
        Quat::new_unchecked(p * (1.5 - 0.5 * p.norm_squared()))
    }
}
