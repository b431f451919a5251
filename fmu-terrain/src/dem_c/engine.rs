//! The engine: grains as rigid balls in unilateral contact with friction, semi-implicit in time (DVI).
//!
//! A step of h: velocities under gravity alone; contacts within reach (`contacts.rs`); impulses by the cone solver of
//! [`terramech_mechanics::cone`], started from those of the last step; positions by the new velocities. State, sorting, pair lists, walls
//! and bodies are those of [`crate::dem`]: a bed of one engine starts the other.
//!
//! **What h does.** Where grains fall or fly further than a third of a radius in a step, it is taken in up to eight parts. An overlap is undone over the recovery time, at most at the recovery speed. The lift of the relaxation is taken out with the slip of the step before (see
//! `contacts.rs`). Cohesion is the impulse c h.

use super::contacts::{Made, PRESCRIBED, World, ball, classes, keep};
use super::obstacles;
use crate::dem::body::BodyLoad;
use crate::dem::diagnostics::Touched;
use crate::dem::engine::Setup;
use crate::dem::grains::{DemState, Grain, INV_M, R, V, W, X0, vec_at};
use crate::dem::kernel::Partner;
use crate::dem::material::PairTable;
use crate::dem::rebuild::{Making, rebuild};
use crate::dem::team::Team;
use crate::dem::vec3::{Vec3, add, add_scaled, dot, norm, sub};
use crate::dem::{Body, DemError, GrainEngine};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use terramech_mechanics::cone::{self, Impulses, Memory, Method, Options, Outcome, Problem};

/// How contacts are solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConeSetup {
    /// Solver.
    pub method: Method,
    /// Residual to reach (m/s).
    pub tolerance: f64,
    /// Iterations at most in a step.
    pub iterations: u32,
    /// Time over which an overlap is undone (s): what a soft bed of another engine has, and what residuals leave (about residual x time).
    pub recovery_time: f64,
    /// Fastest that an overlap is undone (m/s).
    pub recovery_speed: f64,
    /// Whether contacts have the elasticity of their materials; else they are rigid.
    pub elastic: bool,
    /// Longest inner step of what obstacles meet beside grains (s).
    pub obstacle_step: f64,
}

impl Default for ConeSetup {
    fn default() -> Self {
        Self {
            method: Method::Relaxation,
            tolerance: 1e-3,
            iterations: 200,
            recovery_time: 0.05,
            recovery_speed: 0.1,
            elastic: true,
            obstacle_step: 4e-5,
        }
    }
}

/// What the engine keeps from step to step beside the grains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ConeState {
    /// Skin that the pair lists were made with (m); 0 = none yet.
    pub skin: f64,
    /// Lipschitz constant found last (1).
    pub lipschitz: f64,
    /// Last step (s): impulses are kept for it; 0 = none yet.
    pub step: f64,
    /// Furthest that a grain is from where it was when the lists were made (m).
    pub moved: f64,
    /// Steps whose solve did not reach the tolerance.
    pub unconverged: u64,
}

/// What the last step's solve took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Contacts.
    pub contacts: usize,
    /// The solver's words.
    pub outcome: Outcome,
    /// The worst contact's place (m).
    pub worst: Vec3,
}

/// The engine for one process.
pub struct ConeEngine {
    setup: Setup,
    cone: ConeSetup,
    pairs: PairTable,
    rolling: bool,
    state: DemState,
    own: ConeState,
    report: StepReport,
    /// Steps and iterations since the start.
    total: [u64; 2],
    team: Arc<Team>,
    problem: Problem,
    impulses: Impulses,
    made: Vec<Made>,
}

/// Most parts of a step: what is faster than they allow for is a fault.
const MOST_PARTS: u32 = 8;

/// Advice when grains end up where they should not.
const HINT: &str = "the step or the speeds are too large";

impl ConeEngine {
    /// A bed of these grains.
    ///
    /// # Errors
    /// A setup outside its ranges; grains deep inside each other or outside the walls.
    pub fn new(setup: Setup, cone: ConeSetup, grains: &[Grain], threads: usize) -> Result<Self, DemError> {
        let state = DemState::of(grains, setup.walls.len());
        Self::with_state(setup, cone, state, ConeState::default(), threads)
    }

