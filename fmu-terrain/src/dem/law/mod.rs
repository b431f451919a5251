//! Contact force laws: stiffness and damping of a contact as functions of its overlap.
//!
//! delta > 0 is overlap, v_n > 0 separating, v_t the tangential slip velocity, u the tangential displacement. Every law
//! gives the four terms of
//!
//! F_n = k_n delta - g_n v_n (along the normal), F_t = -(k_t u + g_t v_t), limited by Coulomb,
//!
//! and one file holds one law. Effective quantities: m* = m1 m2/(m1+m2), R* = r1 r2/(r1+r2); a wall or body is
//! infinitely heavy and flat. The choice is made by [`LawKind`] in the specification; the kernels are generic over
//! [`Law`], so that nothing is dispatched inside the loop.
//!
//! To add a law: a file with its `impl Law`, a name in [`LawKind`], a line in the `dispatch_law` macro. The generic
//! checks in `checks.rs` then run on it.

#[cfg(test)]
mod checks;
pub mod flores;
pub mod hertz_mindlin;
pub mod hooke;
pub mod plain_coulomb;

use super::material::Pair;
use serde::{Deserialize, Serialize};

/// The terms of a contact at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// k_n, secant normal stiffness (N/m).
    pub kn: f64,
    /// g_n, normal damping (N s/m).
    pub gn: f64,
    /// k_t, tangential stiffness (N/m).
    pub kt: f64,
    /// g_t, tangential damping (N s/m).
    pub gt: f64,
}

/// A force law.
pub trait Law: Copy + Send + Sync + 'static {
    /// Friction is mu tanh(5 v_t) F_n instead of a spring with a Coulomb limit.
    const CREEPS: bool = false;
    /// The terms at overlap `delta` (m) > 0, effective radius `r_eff` (m), effective mass `m_eff` (kg), separation
    /// speed `vn` (m/s).
    fn terms(&self, pair: &Pair, delta: f64, r_eff: f64, m_eff: f64, vn: f64) -> Terms;
}

/// Which law.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LawKind {
    /// Linear spring.
    Hooke,
    /// Hertz normal, Mindlin tangential stiffness.
    #[default]
    HertzMindlin,
    /// Hertz with the dissipation of Flores et al.
    Flores,
    /// Hertz-like with regularised Coulomb friction: the source paper's driver.
    PlainCoulomb,
}

impl LawKind {
    /// Every law.
    pub const ALL: [Self; 4] = [Self::Hooke, Self::HertzMindlin, Self::Flores, Self::PlainCoulomb];
}

/// Where stiffness and damping come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Form {
    /// Young's modulus, Poisson's ratio and restitution.
    #[default]
    Properties,
    /// Coefficients k, g given ([`super::material::Coefficients`]).
    Coefficients,
}

/// How the tangential displacement u is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tangential {
    /// u = 0: damping only.
    None,
    /// u = v_t h, this step's slip only.
    OneStep,
    /// Accumulated per pair, turned with the contact, cut back on slip.
    #[default]
    History,
}

/// Runs `$body` with `$law` bound to the law value that `$kind`, `$form` choose.
macro_rules! dispatch_law {
    ($kind:expr, $form:expr, $law:ident => $body:expr) => {
        match $kind {
            $crate::dem::law::LawKind::Hooke => {
                let $law = $crate::dem::law::hooke::Hooke { form: $form };
                $body
            }
            $crate::dem::law::LawKind::HertzMindlin => {
                let $law = $crate::dem::law::hertz_mindlin::HertzMindlin { form: $form };
                $body
            }
            $crate::dem::law::LawKind::Flores => {
                let $law = $crate::dem::law::flores::Flores { form: $form };
                $body
            }
            $crate::dem::law::LawKind::PlainCoulomb => {
                let $law = $crate::dem::law::plain_coulomb::PlainCoulomb { form: $form };
                $body
            }
        }
    };
}
pub(crate) use dispatch_law;

/// The terms of the law that `kind` and `form` name: for estimates outside the kernels.
pub fn terms_of(kind: LawKind, form: Form, pair: &Pair, delta: f64, r_eff: f64, m_eff: f64, vn: f64) -> Terms {
    dispatch_law!(kind, form, law => law.terms(pair, delta, r_eff, m_eff, vn))
}
