//! Time integration by the method of Hilber, Hughes and Taylor (HHT-alpha), with Newton's method on a kept tangent.
//!
//! `M a' = (1 + alpha) F' - alpha F`, primes at the end of the step, `F` all forces but inertia, with Newmark's formulas at
//! `gamma = (1 - 2 alpha)/2`, `beta = (1 - alpha)^2/4`. alpha = 0 is the trapezoidal rule; down to -1/3 it damps high frequencies.
//!
//! The tangent is the iteration matrix only: it is kept over steps while Newton converges fast with it. Convergence is measured as
//! the largest movement of a material point still to come, in metres: the last correction `c` times `rho/(1 - rho)`, `rho` the
//! contraction seen. `rho` is measured again at least every [`REMEASURE`] steps by a second iteration.

mod tangent;

pub use tangent::KeptTangent;

use crate::ancf::AncfError;
use crate::ancf::assembly::Assembly;
use crate::ancf::external::External;
use crate::ancf::kernel::{Loads, TangentWeights};
use crate::ancf::mesh::{ForceBuffer, NODE, ShellMesh};
use crate::ancf::secant::Secant;
use crate::ancf::statics::correction_norm;
use crate::ancf::team::Team;
use nalgebra::Matrix3;

/// Steps after which the contraction is measured again.
pub const REMEASURE: usize = 16;
/// Iterations beyond which the tangent is renewed before the next step.
const MANY: usize = 5;
/// Contraction below which one iteration may be enough.
const SLOW: f64 = 0.7;
/// Contraction is taken to be no better than this: a stiff mode that the old tangent hardly damps hides behind the many that it does.
const DOUBT: f64 = 0.05;
/// A first correction this much larger than the least since the tangent was renewed has its contraction measured: errors of stiff modes
/// that the old tangent no longer damps grow from step to step.
const GROWN: f64 = 8.0;

/// ... but not below this share of the tolerance, where it does no harm yet.
const SURE: f64 = 0.25;

/// Position, velocity and acceleration of all coordinates, 6 per node, and the force of the last step's end.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ShellState {
    /// Time, s.
    pub time: f64,
    /// Coordinates: position m, director.
    pub q: Vec<f64>,
    /// Their rates, 1/s.
    pub v: Vec<f64>,
    /// Their second derivatives, 1/s2.
    pub a: Vec<f64>,
    /// All forces but inertia and weight at `time`, N and N m.
    pub force: Vec<f64>,
    /// Inertia less weight, `M (a - g)`, at `time`, N and N m.
    pub inertia: Vec<f64>,
    /// Work of all forces but inertia and weight so far, J: trapezoidal over the steps.
    pub work: f64,
}

impl ShellState {
    /// At rest in the given coordinates, with zero acceleration and no force known.
    pub fn at_rest(q: Vec<f64>) -> Self {
        let n = q.len();
        Self { time: 0.0, q, v: vec![0.0; n], a: vec![0.0; n], force: vec![0.0; n], inertia: vec![0.0; n], work: 0.0 }
    }
}

/// How to step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HhtOptions {
    /// Numerical damping, -1/3 to 0.
    pub alpha: f64,
    /// A material point may be off Newton's limit by this much, m.
    pub tolerance: f64,
    /// Iterations before the tangent is renewed, and again before the step fails.
    pub iterations: usize,
    /// Keep the tangent over steps while it converges; otherwise renew it at every iteration.
    pub keep_tangent: bool,
}

impl Default for HhtOptions {
    fn default() -> Self {
        Self { alpha: 0.0, tolerance: 1e-8, iterations: 12, keep_tangent: true }
    }
}

/// What acts on the shells.
#[derive(Clone, Copy)]
pub struct Dynamics<'a> {
    /// The shells.
    pub mesh: &'a ShellMesh,
    /// Damping and pressure.
    pub loads: Loads,
    /// Gravity, m/s2.
    pub gravity: [f64; 3],
    /// Other loads.
    pub external: &'a dyn External,
}

/// Counts of work since the start; tests compare these, never clocks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct HhtCost {
    /// Steps done.
    pub steps: usize,
    /// Newton iterations: force evaluations and solves.
    pub iterations: usize,
    /// Tangents assembled and factorised.
    pub factorisations: usize,
}

/// The integrator: iteration matrix and scratch memory. The state is separate.
#[derive(Debug)]
pub struct Hht {
    /// Options; may be changed between steps.
    pub options: HhtOptions,
    /// Work done.
    pub cost: HhtCost,
    assembly: Assembly,
    step_of_factor: f64,
    /// For each block, the block of the factor whose place it has taken.
    places: Option<Vec<u32>>,
    /// Local axes of the free nodes when the tangent was factorised, and their rotation since.
    axes: Vec<Matrix3<f64>>,
    turns: Vec<Matrix3<f64>>,
    turned: Vec<f64>,
    least: f64,
    first: f64,
    secant: Secant,
    /// Residual and correction of the iteration before, in the factor's axes; empty at the beginning of a step.
    before: Option<(Vec<f64>, Vec<f64>)>,
    kept: KeptTangent,
    rho: f64,
    since_measured: usize,
    buffer: ForceBuffer,
    trial: ShellState,
    relative: Vec<f64>,
    reaction: Vec<f64>,
    free: Vec<f64>,
}

