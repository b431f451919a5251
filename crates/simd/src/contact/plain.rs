//! Two reals without any instruction set: the reference of processors that have no SSE2, and what [`super::x86::Two`] must
//! equal to the bit.

use super::reals::{Apart, Reals, apart, overlap, overlap_of_gap};

/// Two reals.
#[derive(Clone, Copy)]
pub struct Plain([f64; 2]);

/// Two reals in single precision.
#[derive(Clone, Copy)]
pub struct PlainSingle([f32; 2]);

macro_rules! each {
    ($a:expr, $b:expr, $op:expr) => {
        Self([$op($a.0[0], $b.0[0]), $op($a.0[1], $b.0[1])])
    };
}

macro_rules! plain {
    ($name:ident, $real:ty) => {
        // SAFETY: addresses given to the loads and stores point to as many reals each as they are named after; nothing else is unsafe.
        #[allow(clippy::undocumented_unsafe_blocks, clippy::needless_range_loop)]
        impl Reals for $name {
            const N: usize = 2;
            type Mask = [bool; 2];

            #[inline(always)]
            unsafe fn splat(x: f64) -> Self {
                Self([x as $real; 2])
            }
            #[inline(always)]
            unsafe fn add(self, b: Self) -> Self {
                each!(self, b, |x, y| x + y)
            }
            #[inline(always)]
            unsafe fn sub(self, b: Self) -> Self {
                each!(self, b, |x, y| x - y)
            }
            #[inline(always)]
            unsafe fn mul(self, b: Self) -> Self {
                each!(self, b, |x, y| x * y)
            }
            #[inline(always)]
            unsafe fn div(self, b: Self) -> Self {
                each!(self, b, |x, y| x / y)
            }
            #[inline(always)]
            unsafe fn sqrt(self) -> Self {
                Self([self.0[0].sqrt(), self.0[1].sqrt()])
            }
            // Not f64::min and max, which prefer the number to a NaN.
            #[inline(always)]
            unsafe fn min(self, b: Self) -> Self {
                each!(self, b, |x, y| if x < y { x } else { y })
            }
            #[inline(always)]
            unsafe fn max(self, b: Self) -> Self {
                each!(self, b, |x, y| if x > y { x } else { y })
            }
            #[inline(always)]
            unsafe fn fma(self, b: Self, c: Self) -> Self {
                unsafe { self.mul(b).add(c) }
            }
            #[inline(always)]
            unsafe fn fnma(self, b: Self, c: Self) -> Self {
                unsafe { c.sub(self.mul(b)) }
            }
            #[inline(always)]
            unsafe fn lt(self, b: Self) -> [bool; 2] {
                [self.0[0] < b.0[0], self.0[1] < b.0[1]]
            }
            #[inline(always)]
            unsafe fn select(mask: [bool; 2], a: Self, b: Self) -> Self {
                Self([if mask[0] { a.0[0] } else { b.0[0] }, if mask[1] { a.0[1] } else { b.0[1] }])
            }
            #[inline(always)]
            unsafe fn bits(mask: [bool; 2]) -> u32 {
                u32::from(mask[0]) | u32::from(mask[1]) << 1
            }
            #[inline(always)]
            unsafe fn both(a: [bool; 2], b: [bool; 2]) -> [bool; 2] {
                [a[0] & b[0], a[1] & b[1]]
            }
            #[inline(always)]
            unsafe fn load4(at: &[*const f64]) -> [Self; 4] {
                unsafe {
                    let (a, b) = (*at[0].cast::<[f64; 4]>(), *at[1].cast::<[f64; 4]>());
                    let of = |c: usize| Self([a[c] as $real, b[c] as $real]);
                    [of(0), of(1), of(2), of(3)]
                }
            }
            #[inline(always)]
            unsafe fn load1(at: &[*const f64]) -> Self {
                unsafe { Self([*at[0] as $real, *at[1] as $real]) }
            }
            #[inline(always)]
            unsafe fn difference(a: &[*const f64], b: &[*const f64]) -> [Self; 4] {
                unsafe {
                    let minus = |c: usize| {
                        Self([(*a[0].add(c) - *b[0].add(c)) as $real, (*a[1].add(c) - *b[1].add(c)) as $real])
                    };
                    let plus = Self([(*a[0].add(3) + *b[0].add(3)) as $real, (*a[1].add(3) + *b[1].add(3)) as $real]);
                    [minus(0), minus(1), minus(2), plus]
                }
            }
            #[inline(always)]
            unsafe fn apart(a: &[*const f64], b: &[*const f64]) -> Apart<Self> {
                unsafe {
                    let at = apart::<Plain>(a, b);
                    let of = |x: Plain| Self([x.0[0] as $real, x.0[1] as $real]);
                    Apart { d: at.d.map(of), d2: of(at.d2), reach: of(at.reach), gap: of(at.gap) }
                }
            }
            #[inline(always)]
            unsafe fn overlap(at: &Apart<Self>, distance: Self) -> Self {
                unsafe { if size_of::<$real>() == 8 { overlap(at, distance) } else { overlap_of_gap(at, distance) } }
            }
            #[inline(always)]
            unsafe fn load3(at: &[*const f64]) -> [Self; 3] {
                unsafe {
                    let (a, b) = (*at[0].cast::<[f64; 3]>(), *at[1].cast::<[f64; 3]>());
                    let of = |c: usize| Self([a[c] as $real, b[c] as $real]);
                    [of(0), of(1), of(2)]
                }
            }
            #[inline(always)]
            unsafe fn add_both(a: [Self; 4], b: [Self; 4], on_a: &[*mut f64], on_b: &[*mut f64]) {
                unsafe {
                    for l in 0..2 {
                        for c in 0..4 {
                            *on_a[l].add(c) += f64::from(a[c].0[l]);
                        }
                        for c in 0..4 {
                            *on_b[l].add(c) += f64::from(b[c].0[l]);
                        }
                    }
                }
            }
            #[inline(always)]
            unsafe fn store4(rows: [Self; 4], at: &[*mut f64]) {
                unsafe {
                    for l in 0..2 {
                        for (c, row) in rows.iter().enumerate() {
                            *at[l].add(c) = f64::from(row.0[l]);
                        }
                    }
                }
            }
            #[inline(always)]
            unsafe fn store3(rows: [Self; 3], at: &[*mut f64]) {
                unsafe {
                    for l in 0..2 {
                        for (c, row) in rows.iter().enumerate() {
                            *at[l].add(c) = f64::from(row.0[l]);
                        }
                    }
                }
            }
        }
    };
}

plain!(Plain, f64);
plain!(PlainSingle, f32);
