//! Obstacles: free motion, rest, collisions that balance, sleep.

use fmu_terrain::dem::{
    Body, CpuEngine, Cylinder, Fill, FreeBody, Grain, GrainEngine, MassOf, Material, Radii, Sample, Setup, Solid,
    Surface, Wall, sample,
};
use terramech_mechanics::RigidState;

const G: f64 = 9.81;

fn state(position: [f64; 3]) -> RigidState {
    RigidState { position: position.into(), ..RigidState::default() }
}

fn obstacle(solid: Solid, mass: f64, at: RigidState, asleep: bool) -> Body {
    Body::new(Box::new(FreeBody::new(solid, MassOf::Mass(mass), at, asleep).unwrap()), 0)
}

fn now(body: &mut Body) -> RigidState {
    body.shape.as_free().unwrap().now.state
}

/// A box without soil but for one grain far away: the engine wants one.
fn empty() -> CpuEngine {
    let walls = vec![Wall { point: [0.0; 3], normal: [0.0, 0.0, 1.0], material: 0 }];
    let setup = Setup { walls, ..Setup::default() };
    CpuEngine::new(setup, &[Grain::at([9.0, 9.0, 0.012], 0.012, 2500.0)], 1).unwrap()
}

#[test]
fn in_free_flight_it_falls_and_keeps_its_spin() {
    let mut e = empty();
    let mut at = state([0.0, 0.0, 3.0]);
    at.angular_velocity = [0.0, 3.0, 0.0].into();
    let mut bodies = [obstacle(Solid::Box([0.2, 0.3, 0.4]), 5.0, at, false)];
    e.advance(10_000, &mut bodies).unwrap();
    let s = now(&mut bodies[0]);
    let (t, h) = (0.4, 4e-5);
    assert!((s.position[2] - (3.0 - 0.5 * G * t * (t + h))).abs() < 1e-9, "{s:?}");
    assert!((s.angular_velocity[1] - 3.0).abs() < 1e-9 && (s.orientation.angle() - 1.2).abs() < 1e-9);
}

#[test]
fn every_solid_comes_to_rest_on_the_floor_and_weighs_what_it_weighs() {
    let mesh = Solid::mesh(Solid::Box([0.3, 0.2, 0.1]).to_mesh()).unwrap();
    for solid in [Solid::Sphere(0.1), Solid::Cylinder(0.1, 0.3), Solid::Box([0.3, 0.2, 0.1]), mesh] {
        let mut e = empty();
        let height = solid.reach() + 0.01;
        let mut bodies = [obstacle(solid.clone(), 12.0, state([0.0, 0.0, height]), false)];
        e.advance(40_000, &mut bodies).unwrap();
        let s = now(&mut bodies[0]);
        let load = bodies[0].shape.as_free().unwrap().now.load[0];
        assert!(s.velocity.norm() < 1e-3 && s.angular_velocity.norm() < 1e-2, "{solid:?}: {s:?}");
        assert!((load[2] - 12.0 * G).abs() < 0.05 * 12.0 * G, "{solid:?}: {load:?}");
        let rest = match solid {
            Solid::Box(_) | Solid::Mesh(_) => 0.05,
            _ => 0.1,
        };
        assert!((s.position[2] - rest).abs() < 2e-3, "{solid:?}: {}", s.position[2]);
    }
}

#[test]
fn a_sliding_box_is_stopped_by_friction() {
    // From 1 m/s with mu 0.9: v^2/(2 mu g).
    let mut e = empty();
    let mut at = state([0.0, 0.0, 0.05]);
    at.velocity = [1.0, 0.0, 0.0].into();
    let mut bodies = [obstacle(Solid::Box([0.4, 0.4, 0.1]), 20.0, at, false)];
    e.advance(12_000, &mut bodies).unwrap();
    let s = now(&mut bodies[0]);
    assert!((s.position[0] / (1.0 / (2.0 * 0.9 * G)) - 1.0).abs() < 0.03 && s.velocity.norm() < 1e-3, "{s:?}");
}

fn soil() -> (CpuEngine, f64) {
    let (length, width) = (0.6, 0.3);
    let soil = Material { rolling_friction: 0.2, spinning_friction: 0.1, ..Material::default() };
    let setup = Setup { materials: vec![soil], walls: Wall::open_box(length, width, 0, 0), ..Setup::default() };
    let (fill, radii) = (Fill::Count(2500), Radii::Equal(0.01));
    let grains =
        sample(&Sample { length, width, fill, radii, density: 2500.0, material: 0, seed: 3, spacing: 1.0 }).unwrap();
    let mut engine = CpuEngine::new(setup, &grains, 2).unwrap();
    engine.advance(6000, &mut []).unwrap();
    let height = Surface::of(engine.state(), length, width).mean();
    (engine, height)
}

#[test]
fn it_sinks_in_until_the_soil_carries_it() {
    let (mut e, height) = soil();
    let mut bodies = [obstacle(Solid::Cylinder(0.06, 0.2), 4.0, state([0.0, 0.0, height + 0.06]), false)];
    e.advance(9000, &mut bodies).unwrap();
    e.advance(1000, &mut bodies[..]).unwrap();
    let s = now(&mut bodies[0]);
    let load = bodies[0].shape.as_free().unwrap().now.load[0];
    println!("lies {:.4} m above the surface, carried {:.2} N of {:.2}", s.position[2] - height, load[2], 4.0 * G);
    assert!(s.position[2] < height + 0.06 && s.position[2] > height, "{s:?}");
    assert!((load[2] / (4.0 * G) - 1.0).abs() < 0.3 && s.velocity.norm() < 0.05, "{load:?} {s:?}");
}

