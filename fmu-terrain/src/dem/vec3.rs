//! Three-vectors as plain arrays: what the contact kernels need, nothing more.
//!
//! Arrays, not a linear-algebra type, so that a row of a grain is read and written as it lies in memory.

/// A vector in the inertial frame.
pub type Vec3 = [f64; 3];

/// a + b
#[inline(always)]
pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a - b
#[inline(always)]
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// s a
#[inline(always)]
pub fn scale(s: f64, a: Vec3) -> Vec3 {
    [s * a[0], s * a[1], s * a[2]]
}

/// a + s b
#[inline(always)]
pub fn add_scaled(a: Vec3, s: f64, b: Vec3) -> Vec3 {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

/// a . b
#[inline(always)]
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a x b
#[inline(always)]
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// |a|
#[inline(always)]
pub fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// The part of a that is normal to the unit vector n.
#[inline(always)]
pub fn reject(a: Vec3, n: Vec3) -> Vec3 {
    add_scaled(a, -dot(a, n), n)
}

/// Whether all three are finite.
pub fn finite(a: Vec3) -> bool {
    a.iter().all(|c| c.is_finite())
}
