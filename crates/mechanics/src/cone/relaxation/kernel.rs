//! A sweep over the batches of a block, and a look at their residual, on eight lanes of any instruction path.

use super::super::Row;
use super::OMEGA;
use super::batch::{Batch, NOBODY, Plan, Rolling};
use terramech_simd::{Kernel, Lanes, WIDTH};

/// What a look says of a block.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen {
    /// Largest residual (m/s), and its contact.
    pub residual: f64,
    pub worst: usize,
    /// sum g'(u + bias) + q'(p + bias).
    pub work: f64,
}

/// One sweep: every contact's own solution in turn, over-relaxed. Returns the largest change as the square of a speed.
pub struct Sweep<'a, const ROLL: bool> {
    pub plan: &'a mut Plan,
    pub rows: &'a mut [Row],
}

/// Residual and work.
pub struct Look<'a, const ROLL: bool> {
    pub plan: &'a Plan,
    pub rows: &'a [Row],
}

const NOTHING: Row = [0.0; 8];

type Vector<L> = [L; 3];

#[inline(always)]
fn dot<L: Lanes>(a: Vector<L>, b: Vector<L>) -> L {
    a[0].fma(b[0], a[1].fma(b[1], a[2] * b[2]))
}

#[inline(always)]
fn cross<L: Lanes>(a: Vector<L>, b: Vector<L>) -> Vector<L> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a + s b
#[inline(always)]
fn more<L: Lanes>(a: Vector<L>, s: L, b: Vector<L>) -> Vector<L> {
    [s.fma(b[0], a[0]), s.fma(b[1], a[1]), s.fma(b[2], a[2])]
}

#[inline(always)]
fn times<L: Lanes>(s: L, a: Vector<L>) -> Vector<L> {
    [s * a[0], s * a[1], s * a[2]]
}

#[inline(always)]
fn minus<L: Lanes>(a: Vector<L>, b: Vector<L>) -> Vector<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn load<L: Lanes>(x: &[[f64; WIDTH]; 3]) -> Vector<L> {
    [L::load(&x[0]), L::load(&x[1]), L::load(&x[2])]
}

#[inline(always)]
fn store<L: Lanes>(x: Vector<L>, to: &mut [[f64; WIDTH]; 3]) {
    x[0].store(&mut to[0]);
    x[1].store(&mut to[1]);
    x[2].store(&mut to[2]);
}

#[inline(always)]
fn gather<L: Lanes>(rows: &[Row], at: &[u32; WIDTH]) -> [L; 8] {
    let mut from = [&NOTHING; WIDTH];
    for l in 0..WIDTH {
        if let Some(row) = rows.get(at[l] as usize) {
            from[l] = row;
        }
    }
    L::columns(from)
}

#[inline(always)]
fn scatter<L: Lanes>(columns: [L; 8], rows: &mut [Row], at: &[u32; WIDTH]) {
    let from = L::rows(columns);
    for l in 0..WIDTH {
        if let Some(row) = rows.get_mut(at[l] as usize) {
            *row = from[l];
        }
    }
}

/// A batch at the velocities of its bodies.
struct At<L: Lanes> {
    a: [L; 8],
    b: [L; 8],
    n: Vector<L>,
    g: Vector<L>,
    u: Vector<L>,
    bias: Vector<L>,
    w_n: L,
    w_t: L,
}

/// And what rolls.
struct Roll<L: Lanes> {
    lever: [L; 2],
    q: Vector<L>,
    p: Vector<L>,
    bias: Vector<L>,
    w: L,
}

impl<L: Lanes> At<L> {
    #[inline(always)]
    fn new(batch: &Batch, rows: &[Row]) -> Self {
        let (a, b) = (gather::<L>(rows, &batch.a), gather::<L>(rows, &batch.b));
        let (n, g, bias) = (load(&batch.n), load(&batch.g), load(&batch.bias));
        let e = L::load(&batch.e);
        let turn = cross(n, [a[4] + b[4], a[5] + b[5], a[6] + b[6]]);
        let mut u = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        for i in 0..3 {
            u[i] = e.fma(g[i], u[i] + turn[i] + bias[i]);
        }
        let w_n = a[3] + b[3] + e;
        let w_t = w_n + a[7] + b[7];
        Self { a, b, n, g, u, bias, w_n, w_t }
    }

