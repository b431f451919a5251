//! Hertz-Mindlin: the elastic solution for two spheres, with damping that gives a constant restitution.
//!
//! From properties (Tsuji, Tanaka, Ishida 1992; Mindlin, Deresiewicz 1953 without the memory of unloading):
//! S_n = 2 E* sqrt(R* delta), S_t = 8 G* sqrt(R* delta); k_n = 2/3 S_n, k_t = S_t;
//! g_n = 2 sqrt(5/6) beta sqrt(S_n m*), beta = -ln e / sqrt(ln^2 e + pi^2), g_t likewise with S_t.
//!
//! From coefficients: k_n = R* sqrt(delta) k (k: Pa/m^0.5), g_n = R* sqrt(delta) m* g; tangential likewise.

use super::{Form, Law, Terms};
use crate::dem::material::Pair;

/// See the module.
#[derive(Clone, Copy, Debug)]
pub struct HertzMindlin {
    /// Where the stiffness comes from.
    pub form: Form,
}

/// 2 sqrt(5/6)
pub(crate) const TWO_SQRT_5_6: f64 = 1.825_741_858_350_553_7;

impl Law for HertzMindlin {
    #[inline(always)]
    fn terms(&self, pair: &Pair, delta: f64, r_eff: f64, m_eff: f64, _vn: f64) -> Terms {
        match self.form {
            Form::Properties => {
                let contact_radius = (r_eff * delta).sqrt();
                let sn = 2.0 * pair.e_star * contact_radius;
                let st = 8.0 * pair.g_star * contact_radius;
                let damping = TWO_SQRT_5_6 * pair.damping_ratio;
                let gn = damping * (sn * m_eff).sqrt();
                // sqrt(S_t m*) = sqrt(S_n m*) sqrt(4 G*/E*), and the last factor is the pair's alone.
                Terms { kn: 2.0 / 3.0 * sn, gn, kt: st, gt: gn * pair.sqrt_st_over_sn }
            }
            Form::Coefficients => {
                let c = &pair.coefficients;
                let s = r_eff * delta.sqrt();
                Terms { kn: s * c.kn, gn: s * m_eff * c.gn, kt: s * c.kt, gt: s * m_eff * c.gt }
            }
        }
    }
}
