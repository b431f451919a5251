//! The unit: the engine behind the interface. As one of several members: `unit/members.rs`.

mod members;

use super::bed_file::{self, BedFile};
use super::bodies::{self, Kind, Slot};
use super::outputs;
use super::pieces::{self, Piece};
use super::platform;
use super::team::{Crew, Lead, Order};
use crate::config::dem_p::FIRST_OBSTACLE;
use crate::config::{BODIES, Terrain};
use crate::dem::grains::R;
use crate::dem::{BedReport, Body, CpuEngine, DemState, FreeState, Solid};
use crate::error::unit_error;
use crate::soil_engine::{SoilEngine, odd_adhesion};
use crate::variables::Variables;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use terramech_fmi2::{
    Host, LogCategory, Pieces, Stage, Step, Team, Unit, UnitError, Values, Var, specification, state,
};

/// Granular soil.
///
/// In a step from t to t + H the bodies move on from their inputs at t by their velocities; what the grains do to them is
/// summed at every inner step and handed out as means over H.
pub struct GranularUnit<E: SoilEngine> {
    vars: Variables,
    own: Own,
    spec: Option<Terrain>,
    engine: Option<E>,
    /// Bodies as the inputs say, and the triangles their meshes were made from: remade after a restore.
    bodies: Vec<Body>,
    triangles: Vec<Vec<i32>>,
    /// Meshes that this member of a team does not meet now.
    aside: Vec<Option<Body>>,
    /// Longest inner step (s).
    longest: f64,
    /// The log has been told that a body reaches out of the box.
    told_outside: [bool; BODIES],
    /// The log has been told that a solve did not reach its tolerance.
    told_unconverged: bool,
    /// The other members, where it is spread over several processes.
    lead: Lead,
    /// Prefix of files for their parts of saved states.
    pieces: Option<PathBuf>,
}

/// The unit of the model `terrain_dem_p`.
pub type DemPUnit = GranularUnit<CpuEngine>;

/// Everything that is saved beside the engine's state.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Own {
    /// The specification as JSON.
    specification: String,
    origin: String,
    report: Option<BedReport>,
    slots: Vec<Slot>,
    /// Surfaces of the bodies, once initialization is over.
    surfaces: Vec<[f64; 4]>,
    /// Shapes of the obstacles: contents of files, not their paths.
    solids: Vec<Solid>,
    /// States of the obstacles when saved.
    obstacles: Vec<FreeState>,
    /// The platform before the box.
    platform: platform::Run,
}

#[derive(Serialize)]
struct Save<'a, S> {
    own: &'a Own,
    state: Option<&'a DemState>,
    engine: S,
    /// Files that hold the state instead.
    pieces: Vec<Piece>,
}

#[derive(Deserialize)]
struct Restore<S> {
    own: Own,
    state: Option<DemState>,
    engine: S,
    pieces: Vec<Piece>,
}

/// With gravity turned for a slope of this angle (rad), uphill along X.
fn on_slope(mut spec: Terrain, slope: f64) -> Terrain {
    let [x, y, z] = spec.bed.gravity;
    let (sin, cos) = slope.sin_cos();
    spec.bed.gravity = [x * cos + z * sin, y, z * cos - x * sin];
    spec
}

const LOCKED: &str = "the bed has been made with it";

impl<E: SoilEngine> GranularUnit<E> {
    /// A fresh instance.
    pub fn new(vars: Variables) -> Self {
        let bodies = (0..BODIES).map(bodies::absent).collect();
        let triangles = vec![Vec::new(); BODIES];
        Self {
            vars,
            own: Own::default(),
            spec: None,
            engine: None,
            bodies,
            triangles,
            aside: (0..BODIES).map(|_| None).collect(),
            longest: 0.0,
            told_outside: [false; BODIES],
            told_unconverged: false,
            lead: Lead::default(),
            pieces: None,
        }
    }

    fn spec(&self) -> Result<&Terrain, UnitError> {
        self.spec
            .as_ref()
            .ok_or_else(|| UnitError::input("the specification has not been read: initialization mode comes first"))
    }

    /// The bed, made now if it is not there yet.
    fn bed(&mut self, v: &mut Values, host: &Host) -> Result<&mut E, UnitError> {
        if self.engine.is_none() {
            self.make_bed(v, host)?;
        }
        self.engine.as_mut().ok_or_else(|| UnitError::input("the bed has not been made"))
    }

