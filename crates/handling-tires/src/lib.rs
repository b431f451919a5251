//! Tire models for handling: forces of a wheel on firm ground as functions of deflection and slip.
//!
//! The ground is seen through one plane under the wheel: height, normal and friction ([`Probe`]); on uneven ground [`envelope`] finds the plane
//! that stands for a profile. From it and the wheel's state a
//! [`Contact`] frame follows (x along the wheel's heading, y to its left, z along the normal); a [`Tire`] gives forces and moments in that frame, which
//! [`Contact::wrench`] turns into the wrench about the wheel centre.
//!
//! Slip: `kappa = (omega r - v_x) / |v_x|`, `tan(alpha) = v_y / |v_x|`, so that a positive slip angle gives a negative side force.
//! Transient slip by relaxation lengths ([`Transient`]): at standstill the carcass is a spring, so that a vehicle can stand on a slope.
//!
//! ```
//! use terramech_handling_tires::{Contact, Probe, Tire, Transient, fiala::Fiala};
//! use terramech_mechanics::RigidState;
//! let tire = Tire::Fiala(Fiala::hmmwv());
//! let wheel = RigidState { position: [0.0, 0.0, 0.45].into(), velocity: [10.0, 0.0, 0.0].into(),
//!     angular_velocity: [0.0, 10.0 / 0.45, 0.0].into(), ..RigidState::default() };
//! let contact = Contact::new(&wheel, &Probe::level(0.0, 0.9), tire.radius()).unwrap();
//! let f = tire.forces(&contact, &Transient::default(), 1.0);
//! assert!((f.force.z - 3477.0).abs() < 1.0); // 20 mm on the curve
//! ```
#![forbid(unsafe_code)]

pub mod contact;
pub mod envelope;
pub mod fiala;
pub mod pac02;
pub mod rigid;
pub mod tir;
mod transient;
pub mod unit;

pub use contact::{Contact, Probe, TireForces, Wrench};
pub use transient::Transient;

/// A tire model.
#[derive(Clone, Debug, PartialEq)]
pub enum Tire {
    /// Stiff contact with Coulomb friction.
    Rigid(rigid::Rigid),
    /// Fiala's brush-like model.
    Fiala(fiala::Fiala),
    /// Magic Formula, Pacejka 2002.
    Pac02(Box<pac02::Pac02>),
}

impl Tire {
    /// Undeformed radius (m).
    pub fn radius(&self) -> f64 {
        match self {
            Self::Rigid(t) => t.radius,
            Self::Fiala(t) => t.radius,
            Self::Pac02(t) => t.radius(),
        }
    }
    /// Relaxation lengths (m) along and across at a vertical load (N).
    pub fn relaxation(&self, load: f64, camber: f64) -> [f64; 2] {
        match self {
            Self::Rigid(t) => [t.relaxation; 2],
            Self::Fiala(t) => [t.relaxation_x, t.relaxation_y],
            Self::Pac02(t) => t.relaxation(load, camber),
        }
    }
    /// Slips (kappa, tan alpha) at which the friction is as good as spent: beyond them a standing carcass slides instead of winding up.
    pub fn saturation(&self, load: f64, friction: f64) -> [f64; 2] {
        match self {
            Self::Rigid(t) => [2.0 * t.full_slip; 2],
            Self::Fiala(t) => {
                let limit = t.friction_max * friction / t.reference_friction * load;
                [2.0 * limit / t.longitudinal_stiffness, 3.0 * limit / t.cornering_stiffness]
            }
            Self::Pac02(t) => t.saturation(load),
        }
    }
    /// Vertical load (N) of a contact.
    pub fn load(&self, c: &Contact) -> f64 {
        match self {
            Self::Rigid(t) => t.load(c),
            Self::Fiala(t) => t.load(c),
            Self::Pac02(t) => t.load(c),
        }
    }
    /// Forces and moments in the contact frame for the transient slip; `side` is 1 for a left, -1 for a right wheel (models with conicity
    /// are mirrored).
    pub fn forces(&self, c: &Contact, s: &Transient, side: f64) -> TireForces {
        let load = self.load(c);
        if load <= 0.0 {
            return TireForces::default();
        }
        let slip = s.damped(c, self.relaxation(load, c.camber));
        match self {
            Self::Rigid(t) => t.forces(c, load, slip),
            Self::Fiala(t) => t.forces(c, load, slip),
            Self::Pac02(t) => t.forces(c, load, slip, side),
        }
    }
}
