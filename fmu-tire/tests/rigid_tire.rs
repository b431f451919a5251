//! The rigid tire: mesh, masses, wrench, faults, states.

use std::cell::RefCell;
use std::rc::Rc;
use terramech_fmi2::instance::Instance;
use terramech_mechanics::{RigidState, Vec3, cylinder::Cylinder, obj, rotation};

struct Tire {
    instance: Instance,
    time: f64,
    log: Rc<RefCell<Vec<String>>>,
}

impl Tire {
    fn new(specification: &str) -> Self {
        let log = Rc::new(RefCell::new(Vec::new()));
        let sink = log.clone();
        let instance =
            Instance::new(fmu_tire::rigid::model(), None, Box::new(move |_, text| sink.borrow_mut().push(text.into())));
        let mut tire = Self { instance, time: 0.0, log };
        let vr = tire.vr("specification");
        tire.instance.set_string(vr, specification).unwrap();
        tire.instance.setup(0.0, None).unwrap();
        tire
    }
    fn entered(specification: &str) -> Self {
        let mut tire = Self::new(specification);
        tire.instance.enter_initialization().unwrap_or_else(|e| panic!("{}", e.message));
        tire
    }
    fn ready(specification: &str) -> Self {
        let mut tire = Self::entered(specification);
        tire.instance.exit_initialization().unwrap_or_else(|e| panic!("{}", e.message));
        tire
    }
    fn vr(&self, name: &str) -> u32 {
        self.instance.model().table.find(name).unwrap_or_else(|| panic!("no variable {name}")).0
    }
    fn get(&mut self, name: &str) -> f64 {
        let vr = self.vr(name);
        self.instance.real(vr).unwrap_or_else(|e| panic!("{}", e.message))
    }
    fn set(&mut self, name: &str, x: f64) {
        let vr = self.vr(name);
        self.instance.set_real(vr, x).unwrap_or_else(|e| panic!("{}", e.message));
    }
    fn place(&mut self, state: &RigidState) {
        let names: Vec<String> = ["position", "orientation", "velocity", "angular_velocity"]
            .iter()
            .flat_map(|n| {
                let axes: &[&str] = if *n == "orientation" { &["w", "x", "y", "z"] } else { &["x", "y", "z"] };
                axes.iter().map(move |a| format!("wheel.{n}.{a}"))
            })
            .collect();
        for (name, x) in names.iter().zip(state.to_array()) {
            self.set(name, x);
        }
    }
    fn reals(&mut self, name: &str) -> Vec<f64> {
        let vr = self.vr(name);
        self.instance.real_array(vr).unwrap_or_else(|e| panic!("{}", e.message)).to_vec()
    }
    fn points(&mut self, name: &str) -> Vec<Vec3> {
        self.reals(name).chunks_exact(3).map(|c| Vec3::new(c[0], c[1], c[2])).collect()
    }
    fn step(&mut self, size: f64) -> Result<(), String> {
        self.instance.do_step(self.time, size).map_err(|e| e.message)?;
        self.time += size;
        Ok(())
    }
    fn push(&mut self, index: &[i32], force: &[f64]) {
        let (i, f) = (self.vr("contact.index"), self.vr("contact.force"));
        self.instance.set_integer_array(i, index).unwrap_or_else(|e| panic!("{}", e.message));
        self.instance.set_real_array(f, force).unwrap_or_else(|e| panic!("{}", e.message));
    }
    fn wrench(&mut self) -> [Vec3; 2] {
        ["force", "moment"].map(|n| {
            let [x, y, z] = ["x", "y", "z"].map(|a| self.get(&format!("wheel.{n}.{a}")));
            Vec3::new(x, y, z)
        })
    }
}

fn moving() -> RigidState {
    RigidState {
        position: Vec3::new(1.0, -0.2, 0.3),
        orientation: rotation::exp(&Vec3::new(0.1, 2.0, 0.3)),
        velocity: Vec3::new(0.5, 0.1, -0.02),
        angular_velocity: Vec3::new(-1.0, 8.0, 0.5),
    }
}

fn body() -> Vec<Vec3> {
    Cylinder::smooth(0.058, 0.05, 60).mesh().unwrap().vertices.into_iter().map(Vec3::from).collect()
}

