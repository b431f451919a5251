//! Generalised strains: the 32 quadratic forms of an element's coordinates that all its strains are linear in.
//!
//! With `p_i` the node positions and `s_i = (h/2) d_i` half the thickness vectors, the shell is
//! `x(xi, eta, zeta) = sum N_i (p_i + zeta s_i)`. Its covariant in-plane strains at 2 x 2 in-plane points are polynomials in zeta;
//! since N is bilinear, `x,xi` depends on eta alone and `x,eta` on xi alone, so that the 36 coefficients are only 24:
//!
//! | index | strain | count |
//! |---|---|---|
//! | 0.. | xi-xi at eta = -g, +g; powers 1, zeta, zeta^2 | 6 |
//! | 6.. | eta-eta at xi = -g, +g; the same | 6 |
//! | 12.. | 2 xi-eta at the four points (xi fast); the same | 12 |
//! | 24.. | zeta-zeta at the nodes A, B, C, D (assumed natural strain) | 4 |
//! | 28.. | 2 xi-zeta at the middles of edges AB, DC | 2 |
//! | 30.. | 2 eta-zeta at the middles of edges AD, BC | 2 |
//!
//! g = 1/sqrt(3). All in m2; subtracting the reference shape's gives strains.

use terramech_simd::Lanes as Lane;

/// Number of generalised strains.
pub const STRAINS: usize = 32;
/// Coordinates of an element: four nodes of position and director.
pub const COORDS: usize = 24;
/// In-plane Gauss abscissa 1/sqrt(3).
pub const GAUSS: f64 = 0.577_350_269_189_625_8;

/// A vector of lanes.
pub type V3<L> = [L; 3];

#[inline(always)]
pub(super) fn dot<L: Lane>(a: &V3<L>, b: &V3<L>) -> L {
    a[2].fma(b[2], a[1].fma(b[1], a[0] * b[0]))
}

#[inline(always)]
pub(super) fn cross<L: Lane>(a: &V3<L>, b: &V3<L>) -> V3<L> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn sub<L: Lane>(a: &V3<L>, b: &V3<L>) -> V3<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn add<L: Lane>(a: &V3<L>, b: &V3<L>) -> V3<L> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `u a + v b`.
#[inline(always)]
fn mix<L: Lane>(u: f64, a: &V3<L>, v: f64, b: &V3<L>) -> V3<L> {
    [a[0] * u + b[0] * v, a[1] * u + b[1] * v, a[2] * u + b[2] * v]
}

/// `t += s a`.
#[inline(always)]
fn axpy<L: Lane>(t: &mut V3<L>, s: L, a: &V3<L>) {
    for k in 0..3 {
        t[k] = s.fma(a[k], t[k]);
    }
}

/// Weights of the two parallel edges in the tangent at the first Gauss line; swapped at the second.
const NEAR: f64 = 0.25 * (1.0 + GAUSS);
const FAR: f64 = 0.25 * (1.0 - GAUSS);

/// Linear images of an element's coordinates that the quadratic forms are made of.
#[derive(Clone, Copy)]
pub struct Frame<L> {
    /// `x,xi` on the mid-surface at eta = -g, +g.
    pub ax: [V3<L>; 2],
    /// `x,eta` on the mid-surface at xi = -g, +g.
    pub ay: [V3<L>; 2],
    /// The same of the half thickness vectors.
    bx: [V3<L>; 2],
    /// The same.
    by: [V3<L>; 2],
    /// Half thickness vectors at the nodes.
    s: [V3<L>; 4],
    /// Edges AB, DC, AD, BC.
    edge: [V3<L>; 4],
    /// Sums of the half thickness vectors at the ends of those edges.
    sum: [V3<L>; 4],
}

/// Ends of the edges in the order of [`Frame`].
const EDGES: [(usize, usize); 4] = [(0, 1), (3, 2), (0, 3), (1, 2)];

impl<L: Lane> Frame<L> {
    /// From coordinates (per node: position, director) and half the thickness.
    #[inline(always)]
    pub fn new(q: &[L; COORDS], half: f64) -> Self {
        let node = |i: usize, k: usize| [q[6 * i + k], q[6 * i + k + 1], q[6 * i + k + 2]];
        let p = [node(0, 0), node(1, 0), node(2, 0), node(3, 0)];
        let d = [node(0, 3), node(1, 3), node(2, 3), node(3, 3)];
        let mut s = d;
        for i in 0..4 {
            s[i] = [d[i][0] * half, d[i][1] * half, d[i][2] * half];
        }
        let mut edge = p;
        let mut turn = p;
        let mut sum = p;
        for (k, (i, j)) in EDGES.into_iter().enumerate() {
            edge[k] = sub(&p[j], &p[i]);
            turn[k] = sub(&s[j], &s[i]);
            sum[k] = add(&s[i], &s[j]);
        }
        Self {
            ax: [mix(NEAR, &edge[0], FAR, &edge[1]), mix(FAR, &edge[0], NEAR, &edge[1])],
            ay: [mix(NEAR, &edge[2], FAR, &edge[3]), mix(FAR, &edge[2], NEAR, &edge[3])],
            bx: [mix(NEAR, &turn[0], FAR, &turn[1]), mix(FAR, &turn[0], NEAR, &turn[1])],
            by: [mix(NEAR, &turn[2], FAR, &turn[3]), mix(FAR, &turn[2], NEAR, &turn[3])],
            s,
            edge,
            sum,
        }
    }

