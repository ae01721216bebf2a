//! Software prefetching.
//!
//! The kernels stream through more memory than the L2 cache holds, about a page per time step, and hardware
//! prefetchers stop at page boundaries.

/// Prefetches the cache line at `address`, which may be outside of any allocation.
#[inline(always)]
#[expect(unsafe_code, reason = "the standard library has no safe prefetch")]
pub(crate) fn prefetch<T>(address: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a prefetch affects only the speed, for any address; the address is not dereferenced. The
    // instruction is part of SSE, which every x86-64 machine has.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(address.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}
