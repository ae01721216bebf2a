//! Results at a fitted set that several stages need, kept with the set.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Results by key. Copies share them.
///
/// Two threads may compute the same result, but none waits for another.
#[derive(Clone, Debug)]
pub(crate) struct Kept<K, V>(Arc<Mutex<BTreeMap<K, V>>>);

impl<K, V> Default for Kept<K, V> {
    fn default() -> Self {
        Self(Arc::default())
    }
}

impl<K: Ord, V: Clone> Kept<K, V> {
    /// The result for a key: the known one, or that of `find`. Results of `find` that are not `complete`, because the
    /// deadline has passed, are not kept.
    pub fn of(&self, key: K, find: impl FnOnce() -> V, is_complete: impl FnOnce() -> bool) -> V {
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = lock().get(&key) {
            return known.clone();
        }
        let found = find();
        if is_complete() {
            lock().insert(key, found.clone());
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_is_computed_once_for_all_copies_unless_it_is_incomplete() {
        let kept: Kept<&str, Vec<f64>> = Kept::default();
        assert!(kept.of("ripple", Vec::new, || false).is_empty(), "stopped by the deadline");
        let found = kept.of("ripple", || vec![3.0], || true);
        assert_eq!(kept.clone().of("ripple", || panic!("computed again"), || true), found);
    }
}