    #[inline(always)]
    fn roll(&self, rolling: &Rolling) -> Roll<L> {
        let lever = [L::load(&rolling.lever[0]), L::load(&rolling.lever[1])];
        let (q, bias) = (load(&rolling.q), load(&rolling.bias));
        let e = L::load(&rolling.e);
        let mut p: Vector<L> = bias;
        for i in 0..3 {
            p[i] = e.fma(q[i], p[i]) + lever[0] * self.a[4 + i] - lever[1] * self.b[4 + i];
        }
        let w = lever[0] * lever[0] * self.a[7] + lever[1] * lever[1] * self.b[7] + e;
        Roll { lever, q, p, bias, w }
    }

    /// P(g - omega u/w): the new impulses.
    #[inline(always)]
    fn step<const ROLL: bool>(&self, batch: &Batch, rolling: Option<(&Rolling, &Roll<L>)>, omega: L) -> [Vector<L>; 2] {
        let (n, zero, one) = (self.n, L::splat(0.0), L::splat(1.0));
        let tiny = L::splat(1e-300);
        let both = omega.over(self.w_n * self.w_t);
        let (u_n, g_n) = (dot(self.u, n), dot(self.g, n));
        let cohesion = L::load(&batch.cohesion);
        let z = g_n - u_n * (both * self.w_t) + cohesion;
        let tangent = more(self.g, -g_n, n);
        let x = more(tangent, -(both * self.w_n), more(self.u, -u_n, n));
        let length = dot(x, x).sqrt();
        let mu = L::load(&batch.friction);
        let m = mu * self.w_t;
        let mut p = (self.w_n * z + m * length).over(mu.fma(m, self.w_n)).max(z).max(zero);
        if let (true, Some((rolling, roll))) = (ROLL, rolling) {
            let rigid = one.over(roll.w.max(tiny)).where_more(roll.w, zero) * omega;
            let y = more(roll.q, -rigid, roll.p);
            let spin = dot(y, n);
            let turn = more(y, -spin, n);
            let (spin_length, turn_length) = ((spin * spin).sqrt(), dot(turn, turn).sqrt());
            let (mu_r, mu_s) = (L::load(&rolling.rolling), L::load(&rolling.spinning));
            // Newton's method on a concave rising function, from below: as many steps as there are sides, and one more.
            let (mr, ms) = (mu_r * roll.w, mu_s * roll.w);
            p = z;
            for _ in 0..4 {
                let mut top = self.w_n * z;
                let mut bottom = self.w_n;
                for (mu, m, x) in [(mu, m, length), (mu_r, mr, turn_length), (mu_s, ms, spin_length)] {
                    let limit = mu * p;
                    top += (m * x).where_more(x, limit);
                    bottom += (mu * m).where_more(x, limit);
                }
                p = top.over(bottom).max(p);
            }
            p = p.max(zero);
            let f_turn = (mu_r * p).over((mu_r * p).max(turn_length).max(tiny));
            let f_spin = (mu_s * p).over((mu_s * p).max(spin_length).max(tiny));
            let limit = mu * p;
            let f = limit.over(limit.max(length).max(tiny));
            return [more(times(f, x), p - cohesion, n), more(times(f_turn, turn), f_spin * spin, n)];
        }
        let limit = mu * p;
        let f = limit.over(limit.max(length).max(tiny));
        [more(times(f, x), p - cohesion, n), [zero; 3]]
    }

