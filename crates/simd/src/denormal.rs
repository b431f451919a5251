//! Denormal mode of the calling thread.

use std::marker::PhantomData;

/// Scope in which the calling thread flushes denormal results (and, where the processor offers it, operands) to zero.
///
/// The mode is a property of the thread: every computing thread makes its own guard, also the worker threads of a pool.
/// The former mode comes back when the guard is dropped, in a panic as well. On processors other than x86-64 and
/// 64-bit Arm it does nothing. The guard cannot move to another thread, since it would restore the wrong one.
#[must_use = "the mode ends when the guard is dropped"]
pub struct FlushDenormals {
    saved: u64,
    not_send: PhantomData<*const ()>,
}

impl FlushDenormals {
    /// Switches the calling thread to flush-to-zero until the guard is dropped.
    #[inline]
    pub fn new() -> Self {
        let saved = control::read();
        control::write(saved | control::FLUSH);
        Self { saved, not_send: PhantomData }
    }
}

impl Default for FlushDenormals {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for FlushDenormals {
    #[inline]
    fn drop(&mut self) {
        control::write(self.saved);
    }
}

#[cfg(target_arch = "x86_64")]
mod control {
    use std::arch::asm;

    /// MXCSR bits: flush results to zero (15), denormals are zero (6).
    pub const FLUSH: u64 = (1 << 15) | (1 << 6);

    #[inline]
    pub fn read() -> u64 {
        let mut value = 0_u32;
        // SAFETY: stmxcsr stores 4 bytes at the address given, which is a live u32; every x86-64 has SSE.
        unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut value, options(nostack, preserves_flags)) };
        u64::from(value)
    }

    #[inline]
    pub fn write(value: u64) {
        let value = value as u32;
        // SAFETY: ldmxcsr loads 4 bytes from a live u32. Only the denormal bits ever differ from what `read` returned,
        // so no exception is unmasked and the rounding mode stays.
        unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const value, options(nostack, preserves_flags)) };
    }
}

#[cfg(target_arch = "aarch64")]
mod control {
    use std::arch::asm;

    /// FPCR bit FZ (24).
    pub const FLUSH: u64 = 1 << 24;

    #[inline]
    pub fn read() -> u64 {
        let value: u64;
        // SAFETY: reads a register that user code may read.
        unsafe { asm!("mrs {}, fpcr", out(reg) value, options(nomem, nostack, preserves_flags)) };
        value
    }

    #[inline]
    pub fn write(value: u64) {
        // SAFETY: writes back a value of the same register in which only FZ may differ.
        unsafe { asm!("msr fpcr, {}", in(reg) value, options(nostack, preserves_flags)) };
    }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
mod control {
    pub const FLUSH: u64 = 0;

    #[inline]
    pub fn read() -> u64 {
        0
    }

    #[inline]
    pub fn write(_: u64) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hint::black_box;

    fn half_of_the_smallest_normal() -> f64 {
        black_box(f64::MIN_POSITIVE) * black_box(0.5)
    }

    #[test]
    fn the_mode_holds_in_the_scope_and_ends_with_it() {
        assert!(half_of_the_smallest_normal() > 0.0);
        {
            let _outer = FlushDenormals::new();
            {
                let _inner = FlushDenormals::new();
            }
            if control::FLUSH != 0 {
                assert_eq!(half_of_the_smallest_normal(), 0.0);
            }
        }
        assert!(half_of_the_smallest_normal() > 0.0);
    }

    #[test]
    fn a_panic_restores_the_mode_too() {
        let caught = std::panic::catch_unwind(|| {
            let _mode = FlushDenormals::new();
            panic!("inside the scope");
        });
        assert!(caught.is_err());
        assert!(half_of_the_smallest_normal() > 0.0);
    }
}
