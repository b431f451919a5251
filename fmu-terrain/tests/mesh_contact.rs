//! Validation cases 2.9 and 9.2 through the engine: a plate of triangles is the plane, folds are smooth, histories survive
//! edges, and what the grains lose the vertices get.

#[path = "common/checks.rs"]
mod checks;
#[path = "common/surfaces.rs"]
mod surfaces;

use checks::below;
use fmu_terrain::dem::grains::{INV_I, INV_M, V, W, vec_at};
use fmu_terrain::dem::vec3::{Vec3, add, add_scaled, cross, norm, scale, sub};
use fmu_terrain::dem::{Adhesion, Body, CpuEngine, DemState, Grain, GrainEngine, Material, Setup, Wall};
use fmu_terrain::mesh::{MeshBody, MeshShape};
use surfaces::{Noise, folded, sheet};
use terramech_mechanics::{RigidState, TriangleMesh, cylinder::Cylinder, cylinder::Grousers};

const R: f64 = 0.01;

fn plate() -> TriangleMesh {
    let mesh = sheet(20, 30, |s, t| [0.4 * s, 0.6 * t, 0.0]);
    assert_eq!(mesh.triangles.len(), 1200);
    mesh
}

fn body(mesh: &TriangleMesh) -> Body {
    Body::new(Box::new(MeshShape::new(MeshBody::deforming(mesh).unwrap())), 0)
}

fn soil() -> Material {
    Material { restitution: 0.6, friction: 0.3, rolling_friction: 0.05, spinning_friction: 0.05, ..Material::default() }
}

/// Grain row of a lone grain after so many steps over a wall or a body.
fn fly(grain: Grain, material: Material, bodies: &mut [Body], wall: bool, steps: u32, gravity: Vec3) -> DemState {
    let floor = Wall { point: [0.0; 3], normal: [0.0, 0.0, 1.0], material: 0 };
    let walls = if wall { vec![floor] } else { vec![] };
    let setup = Setup { step: 2e-5, gravity, materials: vec![material], walls, ..Setup::default() };
    let mut engine = CpuEngine::new(setup, &[grain], 1).unwrap();
    engine.advance(steps, bodies).unwrap();
    engine.state().clone()
}

/// The largest difference: of places (m), speeds (m/s), and angular velocities (rad/s) times the radius.
fn same(what: &str, a: &DemState, b: &DemState, tolerance: f64) -> f64 {
    let mut worst = 0.0_f64;
    for k in 0..11 {
        let size = [1.0, 1.0, 1.0 / R][k / 4];
        let error = (a.rows[0][k] - b.rows[0][k]).abs();
        assert!(error <= tolerance * size, "{what}, entry {k}: {} and {}", a.rows[0][k], b.rows[0][k]);
        worst = worst.max(error / size);
    }
    worst
}

#[test]
fn case_2_9_the_same_rebound_from_plane_and_mesh() {
    let mut noise = Noise(21);
    let mut worst = 0.0_f64;
    // Cells are 40 mm: a vertex, an edge, a diagonal (both ways), a face, and just beside each.
    for (x, y) in [(0.0, 0.0), (0.02, 0.0), (0.0, 0.013), (0.02, 0.02), (0.06, 0.02), (0.013, 0.005)] {
        for off in [0.0, 1e-10, 1e-6] {
            // Straight down, and obliquely with spin.
            for slant in [0.0, 1.0] {
                let grain = Grain {
                    velocity: [0.3 * slant, -0.2 * slant, -1.0],
                    angular_velocity: scale(20.0 * slant, noise.vector()),
                    ..Grain::at([x + off, y - off, R + 1e-4], R, 2500.0)
                };
                let plane = fly(grain, soil(), &mut [], true, 500, [0.0; 3]);
                let mesh = fly(grain, soil(), &mut [body(&plate())], false, 500, [0.0; 3]);
                assert!(plane.rows[0][V + 2] > 0.5, "it rebounds");
                worst = worst.max(same(&format!("({x}, {y}) + {off}, slant {slant}"), &plane, &mesh, 1e-9));
            }
        }
    }
    below("2.9 rebound on faces, edges, vertices", "largest difference of plane and mesh", "m, m/s", worst, 1e-9);
}

