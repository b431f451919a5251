//! What a solver keeps: impulses by block, velocities of all bodies.

use super::sweep::{Slip, contact};
use super::{Block, Impulses, Outcome, Problem, Row, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// Force and couple of each contact of a block.
#[derive(Clone, Debug, Default)]
pub struct Set {
    pub force: Vec<Vec3>,
    pub couple: Vec<Vec3>,
}

/// A block at work.
#[derive(Clone, Debug, Default)]
pub struct Part {
    pub block: Block,
    pub contacts: Range<usize>,
    /// This iterate, the one before, the next.
    pub now: Set,
    pub before: Set,
    pub next: Set,
    /// Change of impulse on the bodies `first..end`: force (0-2), spin (4-6, before the factor k).
    pub load: Vec<Row>,
    pub sums: Sums,
}

/// Sums over contacts.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sums {
    /// d'Wd of the step d from the point of departure.
    pub length: f64,
    /// u'(next - now).
    pub along: f64,
    /// Largest residual (m/s), and its contact.
    pub residual: f64,
    pub worst: usize,
    /// sum g'(u - D'v): twice the objective, less what the velocities before contact say.
    pub work: f64,
}

impl Sums {
    /// Adds those of the next block.
    pub fn add(&mut self, other: &Sums) {
        self.length += other.length;
        self.along += other.along;
        self.work += other.work;
        // NaN wins: a solve that blows up must not look converged.
        if other.residual > self.residual || other.residual.is_nan() {
            (self.residual, self.worst) = (other.residual, other.worst);
        }
    }
}

/// All blocks and the velocities that belong to their impulses.
pub struct Parts {
    pub parts: Vec<Part>,
    /// Velocities of all bodies at the iterate now, before, at the point of departure, and at the next iterate.
    pub now: Vec<Row>,
    pub before: Vec<Row>,
    pub at: Vec<Row>,
    pub next: Vec<Row>,
    pub next_at: Vec<Row>,
    parallel: bool,
}

impl Parts {
    /// Takes the impulses given, cut back to their cones, and works out the velocities.
    pub fn new<const ROLL: bool>(problem: &Problem, impulses: &Impulses, parallel: bool) -> Self {
        let blocks = &problem.blocks;
        let end = |k: usize| blocks.get(k + 1).map_or(problem.contacts(), |b| b.contact);
        let parts = blocks.iter().enumerate().map(|(k, &block)| {
            let contacts = block.contact..end(k);
            let couple = if ROLL { impulses.couple[contacts.clone()].to_vec() } else { Vec::new() };
            let now = Set { force: impulses.force[contacts.clone()].to_vec(), couple };
            Part { block, contacts, before: now.clone(), next: now.clone(), now, ..Part::default() }
        });
        let empty = Vec::new;
        let mut all = Self {
            parts: parts.collect(),
            now: empty(),
            before: empty(),
            at: empty(),
            next: empty(),
            next_at: empty(),
            parallel,
        };
        all.each(|_, part| {
            for c in 0..part.contacts.len() {
                let k = part.contacts.start + c;
                let (force, couple) = (part.now.force[c], part.now.couple.get(c).copied().unwrap_or_default());
                let slip = contact::<ROLL>(problem, &problem.bodies, k).with_compliance(problem, k, force, couple);
                let (f, q) = slip.cut::<ROLL>(problem, k, force, couple);
                part.now.force[c] = f;
                if ROLL {
                    part.now.couple[c] = q;
                }
            }
        });
        all.velocities::<ROLL>(problem);
        all.before.clone_from(&all.now);
        all.at.clone_from(&all.now);
        all.next.clone_from(&all.now);
        all.next_at.clone_from(&all.now);
        all
    }

    /// Runs `task` on every part, in any order.
    pub fn each(&mut self, task: impl Fn(usize, &mut Part) + Sync) {
        each(self.parallel, &mut self.parts, task);
    }

    /// The sums of all parts, added in order.
    pub fn sums(&self) -> Sums {
        self.parts.iter().fold(Sums::default(), |mut s, p| {
            s.add(&p.sums);
            s
        })
    }

    /// Velocities `now` from the velocities before contact and the impulses `now`.
    pub fn velocities<const ROLL: bool>(&mut self, problem: &Problem) {
        self.each(|_, part| {
            part.load.clear();
            part.load.resize(part.block.end - part.block.first, [0.0; 8]);
            for c in 0..part.contacts.len() {
                let k = part.contacts.start + c;
                let couple = if ROLL { part.now.couple[c] } else { [0.0; 3] };
                Slip::load::<ROLL>(problem, k, part.block, part.now.force[c], couple, &mut part.load);
            }
        });
        self.now.clone_from(&problem.bodies);
        let mut now = std::mem::take(&mut self.now);
        self.bodies(&mut now, |load, body| add_load(body, load));
        self.now = now;
    }

