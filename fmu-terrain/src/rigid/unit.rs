//! The unit: the ground behind the interface.

use super::config::Rigid;
use super::contact::touch;
use super::ground::Ground;
use super::points::{self, PointBody};
use crate::config::{BODIES, Terrain};
use crate::dem_p::bodies::{self, Kind, Slot};
use crate::mesh::mesh_from_arrays;
use crate::variables::{BodyVars, ProbeVars, Variables};
use serde::{Deserialize, Serialize};
use std::path::Path;
use terramech_fmi2::specification::{self, Faults};
use terramech_fmi2::{Host, LogCategory, Stage, Step, Unit, UnitError, Values, Var, state};
use terramech_mechanics::Vec3;

/// Points around and across the tread of a body of shape `cylinder`.
const CYLINDER: [usize; 2] = [360, 5];

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

    /// The points of body `k` at the communication point; `None`: no body, or one that has not shown its mesh.
    fn points(&mut self, v: &mut Values, k: usize) -> Result<Option<PointBody>, UnitError> {
        let (vars, body) = (&self.vars.body[k], &mut self.own.slots[k]);
        let fault = |text: String| UnitError::input(format!("body[{}]: {text}", k + 1));
        let set = vars.state.position.iter().any(|&p| v.take_changed(p));
        body.slot.centre_given |= body.slot.kind == Kind::Mesh && set;
        match body.slot.kind {
            Kind::None => Ok(None),
            Kind::Cylinder => {
                let (radius, width) = (v[vars.radius], v[vars.width]);
                if !(radius > 0.0 && width > 0.0) {
                    return Err(fault(format!(
                        "radius {radius} m, width {width} m; allowed for a cylinder: both greater than 0"
                    )));
                }
                let (position, area) = points::cylinder(radius, width, CYLINDER[0], CYLINDER[1]);
                Ok(Some(PointBody::Rigid { position, area, state: bodies::state(v, &vars.state, k)? }))
            }
            Kind::RigidMesh => {
                let mesh = body.slot.mesh.as_ref().ok_or_else(|| fault("its rigid mesh was never given".into()))?;
                let position: Vec<Vec3> = mesh.vertices.iter().map(|p| Vec3::from(*p)).collect();
                let area = points::vertex_areas(&position, mesh.triangles.iter().map(|t| t.map(|k| k as usize)));
                Ok(Some(PointBody::Rigid { position, area, state: bodies::state(v, &vars.state, k)? }))
            }
            Kind::Mesh => {
                let given = body.slot.centre_given;
                let Some((position, velocity, area)) = free(v, vars).map_err(fault)? else { return Ok(None) };
                let mean = |x: &[Vec3]| x.iter().sum::<Vec3>() / x.len() as f64;
                let centre = if given {
                    let s = bodies::state(v, &vars.state, k)?;
                    [s.position, s.velocity]
                } else {
                    [mean(&position), mean(&velocity)]
                };
                Ok(Some(PointBody::Free { position, velocity, area, centre }))
            }
        }
    }
}

/// Positions (m), velocities (m/s) and areas (m2, outward) of the vertices of a deforming mesh.
type Vertices = (Vec<Vec3>, Vec<Vec3>, Vec<Vec3>);

/// The vertices of a deforming mesh; `None` where there is none yet.
fn free(v: &Values, vars: &BodyVars) -> Result<Option<Vertices>, String> {
    let (position, velocity, triangle) = (v.reals(vars.position), v.reals(vars.velocity), v.integers(vars.triangle));
    if position.is_empty() && triangle.is_empty() {
        return Ok(None);
    }
    if velocity.len() != position.len() {
        return Err(format!("velocity has {} values, allowed: {}, as position has", velocity.len(), position.len()));
    }
    if let Some(k) = position.iter().chain(velocity).position(|x| !x.is_finite()) {
        return Err(format!("value {k} of position and velocity is not finite"));
    }
    let vectors = |x: &[f64]| -> Vec<Vec3> { x.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect() };
    let mesh = mesh_from_arrays(position, triangle).map_err(|e| e.to_string())?;
    let x = vectors(position);
    let count = x.len();
    if let Some(t) = mesh.triangles.iter().find(|t| t.iter().any(|k| *k as usize >= count)) {
        return Err(format!(
            "triangle {t:?} names a vertex that is not there; allowed: 0 to {}",
            count.saturating_sub(1)
        ));
    }
    let area = points::vertex_areas(&x, mesh.triangles.iter().map(|t| t.map(|k| k as usize)));
    Ok(Some((x, vectors(velocity), area)))
}

