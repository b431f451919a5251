//! Validation section 3: complementarity contact.

#[path = "common/checks.rs"]
mod checks;
#[path = "common/surfaces.rs"]
mod surfaces;

use checks::{below, figure, relative};
use fmu_terrain::dem::grains::{INV_I, INV_M};
use fmu_terrain::dem::material::Adhesion;
use fmu_terrain::dem::{
    Body, Cylinder, Fill, FreeBody, Grain, GrainEngine, MassOf, Material, Radii, Recipe, Sample, Settle, Setup, Solid,
    Wall, prepare, sample, settle,
};
use fmu_terrain::dem_c::{ConeEngine, ConeSetup, ConeState};
use fmu_terrain::mesh::{MeshBody, MeshShape};
use terramech_mechanics::RigidState;

const G: f64 = 9.81;

fn plane(material: Material, angle: f64, step: f64) -> Setup {
    let (s, c) = angle.sin_cos();
    Setup {
        step,
        gravity: [G * s, 0.0, -G * c],
        materials: vec![material],
        walls: vec![Wall { point: [0.0; 3], normal: [0.0, 0.0, 1.0], material: 0 }],
        ..Setup::default()
    }
}

/// Rigid contacts: what the closed forms are for.
fn tight() -> ConeSetup {
    ConeSetup { elastic: false, tolerance: 1e-8, iterations: 2000, ..ConeSetup::default() }
}

/// A ball that cannot turn: a block.
fn block(setup: Setup, v0: f64) -> ConeEngine {
    let ball = Grain { velocity: [v0, 0.0, 0.0], ..Grain::at([0.0, 0.0, 0.1], 0.1, 250.0) };
    let mut engine = ConeEngine::new(setup, tight(), &[ball], 1).unwrap();
    let mut state = engine.state().clone();
    state.rows[0][INV_I] = 0.0;
    engine.restore(state);
    engine
}

fn rough(friction: f64) -> Material {
    Material { friction, restitution: 0.0, rolling_friction: 0.0, spinning_friction: 0.0, ..Material::default() }
}

#[test]
fn case_3_1_a_block_holds_up_to_the_angle_of_friction() {
    let mu: f64 = 0.5;
    for (angle, holds) in [(0.99 * mu.atan(), true), (1.1 * mu.atan(), false)] {
        let mut engine = block(plane(rough(mu), angle, 1e-3), 0.0);
        engine.advance(1000, &mut []).unwrap();
        let v = engine.state().rows[0][4];
        if holds {
            below("3.1 below the angle", "speed after 1 s", "m/s", v.abs(), 1e-6);
        } else {
            let expected = G * (angle.sin() - mu * angle.cos());
            relative("3.1 above the angle", "speed after 1 s", "m/s", expected, v, 0.01);
        }
    }
}

#[test]
fn case_3_1_a_sliding_block_stops_after_its_way() {
    let mut engine = block(plane(rough(0.5), 0.0, 1e-3), 5.0);
    let mut lift = 0.0_f64;
    for _ in 0..1500 {
        engine.advance(1, &mut []).unwrap();
        lift = lift.max(engine.state().rows[0][2] - 0.1);
    }
    let row = engine.state().rows[0];
    relative("3.1 sliding", "way", "m", 2.548, row[0], 0.01);
    below("3.1 sliding", "speed at the end", "m/s", row[4].abs(), 1e-6);
    // The relaxation lifts it by mu v h at most.
    below("3.1 sliding", "lift", "m", lift, 0.5 * 5.0 * 1e-3);
}

#[test]
fn case_3_2_sliding_turns_to_rolling() {
    let ball = Grain { velocity: [1.0, 0.0, 0.0], ..Grain::at([0.0, 0.0, 0.05], 0.05, 1000.0) };
    let mut engine = ConeEngine::new(plane(rough(0.3), 0.0, 1e-3), tight(), &[ball], 1).unwrap();
    engine.advance(300, &mut []).unwrap();
    let row = engine.state().rows[0];
    relative("3.2", "speed once it rolls", "m/s", 5.0 / 7.0, row[4], 0.01);
    relative("3.2", "angular speed x radius", "m/s", 5.0 / 7.0, row[9] * 0.05, 0.01);
}

