//! Sets that are no worse in a free run than their parts.
//!
//! A likelihood over windows can be bought by terms that drive a free run away. Whatever is added has to leave the free run over
//! held-out stretches at least as good as every fitted set without it.

use crate::free_runs::NO_WORSE;
use crate::search::Judged;

/// Whether no fitted part of a set has clearly smaller errors in free runs than the set. Without free runs every set is sound.
pub(crate) fn is_sound(judged: &Judged, tried: &[Judged]) -> bool {
    let is_part = |other: &Judged| {
        other.additions().len() < judged.additions().len()
            && other.additions().iter().all(|a| judged.additions().contains(a))
    };
    is_no_worse(
        judged.free_run,
        tried.iter().filter(|other| is_part(other)).filter_map(|other| other.free_run),
    )
}

/// Ratio of free runs' errors below which one set runs clearly better than another.
const CLEARLY: f64 = 0.9;

/// The sound set that has the smallest errors in free runs, where these are clearly smaller than those of `best`; it explains the
/// training part better than the calibrated model, whose criterion is `base`.
pub(crate) fn runs_best<'t>(tried: &'t [Judged], best: &Judged, base: f64) -> Option<&'t Judged> {
    let limit = CLEARLY * best.free_run?;
    let clear = tried.iter().filter(|j| j.free_run.is_some_and(|e| e < limit) && j.criterion < base);
    let sound = clear.filter(|j| is_sound(j, tried));
    sound.min_by(|a, b| a.free_run.unwrap_or(f64::INFINITY).total_cmp(&b.free_run.unwrap_or(f64::INFINITY)))
}

/// Whether an error is no worse than the least of `others`. What runs away is worse than what does not, and as good as what runs
/// away as well.
fn is_no_worse(error: Option<f64>, others: impl Iterator<Item = f64>) -> bool {
    error.is_none_or(|error| error <= NO_WORSE * others.fold(f64::INFINITY, f64::min))
}

/// The best by criterion among the sound.
pub(crate) fn best_sound(tried: &[Judged]) -> Option<&Judged> {
    let sound = tried.iter().filter(|j| is_sound(j, tried));
    sound.min_by(|a, b| a.criterion.total_cmp(&b.criterion))
}

#[cfg(test)]
mod tests {
    //! Contract: a set is refused for the sake of a part that runs better, whether it runs badly or away; without free runs
    //! none is refused.
    use super::*;

    #[test]
    fn a_set_that_runs_worse_than_a_part_is_not_sound() {
        assert!(is_no_worse(Some(0.3), [0.5, 0.4].into_iter()));
        assert!(!is_no_worse(Some(0.45), [0.5, 0.4].into_iter()));
        assert!(!is_no_worse(Some(f64::INFINITY), [0.5, f64::INFINITY].into_iter()));
        assert!(is_no_worse(Some(f64::INFINITY), [f64::INFINITY].into_iter()));
        assert!(is_no_worse(Some(0.5), [].into_iter()));
        assert!(is_no_worse(None, [0.1].into_iter()));
    }
}
