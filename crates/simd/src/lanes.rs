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
}

/// Operators by one intrinsic (or expression) per register; `$n` registers make eight lanes.
macro_rules! vector {
    ($name:ident, $register:ty, $n:expr, $per:expr, $add:expr, $sub:expr, $mul:expr, $neg:expr, $fma:expr, $splat:expr, $load:expr, $store:expr, $tiles:path) => {
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
    }
    vector!(Avx2x8, __m256d, 2, 4, add, sub, mul, neg, fma, splat, load, store, crate::tiles::avx2);
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
    }
    vector!(Avx512x8, __m512d, 1, 8, add, sub, mul, neg, fma, splat, load, store, crate::tiles::avx2);
}
