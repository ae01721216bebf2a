//! Results of the latest calls of an external function.
//!
//! A search simulates the same motion once for every few candidates, and a fit goes back to a point when a step fails. The engine
//! then asks for the very numbers that it had before, and a call costs more than a look-up.

use std::collections::HashMap;
use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::sync::{Arc, Mutex, PoisonError};

/// Calls kept with their results, up to a number of bytes; beyond it the calls that were not asked for longest are forgotten.
#[derive(Debug)]
pub(crate) struct CallMemory<T> {
    kept: Mutex<Generations<T>>,
    hasher: RandomState,
    max_bytes: usize,
}

/// Calls by the hash of their arguments. Those in `old` that are asked for move to `young`; when `young` is full, it becomes `old`.
#[derive(Debug)]
struct Generations<T> {
    young: HashMap<u64, Call<T>>,
    old: HashMap<u64, Call<T>>,
    young_bytes: usize,
}

/// A call: what it was asked for, bit by bit, and its result.
#[derive(Debug, Clone)]
struct Call<T> {
    arguments: Box<[u64]>,
    result: Arc<T>,
    bytes: usize,
}

impl<T> CallMemory<T> {
    /// An empty memory of this size.
    pub(crate) fn new(max_bytes: usize) -> Self {
        let kept = Generations { young: HashMap::new(), old: HashMap::new(), young_bytes: 0 };
        Self { kept: Mutex::new(kept), hasher: RandomState::new(), max_bytes }
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
        let key = self.hasher.hash_one(&arguments);
        if let Some(result) = self.find(key, &arguments) {
            return result;
        }
        let result = Arc::new(compute());
        let bytes = size_of_val(&*arguments) + size(&result);
        let call = Call { arguments, result: Arc::clone(&result), bytes };
        self.lock().insert(key, call, self.max_bytes / 2);
        result
    }

    fn find(&self, key: u64, arguments: &[u64]) -> Option<Arc<T>> {
        let mut kept = self.lock();
        if let Some(call) = kept.young.get(&key) {
            return (*call.arguments == *arguments).then(|| Arc::clone(&call.result));
        }
        let call = kept.old.remove(&key)?;
        let result = (*call.arguments == *arguments).then(|| Arc::clone(&call.result));
        kept.insert(key, call, self.max_bytes / 2);
        result
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Generations<T>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> Generations<T> {
    fn insert(&mut self, key: u64, call: Call<T>, max_bytes: usize) {
        self.young_bytes += call.bytes;
        let before = self.young.insert(key, call);
        self.young_bytes -= before.map_or(0, |call| call.bytes);
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
