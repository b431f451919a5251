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
    /// Steps of [descent](solve) tried when Newton fails; 0: neither search nor descent.
    pub descent: usize,
}

impl Default for StaticOptions {
    fn default() -> Self {
        Self { first: 0.05, largest: 0.1, least: 1e-5, tolerance: 1e-9, iterations: 25, descent: 0 }
    }
}

/// What a search cost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StaticCost {
    /// Increments done.
    pub increments: usize,
    /// Newton iterations, failed attempts included.
    pub iterations: usize,
    /// Steps of descent.
    pub descent: usize,
}

/// Where Newton fails, it is tried again with a search along each correction; then (a fold, a sidewall that snaps) the state may move on as if in a thick liquid, `(M/h^2 + K) dq = F` with h growing as it
/// comes to rest: an implicit descent that ends in a stable equilibrium, which Newton then finishes; then as if the
/// rubber were thick.
///
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
            let (mut iterations, mut correction) = newton(problem, assembly, q, next, options, &mut work, false)?;
            cost.iterations += iterations;
            if correction > options.tolerance && options.descent > 0 {
                q.copy_from_slice(&work.saved);
                (iterations, correction) = newton(problem, assembly, q, next, options, &mut work, true)?;
                cost.iterations += iterations;
            }
            if correction <= options.tolerance {
                factor = next;
                cost.increments += 1;
                if iterations * 3 < options.iterations {
                    increment = (increment * 1.5).min(options.largest);
                }
            } else if relax(problem, assembly, q, next, options, &mut work, &mut cost, Drag::Mass)?
                || relax(problem, assembly, q, next, options, &mut work, &mut cost, Drag::Stiffness)?
            {
                factor = next;
                cost.increments += 1;
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

/// Shortest and longest time step of the descent, s.
const DESCENT: (f64, f64) = (1e-5, 1.0);
/// A step of the descent moves no point further, m.
const FURTHEST: f64 = 4e-3;

/// What holds a descent back.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Drag {
    /// `M/h^2`, as if in a thick liquid.
    Mass,
    /// The material stiffness times `SCALE/h`, as if the rubber itself were thick: the way out of a fold in which stiff plies turn, where mass
    /// lets the soft waves run ahead.
    Stiffness,
}

/// Share of the material stiffness at h = 1 s.
const SCALE: f64 = 1e-2;

/// Descends to equilibrium at a load factor, from the last good state; false if it does not get there.
fn relax(
    problem: &StaticProblem<'_>,
    assembly: &mut Assembly,
    q: &mut [f64],
    factor: f64,
    options: &StaticOptions,
    work: &mut Work,
    cost: &mut StaticCost,
    drag: Drag,
) -> Result<bool, AncfError> {
    q.copy_from_slice(&work.saved);
    // A damping of 1 s, so that the weight of the velocity is a share of the stiffness.
    let loads = Loads { damping: 1.0, pressure: problem.body_factor(factor) * problem.pressure };
    let mut h = 1e-3;
    let mut blocks = Vec::new();
    for _ in 0..options.descent {
        cost.descent += 1;
        let (mass, velocity) = match drag {
            Drag::Mass => (1.0 / (h * h), 0.0),
            Drag::Stiffness => (0.0, SCALE / h),
        };
        let weights = TangentWeights { stiffness: 1.0, velocity, mass, pressure: true, geometric: true };
        residual(problem, assembly, q, factor, work);
        work.residual.copy_from_slice(&work.free);
        blocks.clear();
        problem.external.add_tangent(factor, 1.0, 0.0, q, &work.zero, &mut blocks);
        assembly.factor(problem.mesh, &loads, q, &weights, &blocks)?;
        assembly.solve(&mut work.free);
        let correction = correction_norm(problem.mesh, assembly, &work.free);
        // Uphill, or further than the tangent can be trusted: a shorter step.
        if correction.is_nan() || correction > FURTHEST || assembly.solver().negative_pivots() > 0 {
            h *= 0.3;
            if h < DESCENT.0 {
                return Ok(false);
            }
            continue;
        }
        let taken = match drag {
            Drag::Mass => {
                assembly.add_to(q, 1.0, &work.free);
                1.0
            }
            Drag::Stiffness => search(problem, assembly, q, factor, work),
        };
        if h >= 1e-2 && correction < 1e-5 {
            let here = q.to_vec();
            let (iterations, correction) = newton(problem, assembly, q, factor, options, work, true)?;
            cost.iterations += iterations;
            if correction <= options.tolerance {
                return Ok(true);
            }
            q.copy_from_slice(&here);
        }
        if taken < 0.3 {
            h = (h * 0.5).max(DESCENT.0);
        } else if correction < 0.25 * FURTHEST {
            h = (h * 2.0).min(DESCENT.1);
        }
    }
    Ok(false)
}

