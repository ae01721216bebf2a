//! When the loop is repeated on folds, and how often these find a kind again.

use crate::result::ErrorTable;

/// Folds.
pub(crate) const FOLDS: usize = 5;

/// Whether there is error to remove and the interval of the reduction includes no change.
pub(crate) fn open(error: &ErrorTable) -> bool {
    // An interval that is not a number is open as well.
    let settled = error.reduction.ci95[0] > 0.0;
    error.explained_share.is_some() && !settled
}

/// In how many folds a kind was found.
pub(crate) fn folds_that_found(folds: &[Vec<String>], kind: &str) -> usize {
    folds.iter().filter(|found| found.iter().any(|k| k == kind)).count()
}
