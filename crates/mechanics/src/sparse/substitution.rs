//! Forward and backward substitution with a supernodal L D L' factor.
//!
//! One right-hand side is bound by the memory the factor is streamed from; a general solver's per-block overhead is as large again. Here each
//! supernode's columns are read once, four at a time going forward.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use std::ops::{Add, Div, Mul, Sub};

/// f32 or f64.
pub(super) trait Real:
    Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
}
impl Real for f32 {}
impl Real for f64 {}

/// Partial sums of a dot product: fixed, so that the result does not depend on the compiler's choice of vectors.
const LANES: usize = 16;

#[inline]
fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    let mut sums = [T::default(); LANES];
    let (a_chunks, b_chunks) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let mut rest = T::default();
    for (x, y) in a_chunks.remainder().iter().zip(b_chunks.remainder()) {
        rest = rest + *x * *y;
    }
    for (x, y) in a_chunks.zip(b_chunks) {
        for k in 0..LANES {
            sums[k] = sums[k] + x[k] * y[k];
        }
    }
    sums.into_iter().fold(rest, |s, x| s + x)
}

/// Solves `L D L' x = x` in place, in elimination order. `work` holds at least as many numbers as there are rows.
pub(super) fn solve<T: Real>(symbolic: &SymbolicSupernodalCholesky<usize>, values: &[T], x: &mut [T], work: &mut [T]) {
    let block = |s: usize| {
        let (begin, end) = (symbolic.supernode_begin()[s], symbolic.supernode_end()[s]);
        let rows = &symbolic.row_idx()[symbolic.col_ptr_for_row_idx()[s]..][..symbolic.nnz_per_super()[s]];
        let height = end - begin + rows.len();
        (begin, end - begin, rows, height, &values[symbolic.col_ptr_for_val()[s]..][..height * (end - begin)])
    };
    for s in 0..symbolic.n_supernodes() {
        let (begin, width, rows, height, l) = block(s);
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
        let column = |j: usize| &l[j * height + width..(j + 1) * height];
        while j + 4 <= width {
            let (a, b, c, d) = (own[j], own[j + 1], own[j + 2], own[j + 3]);
            let (la, lb, lc, ld) = (column(j), column(j + 1), column(j + 2), column(j + 3));
            for ((((t, a0), b0), c0), d0) in sums.iter_mut().zip(la).zip(lb).zip(lc).zip(ld) {
                *t = *t + (*a0 * a + *b0 * b) + (*c0 * c + *d0 * d);
            }
            j += 4;
        }
        while j < width {
            let a = own[j];
            sums.iter_mut().zip(column(j)).for_each(|(t, l)| *t = *t + *l * a);
            j += 1;
        }
        for (row, t) in rows.iter().zip(sums.iter()) {
            x[*row] = x[*row] - *t;
        }
    }
    for s in (0..symbolic.n_supernodes()).rev() {
        let (begin, width, rows, height, l) = block(s);
        let below = &mut work[..rows.len()];
        below.iter_mut().zip(rows).for_each(|(t, row)| *t = x[*row]);
        let own = &mut x[begin..begin + width];
        for j in (0..width).rev() {
            let column = &l[j * height..(j + 1) * height];
            let mut value = own[j] / column[j] - dot(&column[width..], below);
            for i in j + 1..width {
                value = value - column[i] * own[i];
            }
            own[j] = value;
        }
    }
}