    /// Goes on from a saved state; with `ConeState::default()` from one that another engine left.
    ///
    /// # Errors
    /// As [`ConeEngine::new`].
    pub fn with_state(
        setup: Setup,
        cone: ConeSetup,
        mut state: DemState,
        own: ConeState,
        threads: usize,
    ) -> Result<Self, DemError> {
        for (what, x) in [
            ("step", setup.step),
            ("skin", setup.skin),
            ("tolerance", cone.tolerance),
            ("recovery speed", cone.recovery_speed),
            ("recovery time", cone.recovery_time),
            ("step of obstacles", cone.obstacle_step),
        ] {
            if !(x.is_finite() && x > 0.0) {
                return Err(DemError::parameter(what, x, "a finite number greater than 0"));
            }
        }
        if cone.iterations == 0 {
            return Err(DemError::parameter("iterations", 0, "at least 1"));
        }
        for (row, id) in state.rows.iter().zip(&state.ids) {
            // 1/m is infinite without mass; a fixed grain has 1/m = 0.
            if !(row[INV_M].is_finite() && row[INV_M] >= 0.0 && row[R].is_finite() && row[R] > 0.0) {
                let given = format!("radius {} m, 1/m {} 1/kg", row[R], row[INV_M]);
                return Err(DemError::parameter(format!("grain {id}"), given, "a radius and a mass greater than 0"));
            }
            if !row.iter().all(|x| x.is_finite()) {
                return Err(DemError::NotFinite { id: *id, time: state.time });
            }
        }
        if own.skin == 0.0 {
            // Histories of another engine mean something else.
            state.forget_contacts();
            state.stale = true;
        }
        let pairs = PairTable::new(&setup.materials, &setup.overrides);
        for p in pairs.all() {
            for (what, x) in [
                ("friction", p.friction),
                ("rolling friction", p.rolling_friction),
                ("spinning friction", p.spinning_friction),
            ] {
                if !(x.is_finite() && x >= 0.0) {
                    return Err(DemError::parameter(what, x, "a finite number, at least 0"));
                }
            }
            if cone.elastic && !(p.e_star.is_finite() && p.e_star > 0.0) {
                let allowed = "greater than 0 and finite for elastic contacts";
                return Err(DemError::parameter("effective Young's modulus", p.e_star, allowed));
            }
        }
        if pairs.all().len() > 256 {
            return Err(DemError::parameter("materials", setup.materials.len(), "at most 16"));
        }
        let rolling = pairs.any_rolling();
        let team = Arc::new(Team::new(threads)?);
        let problem = Problem { classes: classes(&pairs), ..Problem::default() };
        Ok(Self {
            setup,
            cone,
            pairs,
            rolling,
            state,
            own,
            report: StepReport::default(),
            total: [0; 2],
            team,
            problem,
            impulses: Impulses::default(),
            made: Vec::new(),
        })
    }

    /// What is kept beside the grains.
    pub fn cone_state(&self) -> ConeState {
        self.own
    }

    /// What the last step's solve took.
    pub fn report(&self) -> StepReport {
        self.report
    }

    /// Mean number of iterations of all steps.
    pub fn mean_iterations(&self) -> f64 {
        self.total[1] as f64 / self.total[0].max(1) as f64
    }

    /// Whether any pair of materials adheres.
    pub fn has_adhesion(&self) -> bool {
        self.pairs.any_adhesion()
    }

    /// Changes the step.
    pub fn set_step(&mut self, step: f64) {
        self.setup.step = step;
    }

    /// Changes the setup, for materials of bodies, which are known later than the bed's.
    pub fn set_setup(&mut self, setup: Setup) {
        self.pairs = PairTable::new(&setup.materials, &setup.overrides);
        let rolling = self.pairs.any_rolling();
        // The lists hold room for what rolls, or do not.
        self.state.stale |= rolling != self.rolling;
        self.rolling = rolling;
        self.problem.classes = classes(&self.pairs);
        self.setup = setup;
    }

    /// Kinetic and potential energy (J).
    pub fn energy(&self) -> f64 {
        let g = self.setup.gravity;
        let free = self.state.rows.iter().filter(|r| r[INV_M] > 0.0);
        let potential: f64 = free.map(|r| -dot(g, vec_at(r, 0)) / r[INV_M]).sum();
        self.state.kinetic_energy() + potential
    }

    /// Energy turned into heat since the account was opened (J).
    pub fn dissipated(&self) -> f64 {
        match self.state.energy_account {
            Some([energy, work]) => (self.state.body_work - work) - (self.energy() - energy),
            None => 0.0,
        }
    }

