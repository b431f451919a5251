//! The same bits for any number of threads, and rebuilds that change nothing but the order of sums.

use fmu_terrain::dem::{
    Adhesion, Body, CpuEngine, Cylinder, Fill, Grain, GrainEngine, Material, Radii, Sample, Setup, Wall, sample,
};

/// A bed of two materials with cohesion and rolling resistance: every kernel path runs.
fn bed(threads: usize) -> CpuEngine {
    let soil = Material {
        rolling_friction: 0.1,
        spinning_friction: 0.05,
        adhesion: Adhesion { pressure: 1e4, ..Adhesion::default() },
        ..Material::default()
    };
    let rubber = Material { friction: 0.6, ..soil };
    let (length, width) = (0.8, 0.2);
    let setup = Setup { materials: vec![soil, rubber], walls: Wall::open_box(length, width, 0, 1), ..Setup::default() };
    let grains: Vec<Grain> = sample(&Sample {
        length,
        width,
        fill: Fill::Count(5000),
        radii: Radii::Uniform(0.007, 0.009),
        density: 2500.0,
        material: 0,
        seed: 5,
        spacing: 1.0,
    })
    .unwrap();
    CpuEngine::new(setup, &grains, threads).unwrap()
}

fn wheel(x: f64, z: f64) -> [Body; 1] {
    let at = Cylinder::new(0.15, 0.1, [x, 0.0, z], [0.0, 1.0, 0.0], [1.0, 0.0, -0.2], [0.0, 9.0, 0.0]);
    [Body::new(Box::new(at), 1)]
}

/// Hashes along a run in which grains fall, and a wheel ploughs through.
fn run(threads: usize, save_between: bool) -> (Vec<u64>, u64, [f64; 6]) {
    let mut engine = bed(threads);
    let mut hashes = Vec::new();
    engine.advance(800, &mut []).unwrap();
    hashes.push(engine.state().hash());
    let top = fmu_terrain::dem::Surface::of(engine.state(), 0.8, 0.2).mean();
    let mut bodies = wheel(-0.1, top + 0.15);
    for _ in 0..3 {
        engine.advance(200, &mut bodies).unwrap();
        hashes.push(engine.state().hash());
        if save_between {
            let state = engine.state().clone();
            let setup = engine.setup().clone();
            engine = CpuEngine::with_state(setup, state, 4 - threads).unwrap();
        }
    }
    let b = &bodies[0];
    let [f, m] = [b.impulse, b.angular_impulse];
    (hashes, engine.state().rebuilds, [f[0], f[1], f[2], m[0], m[1], m[2]])
}

#[test]
fn one_two_and_three_threads_give_the_same_bits() {
    let (hashes, rebuilds, impulse) = run(1, false);
    println!("{rebuilds} rebuilds, {} slabs, impulse {impulse:?}", bed(1).state().slabs.len());
    assert!(rebuilds > 5 && bed(1).state().slabs.len() >= 4 && impulse[2] > 0.0);
    for threads in [2, 3] {
        let (h, r, i) = run(threads, false);
        assert_eq!(h, hashes, "{threads} threads");
        assert_eq!(r, rebuilds);
        assert_eq!(i.map(f64::to_bits), impulse.map(f64::to_bits));
    }
}

#[test]
fn a_saved_state_goes_on_with_the_same_bits_on_other_threads() {
    let (hashes, ..) = run(1, false);
    assert_eq!(run(1, true).0, hashes);
    assert_eq!(run(3, true).0, hashes);
}

#[test]
fn a_rebuild_out_of_turn_changes_round_off_only() {
    let mut a = bed(1);
    a.advance(1500, &mut []).unwrap();
    let mut b = CpuEngine::with_state(a.setup().clone(), a.state().clone(), 1).unwrap();
    b.rebuild_now().unwrap();
    let forces = |e: &mut CpuEngine| {
        e.advance(1, &mut []).unwrap();
        let s = e.state();
        s.by_id().iter().map(|&i| s.force[i as usize]).collect::<Vec<_>>()
    };
    let contacts = a.state().grain_contacts() + a.state().boundary_contacts();
    assert_eq!(contacts, b.state().grain_contacts() + b.state().boundary_contacts());
    let (fa, fb) = (forces(&mut a), forces(&mut b));
    let largest = fa.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    let worst = fa.iter().flatten().zip(fb.iter().flatten()).fold(0.0_f64, |m, (x, y)| m.max((x - y).abs()));
    println!("{contacts} contacts, largest force {largest:.3e}, worst difference {worst:.3e}");
    assert!(worst < 1e-12 * largest);
}
