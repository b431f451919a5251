//! Plain Coulomb: the model of the source paper's driver.
//!
//! From properties: S_n = 2 E* sqrt(delta), k_n = 2/3 S_n, damping as Hertz-Mindlin with it. From coefficients:
//! k_n = sqrt(delta) k, g_n = sqrt(delta) g. Friction is mu tanh(5 v_t) F_n [v_t in m/s]: it has no static part, so
//! that a heap creeps; rest cases do not hold with it.

use super::hertz_mindlin::TWO_SQRT_5_6;
use super::{Form, Law, Terms};
use crate::dem::material::Pair;

/// See the module.
#[derive(Clone, Copy, Debug)]
pub struct PlainCoulomb {
    /// Where the stiffness comes from.
    pub form: Form,
}

impl Law for PlainCoulomb {
    const CREEPS: bool = true;

    #[inline(always)]
    fn terms(&self, pair: &Pair, delta: f64, _r_eff: f64, m_eff: f64, _vn: f64) -> Terms {
        match self.form {
            Form::Properties => {
                let sn = 2.0 * pair.e_star * delta.sqrt();
                let gn = TWO_SQRT_5_6 * pair.damping_ratio * (sn * m_eff).sqrt();
                Terms { kn: 2.0 / 3.0 * sn, gn, kt: 0.0, gt: 0.0 }
            }
            Form::Coefficients => {
                let c = &pair.coefficients;
                Terms { kn: delta.sqrt() * c.kn, gn: delta.sqrt() * c.gn, kt: 0.0, gt: 0.0 }
            }
        }
    }
}