#[test]
fn case_3_3_cohesion_holds_what_it_can_carry() {
    let fixed = Grain { fixed: true, ..Grain::at([0.0, 0.0, 1.0], 0.05, 1000.0) };
    let ball = Grain::at([0.0, 0.0, 0.9], 0.05, 1000.0);
    let weight = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.05_f64.powi(3) * G;
    for (factor, holds) in [(1.01, true), (0.99, false)] {
        let adhesion = Adhesion { constant: factor * weight, ..Adhesion::default() };
        let material = Material { adhesion, ..rough(0.5) };
        let setup = Setup { walls: vec![], ..plane(material, 0.0, 1e-3) };
        let mut engine = ConeEngine::new(setup, tight(), &[fixed, ball], 1).unwrap();
        engine.advance(1000, &mut []).unwrap();
        let z = engine.state().rows.iter().map(|r| r[2]).fold(f64::INFINITY, f64::min);
        if holds {
            figure("3.3 c = 1.01 m g", "place after 1 s", "m", 0.9, z, 1e-6);
        } else {
            assert!(z < 0.5, "it hangs by {factor} of its weight: {z}");
        }
    }
}

fn sand(count: usize) -> (Setup, Vec<Grain>, Sample) {
    let soil = Material {
        friction: 0.5,
        restitution: 0.0,
        rolling_friction: 0.1,
        spinning_friction: 0.05,
        ..Material::default()
    };
    let s = Sample {
        length: 0.12,
        width: 0.12,
        radii: Radii::Uniform(0.005, 0.007),
        fill: Fill::Count(count),
        density: 2500.0,
        material: 0,
        seed: 1,
        spacing: 1.1,
    };
    let setup = Setup {
        step: 1e-3,
        materials: vec![soil, soil],
        walls: Wall::open_box(s.length, s.width, 0, 0),
        ..Setup::default()
    };
    let grains = sample(&s).unwrap();
    (setup, grains, s)
}

#[test]
fn case_3_5_a_bed_at_rest_weighs_what_it_weighs() {
    let (setup, grains, _) = sand(400);
    let cone = ConeSetup { tolerance: 1e-4, iterations: 500, ..ConeSetup::default() };
    let mut engine = ConeEngine::new(setup, cone, &grains, 1).unwrap();
    let until = Settle { most_time: 3.0, ..Settle::default() };
    let settled = settle(&mut engine, &until, "settling", &mut |_, _| true).unwrap();
    engine.advance(50, &mut []).unwrap();
    // Friction on the sides carries its part. Single steps carry the residual's noise, the mean does not.
    let (mut up, mut across) = (0.0, 0.0);
    for _ in 0..100 {
        engine.advance(1, &mut []).unwrap();
        up -= engine.state().wall_force.iter().map(|f| f[2]).sum::<f64>() / 100.0;
        across += engine.state().wall_force.iter().map(|f| f[0]).sum::<f64>() / 100.0;
    }
    let state = engine.state();
    let weight = state.mass() * G;
    relative("3.5", "vertical force on the box over the weight", "1", 1.0, up / weight, 1e-3);
    below("3.5", "horizontal force on the box over the weight", "1", across.abs() / weight, 1e-3);
    let speed = |r: &fmu_terrain::dem::grains::Row| (r[4] * r[4] + r[5] * r[5] + r[6] * r[6]).sqrt();
    let fastest = state.rows.iter().map(speed).fold(0.0, f64::max);
    println!(
        "settled in {} s, fastest grain {fastest:e} m/s, {:.1} iterations a step",
        settled.time,
        engine.mean_iterations()
    );
}

#[test]
fn no_thread_count_changes_a_bit() {
    let run = |threads: usize| {
        let (setup, grains, _) = sand(2500);
        let cone = ConeSetup { iterations: 20, ..ConeSetup::default() };
        let mut engine = ConeEngine::new(setup, cone, &grains, threads).unwrap();
        engine.advance(100, &mut []).unwrap();
        let top = engine.state().rows.iter().map(|r| r[2] + r[3]).fold(0.0, f64::max);
        let wheel =
            Cylinder::new(0.04, 0.03, [0.0, 0.0, top + 0.035], [0.0, 1.0, 0.0], [0.1, 0.0, -2.0], [0.0, 3.0, 0.0]);
        let mut bodies = [Body::new(Box::new(wheel), 1)];
        engine.advance(40, &mut bodies).unwrap();
        (engine.state().hash(), bodies[0].impulse, engine.cone_state())
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(3));
    assert!(one.1[2] > 0.0, "the wheel sinks into the bed: {:?}", one.1);
}

