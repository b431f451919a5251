//! Transient slip: carcass deflections that lag behind the slip by the relaxation lengths.

use crate::{Contact, Tire};
use serde::{Deserialize, Serialize};

/// Transient slips. `sigma d(kappa)/dt + |v_x| kappa = slip velocity`, likewise across.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Transient {
    /// Longitudinal slip.
    pub kappa: f64,
    /// Tangent of the slip angle.
    pub tan_alpha: f64,
}

/// Bound of both slips at speed.
const BOUND: f64 = 1.5;
/// Below this speed (m/s) the carcass is damped.
const LOW: f64 = 2.5;
/// Damping time at standstill (s): deflection rate times it adds to the deflection.
const DAMPING: f64 = 0.04;

impl Transient {
    /// The slips after `h` s in the contact (implicit Euler: stable for any speed); without contact the carcass is relaxed.
    #[must_use]
    pub fn advanced(&self, tire: &Tire, contact: Option<&Contact>, h: f64) -> Self {
        let Some(c) = contact else { return Self::default() };
        let load = tire.load(c);
        if load <= 0.0 {
            return Self::default();
        }
        let [sx, sy] = tire.relaxation(load, c.camber).map(|s| s.max(0.02));
        let v = c.vx.abs();
        // A locked wheel slides at kappa = -1, which is a deflection of a whole relaxation length. When it comes to rest that must
        // not push the vehicle back: towards standstill the carcass keeps only what friction can hold.
        let fade = fade(v);
        let bound = tire.saturation(load, c.friction).map(|s| BOUND + fade * (s - BOUND).min(0.0));
        let step =
            |s: f64, sigma: f64, slip: f64, most: f64| ((sigma * s + h * slip) / (sigma + h * v)).clamp(-most, most);
        Self { kappa: step(self.kappa, sx, c.slip_x(), bound[0]), tan_alpha: step(self.tan_alpha, sy, c.vy, bound[1]) }
    }

    /// (kappa, tan alpha) that the forces see: with damping at low speed.
    pub(crate) fn damped(&self, c: &Contact, relaxation: [f64; 2]) -> (f64, f64) {
        let v = c.vx.abs();
        let fade = fade(v);
        let [sx, sy] = relaxation.map(|s| s.max(0.02));
        let add = |s: f64, slip: f64, sigma: f64| {
            // d(s)/dt = (slip - v s)/sigma.
            (s + fade * DAMPING * (slip - v * s) / sigma).clamp(-BOUND, BOUND)
        };
        (add(self.kappa, c.slip_x(), sx), add(self.tan_alpha, c.vy, sy))
    }
}

/// 1 at standstill, 0 from the speed LOW on.
fn fade(v: f64) -> f64 {
    if v < LOW { 0.5 * (1.0 + (std::f64::consts::PI * v / LOW).cos()) } else { 0.0 }
}
