//! Spectral projected gradient (Birgin, Martinez, Raydan 2000): Barzilai and Borwein's step length, and a line search that lets the objective
//! rise within the last few values.

use super::parts::{Best, Parts, Sums, add_load};
use super::sweep::{Slip, contact};
use super::{Options, Outcome, Problem};

/// Iterations between two looks at residual and objective.
const LOOK: u32 = 10;
/// Values of the objective that a new one may not exceed.
const REMEMBERED: usize = 10;

pub fn solve<const ROLL: bool>(problem: &Problem, parts: &mut Parts, options: &Options) -> Outcome {
    let mut best = Best::new();
    let mut t = 0.25;
    let mut iterations = 0;
    let mut converged = best.look::<ROLL>(parts, problem, options.tolerance);
    // Objective by increments: exact but for round-off, since it is quadratic.
    let mut value = best.objective();
    let mut recent = vec![value];
    while !converged && iterations < options.iterations {
        let sums = project_step::<ROLL>(problem, parts, t);
        let curvature = try_velocities(parts) + sums.work;
        let mut lambda = 1.0;
        let ceiling = recent.iter().fold(f64::NEG_INFINITY, |m, &x| m.max(x));
        if value + sums.along + 0.5 * curvature > ceiling + 1e-4 * sums.along && curvature > 0.0 {
            // Exact along the way there, and short of its end.
            lambda = (-sums.along / curvature).clamp(1e-4, 1.0);
        }
        value += lambda * sums.along + 0.5 * lambda * lambda * curvature;
        recent.push(value);
        if recent.len() > REMEMBERED {
            recent.remove(0);
        }
        move_on::<ROLL>(parts, lambda);
        iterations += 1;
        // s's / s'Ns in the metric of the diagonal.
        t = if curvature > 0.0 { (sums.length / curvature).clamp(1e-3, 1e3) } else { 1.0 };
        if sums.residual <= options.tolerance || iterations.is_multiple_of(LOOK) || iterations == options.iterations {
            converged = best.look::<ROLL>(parts, problem, options.tolerance);
        }
    }
    best.end(parts, iterations, converged)
}

fn project_step<const ROLL: bool>(problem: &Problem, parts: &mut Parts, t: f64) -> Sums {
    let now = std::mem::take(&mut parts.now);
    parts.each(|_, part| {
        part.load.clear();
        part.load.resize(part.block.end - part.block.first, [0.0; 8]);
        let mut sums = Sums::default();
        for c in 0..part.contacts.len() {
            let k = part.contacts.start + c;
            let (force, couple) = (part.now.force[c], if ROLL { part.now.couple[c] } else { [0.0; 3] });
            let slip = contact::<ROLL>(problem, &now, k).with_compliance(problem, k, force, couple);
            let to = slip.step::<ROLL>(problem, k, t, force, couple);
            let d = std::array::from_fn(|i| to.force[i] - force[i]);
            let dq = std::array::from_fn(|i| to.couple[i] - couple[i]);
            sums.length += slip.length2::<ROLL>(d, dq);
            sums.along += slip.work::<ROLL>(d, dq);
            if let Some(&compliance) = problem.compliance.get(k) {
                sums.work += compliance * d.iter().map(|x| x * x).sum::<f64>();
            }
            if let Some(&compliance) = problem.couple_compliance.get(k) {
                sums.work += compliance * dq.iter().map(|x| x * x).sum::<f64>();
            }
            let residual = slip.speed::<ROLL>(d, dq) / t;
            if residual > sums.residual || residual.is_nan() {
                (sums.residual, sums.worst) = (residual, k);
            }
            part.next.force[c] = to.force;
            if ROLL {
                part.next.couple[c] = to.couple;
            }
            Slip::load::<ROLL>(problem, k, part.block, d, dq, &mut part.load);
        }
        part.sums = sums;
    });
    parts.now = now;
    parts.sums()
}

/// Velocities at the whole step, into `next`; returns d'Nd of the bodies.
fn try_velocities(parts: &mut Parts) -> f64 {
    let mut next = std::mem::take(&mut parts.next);
    next.clone_from(&parts.now);
    parts.bodies(&mut next, |load, body| add_load(body, load));
    let mut sum = 0.0;
    for (to, now) in next.iter().zip(&parts.now) {
        // What cannot move or turn has not.
        for (at, inverse) in [(0, to[3]), (4, to[7])].into_iter().filter(|(_, inverse)| *inverse > 0.0) {
            sum += (at..at + 3).map(|c| (to[c] - now[c]).powi(2)).sum::<f64>() / inverse;
        }
    }
    parts.next = next;
    sum
}

/// Goes `lambda` of the way.
fn move_on<const ROLL: bool>(parts: &mut Parts, lambda: f64) {
    let mix = |to: &mut [f64; 3], from: &[f64; 3]| {
        for c in 0..3 {
            to[c] = from[c] + lambda * (to[c] - from[c]);
        }
    };
    parts.each(|_, part| {
        if lambda < 1.0 {
            for c in 0..part.contacts.len() {
                mix(&mut part.next.force[c], &part.now.force[c]);
                if ROLL {
                    mix(&mut part.next.couple[c], &part.now.couple[c]);
                }
            }
        }
        std::mem::swap(&mut part.now, &mut part.next);
    });
    if lambda < 1.0 {
        for (to, from) in parts.next.iter_mut().zip(&parts.now) {
            for c in 0..8 {
                to[c] = from[c] + lambda * (to[c] - from[c]);
            }
        }
    }
    std::mem::swap(&mut parts.now, &mut parts.next);
}