#[test]
fn a_bed_that_a_wheel_drives_through_takes_few_sweeps() {
    let (setup, grains, _) = sand(800);
    let mut engine = ConeEngine::new(setup, ConeSetup::default(), &grains, 1).unwrap();
    settle(&mut engine, &Settle { most_time: 3.0, ..Settle::default() }, "settling", &mut |_, _| true).unwrap();
    let top = engine.state().rows.iter().map(|r| r[2] + r[3]).fold(0.0, f64::max);
    let mut sweeps = 0.0;
    for k in 0..60 {
        // Pressed in by 12 mm, then driven at slip 1/3.
        let [down, along, spin] = if k < 40 { [-0.3, 0.0, 0.0] } else { [0.0, 0.5, 0.75 / 0.04] };
        let z = top + 0.04 - 3e-4 * f64::from(k.min(40));
        let x = 5e-4 * f64::from((k - 40).max(0)) - 0.01;
        let wheel = Cylinder::new(0.04, 0.03, [x, 0.0, z], [0.0, 1.0, 0.0], [along, 0.0, down], [0.0, spin, 0.0]);
        engine.advance(1, &mut [Body::new(Box::new(wheel), 1)]).unwrap();
        let outcome = engine.report().outcome;
        assert!(outcome.converged && outcome.residual <= 1e-3, "step {k}: {outcome:?}");
        sweeps += f64::from(outcome.iterations) / 60.0;
    }
    println!("{sweeps:.1} sweeps a step");
    assert!(sweeps < 30.0, "{sweeps} sweeps a step");
}

#[test]
fn a_restored_state_goes_on_bit_for_bit() {
    let (setup, grains, _) = sand(400);
    let mut engine = ConeEngine::new(setup.clone(), ConeSetup::default(), &grains, 1).unwrap();
    engine.advance(100, &mut []).unwrap();
    let (state, own) = (engine.state().clone(), engine.cone_state());
    engine.advance(30, &mut []).unwrap();
    let mut other = ConeEngine::with_state(setup, ConeSetup::default(), state, own, 1).unwrap();
    other.advance(30, &mut []).unwrap();
    assert_eq!(engine.state().hash(), other.state().hash());
}

#[test]
fn the_settled_bed_of_dem_p_starts_dem_c() {
    let (setup, _, s) = sand(500);
    let recipe = Recipe::new(s.clone(), Settle::default(), 0.1);
    let soft = Setup { step: 4e-5, ..setup.clone() };
    let (bed, _) = prepare(soft, &recipe, 1, &mut |_, _| true).unwrap();
    let height = |rows: &[fmu_terrain::dem::grains::Row]| rows.iter().map(|r| r[2]).sum::<f64>() / rows.len() as f64;
    let before = height(&bed.state().rows);
    let cone = ConeSetup { tolerance: 1e-4, ..ConeSetup::default() };
    let mut engine = ConeEngine::with_state(setup, cone, bed.state().clone(), ConeState::default(), 1).unwrap();
    engine.advance(300, &mut []).unwrap();
    let after = height(&engine.state().rows);
    // Soft grains overlap: undone, the bed rises a little. It neither jumps nor collapses.
    assert!(after - before > -5e-5 && after - before < 5e-4, "the bed moved by {:e} m", after - before);
    assert!(engine.state().rows.iter().all(|r| r[INV_M] > 0.0));
}

#[test]
fn an_obstacle_on_sand_weighs_what_it_weighs() {
    let (setup, grains, _) = sand(400);
    let mut engine = ConeEngine::new(setup, ConeSetup::default(), &grains, 1).unwrap();
    settle(&mut engine, &Settle { most_time: 3.0, ..Settle::default() }, "settling", &mut |_, _| true).unwrap();
    let top = engine.state().rows.iter().map(|r| r[2] + r[3]).fold(0.0, f64::max);
    let (mass, z) = (0.5, top + 0.031);
    let state = RigidState { position: [0.0, 0.0, z].into(), ..RigidState::default() };
    let free = FreeBody::new(Solid::Box([0.06, 0.06, 0.06]), MassOf::Mass(mass), state, false).unwrap();
    let mut bodies = [Body::new(Box::new(free), 0)];
    engine.advance(800, &mut bodies).unwrap();
    let mut up = 0.0;
    for _ in 0..200 {
        engine.advance(1, &mut bodies).unwrap();
        up += bodies[0].force[2] / 200.0;
    }
    relative("3.5 obstacle", "force of the sand on a box over its weight", "1", 1.0, up / (mass * G), 0.02);
    let now = bodies[0].shape.as_free().unwrap().now.state;
    assert!(now.velocity.norm() < 0.01 && now.position[2] > 0.5 * top && now.position[2] < z, "{now:?}");
    // One as light as the grains would be thrown about.
    let light = FreeBody::new(Solid::Sphere(0.006), MassOf::Mass(0.003), state, false).unwrap();
    let e = engine.advance(1, &mut [Body::new(Box::new(light), 0)]).unwrap_err().to_string();
    assert!(e.contains("mass of an obstacle") && e.contains("20 times"), "{e}");
}

