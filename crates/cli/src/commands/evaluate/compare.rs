//! Compares the forecast errors of two models and states the verdict in one sentence.

use augsim_data::estimate_digits;
use augsim_discovery::{PredictionSet, rmse_reduction};

/// Root mean square errors of two models on the same trajectories, and the 95 % interval of their difference.
#[derive(Debug, Clone, Copy)]
pub(super) struct ErrorReduction {
    pub before: f64,
    pub after: f64,
    pub ci95: [f64; 2],
}

/// Sentence that states whether the model `what` has a smaller error than the model `than`.
///
/// Errors, in the unit of the data, are multiplied by `scale` and displayed in `unit`.
pub(super) fn verdict(what: &str, than: &str, reduction: ErrorReduction, unit: &str, scale: f64) -> String {
    let ErrorReduction { before, after, ci95: [low, high] } = reduction;
    let digits = |v: f64, ends: [f64; 2]| estimate_digits(scale * v, ends.map(|end| scale * end));
    // Both errors are printed to the digits in which they can differ.
    let [difference, low_text, high_text] = digits(before - after, [low, high]);
    let half = 0.5 * (high - low);
    let display = |v: f64| digits(v, [v - half, v + half])[0].clone();
    let figures = format!("{} {unit} against {} {unit}", display(after), display(before));
    let interval = |[a, b]: [&str; 2]| format!("95 % interval {a} to {b} {unit}");
    if low > 0.0 {
        format!(
            "{what} improves the forecasts: {figures} for {than}, {} less ({})",
            difference,
            interval([&low_text, &high_text])
        )
    } else if high < 0.0 {
        let [worse, low, high] = digits(after - before, [-high, -low]);
        format!(
            "{what} makes the forecasts worse: {figures} for {than}, {worse} more ({})",
            interval([&low, &high])
        )
    } else {
        format!(
            "{what} does not change the forecasts significantly: {figures} for {than} ({} of the difference)",
            interval([&low_text, &high_text])
        )
    }
}

/// Sentence that states whether the second of two models has a smaller error in the measure that both list first.
pub(super) fn compare_sets(
    [than, what]: [&str; 2],
    [before, after]: [&PredictionSet; 2],
    seed: u64,
) -> String {
    let (_, ci95) = rmse_reduction(&before.squares, &after.squares, seed);
    let error = |set: &PredictionSet| set.errors.first().map_or(f64::NAN, |e| e.rmse);
    let unit = before.errors.first().map_or("", |e| e.unit.as_str());
    let (unit, scale) = if unit == "m" { ("mm", 1e3) } else { (unit, 1.0) };
    verdict(what, than, ErrorReduction { before: error(before), after: error(after), ci95 }, unit, scale)
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
                .starts_with("the net improves the forecasts: 10.0 mm against 20.0 mm")
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
