//! Highest peaks of the periodograms at a fitted set, kept with the set.

use crate::addition::Addition;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// Parameter values of the peaks of each periodic effect at one fitted set, by the effect's label.
///
/// Several searches linearise at the same set, and a periodogram costs hundreds of simulations. Copies of the set share
/// the peaks.
#[derive(Clone, Debug, Default)]
pub(crate) struct CyclePeaks(Arc<Mutex<BTreeMap<String, Vec<Vec<f64>>>>>);

impl CyclePeaks {
    /// The peaks of an effect: those that are known, or the ones that `find` returns. `None` of `find` is not kept.
    pub fn of(&self, effect: &Addition, find: impl FnOnce() -> Option<Vec<Vec<f64>>>) -> Vec<Vec<f64>> {
        let label = effect.label();
        let lock = || self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let known = lock().get(&label).cloned();
        // Two threads may compute the same peaks, but none waits for another.
        let Some(peaks) = known.or_else(find) else { return Vec::new() };
        lock().insert(label, peaks.clone());
        peaks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::addition::Split;

    #[test]
    fn peaks_are_computed_once_for_all_copies_of_a_set_unless_they_are_incomplete() {
        let effect = Addition::Split(Arc::new(Split { index: 0, kind: "ripple".to_owned() }));
        let peaks = CyclePeaks::default();
        assert!(peaks.of(&effect, || None).is_empty(), "stopped by the deadline");
        let found = peaks.of(&effect, || Some(vec![vec![0.0, 3.0]]));
        assert_eq!(peaks.clone().of(&effect, || panic!("computed again")), found);
    }
}
