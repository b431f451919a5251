//! A register of reals: the few operations that the kernel is written in.
//!
//! Every method is unsafe for the same reason: it may run only where its instruction set is there. The kernel is
//! inlined whole into a function compiled for that set, which is what turns these calls into single instructions.

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