    fn make_bed(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        let spec = self.spec()?.clone();
        let threads = v[self.vars.common.threads].max(1) as usize;
        let load = v.string(self.vars.bed_load).to_string();
        let save = v.string(self.vars.bed_save).to_string();
        let at_end = v.string(self.vars.bed_save_end).to_string();
        for path in [&save, &at_end].into_iter().filter(|p| !p.is_empty()) {
            bed_file::check_writable(path)?;
        }
        let (engine, report) = if load.is_empty() {
            let mut progress = |phase: &str, done: f64| host.progress(phase, done).is_ok();
            let together = match self.lead.crew.clone().filter(Crew::is_lead) {
                None => None,
                Some(crew) => {
                    crew.ask(&Order::Make { specification: self.own.specification.clone() })?;
                    E::make_together(&spec, threads, &|| Box::new(crew.clone()), &mut progress)
                        .map_err(|e| unit_error(e, false))?
                }
            };
            match together {
                Some(made) => made,
                None => E::make(&spec, threads, &mut progress).map_err(|e| unit_error(e, false))?,
            }
        } else {
            let mut file = bed_file::read(&load, &spec)?;
            let own = if file.engine == E::NAME {
                state::from_bytes(&file.own)?
            } else {
                host.log(
                    LogCategory::Info,
                    &format!("the bed was settled by {}: its contacts begin anew", file.engine),
                );
                if file.state.longest_offset > 0.0 {
                    host.log(
                        LogCategory::Warning,
                        "its adhesion grew from overlaps that count from an offset (bed.adhesion_onset: offset), which belong to the \
                         contacts: without them adhesion draws the grains together and the surface sinks",
                    );
                }
                file.state.forget_contacts();
                E::Own::default()
            };
            let engine = E::open(&spec, &[], file.state, own, threads).map_err(|e| unit_error(e, false))?;
            (engine, file.report)
        };
        let BedReport { grains, height, cohesion_change, time, energy } = report;
        if let Some(text) = odd_adhesion(&spec) {
            host.log(LogCategory::Warning, &text);
        }
        let made = if load.is_empty() { format!("settled in {time:.3} s") } else { format!("loaded from {load}") };
        host.log(
            LogCategory::Info,
            &format!(
                "bed of {grains} grains, {made}: height {height:.5} m, kinetic energy {energy:.2e} J per grain, inner step \
                 {:.3e} s, {} threads",
                engine.setup().step,
                threads
            ),
        );
        if cohesion_change != 0.0 {
            host.log(LogCategory::Info, &format!("its surface moved by {cohesion_change:.5} m as adhesion grew"));
        }
        self.engine = Some(engine);
        self.own.report = Some(report);
        self.write_bed(&save, host)?;
        self.place_obstacles(&spec)?;
        let c = self.vars.common;
        v.lock([c.threads.vr(), self.vars.bed_load.vr(), self.vars.bed_save.vr()], LOCKED);
        v[self.vars.height] = height;
        v[self.vars.grain_count] = i32::try_from(grains).unwrap_or(i32::MAX);
        Ok(())
    }

    /// Writes the bed as it is, unless the path is empty. Its height stays that of the settled bed, from which sinkage counts.
    fn write_bed(&mut self, path: &str, host: &Host) -> Result<(), UnitError> {
        let (Some(report), false) = (self.own.report, path.is_empty()) else { return Ok(()) };
        self.gather()?;
        let Some(engine) = &self.engine else { return Ok(()) };
        let specification = self.own.specification.clone();
        let own = state::to_bytes(&engine.own())?;
        let state = self.lead.whole.clone().unwrap_or_else(|| engine.state().clone());
        let engine = E::NAME.to_string();
        bed_file::write(path, &BedFile { specification, report, engine, own, state })?;
        host.log(LogCategory::Info, &format!("bed written to {path}"));
        Ok(())
    }

