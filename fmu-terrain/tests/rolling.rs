//! Validation 2.4, 2.5, 2.7: one sphere on a plane, sliding, rolling, resting.

#[path = "common/checks.rs"]
mod checks;

use checks::{below, curve, relative};
use fmu_terrain::dem::{CpuEngine, Grain, GrainEngine, Material, Setup, Wall};

const G: f64 = 9.81;

/// A sphere of radius `r` and mass `m` resting on a plane inclined by `angle`, at its static overlap.
struct Case {
    r: f64,
    m: f64,
    angle: f64,
    material: Material,
    v0: f64,
    step: f64,
}

impl Case {
    fn engine(&self) -> CpuEngine {
        let (s, c) = self.angle.sin_cos();
        let density = self.m / (4.0 / 3.0 * std::f64::consts::PI * self.r.powi(3));
        let e_star = self.material.young_modulus / (2.0 * (1.0 - self.material.poisson_ratio.powi(2)));
        let delta = (self.m * G * c / (4.0 / 3.0 * e_star * self.r.sqrt())).powf(2.0 / 3.0);
        let ball = Grain { velocity: [self.v0, 0.0, 0.0], ..Grain::at([0.0, 0.0, self.r - delta], self.r, density) };
        let setup = Setup {
            step: self.step,
            gravity: [G * s, 0.0, -G * c],
            materials: vec![self.material],
            walls: vec![Wall { point: [0.0; 3], normal: [0.0, 0.0, 1.0], material: 0 }],
            ..Setup::default()
        };
        CpuEngine::new(setup, &[ball], 1).unwrap()
    }
}

/// Stiff: the lever of friction is the radius less the overlap.
fn ball(mu: f64, mu_roll: f64) -> Material {
    Material {
        young_modulus: 1e8,
        restitution: 0.5,
        friction: mu,
        rolling_friction: mu_roll,
        spinning_friction: 0.0,
        ..Material::default()
    }
}

#[test]
fn case_2_4_sliding_turns_to_rolling() {
    let case = Case { r: 0.05, m: 1.0, angle: 0.0, material: ball(0.3, 0.0), v0: 1.0, step: 1e-5 };
    let mut engine = case.engine();
    let mut rolls_at = None;
    let (mut speed, mut rim) = (Vec::new(), Vec::new());
    for k in 0..15_000 {
        engine.advance(1, &mut []).unwrap();
        let s = engine.state();
        let row = s.rows[0];
        if k % 300 == 0 {
            speed.push([s.time, row[4]]);
            rim.push([s.time, row[9] * row[2]]);
        }
        // Rolling begins where the slip at the contact point vanishes.
        if rolls_at.is_none() && row[4] - row[9] * row[2] <= 0.0 {
            rolls_at = Some((s.time, row[0]));
        }
    }
    let (t, x) = rolls_at.expect("it rolls");
    let v = engine.state().rows[0][4];
    let plot = ["rolling", "2.4: sliding turns to rolling", "time", "s", "speed", "m/s"];
    let closed = |t: f64| [t, (1.0 - 0.3 * G * t).max(5.0 / 7.0)];
    let line: Vec<[f64; 2]> = (0..=150).map(|k| closed(f64::from(k) * 1e-3)).collect();
    curve(plot, "line", "closed form, centre", &line);
    curve(plot, "points", "computed, centre", &speed);
    curve(plot, "points", "computed, angular speed x radius", &rim);
    relative("2.4", "speed once it rolls", "m/s", 5.0 / 7.0, v, 0.01);
    relative("2.4", "time until it rolls", "s", 0.09708, t, 0.01);
    relative("2.4", "way until it rolls", "m", 0.08321, x, 0.01);
}

