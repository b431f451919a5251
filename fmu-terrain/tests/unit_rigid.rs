//! The model `terrain_rigid` through the safe side of the interface.

#[path = "common/checks.rs"]
mod checks;
#[path = "common/terrain.rs"]
mod terrain;

use checks::relative;
use std::path::{Path, PathBuf};
use terrain::Terrain;
use terramech_mechanics::TriangleMesh;
use terramech_mechanics::cylinder::Cylinder;

const H: f64 = 1e-3;

impl Terrain {
    fn new(specification: &str) -> Self {
        Self::of(fmu_terrain::rigid::model(), specification)
    }
    fn triangles(&mut self, mesh: &TriangleMesh) {
        let vr = self.vr("body[1].triangle");
        let t: Vec<i32> = mesh.triangles.iter().flatten().map(|&k| k as i32).collect();
        self.0.set_integer_array(vr, &t).unwrap();
    }
    fn exit(&mut self) {
        self.0.exit_initialization().unwrap_or_else(|e| panic!("{}", e.message));
    }
    fn step(&mut self, k: usize) {
        self.advance(k, H).unwrap();
    }
}

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&path).unwrap();
    path
}

fn specification(folder: &Path, text: &str) -> String {
    let path = folder.join("terrain.json");
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

#[test]
fn probes_see_shape_and_friction_from_files() {
    let folder = folder("rigid-probes");
    // A ramp of slope 0.1 from x = -10 m, friction 0.9 on the left and 0.3 on the right.
    std::fs::write(folder.join("heights.csv"), "0, 1, 2\n0, 1, 2\n").unwrap();
    std::fs::write(folder.join("mu.csv"), "0.9 0.9\n0.3 0.3\n").unwrap();
    let spec = specification(
        &folder,
        r#"{"rigid": {"height": 0.5, "shape": {"height_map": {"file": "heights.csv", "length": 20, "width": 4}},
            "friction_map": {"file": "mu.csv", "length": 20, "width": 1e-3}, "friction": 0.8}}"#,
    );
    let mut t = Terrain::new(&spec);
    t.begin().unwrap();
    assert_eq!(t.get("height"), 1.5);
    t.put("probe.position", &[-5.0, 5e-4, 9.0, 3.0, -5e-4, 9.0, 3.0, 1.0, 0.0]);
    assert_eq!(t.array("probe.height"), [1.0, 1.8, 1.8]);
    let n = t.array("probe.normal");
    assert!((n[0] + 0.1 / 1.01_f64.sqrt()).abs() < 1e-12 && n[1] == 0.0);
    assert_eq!(t.array("probe.friction"), [0.9, 0.3, 0.8]);
    t.exit();
    // The state has the contents of the files: they may go.
    let state = t.0.save().unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let mut u = Terrain::new("");
    u.0.restore(&state).unwrap();
    u.put("probe.position", &[3.0, -5e-4, 0.0]);
    assert_eq!(u.array("probe.height"), [1.8]);
}

