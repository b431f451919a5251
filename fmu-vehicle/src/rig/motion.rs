//! Motions along and about: slip, ramps.

use super::config::{Base, Drive};

/// Slip (omega R - v)/max(|omega R|, |v|) (1) of the rim speed `rim` = omega R and the carriage speed `v` (m/s); 0 at rest.
pub fn slip(rim: f64, v: f64) -> f64 {
    let greater = rim.abs().max(v.abs());
    // Below any speed that an experiment imposes, and above what round-off leaves of a stop.
    if greater < 1e-9 { 0.0 } else { (rim - v) / greater }
}

/// Carriage speed (m/s) and angular speed (rad/s) after the ramp of the mode `imposed_slip`, for the undeformed radius (m).
pub fn imposed_speeds(drive: &Drive, radius: f64) -> (f64, f64) {
    let s = drive.slip;
    match drive.base {
        Base::LinearSpeed if s >= 0.0 => (drive.speed, drive.speed / (1.0 - s) / radius),
        Base::LinearSpeed => (drive.speed, drive.speed * (1.0 + s) / radius),
        Base::AngularSpeed if s >= 0.0 => (drive.angular_speed * radius * (1.0 - s), drive.angular_speed),
        Base::AngularSpeed => (drive.angular_speed * radius / (1.0 + s), drive.angular_speed),
    }
}

/// A ramp from 0 to 1, smooth at both ends: 3x^2 - 2x^3 of x = (t - delay)/duration. A kink would be a jump of the
/// inertia forces that the outputs show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// Time before it (s).
    pub delay: f64,
    /// Its duration (s); 0 means 1 always.
    pub duration: f64,
}

impl Ramp {
    fn place(&self, t: f64) -> f64 {
        if self.duration == 0.0 { 1.0 } else { ((t - self.delay) / self.duration).clamp(0.0, 1.0) }
    }
    /// Value at `t`.
    pub fn value(&self, t: f64) -> f64 {
        let x = self.place(t);
        x * x * (3.0 - 2.0 * x)
    }
    /// Its derivative (1/s).
    pub fn rate(&self, t: f64) -> f64 {
        let x = self.place(t);
        if self.duration == 0.0 { 0.0 } else { 6.0 * x * (1.0 - x) / self.duration }
    }
    /// Its integral from 0 to `t` (s).
    pub fn integral(&self, t: f64) -> f64 {
        if self.duration == 0.0 {
            return t;
        }
        let x = self.place(t);
        self.duration * x * x * x * (1.0 - 0.5 * x) + (t - self.delay - self.duration).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn imposed_speeds_have_the_slip_asked_for() {
        for base in [Base::LinearSpeed, Base::AngularSpeed] {
            for s in [-1.0, -0.9, -0.5, -0.2, 0.0, 0.231, 0.5, 0.9, 1.0] {
                let impossible = if base == Base::LinearSpeed { 1.0 } else { -1.0 };
                if s == impossible {
                    continue;
                }
                let drive = Drive { base, slip: s, speed: 0.3, angular_speed: 4.0, ..Drive::default() };
                let (v, omega) = imposed_speeds(&drive, 0.058);
                assert!(v.is_finite() && omega.is_finite());
                assert!((slip(omega * 0.058, v) - s).abs() < 1e-14, "{base:?} {s}: {v} {omega}");
            }
        }
        assert_eq!(slip(0.0, 0.0), 0.0);
    }

    #[test]
    fn the_ramp_is_its_integral_s_derivative() {
        let ramp = Ramp { delay: 0.2, duration: 0.5 };
        let h = 1e-5;
        for t in [0.0, 0.1, 0.25, 0.4, 0.6, 0.69, 0.8, 3.0] {
            let slope = (ramp.integral(t + h) - ramp.integral(t - h)) / (2.0 * h);
            assert!((slope - ramp.value(t)).abs() < 1e-8, "{t}");
            let slope = (ramp.value(t + h) - ramp.value(t - h)) / (2.0 * h);
            assert!((slope - ramp.rate(t)).abs() < 1e-7, "{t}");
        }
        let none = Ramp { delay: 0.0, duration: 0.0 };
        assert_eq!((none.value(0.3), none.rate(0.3), none.integral(0.3)), (1.0, 0.0, 0.3));
    }
}
