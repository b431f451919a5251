//! One contact: from kinematics and history to force and couple. Every kind of contact (grain-grain, grain-wall,
//! grain-body) goes through [`evaluate`], so that a law or a resistance is written once.
//!
//! **Normal.** F_n = k_n delta - g_n v_n, not clamped at zero unless asked; the adhesion A is subtracted: F_net = F_n - A.
//!
//! **Tangential.** A slider in series with spring and dashpot side by side. While it sticks, F_t = -(k_t u + g_t v_t). If
//! that exceeds the Coulomb limit mu (F_net + A), the force is the limit in the same direction and u relaxes towards
//! limit/k_t with the dashpot's rate, u <- (g_t u + h limit d)/(g_t + k_t h), never beyond it: the element cannot make
//! energy, whatever the damping. Between steps u turns with the contact: about the normal with the mean spin of
//! the two, and back into the tangent plane.
//!
//! **Rolling and spinning** (model C of Ai, Chen, Rotter, Ooi 2011): the same element on the relative rotation rho
//! (one vector: its normal part spins, its tangential part rolls), stiffness k_r = 2.25 k_n (mu_r R*)^2, dashpot
//! 2 eta sqrt(k_r I_r) with I_r = 1.4/(1/(m1 r1^2) + 1/(m2 r2^2)), limit torque mu_r R* F_n; the dashpot adds to the
//! spring only up to the limit. Spinning: mu_s and 0.4 instead of mu_r and 1.4.

use super::law::{Law, Tangential};
use super::material::Pair;
use super::vec3::{Vec3, add, add_scaled, cross, dot, reject, scale};
use std::f64::consts::PI;

/// Memory of a touching pair: tangential displacement u (m) and, fourth, how far adhesion has grown (0 exclusive to 1; below 0 see
/// [`super::offset`]); all zero while the pair does not touch.
pub use terramech_simd::Slip;

/// Memory of a touching pair: relative rotation rho (rad).
pub type Roll = [f64; 3];

/// What is the same for all contacts during a step.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Step h (s).
    pub h: f64,
    /// How the tangential displacement is followed.
    pub tangential: Tangential,
    /// Least normal force: 0 for the clamped variant, -infinity otherwise.
    pub least_normal: f64,
    /// Whether any pair adheres.
    pub adhesion: bool,
    /// Whether overlaps may count from an offset ([`super::offset`]).
    pub offsets: bool,
    /// Factor on all adhesion, 0 to 1: ramps cohesion into a bed prepared without it.
    pub adhesion_scale: f64,
    /// What adhesion of a contact grows by per step: h / ramp time; 1 = at once.
    pub adhesion_growth: f64,
    /// 1 / (overlap at which adhesion is fully grown) (1/m); infinite = at once.
    pub adhesion_per_overlap: f64,
    /// eta, damping ratio of rolling and spinning.
    pub rolling_damping: f64,
    /// Pairs that are closer than touching and this (m) are looked at between two selections ([`super::slab::Near`]).
    pub margin: f64,
}

/// Kinematics of a contact of grain i with something (j).
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    /// Unit normal, towards grain i.
    pub n: Vec3,
    /// Overlap (m), positive.
    pub delta: f64,
    /// R* (m).
    pub r_eff: f64,
    /// Radius for the cohesive pressure (m).
    pub r_adhesion: f64,
    /// 1/m* (1/kg).
    pub inv_m: f64,
    /// 1/(m1 r1^2) + 1/(m2 r2^2) (1/(kg m2)).
    pub inv_mr2: f64,
    /// Velocity of i's contact point relative to j's (m/s).
    pub v: Vec3,
    /// Angular velocity of i relative to j (rad/s).
    pub w_rel: Vec3,
    /// Mean spin of the two about the normal (rad/s).
    pub spin: f64,
    /// n x (rate of n) [rad/s]: how the contact frame tilts.
    pub tilt: Vec3,
    /// Factor on the load, for the caller to apply: below 1 where several touches of a body are one surface.
    pub weight: f64,
}

/// Force and couple on grain i; the opposite acts on the partner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Net normal force, adhesion subtracted (N), positive pushes apart.
    pub normal: f64,
    /// Tangential force (N).
    pub tangential: Vec3,
    /// Rolling and spinning couple (N m).
    pub couple: Vec3,
}

