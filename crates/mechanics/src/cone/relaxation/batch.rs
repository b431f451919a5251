//! The contacts of a block in batches of eight that share no movable body.

use super::super::sweep::contact;
use super::super::{Impulses, Problem, Row, Vec3};
use super::OMEGA;
use super::kernel::Seen;
use terramech_simd::WIDTH;

/// No body: one that does not move.
pub const NOBODY: u32 = u32::MAX;

/// Eight reals.
pub type Pack = [f64; WIDTH];

/// Eight contacts; lanes without one have both bodies [`NOBODY`].
#[derive(Clone, Debug)]
pub struct Batch {
    /// Bodies, counted from the block's first.
    pub a: [u32; WIDTH],
    pub b: [u32; WIDTH],
    /// Normals.
    pub n: [Pack; 3],
    /// All of the slip that no impulse changes: b_n n, bias, the velocity of a prescribed partner.
    pub bias: [Pack; 3],
    /// Compliance.
    pub e: Pack,
    pub friction: Pack,
    pub cohesion: Pack,
    /// Impulses.
    pub g: [Pack; 3],
    /// Numbers of the contacts.
    pub contact: [u32; WIDTH],
}

/// What rolling adds to a batch.
#[derive(Clone, Debug)]
pub struct Rolling {
    pub lever: [Pack; 2],
    /// Compliance.
    pub e: Pack,
    /// Spin of a prescribed partner, as part of p, and the problem's bias.
    pub bias: [Pack; 3],
    /// Over-relaxation of the contact.
    pub omega: Pack,
    pub rolling: Pack,
    pub spinning: Pack,
    /// Couples.
    pub q: [Pack; 3],
}

const EMPTY: Batch = Batch {
    a: [NOBODY; WIDTH],
    b: [NOBODY; WIDTH],
    n: [[0.0; WIDTH]; 3],
    bias: [[0.0; WIDTH]; 3],
    // The diagonal is never 0.
    e: [1.0; WIDTH],
    friction: [0.0; WIDTH],
    cohesion: [0.0; WIDTH],
    g: [[0.0; WIDTH]; 3],
    contact: [NOBODY; WIDTH],
};

const EMPTY_ROLLING: Rolling = Rolling {
    lever: [[0.0; WIDTH]; 2],
    e: [0.0; WIDTH],
    bias: [[0.0; WIDTH]; 3],
    omega: [1.0; WIDTH],
    rolling: [0.0; WIDTH],
    spinning: [0.0; WIDTH],
    q: [[0.0; WIDTH]; 3],
};

/// A block's batches.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    pub batches: Vec<Batch>,
    pub rolling: Vec<Rolling>,
    /// Largest change that the last sweep made, as the square of a speed.
    pub change: f64,
    pub seen: Seen,
    /// Colours taken at each body, the open batch of each colour: scratch.
    taken: Vec<u64>,
    open: Vec<u32>,
}

impl Plan {
    /// Batches of block `k`, whose contacts end before `end`, with the impulses given, cut back to their cones.
    pub fn make<const ROLL: bool>(
        &mut self,
        problem: &Problem,
        bodies: &[Row],
        impulses: &Impulses,
        k: usize,
        end: usize,
    ) {
        let block = problem.blocks[k];
        self.batches.clear();
        self.rolling.clear();
        self.taken.clear();
        self.taken.resize(block.end - block.first, 0);
        self.open.clear();
        // A batch is open for each colour; contacts that find all 64 taken get batches of their own.
        self.open.resize(64, NOBODY);
        for c in block.contact..end {
            let slot = |body: u32| {
                let body = body as usize;
                let moves = body < problem.movable && (bodies[body][3] > 0.0 || bodies[body][7] > 0.0);
                if moves { Some(body - block.first) } else { None }
            };
            let (a, b) = (slot(problem.a[c]), slot(problem.b[c]));
            let used = a.map_or(0, |a| self.taken[a]) | b.map_or(0, |b| self.taken[b]);
            let colour = (!used).trailing_zeros() as usize;
            let (batch, lane) = if colour < 64 {
                for body in [a, b].into_iter().flatten() {
                    self.taken[body] |= 1 << colour;
                }
                let open = self.open[colour];
                let lane = if open == NOBODY { WIDTH } else { self.lanes_of(open) };
                if lane == WIDTH {
                    self.open[colour] = self.batches.len() as u32;
                    (self.add::<ROLL>(), 0)
                } else {
                    (open as usize, lane)
                }
            } else {
                (self.add::<ROLL>(), 0)
            };
            let place = |body: Option<usize>| body.map_or(NOBODY, |x| x as u32);
            self.put::<ROLL>(problem, bodies, impulses, c, (batch, lane), [place(a), place(b)]);
        }
    }

    fn lanes_of(&self, batch: u32) -> usize {
        self.batches[batch as usize].contact.iter().position(|&c| c == NOBODY).unwrap_or(WIDTH)
    }

    fn add<const ROLL: bool>(&mut self) -> usize {
        self.batches.push(EMPTY);
        if ROLL {
            self.rolling.push(EMPTY_ROLLING);
        }
        self.batches.len() - 1
    }

