//! Limits of a driver's rates and a first-order filter.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;

/// How fast inputs may change; 0 means without limit or filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Greatest rate of steering (1/s, full side to straight is 1).
    pub steering_rate: f64,
    /// Greatest rate of throttle (1/s).
    pub throttle_rate: f64,
    /// Greatest rate of braking (1/s).
    pub braking_rate: f64,
    /// Time constant of the filter on all three (s).
    pub time_constant: f64,
}

impl Limits {
    /// Collects faults.
    pub fn check(&self, path: &str, f: &mut Faults) {
        for (name, x) in [
            ("steering_rate", self.steering_rate),
            ("throttle_rate", self.throttle_rate),
            ("braking_rate", self.braking_rate),
            ("time_constant", self.time_constant),
        ] {
            f.not_negative(&format!("{path}.{name}"), x);
        }
    }
    /// Moves `out` towards `wanted` over `h` s.
    pub fn apply(&self, wanted: [f64; 3], h: f64, out: &mut [f64; 3]) {
        let share = if self.time_constant > 0.0 { 1.0 - (-h / self.time_constant).exp() } else { 1.0 };
        let rates = [self.steering_rate, self.throttle_rate, self.braking_rate];
        for k in 0..3 {
            let mut change = share * (wanted[k] - out[k]);
            if rates[k] > 0.0 {
                change = change.clamp(-rates[k] * h, rates[k] * h);
            }
            out[k] += change;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_and_filter() {
        let mut out = [0.0; 3];
        Limits { steering_rate: 2.0, ..Limits::default() }.apply([1.0, 1.0, 0.0], 0.1, &mut out);
        assert_eq!(out, [0.2, 1.0, 0.0]);
        let mut out = [0.0; 3];
        let l = Limits { time_constant: 0.1, ..Limits::default() };
        (0..100).for_each(|_| l.apply([1.0, 0.0, 0.0], 0.001, &mut out));
        assert!((out[0] - (1.0 - (-1.0_f64).exp())).abs() < 1e-12);
    }
}
