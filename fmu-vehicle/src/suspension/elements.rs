//! Building stones that templates share: masses, springs, shocks.

use crate::mbs::{BodyId, DamperLaw, Model, SpringLaw, Stops, Table};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;
use terramech_mechanics::{Mat3, Quat, Vec3};

/// Mass and principal inertias of a part about its centre of mass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MassSpec {
    /// Mass (kg), above 0.
    pub mass: f64,
    /// Inertia (kg m2) about the part's axes, above 0.
    pub inertia: [f64; 3],
}

impl MassSpec {
    /// Collects faults.
    pub fn check(&self, path: &str, f: &mut Faults) {
        f.positive(&format!("{path}.mass"), self.mass);
        for (k, x) in self.inertia.iter().enumerate() {
            f.positive(&format!("{path}.inertia[{k}]"), *x);
        }
        let most = self.inertia.iter().fold(0.0_f64, |m, x| m.max(*x));
        let sum: f64 = self.inertia.iter().sum();
        // Published data miss the triangle inequality by up to 12 %; see `mbs::Body::check`.
        f.check(
            most <= 1.25 * (sum - most),
            &format!("{path}.inertia"),
            format!("{:?}", self.inertia),
            "no moment larger than 1.25 times the sum of the other two (1 for exact data)",
        );
    }
    /// The inertia as a matrix.
    pub fn matrix(&self) -> Mat3 {
        Mat3::from_diagonal(&self.inertia.into())
    }
    /// Adds the part to a model.
    pub fn add(&self, m: &mut Model, name: &str, p: Vec3, q: Quat) -> BodyId {
        m.body(name, self.mass, self.matrix(), p, q)
    }
}

/// A spring. Tension is positive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum SpringSpec {
    /// `rate (length - free_length) + preload`.
    Linear {
        /// Rate (N/m), above 0.
        rate: f64,
        /// Free length (m), above 0.
        free_length: f64,
        /// Tension at the free length (N).
        #[serde(default)]
        preload: f64,
    },
    /// Tension by a curve of the deformation `length - free_length`.
    Curve {
        /// Free length (m), above 0.
        free_length: f64,
        /// Points (deformation m, tension N), deformation rising; the last segments continue.
        points: Vec<[f64; 2]>,
    },
}

/// Bump and rebound stops.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StopsSpec {
    /// Below this length the bump stop acts (m).
    pub min_length: f64,
    /// Above this length the rebound stop acts (m).
    pub max_length: f64,
    /// Points (penetration m, force N), penetration rising from 0.
    pub points: Vec<[f64; 2]>,
}

/// A shock absorber. Rates and tensions are positive in extension.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ShockSpec {
    /// `coefficient * rate`.
    Linear {
        /// Coefficient (N s/m), at least 0.
        coefficient: f64,
    },
    /// Tension by a curve of the rate.
    Curve {
        /// Points (rate m/s, tension N), rate rising.
        points: Vec<[f64; 2]>,
    },
    /// Four coefficients (N s/m): compression and rebound, at midstroke and beyond it.
    Stroke {
        /// Compression at midstroke (N s/m).
        midstroke_compression: f64,
        /// Rebound at midstroke (N s/m).
        midstroke_rebound: f64,
        /// Compression below midstroke (N s/m).
        bump_compression: f64,
        /// Rebound above midstroke (N s/m).
        bump_rebound: f64,
        /// Midstroke range of length (m).
        midstroke: [f64; 2],
        /// Range of length (m) outside which metal touches metal.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        metal_range: Option<[f64; 2]>,
        /// Stiffness of that contact (N/m), in place of damping.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        metal_rate: Option<f64>,
    },
}

/// Collects faults of a table of points.
pub fn check_table(path: &str, points: &[[f64; 2]], f: &mut Faults) {
    if let Err(e) = Table::new(points) {
        f.add(format!("'{path}' has {e}"));
    }
}

/// A table that was checked; a constant zero if it was not, so that building never panics.
pub(crate) fn table(points: &[[f64; 2]]) -> Table {
    Table::new(points).unwrap_or_else(|_| Table::new(&[[0.0, 0.0], [1.0, 0.0]]).expect("two rising points"))
}

impl SpringSpec {
    /// Collects faults.
    pub fn check(&self, path: &str, f: &mut Faults) {
        match self {
            Self::Linear { rate, free_length, preload } => {
                f.positive(&format!("{path}.linear.rate"), *rate);
                f.positive(&format!("{path}.linear.free_length"), *free_length);
                f.check(preload.is_finite(), &format!("{path}.linear.preload"), preload, "a finite number");
            }
            Self::Curve { free_length, points } => {
                f.positive(&format!("{path}.curve.free_length"), *free_length);
                check_table(&format!("{path}.curve.points"), points, f);
            }
        }
    }
    /// The law.
    pub fn law(&self) -> SpringLaw {
        match self {
            Self::Linear { rate, free_length, preload } => {
                SpringLaw::Linear { rate: *rate, free_length: *free_length, preload: *preload }
            }
            Self::Curve { free_length, points } => SpringLaw::Curve { free_length: *free_length, curve: table(points) },
        }
    }
}

impl StopsSpec {
    /// Collects faults.
    pub fn check(&self, path: &str, f: &mut Faults) {
        f.positive(&format!("{path}.min_length"), self.min_length);
        f.check(
            self.max_length > self.min_length,
            &format!("{path}.max_length"),
            self.max_length,
            "more than min_length",
        );
        check_table(&format!("{path}.points"), &self.points, f);
    }
    /// The law.
    pub fn law(&self) -> Stops {
        Stops { min_length: self.min_length, max_length: self.max_length, curve: table(&self.points) }
    }
}

impl ShockSpec {
    /// Collects faults.
    pub fn check(&self, path: &str, f: &mut Faults) {
        match self {
            Self::Linear { coefficient } => f.not_negative(&format!("{path}.linear.coefficient"), *coefficient),
            Self::Curve { points } => check_table(&format!("{path}.curve.points"), points, f),
            Self::Stroke {
                midstroke_compression,
                midstroke_rebound,
                bump_compression,
                bump_rebound,
                midstroke,
                metal_range,
                metal_rate,
            } => {
                for (name, x) in [
                    ("midstroke_compression", midstroke_compression),
                    ("midstroke_rebound", midstroke_rebound),
                    ("bump_compression", bump_compression),
                    ("bump_rebound", bump_rebound),
                ] {
                    f.not_negative(&format!("{path}.stroke.{name}"), *x);
                }
                f.check(
                    midstroke[1] > midstroke[0],
                    &format!("{path}.stroke.midstroke"),
                    format!("{midstroke:?}"),
                    "two rising lengths",
                );
                f.check(
                    metal_range.is_some() == metal_rate.is_some(),
                    &format!("{path}.stroke.metal_rate"),
                    format!("{metal_rate:?}"),
                    "given together with metal_range",
                );
            }
        }
    }
    /// The law.
    pub fn law(&self) -> DamperLaw {
        match self {
            Self::Linear { coefficient } => DamperLaw::Linear { coefficient: *coefficient },
            Self::Curve { points } => DamperLaw::Curve(table(points)),
            Self::Stroke {
                midstroke_compression,
                midstroke_rebound,
                bump_compression,
                bump_rebound,
                midstroke,
                metal_range,
                metal_rate,
            } => DamperLaw::Stroke {
                midstroke_compression: *midstroke_compression,
                midstroke_rebound: *midstroke_rebound,
                bump_compression: *bump_compression,
                bump_rebound: *bump_rebound,
                midstroke: *midstroke,
                metal: metal_range.zip(*metal_rate),
            },
        }
    }
}
