//! Cohesion let in with offset overlaps: nothing moves, and it holds.

use fmu_terrain::dem::kernel::Partner;
use fmu_terrain::dem::{
    Adhesion, CpuEngine, Fill, Grain, GrainEngine, LawKind, Material, Onset, Precision, Radii, Recipe, Sample, Settle,
    Setup, Wall, prepare, vec3,
};

const RADIUS: f64 = 0.012;

fn recipe(onset: Onset) -> Recipe {
    let sample = Sample {
        length: 0.2,
        width: 0.15,
        fill: Fill::Depth(0.1),
        radii: Radii::Uniform(0.01, RADIUS),
        density: 2500.0,
        material: 0,
        seed: 2,
        spacing: 1.05,
    };
    Recipe { cohesion: onset, ..Recipe::new(sample, Settle::default(), 0.1) }
}

fn setup(law: LawKind, precision: Precision) -> Setup {
    let soil = Material {
        young_modulus: 2e7,
        rolling_friction: 0.1,
        spinning_friction: 0.05,
        adhesion: Adhesion { pressure: 1e5, ..Adhesion::default() },
        ..Material::default()
    };
    let walls = Wall::open_box(0.2, 0.15, 0, 0);
    Setup { materials: vec![soil], walls, step: 5e-5, expected_overlap: 0.1, law, precision, ..Setup::default() }
}

fn places(engine: &CpuEngine) -> Vec<[f64; 3]> {
    let rows = &engine.state().rows;
    engine.state().by_id().iter().map(|&i| [rows[i as usize][0], rows[i as usize][1], rows[i as usize][2]]).collect()
}

fn moved(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().zip(b).map(|(&a, &b)| vec3::norm(vec3::sub(a, b))).fold(0.0, f64::max)
}

/// A settled bed without cohesion, on an engine that has it.
fn cohesive(law: LawKind, precision: Precision) -> CpuEngine {
    let with = setup(law, precision);
    let bare = Material { adhesion: Adhesion::default(), ..with.materials[0] };
    let recipe = Recipe { settle: Settle { energy: 1e-7, ..Settle::default() }, ..recipe(Onset::Offset) };
    let (bed, _) = prepare(Setup { materials: vec![bare], ..with.clone() }, &recipe, 1, &mut |_, _| true).unwrap();
    CpuEngine::with_state(with, bed.state().clone(), 1).unwrap()
}

/// What all contacts together do to each grain (N), by grain number.
fn net(engine: &CpuEngine) -> Vec<[f64; 3]> {
    let state = engine.state();
    let mut force = vec![[0.0; 3]; state.rows.len()];
    engine.observe(&[], &mut |i, partner, c| {
        force[state.ids[i] as usize] = vec3::add(force[state.ids[i] as usize], c.force);
        if let Partner::Grain(j) = partner {
            force[state.ids[j] as usize] = vec3::sub(force[state.ids[j] as usize], c.force);
        }
    });
    force
}

#[test]
fn no_force_changes_under_any_law_that_rests() {
    // Friction of plain_coulomb is no spring: no bed of it rests.
    for law in [LawKind::Hooke, LawKind::HertzMindlin, LawKind::Flores] {
        let mut engine = cohesive(law, Precision::Double);
        engine.scale_adhesion(0.0);
        let before = net(&engine);
        engine.scale_adhesion(1.0);
        let pulled = moved(&before, &net(&engine));
        engine.offset_overlaps().unwrap();
        // The bed is not quite at rest: dashpots grow stiffer with the springs.
        let change = moved(&before, &net(&engine));
        println!("{law:?}: the force on a grain changes by {change:.1e} N with offsets, {pulled:.1} N without");
        assert!(change < 0.01 * pulled && pulled > 10.0, "{law:?} {change} {pulled}");
    }
}

#[test]
fn nothing_moves_where_overlaps_are_offset_and_the_bed_contracts_where_cohesion_grows() {
    let change = |onset| {
        let setup = setup(LawKind::HertzMindlin, Precision::Double);
        prepare(setup, &recipe(onset), 1, &mut |_, _| true).unwrap().1.cohesion_change
    };
    let (offset, grown) = (change(Onset::Offset), change(Onset::Growth(0.1)));
    println!("the surface moves by {offset:.2e} m with offsets, {grown:.2e} m with growth");
    assert!(offset.abs() < 2e-6 && grown < -1e-3, "{offset} {grown}");
    // Grain by grain, on batch kernels, contact by contact, and in single precision.
    for (precision, reference) in [(Precision::Double, false), (Precision::Double, true), (Precision::Single, false)] {
        let mut engine = cohesive(LawKind::HertzMindlin, precision);
        let before = places(&engine);
        engine.offset_overlaps().unwrap();
        if reference {
            engine.use_reference_kernel();
        }
        engine.advance(4000, &mut []).unwrap();
        let (way, offset) = (moved(&before, &places(&engine)), engine.state().longest_offset);
        println!("{precision:?}, reference {reference}: longest way of a grain {way:.2e} m, offset {offset:.2e} m");
        assert!(way < 0.005 * RADIUS && offset > 0.05 * RADIUS, "{way} {offset}");
    }
}

