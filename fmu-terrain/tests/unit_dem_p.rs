//! The model `terrain_dem_p` through the safe side of the interface.

#[path = "common/terrain.rs"]
mod terrain;

use terrain::Terrain;
use terramech_fmi2::instance::Instance;
use terramech_mechanics::cylinder::Cylinder;

const H: f64 = 5e-4;
const SMALL: &str =
    r#"{"soil": {"radius": {"equal": 0.006}}, "bed": {"length": 0.24, "width": 0.12, "fill": {"depth": 0.04}}}"#;

impl Terrain {
    fn new(specification: &str, threads: i32) -> Self {
        let mut t = Self::of(fmu_terrain::dem_p::model(), specification);
        let vr = t.vr("threads");
        t.0.set_integer(vr, threads).unwrap();
        t
    }
    fn step(&mut self, k: usize) -> Result<(), String> {
        self.advance(k, H)
    }
    /// A wheel of radius 50 mm, width 40 mm as body 1, its lowest point `gap` above `height` at t = 0.
    fn wheel(&mut self, shape: Shape, time: f64, height: f64) {
        let (speed, sink, omega) = (0.2, -0.3, 8.0);
        let p = [-0.03 + speed * time, 0.0, height + 0.05 + sink * time];
        let angle: f64 = omega * time;
        let q = [(0.5 * angle).cos(), 0.0, (0.5 * angle).sin(), 0.0];
        let (v, w) = ([speed, 0.0, sink], [0.0, omega, 0.0]);
        if shape != Shape::Mesh {
            self.xyz("body[1].position", p);
            ["w", "x", "y", "z"].iter().zip(q).for_each(|(a, x)| self.set(&format!("body[1].orientation.{a}"), x));
            self.xyz("body[1].velocity", v);
            self.xyz("body[1].angular_velocity", w);
        }
        if shape == Shape::Mesh || shape == Shape::RigidMesh && time == 0.0 {
            let mesh = Cylinder::smooth(0.05, 0.04, 48).mesh().unwrap();
            let (s, c) = angle.sin_cos();
            let (mut position, mut velocity) = (Vec::new(), Vec::new());
            for x in &mesh.vertices {
                let arm = [c * x[0] + s * x[2], x[1], -s * x[0] + c * x[2]];
                position.extend((0..3).map(|k| p[k] + arm[k]));
                velocity.extend([v[0] + omega * arm[2], v[1], v[2] - omega * arm[0]]);
            }
            let triangle: Vec<i32> = mesh.triangles.iter().flatten().map(|&k| k as i32).collect();
            self.mesh(&position, &velocity, &triangle).unwrap();
        }
    }
    fn mesh(&mut self, position: &[f64], velocity: &[f64], triangle: &[i32]) -> Result<(), String> {
        let (p, v, t) = (self.vr("body[1].position"), self.vr("body[1].velocity"), self.vr("body[1].triangle"));
        self.0.set_real_array(p, position).map_err(|e| e.message)?;
        self.0.set_real_array(v, velocity).map_err(|e| e.message)?;
        self.0.set_integer_array(t, triangle).map_err(|e| e.message)
    }
    fn bits(&mut self) -> Vec<u64> {
        let mut all = self.array("grain.position");
        all.extend(self.array("grain.velocity"));
        all.extend(self.array("grain.force"));
        all.extend(self.get_xyz("body[1].force"));
        all.extend(self.get_xyz("body[1].moment"));
        all.iter().map(|x| x.to_bits()).collect()
    }
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Shape {
    Mesh,
    RigidMesh,
    Cylinder,
}

fn with_wheel(shape: Shape, threads: i32) -> (Terrain, f64) {
    let mut t = Terrain::new(SMALL, threads);
    let word = match shape {
        Shape::Mesh => "mesh",
        Shape::RigidMesh => "rigid_mesh",
        Shape::Cylinder => "cylinder",
    };
    t.string("body[1].shape", word);
    t.set("body[1].radius", 0.05);
    t.set("body[1].width", 0.04);
    t.begin().unwrap();
    let height = t.get("height");
    t.wheel(shape, 0.0, height);
    t.0.exit_initialization().unwrap();
    (t, height)
}

fn run(t: &mut Terrain, shape: Shape, height: f64, steps: std::ops::Range<usize>) {
    for k in steps {
        t.wheel(shape, k as f64 * H, height);
        t.step(k).unwrap();
    }
}

#[test]
fn the_default_specification_makes_a_bed() {
    let mut t = Terrain::new("", 1);
    t.begin().unwrap();
    let height = t.get("height");
    assert!((height - 0.057).abs() < 0.004, "{height}");
    // Locked from now on, with a reason.
    let vr = t.vr("bed_load");
    let e = t.0.set_string(vr, "/tmp/x").unwrap_err().message;
    assert!(e.contains("bed_load") && e.contains("made"), "{e}");
    t.0.exit_initialization().unwrap();
    t.step(0).unwrap();
    let n = t.integers("grain.id").len();
    assert!(n > 1500 && t.array("grain.position").len() == 3 * n && t.array("grain.radius").len() == n);
    assert!(t.get("kinetic_energy") < 1e-3);
    let vr = t.vr("contact_count");
    assert!(t.0.integer(vr).unwrap() > 2 * n as i32);
}

#[test]
fn cylinder_rigid_mesh_and_moving_mesh_give_the_same_wheel() {
    let mut forces = Vec::new();
    for shape in [Shape::Cylinder, Shape::RigidMesh, Shape::Mesh] {
        let (mut t, height) = with_wheel(shape, 1);
        run(&mut t, shape, height, 0..60);
        let (f, m) = (t.get_xyz("body[1].force"), t.get_xyz("body[1].moment"));
        println!("{shape:?}: force {f:?}, moment {m:?}, dissipated {}", t.get("dissipated_energy"));
        assert!(f[2] > 1.0 && m[1] < 0.0, "{shape:?} {f:?} {m:?}");
        assert!(t.get("dissipated_energy") > 0.0);
        if shape != Shape::Cylinder {
            let (index, force) = (t.integers("body[1].contact.index"), t.array("body[1].contact.force"));
            assert!(index.windows(2).all(|w| w[0] < w[1]) && force.len() == 3 * index.len() && !index.is_empty());
            for k in 0..3 {
                let sum: f64 = force.iter().skip(k).step_by(3).sum();
                assert!((sum - f[k]).abs() < 1e-12 * f[2], "{shape:?}: vertices {sum}, wrench {}", f[k]);
            }
        }
        forces.push(f[2]);
    }
    // The facets lie inside the cylinder by 0.1 mm at most, the bed is the same to the bit.
    assert!((forces[1] / forces[0] - 1.0).abs() < 0.1, "{forces:?}");
    assert!((forces[2] / forces[1] - 1.0).abs() < 0.01, "{forces:?}");
}

#[test]
fn a_state_goes_on_bit_for_bit_on_a_fresh_instance_with_other_threads() {
    for shape in [Shape::Mesh, Shape::RigidMesh] {
        let (mut a, height) = with_wheel(shape, 1);
        run(&mut a, shape, height, 0..40);
        let bytes = a.0.save().unwrap();
        run(&mut a, shape, height, 40..60);
        let mut b = Terrain::new("", 2);
        b.0.restore(&bytes).unwrap();
        run(&mut b, shape, height, 40..60);
        assert_eq!(a.bits(), b.bits(), "{shape:?}");
    }
}

#[test]
fn a_bed_from_a_file_is_the_bed_that_was_saved() {
    let folder = std::env::temp_dir().join(format!("terramech-bed-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("settled.bed");
    let path = path.to_str().unwrap();
    let mut a = Terrain::new(SMALL, 1);
    a.string("bed_save", path);
    a.start().unwrap();
    let mut b = Terrain::new(SMALL, 2);
    b.string("bed_load", path);
    b.start().unwrap();
    for k in 0..10 {
        a.step(k).unwrap();
        b.step(k).unwrap();
    }
    assert_eq!(a.get("height"), b.get("height"));
    assert_eq!(a.bits(), b.bits());

    let mut other = Terrain::new(&SMALL.replace("0.24", "0.25"), 1);
    other.string("bed_load", path);
    let e = other.start().unwrap_err();
    assert!(e.contains("bed.length") && e.contains("settled.bed"), "{e}");
    let bytes = std::fs::read(path).unwrap();
    let mut older = bytes.clone();
    older[7] = b'1';
    std::fs::write(path, &older).unwrap();
    let mut old = Terrain::new(SMALL, 1);
    old.string("bed_load", path);
    let e = old.start().unwrap_err();
    assert!(e.contains("settled.bed") && e.contains("version '1' is not the version"), "{e}");
    std::fs::write(path, &bytes[..bytes.len() / 2]).unwrap();
    let mut cut = Terrain::new(SMALL, 1);
    cut.string("bed_load", path);
    let e = cut.start().unwrap_err();
    assert!(e.contains("cut short"), "{e}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_bed_of_tiles_sleeps_follows_and_hands_out_the_region_that_was_asked_for() {
    let text = r#"{"soil": {"radius": {"equal": 0.006}}, "bed": {"length": 0.8, "width": 0.06, "fill": {"depth": 0.03},
        "tile": 0.1, "follow": 0.1}, "dem_p": {"sleep": {"distance": 0.08}},
        "output": {"low": [-0.2, -1, 0], "high": [1, 1, 1]}}"#;
    let run = |threads: i32| {
        let mut t = Terrain::new(text, threads);
        t.string("body[1].shape", "cylinder");
        t.set("body[1].radius", 0.05);
        t.set("body[1].width", 0.04);
        t.begin().unwrap();
        let height = t.get("height");
        let place = |t: &mut Terrain, k: usize| {
            t.xyz(
                "body[1].position",
                [-0.1 + 2.0 * H * k as f64, 0.0, height + 0.05 - 0.002 * (k as f64 / 80.0).min(1.0)],
            );
            t.xyz("body[1].velocity", [2.0, 0.0, 0.0]);
            t.xyz("body[1].angular_velocity", [0.0, 40.0, 0.0]);
        };
        place(&mut t, 0);
        t.0.exit_initialization().unwrap();
        let x = |t: &mut Terrain| t.array("grain.position").chunks(3).map(|p| p[0]).collect::<Vec<_>>();
        let at_first = x(&mut t);
        assert!(!at_first.is_empty() && at_first.iter().all(|x| (-0.2..=0.4).contains(x)));
        let mut forces = Vec::new();
        // 0.3 m on: the box has followed by a tile.
        for k in 0..300 {
            place(&mut t, k);
            t.step(k).unwrap();
            forces.push(t.get_xyz("body[1].force").map(f64::to_bits));
        }
        assert!(forces.iter().skip(250).any(|f| f64::from_bits(f[2]) > 0.0));
        assert!(x(&mut t).iter().any(|x| *x > 0.41));
        forces
    };
    assert!(run(1) == run(2));
}

#[test]
fn a_place_where_no_bed_can_be_written_is_told_before_settling() {
    let mut t = Terrain::new(SMALL, 1);
    t.string("bed_save", "/no/such/folder/settled.bed");
    t.begin().unwrap();
    t.0.set_progress(Some(Box::new(|phase, _| panic!("{phase} has begun"))));
    let e = t.0.exit_initialization().unwrap_err().message;
    assert!(e.contains("bed_save /no/such/folder/settled.bed") && e.contains("cannot be written"), "{e}");
}

#[test]
fn a_bed_that_cannot_settle_is_the_specifications_fault() {
    let text = SMALL.replace("\"bed\": {", "\"bed\": {\"settle\": {\"most_time\": 0.06},");
    let mut t = Terrain::new(&text, 1);
    let e = t.start().unwrap_err();
    assert!(e.contains("did not settle within 0.06"), "{e}");
    // Input: the instance is as it was, and says the same again.
    assert_eq!(t.0.exit_initialization().unwrap_err().message, e);
}

#[test]
fn a_body_that_leaves_the_box_is_told_once_and_then_refused() {
    let said = std::sync::Arc::new(std::sync::Mutex::new(Vec::new()));
    let heard = said.clone();
    let log = move |_: terramech_fmi2::LogCategory, text: &str| heard.lock().unwrap().push(text.to_string());
    let mut t = Terrain(Instance::new(fmu_terrain::dem_p::model(), None, Box::new(log)));
    t.string("specification", SMALL);
    t.string("body[1].shape", "cylinder");
    t.set("body[1].radius", 0.05);
    t.set("body[1].width", 0.04);
    t.xyz("body[1].position", [0.0, 0.0, 0.3]);
    t.start().unwrap();
    for (k, x) in [0.06, 0.08, 0.1].into_iter().enumerate() {
        t.xyz("body[1].position", [x, 0.0, 0.3]);
        t.step(k).unwrap();
    }
    let told: Vec<String> = said.lock().unwrap().iter().filter(|s| s.contains("over no soil")).cloned().collect();
    assert!(told.len() == 1 && told[0].contains("body[1] is from x 0.0300 to 0.1300 m"), "{told:?}");
    t.xyz("body[1].position", [0.2, 0.0, 0.3]);
    let e = t.step(3).unwrap_err();
    assert!(e.contains("has left the soil") && e.contains("bed.length"), "{e}");
}

#[test]
fn faults_of_a_specification_are_told_at_once() {
    let text = r#"{"soil": {"density": -1, "friction": -2}, "bed": {"length": 0.001, "gravity": [0, 0, 1]},
        "bodies": {"surface": {"poisson_ratio": 0.7}}, "dem_p": {"skin": 7}, "scm": {"n": 0}}"#;
    let e = Terrain::new(text, 1).begin().unwrap_err();
    for path in [
        "soil.density",
        "soil.friction",
        "bed.length",
        "bed.gravity",
        "bodies.surface.poisson_ratio",
        "dem_p.skin",
        "scm.n",
    ] {
        assert!(e.contains(path), "{path} not in {e}");
    }
    let e = Terrain::new(r#"{"soil": {"colour": 1}}"#, 1).begin().unwrap_err();
    assert!(e.contains("colour"), "{e}");
    let e = Terrain::new(r#"{"dem_p": {"step": 0.01}}"#, 1).begin().unwrap_err();
    assert!(e.contains("critical") && e.contains("1.000e-2"), "{e}");
}

#[test]
fn wrong_meshes_are_named() {
    let start = |shape: &str| {
        let mut t = Terrain::new(SMALL, 1);
        t.string("body[1].shape", shape);
        t.begin().unwrap();
        t
    };
    let mut t = start("mesh");
    let e = t.mesh(&[0.0, f64::NAN, 0.0], &[], &[]).unwrap_err();
    assert!(e.contains("body[1].position") && e.contains("NaN"), "{e}");

    let mut t = start("mesh");
    t.mesh(&[0.0, 0.0, 1.0, 0.1, 0.0, 1.0, 0.2, 0.0, 1.0], &[0.0; 9], &[0, 1, 2]).unwrap();
    let e = t.0.exit_initialization().unwrap_err().message;
    assert!(e.contains("body[1]") && e.contains("area"), "{e}");

    let mut t = start("mesh");
    t.mesh(&[0.0, 0.0, 1.0, 0.1, 0.0, 1.0, 0.2, 0.1, 1.0], &[0.0; 6], &[0, 1, 2]).unwrap();
    let e = t.0.exit_initialization().unwrap_err().message;
    assert!(e.contains("velocity") && e.contains('6'), "{e}");

    let mut t = start("wedge");
    let e = t.0.exit_initialization().unwrap_err().message;
    assert!(e.contains("wedge") && e.contains("rigid_mesh"), "{e}");

    let mut t = start("cylinder");
    let e = t.0.exit_initialization().unwrap_err().message;
    assert!(e.contains("radius 0"), "{e}");
}

#[test]
fn a_fault_in_an_input_leaves_the_unit_as_it_was() {
    let (mut a, height) = with_wheel(Shape::Mesh, 1);
    let (mut b, _) = with_wheel(Shape::Mesh, 1);
    run(&mut a, Shape::Mesh, height, 0..5);
    run(&mut b, Shape::Mesh, height, 0..5);
    a.mesh(&[0.0; 9], &[0.0; 9], &[0, 1, 7]).unwrap();
    let e = a.step(5).unwrap_err();
    assert!(e.contains("triangle[2] is 7"), "{e}");
    run(&mut a, Shape::Mesh, height, 5..10);
    run(&mut b, Shape::Mesh, height, 5..10);
    assert_eq!(a.bits(), b.bits());
}

#[test]
fn settling_can_be_stopped() {
    let mut t = Terrain::new(SMALL, 1);
    t.begin().unwrap();
    let mut calls = 0;
    t.0.set_progress(Some(Box::new(move |phase, fraction| {
        assert!(phase.contains("settling") && (0.0..=1.0).contains(&fraction));
        calls += 1;
        calls < 3
    })));
    let e = t.0.exit_initialization().unwrap_err().message;
    assert!(e.contains("stopped on request"), "{e}");
    // And begun again.
    t.0.set_progress(None);
    t.0.exit_initialization().unwrap();
    t.step(0).unwrap();
}

#[test]
fn probes_see_height_normal_and_friction() {
    let mut t = Terrain::new(SMALL, 1);
    t.start().unwrap();
    let vr = t.vr("probe.position");
    t.0.set_real_array(vr, &[0.0, 0.0, 0.0, 0.05, 0.02, 0.0, 9.0, 0.0, 0.0]).unwrap();
    let (height, normal) = (t.array("probe.height"), t.array("probe.normal"));
    assert!((height[0] - 0.04).abs() < 0.012 && height[2] == 0.0, "{height:?}");
    assert!(normal.len() == 9 && normal[2] > 0.5);
    assert_eq!(t.array("probe.friction"), [0.7; 3]);
}

#[test]
fn an_obstacle_lies_on_the_bed_until_a_wheel_pushes_it_and_its_state_is_saved() {
    let spec = SMALL.replace(
        "\"bed\": {",
        r#""obstacles": [{"shape": {"box": {"edges": [0.03, 0.06, 0.03]}}, "mass": 0.3, "position": [0.05, 0.0]},
            {"shape": {"sphere": {"radius": 0.01}}, "density": 3000, "position": [-0.1, 0.04], "height": 0.08, "asleep": false}],
            "bed": {"#,
    );
    let make = |threads| {
        let mut t = Terrain::new(&spec, threads);
        t.string("body[1].shape", "cylinder");
        t.set("body[1].radius", 0.05);
        t.set("body[1].width", 0.04);
        t
    };
    let mut t = make(1);
    t.begin().unwrap();
    let height = t.get("height");
    t.0.exit_initialization().unwrap();
    let at = t.array("obstacle.position");
    assert!(at.len() == 6 && (at[2] - height - 0.015).abs() < 0.006 && at[5] == 0.08, "{at:?} {height}");
    assert_eq!(t.array("obstacle.orientation").len(), 8);
    let (vertices, triangles) = (t.array("obstacle.mesh.position").len(), t.integers("obstacle.mesh.triangle"));
    assert!(triangles.iter().all(|&k| 3 * (k as usize) < vertices) && triangles.len() > 36);
    let roll = |t: &mut Terrain, steps: std::ops::Range<usize>| {
        for k in steps {
            t.xyz("body[1].position", [-0.03 + 0.8 * k as f64 * H, 0.0, height + 0.049]);
            t.xyz("body[1].velocity", [0.8, 0.0, 0.0]);
            t.xyz("body[1].angular_velocity", [0.0, 16.0, 0.0]);
            t.step(k).unwrap();
        }
    };
    roll(&mut t, 0..60);
    let bytes = t.0.save().unwrap();
    roll(&mut t, 60..140);
    let there = t.array("obstacle.position");
    assert!(there[0] > at[0] + 0.003 && there[5] < 0.07, "{at:?} {there:?}");
    let mut other = make(2);
    other.0.restore(&bytes).unwrap();
    roll(&mut other, 60..140);
    assert_eq!(other.array("obstacle.position"), there);
    assert_eq!(other.bits(), t.bits());

    let e =
        Terrain::new(r#"{"obstacles": [{"shape": {"obj": {"file": "none.obj"}}, "mass": 1, "position": [0, 0]}]}"#, 1);
    let e = { e }.begin().unwrap_err();
    assert!(e.contains("none.obj") && e.contains("cannot be read"), "{e}");
    let e = Terrain::new(r#"{"obstacles": [{"shape": {"sphere": {"radius": -1}}, "position": [0, 0]}]}"#, 1);
    let e = { e }.begin().unwrap_err();
    assert!(e.contains("obstacles[0].shape.sphere.radius") && e.contains("exactly one of mass"), "{e}");
}

#[test]
fn a_deforming_mesh_pushes_an_obstacle_and_feels_it() {
    let spec = SMALL.replace(
        r#""bed":"#,
        r#""obstacles": [{"shape": {"sphere": {"radius": 0.06}}, "mass": 0.1, "position": [0.075, 0], "height": 0.2}], "bed":"#,
    );
    let push = |spec: &str| {
        let mut t = Terrain::new(spec, 1);
        t.string("body[1].shape", "mesh");
        t.begin().unwrap();
        // Far above the bed: nothing but the two.
        t.wheel(Shape::Mesh, 0.0, 0.15);
        t.0.exit_initialization().unwrap();
        for k in 0..40 {
            t.wheel(Shape::Mesh, k as f64 * H, 0.15);
            t.step(k).unwrap();
        }
        (t.get_xyz("body[1].force"), t.array("obstacle.velocity"), t.integers("body[1].contact.index").len())
    };
    let (force, velocity, touched) = push(&spec);
    assert!(velocity[0] > 0.1, "the sphere goes ahead of the wheel: {velocity:?}");
    assert!(force[0] <= 0.0 && touched > 0 || velocity[0] > 0.2, "{force:?}, {touched} vertices");
    assert_eq!(push(SMALL).0, [0.0; 3], "without it nothing touches");
}
