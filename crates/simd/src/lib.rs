//! The one room for processor intrinsics: instruction sets chosen at run time, contact kernels, denormal mode.
//!
//! Also what a granular engine needs to be fast and cannot write safely itself: rows that begin at cache lines ([`Row`]), large
//! memory pages, a sweep that reads ahead and writes behind ([`regions`]).
//!
//! [`Isa`] says which instruction path runs ([`Isa::chosen`]; the variable `TERRAMECH_ISA` pins it); [`contact`] holds
//! the batch kernels.
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

mod advance;
pub mod contact;
mod denormal;
mod dispatch;
mod finite;
mod isa;
mod lanes;
mod large_pages;
mod rows;
mod tiles;
mod wavefront;

pub use advance::{Motion, Moved, advance};
pub use denormal::FlushDenormals;
pub use dispatch::{Kernel, active, dispatch};
pub use finite::all_finite;
pub use isa::{Isa, VARIABLE as ISA_VARIABLE};
pub use lanes::{Lanes, WIDTH};
pub use large_pages::prefer_large_pages;
pub use rows::{Force, Row, Slip};
pub use tiles::{Pack, Tile};
pub use wavefront::{Cut, Region, regions};
