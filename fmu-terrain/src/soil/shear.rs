//! Direct shear: the upper half of a box is moved over the lower one under a plate of given pressure.

use super::apparatus::{Frame, Punch};
use super::{Soil, line};
use crate::dem::settle::Progress;
use crate::dem::{Body, DemError, GrainEngine as _};

/// One test.
#[derive(Clone, Debug)]
pub struct Sheared {
    /// Normal stress (Pa), mean over the part that `residual` is taken from.
    pub normal: f64,
    /// Greatest shear stress (Pa), of means over a fiftieth of the way.
    pub peak: f64,
    /// Mean shear stress over the last third of the way (Pa).
    pub residual: f64,
    /// Shear stress (Pa) over displacement (m).
    pub curve: Vec<[f64; 2]>,
}

/// Several tests and the line through them.
#[derive(Clone, Debug)]
pub struct Shear {
    /// Each pressure.
    pub tests: Vec<Sheared>,
    /// Friction angle of the residual stresses (rad).
    pub friction_angle: f64,
    /// Their cohesion (Pa).
    pub cohesion: f64,
    /// Friction angle of the peak stresses (rad).
    pub peak_angle: f64,
    /// Inertial number at the least pressure: below 1e-3 is quasi-static, up to 1e-2 nearly so.
    pub inertial_number: f64,
}

/// Shears at these normal pressures (Pa). The box is 16 x 8 diameters, 10 high; the way is 3 diameters.
///
/// # Errors
/// What making the bed and the engine meet.
pub fn shear(soil: &Soil, pressures: &[f64], threads: usize, progress: Progress) -> Result<Shear, DemError> {
    let d = soil.diameter;
    let (length, width, depth) = (16.0 * d, 8.0 * d, 10.0 * d);
    let made = soil.bed([length, width, depth], true, threads, progress)?;
    let density = soil.recipe.sample.density;
    let least = pressures.iter().copied().fold(f64::INFINITY, f64::min);
    // Quasi-static: the strain goes through a band of some ten diameters.
    let inertial_number = 3e-3;
    let speed = inertial_number * 10.0 * (least / density).sqrt();
    let mut tests = Vec::new();
    for &pressure in pressures {
        let mut setup = made.setup().clone();
        // The frames take the place of the walls across x.
        setup.walls[1].point[0] -= 5.0 * d;
        setup.walls[2].point[0] += 5.0 * d;
        let mut engine = crate::dem::CpuEngine::with_state(setup, made.state().clone(), threads)?;
        engine.rebuild_now()?;
        tests.push(one(&mut engine, soil, [length, width, depth], pressure, speed, progress)?);
    }
    let fit = |stress: fn(&Sheared) -> f64| line(tests.iter().map(move |t| (t.normal, stress(t))));
    let ([slope, cohesion], [peak, _]) = (fit(|t| t.residual), fit(|t| t.peak));
    Ok(Shear { friction_angle: slope.atan(), cohesion, peak_angle: peak.atan(), tests, inertial_number })
}

fn one(
    engine: &mut crate::dem::CpuEngine,
    soil: &Soil,
    [length, width, depth]: [f64; 3],
    pressure: f64,
    speed: f64,
    progress: Progress,
) -> Result<Sheared, DemError> {
    const STEPS: u32 = 20;
    let d = soil.diameter;
    let (area, way) = (length * width, 3.0 * d);
    let chunk = engine.setup().step * f64::from(STEPS);
    let top = engine.state().rows.iter().map(|r| r[2] + r[3]).fold(0.0, f64::max);
    let most = 2.0 * (9.81 * d).sqrt();
    let (mut z, mut v, mut x, mut rest) = (top, -0.2 * most, 0.0, 0.0);
    let mut samples: Vec<[f64; 3]> = Vec::new();
    let mut smooth = 0.0;
    let mut count = 0_u32;
    while x < way {
        // The plate finds its pressure first; then the upper half moves.
        let moves = rest > 40.0 * chunk;
        let u = if moves { speed } else { 0.0 };
        let walls = [-0.5 * length, 0.5 * length];
        let middle = 0.5 * depth;
        let mut bodies = [
            Body::new(Box::new(Frame::new(walls, middle, false, 0.0)), soil.smooth),
            Body::new(Box::new(Frame::new(walls.map(|w| w + x), middle, true, u)), soil.smooth),
            Body::new(Box::new(Punch::new(f64::INFINITY, z, [u, v])), 0),
        ];
        engine.advance(STEPS, &mut bodies)?;
        z += v * chunk;
        x += u * chunk;
        let lid = bodies[2].impulse[2] / chunk;
        // What the upper half and the plate on it feel along x.
        let drag = -(bodies[1].impulse[0] + bodies[2].impulse[0]) / chunk;
        let error = (lid - pressure * area) / (pressure * area);
        smooth += 0.2 * (error - smooth);
        v = 0.1 * most * smooth.clamp(-1.0, 1.0);
        if lid > 0.7 * pressure * area {
            rest += chunk;
        }
        if moves {
            // On the plane of shear: the plate's pressure and the upper half's weight, both as the soil below carries them.
            samples.push([x, drag / area, lid / area]);
        }
        count += 1;
        if f64::from(count) * chunk > 10.0 * way / speed + 20.0 {
            return Err(DemError::parameter(
                "pressure",
                pressure,
                "one that the soil carries: the plate found no hold",
            ));
        }
        if !progress("shearing", x / way) {
            return Err(DemError::Cancelled("shearing"));
        }
    }
    let bins = 50;
    let mut curve = Vec::new();
    for k in 0..bins {
        let (a, b) = (way * f64::from(k) / f64::from(bins), way * f64::from(k + 1) / f64::from(bins));
        let inside: Vec<_> = samples.iter().filter(|s| s[0] > a && s[0] <= b).collect();
        if !inside.is_empty() {
            curve.push([0.5 * (a + b), inside.iter().map(|s| s[1]).sum::<f64>() / inside.len() as f64]);
        }
    }
    let last: Vec<_> = samples.iter().filter(|s| s[0] > 2.0 / 3.0 * way).collect();
    let mean = |c: usize| last.iter().map(|s| s[c]).sum::<f64>() / last.len() as f64;
    // The weight of the soil above the plane is carried through it, too.
    let above: f64 = engine.state().rows.iter().filter(|r| r[2] > 0.5 * depth).map(|r| 1.0 / r[7]).sum();
    let weight = above * soil.setup.gravity[2].abs() / area;
    let peak = curve.iter().fold(0.0, |a, p| f64::max(a, p[1]));
    Ok(Sheared { normal: mean(2) + weight, peak, residual: mean(1), curve })
}
