//! The unit as a member of a team: what the lead asks for, and what the others do for it.

use super::{GranularUnit, on_slope};
use crate::config::{BODIES, Terrain};
use crate::dem::vec3::Vec3;
use crate::dem::{Body, DemError};
use crate::dem_p::bodies::{self, Kind, Slot};
use crate::dem_p::pieces::{self, Piece};
use crate::dem_p::team::{Changes, Crew, Order};
use crate::error::unit_error;
use crate::soil_engine::SoilEngine;
use crate::variables::BodyVars;
use std::collections::BTreeMap;
use std::path::Path;
use terramech_fmi2::{Pieces, Team, Unit, UnitError, Values, Var, specification};

/// The arrays of a mesh that are new at every step.
fn mesh_of(body: &BodyVars) -> [u32; 2] {
    [body.position.vr(), body.velocity.vr()]
}

impl<E: SoilEngine> GranularUnit<E> {
    /// What all members know of this one's inputs: its bodies, the slope, threads of their own. Where the vertices of deforming meshes are goes to those who may meet them, at every step.
    pub(super) fn inputs(&self) -> Vec<u32> {
        let mut all = vec![self.vars.slope.vr()];
        for (body, slot) in self.vars.body.iter().zip(&self.own.slots) {
            all.extend([body.shape.vr(), body.radius.vr(), body.width.vr(), body.triangle.vr()]);
            if slot.kind != Kind::Mesh {
                all.extend(mesh_of(body));
            }
            let s = &body.state;
            all.extend(
                s.position.iter().chain(&s.orientation).chain(&s.velocity).chain(&s.angular_velocity).map(|x| x.vr()),
            );
        }
        all
    }

    /// The lead hands their parts of the bed to the members.
    /// `restored`: the saved bytes that it has just been made of, with their parts in files.
    pub(super) fn spread_out(&mut self, v: &mut Values, restored: Option<&[u8]>) -> Result<(), UnitError> {
        let Some(crew) = self.lead.crew.clone().filter(Crew::is_lead) else { return Ok(()) };
        let unit = restored.map_or_else(|| self.save(), |bytes| Ok(bytes.to_vec()))?;
        let pieces = self.pieces.clone().filter(|_| restored.is_some());
        self.lead.known.clear();
        let mut values = v.changes(self.inputs(), &mut self.lead.known);
        // Meshes whole, so that all make the same of them: which vertices lie in one place is told from where they are first.
        let meshes = self.vars.body.iter().zip(&self.own.slots).filter(|(_, slot)| slot.kind == Kind::Mesh);
        values.extend(v.changes(meshes.flat_map(|(vars, _)| mesh_of(vars)), &mut BTreeMap::new()));
        crew.ask(&Order::Open { unit, values, pieces })?;
        crew.answers::<()>()?;
        crew.ask(&Order::Part)?;
        self.take_part(v, &crew)?;
        self.lead.open = true;
        Ok(())
    }

    /// The lead has the members step: `count` inner steps of length `step` (s).
    pub(super) fn lead_step(&mut self, v: &Values, count: u32, step: f64) -> Result<(), UnitError> {
        let (Some(crew), Some(engine)) = (self.lead.members().cloned(), &self.engine) else { return Ok(()) };
        let values = v.changes(self.inputs(), &mut self.lead.known);
        let centres = self.own.slots.iter().map(|s| s.centre_given).collect();
        let mut boxes = vec![Vec::new(); BODIES];
        let mut meshes = vec![0_u32; Team::size(&crew)];
        for (k, body) in self.bodies.iter_mut().enumerate().take(BODIES) {
            let mesh = body.shape.as_mesh().filter(|_| self.own.slots[k].kind == Kind::Mesh);
            let Some(mesh) = mesh else { continue };
            let mut zone = [f64::INFINITY, f64::NEG_INFINITY];
            for i in 0..count {
                // At the engine's times: the boxes decide about sleep, and about who tells the lead of a body.
                let Some([low, high]) = mesh.bounds_at(f64::from(i) * step) else { continue };
                zone = [zone[0].min(low[0]), zone[1].max(high[0])];
                boxes[k].push([low, high]);
            }
            // Other triangles make another mesh: everywhere, from the same places.
            let anew = values.iter().any(|(vr, _)| *vr == self.vars.body[k].triangle.vr());
            for (mask, meets) in meshes.iter_mut().zip(engine.may_meet(zone, count)).skip(1) {
                *mask |= u32::from(meets || anew) << k;
            }
        }
        let out = meshes.iter().enumerate().filter(|(_, mask)| **mask != 0).map(|(member, mask)| {
            let bodies = self.vars.body.iter().enumerate().filter(|(k, _)| mask & 1 << k != 0);
            (member, v.changes(bodies.flat_map(|(_, vars)| mesh_of(vars)), &mut BTreeMap::new()))
        });
        let out: Vec<(usize, Changes)> = out.collect();
        crew.ask(&Order::Step { count, step, values, centres, boxes, meshes })?;
        crew.send(out)
    }

