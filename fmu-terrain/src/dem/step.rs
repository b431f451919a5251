//! A step.
//!
//! Rebuild the lists if some grain has moved too far; move the bodies to this step's time; one sweep over the slabs, contacts
//! and, right behind, integration (semi-implicit Euler) while rows and forces are still in the cache; sum what the grains did to
//! bodies and walls, in slab order. The sweep runs in regions of several slabs, one task each; only the first slab of
//! a region is integrated after all regions have met (see [`terramech_simd::regions`]). How many regions there are
//! follows from the threads and changes no sum.

use super::body::{Body, BodyLoad};
use super::engine::{CpuEngine, HINT, KEEP};
use super::error::DemError;
use super::grains::Row;
use super::kernel::{World, contacts};
use super::law::dispatch_law;
use super::period;
use super::slab::{Near, Scratch, Slab};
use super::sleep;
use super::vec3::{Vec3, add, norm};
use std::time::Instant;
use terramech_simd::{Cut, Force, Isa, Motion, Moved, Region, advance, regions};

/// Regions for each thread: so that one with a wheel in it does not keep the others waiting.
const REGIONS_PER_THREAD: usize = 4;

/// But no fewer slabs in a region than these, as long as every thread has one: each region has force buffers of three slabs.
const SLABS_PER_REGION: usize = 4;

/// How grains move on, on which instruction path, and whether their net contact forces are kept.
#[derive(Clone, Copy)]
struct Way {
    motion: Motion,
    isa: Isa,
    keep: bool,
}

/// What a region works on.
struct Task<'a> {
    region: Region<'a, Row>,
    slabs: &'a mut [Slab],
    near: &'a mut [Near],
    kept: &'a mut [Vec3],
    scratch: &'a mut Scratch,
}

impl CpuEngine {
    pub(super) fn step(&mut self, t: f64, bodies: &mut [Body], last: bool) -> Result<(), DemError> {
        for b in &mut *bodies {
            b.shape.move_to(t);
            (b.force, b.moment) = ([0.0; 3], [0.0; 3]);
        }
        self.renew(bodies)?;
        self.look_behind()?;
        let h = self.setup.step;
        self.approach(h);
        let motion = Motion { h, gravity: self.setup.gravity, reach: 0.5 * self.skin };
        let way = Way { motion, isa: self.isa(), keep: last };
        let begun = Instant::now();
        let swept = self.inside(|e| e.sweep(bodies, way));
        if let Some(spread) = &mut self.spread {
            spread.took(begun.elapsed().as_secs_f64());
        }
        self.push(&swept)?;
        self.inside(|e| e.finish(&swept, way));
        let touched = self.touched(last, bodies)?;
        let state = &mut self.state;
        state.wall_force.fill([0.0; 3]);
        let walls = self.walls.len();
        for (k, f) in touched.walls.into_iter().enumerate() {
            let sum = &mut state.wall_force[k % walls];
            *sum = add(*sum, f);
        }
        for load in touched.loads {
            state.body_work += bodies[load.body as usize].apply(&load, h);
        }
        let options = self.options();
        super::obstacle::contact::step(bodies, &self.setup, &self.walls, &self.pairs, &options);
        self.tell_obstacles(bodies)?;
        let state = &mut self.state;
        state.steps += 1;
        state.time += h;
        Ok(())
    }

    /// New lists where they are due; wakes slabs and lets them sleep.
    fn renew(&mut self, bodies: &mut [Body]) -> Result<(), DemError> {
        let moved = self.follow(bodies)?;
        self.state.stale = self.any(self.state.stale)?;
        let keep = Some(KEEP * self.skin);
        let Some(sleep) = self.setup.sleep else {
            return if self.state.stale { self.rebuild(HINT, keep) } else { Ok(()) };
        };
        let (zones, gravity) = (sleep::zones(bodies), norm(self.setup.gravity));
        sleep::wake(&mut self.state, &sleep, &zones);
        let look = self.state.steps.is_multiple_of(sleep::LOOK);
        let drowsy = look && !moved && !self.state.stale;
        let drowsy = drowsy && self.any(sleep::drowsy(&self.state, &sleep, &zones, gravity))?;
        if moved || self.state.stale || drowsy {
            if !moved {
                self.rebuild(HINT, keep)?;
            }
            self.settle(&sleep, &zones, gravity)?;
        }
        Ok(())
    }

