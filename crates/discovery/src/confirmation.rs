//! When the held-out part confirms what the training part found.

/// Gain in the criterion on the training part that is clear evidence by itself, and the loss on the held-out part, as a share
/// of it, that is tolerated then.
const CLEAR: f64 = 25.0;
const TOLERATED: f64 = 0.1;

/// Whether the held-out part confirms what the training part found: by a `gain` there, in ln likelihood, or, where the training
/// part speaks clearly (`trained` in the criterion), by no more than chance against it (the estimate of an effect that is there
/// is above its truth in one half of all samples, and then the other half may see a small loss).
pub(crate) fn holds(trained: f64, gain: f64) -> bool {
    gain > 0.0 || (trained > CLEAR && gain > -TOLERATED * trained)
}

#[cfg(test)]
mod tests {
    //! Contract: a gain on the held-out part confirms; a loss there is tolerated only behind clear evidence, and only a small one.
    use super::*;

    #[test]
    fn a_held_out_loss_is_tolerated_behind_odds_of_a_hundred_thousand_only() {
        // The training part's gain is in -2 ln likelihood: 20 is odds of 22,000 to 1, 30 is odds of 3,300,000 to 1.
        assert!(holds(1.0, 0.1) && !holds(20.0, -0.1) && holds(30.0, -0.1));
    }

    #[test]
    fn a_tolerated_loss_is_a_small_share_of_the_gain() {
        assert!(holds(100.0, -8.0) && !holds(100.0, -12.0));
    }
}
