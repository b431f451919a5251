//! Forces and tangents of elements, one or eight at a time.

use super::element::ElementType;
use super::strain::{COORDS, Frame, GAUSS, STRAINS, cross};
use terramech_simd::{Lanes as Lane, WIDTH};

/// What acts on an element besides its elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loads {
    /// Structural damping: the stress is that of `strain + damping x strain rate`, s.
    pub damping: f64,
    /// Pressure on the bottom face, pushing along the director side, Pa. A follower load.
    pub pressure: f64,
}

/// `stiffness * e`, four rows at a time so that the accumulators stay in registers.
#[inline(always)]
fn stress<L: Lane>(stiffness: &[[f64; STRAINS]; STRAINS], e: &[L; STRAINS]) -> [L; STRAINS] {
    const ROWS: usize = 4;
    let mut out = [L::splat(0.0); STRAINS];
    for block in 0..STRAINS / ROWS {
        let mut sums = [L::splat(0.0); ROWS];
        for j in 0..STRAINS {
            for r in 0..ROWS {
                // The matrix is symmetric: reading row j keeps the loads contiguous.
                sums[r] = L::splat(stiffness[j][block * ROWS + r]).fma(e[j], sums[r]);
            }
        }
        out[block * ROWS..][..ROWS].copy_from_slice(&sums);
    }
    out
}

/// Nodal forces of a pressure on the mid-surface, exact for the bilinear surface; adds to positions' rows of `f`. With two frames it
/// gives the bilinear form's mixed term.
#[inline(always)]
fn add_pressure<L: Lane>(f: &mut [L; COORDS], a: &Frame<L>, b: &Frame<L>, pressure: f64) {
    for ky in 0..2 {
        for kx in 0..2 {
            let n = cross(&a.ax[ky], &b.ay[kx]);
            let (x, y) = ([-GAUSS, GAUSS][kx], [-GAUSS, GAUSS][ky]);
            let weights = [(1.0 - x) * (1.0 - y), (1.0 + x) * (1.0 - y), (1.0 + x) * (1.0 + y), (1.0 - x) * (1.0 + y)];
            for i in 0..4 {
                for c in 0..3 {
                    f[6 * i + c] = n[c].fma(L::splat(0.25 * pressure * weights[i]), f[6 * i + c]);
                }
            }
        }
    }
}

/// Force on the nodes: internal (elastic and damping) and pressure; and the inertia `M a` (give `a - g` for gravity).
#[inline(always)]
pub fn force<L: Lane>(
    kind: &ElementType,
    loads: &Loads,
    q: &[L; COORDS],
    v: &[L; COORDS],
    a: &[L; COORDS],
) -> ([L; COORDS], [L; COORDS]) {
    let frame = Frame::new(q, kind.half);
    let double = frame.pair(&frame);
    let mut e = [L::splat(0.0); STRAINS];
    for i in 0..STRAINS {
        e[i] = double[i] * 0.5 - L::splat(kind.reference[i]);
    }
    if loads.damping != 0.0 {
        let rate = frame.pair(&Frame::new(v, kind.half));
        for i in 0..STRAINS {
            e[i] = rate[i].fma(L::splat(loads.damping), e[i]);
        }
    }
    let s = stress(&kind.stiffness, &e);
    let mut f = frame.gradient(&s, kind.half);
    for x in &mut f {
        *x = -*x;
    }
    if loads.pressure != 0.0 {
        add_pressure(&mut f, &frame, &frame, loads.pressure);
    }
    let mut inertia = [L::splat(0.0); COORDS];
    for i in 0..8 {
        for j in 0..8 {
            let m = L::splat(kind.mass[i][j]);
            for c in 0..3 {
                inertia[3 * i + c] = a[3 * j + c].fma(m, inertia[3 * i + c]);
            }
        }
    }
    (f, inertia)
}

/// Strain energy and dissipated power of an element, J and W.
pub fn energy(kind: &ElementType, damping: f64, q: &[f64; COORDS], v: &[f64; COORDS]) -> (f64, f64) {
    let frame = Frame::new(q, kind.half);
    let double = frame.pair(&frame);
    let e: [f64; STRAINS] = std::array::from_fn(|i| 0.5 * double[i] - kind.reference[i]);
    let rate = frame.pair(&Frame::new(v, kind.half));
    let dot = |s: &[f64; STRAINS], e: &[f64; STRAINS]| s.iter().zip(e).map(|(a, b)| a * b).sum::<f64>();
    (0.5 * dot(&stress(&kind.stiffness, &e), &e), damping * dot(&stress(&kind.stiffness, &rate), &rate))
}

/// Mid-surface strains at the centre: along local x, along local y, engineering shear.
pub fn centre_strain(kind: &ElementType, q: &[f64; COORDS]) -> [f64; 3] {
    let frame = Frame::new(q, kind.half);
    let double = frame.pair(&frame);
    let mut out = [0.0; 3];
    for i in 0..STRAINS {
        let e = 0.5 * double[i] - kind.reference[i];
        (0..3).for_each(|k| out[k] += kind.centre[k][i] * e);
    }
    out
}

