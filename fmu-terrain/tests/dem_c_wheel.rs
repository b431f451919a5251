//! Case 3.6: a rigid wheel under load in the same settled beds, by both engines; and the exchange with a wheel at H = 1e-3 s.

#[path = "common/checks.rs"]
mod checks;
#[path = "common/sand_wheel.rs"]
mod sand_wheel;

use checks::{curve, figure};
use fmu_terrain::dem::grains::{INV_M, R};
use fmu_terrain::dem_c::ConeSetup;
use sand_wheel::{Driven, SMALL, Scene, WHEEL, Wheel};
use serde::{Deserialize, Serialize};

/// Slips and loads (N) of case 3.6, from the file of experiments: a braked wheel and a driven one.
const ROWS: [(f64, f64); 2] = [(-0.2, 23.72), (0.5, 25.28)];

fn mean_and_deviation(x: &[f64]) -> (f64, f64) {
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    (mean, (x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt())
}

/// Figures of case 3.6, one line of JSON each: what is there is not computed again, so that the case may be stopped and gone on with. Without the
/// file, or without its lines, they are made anew.
const FIGURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/validation/dem-c-wheel.jsonl");

/// A run of case 3.6 as it is kept.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Kept {
    engine: String,
    slip: f64,
    seed: u64,
    pull: f64,
    sinkage: f64,
}

fn kept() -> Vec<Kept> {
    let text = std::fs::read_to_string(FIGURES).unwrap_or_default();
    // A last line that was cut short is none.
    text.lines().filter_map(|l| serde_json::from_str(l).ok()).collect()
}

fn keep(run: &Kept) {
    use std::io::Write as _;
    let mut file = std::fs::OpenOptions::new().create(true).append(true).open(FIGURES).unwrap();
    writeln!(file, "{}", serde_json::to_string(run).unwrap()).unwrap();
}

/// Names of the engines in the order of their steps (s) and exchanges (s).
const ENGINES: [&str; 2] = ["DEM-P, 4e-5 s", "DEM-C, 1e-3 s"];

#[test]
#[ignore = "minutes: cargo xtask validate dem-c"]
fn case_3_6_both_engines_agree_within_the_scatter_of_beds() {
    let mut known = kept();
    for seed in 1..=5 {
        let mut laid = None;
        for (slip, load) in ROWS {
            for (k, engine) in ENGINES.into_iter().enumerate() {
                if known.iter().any(|r| r.engine == engine && r.slip == slip && r.seed == seed) {
                    continue;
                }
                let state = laid.get_or_insert_with(|| SMALL.bed(seed));
                let scene = Scene { wheel: Wheel { load, slip, ..WHEEL }, ..SMALL };
                let run = if k == 0 {
                    scene.drive(&mut scene.soft(state), 4e-4, 0.12)
                } else {
                    scene.drive(&mut scene.cone(state, 1e-3, ConeSetup::default()), 1e-3, 0.12)
                };
                let Driven { pull, sinkage, .. } = run;
                known.push(Kept { engine: engine.to_string(), slip, seed, pull, sinkage });
                keep(known.last().unwrap());
            }
        }
    }
    let plot = ["wheel", "3.6: the wheel in five beds", "sinkage", "mm", "pull", "N"];
    for (slip, _) in ROWS {
        let of = |engine: &str| known.iter().filter(|r| r.slip == slip && r.engine == engine).cloned().collect();
        let runs: [Vec<Kept>; 2] = ENGINES.map(of);
        for (name, runs) in ENGINES.iter().zip(&runs) {
            let points: Vec<[f64; 2]> = runs.iter().map(|r| [1e3 * r.sinkage, r.pull]).collect();
            curve(plot, "points", &format!("{name}, slip {slip}"), &points);
        }
        type Get = fn(&Kept) -> f64;
        for (quantity, unit, get) in [("drawbar pull", "N", (|r| r.pull) as Get), ("sinkage", "m", |r| r.sinkage)] {
            let [p, c] = [0, 1].map(|k| mean_and_deviation(&runs[k].iter().map(get).collect::<Vec<_>>()));
            println!("slip {slip}, {quantity}: DEM-P {:.4} +- {:.4}, DEM-C {:.4} +- {:.4} {unit}", p.0, p.1, c.0, c.1);
            let scale = if unit == "m" { 1e3 } else { 1.0 };
            let scatter = [p.1, c.1].map(|x| format!("{:.1}", scale * x)).join(" and ");
            let word = if unit == "m" { "mm" } else { unit };
            // Two deviations of a bed, the greater of the two engines'.
            figure(
                &format!("3.6 DEM-C against DEM-P, slip {slip}"),
                &format!("{quantity}, mean of five beds; scatter {scatter} {word}"),
                unit,
                p.0,
                c.0,
                2.0 * p.1.max(c.1),
            );
        }
    }
}

#[test]
fn a_wheel_that_is_told_of_its_forces_every_millisecond_does_not_ring() {
    let state = SMALL.bed(1);
    let lowest = state.rows.iter().filter(|r| r[INV_M] > 0.0).map(|r| r[2] - r[R]).fold(f64::INFINITY, f64::min);
    assert!(lowest > -1e-3, "the bed stands on its floor");
    let r = SMALL.drive(&mut SMALL.cone(&state, 1e-3, ConeSetup::default()), 1e-3, 0.02);
    // A wheel that rings is lifted and dropped by its whole load from one exchange to the next.
    assert!(r.ring < 0.2 * WHEEL.load, "the force changes by {:.2} N from exchange to exchange", r.ring);
    assert!(r.sinkage > 0.0 && r.sinkage < 0.03, "sinkage {} m", r.sinkage);
    // The relaxation would lift the wheel by mu v h, v the slip at its contacts; what is left of that is less than a thousandth of a radius.
    let [whole, left, greatest] = r.lift.means();
    println!("lift {whole:.2e} m, left of it {left:.2e} m, at most {greatest:.2e} m, {} contacts", r.lift.count);
    assert!(r.lift.count > 500.0);
    assert!(
        left < 0.3 * whole && left < 1e-3 * SMALL.grain() && greatest < 0.03 * SMALL.grain(),
        "{whole:e} {left:e} {greatest:e}"
    );
}