#[test]
fn asleep_it_waits_for_a_wheel_and_the_push_balances() {
    let (mut e, height) = soil();
    // Clear of the highest grains, which stand above the mean surface.
    let at = state([0.15, 0.0, height + 0.065]);
    let wheel = |x: f64| {
        let shape = Cylinder::new(0.1, 0.1, [x, 0.0, height + 0.1], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 10.0, 0.0]);
        Body::new(Box::new(shape), 0)
    };
    let mut bodies = [obstacle(Solid::Box([0.1, 0.1, 0.1]), 6.0, at, true), wheel(-0.06)];
    e.advance(500, &mut bodies).unwrap();
    assert_eq!(now(&mut bodies[0]).position, at.position);
    // The gap of 0.06 m is closed at 0.06 s: the wheel then pushes it on.
    bodies[1] = wheel(-0.04);
    e.advance(3000, &mut bodies).unwrap();
    let s = now(&mut bodies[0]);
    println!(
        "pushed by {:.4} m, {:.3} m/s; impulse on the wheel {:?}",
        s.position[0] - 0.15,
        s.velocity[0],
        bodies[1].impulse
    );
    assert!(s.position[0] > 0.16 && bodies[1].impulse[0] < -1.0, "{s:?}");
}

#[test]
fn point_contacts_of_two_bodies_balance_to_round_off() {
    let mut e = empty();
    let gravity = e.setup().gravity;
    let mut bodies = [
        obstacle(Solid::Sphere(0.1), 3.0, state([0.0, 0.0, 1.0]), false),
        Body::new(
            Box::new(Cylinder::new(0.2, 0.1, [0.02, 0.01, 0.75], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 5.0, 0.0])),
            0,
        ),
    ];
    e.advance(2000, &mut bodies).unwrap();
    let s = now(&mut bodies[0]);
    let t = 2000.0 * 4e-5;
    for c in 0..3 {
        // Momentum of the obstacle = weight and the opposite of what the wheel felt.
        let expected = 3.0 * gravity[c] * t - bodies[1].impulse[c];
        assert!((3.0 * s.velocity[c] - expected).abs() < 1e-9, "{c}: {} {expected}", 3.0 * s.velocity[c]);
    }
    assert!(bodies[1].impulse[2] < -1.0 && s.angular_velocity.norm() > 0.1, "{s:?} {:?}", bodies[1].impulse);
}

#[test]
fn two_obstacles_collide_and_momentum_stays() {
    let setup = Setup { gravity: [0.0; 3], ..Setup::default() };
    let box_of = |x: f64, vx: f64, mass: f64, asleep: bool| {
        let mut at = state([x, 0.02, 1.0 + 0.03 * x]);
        at.velocity = [vx, 0.0, 0.0].into();
        obstacle(Solid::Box([0.2, 0.3, 0.25]), mass, at, asleep)
    };
    let ball = |x: f64, vx: f64, mass: f64| {
        let mut at = state([x, 0.0, 1.0]);
        at.velocity = [vx, 0.0, 0.0].into();
        obstacle(Solid::Sphere(0.1), mass, at, false)
    };
    let mesh = Solid::mesh(Solid::Cylinder(0.1, 0.3).to_mesh()).unwrap();
    let drum = obstacle(mesh, 4.0, state([0.31, 0.05, 1.02]), true);
    for mut bodies in [
        vec![ball(0.0, 1.0, 3.0), ball(0.25, -0.5, 5.0)],
        vec![ball(0.0, 1.0, 3.0), box_of(0.25, 0.0, 6.0, true)],
        vec![box_of(0.0, 1.0, 3.0, false), box_of(0.25, 0.0, 6.0, true)],
        vec![box_of(0.06, 1.0, 3.0, false), drum],
    ] {
        let mut e = CpuEngine::new(setup.clone(), &[Grain::at([9.0, 9.0, 0.012], 0.012, 2500.0)], 1).unwrap();
        let sums = |bodies: &mut [Body]| {
            let (mut p, mut l, mut energy) = (nalgebra::Vector3::zeros(), nalgebra::Vector3::zeros(), 0.0);
            for b in bodies {
                let (m, s) = (b.shape.as_free().unwrap().mass(), now(b));
                p += m * s.velocity;
                l += m * s.position.cross(&s.velocity);
                energy += 0.5 * m * s.velocity.norm_squared();
            }
            (p, l, energy)
        };
        let before = sums(&mut bodies);
        e.advance(6000, &mut bodies).unwrap();
        let after = sums(&mut bodies);
        let [a, b] = [0, 1].map(|k| now(&mut bodies[k]));
        println!("{:.4} {:.4} m/s, energy {:.4} of {:.4} J", a.velocity[0], b.velocity[0], after.2, before.2);
        assert!((after.0 - before.0).norm() < 1e-9, "{after:?} {before:?}");
        assert!(a.velocity[0] < b.velocity[0] && after.2 < before.2, "{a:?} {b:?}");
    }
}

#[test]
fn a_box_rests_on_a_box() {
    let mut e = empty();
    let cube = |z: f64| obstacle(Solid::Box([0.3, 0.3, 0.2]), 10.0, state([0.0, 0.0, z]), false);
    let mut bodies = [cube(0.1), cube(0.305)];
    e.advance(40_000, &mut bodies).unwrap();
    let [low, high] = [0, 1].map(|k| now(&mut bodies[k]));
    let load = bodies[1].shape.as_free().unwrap().now.load[0];
    println!("{:.4} m and {:.4} m high, carried {:.3} N", low.position[2], high.position[2], load[2]);
    assert!((load[2] - 10.0 * G).abs() < 0.05 * 10.0 * G && high.velocity.norm() < 1e-2, "{load:?} {high:?}");
    assert!((high.position[2] - low.position[2] - 0.2).abs() < 0.01);
}
