//! Contact with Coulomb friction as a cone-complementarity problem, and its solvers.
//!
//! **Problem.** Bodies are balls with velocity v and spin s = r omega (surface speed, so that both are m/s); each contact has a unit
//! normal n, towards body a, and an unknown impulse g on a (N s), -g on b, as a vector in the inertial frame: no tangents are chosen. Its
//! slip is u = v_a - v_b + n x (s_a + s_b) + b n, b the stabilisation (m/s). With M the masses, D the contacts' directions:
//!
//! minimise 1/2 g'Ng - g'r over |g_t| <= mu (g_n + c), N = D'M^-1 D + E, so that u = N g - r.
//!
//! This is the convex relaxation of Anitescu and Tasora (2010): at its solution u_n - mu |u_t| >= 0, which opens a sliding contact by
//! mu |u_t| h. c is cohesion as an **impulse** (N s), E the compliance of a contact (1/kg) on the diagonal. Where rolling is resisted
//! a contact carries a couple R* q as well (q in N s), conjugate to p = R* (omega_a - omega_b) = l_a s_a - l_b s_b with l = R*/r, in the
//! cones |q_t| <= mu_r (g_n + c) and |q_n| <= mu_s (g_n + c).
//!
//! **Scaling.** Normal and tangential part of each contact are measured by their own diagonal of N, w_n = 1/m_a + 1/m_b + e and
//! w_t = w_n + k_a + k_b (k = r^2/I): the cone stays circular in that metric, its projection closed, and a step of length 1 is exact for
//! a contact alone. The residual of a contact is w (g - P(g - u/w)), normal and tangential, a speed; of a problem, the largest.
//!
//! **Memory.** A compliant contact is at rest under an impulse g0, not under none: u gains e (g - g0), and e g0 is the problem's bias. So a spring that was
//! bent stays bent, and what is at rest has no residual.
//!
//! **Solvers.** [`Method::Relaxation`] (default), [`Method::Nesterov`], [`Method::BarzilaiBorwein`], [`Method::GaussSeidel`]. All start from the
//! impulses they are given and keep the best iterate.
//!
//! **Same bits for any number of threads.** Contacts lie in [`Block`]s over consecutive bodies; a block sums the impulses on its bodies and on
//! the first of the next block in a buffer of its own, and buffers are added in order. Sums over the problem are added block by block.
//!
//! Sources: Tasora and Anitescu 2011; Mazhar, Heyn, Negrut, Tasora 2015 (Nesterov's method here); Birgin, Martinez, Raydan 2000 (spectral
//! projected gradients).

mod barzilai_borwein;
mod gauss_seidel;
mod nesterov;
mod parts;
mod projection;
mod relaxation;
mod sweep;
#[cfg(test)]
mod tests;

pub use projection::project;
pub use relaxation::Scratch;

use parts::Parts;

/// Three reals.
pub type Vec3 = [f64; 3];
/// A ball: v (0-2), 1/m (3), s = r omega (4-6), k = r^2/I (7); m/s and 1/kg. One that moves as prescribed has 1/m = k = 0.
pub type Row = [f64; 8];

/// What contacts have in common.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Class {
    /// Coulomb friction mu (1).
    pub friction: f64,
    /// Rolling friction mu_r (1).
    pub rolling: f64,
    /// Spinning friction mu_s (1).
    pub spinning: f64,
}

/// Contacts over consecutive bodies: all a in `first..last`, all movable b in `first..end`, where the bodies `last..end` belong to the next block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Block {
    /// Its first contact.
    pub contact: usize,
    /// Its first body.
    pub first: usize,
    /// After its last body.
    pub last: usize,
    /// After the last body that its contacts reach.
    pub end: usize,
}

/// The problem: all vectors of contacts have the same length, but for those that may be empty.
#[derive(Clone, Debug, Default)]
pub struct Problem {
    /// Bodies with their velocities before contact: first the movable ones, then those that move as prescribed.
    pub bodies: Vec<Row>,
    /// How many are movable.
    pub movable: usize,
    /// Body a of each contact, movable.
    pub a: Vec<u32>,
    /// Body b.
    pub b: Vec<u32>,
    /// Unit normal towards a, and b_n (m/s).
    pub frame: Vec<[f64; 4]>,
    /// Index into `classes`.
    pub class: Vec<u8>,
    /// The classes.
    pub classes: Vec<Class>,
    /// Cohesion as an impulse (N s); empty = none.
    pub cohesion: Vec<f64>,
    /// Compliance on the diagonal of N (1/kg); empty = none.
    pub compliance: Vec<f64>,
    /// Velocity added to the slip beside b_n (m/s): what compliance remembers, -e times the impulse at which it is at rest; empty = none.
    pub bias: Vec<Vec3>,
    /// Levers R*/r of a and b; empty = nothing resists rolling.
    pub lever: Vec<[f64; 2]>,
    /// Compliance of the couples (1/kg); empty = none.
    pub couple_compliance: Vec<f64>,
    /// Velocity added to p (m/s), as `bias` is to the slip; empty = none.
    pub couple_bias: Vec<Vec3>,
    /// The blocks, ascending; the first begins with body 0, each begins where the one before ends.
    pub blocks: Vec<Block>,
    /// Memory of the solver; empty at first.
    pub scratch: Scratch,
}

