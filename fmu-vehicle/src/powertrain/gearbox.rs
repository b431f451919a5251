//! Shift logic of automatic gearboxes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Position of the selector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Forward gears, shifted automatically.
    #[default]
    Drive,
    /// No torque passes.
    Neutral,
    /// The reverse gear.
    Reverse,
}

/// The gear and how long it has been in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GearState {
    /// -1 reverse, 0 neutral, 1.. forward.
    pub gear: i32,
    /// Time since the last shift (s).
    pub since: f64,
}

impl GearState {
    /// The gear a selector position starts in.
    pub fn start(mode: Mode) -> Self {
        let gear = match mode {
            Mode::Drive => 1,
            Mode::Neutral => 0,
            Mode::Reverse => -1,
        };
        // Long ago: the first shift need not wait for the latency.
        Self { gear, since: 1e9 }
    }
    /// The lowest forward gear whose input turns below `up` at the output speed given (one unit for both).
    pub fn select(&mut self, output: f64, forward: &[f64], up: impl Fn(usize) -> f64) {
        if self.gear >= 1 {
            let fits = forward.iter().enumerate().position(|(k, r)| output / r < up(k));
            self.gear = fits.unwrap_or(forward.len() - 1) as i32 + 1;
        }
    }
    /// Up above `up`, down below `down` (any speed unit), not before `latency` (s) after the last shift; whether it shifted.
    pub fn decide(&mut self, h: f64, speed: f64, up: f64, down: f64, latency: f64, gears: usize) -> bool {
        self.since += h;
        if self.gear < 1 || self.since < latency {
            return false;
        }
        let before = self.gear;
        if speed > up && (self.gear as usize) < gears {
            self.gear += 1;
        } else if speed < down && self.gear > 1 {
            self.gear -= 1;
        }
        let shifted = before != self.gear;
        if shifted {
            self.since = 0.0;
        }
        shifted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shifts_wait_for_the_latency() {
        let mut g = GearState::start(Mode::Drive);
        assert!(g.decide(0.1, 300.0, 250.0, 100.0, 1.0, 3));
        assert!(!g.decide(0.5, 300.0, 250.0, 100.0, 1.0, 3));
        assert!(g.decide(0.6, 300.0, 250.0, 100.0, 1.0, 3));
        assert!(!g.decide(2.0, 300.0, 250.0, 100.0, 1.0, 3), "there is no fourth gear");
        assert_eq!(g.gear, 3);
        assert!(g.decide(2.0, 50.0, 250.0, 100.0, 1.0, 3));
        assert!(!GearState::start(Mode::Reverse).decide(1.0, 300.0, 250.0, 100.0, 1.0, 3));
    }
}
