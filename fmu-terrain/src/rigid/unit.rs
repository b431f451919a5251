//! The unit: the ground behind the interface.

use super::config::Rigid;
use super::ground::Ground;
use super::points::PointBody;
use super::press::{of_body, press};
use crate::config::{BODIES, Terrain};
use crate::dem_p::bodies::{self, Kind, Slot};
use crate::variables::{ProbeVars, Variables};
use serde::{Deserialize, Serialize};
use std::path::Path;
use terramech_fmi2::specification::{self, Faults};
use terramech_fmi2::{Host, LogCategory, Stage, Step, Unit, UnitError, Values, Var, state};

/// Rigid ground.
///
/// In a step from t to t + H the bodies move on from their inputs at t by their velocities; what the ground does to them is summed in the middle of
/// every inner step and handed out as means over H.
pub struct RigidUnit {
    vars: Variables,
    own: Own,
}

/// The whole state.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Own {
    ground: Option<Ground>,
    spec: Rigid,
    /// Friction of bodies that do not say their own (1).
    surface: f64,
    slots: Vec<Body>,
    /// Work of the bodies on the ground so far, and what is in the contacts' springs (J).
    work: f64,
    elastic: f64,
}

/// A body between steps.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Body {
    slot: Slot,
    friction: f64,
    /// Tangential displacement of each point since its touch (m).
    slip: Vec<[f64; 3]>,
}

impl RigidUnit {
    /// A fresh instance.
    pub fn new(vars: Variables) -> Self {
        Self { vars, own: Own::default() }
    }

    fn ground(&self) -> Result<&Ground, UnitError> {
        self.own
            .ground
            .as_ref()
            .ok_or_else(|| UnitError::input("the specification has not been read: initialization mode comes first"))
    }

    fn probes(&self, v: &mut Values, vars: &ProbeVars) -> Result<(), UnitError> {
        let ground = self.ground()?;
        let points = v.reals(vars.position);
        if !points.len().is_multiple_of(3) {
            return Err(UnitError::input(format!(
                "probe.position has {} values; allowed: three for each point",
                points.len()
            )));
        }
        let found: Vec<_> = points.chunks_exact(3).map(|p| ground.at(p[0], p[1])).collect();
        let fill = |to: &mut Vec<f64>, from: &mut dyn Iterator<Item = f64>| {
            to.clear();
            to.extend(from);
        };
        fill(v.reals_mut(vars.height), &mut found.iter().map(|g| g.height));
        fill(v.reals_mut(vars.normal), &mut found.iter().flat_map(|g| [g.normal.x, g.normal.y, g.normal.z]));
        fill(v.reals_mut(vars.friction), &mut found.iter().map(|g| g.friction));
        Ok(())
    }

    /// The points of all bodies at the communication point.
    fn points(&mut self, v: &mut Values) -> Result<Vec<Option<PointBody>>, UnitError> {
        let slots = self.own.slots.iter_mut();
        self.vars.body.iter().zip(slots).enumerate().map(|(k, (vars, b))| of_body(v, vars, &mut b.slot, k)).collect()
    }

    /// Reads kinds, frictions and rigid meshes, once.
    fn take_bodies(&mut self, v: &mut Values) -> Result<(), UnitError> {
        let mut taken = Vec::new();
        for (k, vars) in self.vars.body.iter().enumerate() {
            let mut slot = Slot { kind: bodies::kind(v, vars, k)?, ..Slot::default() };
            if slot.kind == Kind::RigidMesh {
                slot.mesh = Some(bodies::take_rigid_mesh(v, vars, k)?);
            }
            let own = v.take_changed(vars.material[0]);
            let friction = if own { v[vars.material[0]] } else { self.own.surface };
            taken.push(Body { slot, friction, slip: Vec::new() });
        }
        self.own.slots = taken;
        Ok(())
    }
}

