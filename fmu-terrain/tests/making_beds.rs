//! Beds of a specification: distributions, species, ways of placing, compaction.

use fmu_terrain::config::Terrain;
use fmu_terrain::dem::{CpuEngine, Grain, GrainEngine, Setup, Surface, prepare, prepare_with};
use fmu_terrain::dem_c::{ConeEngine, ConeSetup};

fn bed(text: &str) -> (CpuEngine, f64) {
    let spec: Terrain = serde_json::from_str(text).unwrap();
    spec.check("test").unwrap();
    let mut setup = spec.setup(&[]);
    setup.expected_overlap = 0.1;
    let (engine, report) = prepare(setup, &spec.recipe(), 1, &mut |_, _| true).unwrap();
    (engine, report.height)
}

const BOX: &str = r#""length": 0.12, "width": 0.1, "fill": {"count": 700}"#;

#[test]
fn shaking_and_pressing_make_a_bed_denser() {
    let soil = r#""soil": {"radius": {"equal": 0.005}, "friction": 0.5, "rolling_friction": 0.1}"#;
    let (_, loose) = bed(&format!("{{{soil}, \"bed\": {{{BOX}}}}}"));
    let shake = r#""compaction": [{"vibrate": {"amplitude": 4e-4, "frequency": 40, "time": 0.5}}]"#;
    let (shaken, dense) = bed(&format!("{{{soil}, \"bed\": {{{BOX}, {shake}}}}}"));
    let press = r#""compaction": [{"press": {"pressure": 2e4, "time": 0.02}}]"#;
    let (_, pressed) = bed(&format!("{{{soil}, \"bed\": {{{BOX}, {press}}}}}"));
    println!("height loose {loose:.5}, shaken {dense:.5}, pressed {pressed:.5} m");
    assert!(dense < 0.99 * loose && pressed < loose, "{loose} {dense} {pressed}");
    assert_eq!(shaken.setup().gravity, [0.0, 0.0, -9.81]);
}

/// Whole and of tiles, laid with less friction a bed lies denser, and has the specification's friction afterwards.
#[test]
fn less_friction_while_it_is_laid_makes_a_bed_denser() {
    let soil =
        r#""soil": {"radius": {"equal": 0.005}, "friction": 0.6, "rolling_friction": 0.2, "spinning_friction": 0.1}"#;
    for place in [BOX, r#""length": 0.2, "width": 0.08, "fill": {"count": 900}, "tile": 0.065"#] {
        let at = |laying: f64| {
            let (engine, height) = bed(&format!("{{{soil}, \"bed\": {{{place}, \"laying\": {laying}}}}}"));
            let [own, ..] = engine.setup().materials[..] else { panic!("no material") };
            assert_eq!([own.friction, own.rolling_friction, own.spinning_friction], [0.6, 0.2, 0.1]);
            height
        };
        let [loose, middle, dense] = [1.0, 0.5, 0.0].map(at);
        println!("height {loose:.5}, laid with half its friction {middle:.5}, with none {dense:.5} m");
        assert!(middle < 0.99 * loose && dense < 0.97 * middle, "{loose} {middle} {dense}");
    }
}

/// The same with complementarity contacts: rolling resistance, which lists have room for only where it acts, comes back too.
#[test]
fn less_friction_while_it_is_laid_makes_a_bed_of_dem_c_denser() {
    let at = |laying: f64| {
        let text = format!(
            r#"{{"soil": {{"radius": {{"equal": 0.005}}, "friction": 0.6, "rolling_friction": 0.2}}, "bed": {{{BOX}, "laying": {laying}}}}}"#
        );
        let spec: Terrain = serde_json::from_str(&text).unwrap();
        let setup = Setup { step: 2e-4, ..spec.setup(&[]) };
        let new = |grains: &[Grain]| ConeEngine::new(setup.clone(), ConeSetup::default(), grains, 1);
        let (engine, report) = prepare_with(new, false, &spec.recipe(), &mut |_, _| true).unwrap();
        let own = engine.setup().materials[0];
        assert_eq!([own.friction, own.rolling_friction], [0.6, 0.2]);
        report.height
    };
    let [loose, dense] = [1.0, 0.0].map(at);
    println!("DEM-C: height {loose:.5}, laid without friction {dense:.5} m");
    assert!(dense < 0.95 * loose, "{loose} {dense}");
}

