//! Virtual soil tests: plausible numbers of a soil, and how they follow its properties.

use fmu_terrain::config::Terrain;
use fmu_terrain::soil::{Soil, packing, repose, shear};

fn soil(friction: f64, rolling: f64, pressure: f64) -> Soil {
    let text = format!(
        r#"{{"soil": {{"radius": {{"uniform": {{"least": 0.0055, "greatest": 0.0065}}}}, "friction": {friction},
            "rolling_friction": {rolling}, "adhesion": {{"pressure": {pressure}}}}}}}"#
    );
    let spec: Terrain = serde_json::from_str(&text).unwrap();
    spec.check("test").unwrap();
    Soil::new(&spec)
}

#[test]
fn a_poured_bed_has_a_random_packing() {
    let (density, fraction) = packing(&soil(0.5, 0.1, 0.0), 1, &mut |_, _| true).unwrap();
    println!("bulk density {density:.0} kg/m3, packing fraction {fraction:.3}");
    assert!((0.54..0.64).contains(&fraction) && (density / 2500.0 - fraction).abs() < 1e-9);
}

#[test]
fn rougher_soil_stands_steeper() {
    let angle =
        |friction, rolling| repose(&soil(friction, rolling, 0.0), 1, &mut |_, _| true).unwrap().angle.to_degrees();
    let (smooth, rough) = (angle(0.2, 0.0), angle(0.8, 0.3));
    println!("angle of repose: mu 0.2 without rolling resistance {smooth:.1}, mu 0.8 with it {rough:.1} deg");
    assert!((4.0..20.0).contains(&smooth) && (20.0..40.0).contains(&rough), "{smooth} {rough}");
}

#[test]
fn shear_stress_grows_with_the_normal_stress() {
    let sheared = shear(&soil(0.8, 0.3, 0.0), &[2000.0, 8000.0], 1, &mut |_, _| true).unwrap();
    let angle = sheared.friction_angle.to_degrees();
    println!("friction angle {angle:.1} deg, cohesion {:.0} Pa", sheared.cohesion);
    for t in &sheared.tests {
        println!("  {:.0} Pa: peak {:.0}, residual {:.0}", t.normal, t.peak, t.residual);
        assert!(t.peak >= t.residual && t.residual > 0.3 * t.normal && t.curve.len() > 40);
    }
    assert!((20.0..40.0).contains(&angle) && sheared.cohesion.abs() < 800.0, "{angle} {}", sheared.cohesion);
}