impl Problem {
    /// Number of contacts.
    pub fn contacts(&self) -> usize {
        self.a.len()
    }

    /// Tangential slip of contact `k` at the velocities in `bodies` (m/s), less what its compliance takes up under the impulse `force`.
    pub fn slip_speed(&self, k: usize, force: Vec3) -> f64 {
        let slip = sweep::contact::<false>(self, &self.bodies, k).with_compliance(self, k, force, [0.0; 3]);
        let normal: f64 = (0..3).map(|c| slip.u[c] * slip.n[c]).sum();
        (0..3).map(|c| (slip.u[c] - normal * slip.n[c]).powi(2)).sum::<f64>().sqrt()
    }

    /// Removes all contacts and bodies; keeps memory and classes.
    pub fn clear(&mut self) {
        self.bodies.clear();
        self.movable = 0;
        self.a.clear();
        self.b.clear();
        self.frame.clear();
        self.class.clear();
        self.cohesion.clear();
        self.compliance.clear();
        self.bias.clear();
        self.lever.clear();
        self.couple_compliance.clear();
        self.couple_bias.clear();
        self.blocks.clear();
    }
}

/// How to solve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Projected over-relaxation over blocks in two colours, eight contacts at a time: the fast one where contacts are compliant.
    #[default]
    Relaxation,
    /// Nesterov's accelerated projected gradient with adaptive restart and backtracking: for rigid contacts in deep beds.
    Nesterov,
    /// Barzilai and Borwein's step with a line search that is not monotone.
    BarzilaiBorwein,
    /// Projected Gauss-Seidel in colours: slow but simple, the reference.
    GaussSeidel,
}

/// Settings of a solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// How.
    pub method: Method,
    /// Residual to reach (m/s).
    pub tolerance: f64,
    /// Iterations at most.
    pub iterations: u32,
    /// Whether blocks run side by side on the current rayon pool; changes no bit.
    pub parallel: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { method: Method::Relaxation, tolerance: 1e-4, iterations: 200, parallel: false }
    }
}

/// How a solve ended.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Iterations done.
    pub iterations: u32,
    /// Residual of the impulses returned (m/s).
    pub residual: f64,
    /// The contact with that residual.
    pub worst: usize,
    /// Objective 1/2 g'Ng - g'r of the impulses returned (J).
    pub objective: f64,
    /// Whether the residual is within the tolerance.
    pub converged: bool,
}

/// Memory of a solver from one problem to the next; it changes what a solve costs, and its bits: save it with the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory {
    /// Lipschitz constant of the scaled problem found last (1).
    pub lipschitz: f64,
}

impl Default for Memory {
    fn default() -> Self {
        Self { lipschitz: 4.0 }
    }
}

/// Impulses of the contacts: g, and q where rolling is resisted (else empty).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Impulses {
    /// g (N s).
    pub force: Vec<Vec3>,
    /// q (N s), the couple over R*.
    pub couple: Vec<Vec3>,
}

/// Solves `problem` from the impulses given; leaves the best impulses there, and in `bodies` the velocities after contact.
///
/// # Panics
/// When vectors of `problem` and `impulses` differ in length.
pub fn solve(problem: &mut Problem, impulses: &mut Impulses, memory: &mut Memory, options: &Options) -> Outcome {
    let contacts = problem.contacts();
    assert_eq!(contacts, impulses.force.len(), "impulses: one per contact");
    for (name, length) in [("b", problem.b.len()), ("frame", problem.frame.len()), ("class", problem.class.len())] {
        assert_eq!(contacts, length, "{name}: one per contact");
    }
    let rolling = !problem.lever.is_empty();
    assert_eq!(
        if rolling { contacts } else { 0 },
        impulses.couple.len(),
        "couples: one per contact where rolling is resisted"
    );
    if contacts == 0 {
        return Outcome { converged: true, ..Outcome::default() };
    }
    if rolling {
        run::<true>(problem, impulses, memory, options)
    } else {
        run::<false>(problem, impulses, memory, options)
    }
}

fn run<const ROLL: bool>(
    problem: &mut Problem,
    impulses: &mut Impulses,
    memory: &mut Memory,
    options: &Options,
) -> Outcome {
    if options.method == Method::Relaxation {
        return relaxation::solve::<ROLL>(problem, impulses, options);
    }
    let mut parts = Parts::new::<ROLL>(problem, impulses, options.parallel);
    let outcome = match options.method {
        Method::Relaxation => unreachable!("it has been run"),
        Method::Nesterov => nesterov::solve::<ROLL>(problem, &mut parts, memory, options),
        Method::BarzilaiBorwein => barzilai_borwein::solve::<ROLL>(problem, &mut parts, options),
        Method::GaussSeidel => gauss_seidel::solve::<ROLL>(problem, &mut parts, options),
    };
    // From the velocities before contact at once: increments of many iterations leave their round-off behind.
    parts.velocities::<ROLL>(problem);
    parts.give_back(impulses);
    std::mem::swap(&mut problem.bodies, &mut parts.now);
    outcome
}
