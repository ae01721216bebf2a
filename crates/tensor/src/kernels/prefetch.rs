//! Hints to the cache. The kernels stream through more memory than the second-level cache holds, a page or so a step,
//! and the machine's own prefetchers stop at every page.

/// Asks for the cache line at `address` to be fetched, for reading or for writing it. It may lie anywhere, also outside of any allocation.
#[inline(always)]
#[expect(unsafe_code, reason = "the standard library has no safe prefetch")]
pub(crate) fn prefetch<T>(address: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a prefetch has no effect but on speed, whatever the address; it is not dereferenced. SSE, which has the
    // instruction, is part of x86-64.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(address.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}
