//! The unit as a member of a team: what the lead asks for, and what the others do for it.

use super::{GranularUnit, on_slope};
use crate::config::Terrain;
use crate::dem::Body;
use crate::dem_p::pieces::{self, Piece};
use crate::dem_p::team::{Crew, Order};
use crate::error::unit_error;
use crate::soil_engine::SoilEngine;
use std::path::Path;
use terramech_fmi2::{Pieces, Team, Unit, UnitError, Values, Var, specification};

impl<E: SoilEngine> GranularUnit<E> {
    /// What the other members know of this one's inputs: its bodies, the slope, threads of their own.
    pub(super) fn inputs(&self) -> Vec<u32> {
        let mut all = vec![self.vars.slope.vr()];
        for body in &self.vars.body {
            all.push(body.shape.vr());
            all.extend([body.position.vr(), body.velocity.vr(), body.triangle.vr(), body.radius.vr(), body.width.vr()]);
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
        let values = v.changes(self.inputs(), &mut self.lead.known);
        crew.ask(&Order::Open { unit, values, pieces })?;
        crew.answers::<()>()?;
        crew.ask(&Order::Part)?;
        self.take_part(v, &crew)?;
        self.lead.open = true;
        Ok(())
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
            Order::Step { count, step, values, centres } => {
                v.take_changes(values);
                self.place_bodies(v)?;
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
