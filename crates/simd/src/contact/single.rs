//! Registers of x86-64 in single precision: four (SSE2) and eight reals (AVX2), as [`super::x86`] has them in double precision.
//!
//! Memory holds double precision: what is loaded is rounded, what is stored or added is widened. Differences of positions and
//! velocities, and what decides the overlap, are formed in double precision and then rounded.
#![allow(clippy::undocumented_unsafe_blocks)]

use super::reals::{Apart, Reals, apart, overlap_of_gap};
use super::x86::{Four, Put, Two, by_intrinsics, put, take4};
use std::arch::x86_64::*;

/// Four reals in single precision: the portable path.
#[derive(Clone, Copy)]
pub struct Four32(__m128);

/// Eight reals in single precision.
#[derive(Clone, Copy)]
pub struct Eight32(__m256);

macro_rules! register {
    ($name:ident, $wide:ty, $count:expr, $mask:ty, $splat:ident, $($op:ident: $do:ident,)* ; $sqrt:ident, $fma:ident, $fnma:ident, $lt:ident, $select:ident, $bits:ident, $both:ident) => {
        // SAFETY of all methods: as in `super::x86`.
        impl Reals for $name {
            const N: usize = $count;
            type Mask = $mask;

            #[inline(always)]
            unsafe fn splat(x: f64) -> Self {
                unsafe { Self($splat(x as f32)) }
            }
            by_intrinsics!($mask; $($op: $do,)* ; $fma, $fnma, $lt, $select, $bits, $both);
            #[inline(always)]
            unsafe fn sqrt(self) -> Self {
                unsafe { Self($sqrt(self.0)) }
            }
            #[inline(always)]
            unsafe fn load1(at: &[*const f64]) -> Self {
                const HALF: usize = $count / 2;
                unsafe { Self::join(<$wide>::load1(&at[..HALF]), <$wide>::load1(&at[HALF..])) }
            }
            #[inline(always)]
            unsafe fn difference(a: &[*const f64], b: &[*const f64]) -> [Self; 4] {
                const HALF: usize = $count / 2;
                unsafe {
                    let low = <$wide>::difference(&a[..HALF], &b[..HALF]);
                    let high = <$wide>::difference(&a[HALF..], &b[HALF..]);
                    [
                        Self::join(low[0], high[0]),
                        Self::join(low[1], high[1]),
                        Self::join(low[2], high[2]),
                        Self::join(low[3], high[3]),
                    ]
                }
            }
            #[inline(always)]
            unsafe fn apart(a: &[*const f64], b: &[*const f64]) -> Apart<Self> {
                const HALF: usize = $count / 2;
                unsafe {
                    let low = apart::<$wide>(&a[..HALF], &b[..HALF]);
                    let high = apart::<$wide>(&a[HALF..], &b[HALF..]);
                    Apart {
                        d: [
                            Self::join(low.d[0], high.d[0]),
                            Self::join(low.d[1], high.d[1]),
                            Self::join(low.d[2], high.d[2]),
                        ],
                        d2: Self::join(low.d2, high.d2),
                        reach: Self::join(low.reach, high.reach),
                        gap: Self::join(low.gap, high.gap),
                    }
                }
            }
            #[inline(always)]
            unsafe fn overlap(at: &Apart<Self>, distance: Self) -> Self {
                unsafe { overlap_of_gap(at, distance) }
            }
            #[inline(always)]
            unsafe fn add_both(a: [Self; 4], b: [Self; 4], on_a: &[*mut f64], on_b: &[*mut f64]) {
                unsafe {
                    let (a, b) = (Self::scatter(a), Self::scatter(b));
                    for l in 0..Self::N {
                        put(on_a[l], a[l], Put::Add);
                        put(on_b[l], b[l], Put::Add);
                    }
                }
            }
            #[inline(always)]
            unsafe fn store4(rows: [Self; 4], at: &[*mut f64]) {
                unsafe {
                    let out = Self::scatter(rows);
                    for l in 0..Self::N {
                        put(at[l], out[l], Put::Four);
                    }
                }
            }
            #[inline(always)]
            unsafe fn store3(rows: [Self; 3], at: &[*mut f64]) {
                unsafe {
                    let out = Self::scatter([rows[0], rows[1], rows[2], rows[2]]);
                    for l in 0..Self::N {
                        put(at[l], out[l], Put::Three);
                    }
                }
            }
        }
    };
}

register!(Four32, Two, 4, __m128, _mm_set1_ps,
    add: _mm_add_ps, sub: _mm_sub_ps, mul: _mm_mul_ps, div: _mm_div_ps, min: _mm_min_ps, max: _mm_max_ps, ;
    _mm_sqrt_ps, mul_add, mul_sub_from, _mm_cmplt_ps, blend, _mm_movemask_ps, _mm_and_ps);
register!(Eight32, Four, 8, __m256, _mm256_set1_ps,
    add: _mm256_add_ps, sub: _mm256_sub_ps, mul: _mm256_mul_ps, div: _mm256_div_ps, min: _mm256_min_ps, max: _mm256_max_ps, ;
    _mm256_sqrt_ps, _mm256_fmadd_ps, _mm256_fnmadd_ps, lt8, blend8, _mm256_movemask_ps, _mm256_and_ps);

