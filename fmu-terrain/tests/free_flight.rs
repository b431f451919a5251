//! Validation 2.10: a gas of elastic, frictionless grains keeps momentum to round-off and energy within a bound.

#[path = "common/checks.rs"]
mod checks;

use checks::below;
use fmu_terrain::dem::{CpuEngine, Fill, Grain, GrainEngine, Material, Radii, Sample, Setup, sample, vec3};

fn gas(friction: f64, count: usize) -> CpuEngine {
    let material = Material { restitution: 1.0, friction, ..Material::default() };
    let setup = Setup { step: 1e-5, gravity: [0.0; 3], materials: vec![material], ..Setup::default() };
    let grains: Vec<Grain> = sample(&Sample {
        length: 0.25,
        width: 0.25,
        fill: Fill::Count(count),
        radii: Radii::Uniform(0.008, 0.012),
        density: 2500.0,
        material: 0,
        seed: 3,
        spacing: 1.05,
    })
    .unwrap()
    .into_iter()
    .map(|g| {
        // All fly towards the middle, so that there are many collisions.
        let to_middle = vec3::sub([0.0, 0.0, 0.12], g.position);
        Grain { velocity: vec3::scale(4.0, to_middle), ..g }
    })
    .collect();
    CpuEngine::new(setup, &grains, 1).unwrap()
}

/// Momentum, angular momentum about the origin, and the sum of the sizes of their parts.
fn momenta(engine: &CpuEngine) -> ([f64; 3], [f64; 3], f64, f64) {
    let zero = [0.0; 3];
    engine.state().rows.iter().fold((zero, zero, 0.0, 0.0), |(p, l, ps, ls), r| {
        let m = 1.0 / r[7];
        let mv = vec3::scale(m, [r[4], r[5], r[6]]);
        let spin = vec3::scale(1.0 / r[15], [r[8], r[9], r[10]]);
        let arm = vec3::add(vec3::cross([r[0], r[1], r[2]], mv), spin);
        (vec3::add(p, mv), vec3::add(l, arm), ps + vec3::norm(mv), ls + vec3::norm(arm))
    })
}

#[test]
fn case_2_10_momentum_to_round_off_and_energy_bounded() {
    let mut engine = gas(0.0, 800);
    let energy = engine.state().kinetic_energy();
    let (p0, l0, ..) = momenta(&engine);
    let (mut most_contacts, mut worst) = (0, 0.0_f64);
    for _ in 0..20 {
        engine.advance(500, &mut []).unwrap();
        most_contacts = most_contacts.max(engine.state().grain_contacts());
        worst = worst.max((engine.energy(&[]) / energy - 1.0).abs());
    }
    let (p, l, ps, ls) = momenta(&engine);
    println!("contacts {most_contacts}, rebuilds {}", engine.state().rebuilds);
    assert!(most_contacts > 300 && engine.state().rebuilds > 10);
    let change = |a, b, size: f64| vec3::norm(vec3::sub(a, b)) / size;
    below("2.10", "change of momentum over the sum of its parts", "1", change(p, p0, ps), 1e-12);
    below("2.10", "change of angular momentum over the sum of its parts", "1", change(l, l0, ls), 1e-12);
    below("2.10", "largest relative change of energy", "1", worst, 2e-3);
}

#[test]
fn friction_keeps_both_momenta_too() {
    let mut engine = gas(0.7, 800);
    let (p0, l0, ..) = momenta(&engine);
    engine.advance(8000, &mut []).unwrap();
    let (p, l, ps, ls) = momenta(&engine);
    assert!(engine.state().rows.iter().any(|r| r[8].abs() > 1.0));
    let change = |a, b, size: f64| vec3::norm(vec3::sub(a, b)) / size;
    below("2.10 with friction", "change of momentum over the sum of its parts", "1", change(p, p0, ps), 1e-12);
    // Semi-implicit: forces act at x_n and x moves with v_(n+1), which leaves x x p exact for central pairs.
    below("2.10 with friction", "change of angular momentum over the sum of its parts", "1", change(l, l0, ls), 1e-11);
}
