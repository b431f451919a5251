//! What DEM-C costs beside DEM-P for the same work: the tables of `docs/dem-c.md`. Times are those of a processor, of one thread.

#[path = "common/sand_wheel.rs"]
mod sand_wheel;

use fmu_terrain::dem_c::ConeSetup;
use sand_wheel::{Driven, SMALL, Scene, cpu_seconds};

fn show(name: &str, r: Driven) {
    println!(
        "{name}: pull {:.2} N, sinkage {:.2} mm, force from exchange to exchange {:.2} N, {:.2} s",
        r.pull,
        1e3 * r.sinkage,
        r.ring,
        r.seconds
    );
}

#[test]
#[ignore = "minutes: cargo xtask validate dem-c"]
fn what_step_and_rigidity_do_to_the_wheel() {
    // The same work by both engines and several steps: what is gained, and what it costs in accuracy.
    let state = SMALL.bed(1);
    show("DEM-P 4e-5 s", SMALL.drive(&mut SMALL.soft(&state), 4e-4, 0.06));
    for h in [2.5e-4, 5e-4, 1e-3, 2e-3] {
        let mut engine = SMALL.cone(&state, h, ConeSetup::default());
        let r = SMALL.drive(&mut engine, h.max(5e-4), 0.06);
        show(&format!("DEM-C {h} s, {:.1} iterations", engine.mean_iterations()), r);
    }
    for tolerance in [1e-4, 1e-2] {
        let mut engine = SMALL.cone(&state, 1e-3, ConeSetup { tolerance, ..ConeSetup::default() });
        let r = SMALL.drive(&mut engine, 1e-3, 0.06);
        show(&format!("DEM-C 1e-3 s, tolerance {tolerance}, {:.1} iterations", engine.mean_iterations()), r);
    }
    let mut engine = SMALL.cone(&state, 1e-3, ConeSetup { elastic: false, ..ConeSetup::default() });
    let r = SMALL.drive(&mut engine, 1e-3, 0.06);
    show(&format!("DEM-C 1e-3 s rigid, {:.1} iterations", engine.mean_iterations()), r);
}

#[test]
#[ignore = "minutes: cargo xtask validate dem-c"]
fn what_coarse_grains_and_stiff_ones_do() {
    // Wheel and grains six times as great, 36 mm as in the turn; the modulus of the studies, and a stiff one.
    for young in [1e7, 1e8] {
        let scene = Scene { scale: 6.0, young, ..SMALL };
        let state = scene.bed(1);
        let p = scene.soft_step();
        let exchange = (1e-3 / p).round() * p;
        show(&format!("36 mm, {young:e} Pa, DEM-P {p:.2e} s"), scene.drive(&mut scene.soft(&state), exchange, 0.06));
        for h in [1e-3, 2.5e-3] {
            let mut engine = scene.cone(&state, h, ConeSetup::default());
            let r = scene.drive(&mut engine, h, 0.06);
            show(&format!("36 mm, {young:e} Pa, DEM-C {h} s, {:.1} iterations", engine.mean_iterations()), r);
        }
    }
}

#[test]
#[ignore = "minutes: cargo xtask validate dem-c"]
fn what_settling_costs() {
    for scene in [SMALL, Scene { scale: 2.0, young: 1e7, ..SMALL }, Scene { scale: 6.0, young: 1e8, ..SMALL }] {
        let mm = 1e3 * scene.grain();
        let say = |name: &str, start: f64, height: f64, time: f64| {
            let s = cpu_seconds() - start;
            println!("{mm} mm, {:e} Pa, {name}: {s:.2} s for {time:.2} s, height {:.2} mm", scene.young, 1e3 * height);
        };
        let start = cpu_seconds();
        let (_, height, time) = scene.settled_soft(1);
        say(&format!("DEM-P {:.1e} s", scene.soft_step()), start, height, time);
        for h in [1e-3, 2e-3] {
            let start = cpu_seconds();
            let (_, height, time) = scene.settled_cone(1, h);
            say(&format!("DEM-C {h} s"), start, height, time);
        }
    }
}