    /// Takes off the slack of each slab's near pairs what they may have come closer in the last step: by the speeds of
    /// the slab and of the next one, where its partners may lie.
    fn approach(&mut self, h: f64) {
        self.near.resize_with(self.state.slabs.len(), Near::default);
        for k in 0..self.near.len() {
            // Behind the last comes the first, where the bed repeats itself.
            let behind = self.spread.as_ref().map_or(self.near[0].speed, |s| s.speed);
            let next = self.near.get(k + 1).map_or(behind, |n| n.speed);
            let own = self.near[k].speed;
            self.near[k].slack -= h * (own + own.max(next)) * (1.0 + 1e-9);
        }
    }

    fn sweep(&mut self, bodies: &[Body], way: Way) -> Swept {
        let options = self.options();
        let (setup, rolling, team) = (&self.setup, self.rolling, &self.team);
        let world = World { pairs: &self.pairs, walls: &self.walls, bodies, batch: self.batch.as_ref(), options };
        let state = &mut self.state;
        let count = state.rows.len();
        let cuts: Vec<Cut> = state
            .slabs
            .iter()
            .map(|s| Cut { first: s.first as usize, last: s.last as usize, halo: (s.halo as usize).min(count) })
            .collect();
        let images = match (setup.period, state.slabs.last()) {
            (Some(length), Some(last)) => period::images(&state.rows, last.halo - count as u32, length),
            _ => Vec::new(),
        };
        let behind = self.spread.as_ref().map_or(&images[..], |s| &s.ghosts);
        let work = work(&state.slabs, self.spread.as_ref().is_none_or(|s| s.asleep));
        if work.is_empty() {
            self.scratch.clear();
            return Swept { cuts, starts: Vec::new(), work };
        }
        let starts = starts(&work, team.threads());
        self.scratch.resize_with(starts.len(), Scratch::default);

        let mut tasks = Vec::with_capacity(starts.len());
        let (mut slabs, mut kept, mut near) = (&mut state.slabs[..], &mut state.force[..], &mut self.near[..]);
        for (region, scratch) in regions(&mut state.rows, &cuts, &starts).into_iter().zip(&mut self.scratch) {
            let range = region.slabs();
            let grains = cuts[range.end - 1].last - cuts[range.start].first;
            let (here, rest) = std::mem::take(&mut slabs).split_at_mut(range.len());
            let (forces, rest_kept) = std::mem::take(&mut kept).split_at_mut(grains);
            let (pairs, rest_near) = std::mem::take(&mut near).split_at_mut(range.len());
            (slabs, kept, near) = (rest, rest_kept, rest_near);
            tasks.push(Task { region, slabs: here, near: pairs, kept: forces, scratch });
        }
        dispatch_law!(setup.law, setup.form, law => team.each(tasks, |task| {
            task.run(&cuts, &work, way, |rows, slab, near, scratch| {
                let mut joined = std::mem::take(&mut scratch.joined);
                let rows = if slab.halo as usize > count {
                    joined.clear();
                    joined.extend_from_slice(rows);
                    joined.extend_from_slice(behind);
                    &joined[..]
                } else {
                    rows
                };
                if rolling {
                    contacts::<_, true>(law, &world, rows, slab, near, scratch, &mut ());
                } else {
                    contacts::<_, false>(law, &world, rows, slab, near, scratch, &mut ());
                }
                scratch.joined = joined;
            });
        }));
        Swept { cuts, starts, work }
    }