#[test]
fn the_mesh_is_the_wheel_s_turned_and_moved() {
    let mut tire = Tire::entered("");
    tire.place(&moving());
    // In initialization mode: where the wheel state says.
    let (state, points) = (moving(), body());
    for (p, b) in tire.points("mesh.position").iter().zip(&points) {
        assert!((p - state.to_world(b)).norm() < 1e-15);
    }
    // Set anew, read anew.
    tire.place(&RigidState::default());
    assert_eq!(tire.points("mesh.position"), points);
    tire.place(&state);
    tire.instance.exit_initialization().unwrap();
    let h = 1e-3;
    tire.step(h).unwrap();
    // At the end of the step: moved on by the velocities.
    let end = state.advanced(h);
    let (p, v) = (tire.points("mesh.position"), tire.points("mesh.velocity"));
    assert_eq!((p.len(), v.len()), (points.len(), points.len()));
    for k in 0..p.len() {
        assert!((p[k] - end.to_world(&points[k])).norm() < 1e-15);
        assert!((v[k] - end.velocity_at(&p[k])).norm() < 1e-14);
    }
    let vr = tire.vr("mesh.triangle");
    let triangles = tire.instance.integer_array(vr).unwrap();
    assert!(triangles.len().is_multiple_of(3) && triangles.iter().all(|&i| i >= 0 && (i as usize) < points.len()));
}

#[test]
fn the_wrench_goes_on_to_the_hub_as_it_comes() {
    let mut tire = Tire::ready("");
    for (k, name) in ["force.x", "force.y", "force.z", "moment.x", "moment.y", "moment.z"].iter().enumerate() {
        tire.set(&format!("contact.{name}"), k as f64 + 1.0);
    }
    assert_eq!(tire.wrench(), [Vec3::zeros(); 2]);
    tire.step(1e-3).unwrap();
    assert_eq!(tire.wrench(), [Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)]);
}

