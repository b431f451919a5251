//! Angle of repose: one side wall of a column is taken away at once.

use super::{Soil, line};
use crate::dem::settle::Progress;
use crate::dem::{DemError, GrainEngine as _, Settle, settle};

/// The slope that is left.
#[derive(Clone, Debug)]
pub struct Repose {
    /// Angle (rad).
    pub angle: f64,
    /// Height of the slope (m) over x from the wall that stayed (m).
    pub profile: Vec<[f64; 2]>,
}

/// Lets a column of 12 x 6 x 12 diameters fall to one side, between smooth sides, over a floor that grains cannot slide on more
/// than on each other; the angle is that of the line through the middle of the slope.
///
/// # Errors
/// What making the bed and the engine meet.
pub fn repose(soil: &Soil, threads: usize, progress: Progress) -> Result<Repose, DemError> {
    let d = soil.diameter;
    let (length, width, depth) = (12.0 * d, 6.0 * d, 12.0 * d);
    let mut engine = soil.bed([length, width, depth], true, threads, progress)?;
    let mut setup = engine.setup().clone();
    // The wall at +x, see Wall::open_box: out of the way of the fastest grain.
    setup.walls[2].point[0] += 20.0 * length;
    engine.set_setup(setup)?;
    engine.rebuild_now()?;
    let fall = (2.0 * depth / soil.setup.gravity[2].abs()).sqrt();
    let until = Settle { energy: 1e-4, least_time: 3.0 * fall, most_time: 12.0 * fall };
    match settle(&mut engine, &until, "letting the column fall", progress) {
        // Without rolling resistance, grains that have left the slope roll on for ever.
        Ok(_) | Err(DemError::NotSettled { .. }) => {}
        Err(e) => return Err(e),
    }
    // Highest point in each slice of one diameter.
    let slices = 60;
    let mut top = vec![0.0_f64; slices];
    for r in &engine.state().rows {
        let k = ((r[0] + 0.5 * length) / d) as usize;
        if k < slices {
            top[k] = top[k].max(r[2] + r[3]);
        }
    }
    let profile: Vec<[f64; 2]> = top.iter().enumerate().map(|(k, z)| [(k as f64 + 0.5) * d, *z]).collect();
    let most = top.iter().fold(0.0_f64, |a, b| a.max(*b));
    // The slope without its toe and without the rest of the column's top, up to where it ends.
    let end = top.iter().position(|z| *z <= 0.15 * most).unwrap_or(slices);
    let slope = profile[..end].iter().filter(|p| p[1] < 0.85 * most).map(|p| (p[0], p[1]));
    let [rise, _] = line(slope);
    Ok(Repose { angle: (-rise).atan(), profile })
}
