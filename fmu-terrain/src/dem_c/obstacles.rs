//! Obstacles among rigid grains.
//!
//! To the cone problem an obstacle is a body that moves as prescribed over the step; what the grains did to it then moves it, as a force held over
//! the step. That is explicit, and holds as long as the obstacle is much heavier than the grains that lean on it ([`LIGHTEST`]). Walls, driven
//! bodies and other obstacles it meets by the springs of [`crate::dem::obstacle`], in inner steps as short as those of DEM-P.

use crate::dem::contact::Options;
use crate::dem::engine::Setup;
use crate::dem::material::PairTable;
use crate::dem::vec3::{Vec3, add_scaled, sub};
use crate::dem::{Body, DemError, obstacle};

/// Least mass of an obstacle, in masses of the heaviest grain: some twenty grains lean on it, and a held force must not throw it further
/// than they yield.
pub const LIGHTEST: f64 = 20.0;

/// How far an obstacle may come towards a grain in a step of `h` (m); 0 for bodies that others move.
pub fn reach(body: &mut Body, h: f64) -> f64 {
    match body.shape.as_free() {
        Some(free) if !free.now.asleep => {
            let s = &free.now.state;
            h * (s.velocity.norm() + s.angular_velocity.norm() * free.solid().reach())
        }
        _ => 0.0,
    }
}

/// Obstacles heavy enough for grains of at most `heaviest` (kg).
///
/// # Errors
/// Names one that is not.
pub fn check(bodies: &mut [Body], heaviest: f64) -> Result<(), DemError> {
    for free in bodies.iter_mut().filter_map(|b| b.shape.as_free()) {
        if free.mass() < LIGHTEST * heaviest {
            let allowed =
                format!("with terrain_dem_c at least {LIGHTEST} times the heaviest grain's {heaviest:.3e} kg");
            return Err(DemError::parameter("mass of an obstacle", format!("{} kg", free.mass()), allowed));
        }
    }
    Ok(())
}

/// Moves obstacles on from `t` by the step of `setup` under what the grains did to them, in inner steps of at most `longest` (s).
pub fn advance(bodies: &mut [Body], setup: &Setup, pairs: &PairTable, t: f64, longest: f64) {
    if !bodies.iter_mut().any(|b| b.shape.as_free().is_some()) {
        return;
    }
    let count = (setup.step / longest - 1e-9).ceil().max(1.0);
    let h = setup.step / count;
    let options = Options {
        h,
        tangential: setup.tangential,
        least_normal: if setup.clamp_normal { 0.0 } else { f64::NEG_INFINITY },
        adhesion: false,
        offsets: false,
        adhesion_scale: 0.0,
        adhesion_growth: 1.0,
        adhesion_per_overlap: f64::INFINITY,
        rolling_damping: setup.rolling_damping,
        margin: 0.0,
    };
    let force: Vec<Vec3> = bodies.iter().map(|b| b.force).collect();
    let impulse: Vec<Vec3> = bodies.iter().map(|b| b.impulse).collect();
    for j in 0..count as u32 {
        for (body, f) in bodies.iter_mut().zip(&force) {
            body.shape.move_to(t + f64::from(j) * h);
            body.force = *f;
        }
        obstacle::contact::step(bodies, setup, &setup.walls, pairs, &options);
    }
    for ((body, f), before) in bodies.iter_mut().zip(&force).zip(&impulse) {
        body.force = add_scaled(*f, 1.0 / setup.step, sub(body.impulse, *before));
    }
}