impl Hht {
    /// Takes the constraints' assembly.
    pub fn new(mesh: &ShellMesh, assembly: Assembly, options: HhtOptions) -> Self {
        Self {
            options,
            cost: HhtCost::default(),
            free: vec![0.0; assembly.len()],
            assembly,
            step_of_factor: f64::NAN,
            places: None,
            axes: Vec::new(),
            turns: Vec::new(),
            turned: Vec::new(),
            least: f64::INFINITY,
            first: 0.0,
            secant: Secant::default(),
            before: None,
            kept: KeptTangent::default(),
            rho: 1.0,
            since_measured: 0,
            buffer: ForceBuffer::default(),
            trial: ShellState::at_rest(mesh.reference().to_vec()),
            relative: vec![0.0; NODE * mesh.node_count()],
            reaction: vec![0.0; NODE * mesh.node_count()],
        }
    }

    /// Lets a team do the element work; the bits stay the same.
    pub fn set_team(&mut self, team: &Team) {
        self.buffer = ForceBuffer::with_team(team.clone());
        self.assembly.set_team(team.clone());
    }

    /// The assembly.
    pub fn assembly(&self) -> &Assembly {
        &self.assembly
    }

    /// The assembly, to solve statics with. Forgets the kept tangent.
    pub fn assembly_mut(&mut self) -> &mut Assembly {
        self.forget_tangent();
        &mut self.assembly
    }

    /// Says which block of the factorised system each block has become: a body of revolution that has turned by a division is the same body
    /// with its nodes renamed. `None`: each its own. A renewed tangent resets it.
    pub fn set_places(&mut self, places: Option<Vec<u32>>) {
        self.places = places;
    }

    /// Whether a tangent is kept.
    pub fn has_tangent(&self) -> bool {
        !self.step_of_factor.is_nan()
    }

    /// Forgets the kept tangent, so that what follows depends on the state alone.
    pub fn forget_tangent(&mut self) {
        self.step_of_factor = f64::NAN;
    }

    /// Evaluates forces and inertia at the state (needed once before the first step).
    pub fn evaluate(&mut self, dynamics: &Dynamics<'_>, state: &mut ShellState) {
        relative(&state.a, dynamics.gravity, &mut self.relative);
        dynamics.mesh.forces(
            &dynamics.loads,
            &state.q,
            &state.v,
            &self.relative,
            &mut self.buffer,
            &mut state.force,
            &mut state.inertia,
        );
        dynamics.external.add_force(1.0, state.time, &state.q, &state.v, &mut state.force);
    }

    /// Sets the acceleration of free coordinates to balance the forces at the state: `M a = F + M g`.
    ///
    /// # Errors
    /// [`AncfError::Sparse`].
    pub fn balance_acceleration(&mut self, dynamics: &Dynamics<'_>, state: &mut ShellState) -> Result<(), AncfError> {
        self.evaluate(dynamics, state);
        let weights = TangentWeights { stiffness: 0.0, velocity: 0.0, mass: 1.0, pressure: false, geometric: false };
        self.assembly.factor(dynamics.mesh, &dynamics.loads, &state.q, &weights, &[])?;
        self.forget_tangent();
        for (i, f) in self.relative.iter_mut().enumerate() {
            *f = state.force[i] - state.inertia[i];
        }
        self.assembly.restrict(&self.relative, &mut self.free);
        self.assembly.solve(&mut self.free);
        self.assembly.add_to(&mut state.a, 1.0, &self.free);
        self.evaluate(dynamics, state);
        Ok(())
    }

    /// The state before the last successful step.
    pub fn previous(&self) -> &ShellState {
        &self.trial
    }

    /// The force that constraints exerted over the last step, `M (a - g) - (1 + alpha) F' + alpha F`, all coordinates, N and N m: zero on
    /// free nodes within the tolerance.
    pub fn reaction(&self) -> &[f64] {
        &self.reaction
    }

