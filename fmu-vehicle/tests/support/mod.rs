//! A rig behind the interface's instance, by variable names, and soils to stand on.
#![allow(dead_code)] // each test file uses its part

use std::cell::RefCell;
use std::rc::Rc;
use terramech_fmi2::instance::Instance;

pub struct Rig {
    pub instance: Instance,
    pub time: f64,
    pub log: Rc<RefCell<Vec<String>>>,
}

impl Rig {
    /// Instantiated, with this specification.
    pub fn new(specification: &str) -> Self {
        let log = Rc::new(RefCell::new(Vec::new()));
        let sink = log.clone();
        let instance = Instance::new(
            fmu_vehicle::rig::model(),
            None,
            Box::new(move |_, text| sink.borrow_mut().push(text.into())),
        );
        let mut rig = Self { instance, time: 0.0, log };
        let vr = rig.vr("specification");
        rig.instance.set_string(vr, specification).unwrap();
        rig.instance.setup(0.0, None).unwrap();
        rig
    }
    /// In initialization mode.
    pub fn entered(specification: &str) -> Self {
        let mut rig = Self::new(specification);
        rig.instance.enter_initialization().unwrap_or_else(|e| panic!("{}", e.message));
        rig
    }
    /// Ready to step.
    pub fn ready(specification: &str) -> Self {
        let mut rig = Self::entered(specification);
        rig.exit();
        rig
    }
    pub fn exit(&mut self) {
        self.instance.exit_initialization().unwrap_or_else(|e| panic!("{}", e.message));
    }
    pub fn vr(&self, name: &str) -> u32 {
        self.instance.model().table.find(name).unwrap_or_else(|| panic!("no variable {name}")).0
    }
    pub fn get(&mut self, name: &str) -> f64 {
        let vr = self.vr(name);
        self.instance.real(vr).unwrap_or_else(|e| panic!("{}", e.message))
    }
    pub fn set(&mut self, name: &str, x: f64) -> Result<(), String> {
        let vr = self.vr(name);
        self.instance.set_real(vr, x).map_err(|e| e.message)
    }
    pub fn phase(&mut self) -> i32 {
        let vr = self.vr("phase");
        self.instance.integer(vr).unwrap()
    }
    pub fn vector(&mut self, name: &str) -> [f64; 3] {
        ["x", "y", "z"].map(|a| self.get(&format!("{name}.{a}")))
    }
    pub fn orientation(&mut self) -> [f64; 4] {
        ["w", "x", "y", "z"].map(|a| self.get(&format!("wheel[1].orientation.{a}")))
    }
    pub fn push(&mut self, force: [f64; 3]) {
        for (axis, f) in ["x", "y", "z"].into_iter().zip(force) {
            self.set(&format!("wheel[1].force.{axis}"), f).unwrap();
        }
    }
    pub fn step(&mut self, size: f64) -> Result<(), String> {
        self.instance.do_step(self.time, size).map_err(|e| e.message)?;
        self.time += size;
        Ok(())
    }
    /// Every output real now.
    pub fn outputs(&mut self) -> Vec<(String, f64)> {
        let names: Vec<String> = self
            .instance
            .model()
            .table
            .variables()
            .iter()
            .filter(|v| v.start.type_name() == "Real" && !v.causality.settable())
            .map(|v| v.name.clone())
            .collect();
        names.into_iter().map(|n| (n.clone(), self.get(&n))).collect()
    }
    /// Steps of `size` on `soil` (Jacobi: the force at the start of the step, met at its end), until `time`.
    pub fn run(&mut self, soil: &mut dyn FnMut(&Contact, f64) -> [f64; 3], size: f64, time: f64) {
        while self.time < time - 0.5 * size {
            let now = self.contact();
            self.step(size).unwrap();
            let force = soil(&now, size);
            self.push(force);
        }
    }
    pub fn contact(&mut self) -> Contact {
        Contact { depth: self.get("sinkage"), velocity: self.vector("wheel[1].velocity"), slip: self.get("slip") }
    }
}

/// What a soil gets to know.
pub struct Contact {
    /// Sinkage of the undeformed wheel [m].
    pub depth: f64,
    /// Velocity of the wheel centre [m/s].
    pub velocity: [f64; 3],
    /// Slip [1].
    pub slip: f64,
}

/// Mean vertical force over a step on a plane with a Hertz-like spring and a damper that never pulls, whose wheel moves
/// on by its velocity, as a terrain does.
pub fn hertz_plane(stiffness: f64, damping: f64) -> impl FnMut(&Contact, f64) -> [f64; 3] {
    move |c, size| {
        const PARTS: u32 = 8;
        let mut mean = 0.0;
        for k in 0..PARTS {
            let t = size * (f64::from(k) + 0.5) / f64::from(PARTS);
            let depth = (c.depth - c.velocity[2] * t).max(0.0);
            let f = stiffness * depth.powf(1.5) - damping * depth.sqrt() * c.velocity[2];
            mean += if depth > 0.0 { f.max(0.0) } else { 0.0 } / f64::from(PARTS);
        }
        [0.0, 0.0, mean]
    }
}

/// Soil that keeps its deepest print: pressure grows with sinkage, unloading is twenty times as stiff.
pub fn plastic_soil(stiffness: f64) -> impl FnMut(&Contact, f64) -> [f64; 3] {
    let mut plastic = 0.0f64;
    move |c, size| {
        let depth = c.depth - c.velocity[2] * 0.5 * size;
        let elastic = 20.0 * stiffness * (depth - plastic).max(0.0);
        let limit = stiffness * depth.max(0.0);
        if elastic > limit {
            plastic = depth - limit / (20.0 * stiffness);
        }
        [0.0, 0.0, elastic.min(limit)]
    }
}
