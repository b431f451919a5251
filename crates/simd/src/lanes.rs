//! Eight reals at once, for kernels written once for every instruction path.

use crate::tiles::{self, Pack, Tile};
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// Reals a pack carries.
pub const WIDTH: usize = 8;

/// The number type of a kernel: one f64, or eight lanes of a path. The vector types have no public name: only
/// [`dispatch`](crate::dispatch) hands them to a kernel, after it has seen that the machine has their instructions.
pub trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + Neg<Output = Self>
    + AddAssign
{
    /// All lanes set to `x`.
    fn splat(x: f64) -> Self;
    /// `self * b + c`; fused on paths that have the instruction.
    fn fma(self, b: Self, c: Self) -> Self;
    /// From eight numbers (a single f64 takes the first).
    fn load(x: &[f64; WIDTH]) -> Self;
    /// To eight numbers (a single f64 fills all).
    fn store(self, to: &mut [f64; WIDTH]);
    /// `self / o`.
    fn over(self, o: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// The greater one of each lane; `o` where either is not a number.
    fn max(self, o: Self) -> Self;
    /// `self` where `a > b`, else 0.
    fn where_more(self, a: Self, b: Self) -> Self;
    /// Eight rows as eight columns: lane k of column c is `rows[k][c]` (a single f64 takes the first row).
    #[inline(always)]
    fn columns(rows: [&[f64; WIDTH]; WIDTH]) -> [Self; WIDTH] {
        let mut out = [Self::splat(0.0); WIDTH];
        for c in 0..WIDTH {
            let mut column = [0.0; WIDTH];
            for k in 0..WIDTH {
                column[k] = rows[k][c];
            }
            out[c] = Self::load(&column);
        }
        out
    }
    /// Eight columns as eight rows: the way back.
    #[inline(always)]
    fn rows(columns: [Self; WIDTH]) -> [[f64; WIDTH]; WIDTH] {
        let mut out = [[0.0; WIDTH]; WIDTH];
        for c in 0..WIDTH {
            let mut column = [0.0; WIDTH];
            columns[c].store(&mut column);
            for k in 0..WIDTH {
                out[k][c] = column[k];
            }
        }
        out
    }
    /// `y += tiles x` in f32, one tile a pack.
    #[inline(always)]
    fn tile_add(tiles: &[Tile], x: &[f32; 6], y: &mut [Pack]) {
        tiles::add(tiles, x, y);
    }
    /// Scalar products in f32 of the tiles' columns with `y`; the last tile is read first.
    #[inline(always)]
    fn tile_dots(tiles: &[Tile], y: &[Pack]) -> [f32; 6] {
        tiles::dots(tiles, y)
    }
}

impl Lanes for f64 {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        self * b + c
    }
    #[inline(always)]
    fn load(x: &[f64; WIDTH]) -> Self {
        x[0]
    }
    #[inline(always)]
    fn store(self, to: &mut [f64; WIDTH]) {
        *to = [self; WIDTH];
    }
    #[inline(always)]
    fn over(self, o: Self) -> Self {
        self / o
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        if self > o { self } else { o }
    }
    #[inline(always)]
    fn where_more(self, a: Self, b: Self) -> Self {
        if a > b { self } else { 0.0 }
    }
}

