//! Validation 2.11 and 2.12: what heaps, hoppers, silos and shear boxes are known for. Bands, not exact values.

#[path = "common/checks.rs"]
mod checks;

use checks::{below, curve, figure, relative};
use fmu_terrain::config::Terrain;
use fmu_terrain::dem::vec3::Vec3;
use fmu_terrain::dem::{
    Body, BodyTouch, CpuEngine, Fill, Grain, GrainEngine, Material, Radii, Recipe, Sample, Settle, Setup, Shape, Wall,
    prepare,
};
use fmu_terrain::soil::{Soil, shear};
use std::f64::consts::PI;

const RADIUS: f64 = 0.003;
const D: f64 = 2.0 * RADIUS;
const DENSITY: f64 = 2500.0;
const G: f64 = 9.81;

fn grains_of(friction: f64) -> Material {
    Material {
        young_modulus: 5e6,
        friction,
        rolling_friction: 0.05,
        spinning_friction: 0.02,
        restitution: 0.3,
        ..Material::default()
    }
}

/// A settled bed of spheres that differ by a tenth, in an open box with walls like the grains.
fn poured(length: f64, width: f64, fill: Fill) -> CpuEngine {
    let setup = Setup {
        materials: vec![grains_of(0.5)],
        walls: Wall::open_box(length, width, 0, 0),
        step: 2.5e-5,
        ..Setup::default()
    };
    let radii = Radii::Uniform(0.95 * RADIUS, 1.05 * RADIUS);
    let sample = Sample { length, width, fill, radii, density: DENSITY, material: 0, seed: 3, spacing: 1.05 };
    let settle = Settle { energy: 1e-4, ..Settle::default() };
    prepare(setup, &Recipe::new(sample, settle, 0.0), 1, &mut |_, _| true).unwrap().0
}

/// A column of aspect ratio `a` = height over radius, let go of at once: (final radius - radius)/radius.
fn runout(bed: &CpuEngine, radius: f64, a: f64) -> f64 {
    let inside = |r: &&[f64; 16]| (r[0].hypot(r[1]) + r[3] < radius) && r[2] + r[3] < a * radius;
    let rows: Vec<[f64; 16]> = bed.state().rows.iter().map(|r| r.0).collect();
    let grains: Vec<Grain> = rows.iter().filter(inside).map(|r| Grain::at([r[0], r[1], r[2]], r[3], DENSITY)).collect();
    let setup = Setup { walls: Wall::open_box(2.0, 2.0, 0, 0), ..bed.setup().clone() };
    let mut engine = CpuEngine::new(setup, &grains, 1).unwrap();
    engine.advance((1.0 / bed.setup().step) as u32, &mut []).unwrap();
    // The heap ends where its grains no longer cover half of a ring as wide as two of them: single grains roll further.
    let rings = (0..200).take_while(|&k| {
        let (from, to) = (2.0 * D * f64::from(k), 2.0 * D * f64::from(k + 1));
        let covered = engine.state().rows.iter().filter(|r| (from..to).contains(&r[0].hypot(r[1]))).count() as f64;
        covered * PI * RADIUS * RADIUS > 0.5 * PI * (to * to - from * from)
    });
    (2.0 * D * rings.count() as f64 - radius) / radius
}

/// Lube, Huppert, Sparks, Hallworth (2004): 1.24 a below 1.7, 1.6 sqrt(a) above, whatever the grains.
#[test]
#[ignore = "minutes: run by cargo xtask validate dem-p"]
fn case_2_11_a_column_runs_out_as_its_aspect_ratio_says() {
    let radius = 9.0 * D;
    let bed = poured(2.4 * radius, 2.4 * radius, Fill::Depth(3.1 * radius));
    let mut found = Vec::new();
    for a in [0.6_f64, 1.0, 1.5, 3.0] {
        let said = if a < 1.7 { 1.24 * a } else { 1.6 * a.sqrt() };
        let ran = runout(&bed, radius, a);
        found.push([a, ran]);
        relative("2.11 column collapse", &format!("runout over radius, aspect ratio {a}"), "1", said, ran, 0.35);
    }
    let plot = ["runout", "2.11: runout of a column over its radius", "aspect ratio", "", "runout", ""];
    let law = |k: i32| {
        let a = 0.1 * f64::from(k);
        [a, if a < 1.7 { 1.24 * a } else { 1.6 * a.sqrt() }]
    };
    curve(plot, "line", "Lube et al. 2004", &(0..=35).map(law).collect::<Vec<_>>());
    curve(plot, "points", "computed", &found);
}

/// A plate without thickness at z = 0 with a round hole.
struct Orifice(f64);