impl Unit for RigidUnit {
    fn enter_initialization(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        let default = super::default_specification();
        let given = specification::load::<Terrain>(v.string(self.vars.common.specification), &default, host)?;
        given.value.check(&given.origin)?;
        let spec = given.value.rigid.unwrap_or_default();
        let mut f = Faults::new();
        let folder = given.folder.unwrap_or_default();
        let ground = Ground::read(&spec, Path::new(&folder), &mut f);
        f.into_result(&given.origin)?;
        if let Some(g) = &ground {
            host.log(LogCategory::Info, &g.describe());
        }
        let beds = [self.vars.bed_load, self.vars.bed_save, self.vars.bed_save_end];
        if beds.into_iter().any(|p| !v.string(p).is_empty()) {
            host.log(
                LogCategory::Warning,
                "bed_load, bed_save and bed_save_end have no effect: rigid ground has no bed",
            );
        }
        self.own = Own { ground, spec, surface: given.value.bodies.surface.friction, ..Own::default() };
        // Before bodies are read there are none.
        self.own.slots = vec![Body::default(); BODIES];
        v.lock([self.vars.common.specification.vr()], "it was read when initialization mode began");
        Ok(())
    }

    fn refresh(&mut self, v: &mut Values, _: &Host, vr: u32, stage: Stage) -> Result<(), UnitError> {
        let vars = &self.vars;
        if stage == Stage::Initialization && vr == vars.height.vr() {
            v[self.vars.height] = self.ground()?.at(0.0, 0.0).height;
        } else if let Some(probe) = vars.probe_of(vr) {
            if stage != Stage::Instantiated {
                self.probes(v, &probe)?;
            }
        } else if vr == vars.dissipated_energy.vr() {
            v[self.vars.dissipated_energy] = self.own.work - self.own.elastic;
        } else if vr == vars.body_work.vr() {
            v[self.vars.body_work] = self.own.work;
        }
        Ok(())
    }

    fn exit_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        v[self.vars.height] = self.ground()?.at(0.0, 0.0).height;
        self.take_bodies(v)?;
        // Faults of bodies that are there already are told now.
        self.points(v).map(|_| ())
    }

    fn step(&mut self, v: &mut Values, _: &Host, step: Step) -> Result<(), UnitError> {
        let bodies = self.points(v)?;
        let Own { ground: Some(ground), spec, slots, work, elastic, .. } = &mut self.own else {
            return Err(UnitError::input("the specification has not been read: initialization mode comes first"));
        };
        let count = (step.size / spec.contact.step - 1e-9).ceil().max(1.0);
        if count > f64::from(u32::MAX) {
            return Err(UnitError::input(format!(
                "a communication step of {} s would take {count:.0} inner steps of {} s",
                step.size, spec.contact.step
            )));
        }
        let h = step.size / count;
        let (mut touching, mut stored) = (0, 0.0);
        for ((body, points), vars) in slots.iter_mut().zip(&bodies).zip(&self.vars.body) {
            let Some(points) = points else { continue };
            let ground = |x: f64, y: f64| Some(ground.at(x, y));
            let sum = press(points, &ground, &spec.contact, body.friction, &mut body.slip, [h, count]);
            *work += sum.pressed_in;
            let finite = sum.force.iter().chain(&sum.moment).all(|x| x.is_finite());
            if !finite {
                return Err(UnitError::numerical(format!(
                    "the force of the ground at t = {} s is not finite",
                    step.time
                )));
            }
            sum.publish(v, vars);
            *work += sum.work;
            stored += sum.elastic;
            touching += sum.touching;
        }
        *elastic = stored;
        v[self.vars.contact_count] = touching;
        v[self.vars.inner_steps] = count.min(f64::from(i32::MAX)) as i32;
        Ok(())
    }

    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        state::to_bytes(&self.own)
    }

    fn restore(&mut self, _: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
        self.own = state::from_bytes(bytes)?;
        Ok(())
    }
}