/// 2.6 with an offset: pressed together at first, the pair is let go of and hangs by the adhesion alone.
#[test]
fn a_contact_with_an_offset_tears_at_its_adhesion() {
    let gap = |g: f64, precision: Precision| {
        let density = 1.0 / (4.0 / 3.0 * std::f64::consts::PI * 0.05_f64.powi(3));
        let material = Material { adhesion: Adhesion { constant: 10.0, ..Adhesion::default() }, ..Material::default() };
        let setup =
            Setup { materials: vec![material], gravity: [0.0, 0.0, 2.0], step: 2e-5, precision, ..Setup::default() };
        let upper = Grain { fixed: true, ..Grain::at([0.0, 0.0, 0.5], 0.05, density) };
        let lower = Grain::at([0.0, 0.0, 0.4], 0.05, density);
        let mut engine = CpuEngine::new(setup, &[upper, lower], 1).unwrap();
        engine.scale_adhesion(0.0);
        engine.advance(20_000, &mut []).unwrap();
        engine.scale_adhesion(1.0);
        engine.offset_overlaps().unwrap();
        engine.advance(5000, &mut []).unwrap();
        let pressed = engine.state().rows.iter().find(|r| r[7] > 0.0).unwrap()[2];
        // Slowly: what is let go of at once swings, and twice the weight tears it.
        for k in 0..=200 {
            engine.set_gravity([0.0, 0.0, 2.0 - (2.0 + g) * f64::from(k) / 200.0]);
            engine.advance(200, &mut []).unwrap();
        }
        engine.advance(20_000, &mut []).unwrap();
        let now = engine.state().rows.iter().find(|r| r[7] > 0.0).unwrap()[2];
        (0.4 - pressed, 0.4 - now)
    };
    for precision in [Precision::Double, Precision::Single] {
        let ((before, hangs), (_, falls)) = (gap(9.9, precision), gap(10.1, precision));
        println!(
            "VALIDATION|2.6 with offset overlaps, {precision:?}|falls at g 9.9 m/s2 (1 yes, 0 no)|1|0|{}|0",
            i32::from(hangs > 0.01)
        );
        println!(
            "VALIDATION|2.6 with offset overlaps, {precision:?}|falls at g 10.1 m/s2 (1 yes, 0 no)|1|1|{}|0",
            i32::from(falls > 0.01)
        );
        // Before: overlapping; hanging: apart, within the offset.
        assert!(before < 0.0 && hangs > 0.0 && hangs < 1e-3 && falls > 0.1, "{before} {hangs} {falls}");
    }
}

#[test]
fn states_with_offsets_go_on_bit_for_bit_on_other_threads() {
    let (mut one, _) =
        prepare(setup(LawKind::HertzMindlin, Precision::Double), &recipe(Onset::Offset), 1, &mut |_, _| true).unwrap();
    let mut three = CpuEngine::with_state(one.setup().clone(), one.state().clone(), 3).unwrap();
    one.set_gravity([6.0, 0.0, -9.81]);
    three.set_gravity([6.0, 0.0, -9.81]);
    for _ in 0..3 {
        one.advance(200, &mut []).unwrap();
        three.advance(200, &mut []).unwrap();
        assert_eq!(one.state().hash(), three.state().hash());
        three = CpuEngine::with_state(three.setup().clone(), three.state().clone(), 2).unwrap();
    }
}

#[test]
fn adhesion_that_presses_grains_into_each_other_is_refused_with_its_size() {
    let mut much = setup(LawKind::HertzMindlin, Precision::Double);
    much.materials[0].adhesion.pressure = 1e7;
    (much.step, much.expected_overlap) = (1e-5, 0.4);
    let e = prepare(much, &recipe(Onset::Offset), 1, &mut |_, _| true).map(|_| ()).unwrap_err().to_string();
    println!("{e}");
    assert!(e.contains("adhesion is") && e.contains("stiffer soil"), "{e}");
}
