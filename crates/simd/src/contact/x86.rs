//! Registers of x86-64: two (SSE2, which every such processor has), four (AVX2) and eight reals (AVX-512 F).
//!
//! What the widths share is written once, in the macro; what differs is how rows are transposed.
#![allow(clippy::undocumented_unsafe_blocks)]

use super::reals::{Apart, Reals, apart, overlap};
use std::arch::x86_64::*;

/// Two reals. The portable path of x86-64: products are not contracted, so its bits are those of plain arithmetic.
#[derive(Clone, Copy)]
pub struct Two(pub(super) __m128d);

/// Four reals.
#[derive(Clone, Copy)]
pub struct Four(pub(super) __m256d);

/// Eight reals.
#[derive(Clone, Copy)]
pub struct Eight(__m512d);

/// Methods that are one intrinsic or one function each, whatever the precision.
macro_rules! by_intrinsics {
    ($mask:ty; $($op:ident: $do:ident,)* ; $fma:ident, $fnma:ident, $lt:ident, $select:ident, $bits:ident, $both:ident) => {
        $(#[inline(always)]
        unsafe fn $op(self, b: Self) -> Self {
            unsafe { Self($do(self.0, b.0)) }
        })*
        #[inline(always)]
        unsafe fn fma(self, b: Self, c: Self) -> Self {
            unsafe { Self($fma(self.0, b.0, c.0)) }
        }
        #[inline(always)]
        unsafe fn fnma(self, b: Self, c: Self) -> Self {
            unsafe { Self($fnma(self.0, b.0, c.0)) }
        }
        #[inline(always)]
        unsafe fn lt(self, b: Self) -> $mask {
            unsafe { $lt(self.0, b.0) }
        }
        #[inline(always)]
        unsafe fn select(mask: $mask, a: Self, b: Self) -> Self {
            unsafe { Self($select(mask, a.0, b.0)) }
        }
        #[inline(always)]
        unsafe fn bits(mask: $mask) -> u32 {
            unsafe { $bits(mask) as u32 }
        }
        #[inline(always)]
        unsafe fn both(a: $mask, b: $mask) -> $mask {
            unsafe { $both(a, b) }
        }
        #[inline(always)]
        unsafe fn load4(at: &[*const f64]) -> [Self; 4] {
            unsafe { Self::gather(at, false) }
        }
        #[inline(always)]
        unsafe fn load3(at: &[*const f64]) -> [Self; 3] {
            let [a, b, c, _] = unsafe { Self::gather(at, true) };
            [a, b, c]
        }
    };
}
pub(super) use by_intrinsics;

