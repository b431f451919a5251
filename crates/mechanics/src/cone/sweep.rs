//! One contact: its slip, the step of a projected gradient, its residual, its load on the bodies.

use super::projection::{Side, cut, project};
use super::{Block, Problem, Row, Vec3};

#[inline(always)]
fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a + s b
#[inline(always)]
fn more(a: Vec3, s: f64, b: Vec3) -> Vec3 {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

#[inline(always)]
fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// A contact's slip and the diagonal of N.
#[derive(Clone, Copy, Debug)]
pub struct Slip {
    pub n: Vec3,
    /// u (m/s), b_n along n included.
    pub u: Vec3,
    /// p (m/s), where rolling is resisted.
    pub p: Vec3,
    /// w_n, w_t, w of rolling (1/kg).
    pub w_n: f64,
    pub w_t: f64,
    pub w_p: f64,
}

/// Slip of contact `k` at the velocities `v`, without compliance.
#[inline(always)]
pub fn contact<const ROLL: bool>(problem: &Problem, v: &[Row], k: usize) -> Slip {
    let (a, b) = (&v[problem.a[k] as usize], &v[problem.b[k] as usize]);
    let [nx, ny, nz, bias] = problem.frame[k];
    let n = [nx, ny, nz];
    let s = [a[4] + b[4], a[5] + b[5], a[6] + b[6]];
    let turn = cross(n, s);
    let more = problem.bias.get(k).copied().unwrap_or_default();
    let u: Vec3 = std::array::from_fn(|c| a[c] - b[c] + turn[c] + bias * n[c] + more[c]);
    let w_n = a[3] + b[3];
    let w_t = w_n + a[7] + b[7];
    if !ROLL {
        return Slip { n, u, p: [0.0; 3], w_n, w_t, w_p: 0.0 };
    }
    let [la, lb] = problem.lever[k];
    let more = problem.couple_bias.get(k).copied().unwrap_or_default();
    let p = std::array::from_fn(|c| la * a[4 + c] - lb * b[4 + c] + more[c]);
    Slip { n, u, p, w_n, w_t, w_p: la * la * a[7] + lb * lb * b[7] }
}

/// Impulses after the step of a projected gradient.
pub struct Stepped {
    pub force: Vec3,
    pub couple: Vec3,
}

impl Slip {
    /// Adds what the compliance of the contact does under `force` and `couple`.
    #[inline(always)]
    pub fn with_compliance(mut self, problem: &Problem, k: usize, force: Vec3, couple: Vec3) -> Self {
        if let Some(&e) = problem.compliance.get(k) {
            self.u = more(self.u, e, force);
            self.w_n += e;
            self.w_t += e;
        }
        if let Some(&e) = problem.couple_compliance.get(k) {
            self.p = more(self.p, e, couple);
            self.w_p += e;
        }
        self
    }

    /// Projects impulses onto the cones of contact `k`, in the metric of the diagonal.
    #[inline(always)]
    pub fn cut<const ROLL: bool>(&self, problem: &Problem, k: usize, force: Vec3, couple: Vec3) -> (Vec3, Vec3) {
        let class = &problem.classes[problem.class[k] as usize];
        let c = problem.cohesion.get(k).copied().unwrap_or(0.0);
        let normal = dot(force, self.n);
        let tangent = more(force, -normal, self.n);
        let x = norm(tangent);
        let slide = Side { mu: class.friction, kappa: self.w_t / self.w_n, x };
        if !ROLL {
            let g = project(normal + c, [slide]);
            let f = cut(x, class.friction * g);
            return (more([f * tangent[0], f * tangent[1], f * tangent[2]], g - c, self.n), [0.0; 3]);
        }
        let spin = dot(couple, self.n);
        let roll = more(couple, -spin, self.n);
        let kappa = self.w_p / self.w_n;
        let (y, z) = (spin.abs(), norm(roll));
        let g = project(
            normal + c,
            [slide, Side { mu: class.spinning, kappa, x: y }, Side { mu: class.rolling, kappa, x: z }],
        );
        let f = cut(x, class.friction * g);
        let (fs, fr) = (cut(y, class.spinning * g), cut(z, class.rolling * g));
        (
            more([f * tangent[0], f * tangent[1], f * tangent[2]], g - c, self.n),
            more([fr * roll[0], fr * roll[1], fr * roll[2]], fs * spin, self.n),
        )
    }

    /// x / w by parts: normal and tangential.
    #[inline(always)]
    fn over_diagonal(&self, x: Vec3) -> Vec3 {
        let normal = dot(x, self.n);
        let t = 1.0 / self.w_t;
        let y = normal / self.w_n - normal * t;
        [t * x[0] + y * self.n[0], t * x[1] + y * self.n[1], t * x[2] + y * self.n[2]]
    }

    /// P(g - t u/w).
    #[inline(always)]
    pub fn step<const ROLL: bool>(&self, problem: &Problem, k: usize, t: f64, force: Vec3, couple: Vec3) -> Stepped {
        let force = more(force, -t, self.over_diagonal(self.u));
        let couple = if ROLL && self.w_p > 0.0 { more(couple, -t / self.w_p, self.p) } else { couple };
        let (force, couple) = self.cut::<ROLL>(problem, k, force, couple);
        Stepped { force, couple }
    }

    /// d'Wd of a change of impulse.
    #[inline(always)]
    pub fn length2<const ROLL: bool>(&self, force: Vec3, couple: Vec3) -> f64 {
        let normal = dot(force, self.n);
        let n2 = normal * normal;
        let mut sum = self.w_n * n2 + self.w_t * (dot(force, force) - n2);
        if ROLL {
            sum += self.w_p * dot(couple, couple);
        }
        sum
    }

    /// |w d| of a change of impulse: a speed (m/s).
    #[inline(always)]
    pub fn speed<const ROLL: bool>(&self, force: Vec3, couple: Vec3) -> f64 {
        let normal = dot(force, self.n);
        let n2 = normal * normal;
        let mut sum = self.w_n * self.w_n * n2 + self.w_t * self.w_t * (dot(force, force) - n2);
        if ROLL {
            sum += self.w_p * self.w_p * dot(couple, couple);
        }
        sum.sqrt()
    }

    /// Residual of impulses at this slip (m/s).
    #[inline(always)]
    pub fn residual<const ROLL: bool>(&self, problem: &Problem, k: usize, force: Vec3, couple: Vec3) -> f64 {
        let to = self.step::<ROLL>(problem, k, 1.0, force, couple);
        self.speed::<ROLL>(more(force, -1.0, to.force), more(couple, -1.0, to.couple))
    }

    /// u'g.
    #[inline(always)]
    pub fn work<const ROLL: bool>(&self, force: Vec3, couple: Vec3) -> f64 {
        dot(self.u, force) + if ROLL { dot(self.p, couple) } else { 0.0 }
    }

    /// Adds the load of contact `k` on the bodies of its block.
    #[inline(always)]
    pub fn load<const ROLL: bool>(
        problem: &Problem,
        k: usize,
        block: Block,
        force: Vec3,
        couple: Vec3,
        load: &mut [Row],
    ) {
        let mut pair = [[0.0; 8]; 2];
        Self::load_pair::<ROLL>(problem, k, force, couple, &mut pair);
        let a = &mut load[problem.a[k] as usize - block.first];
        for c in 0..8 {
            a[c] += pair[0][c];
        }
        // Beyond the movable ones nothing moves by impulses.
        if let Some(b) = load.get_mut((problem.b[k] as usize).wrapping_sub(block.first)) {
            for c in 0..8 {
                b[c] += pair[1][c];
            }
        }
    }

    /// The loads of contact `k` on its two bodies: force (0-2), turn (4-6, before the factor k).
    #[inline(always)]
    pub fn load_pair<const ROLL: bool>(problem: &Problem, k: usize, force: Vec3, couple: Vec3, pair: &mut [Row; 2]) {
        let [nx, ny, nz, _] = problem.frame[k];
        // Both bodies turn the same way: their arms along n are opposite, and so are the forces.
        let turn = cross([nx, ny, nz], force);
        for c in 0..3 {
            pair[0][c] = force[c];
            pair[1][c] = -force[c];
            pair[0][4 + c] = -turn[c];
            pair[1][4 + c] = -turn[c];
        }
        if ROLL {
            let [la, lb] = problem.lever[k];
            for c in 0..3 {
                pair[0][4 + c] += la * couple[c];
                pair[1][4 + c] -= lb * couple[c];
            }
        }
    }
}