/// Operators by one intrinsic (or expression) per register; `$n` registers make eight lanes.
macro_rules! vector {
    ($name:ident, $register:ty, $n:expr, $per:expr, $add:expr, $sub:expr, $mul:expr, $neg:expr, $fma:expr, $splat:expr, $load:expr, $store:expr, $div:expr, $sqrt:expr, $max:expr, $where_more:expr, $tiles:path $(, $columns:path, $rows:path)?) => {
        #[derive(Clone, Copy)]
        pub struct $name([$register; $n]);

        impl Add for $name {
            type Output = Self;
            #[inline(always)]
            fn add(mut self, o: Self) -> Self {
                for k in 0..$n {
                    self.0[k] = $add(self.0[k], o.0[k]);
                }
                self
            }
        }
        impl Sub for $name {
            type Output = Self;
            #[inline(always)]
            fn sub(mut self, o: Self) -> Self {
                for k in 0..$n {
                    self.0[k] = $sub(self.0[k], o.0[k]);
                }
                self
            }
        }
        impl Mul for $name {
            type Output = Self;
            #[inline(always)]
            fn mul(mut self, o: Self) -> Self {
                for k in 0..$n {
                    self.0[k] = $mul(self.0[k], o.0[k]);
                }
                self
            }
        }
        impl Mul<f64> for $name {
            type Output = Self;
            #[inline(always)]
            fn mul(self, o: f64) -> Self {
                self * Self::splat(o)
            }
        }
        impl Neg for $name {
            type Output = Self;
            #[inline(always)]
            fn neg(mut self) -> Self {
                for k in 0..$n {
                    self.0[k] = $neg(self.0[k]);
                }
                self
            }
        }
        impl AddAssign for $name {
            #[inline(always)]
            fn add_assign(&mut self, o: Self) {
                *self = *self + o;
            }
        }
        impl Lanes for $name {
            #[inline(always)]
            fn splat(x: f64) -> Self {
                Self([$splat(x); $n])
            }
            #[inline(always)]
            fn fma(mut self, b: Self, c: Self) -> Self {
                for k in 0..$n {
                    self.0[k] = $fma(self.0[k], b.0[k], c.0[k]);
                }
                self
            }
            #[inline(always)]
            fn load(x: &[f64; WIDTH]) -> Self {
                let mut out = Self::splat(0.0);
                for k in 0..$n {
                    out.0[k] = $load(x, $per * k);
                }
                out
            }
            #[inline(always)]
            fn store(self, to: &mut [f64; WIDTH]) {
                for k in 0..$n {
                    $store(to, $per * k, self.0[k]);
                }
            }
            #[inline(always)]
            fn over(mut self, o: Self) -> Self {
                for k in 0..$n {
                    self.0[k] = $div(self.0[k], o.0[k]);
                }
                self
            }
            #[inline(always)]
            fn sqrt(mut self) -> Self {
                for k in 0..$n {
                    self.0[k] = $sqrt(self.0[k]);
                }
                self
            }
            #[inline(always)]
            fn max(mut self, o: Self) -> Self {
                for k in 0..$n {
                    self.0[k] = $max(self.0[k], o.0[k]);
                }
                self
            }
            #[inline(always)]
            fn where_more(mut self, a: Self, b: Self) -> Self {
                for k in 0..$n {
                    self.0[k] = $where_more(self.0[k], a.0[k], b.0[k]);
                }
                self
            }
            $(#[inline(always)]
            fn columns(rows: [&[f64; WIDTH]; WIDTH]) -> [Self; WIDTH] {
                let from = $columns(rows);
                let mut out = [Self::splat(0.0); WIDTH];
                for c in 0..WIDTH {
                    out[c] = Self(from[c]);
                }
                out
            }
            #[inline(always)]
            fn rows(columns: [Self; WIDTH]) -> [[f64; WIDTH]; WIDTH] {
                let mut from = [columns[0].0; WIDTH];
                for c in 0..WIDTH {
                    from[c] = columns[c].0;
                }
                $rows(from)
            })?
            #[inline(always)]
            fn tile_add(tiles: &[Tile], x: &[f32; 6], y: &mut [Pack]) {
                use $tiles as room;
                room::add(tiles, x, y);
            }
            #[inline(always)]
            fn tile_dots(tiles: &[Tile], y: &[Pack]) -> [f32; 6] {
                use $tiles as room;
                room::dots(tiles, y)
            }
        }
    };
}