    /// Integrates the first slab of each region, whose forces are complete now.
    fn finish(&mut self, swept: &Swept, way: Way) {
        let Swept { cuts, starts, work } = swept;
        let state = &mut self.state;
        // Where the bed goes on before this member's part, what is done there to its first grains has been told.
        let pushed = self.spread.as_ref().map_or(&[][..], |s| &s.pushed);
        let scratch = &self.scratch;
        let periodic = self.setup.period.is_some();
        let mut tasks = Vec::with_capacity(starts.len());
        let (mut rows, mut kept, mut at) = (&mut state.rows[..], &mut state.force[..], 0);
        for (r, &s) in starts.iter().enumerate() {
            let Cut { first, last, .. } = cuts[s];
            let (here, rest) = std::mem::take(&mut rows)[first - at..].split_at_mut(last - first);
            let (forces, rest_kept) = std::mem::take(&mut kept)[first - at..].split_at_mut(last - first);
            (rows, kept, at) = (rest, rest_kept, last);
            let slabs = starts.get(r + 1).map_or(cuts.len(), |next| *next) - s;
            let own = if slabs > 1 { &scratch[r].start } else { &scratch[r].force };
            // The region before ends with the slab before; before the first is the last, where the bed repeats itself.
            let slab_before = s.checked_sub(1).or(periodic.then(|| cuts.len() - 1));
            let before = slab_before.map_or(pushed, |b| {
                let region = r.checked_sub(1).unwrap_or(starts.len() - 1);
                &scratch[region].force[cuts[b].last - cuts[b].first..]
            });
            if work[s] == Work::All {
                tasks.push((here, forces, &own[..], before));
            }
        }
        let done = self.team.map_each(tasks, |(rows, kept, own, before)| way.integrate(rows, kept, own, before));
        state.stale = scratch.iter().any(|s| s.moved);
        for (&s, moved) in starts.iter().filter(|&&s| work[s] == Work::All).zip(done) {
            state.stale |= moved.far;
            self.near[s].speed = moved.speed;
        }
    }
}

/// What a sweep leaves to be finished.
struct Swept {
    cuts: Vec<Cut>,
    starts: Vec<usize>,
    work: Vec<Work>,
}

/// What grains do to walls and bodies in a step, slab after slab.
struct TouchedBy {
    walls: Vec<Vec3>,
    loads: Vec<BodyLoad>,
}

impl CpuEngine {
    /// Whether it holds here, or for any other member.
    fn any(&mut self, mine: bool) -> Result<bool, DemError> {
        self.spread.as_mut().map_or(Ok(mine), |s| s.links().any(mine))
    }

    /// Members tell each other where the grains at their cuts are.
    pub(super) fn look_behind(&mut self) -> Result<(), DemError> {
        let Some(spread) = &mut self.spread else { return Ok(()) };
        let speed = self.near.first().map_or(0.0, |n| n.speed);
        let asleep = self.state.slabs.first().is_none_or(|s| s.asleep);
        spread.look_behind(&self.state.rows, speed, asleep)
    }

    /// What the last slab does to grains of the next member is told there.
    fn push(&mut self, swept: &Swept) -> Result<(), DemError> {
        let Some(spread) = &mut self.spread else { return Ok(()) };
        let forces = match (self.scratch.last(), swept.cuts.last(), swept.work.last()) {
            (Some(scratch), Some(cut), Some(work)) if *work != Work::Nothing => {
                // The region's only slab is its first, whose forces are kept where they were made.
                let whole = &scratch.force;
                whole.get(cut.last - cut.first..).unwrap_or_default()
            }
            _ => &[],
        };
        spread.push(forces)
    }

    /// Lets slabs sleep and wake, by what those beside them do.
    fn settle(&mut self, sleep: &sleep::Sleep, zones: &[[f64; 2]], gravity: f64) -> Result<(), DemError> {
        let energies = sleep::energies(&self.state, sleep, zones, gravity);
        let mut beside = [0.0; 2];
        if let Some(spread) = &mut self.spread {
            beside = spread.beside(&energies)?;
        }
        sleep::settle(&mut self.state, sleep, zones, &energies, beside);
        Ok(())
    }

    /// What grains have done to walls and bodies in this step: on the lead of a team that of all members, on the others nothing. Of walls the last step of a
    /// call counts.
    fn touched(&mut self, last: bool, bodies: &[Body]) -> Result<TouchedBy, DemError> {
        let mut all = TouchedBy { walls: Vec::new(), loads: Vec::new() };
        for s in &mut self.scratch {
            all.walls.append(&mut s.wall_force);
            all.loads.append(&mut s.body_loads);
        }
        match &mut self.spread {
            None => Ok(all),
            Some(spread) => {
                let bounds = bodies.iter().map(|b| b.shape.bounds()).map(|[low, high]| [low[0], high[0]]);
                let zones: Vec<[f64; 2]> = bounds.filter(|z| z[0] <= z[1]).collect();
                let (walls, loads) = spread.lead_gets(all.walls, all.loads, last, &zones)?;
                Ok(TouchedBy { walls, loads })
            }
        }
    }

