//! Processor time of this process.

use rustix::time::{ClockId, clock_gettime};

/// Returns the processor time of all threads of this process in s.
pub fn processor_s() -> f64 {
    let t = clock_gettime(ClockId::ProcessCPUTime);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}
