//! Bringing a bed to rest, and making one from a recipe.
//!
//! A bed rests when the mean kinetic energy of its grains, the most energetic hundredth left out, is below a limit. Left
//! out, because spheres without rolling resistance that are caged between others without being pressed may roll to
//! and fro for ever, and do not matter.

use super::compact::{Compaction, compact};
use super::engine::{CpuEngine, GrainEngine, Setup};
use super::error::DemError;
use super::grains::{DemState, Grain, INV_M, R, W, kinetic_energy, vec_at};
use super::material::PairTable;
use super::place::Placing;
use super::sample::{Fill, Sample, Species, sample_mixed};
use super::surface::Surface;
use super::tile::prepare_tiled;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// When a bed counts as settled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Settle {
    /// Mean kinetic energy of the grains, the most energetic hundredth left out, over m g r (1): 1e-5 is 1.5 mm/s for
    /// r 12 mm.
    pub energy: f64,
    /// Not before this time (s): grains begin at rest and must fall first.
    pub least_time: f64,
    /// Give up after this time (s).
    pub most_time: f64,
}

impl Default for Settle {
    fn default() -> Self {
        Self { energy: 1e-5, least_time: 0.05, most_time: 5.0 }
    }
}

/// How a settling went.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settled {
    /// Time it took (s).
    pub time: f64,
    /// Mean kinetic energy of the calmer grains at its end (J), see [`calm_energy`].
    pub energy: f64,
}

/// Told of progress: phase, fraction done in [0, 1]; `false` asks to stop.
pub type Progress<'a> = &'a mut dyn FnMut(&str, f64) -> bool;

/// Advances until the bed rests.
///
/// # Errors
/// [`DemError::NotSettled`], [`DemError::Cancelled`], or what the engine meets.
pub fn settle(
    engine: &mut impl GrainEngine,
    until: &Settle,
    phase: &'static str,
    progress: Progress,
) -> Result<Settled, DemError> {
    let (step, start) = (engine.setup().step, engine.state().time);
    let g = super::vec3::norm(engine.setup().gravity);
    let rows = &engine.state().rows;
    let free = rows.iter().filter(|r| r[INV_M] > 0.0).count();
    if free == 0 {
        return Ok(Settled { time: 0.0, energy: 0.0 });
    }
    let weight: f64 = rows.iter().filter(|r| r[INV_M] > 0.0).map(|r| r[R] / r[INV_M]).sum::<f64>() * g;
    let limit = until.energy * weight / free as f64;
    // Often enough that a stop is prompt, seldom enough that looking costs nothing.
    let chunk = (1e-3 / step).ceil().clamp(1.0, 200.0) as u32;
    let (mut highest, mut shown) = (0.0_f64, 0.0_f64);
    loop {
        engine.advance(chunk, &mut [])?;
        let time = engine.state().time - start;
        let energy = calm_energy(engine.state());
        highest = highest.max(energy);
        if time >= until.least_time && energy <= limit {
            return Ok(Settled { time, energy });
        }
        if time >= until.most_time {
            return Err(DemError::NotSettled { time, energy, limit });
        }
        // Energy falls about exponentially: its logarithm is a fair measure of what is left.
        let fallen = if energy < highest { (highest / energy).ln() / (highest / limit).ln().max(1e-9) } else { 0.0 };
        // It may rise again for a while: what has been told is not taken back.
        shown = shown.max(fallen.min(time / until.least_time).clamp(0.0, 0.999));
        if !progress(phase, shown) {
            return Err(DemError::Cancelled(phase));
        }
    }
}

/// Mean kinetic energy of the free grains (J), the most energetic hundredth left out.
pub fn calm_energy(state: &DemState) -> f64 {
    let mut energy: Vec<f64> = state.rows.iter().filter(|r| r[INV_M] > 0.0).map(kinetic_energy).collect();
    let kept = energy.len() - energy.len() / 100;
    if kept < energy.len() {
        energy.select_nth_unstable_by(kept, f64::total_cmp);
    }
    // Selection leaves an order of its own, which still depends on the values alone.
    energy[..kept].iter().sum::<f64>() / kept.max(1) as f64
}

/// How cohesion comes into a bed that was prepared without it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Onset {
    /// It grows over this time (s); the bed contracts and settles again.
    Growth(f64),
    /// At once, overlaps counting from offsets with which nothing moves ([`super::offset`]).
    Offset,
}

/// A bed to be made: place, settle, level, give it its friction, compact, let cohesion grow, settle again.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// What to place.
    pub sample: Sample,
    /// When it counts as settled.
    pub settle: Settle,
    /// How cohesion comes into the bed once it rests; poured with it, grains would hang in loose clumps.
    pub cohesion: Onset,
    /// How it is placed.
    pub placing: Placing,
    /// Other species mixed in.
    pub others: Vec<Species>,
    /// Factor on all friction (sliding, rolling, spinning) while the bed is poured, 0 to 1. It decides how densely it lies: what grains slide
    /// past each other by. From then on they have what the setup says.
    pub laying: f64,
    /// What is done to the settled bed, one after the other.
    pub compaction: Vec<Compaction>,
    /// Length of the tiles that the bed is laid of (m); none: it is settled whole.
    pub tile: Option<f64>,
}

