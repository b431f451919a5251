//! Plain Coulomb: the model of the source paper's driver.
//!
//! From properties: S_n = 2 E* sqrt(delta), k_n = 2/3 S_n, damping as Hertz-Mindlin with it. From coefficients:
//! k_n = sqrt(delta) k, g_n = sqrt(delta) g. Friction is mu tanh(5 v_t) F_n [v_t in m/s]: it has no static part, so
//! that a heap creeps; rest cases do not hold with it.
//!
//! At rest this is a dashpot of 5 mu F_n, which an explicit step does not survive once it exceeds the mass that it stops over the
//! step: at 4e-5 s and 14 N for grains of r 12 mm, where 100 kPa of cohesion alone press with 45 N. So its force is cut to what stops
//! half the slip of the pair within the step, m*/7 |v_t|/h (a sphere slips against 2/7 of m*; half, since a grain has several
//! contacts). Below that the law is as published; a contact pressed by more slips against less than the law says, and creeps at 7 h F/m*
//! under a load F: take a smaller step (1e-5 s at 45 N) where that matters. Without the cut, a bed under 100 kPa chatters at 0.3 m/s.

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