/// What a bed was laid with matters to its density alone: at a slope between the two frictions it stays where it is.
#[test]
fn a_bed_laid_with_less_friction_stands_with_its_own() {
    let tilted = |laying: f64, friction: f64| {
        let soil =
            format!(r#""soil": {{"radius": {{"equal": 0.005}}, "friction": {friction}, "rolling_friction": 0.2}}"#);
        let (mut engine, _) = bed(&format!(
            "{{{soil}, \"bed\": {{\"length\": 0.12, \"width\": 0.1, \"fill\": {{\"count\": 700}}, \"laying\": {laying}}}}}"
        ));
        let before: Vec<f64> = engine.state().by_id().iter().map(|&i| engine.state().rows[i as usize][1]).collect();
        let (sin, cos) = 15_f64.to_radians().sin_cos();
        engine.set_gravity([0.0, -9.81 * sin, -9.81 * cos]);
        let steps = (0.3 / engine.setup().step) as u32;
        engine.advance(steps, &mut []).unwrap();
        let after = engine.state().by_id().iter().map(|&i| engine.state().rows[i as usize][1]).collect::<Vec<_>>();
        before.iter().zip(&after).map(|(a, b)| (a - b).abs()).sum::<f64>() / before.len() as f64
    };
    let (own, smooth) = (tilted(0.1, 0.6), tilted(1.0, 0.06));
    println!(
        "mean way along the slope: laid with a tenth of its friction {own:.2e}, always with so little {smooth:.2e} m"
    );
    assert!(own < 0.1 * smooth && smooth > 5e-4, "{own} {smooth}");
}

#[test]
fn species_have_their_own_material_and_a_mixture_settles() {
    let (engine, height) = bed(&format!(
        r#"{{"soil": {{"radius": {{"normal": {{"mean": 0.005, "deviation": 0.0005, "least": 0.004, "greatest": 0.006}}}},
            "species": [{{"share": 0.2, "radius": {{"list": [{{"radius": 0.006, "share": 1}}, {{"radius": 0.007, "share": 2}}]}},
            "density": 3000, "surface": {{"friction": 0.3}}}}]}},
            "bed": {{{BOX}, "placing": "poisson_disk"}}}}"#
    ));
    let rows = &engine.state().rows;
    let gravel: Vec<_> = rows.iter().filter(|r| r[11] != 0.0).collect();
    assert!((100..190).contains(&gravel.len()), "{}", gravel.len());
    assert!(gravel.iter().all(|r| r[3] == 0.006 || r[3] == 0.007));
    assert!((engine.setup().materials[gravel[0][11] as usize].friction - 0.3).abs() < 1e-12);
    let surface = Surface::of(engine.state(), 0.12, 0.1).mean();
    assert!((surface - height).abs() < 1e-12 && height > 0.03);
}

/// Layers come to rest above what is listed before them, on every way of placing; only grains at the border mix.
#[test]
fn layers_lie_one_above_the_other() {
    for placing in ["grid", "hcp", "poisson_disk"] {
        let (engine, _) = bed(&format!(
            r#"{{"soil": {{"radius": {{"equal": 0.005}}, "friction": 0.5,
                "species": [{{"share": 0.4, "radius": {{"equal": 0.0045}}, "density": 2700, "layer": true}},
                            {{"share": 0.2, "radius": {{"equal": 0.004}}, "density": 2600, "layer": true}}]}},
                "bed": {{{BOX}, "placing": "{placing}"}}}}"#
        ));
        let heights = |radius: f64| -> Vec<f64> {
            let mut z: Vec<f64> = engine.state().rows.iter().filter(|r| r[3] == radius).map(|r| r[2]).collect();
            z.sort_by(f64::total_cmp);
            z
        };
        let [below, middle, above] = [0.005, 0.0045, 0.004].map(heights);
        assert_eq!(below.len() + middle.len() + above.len(), engine.state().rows.len());
        // Layers of two to four grains: those at the border fall between each other, half of a layer lies above four fifths of the one below.
        for (low, high) in [(&below, &middle), (&middle, &above)] {
            let (top, bottom) = (low[low.len() * 4 / 5], high[high.len() / 2]);
            assert!(top < bottom, "{placing}: {top} above {bottom}");
        }
    }
}

#[test]
fn faults_of_mixtures_and_compaction_are_named() {
    let text = r#"{"soil": {"radius": {"normal": {"mean": 0.01, "deviation": 0.001, "least": 0.004, "greatest": 0.006}},
        "species": [{"share": 1.5, "radius": {"list": []}, "density": 2500}]},
        "bed": {"laying": 1.5, "compaction": [{"press": {"pressure": -1, "time": 0.1}}]}}"#;
    let e = serde_json::from_str::<Terrain>(text).unwrap().check("test").unwrap_err().to_string();
    for path in [
        "soil.radius.normal.mean",
        "species[0].share",
        "species[0].radius.list",
        "compaction[0].press.pressure",
        "bed.laying",
    ] {
        assert!(e.contains(path), "{path} not in {e}");
    }
}
