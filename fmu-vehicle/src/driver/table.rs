//! Driver inputs as a table over time.

use crate::vehicle::DriverInputs;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification::Faults;

/// Inputs at one time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TablePoint {
    /// Time since the start (s).
    pub time: f64,
    /// -1 full right to 1 full left.
    #[serde(default)]
    pub steering: f64,
    /// 0 to 1.
    #[serde(default)]
    pub throttle: f64,
    /// 0 to 1.
    #[serde(default)]
    pub braking: f64,
}

pub(super) fn check(points: &[TablePoint], path: &str, f: &mut Faults) {
    f.check(!points.is_empty(), path, "empty", "at least one point");
    let mut before = f64::NEG_INFINITY;
    for (k, p) in points.iter().enumerate() {
        let at = format!("{path}[{k}]");
        f.check(
            p.time.is_finite() && p.time > before,
            &format!("{at}.time"),
            p.time,
            "times that rise from point to point",
        );
        before = p.time;
        f.within(&format!("{at}.steering"), p.steering, -1.0, 1.0);
        f.within(&format!("{at}.throttle"), p.throttle, 0.0, 1.0);
        f.within(&format!("{at}.braking"), p.braking, 0.0, 1.0);
    }
}

pub(super) fn at(points: &[TablePoint], time: f64) -> DriverInputs {
    let of = |p: &TablePoint| DriverInputs { steering: p.steering, throttle: p.throttle, braking: p.braking };
    let k = points.partition_point(|p| p.time <= time);
    match (k.checked_sub(1).and_then(|i| points.get(i)), points.get(k)) {
        (Some(a), Some(b)) => {
            let s = (time - a.time) / (b.time - a.time);
            let mix = |x: f64, y: f64| x + s * (y - x);
            DriverInputs {
                steering: mix(a.steering, b.steering),
                throttle: mix(a.throttle, b.throttle),
                braking: mix(a.braking, b.braking),
            }
        }
        (Some(p), None) | (None, Some(p)) => of(p),
        (None, None) => DriverInputs::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_between_and_held_outside() {
        let p = |time, throttle| TablePoint { time, steering: 0.0, throttle, braking: 0.0 };
        let t = [p(1.0, 0.0), p(2.0, 1.0)];
        assert_eq!(at(&t, 0.0).throttle, 0.0);
        assert_eq!(at(&t, 1.5).throttle, 0.5);
        assert_eq!(at(&t, 7.0).throttle, 1.0);
        let mut f = Faults::new();
        check(&[p(1.0, 0.0), p(1.0, 2.0)], "points", &mut f);
        let e = f.into_result("driver").unwrap_err().to_string();
        assert!(e.contains("2 faults") && e.contains("points[1].time"), "{e}");
    }
}