/// How the tangent is put together: `stiffness x (-dF/dq) + velocity x (-dF/dv) + mass x M`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TangentWeights {
    /// Weight of -dF/dq.
    pub stiffness: f64,
    /// Weight of -dF/dv.
    pub velocity: f64,
    /// Weight of the mass matrix.
    pub mass: f64,
    /// Whether the pressure's stiffness is included.
    pub pressure: bool,
    /// Whether the geometric stiffness is included (without it and without the pressure's the tangent is never indefinite).
    pub geometric: bool,
}

/// Element tangent, row by row: column c is the response to a unit change of coordinate c. The part of -dF/dq from the strain rate is
/// included when `v` is given; it is not symmetric and smaller than the velocity part by (turning rate x step).
///
/// `L` must carry eight lanes: each is one unit displacement.
#[inline(always)]
pub fn tangent<L: Lane>(
    kind: &ElementType,
    loads: &Loads,
    q: &[f64; COORDS],
    v: Option<&[f64; COORDS]>,
    weights: &TangentWeights,
) -> [[f64; COORDS]; COORDS] {
    let mut wide = [L::splat(0.0); COORDS];
    for c in 0..COORDS {
        wide[c] = L::splat(q[c]);
    }
    let frame = Frame::new(&wide, kind.half);
    let mut rate = None;
    if let Some(v) = v {
        for c in 0..COORDS {
            wide[c] = L::splat(v[c]);
        }
        rate = Some(Frame::new(&wide, kind.half));
    }
    // All lanes carry the same stress here; one product more costs less than a second kind of code.
    let mut s = frame.pair(&frame);
    for i in 0..STRAINS {
        s[i] = s[i] * 0.5 - L::splat(kind.reference[i]);
    }
    if let Some(rate) = &rate {
        let r = frame.pair(rate);
        for i in 0..STRAINS {
            s[i] = r[i].fma(L::splat(loads.damping), s[i]);
        }
    }
    let mut s = stress(&kind.stiffness, &s);
    for x in &mut s {
        *x = *x * weights.stiffness;
    }
    let direct = weights.stiffness + weights.velocity * loads.damping;
    let mut out = [[0.0; COORDS]; COORDS];
    for block in 0..COORDS / WIDTH {
        let mut unit = [L::splat(0.0); COORDS];
        for lane in 0..WIDTH {
            let mut one = [0.0; WIDTH];
            one[lane] = 1.0;
            unit[block * WIDTH + lane] = L::load(&one);
        }
        let du = Frame::new(&unit, kind.half);
        let mut de = frame.pair(&du);
        for x in &mut de {
            *x = *x * direct;
        }
        if let Some(rate) = &rate {
            let extra = rate.pair(&du);
            for i in 0..STRAINS {
                de[i] = extra[i].fma(L::splat(weights.stiffness * loads.damping), de[i]);
            }
        }
        let mut f = frame.gradient(&stress(&kind.stiffness, &de), kind.half);
        if weights.geometric {
            let geometric = du.gradient(&s, kind.half);
            for c in 0..COORDS {
                f[c] += geometric[c];
            }
        }
        if weights.pressure && loads.pressure != 0.0 {
            add_pressure(&mut f, &du, &frame, -loads.pressure * weights.stiffness);
            add_pressure(&mut f, &frame, &du, -loads.pressure * weights.stiffness);
        }
        for r in 0..COORDS {
            let mut lanes = [0.0; WIDTH];
            f[r].store(&mut lanes);
            out[r][block * WIDTH..block * WIDTH + WIDTH].copy_from_slice(&lanes);
        }
    }
    if weights.mass != 0.0 {
        for i in 0..8 {
            for j in 0..8 {
                for c in 0..3 {
                    out[3 * i + c][3 * j + c] += weights.mass * kind.mass[i][j];
                }
            }
        }
    }
    out
}

/// [`tangent`] on the machine's instruction path.
pub fn dispatched_tangent(
    kind: &ElementType,
    loads: &Loads,
    q: &[f64; COORDS],
    v: Option<&[f64; COORDS]>,
    weights: &TangentWeights,
) -> [[f64; COORDS]; COORDS] {
    struct One<'a>(&'a ElementType, &'a Loads, &'a [f64; COORDS], Option<&'a [f64; COORDS]>, &'a TangentWeights);
    impl terramech_simd::Kernel for One<'_> {
        type Output = [[f64; COORDS]; COORDS];
        #[inline(always)]
        fn run<L: Lane>(self) -> Self::Output {
            tangent::<L>(self.0, self.1, self.2, self.3, self.4)
        }
    }
    terramech_simd::dispatch(terramech_simd::active(), One(kind, loads, q, v, weights))
}
