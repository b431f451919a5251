//! Specification of the rig.
//!
//! Each real number here that a study varies is also an FMI parameter of the same path (`drive.slip`), which overrides it;
//! see [`super::variables`].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::UnitError;
use terramech_fmi2::specification::Faults;

/// Single-wheel rig: a carriage on rails along X carries a vertical slide with one driven wheel. SI units, angles in rad.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RigSpecification {
    /// How wheel and carriage move.
    pub drive: Drive,
    /// The wheel's heading, turned about Z against the direction of travel: the slip angle.
    pub toe: Toe,
    /// What presses the wheel down.
    pub load: Load,
    /// The vertical slide and the touchdown.
    pub slide: Slide,
    /// The carriage.
    pub carriage: Carriage,
    /// Moment of inertia about the axle of what turns with the wheel besides the tire's hub inertia (kg m2).
    pub spin_inertia: f64,
    /// Window of the running averages of the filtered outputs (s); 0 for none.
    pub filter_window: f64,
    /// Longest inner step, 1e-7 to 0.1 (s); a communication step is cut into equal ones.
    pub inner_step: f64,
}

impl Default for RigSpecification {
    fn default() -> Self {
        Self {
            drive: Drive::default(),
            toe: Toe::default(),
            load: Load::default(),
            slide: Slide::default(),
            carriage: Carriage::default(),
            spin_inertia: 0.0,
            filter_window: 0.1,
            inner_step: 1e-4,
        }
    }
}

/// How wheel and carriage move. Touchdown comes first, then `delay`, then a smooth ramp (3x^2 - 2x^3) of all speeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Drive {
    /// What is imposed.
    pub mode: Mode,
    /// Of the mode `imposed_slip`: which speed is given; the other follows from the slip.
    pub base: Base,
    /// Slip (omega R - v)/max(|omega R|, |v|), v the carriage's speed: -1 (locked wheel, from linear speed) to 1 (spinning
    /// on the spot, from angular speed) (1).
    pub slip: f64,
    /// Carriage speed after the ramp, for `imposed_slip` from `linear_speed` (m/s).
    pub speed: f64,
    /// Angular speed of the wheel after the ramp, for `imposed_slip` from `angular_speed` and for `imposed_angular_speed` (rad/s).
    pub angular_speed: f64,
    /// Whether the wheel touches down at rest, or already at full speed (then without `ramp`): numbers settle sooner.
    pub start: StartOf,
    /// Time at rest between touchdown and ramp (s).
    pub delay: f64,
    /// Duration of the ramp (s).
    pub ramp: f64,
    /// The growing resistance of the mode `imposed_angular_speed`.
    pub resistance: Resistance,
}

impl Default for Drive {
    fn default() -> Self {
        Self {
            mode: Mode::ImposedSlip,
            base: Base::LinearSpeed,
            slip: 0.2,
            speed: 0.1,
            angular_speed: 2.0,
            start: StartOf::AtRest,
            delay: 0.2,
            ramp: 0.5,
            resistance: Resistance::default(),
        }
    }
}

/// What is imposed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Carriage and wheel speed, such that the slip is the one asked for.
    ImposedSlip,
    /// The wheel's angular speed; the carriage is free and pulls against a resistance that grows until it stops: a whole
    /// pull-slip curve in one run.
    ImposedAngularSpeed,
}

/// Which speed is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Base {
    /// The carriage's.
    LinearSpeed,
    /// The wheel's.
    AngularSpeed,
}

/// Motion at touchdown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StartOf {
    /// Lowered at rest, then delay and ramp.
    AtRest,
    /// Lowered at full speed.
    Rolling,
}

/// A resistance at the carriage against its travel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Resistance {
    /// Time from the end of the ramp until it begins to grow (s).
    pub delay: f64,
    /// Growth (N/s).
    pub rate: f64,
    /// What happens when the carriage has stopped.
    pub at_stop: AtStop,
}

impl Default for Resistance {
    fn default() -> Self {
        Self { delay: 0.0, rate: 5.0, at_stop: AtStop::End }
    }
}

/// What happens when the carriage has stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AtStop {
    /// The unit ends the run.
    End,
    /// The carriage stays, the wheel turns on.
    Hold,
}

/// The slip angle. With `delay` and `ramp` both 0 the heading is turned from the start, before the wheel touches down.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Toe {
    /// Angle of the heading against X, positive to the left (about +Z), -pi/2 to pi/2 (rad).
    pub angle: f64,
    /// Time from the end of the touchdown until the heading turns (s).
    pub delay: f64,
    /// Duration of the smooth turn (s).
    pub ramp: f64,
}

