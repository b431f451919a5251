//! The one room for processor intrinsics: denormal mode and, later, contact kernels.
//!
//! A numerical kernel that meets denormal numbers (a contact history that decays, a force that fades) can slow down by
//! a factor of ten and more. [`FlushDenormals`] switches the calling thread to flush-to-zero for the length of a scope
//! and puts the former mode back, so that a host program never sees its floating-point environment changed:
//!
//! ```
//! use terramech_simd::FlushDenormals;
//!
//! let tiny = std::hint::black_box(f64::MIN_POSITIVE);
//! {
//!     let _mode = FlushDenormals::new();
//!     // x86-64: results below the normal range are zero inside the scope
//! }
//! assert!(tiny / 2.0 > 0.0);
//! ```

mod denormal;

pub use denormal::FlushDenormals;