struct Work {
    saved: Vec<f64>,
    zero: Vec<f64>,
    acceleration: Vec<f64>,
    force: Vec<f64>,
    inertia: Vec<f64>,
    free: Vec<f64>,
    residual: Vec<f64>,
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
            residual: vec![0.0; assembly.len()],
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

/// Iterations done and the last correction, m; infinite if it diverged. `careful`: with a search along each correction.
fn newton(
    problem: &StaticProblem<'_>,
    assembly: &mut Assembly,
    q: &mut [f64],
    factor: f64,
    options: &StaticOptions,
    work: &mut Work,
    careful: bool,
) -> Result<(usize, f64), AncfError> {
    let loads = Loads { damping: 0.0, pressure: problem.body_factor(factor) * problem.pressure };
    let weights = TangentWeights { stiffness: 1.0, velocity: 0.0, mass: 0.0, pressure: true, geometric: true };
    let mut correction = f64::INFINITY;
    let mut blocks = Vec::new();
    for iteration in 1..=options.iterations {
        residual(problem, assembly, q, factor, work);
        work.residual.copy_from_slice(&work.free);
        blocks.clear();
        problem.external.add_tangent(factor, 1.0, 0.0, q, &work.zero, &mut blocks);
        assembly.factor(problem.mesh, &loads, q, &weights, &blocks)?;
        assembly.solve(&mut work.free);
        correction = correction_norm(problem.mesh, assembly, &work.free);
        if !correction.is_finite() {
            return Ok((iteration, f64::INFINITY));
        }
        if careful {
            search(problem, assembly, q, factor, work);
        } else {
            assembly.add_to(q, 1.0, &work.free);
        }
        if correction <= options.tolerance {
            return Ok((iteration, correction));
        }
    }
    Ok((options.iterations, correction))
}

/// Moves along the correction in `work.free` to where the force along it has fallen to half, or by the whole of it: nodes that touch and leave
/// the ground from one iteration to the next would keep Newton swinging. `work.residual` holds the forces at `q`. Returns the share taken.
fn search(problem: &StaticProblem<'_>, assembly: &Assembly, q: &mut [f64], factor: f64, work: &mut Work) -> f64 {
    const TRIES: usize = 5;
    let direction = work.free.clone();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let start = dot(&direction, &work.residual);
    let mut taken = 1.0;
    assembly.add_to(q, 1.0, &direction);
    // A direction against the force comes of an indefinite tangent: nothing to search for.
    if start > 0.0 {
        let (mut low, mut at_low, mut high) = (0.0, start, f64::INFINITY);
        for _ in 0..TRIES {
            residual(problem, assembly, q, factor, work);
            let slope = dot(&direction, &work.free);
            if slope >= -0.5 * start && (slope <= 0.5 * start || taken >= 1.0) {
                break;
            }
            if slope < 0.0 || slope.is_nan() {
                high = taken;
            } else {
                (low, at_low) = (taken, slope);
            }
            let guess = low + (high - low) * if slope < 0.0 { at_low / (at_low - slope) } else { 0.5 };
            let next = if guess.is_finite() { guess.clamp(low + 0.1 * (high - low), high) } else { 0.5 * (low + high) };
            assembly.add_to(q, next - taken, &direction);
            taken = next;
        }
    }
    taken
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