#[test]
fn elastic_contacts_hold_slide_and_roll_as_rigid_ones_do() {
    let elastic = ConeSetup { elastic: true, ..tight() };
    let mu: f64 = 0.5;
    for (angle, holds) in [(0.99 * mu.atan(), true), (1.1 * mu.atan(), false)] {
        let mut engine = block(plane(rough(mu), angle, 1e-3), 0.0);
        let state = engine.state().clone();
        engine = ConeEngine::with_state(engine.setup().clone(), elastic, state, ConeState::default(), 1).unwrap();
        engine.advance(1000, &mut []).unwrap();
        let v = engine.state().rows[0][4];
        if holds {
            below("3.1 elastic, below the angle", "speed after 1 s", "m/s", v.abs(), 1e-6);
        } else {
            let expected = G * (angle.sin() - mu * angle.cos());
            relative("3.1 elastic, above the angle", "speed after 1 s", "m/s", expected, v, 0.01);
        }
    }
    let ball = Grain { velocity: [1.0, 0.0, 0.0], ..Grain::at([0.0, 0.0, 0.05], 0.05, 1000.0) };
    let mut engine = ConeEngine::new(plane(rough(0.3), 0.0, 1e-3), elastic, &[ball], 1).unwrap();
    engine.advance(300, &mut []).unwrap();
    relative("3.2 elastic", "speed once it rolls", "m/s", 5.0 / 7.0, engine.state().rows[0][4], 0.01);
}

#[test]
fn a_fold_of_a_mesh_is_no_stiffer_than_a_plane() {
    // Two touches of one surface once had a spring each.
    let soil = rough(0.5);
    let sink = |walls: Vec<Wall>, bodies: &mut [Body]| {
        let setup = Setup { step: 1e-3, materials: vec![soil], walls, ..Setup::default() };
        let cone = ConeSetup { tolerance: 1e-9, iterations: 1000, ..ConeSetup::default() };
        let grain = Grain::at([0.0, 0.0037, 0.01], 0.01, 2500.0);
        let mut engine = ConeEngine::new(setup, cone, &[grain], 1).unwrap();
        engine.advance(600, bodies).unwrap();
        0.01 - engine.state().rows[0][2]
    };
    let plane = sink(vec![Wall { point: [0.0; 3], normal: [0.0, 0.0, 1.0], material: 0 }], &mut []);
    assert!(plane > 1e-6, "{plane}");
    for degrees in [0.0_f64, 0.2] {
        let mesh = MeshShape::new(MeshBody::deforming(&surfaces::folded(degrees.to_radians())).unwrap());
        let fold = sink(vec![], &mut [Body::new(Box::new(mesh), 0)]);
        relative("3.5 mesh", &format!("overlap of a grain in a fold of {degrees} deg"), "m", plane, fold, 0.05);
    }
}

#[test]
fn a_grain_without_mass_and_one_that_is_no_number_are_named() {
    let (setup, grains, _) = sand(10);
    let with = |change: fn(&mut fmu_terrain::dem::grains::Row), friction: f64| {
        let mut state = fmu_terrain::dem::DemState::of(&grains, setup.walls.len());
        change(&mut state.rows[3]);
        let materials = setup.materials.iter().map(|m| Material { friction, ..*m }).collect();
        let setup = Setup { materials, ..setup.clone() };
        ConeEngine::with_state(setup, ConeSetup::default(), state, ConeState::default(), 1).err().map(|e| e.to_string())
    };
    assert_eq!(with(|_| (), 0.5), None);
    let e = with(|r| r[INV_M] = f64::INFINITY, 0.5).unwrap();
    assert!(e.contains("grain") && e.contains("mass greater than 0"), "{e}");
    let e = with(|r| r[4] = f64::NAN, 0.5).unwrap();
    assert!(e.contains("grain"), "{e}");
    let e = with(|_| (), -0.5).unwrap();
    assert!(e.contains("friction") && e.contains("-0.5"), "{e}");
}

#[test]
fn wrong_settings_and_steps_are_told() {
    let (setup, grains, _) = sand(10);
    let fails = |setup: Setup, cone: ConeSetup| ConeEngine::new(setup, cone, &grains, 1).err().unwrap().to_string();
    assert!(fails(setup.clone(), ConeSetup { tolerance: -1.0, ..ConeSetup::default() }).contains("tolerance"));
    assert!(fails(setup.clone(), ConeSetup { iterations: 0, ..ConeSetup::default() }).contains("iterations"));
    assert!(fails(Setup { step: f64::NAN, ..setup.clone() }, ConeSetup::default()).contains("step"));
    let fast: Vec<Grain> = grains.iter().map(|g| Grain { velocity: [0.0, 0.0, 60.0], ..*g }).collect();
    let mut engine = ConeEngine::new(setup, ConeSetup::default(), &fast, 1).unwrap();
    let e = engine.advance(20, &mut []).unwrap_err().to_string();
    assert!(e.contains("half its radius"), "{e}");
}
