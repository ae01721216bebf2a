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
