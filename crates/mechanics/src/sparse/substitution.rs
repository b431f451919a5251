//! Forward and backward substitution with a supernodal L D L' factor.
//!
//! One right-hand side is bound by the memory the factor is streamed from; a general solver's per-block overhead is as large again. Here each
//! supernode's columns are read once, four at a time going forward.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use std::ops::{Add, Div, Mul, Sub};
use terramech_simd::{Kernel, Lanes, active, dispatch};

/// f32 or f64.
pub(super) trait Real:
    Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
}
impl Real for f32 {}
impl Real for f64 {}

/// Partial sums of a dot product: fixed, so that the result does not depend on the compiler's choice of vectors.
const LANES: usize = 8;

/// Scalar products of four columns with one vector: together, so that additions do not wait for each other.
#[inline(always)]
fn four_dots<T: Real>(a: &[T], b: &[T], c: &[T], d: &[T], y: &[T]) -> [T; 4] {
    let (mut sa, mut sb, mut sc, mut sd) =
        ([T::default(); LANES], [T::default(); LANES], [T::default(); LANES], [T::default(); LANES]);
    let (mut ia, mut ib, mut ic, mut id, mut iy) = (
        a.chunks_exact(LANES),
        b.chunks_exact(LANES),
        c.chunks_exact(LANES),
        d.chunks_exact(LANES),
        y.chunks_exact(LANES),
    );
    while let (Some(a), Some(b), Some(c), Some(d), Some(y)) = (ia.next(), ib.next(), ic.next(), id.next(), iy.next()) {
        for k in 0..LANES {
            sa[k] = sa[k] + a[k] * y[k];
        }
        for k in 0..LANES {
            sb[k] = sb[k] + b[k] * y[k];
        }
        for k in 0..LANES {
            sc[k] = sc[k] + c[k] * y[k];
        }
        for k in 0..LANES {
            sd[k] = sd[k] + d[k] * y[k];
        }
    }
    let rest = iy.remainder();
    [
        total(&sa, ia.remainder(), rest),
        total(&sb, ib.remainder(), rest),
        total(&sc, ic.remainder(), rest),
        total(&sd, id.remainder(), rest),
    ]
}

#[inline(always)]
fn dot<T: Real>(a: &[T], y: &[T]) -> T {
    let mut sums = [T::default(); LANES];
    let (mut ia, mut iy) = (a.chunks_exact(LANES), y.chunks_exact(LANES));
    while let (Some(a), Some(y)) = (ia.next(), iy.next()) {
        for k in 0..LANES {
            sums[k] = sums[k] + a[k] * y[k];
        }
    }
    total(&sums, ia.remainder(), iy.remainder())
}

/// Partial sums and the products of what is left, added in a fixed order.
#[inline(always)]
fn total<T: Real>(sums: &[T; LANES], a: &[T], y: &[T]) -> T {
    let mut sum = T::default();
    for k in 0..LANES {
        sum = sum + sums[k];
    }
    for k in 0..a.len().min(y.len()) {
        sum = sum + a[k] * y[k];
    }
    sum
}

/// Solves `L D L' x = x` in place, in elimination order. `work` holds at least as many numbers as there are rows.
pub(super) fn solve<T: Real>(symbolic: &SymbolicSupernodalCholesky<usize>, values: &[T], x: &mut [T], work: &mut [T]) {
    dispatch(active(), Substitution { symbolic, values, x, work });
}

/// The loops, compiled for each instruction path: plain Rust that the compiler widens.
struct Substitution<'a, T> {
    symbolic: &'a SymbolicSupernodalCholesky<usize>,
    values: &'a [T],
    x: &'a mut [T],
    work: &'a mut [T],
}

impl<T: Real> Kernel for Substitution<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { symbolic, values, x, work } = self;
        forward(symbolic, values, x, work);
        backward(symbolic, values, x, work);
    }
}

/// A supernode: first row, columns, rows below, and its columns one after the other, each `height` long.
struct Block<'a, T> {
    begin: usize,
    width: usize,
    rows: &'a [usize],
    height: usize,
    l: &'a [T],
}

#[inline(always)]
fn block<'a, T>(symbolic: &'a SymbolicSupernodalCholesky<usize>, values: &'a [T], s: usize) -> Block<'a, T> {
    let (begin, end) = (symbolic.supernode_begin()[s], symbolic.supernode_end()[s]);
    let rows = &symbolic.row_idx()[symbolic.col_ptr_for_row_idx()[s]..][..symbolic.nnz_per_super()[s]];
    let (width, height) = (end - begin, end - begin + rows.len());
    Block { begin, width, rows, height, l: &values[symbolic.col_ptr_for_val()[s]..][..height * width] }
}

#[inline(always)]
fn forward<T: Real>(symbolic: &SymbolicSupernodalCholesky<usize>, values: &[T], x: &mut [T], work: &mut [T]) {
    for s in 0..symbolic.n_supernodes() {
        let Block { begin, width, rows, height, l } = block(symbolic, values, s);
        let own = &mut x[begin..begin + width];
        for j in 0..width {
            let xj = own[j];
            let column = &l[j * height..j * height + width];
            for i in j + 1..width {
                own[i] = own[i] - column[i] * xj;
            }
        }
        let sums = &mut work[..rows.len()];
        sums.fill(T::default());
        let mut j = 0;
        while j + 4 <= width {
            let n = sums.len();
            let (a, b, c, d) = (own[j], own[j + 1], own[j + 2], own[j + 3]);
            let la = &l[j * height + width..][..n];
            let lb = &l[(j + 1) * height + width..][..n];
            let lc = &l[(j + 2) * height + width..][..n];
            let ld = &l[(j + 3) * height + width..][..n];
            for i in 0..n {
                sums[i] = sums[i] + ((la[i] * a + lb[i] * b) + (lc[i] * c + ld[i] * d));
            }
            j += 4;
        }
        while j < width {
            let a = own[j];
            let column = &l[j * height + width..(j + 1) * height];
            for i in 0..sums.len() {
                sums[i] = sums[i] + column[i] * a;
            }
            j += 1;
        }
        for i in 0..rows.len() {
            x[rows[i]] = x[rows[i]] - sums[i];
        }
    }
}

#[inline(always)]
fn backward<T: Real>(symbolic: &SymbolicSupernodalCholesky<usize>, values: &[T], x: &mut [T], work: &mut [T]) {
    for s in (0..symbolic.n_supernodes()).rev() {
        let Block { begin, width, rows, height, l } = block(symbolic, values, s);
        let below = &mut work[..rows.len()];
        for i in 0..rows.len() {
            below[i] = x[rows[i]];
        }
        let own = &mut x[begin..begin + width];
        let column = |j: usize| &l[j * height + width..(j + 1) * height];
        for j in 0..width {
            own[j] = own[j] / l[j * height + j];
        }
        let mut j = 0;
        while j + 4 <= width {
            let d = four_dots(column(j), column(j + 1), column(j + 2), column(j + 3), below);
            for k in 0..4 {
                own[j + k] = own[j + k] - d[k];
            }
            j += 4;
        }
        while j < width {
            own[j] = own[j] - dot(column(j), below);
            j += 1;
        }
        for j in (0..width).rev() {
            let column = &l[j * height..j * height + width];
            let mut value = own[j];
            for i in j + 1..width {
                value = value - column[i] * own[i];
            }
            own[j] = value;
        }
    }
}
