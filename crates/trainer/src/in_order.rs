//! Work on many threads that may fail, with one answer whatever the threads.

use rayon::prelude::*;

/// Results in the order of the work. Of several faults the first in that order is told: a parallel collection would tell the one that
/// happens to come first.
///
/// # Errors
/// The first fault.
pub fn in_order<T: Send, E: Send>(
    work: impl IndexedParallelIterator<Item = Result<T, E>>,
) -> Result<Vec<T>, E> {
    work.collect::<Vec<_>>().into_iter().collect()
}

#[cfg(test)]
mod tests {
    //! Contract: results keep their order, and the first fault is told although a later one comes sooner.
    use super::*;
    use std::time::Duration;

    #[test]
    fn the_first_fault_is_told() {
        let odd_is_wrong = |k: u64| -> Result<u64, u64> {
            std::thread::sleep(Duration::from_millis(16 - 2 * k));
            if k % 2 == 1 { Err(k) } else { Ok(k) }
        };
        assert_eq!(in_order((0..8_u64).collect::<Vec<_>>().into_par_iter().map(odd_is_wrong)), Err(1));
        assert_eq!(in_order([4_u64, 2, 0].into_par_iter().map(odd_is_wrong)), Ok(vec![4, 2, 0]));
    }
}