    /// Parts to take a step of `h` in, so that no grain moves further than a third of the least radius in one.
    fn parts_of(&self, h: f64) -> u32 {
        let free = self.state.rows.iter().filter(|r| r[INV_M] > 0.0);
        let (fastest, least) = free.fold((0.0_f64, f64::INFINITY), |(v, r), row| {
            let speed = vec_at(row, V);
            (v.max(dot(speed, speed)), r.min(row[R]))
        });
        let travel = h * fastest.sqrt() + h * h * norm(self.setup.gravity);
        (3.0 * travel / least).ceil().clamp(1.0, f64::from(MOST_PARTS)) as u32
    }

    fn skin(&self) -> f64 {
        let rows = &self.state.rows;
        let mean = rows.iter().map(|r| r[R]).sum::<f64>() / rows.len().max(1) as f64;
        self.setup.skin * mean
    }

    /// Velocities under gravity; lists that hold every pair that may meet in this step.
    fn prepare(&mut self) -> Result<(), DemError> {
        let (h, g) = (self.setup.step, self.setup.gravity);
        let mut fastest = 0.0_f64;
        for row in self.state.rows.iter_mut().filter(|r| r[INV_M] > 0.0) {
            for c in 0..3 {
                row[V + c] += h * g[c];
            }
            let v = vec_at(row, V);
            fastest = fastest.max(dot(v, v));
        }
        let travel = h * fastest.sqrt();
        // Impulses may speed a grain up: twice the fastest is the most that a hit from behind gives.
        if self.state.stale || self.own.skin == 0.0 || self.own.moved + 2.0 * travel > 0.5 * self.own.skin {
            let skin = self.skin().max(6.0 * travel);
            let (walls, rolling, team) = (&self.setup.walls[..], self.rolling, &*self.team);
            let longest = f64::INFINITY;
            rebuild(
                &mut self.state,
                &Making { skin, walls, rolling, period: None, keep: None, longest, team, hint: HINT },
            )?;
            (self.own.skin, self.own.moved) = (skin, 0.0);
        }
        Ok(())
    }

    fn step(&mut self, t: f64, bodies: &mut [Body], last: bool) -> Result<(), DemError> {
        let h = self.setup.step;
        self.prepare()?;
        let mut reach = Vec::with_capacity(bodies.len());
        for body in &mut *bodies {
            body.shape.move_to(t + h);
            let after = body.shape.bounds();
            body.shape.move_to(t);
            let before = body.shape.bounds();
            let moved = (0..3).flat_map(|k| [(after[0][k] - before[0][k]).abs(), (after[1][k] - before[1][k]).abs()]);
            let moved = moved.filter(|x| x.is_finite()).fold(0.0, f64::max);
            reach.push(moved.max(obstacles::reach(body, h)));
            (body.force, body.moment) = ([0.0; 3], [0.0; 3]);
        }
        self.pose(bodies, &reach);
        let parallel = self.team.threads() > 1;
        let options = Options {
            method: self.cone.method,
            tolerance: self.cone.tolerance,
            iterations: self.cone.iterations,
            parallel,
        };
        let mut memory =
            if self.own.lipschitz > 0.0 { Memory { lipschitz: self.own.lipschitz } } else { Memory::default() };
        let outcome = cone::solve(&mut self.problem, &mut self.impulses, &mut memory, &options);
        self.own.lipschitz = memory.lipschitz;
        self.own.step = self.setup.step;
        self.own.unconverged += u64::from(!outcome.converged);
        self.total = [self.total[0] + 1, self.total[1] + u64::from(outcome.iterations)];
        let contacts = self.problem.contacts();
        let worst = self.problem.a.get(outcome.worst).map_or([0.0; 3], |&a| vec_at(&self.state.rows[a as usize], 0));
        self.report = StepReport { contacts, outcome, worst };
        self.hand_out(bodies);
        obstacles::advance(bodies, &self.setup, &self.pairs, t, self.cone.obstacle_step);
        self.integrate(last)
    }

