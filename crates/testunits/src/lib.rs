//! Small units for tests of the master.
//!
//! Built as a shared library (`--example testunits`) they are FMUs; as a Rust library their physics can be called directly, so that a
//! test compares the master with a bare loop.
#![forbid(unsafe_code)]

pub mod arrays;
pub mod block;
pub mod feedthrough;
pub mod masses;
pub mod relay;
pub mod smooth;
pub mod trouble;

use terramech_fmi2::Model;

/// All models of this library.
pub fn models() -> Vec<Model> {
    vec![
        masses::first_model(),
        masses::second_model(),
        feedthrough::model(),
        arrays::source_model(),
        arrays::echo_model(),
        relay::model(),
        block::lag_model(),
        block::block_model(),
        trouble::model(),
        smooth::parabola_model(),
        smooth::smooth_model(),
    ]
}