    /// |w d|^2 of a change of impulse: the square of a speed.
    #[inline(always)]
    fn speed2(&self, d: Vector<L>) -> L {
        let normal = dot(d, self.n);
        let n2 = normal * normal;
        (self.w_n * self.w_n) * n2 + (self.w_t * self.w_t) * (dot(d, d) - n2)
    }
}

impl<const ROLL: bool> Kernel for Sweep<'_, ROLL> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let omega = L::splat(OMEGA);
        let mut change = L::splat(0.0);
        for k in 0..self.plan.batches.len() {
            let batch = &mut self.plan.batches[k];
            let mut at = At::<L>::new(batch, self.rows);
            let (to, d, mut dq, lever) = if ROLL {
                let rolling = &mut self.plan.rolling[k];
                let roll = at.roll(rolling);
                let omega = L::load(&rolling.omega);
                let [g, q] = at.step::<true>(batch, Some((rolling, &roll)), omega);
                let dq = minus(q, roll.q);
                change = ((roll.w * roll.w) * dot(dq, dq)).max(change);
                store(q, &mut rolling.q);
                (g, minus(g, at.g), dq, roll.lever)
            } else {
                let [g, q] = at.step::<false>(batch, None, omega);
                (g, minus(g, at.g), q, [omega; 2])
            };
            store(to, &mut batch.g);
            change = at.speed2(d).max(change);
            let turn = cross(at.n, d);
            let mut dq_b = dq;
            if ROLL {
                dq = times(lever[0], dq);
                dq_b = times(lever[1], dq_b);
            }
            for i in 0..3 {
                at.a[i] = at.a[3].fma(d[i], at.a[i]);
                at.b[i] = at.b[i] - at.b[3] * d[i];
                if ROLL {
                    at.a[4 + i] = at.a[7].fma(dq[i] - turn[i], at.a[4 + i]);
                    at.b[4 + i] = at.b[4 + i] - at.b[7] * (dq_b[i] + turn[i]);
                } else {
                    at.a[4 + i] = at.a[4 + i] - at.a[7] * turn[i];
                    at.b[4 + i] = at.b[4 + i] - at.b[7] * turn[i];
                }
            }
            scatter(at.a, self.rows, &batch.a);
            scatter(at.b, self.rows, &batch.b);
        }
        let mut lanes = [0.0; WIDTH];
        change.store(&mut lanes);
        let mut most = 0.0;
        for x in lanes {
            // NaN wins.
            if x > most || x.is_nan() {
                most = x;
            }
        }
        most
    }
}

impl<const ROLL: bool> Kernel for Look<'_, ROLL> {
    type Output = Seen;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Seen {
        let one = L::splat(1.0);
        let mut seen = Seen::default();
        let mut work = L::splat(0.0);
        for k in 0..self.plan.batches.len() {
            let batch = &self.plan.batches[k];
            let at = At::<L>::new(batch, self.rows);
            let mut speed;
            if ROLL {
                let rolling = &self.plan.rolling[k];
                let roll = at.roll(rolling);
                let [g, q] = at.step::<true>(batch, Some((rolling, &roll)), one);
                let dq = minus(q, roll.q);
                speed = at.speed2(minus(g, at.g)) + (roll.w * roll.w) * dot(dq, dq);
                work += dot(roll.q, roll.p) + dot(roll.q, roll.bias);
            } else {
                let [g, _] = at.step::<false>(batch, None, one);
                speed = at.speed2(minus(g, at.g));
            }
            work += dot(at.g, at.u) + dot(at.g, at.bias);
            speed = speed.sqrt();
            let mut lanes = [0.0; WIDTH];
            speed.store(&mut lanes);
            for l in 0..WIDTH {
                if (lanes[l] > seen.residual || lanes[l].is_nan()) && batch.contact[l] != NOBODY {
                    (seen.residual, seen.worst) = (lanes[l], batch.contact[l] as usize);
                }
            }
        }
        let mut lanes = [0.0; WIDTH];
        work.store(&mut lanes);
        for x in lanes {
            seen.work += x;
        }
        seen
    }
}
