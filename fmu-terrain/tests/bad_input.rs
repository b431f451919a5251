//! What a user may get wrong: told with what, where, given and allowed, and nothing runs.

use fmu_terrain::config::Terrain;
use fmu_terrain::dem::{Adhesion, CpuEngine, DemError, DemState, Grain, GrainEngine, Material, Setup, Solid, Wall};

const R: f64 = 0.012;

fn grain(x: f64, z: f64) -> Grain {
    Grain::at([x, 0.0, z], R, 2500.0)
}

fn made(setup: Setup, grains: &[Grain]) -> Result<(), DemError> {
    CpuEngine::new(Setup { walls: Wall::open_box(0.4, 0.2, 0, 0), ..setup }, grains, 1).map(|_| ())
}

#[test]
fn a_step_above_the_critical_one_names_the_contact_and_the_step_that_is_allowed() {
    let e = made(Setup { step: 1e-2, ..Setup::default() }, &[grain(0.0, 0.1)]).unwrap_err();
    assert!(matches!(e, DemError::StepTooLarge { step, critical, .. } if step == 1e-2 && critical < 1e-3), "{e}");
    assert!(e.to_string().contains("take a smaller step"), "{e}");
}

/// Adhesion presses grains together: contacts are stiffer there, and the critical step is shorter.
#[test]
fn adhesion_enters_the_critical_step() {
    let soil = |pressure: f64| {
        let adhesion = Adhesion { pressure, ..Adhesion::default() };
        Setup { materials: vec![Material { adhesion, ..Material::default() }], ..Setup::default() }
    };
    let critical = |pressure: f64| {
        let setup = Setup { step: 1.0, ..soil(pressure) };
        match made(setup, &[grain(0.0, 0.1)]).unwrap_err() {
            DemError::StepTooLarge { critical, overlap, .. } => (critical, overlap),
            e => panic!("{e}"),
        }
    };
    let (plain, light, strong) = (critical(0.0), critical(1e3), critical(4e5));
    assert_eq!(plain, light);
    // Hertz with a wall or between grains: the spring at that overlap carries the pull.
    let (e_star, pull) = (1e7 / (2.0 * 0.91), std::f64::consts::PI * R * R * 4e5);
    let carried = 4.0 / 3.0 * e_star * (0.5 * R * strong.1).sqrt() * strong.1;
    assert!((carried / pull - 1.0).abs() < 1e-6 || (carried / pull - 0.5_f64.sqrt()).abs() < 1e-6, "{carried} {pull}");
    assert!(strong.0 < 0.9 * plain.0, "{strong:?} {plain:?}");
    made(Setup { step: 0.99 * strong.0, ..soil(4e5) }, &[grain(0.0, 0.1)]).unwrap();
    made(Setup { step: 0.99 * plain.0, ..soil(4e5) }, &[grain(0.0, 0.1)]).unwrap_err();
}

#[test]
fn grains_that_overlap_at_the_start_are_named() {
    let e = made(Setup::default(), &[grain(0.0, 0.1), grain(0.1, 0.1), grain(0.11, 0.1)]).unwrap_err();
    assert!(matches!(e, DemError::Interpenetration { a: 1, b: 2, .. }), "{e}");
    assert!(e.to_string().contains("the grains were placed so"), "{e}");
}

#[test]
fn grains_outside_and_values_that_are_no_numbers_are_named() {
    let e = made(Setup::default(), &[grain(0.0, 0.1), grain(0.3, 0.1)]).unwrap_err();
    assert!(matches!(e, DemError::Escaped { id: 1, .. }), "{e}");
    let mut wrong = grain(0.1, 0.1);
    wrong.velocity[1] = f64::NAN;
    let e = made(Setup::default(), &[grain(0.0, 0.1), wrong]).unwrap_err();
    assert!(matches!(e, DemError::NotFinite { id: 1, .. }), "{e}");
    // In a run, too: the step after it went wrong, not some time later.
    let setup = Setup { walls: Wall::open_box(0.4, 0.2, 0, 0), ..Setup::default() };
    let mut state = DemState::of(&[grain(0.0, 0.1), grain(0.1, 0.1)], 5);
    state.rows[1][4] = f64::NAN;
    let mut engine = CpuEngine::with_state(setup, state, 1).unwrap();
    assert!(matches!(engine.advance(2, &mut []).unwrap_err(), DemError::NotFinite { id: 1, .. }));
}

#[test]
fn an_obstacle_with_a_hole_or_a_facet_without_area_is_refused() {
    let whole = Solid::Box([0.2, 0.3, 0.4]).to_mesh();
    Solid::mesh(whole.clone()).unwrap();
    let mut open = whole.clone();
    open.triangles.pop();
    let e = Solid::mesh(open).unwrap_err().to_string();
    println!("{e}");
    assert!(e.contains("mesh is faulty"), "{e}");
    let mut flat = whole;
    flat.triangles[0][2] = flat.triangles[0][1];
    let e = Solid::mesh(flat).unwrap_err().to_string();
    println!("{e}");
    assert!(e.contains("mesh is faulty"), "{e}");
}

#[test]
fn faults_of_tiles_sleep_and_output_are_told_at_once() {
    let text = r#"{"bed": {"tile": 0.01, "follow": 5}, "dem_p": {"sleep": {"distance": 0.001, "energy": 0}},
        "output": {"low": [0, 0, 0], "high": [1, 0, 1]}}"#;
    let e = serde_json::from_str::<Terrain>(text).unwrap().check("test").unwrap_err().to_string();
    for path in ["bed.tile", "bed.follow", "dem_p.sleep.distance", "dem_p.sleep.energy", "output"] {
        assert!(e.contains(path), "{path} not in {e}");
    }
    let e = serde_json::from_str::<Terrain>(r#"{"bed": {"follow": 0.1}}"#).unwrap().check("test").unwrap_err();
    assert!(e.to_string().contains("only together with bed.tile"), "{e}");
    let lone = Setup { period: Some(0.02), ..Setup::default() };
    let e = made(lone, &[grain(0.0, 0.1)]).unwrap_err().to_string();
    assert!(e.contains("period is 0.02"), "{e}");
}