    /// Puts the obstacles on the bed, behind the driven bodies.
    fn place_obstacles(&mut self, spec: &Terrain) -> Result<(), UnitError> {
        let Some(engine) = &self.engine else { return Ok(()) };
        let rows = &engine.state().rows;
        let ground = |low: [f64; 2], high: [f64; 2]| {
            let below = rows.iter().filter(|r| (0..2).all(|c| r[c] + r[R] > low[c] && r[c] - r[R] < high[c]));
            below.map(|r| r[2] + r[R]).fold(0.0, f64::max)
        };
        self.bodies.truncate(BODIES);
        for (k, (obstacle, solid)) in spec.obstacles.iter().zip(&self.own.solids).enumerate() {
            let free = obstacle.body(solid.clone(), ground)?;
            self.bodies.push(Body::new(Box::new(free), FIRST_OBSTACLE + k));
        }
        Ok(())
    }

    /// Reads kinds, surfaces and rigid meshes, once.
    fn take_bodies(&mut self, v: &mut Values) -> Result<(), UnitError> {
        let s = self.spec()?.bodies.surface;
        let given = [s.friction, s.restitution, s.young_modulus, s.poisson_ratio];
        let (mut slots, mut surfaces) = (Vec::new(), Vec::new());
        for (k, vars) in self.vars.body.iter().enumerate() {
            let mut slot = Slot { kind: bodies::kind(v, vars, k)?, ..Slot::default() };
            if slot.kind == Kind::RigidMesh {
                slot.mesh = Some(bodies::take_rigid_mesh(v, vars, k)?);
            }
            let mut surface = given;
            for (value, var) in surface.iter_mut().zip(vars.material) {
                if v.take_changed(var) {
                    *value = v[var];
                }
            }
            surfaces.push(surface);
            slots.push(slot);
        }
        (self.own.slots, self.own.surfaces) = (slots, surfaces);
        Ok(())
    }

    /// Brings all bodies to their communication point.
    fn place_bodies(&mut self, v: &mut Values) -> Result<(), UnitError> {
        self.place_bodies_but(v, &[])
    }

    /// The same but for some.
    fn place_bodies_but(&mut self, v: &mut Values, but: &[bool]) -> Result<(), UnitError> {
        for (k, vars) in self.vars.body.iter().enumerate().filter(|(k, _)| but.get(*k) != Some(&true)) {
            let slot = &mut self.own.slots[k];
            let set = |v: &mut Values| vars.state.position.iter().any(|&p| v.take_changed(p));
            slot.centre_given |= slot.kind == Kind::Mesh && set(v);
            bodies::place(v, vars, slot, &mut self.bodies[k], &mut self.triangles[k], k)?;
        }
        Ok(())
    }

    /// A body that reaches over a side of the box runs into what is not simulated: told once; one beyond it ends the run.
    fn check_inside(&mut self, host: &Host, time: f64) -> Result<(), UnitError> {
        let Some(spec) = &self.spec else { return Ok(()) };
        let moved = self.engine.as_ref().map_or(0.0, |e| e.state().moved());
        let mut sides =
            [(moved, spec.bed.length), (0.0, spec.bed.width)].map(|(at, size)| [at - 0.5 * size, at + 0.5 * size]);
        // The platform stays where it is when the box follows its bodies.
        if moved == 0.0 {
            sides[0][0] -= spec.bed.platform.map_or(0.0, |p| p.length);
        }
        let driven = self.bodies.iter().take(BODIES).enumerate();
        for (k, body) in driven.filter(|(k, _)| self.own.slots[*k].kind != Kind::None) {
            let [low, high] = body.shape.bounds();
            let axes = [0, 1].into_iter().filter(|&c| low[c] <= high[c]);
            for (c, beyond) in axes.map(|c| (c, low[c] > sides[c][1] || high[c] < sides[c][0])) {
                let (axis, name) = [("x", "bed.length"), ("y", "bed.width")][c];
                let text = format!(
                    "body[{}] is from {axis} {:.4} to {:.4} m at {time:.4} s, and the ground from {:.4} to {:.4} m",
                    k + 1,
                    low[c],
                    high[c],
                    sides[c][0],
                    sides[c][1]
                );
                if beyond {
                    let reason = format!("{text}: it has left the soil; a larger {name} would take it further");
                    return Err(UnitError::Ended { last_successful_time: time, reason });
                }
                if (low[c] < sides[c][0] || high[c] > sides[c][1]) && !self.told_outside[k] {
                    self.told_outside[k] = true;
                    host.log(LogCategory::Warning, &format!("{text}: part of it is over no soil (told once)"));
                }
            }
        }
        Ok(())
    }

