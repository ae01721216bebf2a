//! Fallible parallel work whose result does not depend on the number of threads.

use rayon::prelude::*;

/// Collects results of parallel work in its order, and returns the first error in that order.
///
/// Rayon's `collect` into a `Result` would return whichever error happens to occur first in time.
///
/// # Errors
/// The first error in the order of the work.
pub fn collect_in_order<T: Send, E: Send>(
    work: impl IndexedParallelIterator<Item = Result<T, E>>,
) -> Result<Vec<T>, E> {
    work.collect::<Vec<_>>().into_iter().collect()
}

#[cfg(test)]
mod tests {
    //! Contract: results keep their order, and the first error in that order is returned.
    use super::*;
    use std::time::Duration;

    #[test]
    fn the_first_error_in_order_is_returned() {
        let fail_if_odd = |k: u64| -> Result<u64, u64> {
            std::thread::sleep(Duration::from_millis(16 - 2 * k));
            if k % 2 == 1 { Err(k) } else { Ok(k) }
        };
        assert_eq!(collect_in_order((0..8_u64).collect::<Vec<_>>().into_par_iter().map(fail_if_odd)), Err(1));
        assert_eq!(collect_in_order([4_u64, 2, 0].into_par_iter().map(fail_if_odd)), Ok(vec![4, 2, 0]));
    }
}
