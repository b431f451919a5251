//! Eight reals: AVX-512 F. The kernel around it is the one that [`super::avx2`] runs too.

use super::reals::Reals;
use std::arch::x86_64::*;

/// A register of eight.
#[derive(Clone, Copy)]
pub struct Eight(__m512d);

// SAFETY of all methods: see the trait; addresses given to load4 and store4 point to four reals each.
#[allow(clippy::undocumented_unsafe_blocks)]
impl Reals for Eight {
    const N: usize = 8;
    type Mask = __mmask8;

    #[inline(always)]
    unsafe fn splat(x: f64) -> Self {
        unsafe { Self(_mm512_set1_pd(x)) }
    }
    #[inline(always)]
    unsafe fn add(self, b: Self) -> Self {
        unsafe { Self(_mm512_add_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn sub(self, b: Self) -> Self {
        unsafe { Self(_mm512_sub_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn mul(self, b: Self) -> Self {
        unsafe { Self(_mm512_mul_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn div(self, b: Self) -> Self {
        unsafe { Self(_mm512_div_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn sqrt(self) -> Self {
        unsafe { Self(_mm512_sqrt_pd(self.0)) }
    }
    #[inline(always)]
    unsafe fn min(self, b: Self) -> Self {
        unsafe { Self(_mm512_min_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn max(self, b: Self) -> Self {
        unsafe { Self(_mm512_max_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn fma(self, b: Self, c: Self) -> Self {
        unsafe { Self(_mm512_fmadd_pd(self.0, b.0, c.0)) }
    }
    #[inline(always)]
    unsafe fn fnma(self, b: Self, c: Self) -> Self {
        unsafe { Self(_mm512_fnmadd_pd(self.0, b.0, c.0)) }
    }
    #[inline(always)]
    unsafe fn lt(self, b: Self) -> __mmask8 {
        unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, b.0) }
    }
    #[inline(always)]
    unsafe fn select(mask: __mmask8, a: Self, b: Self) -> Self {
        unsafe { Self(_mm512_mask_blend_pd(mask, b.0, a.0)) }
    }
    #[inline(always)]
    unsafe fn bits(mask: __mmask8) -> u32 {
        u32::from(mask)
    }
    #[inline(always)]
    unsafe fn first(count: usize) -> __mmask8 {
        ((1_u32 << count) - 1) as u8
    }
    #[inline(always)]
    unsafe fn both(a: __mmask8, b: __mmask8) -> __mmask8 {
        a & b
    }
    #[inline(always)]
    unsafe fn load4(at: &[*const f64]) -> [Self; 4] {
        unsafe {
            // Rows l and l + 4 share a register: its halves are then transposed like four rows of four.
            let [a, b, c, d] = transpose([pair(at, 0), pair(at, 1), pair(at, 2), pair(at, 3)]);
            [Self(a), Self(b), Self(c), Self(d)]
        }
    }
    #[inline(always)]
    unsafe fn add4(rows: [Self; 4], at: &[*mut f64]) {
        unsafe {
            let out = transpose([rows[0].0, rows[1].0, rows[2].0, rows[3].0]);
            for l in 0..4 {
                let row = _mm512_castpd512_pd256(out[l]);
                _mm256_storeu_pd(at[l], _mm256_add_pd(_mm256_loadu_pd(at[l]), row));
            }
            for l in 0..4 {
                let row = _mm512_extractf64x4_pd::<1>(out[l]);
                _mm256_storeu_pd(at[l + 4], _mm256_add_pd(_mm256_loadu_pd(at[l + 4]), row));
            }
        }
    }
    #[inline(always)]
    unsafe fn store4(rows: [Self; 4], at: &[*mut f64]) {
        unsafe {
            let out = transpose([rows[0].0, rows[1].0, rows[2].0, rows[3].0]);
            for l in 0..4 {
                _mm256_storeu_pd(at[l], _mm512_castpd512_pd256(out[l]));
                _mm256_storeu_pd(at[l + 4], _mm512_extractf64x4_pd::<1>(out[l]));
            }
        }
    }
}

#[inline(always)]
unsafe fn pair(at: &[*const f64], l: usize) -> __m512d {
    // SAFETY: see the trait.
    unsafe {
        let low = _mm512_castpd256_pd512(_mm256_loadu_pd(at[l]));
        _mm512_insertf64x4::<1>(low, _mm256_loadu_pd(at[l + 4]))
    }
}

#[inline(always)]
unsafe fn transpose(r: [__m512d; 4]) -> [__m512d; 4] {
    // SAFETY: shuffles of registers; AVX-512 F is there, see the trait.
    unsafe {
        let (a, b) = (_mm512_unpacklo_pd(r[0], r[1]), _mm512_unpackhi_pd(r[0], r[1]));
        let (c, d) = (_mm512_unpacklo_pd(r[2], r[3]), _mm512_unpackhi_pd(r[2], r[3]));
        let low = _mm512_set_epi64(13, 12, 5, 4, 9, 8, 1, 0);
        let high = _mm512_set_epi64(15, 14, 7, 6, 11, 10, 3, 2);
        [
            _mm512_permutex2var_pd(a, low, c),
            _mm512_permutex2var_pd(b, low, d),
            _mm512_permutex2var_pd(a, high, c),
            _mm512_permutex2var_pd(b, high, d),
        ]
    }
}