impl Shape for Orifice {
    fn move_to(&mut self, _: f64) {}
    fn bounds(&self) -> [Vec3; 2] {
        let far = f64::INFINITY;
        [[-far, -far, 0.0], [far, far, 0.0]]
    }
    fn touches(&self, c: Vec3, radius: f64, out: &mut Vec<BodyTouch>) {
        let rho = c[0].hypot(c[1]);
        let onto = if rho >= self.0 { 1.0 } else { self.0 / rho.max(1e-12) };
        let point = [onto * c[0], onto * c[1], 0.0];
        let away: Vec3 = std::array::from_fn(|k| c[k] - point[k]);
        let distance = away.iter().map(|x| x * x).sum::<f64>().sqrt();
        if distance < radius && distance > 0.0 {
            out.push(BodyTouch {
                overlap: radius - distance,
                weight: 1.0,
                share: 1.0,
                normal: away.map(|x| x / distance),
                point,
                velocity: [0.0; 3],
                angular_velocity: [0.0; 3],
                vertices: [u32::MAX; 3],
                weights: [0.0; 3],
            });
        }
    }
    fn centre(&self) -> Vec3 {
        [0.0; 3]
    }
}

/// Mass that has flowed out (kg) over time (s), every 10 ms, until `least` of the grains (a share) are left above.
fn outflow(bed: &CpuEngine, hole: f64, least: f64) -> Vec<[f64; 2]> {
    let mut setup = bed.setup().clone();
    setup.walls[0].point[2] = -0.3;
    let mut engine = CpuEngine::with_state(setup, bed.state().clone(), 1).unwrap();
    engine.rebuild_now().unwrap();
    let (step, all) = (engine.setup().step, engine.state().rows.len() as f64);
    let chunk = (0.01 / step).round() as u32;
    let mut flowed = Vec::new();
    loop {
        engine.advance(chunk, &mut [Body::new(Box::new(Orifice(hole)), 0)]).unwrap();
        let below = |r: &&terramech_simd::Row| r[2] < -RADIUS;
        let mass: f64 = engine.state().rows.iter().filter(below).map(|r| 1.0 / r[7]).sum();
        let above = engine.state().rows.iter().filter(|r| r[2] > 0.0).count() as f64;
        flowed.push([f64::from(flowed.len() as u32 + 1) * f64::from(chunk) * step, mass]);
        if above < least * all || flowed.len() > 800 {
            return flowed;
        }
    }
}

/// Slope of the line of least squares through points whose second value is in a range.
fn rate(points: &[[f64; 2]], from: f64, to: f64) -> f64 {
    let inside: Vec<_> = points.iter().filter(|p| (from..to).contains(&p[1])).collect();
    let n = inside.len() as f64;
    let (mx, my) = inside.iter().fold((0.0, 0.0), |(a, b), p| (a + p[0] / n, b + p[1] / n));
    let (xy, xx) = inside.iter().fold((0.0, 0.0), |(a, b), p| (a + (p[0] - mx) * (p[1] - my), b + (p[0] - mx).powi(2)));
    xy / xx
}

/// Beverloo, Leniger, van de Velde (1961): W = 0.58 rho_b sqrt(g) (D0 - 1.4 d)^2.5, whatever stands above.
#[test]
#[ignore = "minutes: run by cargo xtask validate dem-p"]
fn case_2_11_a_hopper_flows_with_the_power_of_five_halves() {
    let (base, height) = (13.0 * D, 18.0 * D);
    let bed = poured(base, base, Fill::Depth(height));
    let all = bed.state().mass();
    let bulk = all / (base * base * height);
    let mut logs = Vec::new();
    for holes in [5.0, 6.0, 7.0] {
        let flowed = outflow(&bed, 0.5 * holes * D, 0.66);
        let (early, late) = (rate(&flowed, 0.04 * all, 0.18 * all), rate(&flowed, 0.18 * all, 0.32 * all));
        let w = rate(&flowed, 0.04 * all, 0.32 * all);
        let said = 0.58 * bulk * G.sqrt() * ((holes - 1.4) * D).powf(2.5);
        let case = format!("2.11 hopper, orifice {holes} d");
        relative(&case, "flow", "kg/s", said, w, 0.3);
        relative(&case, "later flow over earlier flow", "1", 1.0, late / early, 0.12);
        logs.push([((holes - 1.4) * D).ln(), w.ln()]);
    }
    let exponent = (logs[2][1] - logs[0][1]) / (logs[2][0] - logs[0][0]);
    figure("2.11 hopper", "exponent of the flow over (D0 - 1.4 d)", "1", 2.5, exponent, 0.25);
}

