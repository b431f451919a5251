//! The unit `vehicle`: wheel states out, wheel wrenches in.

use super::build::{Hub, Vehicle};
use super::dynamics::WheelWrench;
use super::place::Rest;
use super::specification::UnitSpec;
use super::tires::InternalTires;
use super::variables::Variables;
use super::{DriverInputs, Part, Place};
use crate::driver::{Driver, DriverState};
use crate::mbs::MbsError;
use serde::{Deserialize, Serialize};
use terramech_fmi2::specification;
use terramech_fmi2::{Host, LogCategory, Stage, Step, Unit, UnitError, Values, Var, state};
use terramech_mechanics::{RigidState, Vec3, rotation};

/// The vehicle as a unit. Before initialization mode ends its outputs are a pure function of specification, parameters
/// and `ground_height`: the equilibrium is found once for each set of hub parameters.
pub struct VehicleUnit {
    vars: Variables,
    spec: Option<UnitSpec>,
    /// Where the specification came from, for messages.
    origin: String,
    given: [bool; 5],
    rest: Option<(Vec<Hub>, Rest)>,
    run: Option<Run>,
}

struct Run {
    vehicle: Vehicle,
    driver: Driver,
    hubs: Vec<Hub>,
    /// Where the driver's path began.
    start: RigidState,
    elapsed: f64,
    /// Held since the start, and how long the loads have balanced (s).
    held: Option<f64>,
    weight: f64,
    tires: Option<InternalTires>,
}

/// What is saved: contents, never names of files.
#[derive(Serialize, Deserialize)]
struct Saved {
    spec: Option<String>,
    given: [bool; 5],
    run: Option<SavedRun>,
}

#[derive(Serialize, Deserialize)]
struct SavedRun {
    hubs: Vec<[f64; 5]>,
    vehicle: Vec<f64>,
    driver: DriverState,
    start: [f64; 13],
    elapsed: f64,
    held: Option<f64>,
    weight: f64,
    tires: Option<(f64, Vec<terramech_handling_tires::Transient>)>,
}

/// A fault of the multibody core, with file and JSON path where it is the specification's.
fn fault(origin: &str, e: &MbsError) -> UnitError {
    match (e, e.specification_path()) {
        (MbsError::Singular { .. } | MbsError::NoConvergence { .. } | MbsError::NotFinite { .. }, _) => {
            UnitError::numerical(e.to_string())
        }
        (_, Some(path)) => UnitError::input(format!("{origin}: at 'vehicle.{path}': {e}")),
        _ => UnitError::input(format!("{origin}: {e}")),
    }
}

impl VehicleUnit {
    /// A fresh instance.
    pub fn new(vars: Variables) -> Self {
        Self { vars, spec: None, origin: "specification".into(), given: [false; 5], rest: None, run: None }
    }

    fn spec(&self) -> Result<&UnitSpec, UnitError> {
        self.spec
            .as_ref()
            .ok_or_else(|| UnitError::input("the vehicle has no specification: initialization mode comes first"))
    }

    /// Whether tires are inside.
    fn internal(&self, v: &Values) -> Result<bool, UnitError> {
        let Some((tires, _)) = &self.vars.handling_tires else { return Ok(false) };
        match v.string(*tires) {
            "internal" => Ok(true),
            "external" => Ok(false),
            other => Err(UnitError::input(format!("parameter 'tires' is '{other}'; allowed: internal, external"))),
        }
    }

    /// Hubs with tires inside: their mass, and radii under the loads at rest.
    fn internal_hubs(&self) -> Result<Vec<Hub>, UnitError> {
        let spec = self.spec()?;
        let (tire, hub) = spec.tires.build()?;
        let mut hubs = vec![hub; self.vars.wheels.len()];
        let rest = Rest::find(spec.vehicle.get(), &spec.payload, &hubs, spec.start.gear)
            .map_err(|e| fault(&self.origin, &e))?;
        for (hub, load) in hubs.iter_mut().zip(&rest.loads) {
            hub.tire_radius -= InternalTires::deflection(&tire, *load);
        }
        Ok(hubs)
    }

    fn hubs(&self, v: &Values) -> Vec<Hub> {
        let hub = |w: &super::variables::WheelVars| Hub {
            mass: v[w.hub_mass],
            inertia: v.get(w.hub_inertia),
            tire_radius: v[w.tire_radius],
        };
        self.vars.wheels.iter().map(hub).collect()
    }

