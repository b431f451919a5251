//! Validation 2.6: a sphere held by a constant adhesion hangs below another one, or falls.

#[path = "common/checks.rs"]
mod checks;

use checks::figure;
use fmu_terrain::dem::{Adhesion, CpuEngine, DemError, Grain, GrainEngine, Material, Setup};

/// Two spheres of 1 kg, the upper one fixed; gravity grows from zero to `g` within 0.5 s, since a step in load would
/// overshoot. Distance of the centres less the diameter at the end.
fn gap_under(g: f64, adhesion_time: f64) -> Result<f64, DemError> {
    let adhesion = Adhesion { constant: 10.0, ..Adhesion::default() };
    let material = Material { young_modulus: 1e7, restitution: 0.2, adhesion, ..Material::default() };
    let r = 0.05;
    let density = 1.0 / (4.0 / 3.0 * std::f64::consts::PI * f64::powi(r, 3));
    let grains = [
        Grain { fixed: true, ..Grain::at([0.0, 0.0, 1.0], r, density) },
        Grain::at([0.0, 0.0, 1.0 - 2.0 * r + 1e-9], r, density),
    ];
    let setup = |g: f64| Setup {
        step: 2e-5,
        gravity: [0.0, 0.0, -g],
        materials: vec![material],
        adhesion_time,
        ..Setup::default()
    };
    let mut engine = CpuEngine::new(setup(0.0), &grains, 1)?;
    engine.advance(25_000, &mut [])?;
    for k in 1..=100 {
        engine = CpuEngine::with_state(setup(g * f64::from(k) / 100.0), engine.state().clone(), 1)?;
        engine.advance(250, &mut [])?;
    }
    engine.advance(50_000, &mut [])?;
    let z = |id: u32| {
        let s = engine.state();
        s.rows[s.ids.iter().position(|&i| i == id).unwrap()][2]
    };
    Ok(z(0) - z(1) - 2.0 * r)
}

#[test]
fn case_2_6_ten_newtons_hold_one_kilogram_at_8_and_not_at_10_1() {
    for adhesion_time in [0.0, 0.05] {
        let hangs = gap_under(8.0, adhesion_time).unwrap();
        assert!(hangs < 0.0, "it should hang: gap {hangs}");
        let case = format!("2.6 adhesion grown in {adhesion_time} s");
        let fell = |gap: f64| f64::from(u8::from(gap > 0.0));
        figure(&case, "falls at g 8 m/s2 (1 yes, 0 no)", "1", 0.0, fell(hangs), 0.0);
        let falls = gap_under(10.1, adhesion_time).unwrap();
        assert!(falls > 1.0, "it should fall: gap {falls}");
        figure(&case, "falls at g 10.1 m/s2 (1 yes, 0 no)", "1", 1.0, fell(falls), 0.0);
    }
}
