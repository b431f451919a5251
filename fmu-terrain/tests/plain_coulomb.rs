//! The published law at its published step: a bed pressed together by 100 kPa of cohesion comes to rest. Its friction is a dashpot near
//! rest, and without a bound it chattered at any step above 1e-5 s.

use fmu_terrain::dem::settle::calm_energy;
use fmu_terrain::dem::{
    Adhesion, Coefficients, CpuEngine, Fill, Form, GrainEngine, LawKind, Material, Radii, Sample, Setup, Wall, sample,
};

/// Mean kinetic energy of a grain over that of 1 mm/s, 0.4 s after the cohesion has grown.
fn energy(step: f64) -> f64 {
    let (length, width, radius) = (0.2, 0.15, 0.012);
    let adhesion = Adhesion { pressure: 1e5, ..Adhesion::default() };
    let coefficients = Coefficients { kn: 1e6, gn: 60.0, ..Material::default().coefficients };
    let soil = Material { friction: 0.9, adhesion, coefficients, ..Material::default() };
    let setup = Setup {
        step,
        law: LawKind::PlainCoulomb,
        form: Form::Coefficients,
        materials: vec![soil],
        walls: Wall::open_box(length, width, 0, 0),
        ..Setup::default()
    };
    let (fill, radii) = (Fill::Count(300), Radii::Equal(radius));
    let grains = sample(&Sample { length, width, fill, radii, density: 2500.0, material: 0, seed: 1, spacing: 1.0 });
    let mut bed = CpuEngine::new(setup, &grains.unwrap(), 1).unwrap();
    let steps = |time: f64| (time / step).round() as u32;
    bed.scale_adhesion(0.0);
    bed.advance(steps(0.3), &mut []).unwrap();
    for k in 1..=25 {
        bed.scale_adhesion(f64::from(k) / 25.0);
        bed.advance(steps(0.004), &mut []).unwrap();
    }
    bed.advance(steps(0.4), &mut []).unwrap();
    // m v^2/2 of 1 mm/s.
    let mass = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * f64::powi(radius, 3);
    calm_energy(bed.state()) / (0.5 * mass * 1e-6)
}

#[test]
fn a_cohesive_bed_of_the_published_law_does_not_chatter_at_the_published_step() {
    let (published, fine) = (energy(4e-5), energy(5e-6));
    println!("energy of a grain at rest over that of 1 mm/s: {published:.3e}, with an eighth of the step {fine:.3e}");
    // The law creeps at any step; without the bound the published step gives 1.1e5, 0.3 m/s.
    assert!(published < 10.0 * fine && fine < 10.0, "{published} {fine}");
}