/// What the ground does to a body over a step.
#[derive(Default)]
struct Sum {
    vertex: Vec<Vec3>,
    force: Vec3,
    moment: Vec3,
    /// Work of the body on the ground (J).
    work: f64,
    /// At the last inner step: energy in the springs (J), points that touch.
    elastic: f64,
    touching: i32,
}

impl Sum {
    /// Means over `count` inner steps.
    fn publish(&self, v: &mut Values, vars: &BodyVars, count: f64) {
        let (mut index, mut force) = (Vec::new(), Vec::new());
        // A cylinder has no vertices that anybody knows.
        let has_vertices = !v.integers(vars.triangle).is_empty();
        for (k, f) in self.vertex.iter().enumerate().filter(|(_, f)| has_vertices && **f != Vec3::zeros()) {
            index.push(k as i32);
            force.extend([f.x / count, f.y / count, f.z / count]);
        }
        *v.integers_mut(vars.contact_index) = index;
        *v.reals_mut(vars.contact_force) = force;
        v.put(vars.wrench.force, (self.force / count).into());
        v.put(vars.wrench.moment, (self.moment / count).into());
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
        if !v.string(self.vars.bed_load).is_empty() || !v.string(self.vars.bed_save).is_empty() {
            host.log(LogCategory::Warning, "bed_load and bed_save have no effect: rigid ground has no bed");
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
        }
        Ok(())
    }

    fn exit_initialization(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        v[self.vars.height] = self.ground()?.at(0.0, 0.0).height;
        self.take_bodies(v)?;
        // Faults of bodies that are there already are told now.
        (0..BODIES).try_for_each(|k| self.points(v, k).map(|_| ()))
    }

    fn step(&mut self, v: &mut Values, _: &Host, step: Step) -> Result<(), UnitError> {
        let bodies: Vec<Option<PointBody>> = (0..BODIES).map(|k| self.points(v, k)).collect::<Result<_, _>>()?;
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
            if body.slip.len() != points.len() {
                // A body that appears in the ground was pressed in by somebody: what its springs hold is no dissipation.
                body.slip = vec![[0.0; 3]; points.len()];
                points.each(0.0, |_, p| {
                    let under = ground.at(p.position.x, p.position.y);
                    *work += touch(&spec.contact, &p, &under, 0.0, &mut Vec3::zeros(), 0.0).map_or(0.0, |t| t.elastic);
                });
            }
            let mut sum = Sum { vertex: vec![Vec3::zeros(); points.len()], ..Sum::default() };
            for n in 0..count as u32 {
                let (mut force, mut about, mut work) = (Vec3::zeros(), Vec3::zeros(), 0.0);
                (sum.touching, sum.elastic) = (0, 0.0);
                let centre = points.each((f64::from(n) + 0.5) * h, |k, p| {
                    let under = ground.at(p.position.x, p.position.y);
                    let mut slip = Vec3::from(body.slip[k]);
                    if let Some(t) = touch(&spec.contact, &p, &under, body.friction.min(under.friction), &mut slip, h) {
                        sum.vertex[k] += t.force;
                        force += t.force;
                        about += p.position.cross(&t.force);
                        work -= t.force.dot(&p.velocity);
                        sum.elastic += t.elastic;
                        sum.touching += 1;
                    }
                    body.slip[k] = slip.into();
                });
                sum.force += force;
                sum.moment += about - centre.cross(&force);
                sum.work += work * h;
            }
            let finite = sum.force.iter().chain(&sum.moment).all(|x| x.is_finite());
            if !finite {
                return Err(UnitError::numerical(format!(
                    "the force of the ground at t = {} s is not finite",
                    step.time
                )));
            }
            sum.publish(v, vars, count);
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