    /// Brings the bodies of a member to their communication point: meshes that are sent to it, as bits of `near`, to their vertices; of the others their boxes are known, and the meshes
    /// put aside until they come again.
    fn place_near(
        &mut self,
        v: &mut Values,
        near: u32,
        step: f64,
        boxes: Vec<Vec<[Vec3; 2]>>,
    ) -> Result<(), UnitError> {
        for (k, boxes) in boxes.into_iter().enumerate().filter(|(k, _)| self.own.slots[*k].kind == Kind::Mesh) {
            let (mesh, body) = (&mut self.aside[k], &mut self.bodies[k]);
            if boxes.is_empty() {
                // The tire shows no mesh now; as on the lead it is made anew when it does.
                (*mesh, *body) = (None, bodies::absent(k));
                self.triangles[k].clear();
            } else if near & 1 << k == 0 {
                let mut away = bodies::away(k, step, boxes);
                std::mem::swap(body, &mut away);
                mesh.get_or_insert(away);
            } else if let Some(mesh) = mesh.take() {
                *body = mesh;
            }
        }
        let far = |(k, slot): (usize, &Slot)| slot.kind == Kind::Mesh && near & 1 << k == 0;
        let far: Vec<bool> = self.own.slots.iter().enumerate().map(far).collect();
        self.place_bodies_but(v, &far)
    }

    /// Takes this member's part of the bed that all have whole.
    pub(super) fn take_part(&mut self, v: &Values, crew: &Crew) -> Result<(), UnitError> {
        let (Some(engine), Some(spec)) = (&self.engine, &self.spec) else { return Ok(()) };
        let spec = on_slope(spec.clone(), v[self.vars.slope]);
        let threads = v[self.vars.common.threads].max(1) as usize;
        let links = Box::new(crew.clone());
        let part = E::spread(&spec, &self.own.surfaces, engine.state(), links, threads);
        self.engine = Some(part.map_err(|e| unit_error(e, false))?);
        Ok(())
    }

    /// Makes the whole state of a spread bed known here.
    pub(super) fn gather(&mut self) -> Result<(), UnitError> {
        if let (Some(crew), None, Some(engine)) = (self.lead.members(), &self.lead.whole, &mut self.engine) {
            crew.ask(&Order::Gather)?;
            self.lead.whole = engine.whole().map_err(|e| unit_error(e, true))?;
        }
        Ok(())
    }

    /// Writes this member's part of the state, or of what is shown.
    pub(super) fn keep_part(&self, prefix: &Path, crew: &Crew) -> Result<Piece, UnitError> {
        let engine = self.engine.as_ref().ok_or_else(|| UnitError::state("saved before it has a part"))?;
        pieces::keep(prefix, Team::index(crew), engine.state())
    }

    pub(super) fn show_part(&self, v: &mut Values, pieces: &Pieces, place: [usize; 2]) -> Result<(), UnitError> {
        let (Some(engine), Some(spec)) = (&self.engine, &self.spec) else {
            return Err(UnitError::state("shown before it has a part"));
        };
        pieces::show(v, &self.vars, (engine.state(), spec), pieces, place)
    }

    /// What a member other than the lead does for an order.
    pub(super) fn obey(&mut self, order: Order, v: &mut Values, crew: &Crew) -> Result<(), UnitError> {
        match order {
            Order::End => {}
            Order::Make { specification } => {
                let spec: Terrain = specification::parse(&specification, "the lead's specification")?;
                let threads = v[self.vars.common.threads].max(1) as usize;
                // The bed itself comes with the unit.
                E::make_together(&spec, threads, &|| Box::new(crew.clone()), &mut |_, _| true)
                    .map_err(|e| unit_error(e, false))?;
            }
            Order::Open { unit, values, pieces } => {
                v.take_changes(values);
                self.pieces = pieces;
                let restored = self.restore(v, &unit);
                crew.answer(&restored)?;
                restored?;
            }
            Order::Part => self.take_part(v, crew)?,
            Order::Step { count, step, values, centres, boxes, meshes } => {
                v.take_changes(values);
                let mask = meshes.get(Team::index(crew)).copied().unwrap_or(0);
                if mask != 0 {
                    v.take_changes(crew.take()?);
                }
                let mut mine = self.place_near(v, mask, step, boxes);
                for (slot, given) in self.own.slots.iter_mut().zip(centres) {
                    slot.centre_given = given;
                }
                self.bodies.iter_mut().for_each(Body::clear);
                let Some(engine) = &mut self.engine else {
                    return Err(UnitError::state("stepped before it has a part"));
                };
                engine
                    .change_step(step)
                    .and_then(|()| engine.advance(count, &mut self.bodies))
                    .map_err(|e| unit_error(e, true))?;
                if let Some(k) = self.bodies.iter().position(|b| b.shape.is_missed()) {
                    let (k, member) = (k + 1, Team::index(crew));
                    mine = mine.and(Err(UnitError::numerical(format!(
                        "grains of member {member} have come into the box of body[{k}] within a step in which they were too far from it to be sent its mesh"
                    ))));
                }
                // The lead waits to hear of it.
                engine.agree(mine.map_err(|e| DemError::Elsewhere(e.to_string()))).map_err(|e| unit_error(e, true))?;
            }
            Order::Heat => {
                self.engine.as_ref().map(|e| e.heat(&self.bodies));
            }
            Order::Keep { prefix } => crew.answer(&self.keep_part(&prefix, crew))?,
            Order::Show { prefix, position, fields } => {
                let place = [Team::index(crew), Team::size(crew)];
                crew.answer(&self.show_part(v, &Pieces { prefix, position, fields }, place))?;
            }
            Order::Gather => {
                if let Some(engine) = &mut self.engine {
                    engine.whole().map_err(|e| unit_error(e, true))?;
                }
            }
        }
        Ok(())
    }
}
