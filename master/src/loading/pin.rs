//! The instruction path that units are told to take.

use terramech_simd::{ISA_VARIABLE, Isa};

/// Pins the instruction path of this process and of every unit that is loaded from now on. Call it before the first thread and the first unit: the environment is no place for two at a
/// time.
pub fn pin_instruction_path(isa: Isa) {
    // SAFETY: called once, at the start of a run on several ranks, when this process has no other thread that looks at the environment.
    unsafe { std::env::set_var(ISA_VARIABLE, isa.name()) };
}
