//! One row: the wheel is let down under its load, then carriage and rim move as the row says.
//!
//! The wheel's heading is turned to the left of the carriage's way by the slip angle; forces are in the wheel's frame, Fx along its
//! heading, Fy to its left: a wheel that is dragged with its heading to the left is pushed to the left, as in the file. The load is carried by a
//! mass that moves up and down, with a little damping. Speeds are scaled up as far as (omega R)^2/(g R) stays below 0.01.

use crate::Outcome;
use crate::sand::Sand;
use fmu_terrain::config::Terrain;
use fmu_terrain::dem::{Body, Cylinder, GrainEngine as _, Setup, Surface, prepare};
use serde_json::{Value, json};
use std::time::Instant;

/// Radius and width of the wheel (m).
const WHEEL: [f64; 2] = [0.058, 0.05];
/// Speed of the carriage in the experiment (m/s).
const CARRIAGE: f64 = 0.01;
/// Greatest (omega R)^2/(g R), or v^2/(g R), of a scaled run.
const FROUDE: f64 = 0.01;
const G: f64 = 9.81;
/// Way of the carriage in the table (m).
const WAY: f64 = 0.14;

/// A row of the file.
#[derive(Clone, Debug)]
pub struct Row {
    /// Slip angle (deg).
    pub angle: f64,
    /// Slip.
    pub slip: f64,
    /// Pull and its standard deviation (N).
    pub fx: [f64; 2],
    /// Load (N).
    pub load: f64,
    /// Sinkage (m).
    pub sinkage: f64,
}

impl Row {
    /// The rows of the file.
    pub fn read(text: &str) -> Outcome<Vec<Self>> {
        let lines = text.lines().filter(|l| l.starts_with("smooth"));
        lines
            .map(|line| {
                let x: Vec<f64> = line.split(',').skip(1).map(str::parse).collect::<Result<_, _>>()?;
                let [angle, _, _, slip, fx, sd, _, load, sinkage, _] = x[..] else {
                    return Err(format!("not a row of the file: {line}").into());
                };
                Ok(Self { angle, slip, fx: [fx, sd], load, sinkage: 1e-3 * sinkage })
            })
            .collect()
    }

    /// The row of an angle (deg) and slip.
    pub fn find(rows: &[Self], angle: f64, slip: f64) -> Option<&Self> {
        rows.iter().find(|r| r.angle == angle && (r.slip - slip).abs() < 1e-6)
    }

    /// Speed of the rim over the carriage's.
    fn rim(&self) -> f64 {
        if self.slip > 0.0 { 1.0 / (1.0 - self.slip) } else { 1.0 + self.slip }
    }

    /// Factor on all speeds.
    fn scale(&self) -> f64 {
        ((FROUDE * G * WHEEL[0]).sqrt() / (CARRIAGE * self.rim().max(1.0))).max(1.0)
    }

    /// Seconds to simulate, about.
    pub fn cost(&self) -> f64 {
        WAY / (CARRIAGE * self.scale())
    }

    /// Squares of the errors over what counts as agreement: 5 % of the load or three deviations; 15 % or 2 mm of sinkage.
    pub fn error(&self, made: &Value) -> f64 {
        let get = |k: &str| made[k].as_f64().unwrap_or(f64::NAN);
        let pull = (get("fx") - self.fx[0]) / (3.0 * self.fx[1]).max(0.05 * self.load);
        let sinkage = (get("sinkage") - self.sinkage) / (0.15 * self.sinkage).max(0.002);
        pull * pull + sinkage * sinkage
    }
}

/// The box.
#[derive(Clone, Copy, Debug)]
pub struct Bed {
    /// Length along the carriage's way (m).
    pub length: f64,
    /// Width (m).
    pub width: f64,
    /// Depth (m).
    pub depth: f64,
    /// Which random bed.
    pub seed: u64,
}

impl Default for Bed {
    fn default() -> Self {
        Self { length: 0.34, width: 0.2, depth: 0.09, seed: 1 }
    }
}

/// A run.
#[derive(Clone, Copy, Debug)]
pub struct Run<'a> {
    /// What is imposed.
    pub row: &'a Row,
    /// The sand.
    pub sand: Sand,
    /// The box.
    pub bed: Bed,
    /// Factor on the step.
    pub step: f64,
    /// Factor on the speed.
    pub speed: f64,
    /// Young's modulus of the grains (Pa).
    pub modulus: f64,
    /// Way of the carriage (m); means are over its last third.
    pub way: f64,
}

const NOTHING: Row = Row { angle: 0.0, slip: 0.0, fx: [0.0; 2], load: 0.0, sinkage: 0.0 };

