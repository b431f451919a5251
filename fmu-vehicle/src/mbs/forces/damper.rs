//! Shock absorbers.

use crate::mbs::Table;

/// Tension of a damper as a function of its length and the rate of its length (extension positive).
#[derive(Clone, Debug, PartialEq, Default)]
pub enum DamperLaw {
    /// No damper.
    #[default]
    None,
    /// `coefficient * rate`.
    Linear {
        /// Coefficient (N s/m).
        coefficient: f64,
    },
    /// Tension against rate.
    Curve(Table),
    /// Four coefficients: compression and rebound, at midstroke and near the ends.
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
        /// Metal-to-metal contact: range of length (m) and stiffness (N/m) outside it, in place of damping.
        metal: Option<([f64; 2], f64)>,
    },
}

impl DamperLaw {
    /// Whether it acts as a spring at this length: metal on metal.
    #[inline]
    pub fn is_metal(&self, length: f64) -> bool {
        matches!(self, Self::Stroke { metal: Some((range, _)), .. } if length < range[0] || length > range[1])
    }

    /// Tension (N) at a length (m) and rate (m/s).
    #[inline]
    pub fn tension(&self, length: f64, rate: f64) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Linear { coefficient } => coefficient * rate,
            Self::Curve(t) => t.at(rate),
            Self::Stroke {
                midstroke_compression,
                midstroke_rebound,
                bump_compression,
                bump_rebound,
                midstroke,
                metal,
            } => {
                if let Some((range, rate)) = metal {
                    if length < range[0] {
                        return rate * (length - range[0]);
                    }
                    if length > range[1] {
                        return rate * (length - range[1]);
                    }
                }
                let c = if rate >= 0.0 {
                    if length >= midstroke[1] { bump_rebound } else { midstroke_rebound }
                } else if length <= midstroke[0] {
                    bump_compression
                } else {
                    midstroke_compression
                };
                c * rate
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn never_makes_energy() {
        let d = DamperLaw::Stroke {
            midstroke_compression: 1.0,
            midstroke_rebound: 2.0,
            bump_compression: 0.5,
            bump_rebound: 6.0,
            midstroke: [0.3, 0.4],
            metal: Some(([0.25, 0.45], 100.0)),
        };
        for length in [0.26, 0.35, 0.42] {
            for rate in [-2.0, -0.1, 0.0, 0.1, 2.0] {
                assert!(d.tension(length, rate) * rate >= 0.0);
            }
        }
        assert_eq!((d.tension(0.35, 1.0), d.tension(0.42, 1.0), d.tension(0.26, -1.0)), (2.0, 6.0, -0.5));
        assert!((d.tension(0.46, 0.0) - 1.0).abs() < 1e-12);
    }
}
