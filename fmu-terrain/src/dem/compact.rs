//! Compaction of a settled bed: shaken, or pressed by a plate.

use super::body::{Body, BodyTouch, Shape};
use super::engine::GrainEngine;
use super::error::DemError;
use super::settle::Progress;
use super::surface::Surface;
use super::vec3::Vec3;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What is done to a bed after it has settled; it is settled again afterwards.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Compaction {
    /// Shaken up and down, or along x: as seen from the box, gravity swings by amplitude x (2 pi frequency)^2.
    Vibrate {
        /// Amplitude of the box's motion (m).
        amplitude: f64,
        /// Frequency (Hz).
        frequency: f64,
        /// How long (s).
        time: f64,
        /// Along x instead of z.
        sideways: bool,
    },
    /// Pressed by a plate over the whole surface.
    Press {
        /// Pressure (Pa).
        pressure: f64,
        /// How long the pressure is held (s).
        time: f64,
    },
}

/// Speed of the plate at most (m/s).
const PLATE_SPEED: f64 = 0.1;

/// Compacts a bed in a box of this length and width; change of its height (m).
///
/// # Errors
/// What the engine meets; a stop asked for; a pressure that is not reached within ten times its time and a second.
pub fn compact(
    engine: &mut impl GrainEngine,
    what: &Compaction,
    [length, width]: [f64; 2],
    progress: Progress,
) -> Result<f64, DemError> {
    let before = Surface::of(engine.state(), length, width).mean();
    match *what {
        Compaction::Vibrate { amplitude, frequency, time, sideways } => {
            let gravity = engine.setup().gravity;
            let done = vibrate(engine, [amplitude, frequency, time], sideways, progress);
            engine.set_gravity(gravity);
            done?;
        }
        Compaction::Press { pressure, time } => press(engine, pressure * length * width, time, progress)?,
    }
    Ok(Surface::of(engine.state(), length, width).mean() - before)
}

fn vibrate(
    engine: &mut impl GrainEngine,
    [amplitude, frequency, time]: [f64; 3],
    sideways: bool,
    progress: Progress,
) -> Result<(), DemError> {
    let (gravity, h) = (engine.setup().gravity, engine.setup().step);
    let steps = (time / h).ceil() as u32;
    let (w, axis) = (TAU * frequency, if sideways { 0 } else { 2 });
    for k in 0..steps {
        let mut g = gravity;
        g[axis] += amplitude * w * w * (w * h * f64::from(k)).sin();
        engine.set_gravity(g);
        engine.advance(1, &mut [])?;
        if k % 256 == 0 && !progress("shaking the bed", f64::from(k) / f64::from(steps)) {
            return Err(DemError::Cancelled("shaking the bed"));
        }
    }
    Ok(())
}

fn press(engine: &mut impl GrainEngine, target: f64, time: f64, progress: Progress) -> Result<(), DemError> {
    const STEPS: u32 = 20;
    let h = engine.setup().step;
    let chunk = h * f64::from(STEPS);
    let top = engine.state().rows.iter().map(|r| r[2] + r[super::grains::R]).fold(0.0, f64::max);
    let (mut z, mut v, mut held, mut spent) = (top, -PLATE_SPEED, 0.0, 0.0);
    while held < time {
        let mut body = [Body::new(Box::new(Plate { start: z, speed: v, now: z }), 0)];
        engine.advance(STEPS, &mut body)?;
        z += v * chunk;
        spent += chunk;
        let force = body[0].impulse[2] / chunk;
        // Down while the soil gives less than the target, up while it gives more; slower the nearer.
        v = PLATE_SPEED * ((force - target) / target).clamp(-1.0, 1.0);
        held += if force > 0.9 * target { chunk } else { 0.0 };
        if spent > 10.0 * time + 1.0 {
            return Err(DemError::parameter("pressure", target, "one that the bed carries: the plate went on sinking"));
        }
        if !progress("pressing the bed", held / time) {
            return Err(DemError::Cancelled("pressing the bed"));
        }
    }
    // Let go of slowly: the bed springs back against the plate.
    for _ in 0..(0.02 / chunk).ceil() as u32 {
        let mut body = [Body::new(Box::new(Plate { start: z, speed: PLATE_SPEED, now: z }), 0)];
        engine.advance(STEPS, &mut body)?;
        z += PLATE_SPEED * chunk;
    }
    Ok(())
}

/// Everything above a height; of the soil's material.
pub(crate) struct Plate {
    pub start: f64,
    pub speed: f64,
    pub now: f64,
}

impl Shape for Plate {
    fn move_to(&mut self, t: f64) {
        self.now = self.start + self.speed * t;
    }
    fn bounds(&self) -> [Vec3; 2] {
        [[f64::NEG_INFINITY, f64::NEG_INFINITY, self.now], [f64::INFINITY; 3]]
    }
    fn touches(&self, centre: Vec3, radius: f64, out: &mut Vec<BodyTouch>) {
        let overlap = centre[2] + radius - self.now;
        if overlap > 0.0 {
            out.push(BodyTouch {
                overlap,
                weight: 1.0,
                share: 1.0,
                normal: [0.0, 0.0, -1.0],
                point: [centre[0], centre[1], self.now],
                velocity: [0.0, 0.0, self.speed],
                angular_velocity: [0.0; 3],
                vertices: [u32::MAX; 3],
                weights: [0.0; 3],
            });
        }
    }
    fn centre(&self) -> Vec3 {
        [0.0, 0.0, self.now]
    }
}
