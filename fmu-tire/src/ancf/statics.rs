//! Equilibrium by Newton's method under growing load.
//!
//! The load factor grows from 0 to 1 in increments; an increment that does not converge is halved, one that converges easily is
//! followed by a larger one. No inertia, no damping.

use super::AncfError;
use super::assembly::Assembly;
use super::external::External;
use super::kernel::{Loads, TangentWeights};
use super::mesh::{ForceBuffer, NODE, ShellMesh};

/// What is in equilibrium.
#[derive(Clone, Copy)]
pub struct StaticProblem<'a> {
    /// The shells.
    pub mesh: &'a ShellMesh,
    /// Pressure at full load, Pa.
    pub pressure: f64,
    /// Gravity at full load, m/s2.
    pub gravity: [f64; 3],
    /// Whether pressure and gravity act in full from the start, so that only `external` grows.
    pub body_loads_in_full: bool,
    /// Other loads; given the load factor as scale.
    pub external: &'a dyn External,
}

impl StaticProblem<'_> {
    fn body_factor(&self, factor: f64) -> f64 {
        if self.body_loads_in_full { 1.0 } else { factor }
    }
}

/// How to search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StaticOptions {
    /// First increment of the load factor.
    pub first: f64,
    /// Largest increment.
    pub largest: f64,
    /// Below this increment the search stops.
    pub least: f64,
    /// Converged when no material point moves by more in a correction, m.
    pub tolerance: f64,
    /// Iterations per increment.
    pub iterations: usize,
}

impl Default for StaticOptions {
    fn default() -> Self {
        Self { first: 0.05, largest: 0.1, least: 1e-5, tolerance: 1e-9, iterations: 25 }
    }
}

/// What a search cost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StaticCost {
    /// Increments done.
    pub increments: usize,
    /// Newton iterations, failed attempts included.
    pub iterations: usize,
}

/// Finds equilibrium at each load factor of `stops` (ascending) in turn, starting from `q` at load factor `from`, and calls `at` there.
/// `q` holds the last state found.
///
/// # Errors
/// [`AncfError::Newton`] when the increment falls below the least (time = load factor); [`AncfError::Sparse`].
pub fn solve(
    problem: &StaticProblem<'_>,
    assembly: &mut Assembly,
    q: &mut [f64],
    from: f64,
    stops: &[f64],
    options: &StaticOptions,
    mut at: impl FnMut(f64, &[f64]),
) -> Result<StaticCost, AncfError> {
    let mut work = Work::new(problem.mesh, assembly);
    let mut cost = StaticCost::default();
    let (mut factor, mut increment) = (from, options.first);
    for &stop in stops {
        while factor < stop {
            let next = if factor + increment * 1.000_001 > stop { stop } else { factor + increment };
            work.saved.copy_from_slice(q);
            let (iterations, correction) = newton(problem, assembly, q, next, options, &mut work)?;
            cost.iterations += iterations;
            if correction <= options.tolerance {
                factor = next;
                cost.increments += 1;
                if iterations * 3 < options.iterations {
                    increment = (increment * 1.5).min(options.largest);
                }
            } else {
                q.copy_from_slice(&work.saved);
                increment = 0.5 * (next - factor).min(increment);
                if increment < options.least {
                    return Err(AncfError::Newton {
                        time: next,
                        iterations,
                        correction,
                        tolerance: options.tolerance,
                        step: increment,
                    });
                }
            }
        }
        at(factor, q);
    }
    Ok(cost)
}

struct Work {
    saved: Vec<f64>,
    zero: Vec<f64>,
    acceleration: Vec<f64>,
    force: Vec<f64>,
    inertia: Vec<f64>,
    free: Vec<f64>,
    buffer: ForceBuffer,
}

impl Work {
    fn new(mesh: &ShellMesh, assembly: &Assembly) -> Self {
        let n = NODE * mesh.node_count();
        Self {
            saved: vec![0.0; n],
            zero: vec![0.0; n],
            acceleration: vec![0.0; n],
            force: vec![0.0; n],
            inertia: vec![0.0; n],
            free: vec![0.0; assembly.len()],
            buffer: ForceBuffer::default(),
        }
    }
}

/// Forces at a load factor: into `work.force` (all) and `work.free`.
fn residual(problem: &StaticProblem<'_>, assembly: &Assembly, q: &[f64], factor: f64, work: &mut Work) {
    let body = problem.body_factor(factor);
    for (i, a) in work.acceleration.iter_mut().enumerate() {
        *a = if i % NODE < 3 { -body * problem.gravity[i % NODE] } else { 0.0 };
    }
    let loads = Loads { damping: 0.0, pressure: body * problem.pressure };
    let Work { zero, acceleration, buffer, force, inertia, .. } = work;
    problem.mesh.forces(&loads, q, zero, acceleration, buffer, force, inertia);
    work.force.iter_mut().zip(&work.inertia).for_each(|(f, m)| *f -= m);
    problem.external.add_force(factor, 0.0, q, &work.zero, &mut work.force);
    assembly.restrict(&work.force, &mut work.free);
}

/// Iterations done and the last correction, m; infinite if it diverged.
fn newton(
    problem: &StaticProblem<'_>,
    assembly: &mut Assembly,
    q: &mut [f64],
    factor: f64,
    options: &StaticOptions,
    work: &mut Work,
) -> Result<(usize, f64), AncfError> {
    let loads = Loads { damping: 0.0, pressure: problem.body_factor(factor) * problem.pressure };
    let weights = TangentWeights { stiffness: 1.0, velocity: 0.0, mass: 0.0, pressure: true, geometric: true };
    let mut correction = f64::INFINITY;
    let mut blocks = Vec::new();
    for iteration in 1..=options.iterations {
        residual(problem, assembly, q, factor, work);
        blocks.clear();
        problem.external.add_tangent(factor, 1.0, 0.0, q, &work.zero, &mut blocks);
        assembly.factor(problem.mesh, &loads, q, &weights, &blocks)?;
        assembly.solve(&mut work.free);
        correction = correction_norm(problem.mesh, assembly, &work.free);
        if !correction.is_finite() {
            return Ok((iteration, f64::INFINITY));
        }
        assembly.add_to(q, 1.0, &work.free);
        if correction <= options.tolerance {
            return Ok((iteration, correction));
        }
    }
    Ok((options.iterations, correction))
}

/// Largest movement of a material point in a correction over the free coordinates, m: of mid-surface or face.
pub fn correction_norm(mesh: &ShellMesh, assembly: &Assembly, free: &[f64]) -> f64 {
    let half = mesh.kinds().iter().fold(0.0f64, |m, k| m.max(k.half));
    let mut worst = 0.0f64;
    for block in 0..assembly.free_nodes().len() {
        let c = &free[NODE * block..NODE * block + NODE];
        let position = (c[0] * c[0] + c[1] * c[1] + c[2] * c[2]).sqrt();
        let director = half * (c[3] * c[3] + c[4] * c[4] + c[5] * c[5]).sqrt();
        let point = position.max(director);
        // A NaN must not hide behind max().
        if !point.is_finite() {
            return f64::INFINITY;
        }
        worst = worst.max(point);
    }
    worst
}
