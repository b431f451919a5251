//! A terrain unit under a flexible tire, called as its master calls it.

use fmu_tire::ancf::tire::Tire;
use nalgebra::Vector3;
use terramech_fmi2::Model;
use terramech_fmi2::instance::Instance;

/// Force (N) on each vertex that is touched.
pub type Forces = Vec<(u32, [f64; 3])>;

pub struct Soil(pub Instance);

impl Soil {
    /// Settled, with the tire's mesh as its first body; `strings`: more parameters of the unit.
    pub fn new(model: Model, bed: &str, strings: &[(&str, &str)]) -> Self {
        let mut soil = Self(Instance::new(model, None, Box::new(|_, _| ())));
        for (name, value) in [("specification", bed), ("body[1].shape", "mesh")].iter().chain(strings) {
            let vr = soil.vr(name);
            soil.0.set_string(vr, value).unwrap();
        }
        soil.0.setup(0.0, None).unwrap();
        soil.0.enter_initialization().unwrap();
        soil
    }

    fn vr(&self, name: &str) -> u32 {
        self.0.model().table.find(name).unwrap_or_else(|| panic!("no variable {name}")).0
    }

    pub fn get(&mut self, name: &str) -> f64 {
        let vr = self.vr(name);
        self.0.real(vr).unwrap()
    }

    /// `body[1].NAME`.
    pub fn vector(&mut self, name: &str) -> Vector3<f64> {
        ["x", "y", "z"].map(|a| self.get(&format!("body[1].{name}.{a}"))).into()
    }

    /// The tire's surface now, the velocities (m/s) it is told, and the point that moments are about.
    pub fn take(&mut self, tire: &Tire, velocity: &[f64], centre: &Vector3<f64>) {
        for (axis, x) in ["x", "y", "z"].iter().zip(centre.iter()) {
            let vr = self.vr(&format!("body[1].position.{axis}"));
            self.0.set_real(vr, *x).unwrap();
        }
        let surface = &tire.mesh.surface;
        let (p, v, t) = (self.vr("body[1].position"), self.vr("body[1].velocity"), self.vr("body[1].triangle"));
        self.0.set_real_array(p, &surface.all(&tire.state.shell.q).collect::<Vec<_>>()).unwrap();
        self.0.set_real_array(v, velocity).unwrap();
        let triangles: Vec<i32> = surface.triangles.iter().flatten().map(|&k| k as i32).collect();
        self.0.set_integer_array(t, &triangles).unwrap();
    }

    pub fn forces(&mut self) -> Forces {
        let (i, f) = (self.vr("body[1].contact.index"), self.vr("body[1].contact.force"));
        let index = self.0.integer_array(i).unwrap().to_vec();
        let force = self.0.real_array(f).unwrap();
        index.iter().zip(force.chunks_exact(3)).map(|(&i, f)| (i as u32, [f[0], f[1], f[2]])).collect()
    }
}

/// Velocities (m/s) of the tire's surface.
pub fn surface_velocity(tire: &Tire) -> Vec<f64> {
    tire.mesh.surface.all(&tire.state.shell.v).collect()
}