    /// The symmetric bilinear form behind the generalised strains, m2: `E(q) = pair(q, q)/2`, its rate is `pair(q, v)`.
    #[inline(always)]
    pub fn pair(&self, o: &Self) -> [L; STRAINS] {
        let mut e = [L::splat(0.0); STRAINS];
        for k in 0..2 {
            e[3 * k] = dot(&self.ax[k], &o.ax[k]);
            e[3 * k + 1] = dot(&self.ax[k], &o.bx[k]) + dot(&self.bx[k], &o.ax[k]);
            e[3 * k + 2] = dot(&self.bx[k], &o.bx[k]);
            e[6 + 3 * k] = dot(&self.ay[k], &o.ay[k]);
            e[7 + 3 * k] = dot(&self.ay[k], &o.by[k]) + dot(&self.by[k], &o.ay[k]);
            e[8 + 3 * k] = dot(&self.by[k], &o.by[k]);
        }
        for ky in 0..2 {
            for kx in 0..2 {
                let i = 12 + 3 * (kx + 2 * ky);
                e[i] = dot(&self.ax[ky], &o.ay[kx]) + dot(&self.ay[kx], &o.ax[ky]);
                e[i + 1] = dot(&self.ax[ky], &o.by[kx])
                    + dot(&self.by[kx], &o.ax[ky])
                    + dot(&self.bx[ky], &o.ay[kx])
                    + dot(&self.ay[kx], &o.bx[ky]);
                e[i + 2] = dot(&self.bx[ky], &o.by[kx]) + dot(&self.by[kx], &o.bx[ky]);
            }
        }
        for i in 0..4 {
            e[24 + i] = dot(&self.s[i], &o.s[i]);
            e[28 + i] = (dot(&self.edge[i], &o.sum[i]) + dot(&self.sum[i], &o.edge[i])) * 0.25;
        }
        e
    }

    /// Gradient of `stress . E` with respect to the coordinates: the internal force of generalised stresses (J/m2 each), N for
    /// positions and N m for directors. Linear in the frame.
    #[inline(always)]
    pub fn gradient(&self, stress: &[L; STRAINS], half: f64) -> [L; COORDS] {
        let zero = [L::splat(0.0); 3];
        let (mut gax, mut gay, mut gbx, mut gby) = ([zero; 2], [zero; 2], [zero; 2], [zero; 2]);
        for k in 0..2 {
            axpy(&mut gax[k], stress[3 * k], &self.ax[k]);
            axpy(&mut gax[k], stress[3 * k + 1], &self.bx[k]);
            axpy(&mut gbx[k], stress[3 * k + 1], &self.ax[k]);
            axpy(&mut gbx[k], stress[3 * k + 2], &self.bx[k]);
            axpy(&mut gay[k], stress[6 + 3 * k], &self.ay[k]);
            axpy(&mut gay[k], stress[7 + 3 * k], &self.by[k]);
            axpy(&mut gby[k], stress[7 + 3 * k], &self.ay[k]);
            axpy(&mut gby[k], stress[8 + 3 * k], &self.by[k]);
        }
        for ky in 0..2 {
            for kx in 0..2 {
                let i = 12 + 3 * (kx + 2 * ky);
                axpy(&mut gax[ky], stress[i], &self.ay[kx]);
                axpy(&mut gax[ky], stress[i + 1], &self.by[kx]);
                axpy(&mut gbx[ky], stress[i + 1], &self.ay[kx]);
                axpy(&mut gbx[ky], stress[i + 2], &self.by[kx]);
                axpy(&mut gay[kx], stress[i], &self.ax[ky]);
                axpy(&mut gay[kx], stress[i + 1], &self.bx[ky]);
                axpy(&mut gby[kx], stress[i + 1], &self.ax[ky]);
                axpy(&mut gby[kx], stress[i + 2], &self.bx[ky]);
            }
        }
        let mut gp = [zero; 4];
        let mut gs = [zero; 4];
        for i in 0..4 {
            axpy(&mut gs[i], stress[24 + i], &self.s[i]);
        }
        // Edges 0, 1 come from the xi tangents, 2, 3 from the eta tangents.
        let tangents = [(&gax, &gbx), (&gay, &gby)];
        for (k, (i, j)) in EDGES.into_iter().enumerate() {
            let (ga, gb) = tangents[k / 2];
            let (u, v) = if k % 2 == 0 { (NEAR, FAR) } else { (FAR, NEAR) };
            let quarter = stress[28 + k] * 0.25;
            let mut ge = mix(u, &ga[0], v, &ga[1]);
            axpy(&mut ge, quarter, &self.sum[k]);
            let gt = mix(u, &gb[0], v, &gb[1]);
            gp[i] = sub(&gp[i], &ge);
            gp[j] = add(&gp[j], &ge);
            gs[i] = sub(&gs[i], &gt);
            gs[j] = add(&gs[j], &gt);
            axpy(&mut gs[i], quarter, &self.edge[k]);
            axpy(&mut gs[j], quarter, &self.edge[k]);
        }
        let mut out = [L::splat(0.0); COORDS];
        for i in 0..4 {
            for c in 0..3 {
                out[6 * i + c] = gp[i][c];
                out[6 * i + 3 + c] = gs[i][c] * half;
            }
        }
        out
    }
}
