//! The platform before the box: it carries bodies at the height of the settled bed.

#[path = "common/checks.rs"]
mod checks;
#[path = "common/terrain.rs"]
mod terrain;

use checks::relative;
use terrain::Terrain;

const H: f64 = 2e-4;
const RADIUS: f64 = 0.1;
const WIDTH: f64 = 0.08;
const SPEC: &str = r#"{"soil": {"radius": {"equal": 0.006}, "young_modulus": 2e6},
    "bed": {"length": 0.4, "width": 0.12, "fill": {"depth": 0.03}, "platform": {"length": 0.5, "friction": 0.6}}}"#;

/// A wheel as a cylinder whose lowest point is `depth` below the top of the bed and the platform.
fn wheel(threads: i32) -> (Terrain, f64) {
    let mut t = Terrain::of(fmu_terrain::dem_p::model(), SPEC);
    let vr = t.vr("threads");
    t.0.set_integer(vr, threads).unwrap();
    t.string("body[1].shape", "cylinder");
    t.set("body[1].radius", RADIUS);
    t.set("body[1].width", WIDTH);
    t.begin().unwrap();
    let top = t.get("height");
    place(&mut t, -0.45, top, 0.0);
    t.0.exit_initialization().unwrap();
    (t, top)
}

fn place(t: &mut Terrain, x: f64, z: f64, depth: f64) {
    t.xyz("body[1].position", [x, 0.0, z + RADIUS - depth]);
    t.set("body[1].orientation.w", 1.0);
}

#[test]
fn it_carries_a_wheel_by_depth_and_holds_it_by_friction() {
    let (mut t, top) = wheel(1);
    let depth = 1e-4;
    place(&mut t, -0.45, top, depth);
    t.advance(0, H).unwrap();
    // A segment of the tread: force = k width * integral of the depth along the circumference, its normals tilted.
    let k = 1e8;
    let half = (1.0 - depth / RADIUS).acos();
    let n = 2000;
    let d = |a: f64| (RADIUS * a.cos() - (RADIUS - depth)).max(0.0) * a.cos();
    let step = 2.0 * half / f64::from(n);
    let integral: f64 = (0..n).map(|i| d(-half + (f64::from(i) + 0.5) * step) * step).sum();
    let f = t.get_xyz("body[1].force");
    // 360 points around the tread: some five of them touch.
    relative("platform", "force on a wheel pressed in by 0.1 mm", "N", k * WIDTH * RADIUS * integral, f[2], 0.1);
    assert!(f[0].abs() < 1e-9 && f[1].abs() < 1e-9, "{f:?}");
    // Dragged along, it is held by the lesser friction: 0.5 of the body.
    for i in 1..200 {
        t.set("body[1].velocity.x", 0.05);
        place(&mut t, -0.45 + 0.05 * i as f64 * H, top, depth);
        t.advance(i, H).unwrap();
    }
    let f = t.get_xyz("body[1].force");
    relative("platform", "friction of a dragged wheel over its load", "1", -0.5, f[0] / f[2], 0.02);
}

#[test]
fn a_wheel_goes_from_platform_to_soil_with_the_same_bits_for_threads_and_after_a_restore() {
    let run = |threads: i32, save_at: usize| {
        let (mut t, top) = wheel(threads);
        let (mut forces, mut saved) = (Vec::new(), Vec::new());
        for i in 0..1000 {
            let x = -0.3 + 1.0 * i as f64 * H;
            if i == save_at {
                saved = t.0.save().unwrap();
            }
            if i == save_at + 50 && !saved.is_empty() {
                // Back, and once more: nothing is left over.
                t.0.restore(&saved).unwrap();
                for j in save_at..save_at + 50 {
                    place(&mut t, -0.3 + j as f64 * H, top, 2e-4);
                    t.set("body[1].velocity.x", 1.0);
                    t.advance(j, H).unwrap();
                }
            }
            place(&mut t, x, top, 2e-4);
            t.set("body[1].velocity.x", 1.0);
            t.advance(i, H).unwrap();
            forces.push(t.get_xyz("body[1].force").map(f64::to_bits));
        }
        (forces, t.get("dissipated_energy").to_bits())
    };
    let (one, heat) = run(1, usize::MAX - 100);
    let load = |k: usize| f64::from_bits(one[k][2]);
    // On the platform, then beside it: centre at -0.3, -0.2 (the edge), -0.1 m.
    assert!((load(100) - 13.5).abs() < 1.5, "{} N on the platform", load(100));
    assert!(load(999) < 0.2 * load(100) && load(999) >= 0.0, "{} N over the soil", load(999));
    assert_eq!(run(2, usize::MAX - 100), (one.clone(), heat), "two threads");
    assert_eq!(run(1, 470), (one, heat), "saved and restored at the edge");
}

#[test]
fn probes_see_it_and_what_leaves_it_is_told() {
    let (mut t, top) = wheel(1);
    t.put("probe.position", &[-0.45, 0.0, 0.0, -0.8, 0.0, 0.0]);
    assert_eq!(t.array("probe.height"), [top, 0.0], "on the platform, and beyond it");
    assert_eq!(t.array("probe.friction")[0], 0.6);
    place(&mut t, -0.9, top, 0.0);
    let e = t.advance(0, H).unwrap_err();
    assert!(e.contains("body[1]") && e.contains("-0.7000") && e.contains("it has left the soil"), "{e}");
    let mut wrong = Terrain::of(
        fmu_terrain::dem_p::model(),
        r#"{"bed": {"platform": {"length": -1, "friction": 20, "contact": {"stiffness": 0}}}}"#,
    );
    let e = wrong.begin().unwrap_err();
    for part in ["3 faults", "bed.platform.length", "bed.platform.friction", "bed.platform.contact.stiffness"] {
        assert!(e.contains(part), "{part}: {e}");
    }
}
