//! Validation 2.1, 2.2, 2.3: single impacts against closed forms.

#[path = "common/checks.rs"]
mod checks;

use checks::{curve, figure, relative};
use fmu_terrain::dem::{CpuEngine, DemState, Grain, GrainEngine, Material, Setup, Wall};

const RIGID: f64 = f64::INFINITY;

fn floor(material: usize) -> Wall {
    Wall { point: [0.0; 3], normal: [0.0, 0.0, 1.0], material }
}

/// No gravity, small step, the largest overlap a fraction of a percent.
fn setup(step: f64, materials: Vec<Material>, walls: Vec<Wall>) -> Setup {
    Setup { step, gravity: [0.0; 3], materials, walls, ..Setup::default() }
}

/// Advances until `over` holds; calls `each` after every step.
fn run(engine: &mut CpuEngine, mut each: impl FnMut(&DemState), over: impl Fn(&DemState) -> bool) {
    for _ in 0..3_000_000 {
        engine.advance(1, &mut []).unwrap();
        each(engine.state());
        if over(engine.state()) {
            return;
        }
    }
    panic!("the impact did not end");
}

#[test]
fn case_2_1_two_glass_spheres_in_hertz_impact() {
    let glass =
        Material { young_modulus: 48e9, poisson_ratio: 0.2, restitution: 1.0, friction: 0.0, ..Material::default() };
    let h = 2e-9;
    let ball = |x: f64| Grain { velocity: [-10.0 * x.signum(), 0.0, 0.0], ..Grain::at([x, 0.0, 0.0], 0.01, 2800.0) };
    let mut engine =
        CpuEngine::new(setup(h, vec![glass], vec![]), &[ball(-0.010_000_1), ball(0.010_000_1)], 1).unwrap();
    let (mut overlap, mut force, mut contact) = (0.0_f64, 0.0_f64, 0.0);
    run(
        &mut engine,
        |s| {
            let x = |k: usize| s.rows[k][0];
            let delta = 0.02 - (x(0) - x(1)).abs();
            if delta > 0.0 {
                contact += h;
            }
            overlap = overlap.max(delta);
            force = force.max(s.force[0][0].abs());
        },
        |s| s.time > 1e-6 && (s.rows[0][0] - s.rows[1][0]).abs() > 0.02,
    );
    relative("2.1 two spheres", "largest overlap", "m", 274.11e-6, overlap, 1e-3);
    relative("2.1 two spheres", "largest force", "N", 10.697e3, force, 1e-3);
    relative("2.1 two spheres", "duration", "s", 40.34e-6, contact, 1e-3);
}

#[test]
fn case_2_1_a_sphere_on_a_rigid_wall_in_hertz_impact() {
    let soft =
        Material { young_modulus: 70e9, poisson_ratio: 0.3, restitution: 1.0, friction: 0.0, ..Material::default() };
    let wall = Material { young_modulus: RIGID, ..soft };
    let h = 2e-8;
    let ball = Grain { velocity: [0.0, 0.0, -0.2], ..Grain::at([0.0, 0.0, 0.100_000_1], 0.1, 2699.0) };
    let mut engine = CpuEngine::new(setup(h, vec![soft, wall], vec![floor(1)]), &[ball], 1).unwrap();
    let (mut overlap, mut force, mut contact) = (0.0_f64, 0.0_f64, 0.0);
    run(
        &mut engine,
        |s| {
            let delta = 0.1 - s.rows[0][2];
            if delta > 0.0 {
                contact += h;
            }
            overlap = overlap.max(delta);
            force = force.max(s.force[0][2]);
        },
        |s| s.time > 1e-5 && s.rows[0][2] > 0.1,
    );
    relative("2.1 sphere on wall", "largest overlap", "m", 49.717e-6, overlap, 1e-3);
    relative("2.1 sphere on wall", "largest force", "N", 11.370e3, force, 1e-3);
    relative("2.1 sphere on wall", "duration", "s", 731.66e-6, contact, 1e-3);
}

