//! Compares the forecast errors of two models and states the verdict in one sentence.

/// Root mean square errors of two models on the same trajectories, and the 95 % interval of their
/// difference.
#[derive(Debug, Clone, Copy)]
pub(super) struct ErrorReduction {
    pub before: f64,
    pub after: f64,
    pub ci95: [f64; 2],
}

/// States whether `what` has a smaller error than `than`. Errors are displayed in `unit`, `scale` per
/// unit of the data.
pub(super) fn verdict(what: &str, than: &str, reduction: ErrorReduction, unit: &str, scale: f64) -> String {
    let ErrorReduction { before, after, ci95: [low, high] } = reduction;
    let display = |v: f64| format!("{:.3}", scale * v);
    let figures = format!("{} {unit} against {} {unit}", display(after), display(before));
    let interval = |[a, b]: [f64; 2]| format!("95 % interval {} to {} {unit}", display(a), display(b));
    if low > 0.0 {
        format!(
            "{what} improves the forecasts: {figures} for {than}, {} less ({})",
            display(before - after),
            interval([low, high])
        )
    } else if high < 0.0 {
        let (worse, bounds) = (after - before, [-high, -low]);
        format!(
            "{what} makes the forecasts worse: {figures} for {than}, {} more ({})",
            display(worse),
            interval(bounds)
        )
    } else {
        format!(
            "{what} does not change the forecasts significantly: {figures} for {than} ({} of the difference)",
            interval([low, high])
        )
    }
}

#[cfg(test)]
mod tests {
    //! Contract: a difference within its confidence interval is not reported as an improvement.
    use super::*;

    #[test]
    fn reports_an_improvement_only_if_its_interval_is_positive() {
        let sentence = |before: f64, after: f64, ci95: [f64; 2]| {
            verdict("the net", "the physics", ErrorReduction { before, after, ci95 }, "mm", 1e3)
        };
        assert!(
            sentence(0.02, 0.01, [0.005, 0.015])
                .starts_with("the net improves the forecasts: 10.000 mm against 20.000 mm")
        );
        assert!(
            sentence(0.02, 0.019, [-0.001, 0.003])
                .starts_with("the net does not change the forecasts significantly")
        );
        assert!(sentence(0.01, 0.02, [-0.02, -0.005]).starts_with("the net makes the forecasts worse"));
        assert!(
            sentence(0.01, 0.02, [f64::NAN; 2])
                .starts_with("the net does not change the forecasts significantly")
        );
    }
}
