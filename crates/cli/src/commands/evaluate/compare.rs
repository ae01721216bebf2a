//! Whether what was added makes forecasts better, in one sentence.

/// By how much the root mean square error fell on the same trajectories, with its 95 % interval.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fall {
    pub before: f64,
    pub after: f64,
    pub ci95: [f64; 2],
}

/// The verdict on `what` against `than`; errors are told in `unit`, of which one of the data has `scale`.
pub(super) fn verdict(what: &str, than: &str, fall: Fall, unit: &str, scale: f64) -> String {
    let Fall { before, after, ci95: [low, high] } = fall;
    let told = |v: f64| format!("{:.3}", scale * v);
    let figures = format!("{} {unit} against {} {unit}", told(after), told(before));
    let interval = |[a, b]: [f64; 2]| format!("95 % interval {} to {} {unit}", told(a), told(b));
    if low > 0.0 {
        format!(
            "{what} helps: {figures} of {than}, {} less ({})",
            told(before - after),
            interval([low, high])
        )
    } else if high < 0.0 {
        let (worse, bounds) = (after - before, [-high, -low]);
        format!(
            "{what} makes forecasts worse: {figures} of {than}, {} more ({})",
            told(worse),
            interval(bounds)
        )
    } else {
        format!(
            "{what} does not help: {figures} of {than}; the difference may be chance ({})",
            interval([low, high])
        )
    }
}

#[cfg(test)]
mod tests {
    //! Contract: what chance may have made is no help.
    use super::*;

    #[test]
    fn a_gain_is_one_only_where_its_interval_is_above_zero() {
        let of = |before: f64, after: f64, ci95: [f64; 2]| {
            verdict("the net", "the physics", Fall { before, after, ci95 }, "mm", 1e3)
        };
        assert!(of(0.02, 0.01, [0.005, 0.015]).starts_with("the net helps: 10.000 mm against 20.000 mm"));
        assert!(of(0.02, 0.019, [-0.001, 0.003]).starts_with("the net does not help"));
        assert!(of(0.01, 0.02, [-0.02, -0.005]).starts_with("the net makes forecasts worse"));
        assert!(of(0.01, 0.02, [f64::NAN; 2]).starts_with("the net does not help"));
    }
}
