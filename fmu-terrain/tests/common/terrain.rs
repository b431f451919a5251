//! A terrain unit through the safe side of the interface: variables by name.

#![allow(dead_code)]

use terramech_fmi2::Model;
use terramech_fmi2::instance::Instance;

/// An instance of a model.
pub struct Terrain(pub Instance);

impl Terrain {
    /// Before setup; the log goes to the test's output.
    pub fn of(model: Model, specification: &str) -> Self {
        let mut t = Self(Instance::new(model, None, Box::new(|_, text| println!("{text}"))));
        t.string("specification", specification);
        t
    }
    pub fn vr(&self, name: &str) -> u32 {
        self.0.model().table.find(name).unwrap_or_else(|| panic!("no variable {name}")).0
    }
    pub fn string(&mut self, name: &str, value: &str) {
        let vr = self.vr(name);
        self.0.set_string(vr, value).unwrap();
    }
    pub fn set(&mut self, name: &str, x: f64) {
        let vr = self.vr(name);
        self.0.set_real(vr, x).unwrap();
    }
    pub fn xyz(&mut self, name: &str, x: [f64; 3]) {
        ["x", "y", "z"].iter().zip(x).for_each(|(a, x)| self.set(&format!("{name}.{a}"), x));
    }
    pub fn get(&mut self, name: &str) -> f64 {
        let vr = self.vr(name);
        self.0.real(vr).unwrap()
    }
    pub fn get_xyz(&mut self, name: &str) -> [f64; 3] {
        ["x", "y", "z"].map(|a| self.get(&format!("{name}.{a}")))
    }
    pub fn array(&mut self, name: &str) -> Vec<f64> {
        let vr = self.vr(name);
        self.0.real_array(vr).unwrap().to_vec()
    }
    pub fn integers(&mut self, name: &str) -> Vec<i32> {
        let vr = self.vr(name);
        self.0.integer_array(vr).unwrap().to_vec()
    }
    pub fn put(&mut self, name: &str, x: &[f64]) {
        let vr = self.vr(name);
        self.0.set_real_array(vr, x).unwrap();
    }
    pub fn begin(&mut self) -> Result<(), String> {
        self.0.setup(0.0, None).map_err(|e| e.message)?;
        self.0.enter_initialization().map_err(|e| e.message)
    }
    pub fn start(&mut self) -> Result<(), String> {
        self.begin()?;
        self.0.exit_initialization().map_err(|e| e.message)
    }
    /// From `k` to `k + 1` times `h`.
    pub fn advance(&mut self, k: usize, h: f64) -> Result<(), String> {
        self.0.do_step(k as f64 * h, h).map_err(|e| e.message)
    }
}