    /// Makes the problem of this step.
    fn pose(&mut self, bodies: &[Body], reach: &[f64]) {
        let state = &self.state;
        let g = norm(self.setup.gravity);
        let mean = state.rows.iter().map(|r| r[R]).sum::<f64>() / state.rows.len().max(1) as f64;
        let world = World {
            rows: &state.rows,
            pairs: &self.pairs,
            walls: &self.setup.walls,
            bodies,
            h: self.setup.step,
            margin: 0.02 * mean,
            reach,
            recovery_time: self.cone.recovery_time,
            recovery: self.cone.recovery_speed,
            bounce: 4.0 * g * self.setup.step + 1e-3,
            adhesion_scale: state.adhesion_scale,
            rolling: self.rolling,
            elastic: self.cone.elastic,
            ratio: if self.own.step > 0.0 { self.setup.step / self.own.step } else { 1.0 },
        };
        self.made.resize_with(state.slabs.len(), Made::default);
        let tasks = state.slabs.iter().zip(&mut self.made).collect();
        self.team.each(tasks, |(slab, made)| world.contacts(slab, made));

        // Vectors keep their length from step to step, and slabs fill them side by side.
        let (p, made, team) = (&mut self.problem, &self.made, &*self.team);
        let (movable, mut contact, mut prescribed) = (state.rows.len(), 0, state.rows.len() + 1);
        p.movable = movable;
        p.blocks.clear();
        let mut offsets = Vec::with_capacity(made.len());
        for (made, slab) in made.iter().zip(&state.slabs) {
            let [first, last, end] = [slab.first, slab.last, slab.halo].map(|x| x as usize);
            p.blocks.push(cone::Block { contact, first, last, end });
            offsets.push(prescribed as u32);
            contact += made.a.len();
            prescribed += made.prescribed.len();
        }
        p.bodies.resize(prescribed, [0.0; 8]);
        p.bodies[movable] = [0.0; 8];
        let (free, others) = p.bodies.split_at_mut(movable);
        let mut tasks = Vec::with_capacity(made.len());
        let mut rest = free;
        for slab in &state.slabs {
            let (own, after) = rest.split_at_mut((slab.last - slab.first) as usize);
            tasks.push((own, &state.rows[slab.grains()]));
            rest = after;
        }
        team.each(tasks, |(to, from)| to.iter_mut().zip(from).for_each(|(to, row)| *to = ball(row)));
        let mut rest = &mut others[1..];
        for made in made {
            let (own, after) = rest.split_at_mut(made.prescribed.len());
            own.copy_from_slice(&made.prescribed);
            rest = after;
        }
        p.b.resize(contact, 0);
        let mut tasks = Vec::with_capacity(made.len());
        let mut rest = &mut p.b[..];
        for (made, &offset) in made.iter().zip(&offsets) {
            let (own, after) = rest.split_at_mut(made.b.len());
            tasks.push((own, &made.b, offset));
            rest = after;
        }
        team.each(tasks, |(to, from, offset)| {
            for (to, &b) in to.iter_mut().zip(from) {
                *to = match b {
                    u32::MAX => movable as u32,
                    b if b & PRESCRIBED != 0 => offset + (b & !PRESCRIBED),
                    b => b,
                };
            }
        });
        join(team, &mut p.a, made, |m| &m.a);
        join(team, &mut p.frame, made, |m| &m.frame);
        join(team, &mut p.class, made, |m| &m.class);
        if self.pairs.any_adhesion() {
            join(team, &mut p.cohesion, made, |m| &m.cohesion);
        } else {
            p.cohesion.clear();
        }
        join(team, &mut p.compliance, made, |m| &m.compliance);
        join(team, &mut p.bias, made, |m| &m.bias);
        join(team, &mut p.lever, made, |m| &m.lever);
        join(team, &mut p.couple_compliance, made, |m| &m.couple_compliance);
        join(team, &mut p.couple_bias, made, |m| &m.couple_bias);
        join(team, &mut self.impulses.force, made, |m| &m.force);
        join(team, &mut self.impulses.couple, made, |m| &m.couple);
    }

    /// Impulses to where they act and where they are kept.
    fn hand_out(&mut self, bodies: &mut [Body]) {
        let (h, rolling) = (self.setup.step, self.rolling);
        let (state, made, impulses, problem) = (&mut self.state, &self.made, &self.impulses, &self.problem);
        let (rows, walls) = (&state.rows, self.setup.walls.len());
        let starts: Vec<usize> = self.problem.blocks.iter().map(|b| b.contact).collect();
        let tasks: Vec<_> = state.slabs.iter_mut().zip(made).zip(starts).collect();
        let outs: Vec<(Vec<Vec3>, Vec<BodyLoad>)> = self.team.map_each(tasks, |((slab, made), start)| {
            let impulse = |c: usize| {
                let couple = impulses.couple.get(start + c).copied().unwrap_or_default();
                let force = impulses.force[start + c];
                (force, couple, problem.slip_speed(start + c, force))
            };
            let (mut wall_force, mut loads) = (vec![[0.0; 3]; walls], Vec::new());
            keep(slab, made, rows, rolling, h, impulse, &mut wall_force, &mut loads);
            (wall_force, loads)
        });
        state.wall_force.clear();
        state.wall_force.resize(walls, [0.0; 3]);
        for (wall_force, loads) in &outs {
            for (sum, f) in state.wall_force.iter_mut().zip(wall_force) {
                *sum = add(*sum, *f);
            }
            for load in loads {
                state.body_work += bodies[load.body as usize].apply(load, h);
            }
        }
    }

