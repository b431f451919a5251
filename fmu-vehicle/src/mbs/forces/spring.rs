//! Translational springs and their stops.

use crate::mbs::Table;

/// Tension of a spring as a function of its length.
#[derive(Clone, Debug, PartialEq, Default)]
pub enum SpringLaw {
    /// No spring.
    #[default]
    None,
    /// `rate (length - free_length) + preload`.
    Linear {
        /// Rate (N/m).
        rate: f64,
        /// Free length (m).
        free_length: f64,
        /// Tension at the free length (N).
        preload: f64,
    },
    /// `curve(length - free_length)`, the last segments continued.
    Curve {
        /// Free length (m).
        free_length: f64,
        /// Deformation (m, extension positive) to tension (N).
        curve: Table,
    },
}

impl SpringLaw {
    /// Tension (N), positive pulls.
    #[inline]
    pub fn tension(&self, length: f64) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Linear { rate, free_length, preload } => rate * (length - free_length) + preload,
            Self::Curve { free_length, curve } => curve.extrapolated(length - free_length),
        }
    }
}

/// Bump and rebound stops: a force curve of the penetration beyond a least and a greatest length.
#[derive(Clone, Debug, PartialEq)]
pub struct Stops {
    /// Below it the bump stop pushes (m).
    pub min_length: f64,
    /// Above it the rebound stop pulls (m).
    pub max_length: f64,
    /// Penetration (m) to force (N), the last segment continued.
    pub curve: Table,
}

impl Stops {
    /// Tension (N).
    #[inline]
    pub fn tension(&self, length: f64) -> f64 {
        if length < self.min_length {
            -self.curve.extrapolated(self.min_length - length)
        } else if length > self.max_length {
            self.curve.extrapolated(length - self.max_length)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tension_is_the_slope_of_the_energy_and_stops_push_inwards() {
        let curve = Table::new(&[[-0.2, -4000.0], [0.0, 0.0], [0.1, 500.0]]).unwrap();
        let s = SpringLaw::Curve { free_length: 0.3, curve };
        assert_eq!(s.tension(0.3), 0.0);
        assert!((s.tension(0.2) + 2000.0).abs() < 1e-9 && s.tension(0.35) > 0.0);
        let stops =
            Stops { min_length: 0.15, max_length: 0.3, curve: Table::new(&[[0.0, 0.0], [0.01, 1000.0]]).unwrap() };
        assert!((stops.tension(0.145) + 500.0).abs() < 1e-9);
        assert!((stops.tension(0.32) - 2000.0).abs() < 1e-9);
        assert_eq!(stops.tension(0.2), 0.0);
    }
}