    fn on_demand(&mut self, v: &mut Values, host: &Host, vr: u32) -> Result<(), UnitError> {
        self.bed(v, host)?;
        if vr >= self.vars.obstacle.position.vr() && vr <= self.vars.obstacle.mesh_triangle.vr() {
            outputs::obstacles(v, &self.vars.obstacle, &mut self.bodies);
            return Ok(());
        }
        let vars = &self.vars;
        let sums = [vars.dissipated_energy.vr(), vars.body_work.vr()];
        if !sums.contains(&vr) {
            self.gather()?;
        } else if let (Some(crew), true) = (self.lead.members(), vr == vars.dissipated_energy.vr()) {
            crew.ask(&Order::Heat)?;
        }
        let (Some(engine), Some(spec)) = (&self.engine, &self.spec) else { return Ok(()) };
        let (vars, state) = (&self.vars, self.lead.whole.as_ref().unwrap_or_else(|| engine.state()));
        let grain = [vars.grain_position, vars.grain_velocity, vars.grain_radius, vars.grain_force];
        if vr == vars.grain_id.vr() || grain.iter().any(|g| g.vr() == vr) {
            outputs::grain(v, vars, state, spec, vr);
        } else if let Some(probe) = vars.probe_of(vr) {
            outputs::probes(v, &probe, state, spec, self.own.report.as_ref().map_or(0.0, |r| r.height))?;
        } else if vr == vars.kinetic_energy.vr() {
            v[vars.kinetic_energy] = state.kinetic_energy();
        } else if vr == vars.dissipated_energy.vr() {
            v[vars.dissipated_energy] = engine.heat(&self.bodies) + self.own.platform.heat();
        } else if vr == vars.body_work.vr() {
            v[vars.body_work] = engine.body_work() + self.own.platform.work();
        } else if vr == vars.contact_count.vr() {
            v[vars.contact_count] = (state.grain_contacts() + state.boundary_contacts()) as i32;
        }
        Ok(())
    }
}

impl<E: SoilEngine> Unit for GranularUnit<E> {
    fn enter_initialization(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        let default = super::default_specification();
        let given = specification::load::<Terrain>(v.string(self.vars.common.specification), &default, host)?;
        given.value.check(&given.origin)?;
        // The critical step is known without a bed: say it before minutes of settling.
        let longest =
            E::longest_step(&given.value, &[]).map_err(|e| UnitError::input(format!("{}: {e}", given.origin)))?;
        self.own = Own {
            specification: serde_json::to_string(&given.value)
                .map_err(|e| UnitError::input(format!("{}: {e}", given.origin)))?,
            origin: given.origin,
            slots: vec![Slot::default(); BODIES],
            platform: platform::Run::new(BODIES),
            solids: given.value.obstacles.iter().map(|o| o.solid(given.folder.as_deref())).collect::<Result<_, _>>()?,
            ..Own::default()
        };
        self.spec = Some(given.value);
        self.longest = longest;
        v.lock([self.vars.common.specification.vr()], "it was read when initialization mode began");
        Ok(())
    }

    fn refresh(&mut self, v: &mut Values, host: &Host, vr: u32, stage: Stage) -> Result<(), UnitError> {
        let vars = &self.vars;
        if stage == Stage::Initialization && (vr == vars.height.vr() || vr == vars.grain_count.vr()) {
            self.bed(v, host)?;
            return Ok(());
        }
        if vr >= vars.probe.height.vr() {
            self.on_demand(v, host, vr)?;
        }
        Ok(())
    }

    fn exit_initialization(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        self.bed(v, host)?;
        self.take_bodies(v)?;
        let (spec, surfaces) = (on_slope(self.spec()?.clone(), v[self.vars.slope]), self.own.surfaces.clone());
        let fault = |e| UnitError::input(format!("with the surfaces of the bodies: {}", unit_error(e, false)));
        self.longest = E::longest_step(&spec, &surfaces).map_err(fault)?;
        let level = v[self.vars.slope] == 0.0;
        let engine = self.bed(v, host)?;
        engine.take_surfaces(&spec, &surfaces).map_err(fault)?;
        if !level {
            // Potential energy is another one from here on.
            engine.open_energy_account();
        }
        v.lock([self.vars.slope.vr()], "gravity has been turned by it");
        // Faults of meshes that are there already are told now.
        self.place_bodies(v)?;
        self.spread_out(v, None)
    }