    fn put<const ROLL: bool>(
        &mut self,
        problem: &Problem,
        bodies: &[Row],
        impulses: &Impulses,
        c: usize,
        (batch, l): (usize, usize),
        [a, b]: [u32; 2],
    ) {
        let to = &mut self.batches[batch];
        let slip = contact::<ROLL>(problem, bodies, c);
        let [nx, ny, nz, bn] = problem.frame[c];
        let n = [nx, ny, nz];
        let more = problem.bias.get(c).copied().unwrap_or_default();
        // The partner that does not move by impulses: its part of slip and roll.
        let other = if b == NOBODY { &bodies[problem.b[c] as usize] } else { &[0.0; 8] };
        let s = [other[4], other[5], other[6]];
        let turn = [n[1] * s[2] - n[2] * s[1], n[2] * s[0] - n[0] * s[2], n[0] * s[1] - n[1] * s[0]];
        let class = &problem.classes[problem.class[c] as usize];
        let couple = if ROLL { impulses.couple[c] } else { [0.0; 3] };
        let slip = slip.with_compliance(problem, c, [0.0; 3], [0.0; 3]);
        let (g, q) = slip.cut::<ROLL>(problem, c, impulses.force[c], couple);
        (to.a[l], to.b[l], to.contact[l]) = (a, b, c as u32);
        for i in 0..3 {
            to.n[i][l] = n[i];
            to.bias[i][l] = bn * n[i] + more[i] - other[i] + turn[i];
            to.g[i][l] = g[i];
        }
        to.e[l] = problem.compliance.get(c).copied().unwrap_or(0.0);
        to.friction[l] = class.friction;
        to.cohesion[l] = problem.cohesion.get(c).copied().unwrap_or(0.0);
        if ROLL {
            let to = &mut self.rolling[batch];
            let lever = problem.lever[c];
            // The metric leaves out what couples force and couple of a contact: N is at most 1 + rho times the metric, and a step of
            // omega cannot raise the objective where that is at most 2/omega.
            let (ka, kb) = (bodies[problem.a[c] as usize][7], bodies[problem.b[c] as usize][7]);
            let both = slip.w_t * slip.w_p;
            let rho = if both > 0.0 { (ka * lever[0] - kb * lever[1]).abs() / both.sqrt() } else { 0.0 };
            to.omega[l] = OMEGA.min(1.98 / (1.0 + rho));
            (to.lever[0][l], to.lever[1][l]) = (lever[0], lever[1]);
            (to.rolling[l], to.spinning[l]) = (class.rolling, class.spinning);
            to.e[l] = problem.couple_compliance.get(c).copied().unwrap_or(0.0);
            let more = problem.couple_bias.get(c).copied().unwrap_or_default();
            for i in 0..3 {
                to.bias[i][l] = more[i] - lever[1] * s[i];
                to.q[i][l] = q[i];
            }
        }
    }

    /// Loads the bodies with the impulses as they are.
    pub fn push<const ROLL: bool>(&self, rows: &mut [Row]) {
        for (k, batch) in self.batches.iter().enumerate() {
            for l in 0..WIDTH {
                let (g, n) = (lane(&batch.g, l), lane(&batch.n, l));
                let turn = [n[1] * g[2] - n[2] * g[1], n[2] * g[0] - n[0] * g[2], n[0] * g[1] - n[1] * g[0]];
                let (mut q, mut lever) = ([0.0; 3], [0.0; 2]);
                if ROLL {
                    let r = &self.rolling[k];
                    (q, lever) = (lane(&r.q, l), [r.lever[0][l], r.lever[1][l]]);
                }
                for (body, sign, lever) in [(batch.a[l], 1.0, lever[0]), (batch.b[l], -1.0, lever[1])] {
                    let Some(row) = rows.get_mut(body as usize) else { continue };
                    for i in 0..3 {
                        row[i] += row[3] * sign * g[i];
                        row[4 + i] += row[7] * (sign * lever * q[i] - turn[i]);
                    }
                }
            }
        }
    }

    /// The impulses, to where they belong.
    pub fn give<const ROLL: bool>(&self, force: &mut [Vec3], couple: &mut [Vec3]) {
        for (k, batch) in self.batches.iter().enumerate() {
            for l in 0..WIDTH {
                let c = batch.contact[l] as usize;
                if c < force.len() {
                    force[c] = lane(&batch.g, l);
                    if ROLL {
                        couple[c] = lane(&self.rolling[k].q, l);
                    }
                }
            }
        }
    }

    /// Impulses from where they belong.
    pub fn take<const ROLL: bool>(&mut self, impulses: &Impulses) {
        for (k, batch) in self.batches.iter_mut().enumerate() {
            for l in 0..WIDTH {
                let Some(g) = impulses.force.get(batch.contact[l] as usize) else { continue };
                for i in 0..3 {
                    batch.g[i][l] = g[i];
                    if ROLL {
                        self.rolling[k].q[i][l] = impulses.couple[batch.contact[l] as usize][i];
                    }
                }
            }
        }
    }
}

fn lane(x: &[Pack; 3], l: usize) -> Vec3 {
    [x[0][l], x[1][l], x[2][l]]
}