#[test]
fn case_2_9_a_grain_that_slides_and_rolls_across_edges_keeps_its_history() {
    let g = [0.0, 0.0, -9.81];
    // Where a grain of this stiffness rests: found by letting one settle.
    let at = |x: Vec3| Grain::at(x, R, 2500.0);
    let rest = fly(at([0.1, 0.1, R - 1e-6]), soil(), &mut [], true, 20_000, g).rows[0][2];
    // Slides, then rolls, across some 5 edges; and rests on an incline (gravity tilted) on a vertex.
    let slide = Grain { velocity: [0.8, 0.31, 0.0], ..at([-0.15, -0.07, rest]) };
    let tilted = [1.9, 0.9, -9.5];
    let sticky = Material { rolling_friction: 0.3, ..soil() };
    for (what, grain, material, gravity, steps) in [
        ("slide", slide, soil(), g, 16_000),
        ("rest on a vertex", at([0.0, 0.0, rest]), sticky, tilted, 8_000),
        ("rest on an edge", at([0.02, 0.0, rest]), sticky, tilted, 8_000),
    ] {
        let plane = fly(grain, material, &mut [], true, steps, gravity);
        let mesh = fly(grain, material, &mut [body(&plate())], false, steps, gravity);
        let worst = same(what, &plane, &mesh, 1e-6);
        below(&format!("2.9 {what}"), "largest difference of plane and mesh", "m, m/s", worst, 1e-6);
        let moved = norm(sub(vec_at(&mesh.rows[0], 0), grain.position));
        assert!(if what == "slide" { moved > 0.15 } else { moved < 1e-4 }, "{what}: moved {moved}");
    }
}

#[test]
fn case_2_9_a_belt_of_triangles_carries_a_grain_and_feels_its_friction() {
    let g = [0.0, 0.0, -9.81];
    let grain = Grain::at([0.0, 0.0, R - 1e-6], R, 2500.0);
    let sticky = Material { rolling_friction: 0.5, ..soil() };
    let mut bodies = [body(&plate())];
    let n = bodies[0].shape.vertices();
    let positions: Vec<f64> = bodies[0].shape.positions().concat();
    let velocity: Vec<f64> = [0.2, 0.1, 0.0].repeat(n);
    bodies[0].shape.as_mesh().unwrap().update(|b| b.set_vertices(&positions, &velocity)).unwrap();
    let state = fly(grain, sticky, &mut bodies, false, 20_000, g);
    // It slips at first, then moves with the belt, across four edges, without rolling.
    assert!((state.rows[0][V] - 0.2).abs() < 1e-6 && (state.rows[0][V + 1] - 0.1).abs() < 1e-6);
    assert!(norm(vec_at(&state.rows[0], W)) < 1e-4);
    let m = 1.0 / state.rows[0][INV_M];
    let impulse = bodies[0].impulse;
    assert!((impulse[0] + 0.2 * m).abs() < 1e-6 * m && (impulse[1] + 0.1 * m).abs() < 1e-6 * m);
}

#[test]
fn adhesion_of_a_mesh_is_that_of_the_plane_on_edges_and_vertices() {
    let adhesion = Adhesion { constant: 0.05, ..Adhesion::default() };
    let material = Material { adhesion, ..soil() };
    // Its weight is 0.10 N: it rests, pressed by weight and adhesion, with gravity slanted.
    for (x, y) in [(0.0, 0.0), (0.02, 0.0), (0.02, 0.02), (1e-5, 1e-6)] {
        let grain = Grain { velocity: [0.05, 0.02, 0.0], ..Grain::at([x, y, R - 1e-6], R, 2500.0) };
        let plane = fly(grain, material, &mut [], true, 4000, [3.0, 0.0, -9.0]);
        let mesh = fly(grain, material, &mut [body(&plate())], false, 4000, [3.0, 0.0, -9.0]);
        same(&format!("({x}, {y})"), &plane, &mesh, 1e-7);
    }
}

