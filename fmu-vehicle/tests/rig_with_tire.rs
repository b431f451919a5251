//! Rig and rigid tire step side by side on a plane with friction, as the master couples them: all outputs are read before
//! any input is set.

use terramech_fmi2::instance::Instance;

const R: f64 = 0.058;
const FRICTION: f64 = 0.4;

struct Pair {
    rig: Instance,
    tire: Instance,
    /// Force and moment of the plane on the wheel, means over the last step.
    contact: [f64; 6],
    time: f64,
}

fn vr(unit: &Instance, name: &str) -> u32 {
    unit.model().table.find(name).unwrap_or_else(|| panic!("no variable {name}")).0
}
fn get(unit: &mut Instance, name: &str) -> f64 {
    let vr = vr(unit, name);
    unit.real(vr).unwrap_or_else(|e| panic!("{}", e.message))
}
fn set(unit: &mut Instance, name: &str, x: f64) {
    let vr = vr(unit, name);
    unit.set_real(vr, x).unwrap_or_else(|e| panic!("{}", e.message));
}

fn state_names() -> Vec<String> {
    let mut names = Vec::new();
    for (quantity, axes) in
        [("position", "xyz"), ("orientation", "wxyz"), ("velocity", "xyz"), ("angular_velocity", "xyz")]
    {
        names.extend(axes.chars().map(|a| format!("{quantity}.{a}")));
    }
    names
}
fn wrench_names() -> Vec<String> {
    ["force", "moment"].iter().flat_map(|q| "xyz".chars().map(move |a| format!("{q}.{a}"))).collect()
}

impl Pair {
    fn new(specification: &str) -> Self {
        let silent = || Box::new(|_, _: &str| {});
        let mut rig = Instance::new(fmu_vehicle::rig::model(), None, silent());
        let mut tire = Instance::new(fmu_tire::rigid::model(), None, silent());
        let specification_vr = vr(&rig, "specification");
        rig.set_string(specification_vr, specification).unwrap();
        for unit in [&mut rig, &mut tire] {
            unit.setup(0.0, None).unwrap();
            unit.enter_initialization().unwrap_or_else(|e| panic!("{}", e.message));
        }
        for (from, to) in [
            ("radius", "wheel[1].tire_radius"),
            ("outer_radius", "wheel[1].outer_radius"),
            ("hub.mass", "wheel[1].hub_mass"),
            ("hub.inertia.xx", "wheel[1].hub_inertia.xx"),
            ("hub.inertia.yy", "wheel[1].hub_inertia.yy"),
            ("hub.inertia.zz", "wheel[1].hub_inertia.zz"),
        ] {
            let x = get(&mut tire, from);
            set(&mut rig, to, x);
        }
        let mut pair = Self { rig, tire, contact: [0.0; 6], time: 0.0 };
        pair.wheel_to_tire();
        pair.rig.exit_initialization().unwrap();
        pair.tire.exit_initialization().unwrap();
        pair
    }
    fn wheel_to_tire(&mut self) {
        for name in state_names() {
            let x = get(&mut self.rig, &format!("wheel[1].{name}"));
            set(&mut self.tire, &format!("wheel.{name}"), x);
        }
    }
    /// A Hertz-like plane with regularised friction, on the mesh's mean velocities: what a terrain would give.
    fn plane(&mut self, size: f64) -> [f64; 6] {
        let (p, v) = (vr(&self.tire, "mesh.position"), vr(&self.tire, "mesh.velocity"));
        let p = self.tire.real_array(p).unwrap().to_vec();
        let v = self.tire.real_array(v).unwrap().to_vec();
        let n = p.len() as f64 / 3.0;
        let mean = |x: &[f64], k: usize| x.chunks_exact(3).map(|c| c[k]).sum::<f64>() / n;
        let (z, vz, vx) = (mean(&p, 2), mean(&v, 2), mean(&v, 0));
        let omega = get(&mut self.rig, "wheel_speed");
        let depth = (R - z - 0.5 * size * vz).max(0.0);
        let normal = (25.0 / 1e-3f64.powf(1.5) * depth.powf(1.5) - 1000.0 * depth.sqrt() * vz).max(0.0);
        let sliding = vx - omega * R;
        let friction = -FRICTION * normal * (sliding / 1e-3).tanh();
        // The contact point is R below the centre: (0, 0, -R) x (fx, 0, fz).
        [friction, 0.0, normal, 0.0, -R * friction, 0.0]
    }
    fn step(&mut self, size: f64) {
        let new_contact = self.plane(size);
        let wrench: Vec<f64> = wrench_names().iter().map(|n| get(&mut self.tire, &format!("wheel.{n}"))).collect();
        self.wheel_to_tire();
        for (name, x) in wrench_names().iter().zip(self.contact) {
            set(&mut self.tire, &format!("contact.{name}"), x);
        }
        for (name, x) in wrench_names().iter().zip(wrench) {
            set(&mut self.rig, &format!("wheel[1].{name}"), x);
        }
        self.rig.do_step(self.time, size).unwrap_or_else(|e| panic!("{}", e.message));
        self.tire.do_step(self.time, size).unwrap_or_else(|e| panic!("{}", e.message));
        self.contact = new_contact;
        self.time += size;
    }
}

#[test]
fn a_driven_wheel_pulls_a_braked_one_drags_and_the_plane_carries_both() {
    for (slip, sign) in [(0.5, 1.0), (-0.5, -1.0), (-1.0, -1.0)] {
        let mut pair = Pair::new(&format!(
            r#"{{"load": {{"mass": 2}}, "drive": {{"slip": {slip}, "speed": 0.1, "delay": 0.1, "ramp": 0.2}}}}"#
        ));
        let size = 2e-4;
        while pair.time < 1.5 {
            pair.step(size);
        }
        // 2 kg of the slide and 0.5 kg of the tire, counted once.
        let load = 2.5 * 9.81;
        let rig = &mut pair.rig;
        assert!((get(rig, "wheel_force_filtered.z") - load).abs() < 0.02, "{}", get(rig, "wheel_force_filtered.z"));
        let pull = get(rig, "drawbar_pull_filtered");
        assert!((pull - sign * FRICTION * load).abs() < 0.02, "{slip}: {pull}");
        let torque = get(rig, "wheel_torque_filtered");
        assert!((torque - sign * FRICTION * load * R).abs() < 0.002, "{slip}: {torque}");
        assert!((get(rig, "sinkage") - 1e-3).abs() < 2e-5, "{}", get(rig, "sinkage"));
        assert!((get(rig, "slip") - slip).abs() < 1e-12);
    }
}

#[test]
fn the_wheel_stands_still_though_forces_come_two_steps_late() {
    // Stiffness 37 kN/m on 2.5 kg; at 5e-4 s the lag's negative damping is 37 N s/m, slide and plane damp with 57.
    for size in [1e-4, 5e-4] {
        let mut pair = Pair::new(r#"{"load": {"mass": 2}}"#);
        while pair.time < 2.0 {
            pair.step(size);
        }
        let speed = get(&mut pair.rig, "wheel[1].velocity.z").abs();
        assert!(speed < 1e-5, "H {size}: {speed} m/s");
    }
}
