//! Tires inside the vehicle, for handling studies on a rigid plane without other units.

use super::build::{Hub, Vehicle};
use crate::mbs::{Loads, Pose, View};
use crate::suspension::Corner;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terramech_fmi2::UnitError;
use terramech_fmi2::specification::Faults;
use terramech_handling_tires::{Contact, Probe, Tire, TireForces, Transient, fiala::Fiala, pac02::Pac02, rigid::Rigid};
use terramech_mechanics::{Quat, RigidState, Vec3};

/// Tires of `vehicle_handling`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TiresSpec {
    /// Model.
    pub model: TireModel,
    /// Coefficient of friction of the plane.
    #[serde(default = "friction")]
    pub friction: f64,
}

fn friction() -> f64 {
    0.8
}

impl Default for TiresSpec {
    fn default() -> Self {
        Self { model: TireModel::Fiala(None), friction: friction() }
    }
}

/// A tire model by name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TireModel {
    /// Rigid contact.
    Rigid(Rigid),
    /// Fiala; null: the HMMWV's tire.
    Fiala(Option<Fiala>),
    /// Magic Formula 2002.
    Pac02 {
        /// Text of a `.tir` file; null: the HMMWV's tire.
        #[serde(default)]
        tir: Option<String>,
        /// Name of a `.tir` file, read into `tir`.
        #[serde(default)]
        file: Option<String>,
        /// Mass (kg).
        #[serde(default = "mass")]
        mass: f64,
        /// Moments of inertia (kg m2).
        #[serde(default = "inertia")]
        inertia: [f64; 3],
    },
}

fn mass() -> f64 {
    37.6
}
fn inertia() -> [f64; 3] {
    [3.84, 6.69, 3.84]
}

impl TiresSpec {
    /// Reads a `.tir` file that is named.
    pub fn resolve(&mut self, place: &super::Place, path: &str, f: &mut Faults) {
        if let TireModel::Pac02 { tir, file, .. } = &mut self.model
            && let Some(name) = file.take()
        {
            match place.text(&name) {
                Ok(text) => *tir = Some(text),
                Err(e) => f.add(format!("'{path}.model.pac02.file': {e}")),
            }
        }
    }

    /// The model with its mass and inertia.
    ///
    /// # Errors
    /// Faults of the parameters.
    pub fn build(&self) -> Result<(Tire, Hub), UnitError> {
        let mut f = Faults::new();
        f.positive("tires.friction", self.friction);
        let (tire, mass, inertia) = match &self.model {
            TireModel::Rigid(r) => {
                for (name, x) in [
                    ("radius", r.radius),
                    ("stiffness", r.stiffness),
                    ("friction", r.friction),
                    ("full_slip", r.full_slip),
                ] {
                    f.positive(&format!("tires.model.rigid.{name}"), x);
                }
                (Tire::Rigid(r.clone()), r.mass, r.inertia)
            }
            TireModel::Fiala(p) => {
                let p = p.clone().unwrap_or_else(Fiala::hmmwv);
                for (name, x, allowed) in p.faults() {
                    f.check(false, &format!("tires.model.fiala.{name}"), x, allowed);
                }
                let (m, i) = (p.mass, p.inertia);
                (Tire::Fiala(p), m, i)
            }
            TireModel::Pac02 { tir, mass, inertia, .. } => {
                let p = match tir {
                    Some(text) => {
                        Pac02::parse(text).map_err(|e| UnitError::input(format!("'tires.model.pac02.tir': {e}")))?
                    }
                    None => Pac02::hmmwv(),
                };
                (Tire::Pac02(Box::new(p)), *mass, *inertia)
            }
        };
        f.not_negative("tires.model.*.mass", mass);
        f.into_result("vehicle_handling")?;
        let hub = Hub { mass, inertia, tire_radius: tire.radius() };
        Ok((tire, hub))
    }
}

/// Tires of a vehicle on a level plane.
#[derive(Clone, Debug)]
pub struct InternalTires {
    /// Model, the same for all wheels.
    pub tire: Tire,
    /// Transient slips: what is saved.
    pub transient: Vec<Transient>,
    ground: Probe,
}

impl InternalTires {
    /// Relaxed tires on a plane at `height` (m).
    pub fn new(tire: Tire, wheels: usize, height: f64, friction: f64) -> Self {
        Self { tire, transient: vec![Transient::default(); wheels], ground: Probe::level(height, friction) }
    }

    /// Height of the plane (m).
    pub fn height(&self) -> f64 {
        self.ground.height
    }

    /// Deflection (m) at which a tire carries `load` (N) at rest.
    pub fn deflection(tire: &Tire, load: f64) -> f64 {
        let (mut low, mut high) = (0.0, 0.5 * tire.radius());
        for _ in 0..60 {
            let depth = 0.5 * (low + high);
            let wheel = RigidState { position: Vec3::new(0.0, 0.0, tire.radius() - depth), ..RigidState::default() };
            let carried = Contact::new(&wheel, &Probe::level(0.0, 1.0), tire.radius()).map_or(0.0, |c| tire.load(&c));
            if carried < load { low = depth } else { high = depth }
        }
        0.5 * (low + high)
    }

    fn contact(&self, pose: &Pose, u: &[f64; 6]) -> Option<Contact> {
        let state = RigidState {
            position: pose.p,
            orientation: Quat::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(pose.r)),
            velocity: Vec3::new(u[0], u[1], u[2]),
            angular_velocity: pose.r * Vec3::new(u[3], u[4], u[5]),
        };
        Contact::new(&state, &self.ground, self.tire.radius())
    }

    fn side(wheel: usize) -> f64 {
        if wheel.is_multiple_of(2) { 1.0 } else { -1.0 }
    }

    /// Adds the tires' forces.
    pub fn apply(&self, wheels: &[Corner], view: &View, loads: &mut Loads) {
        for (i, c) in wheels.iter().enumerate() {
            let pose = view.pose(c.spindle);
            if let Some(contact) = self.contact(pose, &view.u[c.spindle.index()]) {
                let f = self.tire.forces(&contact, &self.transient[i], Self::side(i));
                let w = contact.wrench(&f);
                loads.force_at(c.spindle, pose, &w.force, &Vec3::zeros());
                loads.torque(c.spindle, pose, &w.moment);
            }
        }
    }

    /// Forces of each tire in its contact frame at the vehicle's state.
    pub fn forces(&self, vehicle: &Vehicle) -> Vec<TireForces> {
        (0..vehicle.wheel_count())
            .map(|i| {
                Contact::new(&vehicle.wheel_state(i), &self.ground, self.tire.radius())
                    .map_or_else(TireForces::default, |c| self.tire.forces(&c, &self.transient[i], Self::side(i)))
            })
            .collect()
    }

    /// One inner step of the vehicle on these tires.
    ///
    /// # Errors
    /// As [`Vehicle::step`].
    pub fn step(&mut self, vehicle: &mut Vehicle, h: f64) -> Result<(), crate::mbs::MbsError> {
        let wheels = vehicle.wheels.clone();
        // Half before, half after: the slips are those of the middle of the step, so that the whole keeps its second order.
        self.advance(vehicle, 0.5 * h);
        vehicle.step_with(h, &mut |view, loads| self.apply(&wheels, view, loads))?;
        self.advance(vehicle, 0.5 * h);
        Ok(())
    }

    fn advance(&mut self, vehicle: &Vehicle, h: f64) {
        for i in 0..self.transient.len() {
            let c = Contact::new(&vehicle.wheel_state(i), &self.ground, self.tire.radius());
            self.transient[i] = self.transient[i].advanced(&self.tire, c.as_ref(), h);
        }
    }
}
