//! Speed of the granular engine: grain-steps per second in a settled bed that a wheel drives through.
//!
//! `cargo run --release -p fmu-terrain --example bench_bed [grains ...]`; default 20000 100000. Figures depend on what
//! else the machine does; compare only within one run.

use fmu_terrain::dem::{
    Body, Cylinder, Fill, GrainEngine, Material, Radii, Recipe, Sample, Settle, Setup, Wall, prepare,
};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut sizes: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    if sizes.is_empty() {
        sizes = vec![20_000, 100_000];
    }
    println!("grains  threads  Mgrain-steps/s  per thread  contacts/grain  rebuilt every  bytes/grain");
    for n in sizes {
        bench(n)?;
    }
    Ok(())
}

/// The bed of the reference figures: r 12 mm, rho 2500, E 1e7, nu .3, mu .9, e .2, h 4e-5, about 0.3 m deep.
fn bench(n: usize) -> Result<(), Box<dyn std::error::Error>> {
    let r: f64 = 0.012;
    let area = n as f64 * 4.0 / 3.0 * std::f64::consts::PI * r.powi(3) / 0.58 / 0.3;
    let (length, width) = ((2.5 * area).sqrt(), (area / 2.5).sqrt());
    let setup =
        Setup { materials: vec![Material::default()], walls: Wall::open_box(length, width, 0, 0), ..Setup::default() };
    let sample = Sample {
        length,
        width,
        fill: Fill::Count(n),
        radii: Radii::Equal(r),
        density: 2500.0,
        material: 0,
        seed: 1,
        spacing: 1.02,
    };
    let settle = Settle { energy: 1e-3, least_time: 0.1, most_time: 2.0 };
    let (mut engine, report) =
        prepare(setup.clone(), &Recipe { sample, settle, cohesion_time: 0.0 }, 2, &mut |_, _| true)?;
    let state = engine.state().clone();
    for threads in [1, 2] {
        engine = fmu_terrain::dem::CpuEngine::with_state(setup.clone(), state.clone(), threads)?;
        // The wheel is pressed in over 0.1 s, then driven at slip 1/3.
        let wheel = |centre, vx: f64, vz, w| {
            let cylinder = Cylinder::new(0.4, 0.25, centre, [0.0, 1.0, 0.0], [vx, 0.0, vz], [0.0, w, 0.0]);
            [Body::new(Box::new(cylinder), 0)]
        };
        let x = -0.25 * length;
        engine.advance(2500, &mut wheel([x, 0.0, report.height + 0.4], 0.0, -0.5, 0.0))?;
        let mut bodies = wheel([x, 0.0, report.height + 0.35], 1.0, 0.0, 1.5 / 0.4);
        engine.advance(100, &mut bodies)?;
        let (before, steps) = (engine.state().rebuilds, (20_000_000 / n).clamp(50, 2000) as u32);
        let start = Instant::now();
        engine.advance(steps, &mut bodies)?;
        let rate = n as f64 * f64::from(steps) / start.elapsed().as_secs_f64() / 1e6;
        let s = engine.state();
        let contacts = s.grain_contacts() as f64 / n as f64;
        let every = f64::from(steps) / (s.rebuilds - before).max(1) as f64;
        let lists: usize = s.slabs.iter().map(|s| s.start.len() * 4 + s.other.len() * 36 + s.roll.len() * 24).sum();
        let bytes = (s.rows.len() * (128 + 4 + 24 + 64) + lists) / n;
        println!(
            "{n:6}  {threads:7}  {rate:14.2}  {:10.2}  {contacts:14.2}  {every:13.1}  {bytes:11}",
            rate / threads as f64
        );
    }
    Ok(())
}
