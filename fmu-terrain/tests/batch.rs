//! The batch kernels against the loop over single contacts: every instruction path of this machine, every switch they know.

use fmu_terrain::dem::{
    Adhesion, CpuEngine, DemState, Fill, GrainEngine, Material, Precision, Radii, Sample, Setup, Wall, sample,
};
use terramech_simd::Isa;

/// A bed that falls, rolls and slides: one or two materials in it, with or without rolling resistance and adhesion; with it, overlaps may
/// count from offsets.
fn bed(materials: usize, rolling: bool, adhesion: bool, offsets: bool) -> (Setup, DemState) {
    let (length, width) = (0.3, 0.2);
    let soil = Material {
        rolling_friction: if rolling { 0.1 } else { 0.0 },
        spinning_friction: if rolling { 0.05 } else { 0.0 },
        adhesion: if adhesion {
            Adhesion { constant: 1e-3, dmt: 1e-2, perko: 0.1, pressure: 1e3 }
        } else {
            Adhesion::default()
        },
        ..Material::default()
    };
    let other = Material { young_modulus: 3e6, friction: 0.3, restitution: 0.6, ..soil };
    let setup = Setup {
        materials: [soil, other][..materials].to_vec(),
        walls: Wall::open_box(length, width, 0, 0),
        adhesion_time: 1e-3,
        adhesion_overlap: 1e-6,
        ..Setup::default()
    };
    let fill = Fill::Count(1500);
    let radii = Radii::Uniform(0.008, 0.012);
    let mut grains =
        sample(&Sample { length, width, fill, radii, density: 2500.0, material: 0, seed: 3, spacing: 1.0 }).unwrap();
    for (k, g) in grains.iter_mut().enumerate() {
        g.material = k % materials;
        g.fixed = k % 97 == 0;
        g.angular_velocity = [1.0, -2.0, 0.5];
    }
    let mut engine = CpuEngine::new(setup.clone(), &grains, 1).unwrap();
    engine.set_isa(Isa::Portable).unwrap();
    engine.advance(4000, &mut []).unwrap();
    if offsets {
        engine.offset_overlaps().unwrap();
        // Some contacts are apart by then, held within their offsets.
        engine.advance(200, &mut []).unwrap();
    }
    (setup, engine.state().clone())
}

/// The state one step later, on a path; none: contact by contact, the reference.
fn after(setup: &Setup, state: &DemState, isa: Option<Isa>) -> DemState {
    let mut engine = CpuEngine::with_state(setup.clone(), state.clone(), 1).unwrap();
    match isa {
        Some(isa) => engine.set_isa(isa).unwrap(),
        None => engine.use_reference_kernel(),
    }
    engine.rebuild_now().unwrap();
    engine.advance(1, &mut []).unwrap();
    engine.state().clone()
}

/// Largest difference relative to the largest value.
fn difference<'a>(a: impl Iterator<Item = &'a f64>, b: impl Iterator<Item = &'a f64>) -> f64 {
    let (mut size, mut worst) = (0.0_f64, 0.0_f64);
    for (x, y) in a.zip(b) {
        size = size.max(x.abs());
        worst = worst.max((x - y).abs());
    }
    worst / size.max(f64::MIN_POSITIVE)
}

#[test]
fn every_path_is_the_reference_to_round_off_and_in_single_precision_to_a_millionth() {
    for (materials, rolling, adhesion, offsets) in [
        (1, false, false, false),
        (2, false, false, false),
        (1, true, false, false),
        (1, false, true, false),
        (2, true, true, false),
        (1, false, true, true),
        (2, true, true, true),
    ] {
        let (setup, state) = bed(materials, rolling, adhesion, offsets);
        let a = after(&setup, &state, None);
        assert!(a.grain_contacts() > 800, "{}", a.grain_contacts());
        for isa in Isa::ALL.into_iter().filter(|i| i.runs_here()) {
            // Products contracted and divisions merged: some tens of roundings, and overlaps lose 3 digits of the positions.
            for (precision, tolerance) in [(Precision::Double, 1e-12), (Precision::Single, 1e-6)] {
                let b = after(&Setup { precision, ..setup.clone() }, &state, Some(isa));
                let worst = worst(&a, &b);
                println!(
                    "{isa}, {precision:?}, {materials} materials, rolling {rolling}, adhesion {adhesion}, offsets {offsets}: {worst:?}"
                );
                assert!(worst.iter().all(|w| *w < tolerance), "{isa}: {worst:?}");
            }
        }
    }
}

/// Differences of forces, velocities, angular velocities, displacements, growth of adhesion, rotations.
fn worst(a: &DemState, b: &DemState) -> [f64; 6] {
    assert_eq!(a.grain_contacts(), b.grain_contacts());
    let slips = |s: &DemState| s.slabs.iter().flat_map(|s| s.slip.iter().flat_map(|s| s.0)).collect::<Vec<f64>>();
    let rolls = |s: &DemState| s.slabs.iter().flat_map(|s| s.roll.clone()).flatten().collect::<Vec<_>>();
    // Displacements apart from the growth of adhesion, which is of another size.
    let moved = |v: Vec<f64>| v.chunks(4).flat_map(|c| c[..3].to_vec()).collect::<Vec<_>>();
    let grown = |v: Vec<f64>| v.chunks(4).map(|c| c[3]).collect::<Vec<_>>();
    [
        difference(a.force.iter().flatten(), b.force.iter().flatten()),
        difference(a.rows.iter().flat_map(|r| &r[4..7]), b.rows.iter().flat_map(|r| &r[4..7])),
        difference(a.rows.iter().flat_map(|r| &r[8..11]), b.rows.iter().flat_map(|r| &r[8..11])),
        difference(moved(slips(a)).iter(), moved(slips(b)).iter()),
        difference(grown(slips(a)).iter(), grown(slips(b)).iter()),
        difference(rolls(a).iter(), rolls(b).iter()),
    ]
}

#[test]
fn a_path_that_is_not_here_is_refused() {
    let (setup, state) = bed(1, false, false, false);
    let mut engine = CpuEngine::with_state(setup, state, 1).unwrap();
    if let Some(missing) = Isa::ALL.into_iter().find(|i| !i.runs_here()) {
        let message = engine.set_isa(missing).unwrap_err().to_string();
        assert!(message.contains(missing.name()), "{message}");
    }
}
