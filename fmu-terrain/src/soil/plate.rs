//! Plate sinkage: strips of two widths are pushed into a bed, and Bekker's law is fitted.

use super::apparatus::Punch;
use super::{Soil, line};
use crate::dem::settle::Progress;
use crate::dem::{Body, CpuEngine, DemError, GrainEngine as _, Surface};

/// One strip.
#[derive(Clone, Debug)]
pub struct Sinkage {
    /// Its width b (m).
    pub width: f64,
    /// Pressure (Pa) over sinkage (m).
    pub curve: Vec<[f64; 2]>,
}

/// Two strips and p = (k_c/b + k_phi) z^n through both.
#[derive(Clone, Debug)]
pub struct Plates {
    /// Each strip.
    pub tests: Vec<Sinkage>,
    /// Bekker's k_c (N/m^(n+1)).
    pub k_c: f64,
    /// Bekker's k_phi (N/m^(n+2)).
    pub k_phi: f64,
    /// Bekker's n (1).
    pub n: f64,
}

/// Pushes strips of 4 and 8 diameters, across the whole width of the box, 3 diameters deep into a bed of 40 x 6 x 16 diameters
/// between smooth sides, at a fiftieth of the free fall over a diameter.
///
/// # Errors
/// What making the bed and the engine meet.
pub fn plates(soil: &Soil, threads: usize, progress: Progress) -> Result<Plates, DemError> {
    let d = soil.diameter;
    let size = [40.0 * d, 6.0 * d, 16.0 * d];
    let made = soil.bed(size, true, threads, progress)?;
    let mut tests = Vec::new();
    for width in [4.0 * d, 8.0 * d] {
        let mut engine = CpuEngine::with_state(made.setup().clone(), made.state().clone(), threads)?;
        tests.push(one(&mut engine, d, size, width, progress)?);
    }
    // Exponent and stiffness of each by the logarithms, from half a diameter on: less is one layer of grains.
    let fits: Vec<[f64; 2]> = tests
        .iter()
        .map(|t| {
            let points = t.curve.iter().filter(|p| p[0] > 0.5 * d && p[1] > 0.0);
            line(points.map(|p| (p[0].ln(), p[1].ln())))
        })
        .collect();
    let n = 0.5 * (fits[0][0] + fits[1][0]);
    // With one exponent for both: the mean of ln p - n ln z.
    let k: Vec<f64> = tests
        .iter()
        .map(|t| {
            let points: Vec<f64> =
                t.curve.iter().filter(|p| p[0] > 0.5 * d && p[1] > 0.0).map(|p| p[1].ln() - n * p[0].ln()).collect();
            (points.iter().sum::<f64>() / points.len() as f64).exp()
        })
        .collect();
    let (a, b) = (1.0 / tests[0].width, 1.0 / tests[1].width);
    let k_c = (k[0] - k[1]) / (a - b);
    Ok(Plates { k_c, k_phi: k[0] - k_c * a, n, tests })
}

fn one(
    engine: &mut CpuEngine,
    d: f64,
    [length, across, _]: [f64; 3],
    width: f64,
    progress: Progress,
) -> Result<Sinkage, DemError> {
    const STEPS: u32 = 20;
    let height = Surface::of(engine.state(), length, across).mean();
    let speed = (2.0 * 9.81 * d).sqrt() / 50.0;
    let chunk = engine.setup().step * f64::from(STEPS);
    let depth = 3.0 * d;
    let mut z = engine.state().rows.iter().map(|r| r[2] + r[3]).fold(0.0, f64::max);
    let bins = 60;
    let mut sums = vec![[0.0; 2]; bins];
    while height - z < depth {
        let mut body = [Body::new(Box::new(Punch::new(0.5 * width, z, [0.0, -speed])), 0)];
        engine.advance(STEPS, &mut body)?;
        z -= speed * chunk;
        let sinkage = height - z;
        if sinkage > 0.0 {
            let bin = &mut sums[((sinkage / depth * bins as f64) as usize).min(bins - 1)];
            bin[0] += body[0].impulse[2] / chunk / (width * across);
            bin[1] += 1.0;
        }
        if !progress("pushing a plate in", (sinkage / depth).clamp(0.0, 1.0)) {
            return Err(DemError::Cancelled("pushing a plate in"));
        }
    }
    let middle = |k: usize| (k as f64 + 0.5) / bins as f64 * depth;
    let curve = sums.iter().enumerate().filter(|(_, s)| s[1] > 0.0).map(|(k, s)| [middle(k), s[0] / s[1]]).collect();
    Ok(Sinkage { width, curve })
}