    /// The vehicle at its place at the start, with its loads.
    fn placed(&mut self, v: &mut Values) -> Result<(Vehicle, Vec<f64>), UnitError> {
        let spec = self.spec()?.clone();
        let hubs = match (self.internal(v)?, &self.rest) {
            (true, Some((found, _))) => found.clone(),
            (true, None) => self.internal_hubs()?,
            (false, _) => self.hubs(v),
        };
        if self.rest.as_ref().is_none_or(|(h, _)| *h != hubs) {
            let rest = Rest::find(spec.vehicle.get(), &spec.payload, &hubs, spec.start.gear)
                .map_err(|e| fault(&self.origin, &e))?;
            self.rest = Some((hubs, rest));
        }
        let mut start = [spec.start.x, spec.start.y, spec.start.heading, spec.start.speed];
        for (k, var) in self.vars.start.into_iter().enumerate() {
            self.given[k] |= v.take_changed(var) || v[var] != 0.0;
            if self.given[k] {
                start[k] = v[var];
            }
        }
        let (_, rest) = self.rest.as_ref().expect("found above");
        let mut vehicle = rest.vehicle.clone();
        vehicle.steering_frequency = spec.steering_frequency;
        let [x, y, heading, speed] = start;
        let p = vehicle.chassis_state().state.position;
        vehicle.place(&Vec3::new(-p.x, -p.y, 0.0), 0.0);
        vehicle.place(&Vec3::new(x, y, v[self.vars.ground_height] + spec.start.clearance), heading);
        if speed != 0.0 {
            vehicle.launch(speed).map_err(|e| fault(&self.origin, &e))?;
        }
        vehicle.system.set_gravity(gravity_on(v[self.vars.slope]));
        vehicle.start_energy();
        Ok((vehicle, rest.loads.clone()))
    }

    fn publish(&self, v: &mut Values, vehicle: &Vehicle) {
        let put = |v: &mut Values, s: &terramech_fmi2::variables::StateVars, r: &RigidState| {
            let all = [&s.position[..], &s.orientation, &s.velocity, &s.angular_velocity].concat();
            for (var, x) in all.into_iter().zip(r.to_array()) {
                v[var] = x;
            }
        };
        for (i, w) in self.vars.wheels.iter().enumerate() {
            put(v, &w.state, &vehicle.wheel_state(i));
            v[w.speed] = vehicle.wheel_speed(i);
            v[w.axle_torque] = vehicle.axle_torque(i);
            v[w.brake_torque] = vehicle.brake_torque(i);
            let c = vehicle.corner(i);
            let (spring, shock) = (vehicle.system.stroke(c.spring), vehicle.system.stroke(c.shock));
            v.put(w.suspension, [spring.length, spring.tension, shock.length, shock.tension]);
        }
        let c = vehicle.chassis_state();
        put(v, &self.vars.chassis, &c.state);
        v.put(self.vars.acceleration[0], c.acceleration.into());
        v.put(self.vars.acceleration[1], c.angular_acceleration.into());
        let i = &vehicle.inputs;
        v.put(self.vars.used, [i.steering, i.throttle, i.braking]);
        let r = rotation::matrix(&c.state.orientation);
        let (x, y) = (r.column(0).into_owned(), r.column(1).into_owned());
        let left = Vec3::new(-x.y, x.x, 0.0).normalize();
        v.put(
            self.vars.handling,
            [
                c.state.velocity.dot(&x),
                c.acceleration.dot(&left),
                c.state.angular_velocity.z,
                y.z.clamp(-1.0, 1.0).asin(),
                (-x.z).clamp(-1.0, 1.0).asin(),
            ],
        );
        let e = vehicle.engine();
        v.put(self.vars.engine, [e.speed, e.torque, e.converter_input, e.output]);
        let e = vehicle.energies();
        v.put(self.vars.energies, [e.engine, e.wheels, e.kinetic, e.potential, e.dissipated]);
        v[self.vars.gear] = vehicle.gear();
        v[self.vars.mass] = vehicle.system.mass();
    }

    fn publish_placed(&mut self, v: &mut Values) -> Result<(Vehicle, Vec<f64>), UnitError> {
        let (vehicle, loads) = self.placed(v)?;
        self.publish(v, &vehicle);
        for (w, load) in self.vars.wheels.iter().zip(&loads) {
            v[w.load_mass] = load / 9.81;
        }
        Ok((vehicle, loads))
    }
}

