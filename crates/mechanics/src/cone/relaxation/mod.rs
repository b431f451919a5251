//! Projected successive over-relaxation: Gauss-Seidel over blocks, eight contacts at a time.
//!
//! Contacts of a block are sorted into colours; those of a colour share no movable body, so that eight of them go through the registers at once.
//! Blocks themselves have two colours, even and odd: a block reaches into the next one only, so that all even blocks run side by side, then all
//! odd ones. The order in which impulses meet a body depends on the problem alone: the same bits for any number of threads.
//!
//! A contact's step is its own exact solution, taken omega times as far; the objective cannot rise where 0 < omega < 2 (less for a contact whose
//! force and couple feel each other: `batch.rs`). Compliance bounds the condition of N, and a
//! few sweeps are enough; for rigid contacts in deep beds Nesterov's method catches up.

mod batch;
mod kernel;

use super::parts::each;
use super::{Impulses, Options, Outcome, Problem, Row, Vec3};
use batch::Plan;
use kernel::{Look, Sweep};
use terramech_simd::{FlushDenormals, active, dispatch};

/// Over-relaxation: measured best on a bed that a wheel drives through (`docs/benchmarks/dem-c.md`).
pub const OMEGA: f64 = 1.3;
/// Sweeps between two looks at the residual where no sweep says that one is worth it.
const LOOK: u32 = 20;

/// Memory of the solver from one solve to the next: lists, no state.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    plans: Vec<Plan>,
    best: Vec<Vec3>,
    best_couple: Vec<Vec3>,
}

/// What a look says.
#[derive(Clone, Copy, Default)]
struct Seen {
    residual: f64,
    worst: usize,
    objective: f64,
}

/// Solves from the impulses given; leaves the best there, and the velocities after contact in `problem.bodies`.
pub fn solve<const ROLL: bool>(problem: &mut Problem, impulses: &mut Impulses, options: &Options) -> Outcome {
    let mut scratch = std::mem::take(&mut problem.scratch);
    let bodies = std::mem::take(&mut problem.bodies);
    let blocks = problem.blocks.len();
    scratch.plans.resize_with(blocks, Plan::default);
    let before: Vec<Row> = bodies[..problem.movable].to_vec();
    {
        let (view, rows, start) = (&*problem, &bodies[..], &*impulses);
        each(options.parallel, &mut scratch.plans, |k, plan| {
            let _mode = FlushDenormals::new();
            let end = view.blocks.get(k + 1).map_or(view.contacts(), |b| b.contact);
            plan.make::<ROLL>(view, rows, start, k, end);
        });
    }
    let mut now = bodies;
    sides(problem, &mut scratch.plans, &mut now, options.parallel, |plan, rows| plan.push::<ROLL>(rows));
    let mut seen = look::<ROLL>(problem, &mut scratch.plans, &before, &mut now, options.parallel);
    let mut best = Seen { residual: f64::INFINITY, objective: f64::INFINITY, worst: 0 };
    let (mut iterations, mut kept) = (0, false);
    loop {
        let converged = seen.residual <= options.tolerance;
        if converged || (seen.residual < best.residual && seen.objective <= best.objective) {
            best = seen;
            // The end is taken from the plans themselves.
            kept = !converged && iterations < options.iterations;
            if kept {
                scratch.best.resize(problem.contacts(), [0.0; 3]);
                scratch.best_couple.resize(impulses.couple.len(), [0.0; 3]);
                scratch.plans.iter().for_each(|p| p.give::<ROLL>(&mut scratch.best, &mut scratch.best_couple));
            }
        }
        if converged || iterations >= options.iterations {
            break;
        }
        loop {
            sides(problem, &mut scratch.plans, &mut now, options.parallel, |plan, rows| {
                plan.change = dispatch(active(), Sweep::<ROLL> { plan, rows });
            });
            iterations += 1;
            let change =
                scratch.plans.iter().fold(0.0_f64, |m, p| if p.change > m || p.change.is_nan() { p.change } else { m });
            if change.sqrt() <= options.tolerance
                || change.is_nan()
                || iterations % LOOK == 0
                || iterations >= options.iterations
            {
                break;
            }
        }
        seen = look::<ROLL>(problem, &mut scratch.plans, &before, &mut now, options.parallel);
    }
    if kept {
        // From the velocities before contact once more, under the impulses kept.
        impulses.force.copy_from_slice(&scratch.best);
        impulses.couple.copy_from_slice(&scratch.best_couple);
        now[..problem.movable].copy_from_slice(&before);
        scratch.plans.iter_mut().for_each(|p| p.take::<ROLL>(impulses));
        sides(problem, &mut scratch.plans, &mut now, options.parallel, |plan, rows| plan.push::<ROLL>(rows));
    } else {
        scratch.plans.iter().for_each(|p| p.give::<ROLL>(&mut impulses.force, &mut impulses.couple));
    }
    problem.bodies = now;
    problem.scratch = scratch;
    Outcome {
        iterations,
        residual: best.residual,
        worst: best.worst,
        objective: best.objective,
        converged: best.residual <= options.tolerance,
    }
}

/// Runs `task` on every plan and the rows that its block reaches: even blocks side by side, then odd ones.
fn sides(
    problem: &Problem,
    plans: &mut [Plan],
    bodies: &mut [Row],
    parallel: bool,
    task: impl Fn(&mut Plan, &mut [Row]) + Sync,
) {
    for side in 0..2 {
        let mut work = Vec::with_capacity(plans.len() / 2 + 1);
        let (mut rest, mut from) = (&mut bodies[..], 0);
        for (plan, block) in plans.iter_mut().zip(&problem.blocks).skip(side).step_by(2) {
            let (_, after) = rest.split_at_mut(block.first - from);
            let (own, after) = after.split_at_mut(block.end - block.first);
            (rest, from) = (after, block.end);
            work.push((plan, own));
        }
        each(parallel, &mut work, |_, (plan, rows)| {
            let _mode = FlushDenormals::new();
            task(plan, rows);
        });
    }
}

/// Residual, worst contact and objective of the impulses as they are.
fn look<const ROLL: bool>(
    problem: &Problem,
    plans: &mut [Plan],
    before: &[Row],
    bodies: &mut [Row],
    parallel: bool,
) -> Seen {
    sides(problem, plans, bodies, parallel, |plan, rows| {
        plan.seen = dispatch(active(), Look::<ROLL> { plan, rows });
    });
    let mut work = vec![0.0; problem.blocks.len()];
    each(parallel, &mut work, |k, sum| {
        let block = &problem.blocks[k];
        for (v, u) in bodies[block.first..block.last].iter().zip(&before[block.first..block.last]) {
            for (at, inverse) in [(0, u[3]), (4, u[7])] {
                if inverse > 0.0 {
                    *sum += (at..at + 3).map(|c| u[c] * (v[c] - u[c])).sum::<f64>() / inverse;
                }
            }
        }
    });
    let mut seen = Seen::default();
    for (plan, w) in plans.iter().zip(&work) {
        seen.objective += 0.5 * (plan.seen.work + w);
        // NaN wins: a solve that blows up must not look converged.
        if plan.seen.residual > seen.residual || plan.seen.residual.is_nan() {
            (seen.residual, seen.worst) = (plan.seen.residual, plan.seen.worst);
        }
    }
    seen
}
