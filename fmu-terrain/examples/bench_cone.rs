//! Cost and convergence of the complementarity engine on a settled bed: `bench_cone [grains] [threads] [method] [tolerance] [iterations] [steps] [rolling friction]`.

use fmu_terrain::dem::{Fill, GrainEngine, Material, Radii, Recipe, Sample, Settle, Setup, Wall, prepare};
use fmu_terrain::dem_c::{ConeEngine, ConeSetup, ConeState};
use std::time::Instant;
use terramech_mechanics::cone::Method;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, or: f64| args.get(k).and_then(|a| a.parse().ok()).unwrap_or(or);
    let (grains, threads) = (number(0, 2000.0) as usize, number(1, 1.0) as usize);
    let method = match args.get(2).map(String::as_str) {
        Some("bb") => Method::BarzilaiBorwein,
        Some("gs") => Method::GaussSeidel,
        _ => Method::Nesterov,
    };
    let cone =
        ConeSetup { method, tolerance: number(3, 1e-3), iterations: number(4, 200.0) as u32, ..ConeSetup::default() };
    let r = 0.006;
    // About twelve layers.
    let side = (grains as f64 / 12.0).sqrt() * 2.0 * r;
    let soil = Material {
        friction: 0.5,
        restitution: 0.1,
        rolling_friction: number(6, 0.1),
        spinning_friction: 0.5 * number(6, 0.1),
        young_modulus: 1e7,
        ..Material::default()
    };
    let setup =
        Setup { step: 4e-5, materials: vec![soil], walls: Wall::open_box(side, side, 0, 0), ..Setup::default() };
    let sample = Sample {
        length: side,
        width: side,
        fill: Fill::Count(grains),
        radii: Radii::Uniform(0.9 * r, 1.1 * r),
        density: 2500.0,
        material: 0,
        seed: 1,
        spacing: 1.1,
    };
    let recipe = Recipe::new(sample, Settle { most_time: 20.0, ..Settle::default() }, 0.0);
    let (bed, report) = prepare(setup.clone(), &recipe, threads, &mut |_, _| true).expect("the bed settles");
    println!("{report:?}");
    let height = |rows: &[fmu_terrain::dem::grains::Row]| rows.iter().map(|r| r[2]).sum::<f64>() / rows.len() as f64;
    let before = height(&bed.state().rows);
    let setup = Setup { step: 1e-3, ..setup };
    let mut engine = ConeEngine::with_state(setup, cone, bed.state().clone(), ConeState::default(), threads).unwrap();
    let steps = number(5, 20.0) as usize;
    for k in 0..steps {
        let start = Instant::now();
        engine.advance(1, &mut []).unwrap();
        let (time, r) = (start.elapsed().as_secs_f64(), engine.report());
        if k < 10 || k % 10 == 9 {
            println!(
                "step {k}: {} contacts, {} iterations, residual {:.2e} m/s, {:.1} ms, {:.3} ms per iteration, mean height {:+.2e} m",
                r.contacts,
                r.outcome.iterations,
                r.outcome.residual,
                1e3 * time,
                1e3 * time / f64::from(r.outcome.iterations.max(1)),
                height(&engine.state().rows) - before
            );
        }
    }
}
