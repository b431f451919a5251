//! Sleep: what is far from every body stays as it is; what that does to the forces on a wheel.

#[path = "common/checks.rs"]
mod checks;

use checks::figure;
use fmu_terrain::dem::{
    Body, CpuEngine, Cylinder, Fill, GrainEngine, Material, Radii, Recipe, Sample, Settle, Setup, Sleep, Surface, Wall,
    prepare,
};

const LENGTH: f64 = 3.0;
const WIDTH: f64 = 0.16;
const STEP: f64 = 4e-5;

fn setup(sleep: Option<f64>) -> Setup {
    let soil = Material { rolling_friction: 0.1, spinning_friction: 0.05, ..Material::default() };
    let sleep = sleep.map(|distance| Sleep { distance, energy: 1e-4 });
    Setup { materials: vec![soil], walls: Wall::open_box(LENGTH, WIDTH, 0, 0), sleep, step: STEP, ..Setup::default() }
}

/// A settled bed, 4800 grains.
fn bed() -> CpuEngine {
    let sample = Sample {
        length: LENGTH,
        width: WIDTH,
        fill: Fill::Count(4800),
        radii: Radii::Uniform(0.011, 0.013),
        density: 2500.0,
        material: 0,
        seed: 3,
        spacing: 1.0,
    };
    let settle = Settle { energy: 2e-5, least_time: 0.1, most_time: 3.0 };
    prepare(setup(None), &Recipe::new(sample, settle, 0.0), 2, &mut |_, _| true).unwrap().0
}

fn surface(bed: &CpuEngine) -> f64 {
    Surface::of(bed.state(), LENGTH, WIDTH).mean()
}

fn with(bed: &CpuEngine, sleep: Option<f64>, threads: usize) -> CpuEngine {
    CpuEngine::with_state(setup(sleep), bed.state().clone(), threads).unwrap()
}

/// A wheel of radius 0.2 m, at 1.5 m/s and slip 0.25, 25 mm deep; `k` counts communication steps of 100 inner steps.
fn wheel(height: f64, k: u32) -> [Body; 1] {
    let (v, t) = (1.5, 100.0 * STEP * f64::from(k));
    let z = (height + 0.2 - t * 0.4).max(height + 0.175);
    let fall = if z > height + 0.175 { -0.4 } else { 0.0 };
    let at =
        Cylinder::new(0.2, 0.14, [-0.95 + v * t, 0.0, z], [0.0, 1.0, 0.0], [v, 0.0, fall], [0.0, v / 0.75 / 0.2, 0.0]);
    [Body::new(Box::new(at), 0)]
}

/// Impulses on the wheel per communication step, hashes now and then, mean share of grains asleep.
fn drive(engine: &mut CpuEngine, height: f64, steps: std::ops::Range<u32>) -> (Vec<[f64; 3]>, Vec<u64>, f64) {
    let (mut impulses, mut hashes, mut share) = (Vec::new(), Vec::new(), 0.0);
    let count = f64::from(steps.end - steps.start);
    for k in steps {
        let mut bodies = wheel(height, k);
        engine.advance(100, &mut bodies).unwrap();
        impulses.push(bodies[0].impulse);
        share += engine.state().asleep() / count;
        if k % 30 == 29 {
            hashes.push(engine.state().hash());
        }
    }
    (impulses, hashes, share)
}

