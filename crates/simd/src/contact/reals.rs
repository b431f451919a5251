//! A register of reals: the few operations that the kernel is written in.
//!
//! Every method is unsafe for the same reason: it may run only where its instruction set is there. The kernel is
//! inlined whole into a function compiled for that set, which is what turns these calls into single instructions.
//!
//! Memory holds double precision whatever a register holds: registers of single precision round what they load, and widen what
//! they store and add.
#![allow(clippy::undocumented_unsafe_blocks)]

/// Where two grains are to each other.
#[derive(Clone, Copy)]
pub struct Apart<V> {
    /// From the second centre to the first.
    pub d: [V; 3],
    /// Its square.
    pub d2: V,
    /// Sum of the radii.
    pub reach: V,
    /// Square of that sum less the square of the distance: what single precision would lose of the overlap.
    pub gap: V,
}

/// [`Reals::apart`] of reals in double precision.
#[inline(always)]
pub unsafe fn apart<V: Reals>(a: &[*const f64], b: &[*const f64]) -> Apart<V> {
    unsafe {
        let [x, y, z, reach] = V::difference(a, b);
        let d2 = z.fma(z, y.fma(y, x.mul(x)));
        let gap = reach.fma(reach, V::splat(0.0).sub(d2));
        Apart { d: [x, y, z], d2, reach, gap }
    }
}

/// [`Reals::overlap`] of reals in double precision.
#[inline(always)]
pub unsafe fn overlap<V: Reals>(apart: &Apart<V>, distance: V) -> V {
    unsafe {
        let touching = V::lt(apart.d2, apart.reach.mul(apart.reach));
        V::select(touching, apart.reach.sub(distance), V::splat(0.0))
    }
}

/// [`Reals::overlap`] of reals in single precision: (r^2 - d^2)/(r + d), whose numerator was formed in double precision.
#[inline(always)]
pub unsafe fn overlap_of_gap<V: Reals>(apart: &Apart<V>, distance: V) -> V {
    unsafe {
        let delta = apart.gap.div(apart.reach.add(distance));
        V::select(V::lt(V::splat(0.0), apart.gap), delta, V::splat(0.0))
    }
}

/// `N` reals in a register.
pub trait Reals: Copy {
    /// How many.
    const N: usize;
    /// One bit for each.
    type Mask: Copy;

    unsafe fn splat(x: f64) -> Self;
    unsafe fn add(self, b: Self) -> Self;
    unsafe fn sub(self, b: Self) -> Self;
    unsafe fn mul(self, b: Self) -> Self;
    unsafe fn div(self, b: Self) -> Self;
    unsafe fn sqrt(self) -> Self;
    /// The lesser; `b` where one of them is NaN.
    unsafe fn min(self, b: Self) -> Self;
    /// The greater; `b` where one of them is NaN.
    unsafe fn max(self, b: Self) -> Self;
    /// `self * b + c`, rounded once where the set has the instruction.
    unsafe fn fma(self, b: Self, c: Self) -> Self;
    /// `c - self * b`, rounded once where the set has the instruction.
    unsafe fn fnma(self, b: Self, c: Self) -> Self;
    /// Where `self < b`; not where one of them is NaN.
    unsafe fn lt(self, b: Self) -> Self::Mask;
    /// `a` where the mask is set, `b` elsewhere.
    unsafe fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// The mask's bits, first register entry lowest.
    unsafe fn bits(mask: Self::Mask) -> u32;
    /// Both.
    unsafe fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Loads four reals from each of `N` addresses and transposes: entry `l` of result `c` is `at[l][c]`.
    unsafe fn load4(at: &[*const f64]) -> [Self; 4];
    /// Loads one real from each of `N` addresses.
    unsafe fn load1(at: &[*const f64]) -> Self;
    /// As `load4` of the differences `a - b` of three reals and the sum of the fourths, in double precision before it is rounded:
    /// where both go through a register in one piece, fewer of them are transposed.
    unsafe fn difference(a: &[*const f64], b: &[*const f64]) -> [Self; 4];
    /// Where the centres `a`, `b` of two grains are to each other: rows of position and radius.
    unsafe fn apart(a: &[*const f64], b: &[*const f64]) -> Apart<Self>;
    /// Overlap of two grains this far apart, `distance` the root of its square; where they do not touch, 0.
    unsafe fn overlap(apart: &Apart<Self>, distance: Self) -> Self;
    /// As `load4` of three reals: the fourth place is not read.
    unsafe fn load3(at: &[*const f64]) -> [Self; 3];
    /// Adds where [`Reals::store4`] would store: entry 0 of `a`, then of `b`, entry 1 of `a`, and so on. Addresses may repeat: what
    /// is summed at one of them is summed in the order of the entries, whatever the width.
    unsafe fn add_both(a: [Self; 4], b: [Self; 4], on_a: &[*mut f64], on_b: &[*mut f64]);
    /// The inverse of [`Reals::load4`].
    unsafe fn store4(rows: [Self; 4], at: &[*mut f64]);
    /// The inverse of [`Reals::load3`].
    unsafe fn store3(rows: [Self; 3], at: &[*mut f64]);
}
