//! Sets that are no worse in a free run than their parts.
//!
//! A likelihood over windows can be bought by terms that drive a free run away. Whatever is added has to leave the free run over
//! held-out stretches at least as good as every fitted set without it.

use crate::free_runs::NO_WORSE;
use crate::judged::Judged;

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