/// Aluminium oxide of 2.2 and 2.3 on a rigid wall.
fn oxide(restitution: f64, friction: f64) -> Vec<Material> {
    let m = Material { young_modulus: 380e9, poisson_ratio: 0.23, restitution, friction, ..Material::default() };
    vec![m, Material { young_modulus: RIGID, ..m }]
}

/// Velocity and angular velocity after an impact at `angle` degrees from the normal, 3.9 m/s, r 2.5 mm.
fn impact(materials: Vec<Material>, angle: f64, h: f64) -> ([f64; 3], [f64; 3]) {
    let (s, c) = angle.to_radians().sin_cos();
    let r = 2.5e-3;
    let ball = Grain { velocity: [3.9 * s, 0.0, -3.9 * c], ..Grain::at([0.0, 0.0, r + 1e-9], r, 4000.0) };
    let mut engine = CpuEngine::new(setup(h, materials, vec![floor(1)]), &[ball], 1).unwrap();
    run(&mut engine, |_| {}, |s| s.time > 1e-7 && s.rows[0][2] > r);
    let row = engine.state().rows[0];
    ([row[4], row[5], row[6]], [row[8], row[9], row[10]])
}

#[test]
fn case_2_2_restitution_out_is_restitution_in() {
    let plot = ["restitution", "2.2: restitution of a sphere on a wall", "asked", "", "found", ""];
    let mut found = Vec::new();
    for e in [0.2, 0.4, 0.6, 0.8, 1.0] {
        let (v, _) = impact(oxide(e, 0.0), 0.0, 5e-10);
        figure("2.2", &format!("restitution, asked {e}"), "1", e, v[2] / 3.9, 1e-3);
        found.push([e, v[2] / 3.9]);
    }
    curve(plot, "dashed", "as asked", &[[0.0, 0.0], [1.0, 1.0]]);
    curve(plot, "points", "computed", &found);
}

#[test]
fn case_2_3_oblique_impact_in_full_sliding() {
    let (e, mu) = (0.98, 0.092);
    let plot = [
        "oblique",
        "2.3: oblique impact in full sliding",
        "angle from the normal",
        "deg",
        "tangential restitution",
        "",
    ];
    let mut found = Vec::new();
    for (angle, e_t, omega) in [(50.0, 0.8471, 456.7), (60.0, 0.8948, 355.2), (80.0, 0.9679, 123.4)] {
        let (v, w) = impact(oxide(e, mu), angle, 1e-9);
        let case = format!("2.3 {angle} deg");
        let got = v[0] / (3.9 * f64::to_radians(angle).sin());
        relative(&case, "tangential restitution", "1", e_t, got, 1e-2);
        relative(&case, "angular speed", "rad/s", omega, w[1], 1e-2);
        found.push([angle, got]);
    }
    let closed = |angle: f64| [angle, 1.0 - mu * (1.0 + e) / angle.to_radians().tan()];
    let line: Vec<[f64; 2]> = (45..=85).map(|a| closed(f64::from(a))).collect();
    curve(plot, "line", "1 - mu (1 + e) cot(angle)", &line);
    curve(plot, "points", "computed", &found);
}

#[test]
fn the_clamped_variant_ends_the_impact_early() {
    // The page on laws: e = .325 for an asked .2.
    let materials = oxide(0.2, 0.0);
    let r = 2.5e-3;
    let ball = Grain { velocity: [0.0, 0.0, -3.9], ..Grain::at([0.0, 0.0, r + 1e-9], r, 4000.0) };
    let setup = Setup { clamp_normal: true, ..setup(5e-10, materials, vec![floor(1)]) };
    let mut engine = CpuEngine::new(setup, &[ball], 1).unwrap();
    run(&mut engine, |_| {}, |s| s.time > 1e-7 && s.rows[0][2] > r);
    relative("2.2 clamped", "restitution, asked 0.2", "1", 0.325, engine.state().rows[0][6] / 3.9, 1e-2);
}
