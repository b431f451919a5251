//! Flores et al. (2011): Hertz with a dissipation that grows with the overlap, so that damping starts and ends at zero.
//!
//! From properties: S_n, S_t as Hertz-Mindlin; k_n = 2/3 S_n, k_t = 2/3 S_t; g_n = 8 (1-e) k_n delta / (5 e v_c),
//! v_c = max(|v_n|, 1 m/s) as for Hooke: a contact at rest would divide by zero. Needs e > 0. g_t = g_n k_t/k_n.
//!
//! From coefficients: stiffness as Hertz-Mindlin, g_n = R* sqrt(delta) m* g delta; tangential likewise.

use super::{Form, Law, Terms};
use crate::dem::material::Pair;

/// See the module.
#[derive(Clone, Copy, Debug)]
pub struct Flores {
    /// Where the stiffness comes from.
    pub form: Form,
}

impl Law for Flores {
    #[inline(always)]
    fn terms(&self, pair: &Pair, delta: f64, r_eff: f64, m_eff: f64, vn: f64) -> Terms {
        match self.form {
            Form::Properties => {
                let contact_radius = (r_eff * delta).sqrt();
                let kn = 2.0 / 3.0 * 2.0 * pair.e_star * contact_radius;
                let kt = 2.0 / 3.0 * 8.0 * pair.g_star * contact_radius;
                let e = pair.restitution;
                let per_stiffness = 8.0 * (1.0 - e) * delta / (5.0 * e * vn.abs().max(1.0));
                Terms { kn, gn: kn * per_stiffness, kt, gt: kt * per_stiffness }
            }
            Form::Coefficients => {
                let c = &pair.coefficients;
                let s = r_eff * delta.sqrt();
                let damping = s * m_eff * delta;
                Terms { kn: s * c.kn, gn: damping * c.gn, kt: s * c.kt, gt: damping * c.gt }
            }
        }
    }
}
