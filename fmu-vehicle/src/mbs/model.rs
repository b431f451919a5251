//! A multibody model in its making: bodies, joints, forces and shafts at the design position.

use super::friction::Friction;
use super::primitive::DriveId;
use super::{
    Body, BodyId, FrictionId, GROUND, MbsError, Motion, Primitive, ShaftId, ShaftNetwork, SpringDamper, System,
};
use terramech_mechanics::{Mat3, Quat, Vec3};

/// A model under construction. Points and axes are given in the inertial frame at the design position. Faults are collected and
/// told by [`Model::build`].
#[derive(Clone, Debug)]
pub struct Model {
    pub(crate) bodies: Vec<Body>,
    pub(crate) motions: Vec<Motion>,
    pub(crate) joints: Vec<String>,
    /// Joint, rows, A, B.
    pub(crate) constraints: Vec<(usize, Primitive, usize, usize)>,
    pub(crate) springs: Vec<SpringDamper>,
    pub(crate) frictions: Vec<Friction>,
    pub(crate) drives: usize,
    /// Shafts, gears and differentials.
    pub shafts: ShaftNetwork,
    /// The body whose housing the gears sit in; must be a hub or the ground.
    pub carrier: BodyId,
    /// Gravity (m/s2), in W.
    pub gravity: Vec3,
    faults: Vec<MbsError>,
}

impl Default for Model {
    fn default() -> Self {
        Self::new()
    }
}

impl Model {
    /// Only the ground.
    pub fn new() -> Self {
        let ground = Body { name: "ground".into(), mass: 1.0, inertia: Mat3::identity(), hub: false };
        Self {
            bodies: vec![ground],
            motions: vec![Motion::at(Vec3::zeros(), Quat::identity())],
            joints: Vec::new(),
            constraints: Vec::new(),
            springs: Vec::new(),
            frictions: Vec::new(),
            drives: 0,
            shafts: ShaftNetwork::default(),
            carrier: GROUND,
            gravity: Vec3::new(0.0, 0.0, -9.81),
            faults: Vec::new(),
        }
    }

    /// A body with its centre of mass at `p_wc` (m), axes `q_wb`, inertia about the centre in body axes (kg m2).
    pub fn body(&mut self, name: &str, mass: f64, inertia: Mat3, p_wc: Vec3, q_wb: Quat) -> BodyId {
        let body = Body { name: name.into(), mass, inertia, hub: false };
        if let Err(e) = body.check() {
            self.faults.push(e);
        }
        self.bodies.push(body);
        self.motions.push(Motion::at(p_wc, q_wb));
        BodyId(self.bodies.len() - 1)
    }

    /// Marks a body that touches many clusters of others (a chassis, a steering link): it is eliminated last.
    pub fn hub(&mut self, body: BodyId) {
        self.bodies[body.0].hub = true;
    }

    /// Adds mass and inertia (about the centre of mass, body axes) to a body: a wheel on its spindle.
    pub fn add_mass(&mut self, body: BodyId, mass: f64, inertia: Mat3) {
        self.bodies[body.0].mass += mass;
        self.bodies[body.0].inertia += inertia;
    }

    /// Number of bodies, the ground included.
    pub fn bodies(&self) -> usize {
        self.bodies.len()
    }

    /// Name of a body.
    pub fn body_name(&self, body: BodyId) -> &str {
        &self.bodies[body.0].name
    }

    /// Mass of all bodies together (kg).
    pub fn mass(&self) -> f64 {
        self.bodies[1..].iter().map(|b| b.mass).sum()
    }

    /// Design position of a body's centre of mass (m).
    pub fn position(&self, body: BodyId) -> Vec3 {
        self.motions[body.0].p
    }

    /// A direction of a body's axes in W, at the design position.
    pub fn direction(&self, body: BodyId, d_b: &Vec3) -> Vec3 {
        self.motions[body.0].q * d_b
    }

    /// Adds a spring-damper between points given at the design position (m); its index.
    pub fn spring(&mut self, pa_w: &Vec3, pb_w: &Vec3, mut spring: SpringDamper) -> usize {
        if (pa_w - pb_w).norm() < 1e-6 {
            let joint = spring.name.clone();
            self.faults.push(MbsError::Geometry { joint, what: format!("its two ends coincide at {pa_w:?}") });
        }
        spring.p_ap = self.local_point(spring.a, pa_w);
        spring.p_bp = self.local_point(spring.b, pb_w);
        self.springs.push(spring);
        self.springs.len() - 1
    }

    /// Lets `body` turn a shaft: the shaft's speed is the body's angular velocity about `axis_w`.
    pub fn couple(&mut self, name: &str, body: BodyId, axis_w: &Vec3, shaft: ShaftId) {
        let j = self.joint(name);
        let n = self.unit(j, "axis", axis_w);
        let axis_b = self.local_direction(body, &n);
        let column = self.shafts.couple(shaft);
        self.constrain(j, Primitive::Spin { axis_b, shaft: column }, GROUND, body);
    }

    /// Dry friction of `b` turning against `a` about `axis_w`.
    pub fn friction(&mut self, a: BodyId, b: BodyId, axis_w: &Vec3) -> FrictionId {
        let n = axis_w.normalize();
        let (axis_a, axis_b) = (self.local_direction(a, &n), self.local_direction(b, &n));
        self.frictions.push(Friction::Bodies { a, b, axis_a, axis_b });
        FrictionId(self.frictions.len() - 1)
    }

    /// A clutch between two shafts.
    pub fn clutch(&mut self, a: ShaftId, b: ShaftId) -> FrictionId {
        self.frictions.push(Friction::Shafts { a, b });
        FrictionId(self.frictions.len() - 1)
    }

    /// Assembles the model: joints closed, redundancy checked, structure of the solver found.
    ///
    /// # Errors
    /// The first fault collected; joints that do not close; redundant constraints.
    pub fn build(self) -> Result<System, MbsError> {
        match self.faults.first() {
            Some(e) => Err(e.clone()),
            None => System::new(self),
        }
    }

    /// All faults so far.
    pub fn faults(&self) -> &[MbsError] {
        &self.faults
    }

    pub(crate) fn joint(&mut self, name: &str) -> usize {
        self.joints.push(name.into());
        self.joints.len() - 1
    }
    pub(crate) fn last_joint(&self) -> usize {
        self.joints.len() - 1
    }
    pub(crate) fn drive(&mut self) -> DriveId {
        self.drives += 1;
        DriveId(self.drives - 1)
    }
    pub(crate) fn constrain(&mut self, joint: usize, row: Primitive, a: BodyId, b: BodyId) {
        self.constraints.push((joint, row, a.0, b.0));
    }
    pub(crate) fn fault(&mut self, joint: usize, what: String) {
        self.faults.push(MbsError::Geometry { joint: self.joints[joint].clone(), what });
    }
    pub(crate) fn unit(&mut self, joint: usize, what: &str, d: &Vec3) -> Vec3 {
        let n = d.norm();
        if n > 1e-9 && n.is_finite() {
            return d / n;
        }
        self.fault(joint, format!("{what} ({}, {}, {}); it needs a direction of length above 0", d.x, d.y, d.z));
        Vec3::x()
    }
    pub(crate) fn local_point(&self, body: BodyId, p_w: &Vec3) -> Vec3 {
        let m = &self.motions[body.0];
        m.q.inverse() * (p_w - m.p)
    }
    pub(crate) fn local_direction(&self, body: BodyId, d_w: &Vec3) -> Vec3 {
        self.motions[body.0].q.inverse() * d_w
    }
}