    fn step(&mut self, v: &mut Values, host: &Host, step: Step) -> Result<(), UnitError> {
        self.place_bodies(v)?;
        self.check_inside(host, step.time)?;
        // Equal inner steps that fill the communication step; the allowance is for its round-off.
        let count = (step.size / self.longest - 1e-9).ceil().max(1.0);
        if count > f64::from(u32::MAX) {
            return Err(UnitError::input(format!(
                "a communication step of {} s would take {count:.0} inner steps",
                step.size
            )));
        }
        self.bodies.iter_mut().for_each(Body::clear);
        self.bed(v, host)?;
        if self.lead.members().is_some() {
            self.lead.whole = None;
            self.lead_step(v, count as u32, step.size / count)?;
        }
        let Some(engine) = &mut self.engine else { return Ok(()) };
        engine
            .change_step(step.size / count)
            .and_then(|()| engine.advance(count as u32, &mut self.bodies))
            .and_then(|()| engine.agree(Ok(())))
            .map_err(|e| unit_error(e, true))?;
        let (spec, own) = (self.spec.as_ref(), &mut self.own);
        let top = own.report.as_ref().map_or(0.0, |r| r.height);
        let driven = self.bodies.iter_mut().zip(&self.vars.body).zip(&mut own.slots).enumerate();
        for (k, ((body, vars), slot)) in driven.filter(|(_, (_, slot))| slot.kind != Kind::None) {
            if let Some(spec) = spec.filter(|s| s.bed.platform.is_some()) {
                let friction = own.surfaces.get(k).map_or(spec.bodies.surface.friction, |s| s[0]);
                own.platform.press(spec, top, (v, vars), (slot, k, friction), body, step.size)?;
            }
            bodies::publish(v, vars, body, step.size);
        }
        // A box that follows its bodies takes grains away and lays new ones.
        if !self.lead.open {
            v[self.vars.grain_count] = i32::try_from(engine.state().rows.len()).unwrap_or(i32::MAX);
        }
        v[self.vars.inner_steps] = count.min(f64::from(i32::MAX)) as i32;
        if let (Some(report), Some(vars)) = (engine.solver(), self.vars.solver) {
            v[vars.iterations] = i32::try_from(report.iterations).unwrap_or(i32::MAX);
            v[vars.residual] = report.residual;
            v[vars.unconverged] = i32::try_from(report.unconverged).unwrap_or(i32::MAX);
            if report.unconverged > 0 && !self.told_unconverged {
                self.told_unconverged = true;
                let [x, y, z] = report.worst;
                host.log(
                    LogCategory::Warning,
                    &format!(
                        "the contact solver stopped at {} iterations with a residual of {:.2e} m/s before {:.4} s, worst contact at \
                         ({x:.3}, {y:.3}, {z:.3}) m; solver.unconverged counts such steps (told once)",
                        report.iterations,
                        report.residual,
                        step.time + step.size
                    ),
                );
            }
        }
        Ok(())
    }

    fn join(&mut self, team: Box<dyn Team>) -> Result<(), UnitError> {
        if E::NAME != CpuEngine::NAME {
            return Err(UnitError::input("this kind of ground cannot be spread over several processes"));
        }
        self.lead.crew = Some(Crew::new(team));
        Ok(())
    }

    fn serve(&mut self, v: &mut Values, _: &Host) -> Result<(), UnitError> {
        let crew = self.lead.crew.clone().filter(|c| !c.is_lead());
        let Some(crew) = crew else {
            return Err(UnitError::input("the lead of a team, or a unit alone, serves nobody"));
        };
        let mut done = Ok(());
        loop {
            match crew.hear()? {
                Order::End => return done,
                // Where it has failed so has the lead, which will end it.
                order if done.is_ok() => done = self.obey(order, v, &crew),
                _ => {}
            }
        }
    }