    /// One step of `h` seconds. `prescribe` writes the coordinates, rates and second derivatives of the constrained nodes at the end of
    /// the step. On failure the state is as before the step.
    ///
    /// # Errors
    /// [`AncfError::Newton`] if it does not converge with a fresh tangent, [`AncfError::Sparse`].
    pub fn step(
        &mut self,
        dynamics: &Dynamics<'_>,
        state: &mut ShellState,
        h: f64,
        prescribe: impl Fn(&mut [f64], &mut [f64], &mut [f64]),
    ) -> Result<(), AncfError> {
        let alpha = self.options.alpha;
        let (gamma, beta) = (0.5 * (1.0 - 2.0 * alpha), 0.25 * (1.0 - alpha) * (1.0 - alpha));
        let end = state.time + h;
        let mut last = f64::INFINITY;
        // First with the kept tangent, then with a fresh one, then with one renewed at every iteration.
        for attempt in 0..3 {
            let full = attempt == 2;
            if !full && !self.options.keep_tangent {
                continue;
            }
            self.predict(state, h, gamma, beta);
            self.before = None;
            self.trial.time = end;
            let ShellState { q, v, a, .. } = &mut self.trial;
            prescribe(q, v, a);
            if !full && self.step_of_factor == h {
                self.follow(dynamics.mesh);
            }
            for iteration in 1..=self.options.iterations {
                if full || self.step_of_factor != h {
                    self.renew(dynamics, h, gamma, beta)?;
                }
                let previous = last;
                last = self.iterate(dynamics, state, h, gamma, beta);
                if !last.is_finite() {
                    break;
                }
                if iteration == 1 {
                    self.first = last;
                } else if !full {
                    self.rho = last / previous;
                    self.since_measured = 0;
                }
                if self.converged(full, iteration, last) {
                    self.accept(state);
                    self.least = self.least.min(self.first);
                    if iteration > MANY || self.secant.is_full() {
                        self.forget_tangent();
                    }
                    return Ok(());
                }
                let left = (self.options.iterations - iteration) as i32;
                if iteration > 4 && !full && last * self.rho.powi(left) > self.options.tolerance {
                    break;
                }
            }
            self.forget_tangent();
        }
        Err(AncfError::Newton {
            time: end,
            iterations: self.options.iterations,
            correction: last,
            tolerance: self.options.tolerance,
            step: h,
        })
    }

    fn converged(&self, full: bool, iteration: usize, last: f64) -> bool {
        let tolerance = self.options.tolerance;
        if full {
            return last <= tolerance;
        }
        // Far below the tolerance, corrections are round-off and say nothing about contraction.
        let grown = last > (GROWN * self.least).max(SURE * tolerance);
        let measured = iteration > 1 || (self.rho < SLOW && self.since_measured < REMEASURE && !grown);
        let rho = self.rho.max(DOUBT);
        last <= 1e-3 * tolerance || (measured && rho < 1.0 && last * rho / (1.0 - rho) <= tolerance)
    }

    fn predict(&mut self, state: &ShellState, h: f64, gamma: f64, beta: f64) {
        // Constant acceleration: exact for the rigid part of the motion to second order.
        let (p, w) = (h * h * (0.5 - beta) + h * h * beta, h * (1.0 - gamma) + h * gamma);
        for i in 0..state.q.len() {
            self.trial.q[i] = state.q[i] + h * state.v[i] + p * state.a[i];
            self.trial.v[i] = state.v[i] + w * state.a[i];
            self.trial.a[i] = state.a[i];
        }
    }

    /// One correction of the trial state; returns its size, m.
    fn iterate(&mut self, dynamics: &Dynamics<'_>, state: &ShellState, h: f64, gamma: f64, beta: f64) -> f64 {
        let alpha = self.options.alpha;
        let mut trial = std::mem::replace(&mut self.trial, ShellState::at_rest(Vec::new()));
        self.evaluate(dynamics, &mut trial);
        for i in 0..trial.q.len() {
            self.reaction[i] = trial.inertia[i] - (1.0 + alpha) * trial.force[i] + alpha * state.force[i];
        }
        self.assembly.restrict(&self.reaction, &mut self.free);
        self.free.iter_mut().for_each(|x| *x = -*x);
        self.solve_in_frame();
        self.assembly.add_to(&mut trial.q, 1.0, &self.free);
        self.assembly.add_to(&mut trial.v, gamma / (beta * h), &self.free);
        self.assembly.add_to(&mut trial.a, 1.0 / (beta * h * h), &self.free);
        self.trial = trial;
        self.cost.iterations += 1;
        correction_norm(dynamics.mesh, &self.assembly, &self.free)
    }

    /// Takes the trial state over. Its force is that before the last correction, which is below the tolerance.
    fn accept(&mut self, state: &mut ShellState) {
        let mut sums = [0.0; 8];
        for i in 0..state.q.len() {
            sums[i % 8] += (state.force[i] + self.trial.force[i]) * (self.trial.q[i] - state.q[i]);
        }
        self.trial.work = state.work + 0.5 * sums.iter().sum::<f64>();
        std::mem::swap(state, &mut self.trial);
        self.cost.steps += 1;
        self.since_measured += 1;
    }
}

/// `a - g` on positions.
fn relative(a: &[f64], gravity: [f64; 3], out: &mut [f64]) {
    for (i, (out, a)) in out.iter_mut().zip(a).enumerate() {
        *out = if i % NODE < 3 { a - gravity[i % NODE] } else { *a };
    }
}
