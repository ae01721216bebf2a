//! Results of the latest calls of an external function.
//!
//! A search simulates the same motion once for every few candidates, and a fit goes back to a point when a step fails. The engine
//! then asks for the very numbers that it had before, and a call costs more than a look-up.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Calls kept with their results, up to a number of bytes; beyond it the calls that were not asked for longest are forgotten.
#[derive(Debug)]
pub(crate) struct CallMemory<T> {
    kept: Mutex<Generations<T>>,
    max_bytes: usize,
}

/// Results by the bits of the arguments. Those in `old` that are asked for move to `young`; when `young` is full, it becomes `old`.
#[derive(Debug)]
struct Generations<T> {
    young: BTreeMap<Box<[u64]>, Kept<T>>,
    old: BTreeMap<Box<[u64]>, Kept<T>>,
    young_bytes: usize,
}

/// Result of a call, with the bytes that it takes with its arguments.
#[derive(Debug)]
struct Kept<T> {
    result: Arc<T>,
    bytes: usize,
}

impl<T> CallMemory<T> {
    /// An empty memory of this size.
    pub(crate) fn new(max_bytes: usize) -> Self {
        let kept = Generations { young: BTreeMap::new(), old: BTreeMap::new(), young_bytes: 0 };
        Self { kept: Mutex::new(kept), max_bytes }
    }

    /// The result for these arguments: that of the earlier call with the same bits, or that of `compute`, whose size in bytes
    /// `size` gives.
    ///
    /// Nothing is locked during `compute`.
    pub(crate) fn of(
        &self,
        arguments: Box<[u64]>,
        compute: impl FnOnce() -> T,
        size: impl FnOnce(&T) -> usize,
    ) -> Arc<T> {
        let lock = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(result) = lock().find(&arguments, self.max_bytes / 2) {
            return result;
        }
        let result = Arc::new(compute());
        let bytes = size_of_val(&*arguments) + size(&result);
        lock().insert(arguments, Kept { result: Arc::clone(&result), bytes }, self.max_bytes / 2);
        result
    }
}

impl<T> Generations<T> {
    fn find(&mut self, arguments: &[u64], max_bytes: usize) -> Option<Arc<T>> {
        if let Some(kept) = self.young.get(arguments) {
            return Some(Arc::clone(&kept.result));
        }
        let (arguments, kept) = self.old.remove_entry(arguments)?;
        let result = Arc::clone(&kept.result);
        self.insert(arguments, kept, max_bytes);
        Some(result)
    }

    fn insert(&mut self, arguments: Box<[u64]>, kept: Kept<T>, max_bytes: usize) {
        self.young_bytes += kept.bytes;
        let before = self.young.insert(arguments, kept);
        self.young_bytes -= before.map_or(0, |kept| kept.bytes);
        if self.young_bytes > max_bytes {
            self.old = std::mem::take(&mut self.young);
            self.young_bytes = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: the same arguments give the result of their first call, without a second one; other arguments, and those that were
    //! not asked for longest, are computed.
    use super::CallMemory;
    use std::cell::Cell;

    const BYTES_OF_A_CALL: usize = 24;

    #[test]
    fn the_latest_calls_are_not_repeated() {
        let memory = CallMemory::new(10 * BYTES_OF_A_CALL);
        let calls = Cell::new(0);
        let ask = |x: f64| {
            let compute = || {
                calls.set(calls.get() + 1);
                2.0 * x
            };
            let result = memory.of(Box::new([1, x.to_bits()]), compute, size_of_val);
            assert_eq!(*result, 2.0 * x);
            calls.replace(0) == 1
        };
        assert!(ask(1.0) && !ask(1.0), "the first call is made, and not repeated");
        assert!(ask(0.0) && ask(-0.0), "arguments with other bits are other arguments");
        for k in 10..40 {
            assert!(ask(f64::from(k)));
            assert!(!ask(1.0), "a call that is asked for again and again is kept");
        }
        assert!(!ask(37.0), "the latest calls are kept");
        assert!(ask(10.0), "calls from long ago are forgotten");
    }
}