pub(crate) mod portable {
    use super::*;
    vector!(
        Portable8,
        f64,
        8,
        1,
        |a: f64, b: f64| a + b,
        |a: f64, b: f64| a - b,
        |a: f64, b: f64| a * b,
        |a: f64| -a,
        |a: f64, b: f64, c: f64| a * b + c,
        |x: f64| x,
        |x: &[f64; WIDTH], k: usize| x[k],
        |to: &mut [f64; WIDTH], k: usize, v: f64| to[k] = v,
        |a: f64, b: f64| a / b,
        |a: f64| a.sqrt(),
        |a: f64, b: f64| if a > b { a } else { b },
        |x: f64, a: f64, b: f64| if a > b { x } else { 0.0 },
        crate::tiles
    );
}

// Functions rather than closures: a closure inside a target-feature function does not inherit its features for certain.
#[cfg(target_arch = "x86_64")]
macro_rules! wrap {
    ($($name:ident($($a:ident: $t:ty),*) -> $r:ty = $body:expr;)*) => {
        $(#[inline(always)]
        fn $name($($a: $t),*) -> $r {
            // SAFETY: types of this module reach only kernels that `dispatch` runs after it has detected the features; offsets
            // of loads and stores stay inside the array of eight.
            unsafe { $body }
        })*
    };
}

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2 {
    use super::*;
    use std::arch::x86_64::*;
    wrap! {
        add(a: __m256d, b: __m256d) -> __m256d = _mm256_add_pd(a, b);
        sub(a: __m256d, b: __m256d) -> __m256d = _mm256_sub_pd(a, b);
        mul(a: __m256d, b: __m256d) -> __m256d = _mm256_mul_pd(a, b);
        neg(a: __m256d) -> __m256d = _mm256_xor_pd(a, _mm256_set1_pd(-0.0));
        fma(a: __m256d, b: __m256d, c: __m256d) -> __m256d = _mm256_fmadd_pd(a, b, c);
        splat(x: f64) -> __m256d = _mm256_set1_pd(x);
        load(x: &[f64; WIDTH], k: usize) -> __m256d = _mm256_loadu_pd(x[k..k + 4].as_ptr());
        store(to: &mut [f64; WIDTH], k: usize, v: __m256d) -> () = _mm256_storeu_pd(to[k..k + 4].as_mut_ptr(), v);
        div(a: __m256d, b: __m256d) -> __m256d = _mm256_div_pd(a, b);
        sqrt(a: __m256d) -> __m256d = _mm256_sqrt_pd(a);
        max(a: __m256d, b: __m256d) -> __m256d = _mm256_max_pd(a, b);
        where_more(x: __m256d, a: __m256d, b: __m256d) -> __m256d = _mm256_and_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(a, b), x);
        low(a: __m256d, b: __m256d) -> __m256d = _mm256_unpacklo_pd(a, b);
        high(a: __m256d, b: __m256d) -> __m256d = _mm256_unpackhi_pd(a, b);
        first(a: __m256d, b: __m256d) -> __m256d = _mm256_permute2f128_pd::<0x20>(a, b);
        second(a: __m256d, b: __m256d) -> __m256d = _mm256_permute2f128_pd::<0x31>(a, b);
    }

    /// Four by four, transposed.
    #[inline(always)]
    fn turn(r: [__m256d; 4]) -> [__m256d; 4] {
        let (a, b, c, d) = (low(r[0], r[1]), high(r[0], r[1]), low(r[2], r[3]), high(r[2], r[3]));
        [first(a, c), first(b, d), second(a, c), second(b, d)]
    }

    /// See [`Lanes::columns`].
    #[inline(always)]
    pub(super) fn columns(rows: [&[f64; WIDTH]; WIDTH]) -> [[__m256d; 2]; WIDTH] {
        let mut out = [[splat(0.0); 2]; WIDTH];
        for q in 0..2 {
            for h in 0..2 {
                let mut r = [splat(0.0); 4];
                for i in 0..4 {
                    r[i] = load(rows[4 * q + i], 4 * h);
                }
                let t = turn(r);
                for i in 0..4 {
                    out[4 * h + i][q] = t[i];
                }
            }
        }
        out
    }

    /// See [`Lanes::rows`].
    #[inline(always)]
    pub(super) fn rows(columns: [[__m256d; 2]; WIDTH]) -> [[f64; WIDTH]; WIDTH] {
        let mut out = [[0.0; WIDTH]; WIDTH];
        for q in 0..2 {
            for h in 0..2 {
                let mut r = [splat(0.0); 4];
                for i in 0..4 {
                    r[i] = columns[4 * h + i][q];
                }
                let t = turn(r);
                for i in 0..4 {
                    store(&mut out[4 * q + i], 4 * h, t[i]);
                }
            }
        }
        out
    }

    vector!(
        Avx2x8,
        __m256d,
        2,
        4,
        add,
        sub,
        mul,
        neg,
        fma,
        splat,
        load,
        store,
        div,
        sqrt,
        max,
        where_more,
        crate::tiles::avx2,
        columns,
        rows
    );
}

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx512 {
    use super::*;
    use std::arch::x86_64::*;
    wrap! {
        add(a: __m512d, b: __m512d) -> __m512d = _mm512_add_pd(a, b);
        sub(a: __m512d, b: __m512d) -> __m512d = _mm512_sub_pd(a, b);
        mul(a: __m512d, b: __m512d) -> __m512d = _mm512_mul_pd(a, b);
        neg(a: __m512d) -> __m512d = _mm512_sub_pd(_mm512_set1_pd(-0.0), a);
        fma(a: __m512d, b: __m512d, c: __m512d) -> __m512d = _mm512_fmadd_pd(a, b, c);
        splat(x: f64) -> __m512d = _mm512_set1_pd(x);
        load(x: &[f64; WIDTH], _k: usize) -> __m512d = _mm512_loadu_pd(x.as_ptr());
        store(to: &mut [f64; WIDTH], _k: usize, v: __m512d) -> () = _mm512_storeu_pd(to.as_mut_ptr(), v);
        div(a: __m512d, b: __m512d) -> __m512d = _mm512_div_pd(a, b);
        sqrt(a: __m512d) -> __m512d = _mm512_sqrt_pd(a);
        max(a: __m512d, b: __m512d) -> __m512d = _mm512_max_pd(a, b);
        where_more(x: __m512d, a: __m512d, b: __m512d) -> __m512d =
            _mm512_maskz_mov_pd(_mm512_cmp_pd_mask::<_CMP_GT_OQ>(a, b), x);
        pair(a: __m256d, b: __m256d) -> __m512d = _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(a), b);
        lower(a: __m512d) -> __m256d = _mm512_castpd512_pd256(a);
        upper(a: __m512d) -> __m256d = _mm512_extractf64x4_pd::<1>(a);
    }

    /// See [`Lanes::columns`].
    #[inline(always)]
    fn columns(rows: [&[f64; WIDTH]; WIDTH]) -> [[__m512d; 1]; WIDTH] {
        let halves = super::avx2::columns(rows);
        let mut out = [[splat(0.0)]; WIDTH];
        for c in 0..WIDTH {
            out[c] = [pair(halves[c][0], halves[c][1])];
        }
        out
    }

    /// See [`Lanes::rows`].
    #[inline(always)]
    fn rows(columns: [[__m512d; 1]; WIDTH]) -> [[f64; WIDTH]; WIDTH] {
        let mut halves = [[lower(columns[0][0]); 2]; WIDTH];
        for c in 0..WIDTH {
            halves[c] = [lower(columns[c][0]), upper(columns[c][0])];
        }
        super::avx2::rows(halves)
    }

    vector!(
        Avx512x8,
        __m512d,
        1,
        8,
        add,
        sub,
        mul,
        neg,
        fma,
        splat,
        load,
        store,
        div,
        sqrt,
        max,
        where_more,
        crate::tiles::avx2,
        columns,
        rows
    );
}