impl Run {
    /// Holds the vehicle as long as the specification says; whether it is held during the step to come.
    fn holding(&mut self, spec: &UnitSpec, h: f64, vertical: f64, host: &Host, time: f64) -> bool {
        let Some(balanced) = &mut self.held else { return false };
        let calm = (vertical - self.weight).abs() <= spec.hold.tolerance * self.weight
            && self.vehicle.chassis_state().state.velocity.norm() < 0.02;
        *balanced = if calm { *balanced + h } else { 0.0 };
        let released = *balanced >= 0.2 || self.elapsed >= spec.hold.duration;
        if released {
            let how = if *balanced >= 0.2 { "the wheels carry the weight" } else { "the time is over" };
            host.log(
                LogCategory::Info,
                &format!("t = {time} s: released, {how}: {vertical:.0} N of {:.0} N", self.weight),
            );
            self.held = None;
            self.vehicle.hold(false, 0.0);
        }
        !released
    }
}

/// Gravity (m/s2) on a slope of this angle (rad), uphill along X.
fn gravity_on(slope: f64) -> Vec3 {
    Vec3::new(-9.81 * slope.sin(), 0.0, -9.81 * slope.cos())
}

/// A vehicle on its side or roof ends the run: what its tires and driver do there means nothing.
fn rolled_over(vehicle: &Vehicle, time: f64) -> Result<(), UnitError> {
    let state = vehicle.chassis_state().state;
    let up = (rotation::matrix(&state.orientation).column(2)[2]).clamp(-1.0, 1.0);
    if up > 0.0 {
        return Ok(());
    }
    let [x, y, _] = state.position.into();
    let reason = format!(
        "the vehicle has rolled over: its chassis leans {:.0} degrees from upright at x = {x:.2} m, y = {y:.2} m",
        up.acos().to_degrees()
    );
    Err(UnitError::Ended { last_successful_time: time, reason })
}

impl Unit for VehicleUnit {
    fn enter_initialization(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        let default = super::default_specification(self.vars.wheels.len());
        let read = specification::load::<UnitSpec>(v.string(self.vars.common.specification), &default, host)?;
        let mut spec = read.value;
        spec.complete(&Place::Folder(read.folder), &read.origin)?;
        let wheels = 2 * spec.vehicle.get().axles.len();
        let own = self.vars.wheels.len();
        if wheels != own {
            return Err(UnitError::input(format!(
                "{}: 'vehicle.axles' has {} axles; this model has {own} wheels, that is {} axles; the models are {}",
                read.origin,
                wheels / 2,
                own / 2,
                super::model_names()
            )));
        }
        self.spec = Some(spec);
        self.origin = read.origin;
        v.lock([self.vars.common.specification.vr()], "it was read when initialization mode began");
        Ok(())
    }

    fn refresh(&mut self, v: &mut Values, _: &Host, _vr: u32, stage: Stage) -> Result<(), UnitError> {
        if stage == Stage::Initialization {
            self.publish_placed(v)?;
        }
        Ok(())
    }

    fn exit_initialization(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        let (mut vehicle, loads) = self.publish_placed(v)?;
        let mut spec = self.spec()?.clone();
        self.given[4] |= v.take_changed(self.vars.hold) || v[self.vars.hold] != 0.0;
        if self.given[4] {
            spec.hold.duration = v[self.vars.hold];
        }
        let start = vehicle.chassis_state().state;
        let driver = Driver::new(&spec.driver, &start)?;
        let held = (spec.hold.duration > 0.0).then_some(0.0);
        if held.is_some() {
            vehicle.hold(true, spec.hold.damping);
        }
        v.lock([self.vars.slope.vr()], "gravity has been turned by it");
        // What the wheels carry.
        let weight = -vehicle.system.mass() * gravity_on(v[self.vars.slope]).z;
        let rounded: Vec<String> = loads.iter().map(|l| format!("{l:.0}")).collect();
        host.log(
            LogCategory::Info,
            &format!(
                "vehicle '{}': {:.1} kg, wheel loads at rest {} N",
                spec.vehicle.get().name,
                vehicle.system.mass(),
                rounded.join(", ")
            ),
        );
        let hubs = self.rest.as_ref().map_or_else(Vec::new, |r| r.0.clone());
        let tires = if self.internal(v)? {
            let height = v[self.vars.ground_height];
            Some(InternalTires::new(spec.tires.build()?.0, self.vars.wheels.len(), height, spec.tires.friction))
        } else {
            None
        };
        self.spec = Some(spec);
        self.run = Some(Run { vehicle, driver, hubs, start, elapsed: 0.0, held, weight, tires });
        self.rest = None;
        Ok(())
    }

