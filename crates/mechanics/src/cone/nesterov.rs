//! Accelerated projected gradient descent (Nesterov) with backtracking on the Lipschitz constant and adaptive restart.

use super::parts::{Best, Parts, Sums, add_load, each};
use super::sweep::{Slip, contact};
use super::{Memory, Options, Outcome, Problem, Row};

/// Iterations between two looks at the residual of the iterate itself (every step looks at that of its point of departure).
const LOOK: u32 = 10;
/// Largest Lipschitz constant tried: a ball has at most a few dozen contacts.
const STEEPEST: f64 = 4096.0;
/// Smallest.
const FLATTEST: f64 = 0.25;

pub fn solve<const ROLL: bool>(
    problem: &Problem,
    parts: &mut Parts,
    memory: &mut Memory,
    options: &Options,
) -> Outcome {
    let mut best = Best::new();
    let mut lipschitz = memory.lipschitz.clamp(FLATTEST, STEEPEST);
    // Momentum of the present point of departure, and theta that it came from.
    let (mut beta, mut theta) = (0.0, 1.0_f64);
    let mut iterations = 0;
    let mut converged = best.look::<ROLL>(parts, problem, options.tolerance);
    while !converged && iterations < options.iterations {
        descend::<ROLL>(problem, parts, 1.0 / lipschitz, beta);
        let sums = parts.sums();
        let next_theta = 0.5 * theta * ((theta * theta + 4.0).sqrt() - theta);
        // A step uphill: the momentum is spent.
        let restart = sums.along > 0.0;
        let next_beta = if restart { 0.0 } else { theta * (1.0 - theta) / (theta * theta + next_theta) };
        let curvature = advance(parts, next_beta);
        if curvature > lipschitz * sums.length * (1.0 + 1e-9) && lipschitz < STEEPEST {
            lipschitz *= 2.0;
            continue;
        }
        iterations += 1;
        accept(parts);
        (beta, theta) = (next_beta, if restart { 1.0 } else { next_theta });
        lipschitz = (0.9 * lipschitz).max(FLATTEST);
        // What the step saw is near enough to tell when a look may be worth it.
        if sums.residual <= options.tolerance || iterations.is_multiple_of(LOOK) || iterations == options.iterations {
            converged = best.look::<ROLL>(parts, problem, options.tolerance);
        }
    }
    memory.lipschitz = lipschitz;
    best.end(parts, iterations, converged)
}

/// The projected step from y = now + beta (now - before), at whose velocities `at` are, and its loads on the bodies.
fn descend<const ROLL: bool>(problem: &Problem, parts: &mut Parts, t: f64, beta: f64) {
    let at = std::mem::take(&mut parts.at);
    parts.each(|_, part| {
        part.load.clear();
        part.load.resize(part.block.end - part.block.first, [0.0; 8]);
        let mut sums = Sums::default();
        for c in 0..part.contacts.len() {
            let k = part.contacts.start + c;
            let (now, before) = (part.now.force[c], part.before.force[c]);
            let y = std::array::from_fn(|i| now[i] + beta * (now[i] - before[i]));
            let (mut q_now, mut q) = ([0.0; 3], [0.0; 3]);
            if ROLL {
                let before = part.before.couple[c];
                q_now = part.now.couple[c];
                q = std::array::from_fn(|i| q_now[i] + beta * (q_now[i] - before[i]));
            }
            let slip = contact::<ROLL>(problem, &at, k).with_compliance(problem, k, y, q);
            let to = slip.step::<ROLL>(problem, k, t, y, q);
            let minus = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| a[i] - b[i]) };
            let (d, dq) = (minus(to.force, y), minus(to.couple, q));
            let (e, eq) = (minus(to.force, now), minus(to.couple, q_now));
            sums.length += slip.length2::<ROLL>(d, dq);
            sums.along += slip.work::<ROLL>(e, eq);
            if let Some(&compliance) = problem.compliance.get(k) {
                // What E adds to the curvature along d: the bodies do not know of it.
                sums.work += compliance * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
            }
            if let Some(&compliance) = problem.couple_compliance.get(k) {
                sums.work += compliance * (dq[0] * dq[0] + dq[1] * dq[1] + dq[2] * dq[2]);
            }
            let residual = slip.speed::<ROLL>(d, dq) / t;
            if residual > sums.residual || residual.is_nan() {
                (sums.residual, sums.worst) = (residual, k);
            }
            part.next.force[c] = to.force;
            if ROLL {
                part.next.couple[c] = to.couple;
            }
            Slip::load::<ROLL>(problem, k, part.block, e, eq, &mut part.load);
        }
        part.sums = sums;
    });
    parts.at = at;
}

/// x / y, 0 for what cannot move.
#[inline(always)]
fn over(x: f64, y: f64) -> f64 {
    if y > 0.0 { x / y } else { 0.0 }
}

/// Velocities of the next iterate and of the point of departure after it; returns d'Nd of the step from `at`.
fn advance(parts: &mut Parts, beta: f64) -> f64 {
    let (mut next, mut next_at) = (std::mem::take(&mut parts.next), std::mem::take(&mut parts.next_at));
    let mut work = Vec::with_capacity(parts.parts.len());
    let (mut rest, mut rest_at) = (&mut next[..], &mut next_at[..]);
    for part in &parts.parts {
        let count = part.block.last - part.block.first;
        let (own, after) = rest.split_at_mut(count);
        let (own_at, after_at) = rest_at.split_at_mut(count);
        work.push((own, own_at, 0.0));
        (rest, rest_at) = (after, after_at);
    }
    let view = &*parts;
    each(parts.parallel(), &mut work, |k, (own, own_at, sum)| {
        let (halo, first) = (view.halo(k), view.parts[k].block.first);
        for i in 0..own.len() {
            let (now, at): (&Row, &Row) = (&view.now[first + i], &view.at[first + i]);
            let mut to = *now;
            add_load(&mut to, &view.load(k, i, halo));
            let mut square = [0.0; 2];
            for c in 0..3 {
                let (dv, ds) = (to[c] - at[c], to[4 + c] - at[4 + c]);
                square[0] += dv * dv;
                square[1] += ds * ds;
            }
            *sum += over(square[0], to[3]) + over(square[1], to[7]);
            own[i] = to;
            for c in 0..8 {
                own_at[i][c] = to[c] + beta * (to[c] - now[c]);
            }
        }
    });
    let of_bodies: f64 = work.iter().map(|w| w.2).sum();
    let curvature = of_bodies + parts.parts.iter().map(|p| p.sums.work).sum::<f64>();
    (parts.next, parts.next_at) = (next, next_at);
    curvature
}

/// The next iterate becomes the present one.
fn accept(parts: &mut Parts) {
    for part in &mut parts.parts {
        std::mem::swap(&mut part.before, &mut part.now);
        std::mem::swap(&mut part.now, &mut part.next);
    }
    std::mem::swap(&mut parts.before, &mut parts.now);
    std::mem::swap(&mut parts.now, &mut parts.next);
    std::mem::swap(&mut parts.at, &mut parts.next_at);
}