impl Recipe {
    /// On a grid, of one species, as it settles.
    pub fn new(sample: Sample, settle: Settle, cohesion_time: f64) -> Self {
        let (placing, cohesion) = (Placing::default(), Onset::Growth(cohesion_time));
        Self { sample, settle, cohesion, placing, others: Vec::new(), laying: 1.0, compaction: Vec::new(), tile: None }
    }
}

/// How a bed came out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BedReport {
    /// Grains.
    pub grains: usize,
    /// Mean height of the surface (m).
    pub height: f64,
    /// Change of that height as cohesion grew (m), negative where the bed contracts.
    pub cohesion_change: f64,
    /// Simulated time spent (s).
    pub time: f64,
    /// Mean kinetic energy of the calmer grains at the end (J), see [`calm_energy`].
    pub energy: f64,
}

/// Makes a bed in an open box of the sample's length and width.
///
/// # Errors
/// As [`sample_mixed`], [`CpuEngine::new`], [`compact`] and [`settle()`].
pub fn prepare(
    setup: Setup,
    recipe: &Recipe,
    threads: usize,
    progress: Progress,
) -> Result<(CpuEngine, BedReport), DemError> {
    if let Some(length) = recipe.tile {
        return prepare_tiled(setup, recipe, length, threads, progress);
    }
    let adheres = PairTable::new(&setup.materials, &setup.overrides).any_adhesion();
    prepare_with(|grains: &[Grain]| CpuEngine::new(setup.clone(), grains, threads), adheres, recipe, progress)
}

/// As [`prepare`], with any engine: `new` makes one of grains; `adheres` says whether there is cohesion to let grow.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_with<E: GrainEngine>(
    new: impl Fn(&[Grain]) -> Result<E, DemError>,
    adheres: bool,
    recipe: &Recipe,
    progress: Progress,
) -> Result<(E, BedReport), DemError> {
    let s = &recipe.sample;
    let grains = sample_mixed(s, recipe.placing, &recipe.others)?;
    if !(0.0..=1.0).contains(&recipe.laying) {
        return Err(DemError::parameter("factor on friction while the bed is laid", recipe.laying, "0 to 1"));
    }
    let mut own = None;
    let mut pour = |grains: &[Grain]| {
        let mut engine = new(grains)?;
        engine.scale_adhesion(0.0);
        if recipe.laying < 1.0 {
            let setup = engine.setup().clone();
            engine.take_setup(setup.with_friction(recipe.laying))?;
            own = Some(setup);
        }
        Ok::<E, DemError>(engine)
    };
    let mut engine = pour(&grains)?;
    let mut done = settle(&mut engine, &recipe.settle, "settling", progress)?;
    let mut time = done.time;
    if let Fill::Depth(depth) = s.fill {
        let kept = level(&engine, &grains, depth);
        if kept.len() < grains.len() {
            engine = pour(&kept)?;
            done = settle(&mut engine, &recipe.settle, "settling the levelled bed", progress)?;
            time += done.time;
        }
    }
    if let Some(setup) = own {
        engine.take_setup(setup)?;
        done = settle(&mut engine, &recipe.settle, "settling with its friction", progress)?;
        time += done.time;
    }
    for what in &recipe.compaction {
        compact(&mut engine, what, [s.length, s.width], progress)?;
        done = settle(&mut engine, &recipe.settle, "settling the compacted bed", progress)?;
        time += done.time;
    }
    let height = Surface::of(engine.state(), s.length, s.width).mean();
    let mut cohesion_change = 0.0;
    if adheres {
        match recipe.cohesion {
            Onset::Growth(growth) => {
                grow_cohesion(&mut engine, growth, progress)?;
                time += growth;
            }
            Onset::Offset => {
                engine.scale_adhesion(1.0);
                engine.offset_overlaps()?;
            }
        }
        done = settle(&mut engine, &recipe.settle, "settling the cohesive bed", progress)?;
        time += done.time;
        cohesion_change = Surface::of(engine.state(), s.length, s.width).mean() - height;
    } else {
        engine.scale_adhesion(1.0);
    }
    engine.open_energy_account();
    let report = BedReport {
        grains: engine.state().rows.len(),
        height: height + cohesion_change,
        cohesion_change,
        time,
        energy: done.energy,
    };
    Ok((engine, report))
}

/// Lets cohesion grow over this time (s).
fn grow_cohesion(engine: &mut impl GrainEngine, time: f64, progress: Progress) -> Result<(), DemError> {
    let steps = (time / engine.setup().step).ceil().max(1.0) as u32;
    let parts = 100.min(steps);
    for k in 1..=parts {
        engine.scale_adhesion(f64::from(k) / f64::from(parts));
        engine.advance(steps.div_ceil(parts), &mut [])?;
        if !progress("letting cohesion grow", f64::from(k) / f64::from(parts)) {
            return Err(DemError::Cancelled("letting cohesion grow"));
        }
    }
    Ok(())
}

/// The grains that lie below `depth`, as they are now.
fn level(engine: &impl GrainEngine, placed: &[Grain], depth: f64) -> Vec<Grain> {
    let state = engine.state();
    state
        .by_id()
        .iter()
        .map(|&i| (&state.rows[i as usize], state.ids[i as usize]))
        .filter(|(row, _)| row[2] + row[R] <= depth)
        .map(|(row, id)| Grain {
            position: vec_at(row, 0),
            velocity: vec_at(row, super::grains::V),
            angular_velocity: vec_at(row, W),
            ..placed[id as usize]
        })
        .collect()
}
