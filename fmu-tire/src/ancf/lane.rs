//! Numbers the shell kernels run on: one f64, or eight at once.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// Elements (or unit displacements) a [`Pack`] carries.
pub const WIDTH: usize = 8;

/// A number of the shell kernels.
pub trait Lane:
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
    /// `self * b + c`, fused where the lane says so.
    fn fma(self, b: Self, c: Self) -> Self;
}

impl Lane for f64 {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        self * b + c
    }
}

/// Eight numbers. Written as plain loops, which the compiler turns into vector code of the target; `FUSED` asks for fused
/// multiply-add, which must only be used where the target has the instruction (in software it is many times slower).
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub struct Pack<const FUSED: bool>(pub [f64; WIDTH]);

macro_rules! lanewise {
    ($trait:ident, $method:ident, $op:tt) => {
        impl<const FUSED: bool> $trait for Pack<FUSED> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let mut out = [0.0; WIDTH];
                for k in 0..WIDTH {
                    out[k] = self.0[k] $op other.0[k];
                }
                Self(out)
            }
        }
    };
}
lanewise!(Add, add, +);
lanewise!(Sub, sub, -);
lanewise!(Mul, mul, *);

impl<const FUSED: bool> Mul<f64> for Pack<FUSED> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        self * Self([other; WIDTH])
    }
}

impl<const FUSED: bool> Neg for Pack<FUSED> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let mut out = [0.0; WIDTH];
        for k in 0..WIDTH {
            out[k] = -self.0[k];
        }
        Self(out)
    }
}

impl<const FUSED: bool> AddAssign for Pack<FUSED> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const FUSED: bool> Lane for Pack<FUSED> {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([x; WIDTH])
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        let mut out = [0.0; WIDTH];
        for k in 0..WIDTH {
            out[k] = if FUSED { self.0[k].mul_add(b.0[k], c.0[k]) } else { self.0[k] * b.0[k] + c.0[k] };
        }
        Self(out)
    }
}
