//! Projected Gauss-Seidel, contact by contact in colours: contacts of a colour share no movable body, so that the result does not
//! depend on who works on them. One contact after the other here: it is the reference, not the fast way.

use super::parts::{Best, Parts, Set};
use super::sweep::{Slip, contact};
use super::{Options, Outcome, Problem, Row};

/// Iterations between two looks at residual and objective.
const LOOK: u32 = 5;

pub fn solve<const ROLL: bool>(problem: &Problem, parts: &mut Parts, options: &Options) -> Outcome {
    let order = colours(problem);
    let mut best = Best::new();
    let mut converged = best.look::<ROLL>(parts, problem, options.tolerance);
    let mut set = gather(parts);
    let mut iterations = 0;
    while !converged && iterations < options.iterations {
        for &k in &order {
            let k = k as usize;
            let (force, couple) = (set.force[k], if ROLL { set.couple[k] } else { [0.0; 3] });
            let slip = contact::<ROLL>(problem, &parts.now, k).with_compliance(problem, k, force, couple);
            let to = slip.step::<ROLL>(problem, k, 1.0, force, couple);
            let d = std::array::from_fn(|i| to.force[i] - force[i]);
            let dq = std::array::from_fn(|i| to.couple[i] - couple[i]);
            set.force[k] = to.force;
            if ROLL {
                set.couple[k] = to.couple;
            }
            push::<ROLL>(problem, k, d, dq, &mut parts.now);
        }
        iterations += 1;
        if iterations.is_multiple_of(LOOK) || iterations == options.iterations {
            scatter(&set, parts);
            converged = best.look::<ROLL>(parts, problem, options.tolerance);
        }
    }
    best.end(parts, iterations, converged)
}

/// Changes the velocities of the two bodies of contact `k`.
fn push<const ROLL: bool>(problem: &Problem, k: usize, force: [f64; 3], couple: [f64; 3], v: &mut [Row]) {
    let (a, b) = (problem.a[k] as usize, problem.b[k] as usize);
    let mut pair = [[0.0; 8]; 2];
    Slip::load_pair::<ROLL>(problem, k, force, couple, &mut pair);
    super::parts::add_load(&mut v[a], &pair[0]);
    super::parts::add_load(&mut v[b], &pair[1]);
}

/// Contacts, colour by colour; the least free colour first, in the order of contacts.
fn colours(problem: &Problem) -> Vec<u32> {
    // Colours taken at each body, as bits; a contact that finds all 64 taken goes last, on its own.
    let mut taken = vec![0_u64; problem.bodies.len()];
    let mut colour = vec![64_u32; problem.contacts()];
    for k in 0..problem.contacts() {
        let (a, b) = (problem.a[k] as usize, problem.b[k] as usize);
        let used = taken[a] | if b < problem.movable { taken[b] } else { 0 };
        let free = (!used).trailing_zeros();
        if free < 64 {
            colour[k] = free;
            taken[a] |= 1 << free;
            taken[b] |= 1 << free;
        }
    }
    let mut order: Vec<u32> = (0..problem.contacts() as u32).collect();
    order.sort_by_key(|&k| colour[k as usize]);
    order
}

fn gather(parts: &Parts) -> Set {
    let mut set = Set::default();
    for part in &parts.parts {
        set.force.extend(&part.now.force);
        set.couple.extend(&part.now.couple);
    }
    set
}

fn scatter(set: &Set, parts: &mut Parts) {
    for part in &mut parts.parts {
        part.now.force.copy_from_slice(&set.force[part.contacts.clone()]);
        if !part.now.couple.is_empty() {
            part.now.couple.copy_from_slice(&set.couple[part.contacts.clone()]);
        }
    }
}