    fn measure(&mut self, v: &mut Values, host: &Host, folder: &Path) -> Result<(), UnitError> {
        if E::NAME != CpuEngine::NAME {
            return Err(UnitError::input("soil is measured by terrain-dem-p"));
        }
        let default = super::default_specification();
        let given = specification::load::<Terrain>(v.string(self.vars.common.specification), &default, host)?;
        given.value.check(&given.origin)?;
        let threads = v[self.vars.common.threads].max(1) as usize;
        let mut progress = |phase: &str, done: f64| host.progress(phase, done).is_ok();
        let table = crate::soil::sheet(&given.value, &given.origin, threads, folder, &mut progress)?;
        table.lines().for_each(|line| host.log(LogCategory::Info, line));
        Ok(())
    }

    fn leave(&mut self) -> Option<Box<dyn Team>> {
        let crew = self.lead.crew.take()?;
        Some(Box::new(crew))
    }

    fn keep_pieces(&mut self, prefix: Option<PathBuf>) {
        self.pieces = prefix;
    }

    fn write_pieces(&mut self, v: &mut Values, host: &Host, pieces: &Pieces) -> Result<(), UnitError> {
        self.bed(v, host)?;
        let Some(crew) = self.lead.members().cloned() else { return self.show_part(v, pieces, [0, 1]) };
        let Pieces { prefix, position, fields } = pieces.clone();
        crew.ask(&Order::Show { prefix, position, fields })?;
        let shown = self.show_part(v, pieces, [0, Team::size(&crew)]);
        // The members answer whatever became of the lead's own part.
        crew.answers::<()>().and(shown)
    }

    fn terminate(&mut self, v: &mut Values, host: &Host) -> Result<(), UnitError> {
        let path = v.string(self.vars.bed_save_end).to_owned();
        self.write_bed(&path, host)
    }

    fn save(&mut self) -> Result<Vec<u8>, UnitError> {
        self.own.obstacles = self.bodies.iter_mut().filter_map(|b| b.shape.as_free()).map(|f| f.now.clone()).collect();
        let mut pieces = Vec::new();
        if let (Some(crew), Some(prefix)) = (self.lead.members(), &self.pieces) {
            crew.ask(&Order::Keep { prefix: prefix.clone() })?;
            let own = self.keep_part(prefix, crew);
            let others = crew.answers()?;
            pieces.push(own?);
            pieces.extend::<Vec<Piece>>(others);
        } else {
            self.gather()?;
        }
        let engine = self.engine.as_ref();
        state::to_bytes(&Save {
            own: &self.own,
            state: self.lead.whole.as_ref().or(engine.map(|e| e.state())).filter(|_| pieces.is_empty()),
            engine: engine.map(E::own).unwrap_or_default(),
            pieces,
        })
    }

    fn restore(&mut self, v: &mut Values, bytes: &[u8]) -> Result<(), UnitError> {
        let Restore::<E::Own> { own, mut state, engine, pieces } = state::from_bytes(bytes)?;
        if !pieces.is_empty() {
            state = Some(pieces::whole(self.pieces.as_deref(), &pieces)?);
        }
        self.spec = match own.specification.as_str() {
            "" => None,
            text => Some(specification::parse(text, &own.origin)?),
        };
        self.own = own;
        self.bodies = (0..BODIES).map(bodies::absent).collect();
        self.triangles = vec![Vec::new(); BODIES];
        self.aside = (0..BODIES).map(|_| None).collect();
        self.engine = None;
        if let Some(spec) = self.spec.clone().map(|spec| on_slope(spec, v[self.vars.slope])) {
            let fault = |e| unit_error(e, false);
            self.longest = E::longest_step(&spec, &self.own.surfaces).map_err(fault)?;
            if let Some(state) = state {
                let threads = v[self.vars.common.threads].max(1) as usize;
                self.engine = Some(E::open(&spec, &self.own.surfaces, state, engine, threads).map_err(fault)?);
                self.place_obstacles(&spec)?;
                let obstacles = std::mem::take(&mut self.own.obstacles);
                for (free, saved) in self.bodies.iter_mut().filter_map(|b| b.shape.as_free()).zip(obstacles) {
                    free.restore(saved);
                }
                // Faultless when it was saved.
                if !self.own.surfaces.is_empty() {
                    self.place_bodies(v)?;
                    (self.lead.open, self.lead.whole) = (false, None);
                    self.spread_out(v, (!pieces.is_empty()).then_some(bytes))?;
                }
            }
        }
        Ok(())
    }
}