#[test]
fn what_is_far_sleeps_and_no_thread_or_checkpoint_changes_a_bit() {
    let bed = bed();
    let run = |threads: usize, save: bool| {
        let mut engine = with(&bed, Some(0.2), threads);
        let (mut impulses, mut hashes, share) = drive(&mut engine, surface(&bed), 0..30);
        if save {
            engine = with(&engine, Some(0.2), 4 - threads);
        }
        let (more, again, _) = drive(&mut engine, surface(&bed), 30..60);
        impulses.extend(more);
        hashes.extend(again);
        let bits: Vec<u64> = impulses.iter().flatten().map(|x| x.to_bits()).collect();
        (bits, hashes, share, engine)
    };
    let (bits, hashes, share, engine) = run(1, false);
    println!("{:.0} % of the grains sleep, {} rebuilds", 100.0 * share, engine.state().rebuilds);
    assert!(share > 0.3 && engine.state().rebuilds > 20);
    let (b, h, ..) = run(2, true);
    assert!(b == bits && h == hashes);
    // Sorted by cell, lists whole: as an engine that makes everything anew finds it.
    let contacts = engine.state().grain_contacts();
    println!("{:.2e} J a grain", fmu_terrain::dem::settle::calm_energy(engine.state()));
    let mut anew = CpuEngine::with_state(setup(None), engine.state().clone(), 1).unwrap();
    anew.rebuild_now().unwrap();
    assert_eq!(anew.state().grain_contacts(), contacts);
    let touching = |e: &CpuEngine| {
        let mut n = 0;
        e.observe(&[], &mut |_, _, _| n += 1);
        n
    };
    assert_eq!(touching(&anew), touching(&engine));
}

#[test]
fn everything_is_awake_without_a_body_and_a_body_wakes_what_it_comes_near_to() {
    let bed = bed();
    let mut engine = with(&bed, Some(0.3), 1);
    engine.advance(600, &mut []).unwrap();
    assert_eq!(engine.state().asleep(), 0.0);
    engine.advance(600, &mut wheel(0.3, 0)).unwrap();
    let asleep = engine.state().asleep();
    let frozen: Vec<_> = {
        let s = engine.state();
        let far = s.slabs.iter().filter(|s| s.asleep).flat_map(|s| s.grains());
        far.map(|i| (s.ids[i], s.rows[i])).collect()
    };
    assert!(asleep > 0.4, "{asleep}");
    engine.advance(600, &mut wheel(0.3, 0)).unwrap();
    let s = engine.state();
    for (id, row) in &frozen {
        let now = s.ids.iter().position(|i| i == id).unwrap();
        assert!(s.rows[now] == *row, "grain {id} has moved in its sleep");
    }
    // At the other end within one step.
    let far = Cylinder::new(0.2, 0.14, [1.2, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0; 3], [0.0; 3]);
    engine.advance(1, &mut [Body::new(Box::new(far), 0)]).unwrap();
    let s = engine.state();
    let near = s.slabs.iter().filter(|s| s.extent[1] > 0.75 && s.extent[0] < 1.4);
    assert!(near.clone().count() > 0 && near.clone().all(|s| !s.asleep));
}

#[test]
#[ignore = "a validation figure: minutes"]
fn what_sleep_does_to_the_forces_on_a_wheel() {
    let bed = bed();
    let mean = |sleep: Option<f64>, shaken: bool| {
        let mut engine = with(&bed, sleep, 2);
        if shaken {
            // Another order of sums, another run: how far two runs of the same bed are apart.
            engine.rebuild_now().unwrap();
            engine.advance(1, &mut []).unwrap();
        }
        let (impulses, _, share) = drive(&mut engine, surface(&bed), 0..300);
        let tail = &impulses[80..];
        let n = tail.len() as f64 * 100.0 * STEP;
        let sum = tail.iter().fold([0.0; 3], |a, b| [a[0] + b[0] / n, a[1] + b[1] / n, a[2] + b[2] / n]);
        (sum, share)
    };
    let (whole, _) = mean(None, false);
    let (other, _) = mean(None, true);
    let size = whole[2];
    let part = |f: [f64; 3]| ((f[0] - whole[0]).powi(2) + (f[2] - whole[2]).powi(2)).sqrt() / size;
    println!(
        "\nVALIDATION|sleep|two runs of one bed, difference of the mean force over the load|1|0|{:.5}|reported",
        part(other)
    );
    // On top of how far two runs of the same bed are apart.
    let scatter = part(other);
    for (distance, limit) in [(0.15, 0.1), (0.3, 0.05), (0.5, 0.05), (0.8, 0.05)] {
        let (f, share) = mean(Some(distance), false);
        println!("\nVALIDATION|sleep beyond {distance} m|grains asleep|1||{share:.3}|reported");
        figure(
            &format!("sleep beyond {distance} m"),
            "difference of the mean force over the load",
            "1",
            0.0,
            part(f),
            limit + scatter,
        );
    }
}