/// What presses the wheel down.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Load {
    /// Mass that slides vertically with the wheel, without the tire's hub mass, which is added (kg).
    pub mass: f64,
    /// Static vertical load on the soil (N): **everything included**, the weights of `mass` and of the tire's hub mass too
    /// (only what a flexible tire does not hand over to the hub weighs on top). 0: their weight and nothing else.
    pub force: f64,
}

impl Default for Load {
    fn default() -> Self {
        Self { mass: 2.5, force: 0.0 }
    }
}

/// The vertical slide. Touchdown: the slide gives way under the load, never faster than `lowering_speed`, against a damper
/// that fades out over `release` once the soil carries the load: no drop, no bounce.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Slide {
    /// Gap between the settled soil and the wheel's lowest point at the start (m).
    pub gap: f64,
    /// Greatest vertical speed during touchdown (m/s).
    pub lowering_speed: f64,
    /// Time over which the touchdown's damper fades out (s).
    pub release: f64,
    /// Damping of the slide after touchdown, per mass that slides (1/s). It carries part of the load only while the wheel
    /// sinks or rises: at 10 1/s and 5 mm/s half a percent of the weight. It outweighs the negative damping K H/m that a
    /// contact stiffness K (N/m) has at a communication step H (s); 0 leaves that to the soil.
    pub damping_rate: f64,
    /// Sinkage at which the slide meets its end stop (m); 0: one and a half undeformed radii.
    pub greatest_sinkage: f64,
}

impl Default for Slide {
    fn default() -> Self {
        Self { gap: 0.005, lowering_speed: 0.05, release: 0.1, damping_rate: 10.0, greatest_sinkage: 0.0 }
    }
}

/// The carriage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Carriage {
    /// Where the wheel centre starts along the rails (m).
    pub x: f64,
    /// Where the rails are (m).
    pub y: f64,
    /// Mass of the carriage without slide and wheel, for the mode `imposed_angular_speed` (kg).
    pub mass: f64,
}

impl Default for Carriage {
    fn default() -> Self {
        Self { x: 0.0, y: 0.0, mass: 10.0 }
    }
}

impl RigSpecification {
    /// Checks every value.
    ///
    /// # Errors
    /// All faults at once, with their JSON paths; `origin` names the specification.
    pub fn check(&self, origin: &str) -> Result<(), UnitError> {
        let mut f = Faults::new();
        let d = &self.drive;
        if d.mode == Mode::ImposedSlip {
            let s = d.slip;
            match d.base {
                Base::LinearSpeed => {
                    f.check((-1.0..1.0).contains(&s), "drive.slip", s, "from linear speed at least -1 and below 1");
                    f.positive("drive.speed", d.speed);
                }
                Base::AngularSpeed => {
                    f.check(s > -1.0 && s <= 1.0, "drive.slip", s, "from angular speed above -1 and at most 1");
                    f.positive("drive.angular_speed", d.angular_speed);
                }
            }
        } else {
            f.positive("drive.angular_speed", d.angular_speed);
            f.positive("drive.resistance.rate", d.resistance.rate);
            f.positive("carriage.mass", self.carriage.mass);
        }
        f.not_negative("drive.delay", d.delay);
        f.positive("drive.ramp", d.ramp);
        f.not_negative("drive.resistance.delay", d.resistance.delay);
        let right = std::f64::consts::FRAC_PI_2;
        f.within("toe.angle", self.toe.angle, -right, right);
        f.not_negative("toe.delay", self.toe.delay);
        f.not_negative("toe.ramp", self.toe.ramp);
        let jump = self.toe.delay > 0.0 && self.toe.ramp == 0.0;
        f.check(!jump, "toe.ramp", self.toe.ramp, "greater than 0 when 'toe.delay' is (a heading does not jump)");
        f.positive("load.mass", self.load.mass);
        f.not_negative("load.force", self.load.force);
        f.not_negative("slide.gap", self.slide.gap);
        f.positive("slide.lowering_speed", self.slide.lowering_speed);
        f.positive("slide.release", self.slide.release);
        f.not_negative("slide.damping_rate", self.slide.damping_rate);
        f.not_negative("slide.greatest_sinkage", self.slide.greatest_sinkage);
        f.check(self.carriage.x.is_finite(), "carriage.x", self.carriage.x, "a finite number");
        f.check(self.carriage.y.is_finite(), "carriage.y", self.carriage.y, "a finite number");
        f.not_negative("spin_inertia", self.spin_inertia);
        f.not_negative("filter_window", self.filter_window);
        // A step of nothing would be a run without end.
        f.within("inner_step", self.inner_step, 1e-7, 0.1);
        f.into_result(origin)
    }
}
