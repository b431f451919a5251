//! Rigid bodies and their motion.

use super::MbsError;
use terramech_mechanics::{Mat3, Quat, RigidState, Vec3, rotation};

/// Handle of a body in its model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BodyId(pub(crate) usize);

/// The inertial frame as a body: it never moves.
pub const GROUND: BodyId = BodyId(0);

impl BodyId {
    /// Position in lists of bodies; the ground is 0.
    pub fn index(self) -> usize {
        self.0
    }
}

/// Mass properties of a body.
#[derive(Clone, Debug)]
pub struct Body {
    /// Name in messages.
    pub name: String,
    /// Mass (kg).
    pub mass: f64,
    /// `I_BC_B`, inertia about the centre of mass in body axes (kg m2).
    pub inertia: Mat3,
    /// Touches many clusters (a chassis, a steering link): eliminated last.
    pub hub: bool,
}

impl Body {
    /// Refuses a body that cannot exist.
    ///
    /// # Errors
    /// [`MbsError::Body`].
    pub fn check(&self) -> Result<(), MbsError> {
        let fault =
            |what, given: String, allowed| Err(MbsError::Body { body: self.name.clone(), what, given, allowed });
        if !(self.mass.is_finite() && self.mass > 0.0) {
            return fault("mass", format!("{} kg", self.mass), "a finite number above 0");
        }
        let e = self.inertia.symmetric_eigenvalues();
        let (sum, most) = (e.sum(), e.max());
        if !e.iter().all(|x| x.is_finite() && *x > 0.0) {
            return fault("inertia", format!("{:?} kg m2 (principal)", e.as_slice()), "three positive moments");
        }
        // The triangle inequality of moments of inertia. Published data miss it by up to 12 % (the HMMWV's lower arms), which the equations
        // of motion bear; beyond a quarter it is a slip of the pen.
        if most > (sum - most) * 1.25 {
            return fault(
                "inertia",
                format!("{:?} kg m2 (principal)", e.as_slice()),
                "no principal moment larger than 1.25 times the sum of the other two (1 for exact data)",
            );
        }
        Ok(())
    }
}

/// Position and orientation, as the constraint rows need them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// `p_WC` (m).
    pub p: Vec3,
    /// `R_WB`.
    pub r: Mat3,
}

impl Pose {
    /// `p_WP` of the body-fixed point `p_CP` (m).
    pub fn point(&self, p_cp: &Vec3) -> Vec3 {
        self.p + self.r * p_cp
    }
}

/// State of one body: position of its centre of mass, orientation, and the six velocities the solver works with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// `p_WC` (m).
    pub p: Vec3,
    /// `q_WB`.
    pub q: Quat,
    /// `v_WC_W` (m/s) and `w_WB_B` (rad/s, **body** axes).
    pub u: [f64; 6],
}

impl Motion {
    /// At rest at a place.
    pub fn at(p: Vec3, q: Quat) -> Self {
        Self { p, q, u: [0.0; 6] }
    }
    /// `v_WC_W` (m/s).
    pub fn v(&self) -> Vec3 {
        Vec3::new(self.u[0], self.u[1], self.u[2])
    }
    /// `w_WB_B` (rad/s).
    pub fn w_body(&self) -> Vec3 {
        Vec3::new(self.u[3], self.u[4], self.u[5])
    }
    /// `w_WB_W` (rad/s).
    pub fn w_world(&self) -> Vec3 {
        self.q * self.w_body()
    }
    /// Sets `v_WC_W` and `w_WB_W`.
    pub fn set_velocity(&mut self, v_w: &Vec3, w_w: &Vec3) {
        let w = self.q.inverse() * w_w;
        self.u = [v_w.x, v_w.y, v_w.z, w.x, w.y, w.z];
    }
    /// Pose of this motion.
    pub fn pose(&self) -> Pose {
        Pose { p: self.p, r: rotation::matrix(&self.q) }
    }
    /// Velocity (m/s, in W) of the body-fixed point `p_CP`.
    pub fn point_velocity(&self, p_cp: &Vec3) -> Vec3 {
        self.v() + self.q * self.w_body().cross(p_cp)
    }
    /// The state in interface form: angular velocity in the inertial frame.
    pub fn rigid_state(&self) -> RigidState {
        RigidState { position: self.p, orientation: self.q, velocity: self.v(), angular_velocity: self.w_world() }
    }
    /// Thirteen plain numbers (p, q scalar first, u): what a saved state holds.
    pub fn to_array(&self) -> [f64; 13] {
        let q = rotation::to_wxyz(&self.q);
        let u = &self.u;
        [self.p.x, self.p.y, self.p.z, q[0], q[1], q[2], q[3], u[0], u[1], u[2], u[3], u[4], u[5]]
    }
    /// The reverse of [`Self::to_array`], changing no bit.
    pub fn from_array(a: &[f64; 13]) -> Self {
        Self {
            p: Vec3::new(a[0], a[1], a[2]),
            q: Quat::new_unchecked(nalgebra::Quaternion::new(a[3], a[4], a[5], a[6])),
            u: [a[7], a[8], a[9], a[10], a[11], a[12]],
        }
    }
}