    /// The lead has moved the obstacles: the others learn where they are.
    fn tell_obstacles(&mut self, bodies: &mut [Body]) -> Result<(), DemError> {
        let Some(spread) = &mut self.spread else { return Ok(()) };
        let free: Vec<&mut super::FreeBody> = bodies.iter_mut().filter_map(|b| b.shape.as_free()).collect();
        if free.is_empty() { Ok(()) } else { spread.same_obstacles(free) }
    }
}

/// What is done to a slab in a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Work {
    /// Nothing: it sleeps, and so does what it looks at.
    Nothing,
    /// Contacts: it sleeps, but its halo moves.
    Contacts,
    /// Contacts and motion.
    All,
}

fn work(slabs: &[Slab], asleep_behind: bool) -> Vec<Work> {
    let of = |(k, s): (usize, &Slab)| match slabs.get(k + 1).map_or(asleep_behind, |next| next.asleep) {
        _ if !s.asleep => Work::All,
        false => Work::Contacts,
        true => Work::Nothing,
    };
    slabs.iter().enumerate().map(of).collect()
}

/// First slabs of the regions, which hold about the same number of slabs that are awake.
fn starts(work: &[Work], threads: usize) -> Vec<usize> {
    let awake = work.iter().filter(|w| **w == Work::All).count();
    let enough = (awake / SLABS_PER_REGION).max(threads);
    let most = if threads > 1 { enough.min(threads * REGIONS_PER_THREAD) } else { 1 };
    let count = awake.clamp(1, most).min(work.len());
    let mut starts = Vec::with_capacity(count);
    let mut seen = 0;
    for (k, w) in work.iter().enumerate() {
        if starts.len() < count && (k == 0 || *w == Work::All && seen * count >= starts.len() * awake) {
            starts.push(k);
        }
        seen += usize::from(*w == Work::All);
    }
    starts
}

impl Task<'_> {
    fn run(self, cuts: &[Cut], work: &[Work], way: Way, contacts: impl Fn(&[Row], &mut Slab, &mut Near, &mut Scratch)) {
        let Self { region, slabs, near, kept, scratch } = self;
        let start = region.slabs().start;
        let first = cuts[start].first;
        scratch.moved = false;
        region.sweep(
            &mut (scratch, slabs, near, kept),
            |(scratch, slabs, near, _), k, rows| {
                let Scratch { force, before, start: kept, .. } = &mut **scratch;
                if k > start {
                    // Its own grains have been moved on, or wait for the end; its halo is still to be added.
                    before.clear();
                    before.extend_from_slice(force.get(cuts[k - 1].last - cuts[k - 1].first..).unwrap_or_default());
                }
                if k == start + 1 {
                    // The forces on the region's first slab are kept to the end.
                    std::mem::swap(force, kept);
                }
                // Where nothing is done, the slab behind sleeps: nobody asks for these forces.
                if work[k] != Work::Nothing {
                    contacts(rows, &mut slabs[k - start], &mut near[k - start], scratch);
                }
            },
            |(scratch, _, near, kept), k, rows| {
                if work[k] != Work::All {
                    return;
                }
                let halo = &scratch.before[..];
                let kept = &mut kept[cuts[k].first - first..cuts[k].last - first];
                let moved = way.integrate(rows, kept, &scratch.force, halo);
                scratch.moved |= moved.far;
                near[k - start].speed = moved.speed;
            },
        );
    }
}

impl Way {
    /// Moves the grains of a slab on. Own forces first, then those from the slab before: the canonical order of sums.
    fn integrate(self, rows: &mut [Row], kept: &mut [Vec3], own: &[Force], halo: &[Force]) -> Moved {
        if self.keep {
            for (i, f) in kept.iter_mut().enumerate() {
                let (a, b) = (&own[i], halo.get(i).copied().unwrap_or_default());
                *f = [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
            }
        }
        advance(self.isa, rows, own, halo, self.motion)
    }
}