/// Operations that are one intrinsic each, or one function below.
macro_rules! register {
    ($name:ident, $count:expr, $mask:ty, $splat:ident, $($op:ident: $do:ident,)* ; $fma:ident, $fnma:ident, $lt:ident, $select:ident, $bits:ident, $both:ident) => {
        // SAFETY of all methods: the trait says where they may run; addresses given to loads and stores point to as many reals each
        // as those are named after.
        impl Reals for $name {
            const N: usize = $count;
            type Mask = $mask;

            #[inline(always)]
            unsafe fn splat(x: f64) -> Self {
                unsafe { Self($splat(x)) }
            }
            by_intrinsics!($mask; $($op: $do,)* ; $fma, $fnma, $lt, $select, $bits, $both);
            #[inline(always)]
            unsafe fn sqrt(self) -> Self {
                unsafe { self.root() }
            }
            #[inline(always)]
            unsafe fn load1(at: &[*const f64]) -> Self {
                unsafe { Self::single(at) }
            }
            #[inline(always)]
            unsafe fn difference(a: &[*const f64], b: &[*const f64]) -> [Self; 4] {
                unsafe { Self::apart4(a, b) }
            }
            #[inline(always)]
            unsafe fn apart(a: &[*const f64], b: &[*const f64]) -> Apart<Self> {
                unsafe { apart(a, b) }
            }
            #[inline(always)]
            unsafe fn overlap(at: &Apart<Self>, distance: Self) -> Self {
                unsafe { overlap(at, distance) }
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

register!(Two, 2, __m128d, _mm_set1_pd,
    add: _mm_add_pd, sub: _mm_sub_pd, mul: _mm_mul_pd, div: _mm_div_pd, min: _mm_min_pd, max: _mm_max_pd, ;
    mul_add, mul_sub_from, _mm_cmplt_pd, blend2, _mm_movemask_pd, _mm_and_pd);
register!(Four, 4, __m256d, _mm256_set1_pd,
    add: _mm256_add_pd, sub: _mm256_sub_pd, mul: _mm256_mul_pd, div: _mm256_div_pd, min: _mm256_min_pd, max: _mm256_max_pd, ;
    _mm256_fmadd_pd, _mm256_fnmadd_pd, lt4, blend4, _mm256_movemask_pd, _mm256_and_pd);
register!(Eight, 8, __mmask8, _mm512_set1_pd,
    add: _mm512_add_pd, sub: _mm512_sub_pd, mul: _mm512_mul_pd, div: _mm512_div_pd, min: _mm512_min_pd, max: _mm512_max_pd, ;
    _mm512_fmadd_pd, _mm512_fnmadd_pd, lt8, blend8, bits8, both8);

/// What is done with a row of reals at its address. A constant where it is used, so that no choice is left at run time.
#[derive(Clone, Copy)]
pub(super) enum Put {
    Add,
    Four,
    Three,
}

#[inline(always)]
unsafe fn mul_add(a: __m128d, b: __m128d, c: __m128d) -> __m128d {
    unsafe { _mm_add_pd(_mm_mul_pd(a, b), c) }
}
#[inline(always)]
unsafe fn mul_sub_from(a: __m128d, b: __m128d, c: __m128d) -> __m128d {
    unsafe { _mm_sub_pd(c, _mm_mul_pd(a, b)) }
}
#[inline(always)]
unsafe fn blend2(mask: __m128d, a: __m128d, b: __m128d) -> __m128d {
    unsafe { _mm_or_pd(_mm_and_pd(mask, a), _mm_andnot_pd(mask, b)) }
}
#[inline(always)]
unsafe fn lt4(a: __m256d, b: __m256d) -> __m256d {
    unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(a, b) }
}
#[inline(always)]
unsafe fn blend4(mask: __m256d, a: __m256d, b: __m256d) -> __m256d {
    unsafe { _mm256_blendv_pd(b, a, mask) }
}
#[inline(always)]
unsafe fn lt8(a: __m512d, b: __m512d) -> __mmask8 {
    unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, b) }
}
#[inline(always)]
unsafe fn blend8(mask: __mmask8, a: __m512d, b: __m512d) -> __m512d {
    unsafe { _mm512_mask_blend_pd(mask, b, a) }
}
#[inline(always)]
unsafe fn bits8(mask: __mmask8) -> u8 {
    mask
}
#[inline(always)]
unsafe fn both8(a: __mmask8, b: __mmask8) -> __mmask8 {
    a & b
}

impl Two {
    #[inline(always)]
    unsafe fn root(self) -> Self {
        unsafe { Self(_mm_sqrt_pd(self.0)) }
    }
    #[inline(always)]
    unsafe fn gather(at: &[*const f64], three: bool) -> [Self; 4] {
        unsafe {
            let (a, b) = (_mm_loadu_pd(at[0]), _mm_loadu_pd(at[1]));
            let (c, d) = if three {
                (_mm_load_sd(at[0].add(2)), _mm_load_sd(at[1].add(2)))
            } else {
                (_mm_loadu_pd(at[0].add(2)), _mm_loadu_pd(at[1].add(2)))
            };
            [
                Self(_mm_unpacklo_pd(a, b)),
                Self(_mm_unpackhi_pd(a, b)),
                Self(_mm_unpacklo_pd(c, d)),
                Self(_mm_unpackhi_pd(c, d)),
            ]
        }
    }
    #[inline(always)]
    unsafe fn single(at: &[*const f64]) -> Self {
        unsafe { Self(_mm_set_pd(*at[1], *at[0])) }
    }
    #[inline(always)]
    unsafe fn apart4(a: &[*const f64], b: &[*const f64]) -> [Self; 4] {
        unsafe {
            let p = _mm_sub_pd(_mm_loadu_pd(a[0]), _mm_loadu_pd(b[0]));
            let q = _mm_sub_pd(_mm_loadu_pd(a[1]), _mm_loadu_pd(b[1]));
            let sign = _mm_set_pd(1.0, -1.0);
            let r = mul_add(sign, _mm_loadu_pd(b[0].add(2)), _mm_loadu_pd(a[0].add(2)));
            let s = mul_add(sign, _mm_loadu_pd(b[1].add(2)), _mm_loadu_pd(a[1].add(2)));
            [
                Self(_mm_unpacklo_pd(p, q)),
                Self(_mm_unpackhi_pd(p, q)),
                Self(_mm_unpacklo_pd(r, s)),
                Self(_mm_unpackhi_pd(r, s)),
            ]
        }
    }
    #[inline(always)]
    unsafe fn scatter(rows: [Self; 4]) -> [[__m128d; 2]; 2] {
        unsafe {
            let (a, b, c, d) = (rows[0].0, rows[1].0, rows[2].0, rows[3].0);
            [[_mm_unpacklo_pd(a, b), _mm_unpacklo_pd(c, d)], [_mm_unpackhi_pd(a, b), _mm_unpackhi_pd(c, d)]]
        }
    }
}

/// A row of four reals in registers.
pub(super) trait Four64 {
    unsafe fn put(self, to: *mut f64, how: Put);
}

impl Four64 for [__m128d; 2] {
    #[inline(always)]
    unsafe fn put(self, to: *mut f64, how: Put) {
        unsafe {
            match how {
                Put::Add => {
                    _mm_storeu_pd(to, _mm_add_pd(_mm_loadu_pd(to), self[0]));
                    _mm_storeu_pd(to.add(2), _mm_add_pd(_mm_loadu_pd(to.add(2)), self[1]));
                }
                Put::Four => {
                    _mm_storeu_pd(to, self[0]);
                    _mm_storeu_pd(to.add(2), self[1]);
                }
                Put::Three => {
                    _mm_storeu_pd(to, self[0]);
                    _mm_store_sd(to.add(2), self[1]);
                }
            }
        }
    }
}

impl Four64 for __m256d {
    #[inline(always)]
    unsafe fn put(self, to: *mut f64, how: Put) {
        unsafe {
            match how {
                Put::Add => _mm256_storeu_pd(to, _mm256_add_pd(_mm256_loadu_pd(to), self)),
                Put::Four => _mm256_storeu_pd(to, self),
                Put::Three => {
                    _mm_storeu_pd(to, _mm256_castpd256_pd128(self));
                    _mm_store_sd(to.add(2), _mm256_extractf128_pd::<1>(self));
                }
            }
        }
    }
}

#[inline(always)]
pub(super) unsafe fn put(to: *mut f64, row: impl Four64, how: Put) {
    unsafe { row.put(to, how) }
}

/// Takes a row of four, or of three and a zero.
#[inline(always)]
pub(super) unsafe fn take4(from: *const f64, three: bool) -> __m256d {
    unsafe {
        if three {
            let low = _mm256_castpd128_pd256(_mm_loadu_pd(from));
            _mm256_insertf128_pd::<1>(low, _mm_load_sd(from.add(2)))
        } else {
            _mm256_loadu_pd(from)
        }
    }
}

/// `a - b` of three reals and `a + b` of the fourth: the product with 1 or -1 is exact.
#[inline(always)]
unsafe fn minus3(a: *const f64, b: *const f64) -> __m256d {
    unsafe {
        let sign = _mm256_set_pd(1.0, -1.0, -1.0, -1.0);
        _mm256_fmadd_pd(_mm256_loadu_pd(b), sign, _mm256_loadu_pd(a))
    }
}

impl Four {
    #[inline(always)]
    unsafe fn root(self) -> Self {
        unsafe { Self(_mm256_sqrt_pd(self.0)) }
    }
    #[inline(always)]
    unsafe fn gather(at: &[*const f64], three: bool) -> [Self; 4] {
        unsafe {
            let rows = [take4(at[0], three), take4(at[1], three), take4(at[2], three), take4(at[3], three)];
            let [a, b, c, d] = Self::transpose(rows);
            [Self(a), Self(b), Self(c), Self(d)]
        }
    }
    #[inline(always)]
    unsafe fn single(at: &[*const f64]) -> Self {
        unsafe { Self(_mm256_set_pd(*at[3], *at[2], *at[1], *at[0])) }
    }
    #[inline(always)]
    unsafe fn apart4(a: &[*const f64], b: &[*const f64]) -> [Self; 4] {
        unsafe {
            let rows = [minus3(a[0], b[0]), minus3(a[1], b[1]), minus3(a[2], b[2]), minus3(a[3], b[3])];
            let [x, y, z, s] = Self::transpose(rows);
            [Self(x), Self(y), Self(z), Self(s)]
        }
    }
    #[inline(always)]
    unsafe fn scatter(rows: [Self; 4]) -> [__m256d; 4] {
        unsafe { Self::transpose([rows[0].0, rows[1].0, rows[2].0, rows[3].0]) }
    }
    #[inline(always)]
    unsafe fn transpose(r: [__m256d; 4]) -> [__m256d; 4] {
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
}

impl Eight {
    #[inline(always)]
    unsafe fn root(self) -> Self {
        unsafe { Self(_mm512_sqrt_pd(self.0)) }
    }
    #[inline(always)]
    unsafe fn gather(at: &[*const f64], three: bool) -> [Self; 4] {
        unsafe {
            // Rows l and l + 4 share a register: its halves are then transposed like four rows of four.
            let mut rows = [_mm512_setzero_pd(); 4];
            for l in 0..4 {
                let low = _mm512_castpd256_pd512(take4(at[l], three));
                rows[l] = _mm512_insertf64x4::<1>(low, take4(at[l + 4], three));
            }
            let [a, b, c, d] = Self::transpose(rows);
            [Self(a), Self(b), Self(c), Self(d)]
        }
    }
    #[inline(always)]
    unsafe fn single(at: &[*const f64]) -> Self {
        unsafe { Self(_mm512_set_pd(*at[7], *at[6], *at[5], *at[4], *at[3], *at[2], *at[1], *at[0])) }
    }
    #[inline(always)]
    unsafe fn apart4(a: &[*const f64], b: &[*const f64]) -> [Self; 4] {
        unsafe {
            let mut rows = [_mm512_setzero_pd(); 4];
            for l in 0..4 {
                let low = _mm512_castpd256_pd512(minus3(a[l], b[l]));
                rows[l] = _mm512_insertf64x4::<1>(low, minus3(a[l + 4], b[l + 4]));
            }
            let [x, y, z, s] = Self::transpose(rows);
            [Self(x), Self(y), Self(z), Self(s)]
        }
    }
    #[inline(always)]
    unsafe fn scatter(rows: [Self; 4]) -> [__m256d; 8] {
        unsafe {
            let out = Self::transpose([rows[0].0, rows[1].0, rows[2].0, rows[3].0]);
            let mut rows = [_mm256_setzero_pd(); 8];
            for l in 0..4 {
                rows[l] = _mm512_castpd512_pd256(out[l]);
                rows[l + 4] = _mm512_extractf64x4_pd::<1>(out[l]);
            }
            rows
        }
    }
    #[inline(always)]
    unsafe fn transpose(r: [__m512d; 4]) -> [__m512d; 4] {
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
}