#[test]
fn case_2_5_rolling_resistance_brakes() {
    let v0 = 1.0;
    let case = Case { r: 0.05, m: 1.0, angle: 0.0, material: ball(0.3, 0.2), v0, step: 1e-5 };
    let mut engine = case.engine();
    // First let it come to rolling (it also brakes while sliding), then time the braking.
    engine.advance(20_000, &mut []).unwrap();
    let before = engine.state().rows[0][4];
    engine.advance(20_000, &mut []).unwrap();
    let after = engine.state().rows[0][4];
    let deceleration = (before - after) / 0.2;
    relative("2.5", "deceleration", "m/s2", 5.0 / 7.0 * 0.2 * G, deceleration, 0.01);
    // It comes to rest and stays: a torque that only follows the velocity could not.
    engine.advance(80_000, &mut []).unwrap();
    let x = engine.state().rows[0][0];
    engine.advance(20_000, &mut []).unwrap();
    below("2.5", "speed at the end", "m/s", engine.state().rows[0][4], 1e-8);
    below("2.5", "creep over 0.2 s", "m", engine.state().rows[0][0] - x, 1e-8);
}

/// What the closed form says of a sphere on an incline: acceleration down the slope, or none where it says nothing.
fn expected(angle: f64, mu: f64, mu_roll: f64) -> Option<f64> {
    let (tan, s, c) = (angle.tan(), angle.sin(), angle.cos());
    if tan <= mu.min(mu_roll) {
        Some(0.0)
    } else if tan > mu_roll && 2.0 / 7.0 * tan + 5.0 / 7.0 * mu_roll <= mu {
        Some(5.0 / 7.0 * G * (s - mu_roll * c))
    } else if mu_roll >= mu && tan > mu {
        Some(G * (s - mu * c))
    } else {
        None
    }
}

fn incline(scale: f64) {
    let mu = 0.25;
    let mut checked = 0;
    // Worst of all cases: relative error of the acceleration, speed and way of those at rest.
    let (mut error, mut speed, mut way) = (0.0_f64, 0.0_f64, 0.0_f64);
    for mu_roll in [0.0, 0.05, 0.1, 0.2, 0.3] {
        for degrees in [1.0, 5.0, 10.0, 13.0, 15.0, 20.0, 30.0, 40.0, 60.0] {
            let angle = f64::to_radians(degrees);
            let Some(a) = expected(angle, mu, mu_roll) else { continue };
            let material = Material { young_modulus: 1e9, ..ball(mu, mu_roll) };
            let case = Case { r: 0.2 * scale, m: 5.0 * scale.powi(3), angle, material, v0: 0.0, step: 4e-5 * scale };
            let mut engine = case.engine();
            let steps = (0.25 / case.step) as u32 / 2;
            engine.advance(steps, &mut []).unwrap();
            let (v1, x1) = (engine.state().rows[0][4], engine.state().rows[0][0]);
            engine.advance(steps, &mut []).unwrap();
            let (v2, x2) = (engine.state().rows[0][4], engine.state().rows[0][0]);
            let got = (v2 - v1) / (f64::from(steps) * case.step);
            let name = format!("scale {scale}, mu_roll {mu_roll}, {degrees} deg: {got:.5}, expected {a:.5}");
            if a == 0.0 {
                (speed, way) = (speed.max(v2.abs()), way.max((x2 - x1).abs()));
                assert!(
                    v2.abs() < 1e-4 * scale && (x2 - x1).abs() < 1e-5 * scale,
                    "{name}, v {v2:.2e} x {:.2e}",
                    x2 - x1
                );
            } else {
                error = error.max((got / a - 1.0).abs());
                assert!((got / a - 1.0).abs() < 0.01, "{name}");
            }
            checked += 1;
        }
    }
    assert!(checked > 25, "{checked}");
    let case = format!("2.7 radius {:.2} m", 0.2 * scale);
    let quantity = |what: &str| format!("{what}, worst of {checked} inclines");
    below(&case, &quantity("relative error of the acceleration"), "1", error, 0.01);
    below(&case, &quantity("speed at rest"), "m/s", speed, 1e-4 * scale);
    below(&case, &quantity("creep at rest in 0.125 s"), "m", way, 1e-5 * scale);
}

#[test]
fn case_2_7_sphere_on_an_incline() {
    incline(1.0);
}

#[test]
fn case_2_7_the_same_answer_at_a_tenth_of_the_size() {
    incline(0.1);
}