/// Evaluates a contact and moves its history on by one step.
#[inline(always)]
pub fn evaluate<L: Law, const ROLL: bool>(
    law: &L,
    pair: &Pair,
    opt: &Options,
    c: &Touch,
    slip: &mut Slip,
    roll: Option<&mut Roll>,
) -> Load {
    let m_eff = 1.0 / c.inv_m;
    let vn = dot(c.v, c.n);
    let terms = law.terms(pair, c.delta, c.r_eff, m_eff, vn);
    let fn_repulsive = (terms.kn * c.delta - terms.gn * vn).max(opt.least_normal);
    let vt = add_scaled(c.v, -vn, c.n);
    // mu (F_net + A): F_net has had A subtracted, so that the sum is the normal force before adhesion.
    let push = fn_repulsive.max(0.0);

    let adhesion = if opt.adhesion {
        let mut grown = 1.0;
        // Where an offset is remembered instead, adhesion has grown whole.
        if slip[3] >= 0.0 {
            grown = (slip[3] + opt.adhesion_growth).min(1.0);
            slip[3] = grown;
        }
        let grown = grown * (c.delta * opt.adhesion_per_overlap).min(1.0);
        let a = &pair.adhesion;
        let full =
            a.constant + a.dmt * c.r_eff.sqrt() + a.perko * c.r_eff + PI * c.r_adhesion * c.r_adhesion * a.pressure;
        opt.adhesion_scale * grown * full
    } else {
        slip[3] = 1.0;
        0.0
    };

    let limit = pair.friction * push;
    let tangential = if L::CREEPS {
        let speed2 = dot(vt, vt);
        if speed2 > 0.0 {
            let speed = speed2.sqrt();
            // Not more than what stops half the slip within the step: see the law.
            let most = m_eff * speed / (7.0 * opt.h);
            scale(-(limit * (5.0 * speed).tanh()).min(most) / speed, vt)
        } else {
            [0.0; 3]
        }
    } else {
        friction(&terms, opt, c, vt, limit, slip)
    };
    let couple = match roll {
        Some(roll) if ROLL => resist_rolling(pair, opt, c, terms.kn, push, roll),
        _ => [0.0; 3],
    };
    Load { normal: fn_repulsive - adhesion, tangential, couple }
}

#[inline(always)]
fn friction(terms: &super::law::Terms, opt: &Options, c: &Touch, vt: Vec3, limit: f64, slip: &mut Slip) -> Vec3 {
    let (kt, gt) = (terms.kt, terms.gt);
    let (kept, u) = match opt.tangential {
        Tangential::History => {
            let old = [slip[0], slip[1], slip[2]];
            let turned = add_scaled(old, opt.h * c.spin, cross(c.n, old));
            let kept = reject(turned, c.n);
            (kept, add_scaled(kept, opt.h, vt))
        }
        Tangential::OneStep => ([0.0; 3], scale(opt.h, vt)),
        Tangential::None => ([0.0; 3], [0.0; 3]),
    };
    let trial = add_scaled(scale(kt, u), gt, vt);
    let trial2 = dot(trial, trial);
    if trial2 <= limit * limit {
        slip[..3].copy_from_slice(&u);
        return scale(-1.0, trial);
    }
    let d = scale(1.0 / trial2.sqrt(), trial);
    if opt.tangential == Tangential::History {
        let relaxed = scale(1.0 / (gt + kt * opt.h), add_scaled(scale(gt, kept), opt.h * limit, d));
        let stretch2 = kt * kt * dot(relaxed, relaxed);
        let cut = if stretch2 > limit * limit { limit / stretch2.sqrt() } else { 1.0 };
        slip[..3].copy_from_slice(&scale(cut, relaxed));
    }
    scale(-limit, d)
}

#[inline(always)]
fn resist_rolling(pair: &Pair, opt: &Options, c: &Touch, kn: f64, push: f64, rho: &mut Roll) -> Vec3 {
    let frame = add_scaled(c.tilt, c.spin, c.n);
    let now = add_scaled(add_scaled(*rho, opt.h, cross(frame, *rho)), opt.h, c.w_rel);
    let (rho_n, w_n) = (dot(now, c.n), dot(c.w_rel, c.n));
    let rho_t = add_scaled(now, -rho_n, c.n);
    let w_t = add_scaled(c.w_rel, -w_n, c.n);

    let arm = pair.rolling_friction * c.r_eff;
    let (rho_t, torque_t) = element(kn, arm, push, 1.4 / c.inv_mr2, opt.rolling_damping, rho_t, w_t);
    let arm = pair.spinning_friction * c.r_eff;
    let (rho_n, torque_n) =
        element(kn, arm, push, 0.4 / c.inv_mr2, opt.rolling_damping, scale(rho_n, c.n), scale(w_n, c.n));
    *rho = add(rho_t, rho_n);
    add(torque_t, torque_n)
}

/// Spring-dashpot-slider: the rotation kept and the torque on grain i.
#[inline(always)]
fn element(kn: f64, arm: f64, push: f64, inertia: f64, damping: f64, rho: Vec3, w: Vec3) -> (Vec3, Vec3) {
    if arm <= 0.0 || push <= 0.0 {
        return ([0.0; 3], [0.0; 3]);
    }
    let k = 2.25 * kn * arm * arm;
    let limit = arm * push;
    let spring2 = k * k * dot(rho, rho);
    let rho = if spring2 > limit * limit { scale(limit / spring2.sqrt(), rho) } else { rho };
    let torque = add_scaled(scale(-k, rho), -2.0 * damping * (k * inertia).sqrt(), w);
    let size2 = dot(torque, torque);
    let torque = if size2 > limit * limit { scale(limit / size2.sqrt(), torque) } else { torque };
    (rho, torque)
}