#[test]
fn a_grain_in_a_valley_is_held_as_by_two_walls() {
    // Each face has its own displacement and its own Coulomb limit: gravity leans towards one of them.
    let valley = folded(std::f64::consts::FRAC_PI_2);
    let s = 0.5_f64.sqrt();
    let walls: Vec<Wall> =
        [s, -s].iter().map(|&x| Wall { point: [0.0; 3], normal: [x, 0.0, s], material: 0 }).collect();
    let sticky = Material { friction: 0.4, rolling_friction: 0.5, restitution: 0.2, ..Material::default() };
    for (gravity, slides) in [([4.0, 2.0, -8.0], false), ([4.0, 9.0, -4.0], true)] {
        let run = |walls: &[Wall], bodies: &mut [Body]| {
            let grain = Grain::at([0.0, -0.015, R / s - 1e-6], R, 2500.0);
            let setup =
                Setup { step: 2e-5, gravity, materials: vec![sticky], walls: walls.to_vec(), ..Setup::default() };
            let mut engine = CpuEngine::new(setup, &[grain], 1).unwrap();
            engine.advance(3500, bodies).unwrap();
            engine.state().clone()
        };
        let (plane, mesh) = (run(&walls, &mut []), run(&[], &mut [body(&valley)]));
        same(&format!("slides {slides}"), &plane, &mesh, 1e-8);
        assert_eq!((mesh.rows[0][1] + 0.015).abs() > 1e-3, slides, "{}", mesh.rows[0][1]);
    }
}

#[test]
fn case_2_9_folds_are_smooth() {
    let bouncy = Material { restitution: 1.0, friction: 0.0, ..soil() };
    let largest = |mesh: &TriangleMesh, x: f64, height: f64| {
        let mut bodies = [body(mesh)];
        let grain = Grain { velocity: [0.0, 0.0, -0.5], ..Grain::at([x, 0.0037, R + 1e-5 + height], R, 2500.0) };
        let setup = Setup { step: 2e-5, gravity: [0.0; 3], materials: vec![bouncy], ..Setup::default() };
        let mut engine = CpuEngine::new(setup, &[grain], 1).unwrap();
        (0..400).fold(0.0_f64, |most, _| {
            engine.advance(1, &mut bodies).unwrap();
            most.max(norm(bodies[0].force))
        })
    };
    let flat = largest(&folded(0.0), 0.0, 0.0);
    let mut worst = 0.0_f64;
    for degrees in [-1.0_f64, -0.1, 0.1, 1.0] {
        let mesh = folded(degrees.to_radians());
        for x in [0.0, 1e-6, 5e-5, 1e-4, 1e-3, 5e-3] {
            let error = largest(&mesh, x, x * (0.5 * degrees.to_radians()).tan()) / flat - 1.0;
            assert!(error.abs() < 0.01, "{degrees} deg, {x} m from the fold: {error}");
            worst = worst.max(error.abs());
        }
    }
    below("2.9 folds up to 1 deg", "relative error of the largest force", "1", worst, 0.01);
    // Across a fold under gravity: energy is kept, since the force has no jump to gain from.
    for degrees in [-5.0_f64, -1.0, 1.0, 5.0] {
        let mut bodies = [body(&folded(degrees.to_radians()))];
        let slope = 0.5 * degrees.to_radians();
        let start = 0.02;
        let grain = Grain {
            velocity: [-0.4 * slope.cos(), 0.0, -0.4 * slope.sin()],
            ..Grain::at([start, 0.0, start * slope.tan() + R / slope.cos() - 4e-6], R, 2500.0)
        };
        let setup = Setup { step: 1e-5, materials: vec![bouncy], ..Setup::default() };
        let mut engine = CpuEngine::new(setup, &[grain], 1).unwrap();
        let before = engine.energy(&bodies);
        engine.advance(10_000, &mut bodies).unwrap();
        assert!(engine.state().rows[0][0] < -0.01, "it has crossed");
        let kinetic = 0.08 / engine.state().rows[0][INV_M];
        let change = (engine.energy(&bodies) - before) / kinetic;
        below(&format!("2.9 fold of {degrees} deg"), "relative change of energy across", "1", change, 2e-3);
    }
}