#[test]
fn a_mesh_lies_on_its_plane() {
    let folder = folder("rigid-mesh");
    std::fs::write(folder.join("ramp.obj"), "v 0 -1 0\nv 2 -1 0.4\nv 2 1 0.4\nv 0 1 0\nf 1 2 3 4\n").unwrap();
    let spec = specification(&folder, r#"{"rigid": {"height": -0.1, "shape": {"mesh": {"file": "ramp.obj"}}}}"#);
    let mut t = Terrain::new(&spec);
    t.begin().unwrap();
    t.put("probe.position", &[1.0, 0.3, 0.0, 5.0, 0.0, 0.0]);
    let h = t.array("probe.height");
    assert!((h[0] - 0.2).abs() < 1e-12 && h[1] == -0.1, "{h:?}");
}

/// The wheel as each of the three shapes, 4 mm deep in the plane, rolling with a little slip.
fn wheel(shape: &str, k: usize, t: &mut Terrain, mesh: &TriangleMesh) {
    let (r, speed, omega) = (0.3, 1.0, 1.02 / 0.3);
    let time = k as f64 * H;
    let p = [speed * time, 0.0, r - 0.004];
    let angle = omega * time;
    if shape != "mesh" {
        t.xyz("body[1].position", p);
        let q = [(0.5 * angle).cos(), 0.0, (0.5 * angle).sin(), 0.0];
        ["w", "x", "y", "z"].iter().zip(q).for_each(|(a, x)| t.set(&format!("body[1].orientation.{a}"), x));
        t.xyz("body[1].velocity", [speed, 0.0, 0.0]);
        t.xyz("body[1].angular_velocity", [0.0, omega, 0.0]);
    }
    if shape == "mesh" || shape == "rigid_mesh" && k == 0 {
        let (s, c) = angle.sin_cos();
        let (mut x, mut v) = (Vec::new(), Vec::new());
        for a in &mesh.vertices {
            let arm = [c * a[0] + s * a[2], a[1], c * a[2] - s * a[0]];
            x.extend((0..3).map(|k| p[k] + arm[k]));
            v.extend([speed + omega * arm[2], 0.0, -omega * arm[0]]);
        }
        t.put("body[1].position", &x);
        t.put("body[1].velocity", &v);
        if k == 0 {
            t.triangles(mesh);
        }
    }
}

#[test]
fn three_shapes_of_one_wheel_carry_the_same() {
    // Pressure k d over the width: F = k b (area of the segment below the plane).
    let (r, d): (f64, f64) = (0.3, 0.004);
    let mesh = Cylinder::smooth(r, 0.2, 720).mesh().unwrap();
    let segment = r * r * ((r - d) / r).acos() - (r - d) * (2.0 * r * d - d * d).sqrt();
    let expected = 1e8 * 0.2 * segment;
    for shape in ["cylinder", "rigid_mesh", "mesh"] {
        let mut t = Terrain::new(r#"{"rigid": {"friction": 0.6, "contact": {"damping_speed": 1e6}}}"#);
        t.string("body[1].shape", shape);
        t.set("body[1].material.friction", 2.0);
        t.set("body[1].radius", r);
        t.set("body[1].width", 0.2);
        t.begin().unwrap();
        wheel(shape, 0, &mut t, &mesh);
        t.exit();
        let n = 60;
        for k in 0..n {
            wheel(shape, k, &mut t, &mesh);
            t.step(k);
        }
        let f = t.get_xyz("body[1].force");
        relative("5 rigid", &format!("load of a {shape} 4 mm deep: k b segment"), "N", expected, f[2], 5e-3);
        assert!(f[0] > 0.0 && f[0] < 0.6 * f[2] && f[1].abs() < 1e-9 * f[2], "{shape} drives: {f:?}");
        let m = t.get_xyz("body[1].moment");
        assert!((m[1] + f[0] * r).abs() < 0.05 * f[0] * r, "{shape}: {m:?} {f:?}");
        let energy = t.get("dissipated_energy");
        assert!(energy > 0.0, "{shape}: {energy} J");
        if shape != "cylinder" {
            let forces = t.array("body[1].contact.force");
            let sum: f64 = forces.chunks(3).map(|f| f[2]).sum();
            assert!((sum - f[2]).abs() < 1e-9 * sum, "forces on vertices sum to the wrench");
        }
    }
}

/// A block of 100 kg on the slope as a rigid mesh, moved by the mean forces: it holds or slides as tan(a) against mu says.
#[test]
fn a_block_holds_or_slides_on_a_slope() {
    for (mu, slope) in [(0.5, 0.4), (0.5, 0.7)] {
        let mut t = Terrain::new(&format!(
            r#"{{"rigid": {{"friction": {mu}, "shape": {{"plane": {{"slope": [{slope}, 0]}}}}, "contact": {{"stiffness": 1e7, "damping_speed": 0.1}}}}}}"#
        ));
        t.string("body[1].shape", "rigid_mesh");
        t.set("body[1].material.friction", 2.0);
        t.begin().unwrap();
        // A plate of 0.5 m by 0.5 m, its lower side wound downward, in the frame of the slope; the body does not turn.
        let a = f64::atan(slope);
        let (s, c) = (a.sin(), a.cos());
        let corner = |u: f64, w: f64| [c * u, w, s * u];
        let mut mesh = TriangleMesh::default();
        for i in 0..=4 {
            for j in 0..=4 {
                mesh.vertices.push(corner(f64::from(i) / 8.0 - 0.25, f64::from(j) / 8.0 - 0.25));
            }
        }
        for i in 0..4 {
            for j in 0..4 {
                let k = i * 5 + j;
                mesh.triangles.extend([[k, k + 1, k + 6], [k, k + 6, k + 5]]);
            }
        }
        t.put("body[1].position", &mesh.vertices.concat());
        t.put("body[1].velocity", &vec![0.0; 3 * mesh.vertices.len()]);
        t.triangles(&mesh);
        t.exit();
        let (mass, g) = (100.0, 9.81);
        let (mut x, mut v) = ([0.0; 3], [0.0; 3]);
        for k in 0..1500 {
            t.xyz("body[1].position", x);
            t.xyz("body[1].velocity", v);
            t.step(k);
            let f = t.get_xyz("body[1].force");
            for i in 0..3 {
                v[i] += H * (f[i] / mass - if i == 2 { g } else { 0.0 });
                x[i] += H * v[i];
            }
        }
        let down = -(v[0] * c + v[2] * s);
        let expected = if mu > slope { 0.0 } else { 1.5 * g * (s - mu * c) };
        println!("slope {slope}, friction {mu}: {down} m/s, expected {expected}");
        assert!((down - expected).abs() < 0.01 * expected.max(0.05), "slope {slope}, friction {mu}: {down} {expected}");
    }
}

#[test]
fn a_saved_terrain_continues_to_the_same_bits() {
    let mut t = Terrain::new("");
    t.string("body[1].shape", "cylinder");
    t.set("body[1].radius", 0.3);
    t.set("body[1].width", 0.2);
    t.begin().unwrap();
    wheel("cylinder", 0, &mut t, &TriangleMesh::default());
    t.exit();
    (0..20).for_each(|k| {
        wheel("cylinder", k, &mut t, &TriangleMesh::default());
        t.step(k);
    });
    let mut u = Terrain::new("");
    u.0.restore(&t.0.save().unwrap()).unwrap();
    for x in [&mut t, &mut u] {
        wheel("cylinder", 20, x, &TriangleMesh::default());
        x.step(20);
    }
    assert_eq!(t.get_xyz("body[1].force"), u.get_xyz("body[1].force"));
    assert_eq!(t.0.save().unwrap(), u.0.save().unwrap());
}

#[test]
fn faults_name_file_and_path() {
    let error = |text: &str| Terrain::new(text).begin().unwrap_err();
    let e = error(
        r#"{"rigid": {"friction": -1, "contact": {"stiffness": 0}, "obstacles": [{"half_round": {"position": [0, 0], "radius": 0, "length": 1}}]}}"#,
    );
    for part in ["3 faults", "rigid.friction", "rigid.contact.stiffness", "rigid.obstacles[0].half_round.radius"] {
        assert!(e.contains(part), "{part} missing in {e}");
    }
    let e = error(r#"{"rigid": {"shape": {"mesh": {"file": "/no/such.obj"}}}}"#);
    assert!(e.contains("rigid.shape.mesh") && e.contains("/no/such.obj"), "{e}");
    let e = error(r#"{"rigid": {"shape": {"height_map": {"file": "a.tif", "length": 1, "width": 1}}}}"#);
    assert!(e.contains("a.tif") && e.contains(".png or .csv"), "{e}");
    let e = error(r#"{"rigid": {"shape": {"height_map": {"file": "a.png", "length": 1, "width": 1}}}}"#);
    assert!(e.contains("range"), "{e}");
    let e = error(r#"{"rigid": {"shape": {"cone": {}}}}"#);
    assert!(e.contains("cone") && e.contains("height_map"), "{e}");
}
