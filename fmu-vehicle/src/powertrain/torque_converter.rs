//! Hydrodynamic torque converter.

use crate::mbs::Table;
use crate::suspension::elements::{check_table, table};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;

/// Specification: two curves over the speed ratio R = output / input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConverterSpec {
    /// Points (R, capacity factor K): input torque = (input speed / K)^2, speeds in rad/s, torque in N m.
    pub capacity_factor: Vec<[f64; 2]>,
    /// Points (R, torque ratio): output torque / input torque.
    pub torque_ratio: Vec<[f64; 2]>,
}

impl ConverterSpec {
    /// Collects faults.
    pub fn check(&self, path: &str, f: &mut Faults) {
        check_table(&format!("{path}.capacity_factor"), &self.capacity_factor, f);
        check_table(&format!("{path}.torque_ratio"), &self.torque_ratio, f);
        for (k, p) in self.capacity_factor.iter().enumerate() {
            f.positive(&format!("{path}.capacity_factor[{k}][1]"), p[1]);
        }
    }
    /// The law.
    pub fn law(&self) -> TorqueConverter {
        TorqueConverter { capacity: table(&self.capacity_factor), ratio: table(&self.torque_ratio) }
    }
}

/// Torques of a converter as a function of its speeds relative to the stator.
#[derive(Clone, Debug)]
pub struct TorqueConverter {
    capacity: Table,
    ratio: Table,
}

impl TorqueConverter {
    /// Torques (N m) that act on the input and the output shaft at speeds `w_in`, `w_out` (rad/s); the stator takes minus their sum. R
    /// is held at 0 for an output that turns backwards; an output faster than the input (coasting) is taken by reflection at R = 1 with
    /// reversed torque and ratio 1; an input that turns backwards transmits nothing.
    pub fn torques(&self, w_in: f64, w_out: f64) -> (f64, f64) {
        if w_in < 1e-9 {
            return (0.0, 0.0);
        }
        let r = w_out / w_in;
        let coasting = r > 1.0;
        let s = if coasting { 2.0 - r } else { r }.max(0.0);
        let k = w_in / self.capacity.at(s);
        if coasting { (k * k, -k * k) } else { (-k * k, k * k * self.ratio.at(s)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stall_multiplies_torque_and_coasting_brakes() {
        let c = ConverterSpec {
            capacity_factor: vec![[0.0, 15.0], [0.9, 18.0], [1.0, 35.0]],
            torque_ratio: vec![[0.0, 2.0], [1.0, 1.0]],
        }
        .law();
        let (i, o) = c.torques(150.0, 0.0);
        assert_eq!((i, o), (-100.0, 200.0));
        let (i, o) = c.torques(150.0, 165.0);
        assert!(i > 0.0 && (o + i).abs() < 1e-12);
        assert_eq!(c.torques(-10.0, 5.0), (0.0, 0.0));
        assert_eq!(c.torques(150.0, -20.0), (-100.0, 200.0));
    }
}