#[test]
fn forces_at_vertices_sum_to_force_and_moment_about_the_centre() {
    let mut tire = Tire::ready(r#"{"contact": "vertices"}"#);
    let state = moving();
    tire.place(&state);
    let (index, force) = ([3, 70, 71], [1.0, 0.0, 5.0, -2.0, 0.5, 7.0, 0.0, 0.0, 1.0]);
    tire.push(&index, &force);
    let h = 1e-3;
    tire.step(h).unwrap();
    let [f, m] = tire.wrench();
    assert_eq!(f, Vec3::new(-1.0, 0.5, 13.0));
    // The forces are means over the step before: arms of its middle.
    let (middle, points) = (state.advanced(-h / 2.0), body());
    let expected: Vec3 = index
        .iter()
        .zip(force.chunks_exact(3))
        .map(|(&i, f)| (middle.orientation * points[i as usize]).cross(&Vec3::new(f[0], f[1], f[2])))
        .sum();
    assert!((m - expected).norm() < 1e-15);
    tire.push(&[], &[]);
    tire.step(h).unwrap();
    assert_eq!(tire.wrench(), [Vec3::zeros(); 2]);
}

#[test]
fn forces_held_on_a_rolling_wheel_make_a_moment_of_second_order_only() {
    // A fixed point of the ground pushes upward below the axle while the wheel turns: no moment about the axle. Vertex
    // forces averaged over the step before are of the vertex that passed there.
    let error = |h: f64| {
        let mut tire = Tire::ready(r#"{"contact": "vertices"}"#);
        let omega = Vec3::new(0.0, 10.0, 0.0);
        // Vertex 0 of the mesh lies at +X of the wheel: it is below the axle in the middle of the step that ended now.
        let below = rotation::exp(&(Vec3::y() * std::f64::consts::FRAC_PI_2));
        let now =
            RigidState { orientation: rotation::turned(&below, &omega, h / 2.0), angular_velocity: omega, ..moving() };
        tire.place(&now);
        tire.push(&[0], &[0.0, 0.0, 25.0]);
        tire.step(h).unwrap();
        tire.wrench()[1].y.abs()
    };
    assert!(error(1e-3) < 1e-14 && error(1e-2) < 1e-14);
}

#[test]
fn contact_arrays_that_do_not_fit_are_told() {
    let mut tire = Tire::ready(r#"{"contact": "vertices"}"#);
    for (index, reals, parts) in [
        (vec![1, 2], 3, ["'contact.index' has 2", "'contact.force' 3"]),
        (vec![5, 5], 6, ["element 1 is 5 after 5", "ascending"]),
        (vec![-1], 3, ["element 0 is -1", "0 to"]),
        (vec![1, 100_000], 6, ["element 1 is 100000", "0 to"]),
    ] {
        tire.push(&index, &vec![1.0; reals]);
        let e = tire.step(1e-3).unwrap_err();
        assert!(parts.iter().all(|p| e.contains(p)), "{e}");
    }
    // The instance goes on when they fit again.
    tire.push(&[1], &[0.0; 3]);
    tire.step(1e-3).unwrap();
}

#[test]
fn everything_that_weighs_goes_to_the_hub() {
    let mut tire = Tire::entered(r#"{"mass": {"density": 1000}}"#);
    let volume = std::f64::consts::PI * 0.058f64.powi(2) * 0.05;
    let mass = tire.get("hub.mass");
    assert!((mass / (1000.0 * volume) - 1.0).abs() < 5e-3);
    assert!((tire.get("hub.inertia.yy") / (0.5 * mass * 0.058f64.powi(2)) - 1.0).abs() < 5e-3);
    let xx = mass * (0.058f64.powi(2) / 4.0 + 0.05f64.powi(2) / 12.0);
    assert!((tire.get("hub.inertia.xx") / xx - 1.0).abs() < 5e-3);
    assert!((tire.get("hub.inertia.zz") / xx - 1.0).abs() < 5e-3);
    let mut tire = Tire::entered(r#"{"mass": {"mass": 2, "inertia": {"xx": 0.1, "yy": 0.15, "zz": 0.1}}}"#);
    assert_eq!((tire.get("hub.mass"), tire.get("hub.inertia.yy")), (2.0, 0.15));
}

#[test]
fn grousers_reach_beyond_the_radius_that_slip_refers_to() {
    let mut tire = Tire::entered(
        r#"{"shape": {"cylinder": {"radius": 0.1, "width": 0.06, "grousers": {"count": 12, "height": 0.01, "thickness": 0.003}}}}"#,
    );
    assert_eq!(tire.get("radius"), 0.1);
    assert!((tire.get("width") - 0.06).abs() < 1e-15);
    assert!((tire.get("outer_radius") - 0.11f64.hypot(0.0015)).abs() < 1e-12);
    assert_eq!(tire.get("material.friction"), 0.5);
}

#[test]
fn a_mesh_from_a_file_beside_the_specification() {
    let folder = std::env::temp_dir().join(format!("terramech-rigid-tire-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let wheel = Cylinder::smooth(58.0, 50.0, 24).mesh().unwrap();
    std::fs::write(folder.join("wheel.obj"), obj::write(&wheel)).unwrap();
    let spec = folder.join("tire.json");
    std::fs::write(&spec, r#"{"shape": {"obj": {"file": "wheel.obj", "scale": 1e-3}}}"#).unwrap();
    let mut tire = Tire::ready(spec.to_str().unwrap());
    assert!((tire.get("radius") - 0.058).abs() < 1e-15);
    assert_eq!(tire.points("mesh.position").len(), wheel.vertices.len());
    // A state holds the mesh, not the path.
    let saved = tire.instance.save().unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let mut other = Tire::new("");
    other.instance.restore(&saved).unwrap_or_else(|e| panic!("{}", e.message));
    tire.step(1e-3).unwrap();
    other.step(1e-3).unwrap();
    assert_eq!(tire.points("mesh.position"), other.points("mesh.position"));
    assert!(!saved.windows(9).any(|w| w == b"wheel.obj"));
    let e = Tire::new(spec.to_str().unwrap()).instance.enter_initialization().unwrap_err().message;
    assert!(e.contains("tire.json") && e.contains("cannot be read"), "{e}");
}

#[test]
fn a_mesh_with_holes_is_refused() {
    let folder = std::env::temp_dir().join(format!("terramech-open-tire-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut wheel = Cylinder::smooth(0.058, 0.05, 24).mesh().unwrap();
    wheel.triangles.pop();
    std::fs::write(folder.join("open.obj"), obj::write(&wheel)).unwrap();
    let spec = folder.join("tire.json");
    std::fs::write(&spec, r#"{"shape": {"obj": {"file": "open.obj"}}}"#).unwrap();
    let e = Tire::new(spec.to_str().unwrap()).instance.enter_initialization().unwrap_err().message;
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(e.contains("shape.obj.file") && e.contains("3 boundary edges"), "{e}");
}

#[test]
fn faults_are_told_at_once_with_their_paths() {
    let refused = |text: &str| Tire::new(text).instance.enter_initialization().unwrap_err().message;
    let e = refused(
        r#"{"shape": {"cylinder": {"radius": -1}}, "mass": {"mass": 1, "density": 2},
            "material": {"restitution": 2, "poisson_ratio": 0.7}}"#,
    );
    for part in
        ["4 faults", "shape.cylinder", "radius -1", "'mass' has both", "'material.restitution' is 2", "poisson_ratio"]
    {
        assert!(e.contains(part), "{part} missing in {e}");
    }
    let e = refused(r#"{"mass": {"mass": 1, "inertia": {"xx": 1, "yy": 5, "zz": 1}}}"#);
    assert!(e.contains("mass.inertia") && e.contains("sum of the other two"), "{e}");
    let e = refused(r#"{"mass": {}}"#);
    assert!(e.contains("neither"), "{e}");
    for bad in ["NaN", "1e400"] {
        let e = refused(&format!(r#"{{"shape": {{"cylinder": {{"radius": {bad}}}}}}}"#));
        // No JSON number at all: the place in the text, not the path.
        assert!(e.contains("line 1 column"), "{e}");
    }
    let e = refused(r#"{"shape": {"cylinder": {"diameter": 1}}}"#);
    assert!(e.contains("shape.cylinder") && e.contains("diameter") && e.contains("radius"), "{e}");
    let e = refused(r#"{"shape": {"obj": {"file": "wheel.obj"}}}"#);
    assert!(e.contains("wheel.obj") && e.contains("relative path"), "{e}");
}

#[test]
fn wheel_states_and_late_specifications_are_refused() {
    let mut tire = Tire::entered("");
    tire.set("wheel.orientation.w", 0.3);
    let vr = tire.vr("mesh.position");
    let e = tire.instance.array_size(vr).unwrap_err().message;
    assert!(e.contains("wheel state") && e.contains("norm 1"), "{e}");
    tire.set("wheel.orientation.w", 1.0);
    let vr = tire.vr("specification");
    let e = tire.instance.set_string(vr, "{}").unwrap_err().message;
    assert!(e.contains("too late"), "{e}");
    tire.instance.exit_initialization().unwrap();
    assert!(tire.log.borrow().iter().any(|l| l.contains("vertices")));
    let vr = tire.vr("wheel.position.x");
    assert!(tire.instance.set_real(vr, f64::INFINITY).unwrap_err().message.contains("finite"));
}

#[test]
fn a_saved_state_goes_on_bit_for_bit() {
    let mut tire = Tire::ready(r#"{"contact": "vertices", "mass": {"density": 300}}"#);
    tire.place(&moving());
    tire.push(&[0, 4], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    tire.step(1e-3).unwrap();
    let saved = tire.instance.save().unwrap();
    let mut other = Tire::new("");
    other.instance.restore(&saved).unwrap_or_else(|e| panic!("{}", e.message));
    other.time = tire.time;
    assert_eq!(other.wrench(), tire.wrench());
    for t in [&mut tire, &mut other] {
        t.step(1e-3).unwrap();
    }
    assert_eq!(tire.instance.save().unwrap(), other.instance.save().unwrap());
    assert_eq!(tire.points("mesh.velocity"), other.points("mesh.velocity"));
}

#[test]
fn the_model_description_and_the_default_specification_are_sound() {
    let model = fmu_tire::rigid::model();
    let xml = model.xml();
    for part in ["wheel.orientation.w", "contact.force.x", "mesh.triangle", "hub.inertia.yy", "InitialDependency"] {
        assert!(xml.contains(part), "{part}");
    }
    terramech_fmi2::specification::parse::<fmu_tire::rigid::config::RigidTire>(&model.default_specification, "default")
        .unwrap();
    let schema = model.schema.to_string();
    assert!(schema.contains("grousers") && schema.contains("(kg/m3)"));
    let table = &model.table;
    let position = table.find("mesh.position").unwrap().1;
    let wheel = table.find("wheel.position.z").unwrap().0;
    assert!(position.initial_dependencies.contains(&wheel));
    assert!(table.find("hub.mass").unwrap().1.initial_dependencies.iter().all(|&d| d != wheel));
}
