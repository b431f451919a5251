//! Large memory pages for arrays that are walked through at every step.

/// Asks the system to keep the pages that lie wholly inside `memory` as large pages, if it can: a bed of 100,000 grains
/// fills thousands of small ones, and the processor's table of pages holds fewer. Costs one system call, changes no
/// value, and does nothing where it is not supported.
pub fn prefer_large_pages<T>(memory: &[T]) {
    #[cfg(target_os = "linux")]
    {
        const LARGE: usize = 2 << 20;
        const MADV_HUGEPAGE: i32 = 14;
        unsafe extern "C" {
            fn madvise(address: *mut core::ffi::c_void, length: usize, advice: i32) -> i32;
        }
        let start = (memory.as_ptr() as usize).next_multiple_of(LARGE);
        let end = (memory.as_ptr() as usize + std::mem::size_of_val(memory)) & !(LARGE - 1);
        if start < end {
            // SAFETY: the range lies inside memory that the caller has borrowed, and this advice changes no content. A
            // refusal is no fault: pages then stay small.
            unsafe { madvise(start as *mut core::ffi::c_void, end - start, MADV_HUGEPAGE) };
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = memory;
}
