//! The HMMWV with tires inside on a rigid plane, for tests.
#![allow(dead_code)] // each test file uses its part

use fmu_vehicle::driver::{Driver, DriverSpec};
use fmu_vehicle::powertrain::Mode;
use fmu_vehicle::vehicle::place::Rest;
use fmu_vehicle::vehicle::tires::{InternalTires, TireModel, TiresSpec};
use fmu_vehicle::vehicle::{Place, Vehicle, VehicleSpec};

pub const EXTERNAL: &str = r#"{"kind": {"external": {}}}"#;

pub struct Study {
    pub v: Vehicle,
    pub tires: InternalTires,
    pub driver: Driver,
    pub time: f64,
    pub loads: Vec<f64>,
}

impl Study {
    pub fn new(model: TireModel, driver: &str, speed: f64) -> Self {
        Self::of(&VehicleSpec::read("hmmwv/vehicle.json", &Place::Folder(None)).unwrap(), model, driver, speed)
    }
    pub fn of(spec: &VehicleSpec, model: TireModel, driver: &str, speed: f64) -> Self {
        let (tire, hub) = TiresSpec { model, friction: 0.8 }.build().unwrap();
        let mut hubs = vec![hub; 4];
        let rest = Rest::find(spec, &[], &hubs, Mode::Drive).unwrap();
        for (h, load) in hubs.iter_mut().zip(&rest.loads) {
            h.tire_radius -= InternalTires::deflection(&tire, *load);
        }
        let rest = Rest::find(spec, &[], &hubs, Mode::Drive).unwrap();
        let mut v = rest.vehicle;
        if speed > 0.0 {
            v.launch(speed).unwrap();
        }
        let driver: DriverSpec = serde_json::from_str(driver).unwrap();
        let driver = Driver::new(&driver, &v.chassis_state().state).unwrap();
        Self { v, tires: InternalTires::new(tire, 4, 0.0, 0.8), driver, time: 0.0, loads: rest.loads }
    }
    pub fn run(&mut self, seconds: f64, h: f64) {
        for _ in 0..(seconds / h).round() as usize {
            let chassis = self.v.chassis_state().state;
            self.v.inputs = self.driver.drive(self.time, h, &chassis, self.v.inputs);
            self.tires.step(&mut self.v, h).unwrap();
            self.time += h;
        }
    }
    pub fn wheel_loads(&self) -> Vec<f64> {
        self.tires.forces(&self.v).iter().map(|f| f.force.z).collect()
    }
}