#[inline(always)]
unsafe fn mul_add(a: __m128, b: __m128, c: __m128) -> __m128 {
    unsafe { _mm_add_ps(_mm_mul_ps(a, b), c) }
}
#[inline(always)]
unsafe fn mul_sub_from(a: __m128, b: __m128, c: __m128) -> __m128 {
    unsafe { _mm_sub_ps(c, _mm_mul_ps(a, b)) }
}
#[inline(always)]
unsafe fn blend(mask: __m128, a: __m128, b: __m128) -> __m128 {
    unsafe { _mm_or_ps(_mm_and_ps(mask, a), _mm_andnot_ps(mask, b)) }
}
#[inline(always)]
unsafe fn lt8(a: __m256, b: __m256) -> __m256 {
    unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(a, b) }
}
#[inline(always)]
unsafe fn blend8(mask: __m256, a: __m256, b: __m256) -> __m256 {
    unsafe { _mm256_blendv_ps(b, a, mask) }
}

/// A row of four, or of three and a zero, rounded.
#[inline(always)]
unsafe fn round(from: *const f64, three: bool) -> __m128 {
    unsafe {
        let last = if three { _mm_load_sd(from.add(2)) } else { _mm_loadu_pd(from.add(2)) };
        _mm_movelh_ps(_mm_cvtpd_ps(_mm_loadu_pd(from)), _mm_cvtpd_ps(last))
    }
}

/// A row of four, widened.
#[inline(always)]
unsafe fn wide(r: __m128) -> [__m128d; 2] {
    unsafe { [_mm_cvtps_pd(r), _mm_cvtps_pd(_mm_movehl_ps(r, r))] }
}

impl Four32 {
    #[inline(always)]
    unsafe fn join(low: Two, high: Two) -> Self {
        unsafe { Self(_mm_movelh_ps(_mm_cvtpd_ps(low.0), _mm_cvtpd_ps(high.0))) }
    }
    #[inline(always)]
    unsafe fn gather(at: &[*const f64], three: bool) -> [Self; 4] {
        unsafe {
            let rows = [round(at[0], three), round(at[1], three), round(at[2], three), round(at[3], three)];
            let [a, b, c, d] = Self::transpose(rows);
            [Self(a), Self(b), Self(c), Self(d)]
        }
    }
    #[inline(always)]
    unsafe fn scatter(rows: [Self; 4]) -> [[__m128d; 2]; 4] {
        unsafe {
            let [a, b, c, d] = Self::transpose([rows[0].0, rows[1].0, rows[2].0, rows[3].0]);
            [wide(a), wide(b), wide(c), wide(d)]
        }
    }
    #[inline(always)]
    unsafe fn transpose(r: [__m128; 4]) -> [__m128; 4] {
        unsafe {
            let (a, b) = (_mm_unpacklo_ps(r[0], r[1]), _mm_unpacklo_ps(r[2], r[3]));
            let (c, d) = (_mm_unpackhi_ps(r[0], r[1]), _mm_unpackhi_ps(r[2], r[3]));
            [_mm_movelh_ps(a, b), _mm_movehl_ps(b, a), _mm_movelh_ps(c, d), _mm_movehl_ps(d, c)]
        }
    }
}

impl Eight32 {
    #[inline(always)]
    unsafe fn join(low: Four, high: Four) -> Self {
        unsafe { Self(_mm256_set_m128(_mm256_cvtpd_ps(high.0), _mm256_cvtpd_ps(low.0))) }
    }
    #[inline(always)]
    unsafe fn gather(at: &[*const f64], three: bool) -> [Self; 4] {
        unsafe {
            // Rows l and l + 4 share a register: its halves are then transposed like four rows of four.
            let mut rows = [_mm256_setzero_ps(); 4];
            for l in 0..4 {
                let (low, high) = (take4(at[l], three), take4(at[l + 4], three));
                rows[l] = _mm256_set_m128(_mm256_cvtpd_ps(high), _mm256_cvtpd_ps(low));
            }
            let [a, b, c, d] = Self::transpose(rows);
            [Self(a), Self(b), Self(c), Self(d)]
        }
    }
    #[inline(always)]
    unsafe fn scatter(rows: [Self; 4]) -> [__m256d; 8] {
        unsafe {
            let out = Self::transpose([rows[0].0, rows[1].0, rows[2].0, rows[3].0]);
            let mut wide = [_mm256_setzero_pd(); 8];
            for l in 0..4 {
                wide[l] = _mm256_cvtps_pd(_mm256_castps256_ps128(out[l]));
                wide[l + 4] = _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(out[l]));
            }
            wide
        }
    }
    #[inline(always)]
    unsafe fn transpose(r: [__m256; 4]) -> [__m256; 4] {
        unsafe {
            let (a, b) = (_mm256_unpacklo_ps(r[0], r[1]), _mm256_unpacklo_ps(r[2], r[3]));
            let (c, d) = (_mm256_unpackhi_ps(r[0], r[1]), _mm256_unpackhi_ps(r[2], r[3]));
            [
                _mm256_shuffle_ps::<0x44>(a, b),
                _mm256_shuffle_ps::<0xee>(a, b),
                _mm256_shuffle_ps::<0x44>(c, d),
                _mm256_shuffle_ps::<0xee>(c, d),
            ]
        }
    }
}