/// Weight of the grains and what the floor carries of it (N), once it has sunk by a tenth of a diameter: only then do the walls hold all they
/// can.
fn on_the_floor(mut bed: CpuEngine) -> [f64; 2] {
    let weight = bed.state().mass() * G;
    let (mut sum, mut count) = (0.0, 0.0);
    for k in 1..=200 {
        let mut setup = bed.setup().clone();
        setup.walls[0].point[2] = -0.1 * D * f64::from(k) / 200.0;
        bed.set_setup(setup).unwrap();
        bed.advance(20, &mut []).unwrap();
        if k > 100 {
            (sum, count) = (sum - bed.state().wall_force[0][2], count + 1.0);
        }
    }
    [weight, sum / count]
}

/// Janssen (1895): the floor carries rho g A l (1 - exp(-H/l)), one length l for all heights.
#[test]
#[ignore = "minutes: run by cargo xtask validate dem-p"]
fn case_2_11_a_silo_floor_carries_ever_less_of_what_is_added() {
    let base = 8.0 * D;
    let floor: Vec<[f64; 2]> =
        [600, 1200, 2400, 4800].map(|count| on_the_floor(poured(base, base, Fill::Count(count)))).to_vec();
    // The length as a weight: from the highest fill.
    let janssen = |w: f64, l: f64| l * (1.0 - (-w / l).exp());
    let (mut low, mut high) = (1e-3, 1e3);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if janssen(floor[3][0], middle) < floor[3][1] { low = middle } else { high = middle }
    }
    println!("weight and floor force (N): {floor:?}");
    for [w, f] in &floor[..3] {
        relative("2.11 silo", &format!("floor force under {w:.1} N of grains"), "N", janssen(*w, low), *f, 0.2);
    }
    let added = (floor[3][1] - floor[2][1]) / (floor[3][0] - floor[2][0]);
    below("2.11 silo", "share of the upper half's weight that the floor feels", "1", added, 0.15);
    let plot = ["silo", "2.11: what the floor of a silo carries", "weight of the grains", "N", "force", "N"];
    let law = |k: i32| [0.025 * f64::from(k) * floor[3][0], janssen(0.025 * f64::from(k) * floor[3][0], low)];
    curve(plot, "line", "Janssen", &(0..=40).map(law).collect::<Vec<_>>());
    curve(plot, "points", "computed", &floor);
}

/// 2.12: glass beads r 3 mm, rho 2550, E 4e7, nu .22, e .87, mu .18 under 3.1 to 24.2 kPa, in the shear box of the virtual soil tests (16 x 8 x
/// 10 diameters, quasi-static by its inertial number).
#[test]
#[ignore = "minutes: run by cargo xtask validate dem-p"]
fn case_2_12_glass_beads_shear_in_proportion_to_the_normal_stress() {
    let text = r#"{"soil": {"radius": {"equal": 0.003}, "density": 2550, "friction": 0.18, "restitution": 0.87, "young_modulus": 4e7,
        "poisson_ratio": 0.22, "rolling_friction": 0, "spinning_friction": 0}, "bed": {"settle": {"energy": 1e-3}}}"#;
    let spec: Terrain = serde_json::from_str(text).unwrap();
    spec.check("beads").unwrap();
    let found = shear(&Soil::new(&spec), &[3100.0, 6400.0, 12_500.0, 24_200.0], 1, &mut |_, _| true).unwrap();
    let points: Vec<[f64; 2]> = found.tests.iter().map(|t| [t.normal, t.residual]).collect();
    println!("normal and shear stress (Pa): {points:?}");
    let n = points.len() as f64;
    let mean = [0, 1].map(|c| points.iter().map(|p| p[c]).sum::<f64>() / n);
    let of = |a: usize, b: usize| points.iter().map(|p| (p[a] - mean[a]) * (p[b] - mean[b])).sum::<f64>();
    let correlation = of(0, 1) / (of(0, 0) * of(1, 1)).sqrt();
    figure("2.12 direct shear", "correlation of shear and normal stress", "1", 1.0, correlation, 0.005);
    println!(
        "\nVALIDATION|2.12 direct shear|friction angle, residual|deg||{:.2}|reported",
        found.friction_angle.to_degrees()
    );
    println!("\nVALIDATION|2.12 direct shear|friction angle, peak|deg||{:.2}|reported", found.peak_angle.to_degrees());
    below("2.12 direct shear", "cohesion over the greatest normal stress", "1", found.cohesion / 24_200.0, 0.02);
    let plot = ["shear", "2.12: direct shear of glass beads", "normal stress", "Pa", "shear stress", "Pa"];
    let line = |x: f64| [x, found.cohesion + x * found.friction_angle.tan()];
    curve(plot, "line", &format!("{:.1} deg", found.friction_angle.to_degrees()), &[line(0.0), line(26_000.0)]);
    curve(plot, "points", "computed", &points);
}
