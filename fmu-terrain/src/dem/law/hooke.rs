//! Hooke: a linear spring and dashpot.
//!
//! From properties: k = 16/15 sqrt(R*) E*, k_n = k_t = k (m* v_c^2 / k)^(1/5) with v_c = max(|v_n|, 1 m/s), the linear
//! stiffness that stores the energy of a Hertz impact at v_c; g_n = g_t = sqrt(4 m* k_n / (1 + (pi/ln e)^2)).
//!
//! From coefficients: k_n = k, k_t = k (N/m); g_n = m* g (g: 1/s), g_t likewise.

use super::{Form, Law, Terms};
use crate::dem::material::Pair;

/// See the module.
#[derive(Clone, Copy, Debug)]
pub struct Hooke {
    /// Where the stiffness comes from.
    pub form: Form,
}

impl Law for Hooke {
    #[inline(always)]
    fn terms(&self, pair: &Pair, _delta: f64, r_eff: f64, m_eff: f64, vn: f64) -> Terms {
        match self.form {
            Form::Properties => {
                let vc = vn.abs().max(1.0);
                let k = 16.0 / 15.0 * r_eff.sqrt() * pair.e_star;
                let kn = k * (m_eff * vc * vc / k).powf(0.2);
                let gn = (4.0 * m_eff * kn / (1.0 + pair.pi_over_ln_e_squared)).sqrt();
                Terms { kn, gn, kt: kn, gt: gn }
            }
            Form::Coefficients => {
                let c = &pair.coefficients;
                Terms { kn: c.kn, gn: m_eff * c.gn, kt: c.kt, gt: m_eff * c.gt }
            }
        }
    }
}
