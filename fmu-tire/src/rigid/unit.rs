//! The unit: places the mesh at the wheel state, and hands the terrain's answer to the hub.

use super::config::{RigidTire, Wheel};
use super::contact;
use super::variables::Variables;
use serde::{Deserialize, Serialize};
use terramech_fmi2::variables::StateVars;
use terramech_fmi2::{Host, LogCategory, Stage, Step, Unit, UnitError, Values, Var, specification, state};
use terramech_mechanics::{RigidState, Vec3};

/// The rigid tire.
///
/// In a step from t to t + H it holds the terrain's wrench (its mean over the step before) as the wheel's, and publishes the
/// mesh at t + H, moved on from the wheel state at t by its velocities: what the terrain reads next has no lag.
pub struct RigidTireUnit {
    vars: Variables,
    own: Own,
}

/// Everything that is saved.
#[derive(Default, Serialize, Deserialize)]
struct Own {
    wheel: Option<Wheel>,
}

impl RigidTireUnit {
    /// A fresh instance.
    pub fn new(vars: Variables) -> Self {
        Self { vars, own: Own::default() }
    }

    fn wheel(&self) -> Result<&Wheel, UnitError> {
        self.own
            .wheel
            .as_ref()
            .ok_or_else(|| UnitError::input("the tire has not been made: initialization mode comes first"))
    }

    fn publish(&self, v: &mut Values, placed: &RigidState) -> Result<(), UnitError> {
        let vertices = &self.wheel()?.mesh.vertices;
        let r_wb = terramech_mechanics::rotation::matrix(&placed.orientation);
        let arms = || vertices.iter().map(|p| r_wb * Vec3::from(*p));
        fill(v.reals_mut(self.vars.mesh_position), arms().map(|arm| placed.position + arm));
        let (velocity, omega) = (placed.velocity, placed.angular_velocity);
        fill(v.reals_mut(self.vars.mesh_velocity), arms().map(|arm| velocity + omega.cross(&arm)));
        Ok(())
    }

    /// Calculated parameters and the triangles, once.
    fn publish_fixed(&self, v: &mut Values) -> Result<(), UnitError> {
        let (w, vars) = (self.wheel()?, &self.vars);
        v.put([vars.hub_mass, vars.radius, vars.outer_radius, vars.width], [w.mass, w.radius, w.outer_radius, w.width]);
        v.put(vars.hub_inertia, w.inertia);
        v.put(vars.material, w.material);
        let triangles = v.integers_mut(vars.mesh_triangle);
        triangles.clear();
        // Below 2^31 vertices: a mesh of that size is refused by memory long before.
        triangles.extend(w.mesh.triangles.iter().flatten().map(|&k| k as i32));
        Ok(())
    }
}

fn fill(to: &mut Vec<f64>, points: impl Iterator<Item = Vec3>) {
    to.clear();
    to.extend(points.flat_map(|p| [p.x, p.y, p.z]));
}

fn wheel_state(v: &Values, vars: &StateVars) -> Result<RigidState, UnitError> {
    let mut reals = [0.0; 13];
    reals[..3].copy_from_slice(&v.get(vars.position));
    reals[3..7].copy_from_slice(&v.get(vars.orientation));
    reals[7..10].copy_from_slice(&v.get(vars.velocity));
    reals[10..].copy_from_slice(&v.get(vars.angular_velocity));
    RigidState::from_array(&reals).map_err(|e| UnitError::input(format!("input wheel state: {e}")))
}

impl Unit for RigidTireUnit {
    fn enter_initialization(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        let default = super::default_specification();
        let spec = specification::load::<RigidTire>(v.string(self.vars.common.specification), &default, host)?;
        let wheel = Wheel::build(&spec)?;
        for note in &wheel.notes {
            host.log(LogCategory::Warning, note);
        }
        host.log(
            LogCategory::Info,
            &format!(
                "rigid tire of {} vertices and {} triangles, radius {} m, mass {} kg ({})",
                wheel.mesh.vertices.len(),
                wheel.mesh.triangles.len(),
                wheel.radius,
                wheel.mass,
                spec.origin
            ),
        );
        self.own.wheel = Some(wheel);
        self.publish_fixed(v)?;
        v.lock([self.vars.common.specification.vr()], "the tire has been made from it when initialization mode began");
        Ok(())
    }

    fn refresh(&mut self, v: &mut Values, _: &Host, vr: u32, stage: Stage) -> Result<(), UnitError> {
        if stage == Stage::Initialization && (vr == self.vars.mesh_position.vr() || vr == self.vars.mesh_velocity.vr())
        {
            let placed = wheel_state(v, &self.vars.wheel_state)?;
            self.publish(v, &placed)?;
        }
        Ok(())
    }

    fn exit_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        let placed = wheel_state(v, &self.vars.wheel_state)?;
        self.publish(v, &placed)
    }

    fn step(&mut self, v: &mut Values, _: &Host, step: Step) -> Result<(), UnitError> {
        let now = wheel_state(v, &self.vars.wheel_state)?;
        let wheel = self.wheel()?;
        let (force, moment) = if wheel.by_vertices {
            // The forces are means over the step before, while the vertices turned: their arms are those of its middle.
            let middle = now.advanced(-0.5 * step.size);
            let (index, force) = (v.integers(self.vars.contact_index), v.reals(self.vars.contact_force));
            let [f, m] =
                contact::wrench(&wheel.mesh, &middle, index, force).map_err(|e| UnitError::input(e.to_string()))?;
            (f.into(), m.into())
        } else {
            (v.get(self.vars.contact.force), v.get(self.vars.contact.moment))
        };
        let end = now.advanced(step.size);
        if !end.to_array().iter().all(|x| x.is_finite()) {
            return Err(UnitError::numerical(format!(
                "the wheel state at t = {} s is not finite: {end:?}",
                step.time + step.size
            )));
        }
        v.put(self.vars.wheel_wrench.force, force);
        v.put(self.vars.wheel_wrench.moment, moment);
        self.publish(v, &end)
    }

    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        state::to_bytes(&self.own)
    }

    fn restore(&mut self, _: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
        self.own = state::from_bytes(bytes)?;
        Ok(())
    }
}