/// Linear and angular momentum about the origin.
fn momentum(state: &DemState) -> (Vec3, Vec3) {
    state.rows.iter().fold(([0.0; 3], [0.0; 3]), |(p, l), r| {
        let mv = scale(1.0 / r[INV_M], vec_at(r, V));
        let spin = scale(1.0 / r[INV_I], vec_at(r, W));
        (add(p, mv), add(l, add(cross(vec_at(r, 0), mv), spin)))
    })
}

/// Grains in three shells around the lower part of a wheel of radius 0.1 m, the first just touching it, and each other.
fn heap(noise: &mut Noise) -> Vec<Grain> {
    let mut grains = Vec::new();
    for shell in 0..3 {
        let radius = 0.1 + R - 2e-4 + 0.01998 * f64::from(shell);
        let step = 0.01998 / radius;
        for k in 0..(2.0 / step) as u32 {
            let (sin, cos) = (step * f64::from(k) - 1.0).sin_cos();
            for j in -2..=2 {
                let at = [radius * sin, 0.02 * f64::from(j), -radius * cos];
                let spin = scale(10.0, noise.vector());
                grains.push(Grain { angular_velocity: spin, ..Grain::at(at, R, 2500.0) });
            }
        }
    }
    grains
}

/// Bits of the end, and the largest of what is missing in the balance of force and of moment, over the momentum of all grains.
fn balance(mesh: &TriangleMesh, rigid: bool, threads: usize) -> (Vec<u64>, [f64; 2]) {
    let mut noise = Noise(77);
    let state = RigidState {
        velocity: [0.5, 0.1, -1.0].into(),
        angular_velocity: [0.3, 9.0, -0.2].into(),
        ..RigidState::default()
    };
    let shape = if rigid {
        MeshBody::rigid(mesh, state).unwrap()
    } else {
        let mut b = MeshBody::deforming(mesh).unwrap();
        let velocity: Vec<f64> = mesh
            .vertices
            .iter()
            .flat_map(|&p| add(Vec3::from(state.velocity_at(&p.into())), scale(0.3, noise.vector())))
            .collect();
        b.set_vertices(&mesh.vertices.concat(), &velocity).unwrap();
        b
    };
    let sticky = Material { adhesion: Adhesion { pressure: 1e3, ..Adhesion::default() }, ..soil() };
    let setup = Setup { step: 2e-5, gravity: [0.0; 3], materials: vec![sticky], ..Setup::default() };
    let mut engine = CpuEngine::new(setup, &heap(&mut noise), threads).unwrap();
    let h = engine.setup().step;
    let mut bodies = [Body::new(Box::new(MeshShape::new(shape)), 0)];
    let (mut touched, mut several) = (0, 0);
    let mut worst = [0.0_f64; 2];
    for step in 1..=240 {
        bodies[0].clear();
        if engine.state().stale {
            // Here, so that the order of grains is the same before and after the step.
            engine.rebuild_now().unwrap();
        }
        let before = engine.state().clone();
        engine.advance(1, &mut bodies).unwrap();
        let after = engine.state();
        assert_eq!(after.ids, before.ids, "a rebuild would reorder the sums");
        let (p0, l0) = momentum(&before);
        // At the old positions: the momentum that the forces of this step gave.
        let mut kicked = after.clone();
        for (row, old) in kicked.rows.iter_mut().zip(&before.rows) {
            row[..3].copy_from_slice(&old[..3]);
        }
        let (p1, l1) = momentum(&kicked);
        let sums = |x: &[Vec3], about: Vec3| {
            bodies[0]
                .vertex_impulse
                .iter()
                .zip(x)
                .fold(([0.0; 3], [0.0; 3]), |(p, l), (&i, &x)| (add(p, i), add(l, cross(sub(x, about), i))))
        };
        let (p, l) = sums(bodies[0].shape.positions(), [0.0; 3]);
        let size: f64 = bodies[0].vertex_impulse.iter().map(|&i| norm(i)).sum();
        // Round-off of the grains' momenta counts too.
        let total: f64 = after.rows.iter().map(|r| (norm(vec_at(r, V)) + R * norm(vec_at(r, W))) / r[INV_M]).sum();
        let round_off = 1e-14 * (size + total);
        let missing = [norm(add(p, sub(p1, p0))), norm(add(l, sub(l1, l0)))];
        worst = [0, 1].map(|c| worst[c].max(missing[c] / (size + total)));
        assert!(norm(add(p, sub(p1, p0))) < round_off, "force: {:e}", norm(add(p, sub(p1, p0))) / total);
        assert!(norm(add(l, sub(l1, l0))) < 0.15 * round_off, "moment: {:e}", norm(add(l, sub(l1, l0))));
        // The wrench about the centre says the same.
        assert!(norm(sub(bodies[0].impulse, p)) < round_off);
        let (_, about) = sums(bodies[0].shape.positions(), bodies[0].shape.centre());
        assert!(norm(sub(bodies[0].angular_impulse, about)) < 0.15 * round_off);
        touched += usize::from(size > 0.0);
        let pairs: Vec<_> = after.slabs.iter().flat_map(|s| &s.bodies).map(|p| p.grain).collect();
        several += pairs.windows(2).filter(|w| w[0] == w[1]).count();
        // The engine's clock for bodies starts at 0 in each call: this one moves on by hand.
        let shape = bodies[0].shape.as_mesh().unwrap();
        if rigid {
            let turned = state.advanced(h * f64::from(step));
            shape.update(|b| b.set_state(turned)).unwrap();
        } else {
            let x: Vec<f64> = shape
                .body()
                .positions()
                .iter()
                .zip(shape.body().velocities())
                .flat_map(|(&x, &v)| add_scaled(x, h, v))
                .collect();
            let v = shape.body().velocities().concat();
            shape.update(|b| b.set_vertices(&x, &v)).unwrap();
        }
    }
    assert!(touched > 200, "only {touched} steps touched");
    println!("steps with contact {touched}, second contacts {several}");
    (engine.state().rows.iter().flat_map(|r| r.0).map(f64::to_bits).collect(), worst)
}

#[test]
fn case_9_2_what_the_grains_lose_the_vertices_get() {
    let smooth = Cylinder::smooth(0.1, 0.08, 40).mesh().unwrap();
    let grousers = Grousers { count: 12, height: 0.012, thickness: 0.004 };
    let barred = Cylinder { grousers: Some(grousers), ..Cylinder::smooth(0.088, 0.08, 40) }.mesh().unwrap();
    for rigid in [true, false] {
        let worst = [&smooth, &barred].map(|mesh| balance(mesh, rigid, 1).1);
        let case = if rigid { "9.2 rigid mesh" } else { "9.2 deforming mesh" };
        below(
            case,
            "impulse on the grains and on the vertices, sum over momentum",
            "1",
            worst[0][0].max(worst[1][0]),
            1e-14,
        );
        below(case, "their moments, likewise", "m", worst[0][1].max(worst[1][1]), 1.5e-15);
    }
    assert_eq!(balance(&barred, false, 1).0, balance(&barred, false, 3).0, "thread count changes bits");
}
