//! Four reals: AVX2 and FMA.

use super::reals::Reals;
use std::arch::x86_64::*;

/// A register of four.
#[derive(Clone, Copy)]
pub struct Four(__m256d);

// SAFETY of all methods: see the trait; addresses given to load4 and store4 point to four reals each.
#[allow(clippy::undocumented_unsafe_blocks)]
impl Reals for Four {
    const N: usize = 4;
    type Mask = __m256d;

    #[inline(always)]
    unsafe fn splat(x: f64) -> Self {
        unsafe { Self(_mm256_set1_pd(x)) }
    }
    #[inline(always)]
    unsafe fn add(self, b: Self) -> Self {
        unsafe { Self(_mm256_add_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn sub(self, b: Self) -> Self {
        unsafe { Self(_mm256_sub_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn mul(self, b: Self) -> Self {
        unsafe { Self(_mm256_mul_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn div(self, b: Self) -> Self {
        unsafe { Self(_mm256_div_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn sqrt(self) -> Self {
        unsafe { Self(_mm256_sqrt_pd(self.0)) }
    }
    #[inline(always)]
    unsafe fn min(self, b: Self) -> Self {
        unsafe { Self(_mm256_min_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn max(self, b: Self) -> Self {
        unsafe { Self(_mm256_max_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn fma(self, b: Self, c: Self) -> Self {
        unsafe { Self(_mm256_fmadd_pd(self.0, b.0, c.0)) }
    }
    #[inline(always)]
    unsafe fn fnma(self, b: Self, c: Self) -> Self {
        unsafe { Self(_mm256_fnmadd_pd(self.0, b.0, c.0)) }
    }
    #[inline(always)]
    unsafe fn lt(self, b: Self) -> __m256d {
        unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, b.0) }
    }
    #[inline(always)]
    unsafe fn select(mask: __m256d, a: Self, b: Self) -> Self {
        unsafe { Self(_mm256_blendv_pd(b.0, a.0, mask)) }
    }
    #[inline(always)]
    unsafe fn bits(mask: __m256d) -> u32 {
        unsafe { _mm256_movemask_pd(mask) as u32 }
    }
    #[inline(always)]
    unsafe fn first(count: usize) -> __m256d {
        unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(_mm256_set_pd(3.0, 2.0, 1.0, 0.0), _mm256_set1_pd(count as f64)) }
    }
    #[inline(always)]
    unsafe fn both(a: __m256d, b: __m256d) -> __m256d {
        unsafe { _mm256_and_pd(a, b) }
    }
    #[inline(always)]
    unsafe fn load4(at: &[*const f64]) -> [Self; 4] {
        unsafe {
            let [a, b, c, d] = transpose([
                _mm256_loadu_pd(at[0]),
                _mm256_loadu_pd(at[1]),
                _mm256_loadu_pd(at[2]),
                _mm256_loadu_pd(at[3]),
            ]);
            [Self(a), Self(b), Self(c), Self(d)]
        }
    }
    #[inline(always)]
    unsafe fn add4(rows: [Self; 4], at: &[*mut f64]) {
        unsafe {
            let out = transpose([rows[0].0, rows[1].0, rows[2].0, rows[3].0]);
            for l in 0..4 {
                _mm256_storeu_pd(at[l], _mm256_add_pd(_mm256_loadu_pd(at[l]), out[l]));
            }
        }
    }
    #[inline(always)]
    unsafe fn store4(rows: [Self; 4], at: &[*mut f64]) {
        unsafe {
            let out = transpose([rows[0].0, rows[1].0, rows[2].0, rows[3].0]);
            for l in 0..4 {
                _mm256_storeu_pd(at[l], out[l]);
            }
        }
    }
}

#[inline(always)]
unsafe fn transpose(r: [__m256d; 4]) -> [__m256d; 4] {
    // SAFETY: shuffles of registers; AVX2 is there, see the trait.
    unsafe {
        let (a, b) = (_mm256_unpacklo_pd(r[0], r[1]), _mm256_unpackhi_pd(r[0], r[1]));
        let (c, d) = (_mm256_unpacklo_pd(r[2], r[3]), _mm256_unpackhi_pd(r[2], r[3]));
        [
            _mm256_permute2f128_pd::<0x20>(a, c),
            _mm256_permute2f128_pd::<0x20>(b, d),
            _mm256_permute2f128_pd::<0x31>(a, c),
            _mm256_permute2f128_pd::<0x31>(b, d),
        ]
    }
}