    /// Runs `task(load, row)` on every movable body, its load summed over the blocks that reach it, in order.
    pub fn bodies(&self, rows: &mut [Row], task: impl Fn(&Row, &mut Row) + Sync) {
        let mut work = Vec::with_capacity(self.parts.len());
        let mut rest = rows;
        for part in &self.parts {
            let (own, after) = rest.split_at_mut(part.block.last - part.block.first);
            work.push(own);
            rest = after;
        }
        each(self.parallel, &mut work, |k, own| {
            let halo = self.halo(k);
            for (i, row) in own.iter_mut().enumerate() {
                task(&self.load(k, i, halo), row);
            }
        });
    }

    /// What the block before left for this one's first bodies.
    pub fn halo(&self, k: usize) -> &[Row] {
        match k.checked_sub(1).map(|b| &self.parts[b]) {
            Some(p) => &p.load[p.block.last - p.block.first..],
            None => &[],
        }
    }

    /// Load on body `i` of block `k`.
    #[inline(always)]
    pub fn load(&self, k: usize, i: usize, halo: &[Row]) -> Row {
        let mut load = self.parts[k].load[i];
        if let Some(more) = halo.get(i) {
            for c in 0..8 {
                load[c] += more[c];
            }
        }
        load
    }

    /// Whether blocks run side by side.
    pub fn parallel(&self) -> bool {
        self.parallel
    }

    /// Residual of the iterate `now`, its worst contact, and its objective.
    pub fn measure<const ROLL: bool>(&mut self, problem: &Problem) -> (Sums, f64) {
        let now = std::mem::take(&mut self.now);
        self.each(|_, part| {
            let mut sums = Sums::default();
            for c in 0..part.contacts.len() {
                let k = part.contacts.start + c;
                let (force, couple) = (part.now.force[c], if ROLL { part.now.couple[c] } else { [0.0; 3] });
                let slip = contact::<ROLL>(problem, &now, k).with_compliance(problem, k, force, couple);
                let residual = slip.residual::<ROLL>(problem, k, force, couple);
                if residual > sums.residual || residual.is_nan() {
                    (sums.residual, sums.worst) = (residual, k);
                }
                let free = contact::<ROLL>(problem, &problem.bodies, k);
                sums.work += free.work::<ROLL>(force, couple) + slip.work::<ROLL>(force, couple);
            }
            part.sums = sums;
        });
        self.now = now;
        let sums = self.sums();
        (sums, 0.5 * sums.work)
    }

    /// The impulses now, to their owner.
    pub fn give_back(&mut self, impulses: &mut Impulses) {
        for part in &self.parts {
            impulses.force[part.contacts.clone()].copy_from_slice(&part.now.force);
            if !part.now.couple.is_empty() {
                impulses.couple[part.contacts.clone()].copy_from_slice(&part.now.couple);
            }
        }
    }
}

/// Velocity change of a body under a load.
#[inline(always)]
pub fn add_load(body: &mut Row, load: &Row) {
    for c in 0..3 {
        body[c] += body[3] * load[c];
        body[4 + c] += body[7] * load[4 + c];
    }
}

/// Runs `task` on every entry, side by side or one after the other.
pub fn each<T: Send>(parallel: bool, items: &mut [T], task: impl Fn(usize, &mut T) + Sync) {
    if parallel {
        items.par_iter_mut().enumerate().with_max_len(1).for_each(|(k, x)| task(k, x));
    } else {
        items.iter_mut().enumerate().for_each(|(k, x)| task(k, x));
    }
}

/// The best iterate so far.
#[derive(Clone, Debug, Default)]
pub struct Best {
    kept: Vec<Set>,
    residual: f64,
    objective: f64,
    worst: usize,
}

impl Best {
    /// Nothing yet.
    pub fn new() -> Self {
        Self { residual: f64::INFINITY, objective: f64::INFINITY, ..Self::default() }
    }

    /// Objective of what is kept (J).
    pub fn objective(&self) -> f64 {
        self.objective
    }

    /// Measures the iterate `now`; keeps it if neither its residual nor its objective is worse than what is kept. Whether it is within the
    /// tolerance: then it is the result, though its objective may differ by round-off from a better one.
    pub fn look<const ROLL: bool>(&mut self, parts: &mut Parts, problem: &Problem, tolerance: f64) -> bool {
        let (sums, objective) = parts.measure::<ROLL>(problem);
        let converged = sums.residual <= tolerance;
        let better = sums.residual < self.residual && objective <= self.objective;
        if better && !converged {
            self.kept.resize_with(parts.parts.len(), Set::default);
            for (kept, part) in self.kept.iter_mut().zip(&parts.parts) {
                kept.force.clone_from(&part.now.force);
                kept.couple.clone_from(&part.now.couple);
            }
        }
        if better || converged {
            (self.residual, self.worst, self.objective) = (sums.residual, sums.worst, objective);
        }
        converged
    }

    /// What the solve came to; unless the iterate `now` converged, the best one takes its place.
    pub fn end(self, parts: &mut Parts, iterations: u32, converged: bool) -> Outcome {
        if !converged {
            for (kept, part) in self.kept.into_iter().zip(&mut parts.parts) {
                part.now = kept;
            }
        }
        Outcome { iterations, residual: self.residual, worst: self.worst, objective: self.objective, converged }
    }
}