    fn integrate(&mut self, keep_force: bool) -> Result<(), DemError> {
        let h = self.setup.step;
        let state = &mut self.state;
        let mut furthest = 0.0_f64;
        let (mut longest, mut sound) = (0.0_f64, true);
        for (k, (row, new)) in state.rows.iter_mut().zip(&self.problem.bodies).enumerate() {
            if row[INV_M] == 0.0 {
                continue;
            }
            let v = [new[0], new[1], new[2]];
            if keep_force {
                state.force[k] = sub(v, vec_at(row, V)).map(|x| x / (h * row[INV_M]));
            }
            for c in 0..3 {
                row[V + c] = v[c];
                row[W + c] = new[4 + c] / row[R];
                row[c] += h * v[c];
            }
            longest = longest.max(h * norm(v) / row[R]);
            let d = sub(vec_at(row, 0), vec_at(row, X0));
            furthest = furthest.max(dot(d, d));
            sound &= d.iter().all(|x| x.is_finite());
        }
        self.own.moved = furthest.sqrt();
        state.steps += 1;
        state.time += h;
        if !sound {
            let k = state.rows.iter().position(|r| !r.iter().all(|x| x.is_finite())).unwrap_or(0);
            return Err(DemError::NotFinite { id: state.ids[k], time: state.time });
        }
        // Further than half a radius, it may have passed through another.
        if longest > 0.5 {
            return Err(DemError::parameter(
                format!("step at {:.6} s", state.time),
                format!("{h} s, in which a grain moved {longest:.2} of its radius"),
                "a step in which no grain moves more than half its radius; take a smaller one",
            ));
        }
        // The lists missed whoever came further than they were made for.
        self.state.stale |= self.own.moved > 0.5 * self.own.skin;
        Ok(())
    }
}

/// One list of all slabs, in their order.
fn join<T: Copy + Default + Send + Sync>(team: &Team, to: &mut Vec<T>, made: &[Made], list: impl Fn(&Made) -> &Vec<T>) {
    to.resize(made.iter().map(|m| list(m).len()).sum(), T::default());
    let mut tasks = Vec::with_capacity(made.len());
    let mut rest = &mut to[..];
    for m in made {
        let from = list(m);
        let (own, after) = rest.split_at_mut(from.len());
        tasks.push((own, from));
        rest = after;
    }
    team.each(tasks, |(to, from)| to.copy_from_slice(from));
}

impl GrainEngine for ConeEngine {
    fn setup(&self) -> &Setup {
        &self.setup
    }

    fn advance(&mut self, steps: u32, bodies: &mut [Body]) -> Result<(), DemError> {
        let team = Arc::clone(&self.team);
        let h = self.setup.step;
        let least = self.state.rows.iter().map(|r| r[INV_M]).filter(|x| *x > 0.0).fold(f64::INFINITY, f64::min);
        obstacles::check(bodies, if least.is_finite() { 1.0 / least } else { 0.0 })?;
        team.enter(|| {
            (0..steps).try_for_each(|k| {
                // Grains that fall or fly take the step in parts.
                let parts = self.parts_of(h);
                self.setup.step = h / f64::from(parts);
                let done = (0..parts).try_for_each(|j| {
                    let t = f64::from(k) * h + f64::from(j) * self.setup.step;
                    self.step(t, bodies, k + 1 == steps && j + 1 == parts)
                });
                self.setup.step = h;
                done
            })
        })
    }

    fn state(&self) -> &DemState {
        &self.state
    }

    fn restore(&mut self, state: DemState) {
        self.state = state;
        self.own = ConeState::default();
        self.state.stale = true;
    }

    fn set_gravity(&mut self, gravity: Vec3) {
        self.setup.gravity = gravity;
    }

    fn take_setup(&mut self, setup: Setup) -> Result<(), DemError> {
        self.set_setup(setup);
        Ok(())
    }

    fn scale_adhesion(&mut self, factor: f64) {
        self.state.adhesion_scale = factor;
    }

    fn observe(&self, _: &[Body], _: &mut dyn FnMut(usize, Partner, &Touched)) {}

    fn open_energy_account(&mut self) {
        self.state.energy_account = Some([self.energy(), self.state.body_work]);
    }
}

/// What the contacts do to the free grains (N) at the last step: the change of momentum less gravity.
pub fn contact_force(state: &DemState) -> Vec3 {
    state.force.iter().fold([0.0; 3], |sum, f| add_scaled(sum, 1.0, *f))
}