impl Default for Run<'_> {
    fn default() -> Self {
        let sand = Sand { radius: 0.0, friction: 0.0, rolling: 0.0, density: 0.0, wheel: 0.0, laying: 1.0 };
        Self { row: &NOTHING, sand, bed: Bed::default(), step: 1.0, speed: 1.0, modulus: 5e6, way: WAY }
    }
}

/// Runs a row: means of the forces on the wheel (N, its frame) and of its sinkage (m).
pub fn drive(run: &Run) -> Outcome<Value> {
    let start = Instant::now();
    let Run { row, sand, bed, .. } = run;
    let mut spec = sand.specification(run.modulus);
    spec["bed"] = json!({"length": bed.length, "width": bed.width, "fill": {"depth": bed.depth}, "seed": bed.seed, "laying": sand.laying});
    let spec: Terrain = serde_json::from_value(spec)?;
    spec.check("the wheel in sand")?;
    let setup = spec.setup(&[]);
    let setup = Setup { step: run.step * setup.step, ..setup };
    let (mut engine, report) = prepare(setup, &spec.recipe(), 1, &mut |_, _| true)?;
    let height = Surface::of(engine.state(), bed.length, bed.width).mean();

    let [radius, width] = WHEEL;
    let (speed, rim) = (CARRIAGE * row.scale() * run.speed, row.rim());
    let (sin, cos) = row.angle.to_radians().sin_cos();
    let h = engine.setup().step;
    // A communication step: what the wheel falls in it is far below a grain.
    const STEPS: u32 = 10;
    let dt = h * f64::from(STEPS);
    let mass = row.load / G;
    let (mut x, mut z, mut vz) = (-0.5 * bed.length + 0.09, height + radius, 0.0);
    // The load comes on slowly, or the wheel would fall deeper in than it stands.
    let (rest, ramp): (f64, f64) = (0.2, 0.1);
    let (mut t, mut way) = (0.0_f64, 0.0_f64);
    let mut sums = [0.0; 6];
    let mut parts = [[0.0; 4]; 2];
    while way < run.way {
        let share = ((t - rest) / ramp).clamp(0.0, 1.0);
        let (v, omega) = (share * speed, share * speed * rim / radius);
        let axis = [-sin, cos, 0.0];
        let spin = axis.map(|a| omega * a);
        let wheel = Cylinder::new(radius, width, [x, 0.0, z], axis, [v, 0.0, vz], spin);
        let mut body = [Body::new(Box::new(wheel), fmu_terrain::config::dem_p::FIRST_BODY)];
        engine.advance(STEPS, &mut body)?;
        let f = body[0].impulse.map(|i| i / dt);
        x += v * dt;
        z += vz * dt;
        way += v * dt;
        t += dt;
        let (load, damping) = (row.load * (t / rest).min(1.0), if share > 0.0 { 30.0 } else { 300.0 });
        vz += dt * ((f[2] - load) / mass - damping / mass * vz);
        if way > run.way * 2.0 / 3.0 {
            let frame = [f[0] * cos + f[1] * sin, -f[0] * sin + f[1] * cos, f[2], height + radius - z];
            let half = &mut parts[usize::from(way > run.way * 5.0 / 6.0)];
            for (k, value) in frame.into_iter().enumerate() {
                sums[k] += value;
                half[k] += value;
            }
            sums[4] += frame[0] * frame[0];
            sums[5] += 1.0;
        }
        if !z.is_finite() || z - radius < 0.0 {
            return Err(format!("the wheel has sunk through the bed at {t} s").into());
        }
    }
    let n = sums[5];
    let mean = |k: usize| sums[k] / n;
    // Difference of the two halves of the window: whether it is steady.
    let drift = |k: usize| 2.0 * (parts[1][k] - parts[0][k]) / n;
    let pressure = row.load / (width * radius);
    Ok(json!({
        "angle_deg": row.angle, "slip": row.slip, "load": row.load,
        "fx": mean(0), "fy": mean(1), "fz": mean(2), "sinkage": mean(3),
        "fx_sd": (sums[4] / n - mean(0) * mean(0)).max(0.0).sqrt(),
        "fx_drift": drift(0), "sinkage_drift": drift(3),
        "grains": report.grains, "step": h, "height": height, "speed": speed,
        "froude": (speed * rim.max(1.0)).powi(2) / (G * radius),
        "inertial": (speed * (rim - 1.0).abs().max(0.2)) / 5.0 * (sand.density / pressure).sqrt(),
        "wall_s": start.elapsed().as_secs_f64(),
    }))
}