    fn step(&mut self, v: &mut Values, host: &Host, step: Step) -> Result<(), UnitError> {
        let (Some(run), Some(spec)) = (self.run.as_mut(), self.spec.as_ref()) else {
            return Err(UnitError::input("the vehicle has not been initialised"));
        };
        rolled_over(&run.vehicle, step.time)?;
        let mut vertical = 0.0;
        for (w, wrench) in self.vars.wheels.iter().zip(&mut run.vehicle.wrenches) {
            *wrench = WheelWrench { force: v.get(w.wrench.force).into(), moment: v.get(w.wrench.moment).into() };
            vertical += wrench.force.z;
        }
        let [steering, throttle, braking] = v.get(self.vars.driver);
        let external = DriverInputs { steering, throttle, braking };
        if let Some(t) = &run.tires {
            vertical += t.forces(&run.vehicle).iter().map(|f| f.force.z).sum::<f64>();
        }
        let n = (step.size / spec.step - 1e-9).ceil().max(1.0);
        let h = step.size / n;
        let held = run.holding(spec, step.size, vertical, host, step.time);
        for _ in 0..n as usize {
            let chassis = run.vehicle.chassis_state().state;
            run.vehicle.inputs = if held {
                DriverInputs { braking: 1.0, ..DriverInputs::default() }
            } else {
                run.driver.drive(run.elapsed, h, &chassis, external)
            };
            match &mut run.tires {
                Some(t) => t.step(&mut run.vehicle, h),
                None => run.vehicle.step(h).map(|_| ()),
            }
            .map_err(|e| fault(&self.origin, &e))?;
            run.elapsed += h;
        }
        let run = self.run.as_ref().expect("checked above");
        self.publish(v, &run.vehicle);
        if let (Some(t), Some((_, vars))) = (&run.tires, &self.vars.handling_tires) {
            for (f, vars) in t.forces(&run.vehicle).iter().zip(vars) {
                v.put(*vars, f.force.into());
            }
        }
        Ok(())
    }

    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        let text = |s: &UnitSpec| serde_json::to_string(s).map_err(|e| UnitError::state(e.to_string()));
        let spec = self.spec.as_ref().map(text).transpose()?;
        let run = self.run.as_ref().map(|r| SavedRun {
            hubs: r.hubs.iter().map(|h| [h.mass, h.inertia[0], h.inertia[1], h.inertia[2], h.tire_radius]).collect(),
            vehicle: r.vehicle.save(),
            driver: r.driver.state.clone(),
            start: r.start.to_array(),
            elapsed: r.elapsed,
            held: r.held,
            weight: r.weight,
            tires: r.tires.as_ref().map(|t| (t.height(), t.transient.clone())),
        });
        state::to_bytes(&Saved { spec, given: self.given, run })
    }

    fn restore(&mut self, v: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
        let saved: Saved = state::from_bytes(bytes)?;
        self.given = saved.given;
        self.rest = None;
        self.spec = saved.spec.map(|s| specification::parse::<UnitSpec>(&s, "saved specification")).transpose()?;
        self.run = match (saved.run, &self.spec) {
            (Some(s), Some(spec)) => {
                let hubs: Vec<Hub> =
                    s.hubs.iter().map(|h| Hub { mass: h[0], inertia: [h[1], h[2], h[3]], tire_radius: h[4] }).collect();
                let Part::Inline(vehicle_spec) = &spec.vehicle else {
                    return Err(UnitError::state("the vehicle's specification is missing"));
                };
                let mut vehicle = Vehicle::build(vehicle_spec, &spec.payload, &hubs, spec.start.gear, false)
                    .map_err(|e| UnitError::state(e.to_string()))?;
                vehicle.steering_frequency = spec.steering_frequency;
                vehicle.restore(&s.vehicle).map_err(UnitError::state)?;
                vehicle.system.set_gravity(gravity_on(v[self.vars.slope]));
                let start = RigidState::from_array(&s.start).map_err(|e| UnitError::state(e.to_string()))?;
                let mut driver = Driver::new(&spec.driver, &start)?;
                driver.state = s.driver;
                let [steering, throttle, braking] = v.get(self.vars.used);
                vehicle.inputs = DriverInputs { steering, throttle, braking };
                let tires = match s.tires {
                    Some((height, transient)) => {
                        let mut t = InternalTires::new(
                            spec.tires.build()?.0,
                            self.vars.wheels.len(),
                            height,
                            spec.tires.friction,
                        );
                        t.transient = transient;
                        Some(t)
                    }
                    None => None,
                };
                Some(Run { vehicle, driver, hubs, start, elapsed: s.elapsed, held: s.held, weight: s.weight, tires })
            }
            _ => None,
        };
        Ok(())
    }
}
