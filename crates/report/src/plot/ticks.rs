//! Tick positions by the extended Wilkinson algorithm.
//!
//! Source: Talbot, Lin and Hanrahan, "An Extension of Wilkinson's Algorithm for Positioning Tick Labels on Axes",
//! IEEE TVCG 16, 2010.
//!
//! It searches for the ticks with the largest score
//!
//! 1. score = 0.25 simplicity + 0.2 coverage + 0.5 density + 0.05 legibility, where legibility is always 1 here.
//!
//! The functions `*_max` are upper bounds of the terms, with which the search skips candidates that cannot be
//! best.

/// Step mantissas of ticks in order of preference (Q in the paper).
const STEPS: [f64; 6] = [1.0, 5.0, 2.0, 2.5, 4.0, 3.0];
/// Weights of simplicity, coverage and density in the score (w in the paper).
const WEIGHTS: [f64; 3] = [0.25, 0.2, 0.5];

fn score(simplicity: f64, coverage: f64, density: f64) -> f64 {
    WEIGHTS[0] * simplicity + WEIGHTS[1] * coverage + WEIGHTS[2] * density + 0.05
}

fn simplicity(rank: usize, skip: f64, start: f64, end: f64, step: f64) -> f64 {
    let eps = 1e-10;
    let offset = (start / step).rem_euclid(1.0);
    let holds_zero = (offset < eps || 1.0 - offset < eps) && start <= 0.0 && end >= 0.0;
    simplicity_max(rank, skip) - f64::from(u8::from(!holds_zero))
}

fn simplicity_max(rank: usize, skip: f64) -> f64 {
    2.0 - rank as f64 / (STEPS.len() as f64 - 1.0) - skip
}

fn coverage(low: f64, high: f64, start: f64, end: f64) -> f64 {
    let range = 0.1 * (high - low);
    1.0 - 0.5 * ((high - end).powi(2) + (low - start).powi(2)) / (range * range)
}

fn coverage_max(low: f64, high: f64, span: f64) -> f64 {
    let range = high - low;
    if span > range { 1.0 - ((span - range) / 2.0 / (0.1 * range)).powi(2) } else { 1.0 }
}

fn density(count: f64, target: f64, low: f64, high: f64, start: f64, end: f64) -> f64 {
    let actual = (count - 1.0) / (end - start);
    let wanted = (target - 1.0) / (end.max(high) - start.min(low));
    2.0 - (actual / wanted).max(wanted / actual)
}

fn density_max(count: f64, target: f64) -> f64 {
    if count >= target { 2.0 - (count - 1.0) / (target - 1.0) } else { 1.0 }
}

/// About `target` round tick values inside `[low, high]`, ascending; both ends if there are none.
///
/// Unlike in the paper's default, no tick is outside the range, since the frame ends where the data end.
pub(crate) fn linear(low: f64, high: f64, target: usize) -> Vec<f64> {
    if !(low.is_finite() && high.is_finite()) || high - low <= f64::EPSILON * low.abs().max(high.abs()) {
        return if low.is_finite() { vec![low] } else { Vec::new() };
    }
    let target = target.max(2) as f64;
    let slack = 1e-9 * (high - low);
    let mut best: Option<(f64, f64, f64, f64)> = None; // score, start, step, count
    let best_score = |best: &Option<(f64, f64, f64, f64)>| best.map_or(-2.0, |b| b.0);
    'skips: for skip in 1..=20_u32 {
        let skip = f64::from(skip);
        for (rank, q) in STEPS.iter().enumerate() {
            let most_simple = simplicity_max(rank, skip);
            if score(most_simple, 1.0, 1.0) < best_score(&best) {
                break 'skips;
            }
            for count in 2..=40_u32 {
                let count = f64::from(count);
                let most_dense = density_max(count, target);
                if score(most_simple, 1.0, most_dense) < best_score(&best) {
                    break;
                }
                let delta = (high - low) / (count + 1.0) / (skip * q);
                let first_power = delta.log10().ceil() as i32;
                for power in first_power..first_power + 8 {
                    let step = skip * q * 10f64.powi(power);
                    let most_cover = coverage_max(low, high, step * (count - 1.0));
                    if score(most_simple, most_cover, most_dense) < best_score(&best) {
                        break;
                    }
                    let first = (high / step).floor() * skip - (count - 1.0) * skip;
                    let last = (low / step).ceil() * skip;
                    let mut position = first.min(last);
                    while position <= first.max(last) {
                        let start = position * step / skip;
                        let end = start + step * (count - 1.0);
                        position += 1.0;
                        if start < low - slack || end > high + slack {
                            continue;
                        }
                        let value = score(
                            simplicity(rank, skip, start, end, step),
                            coverage(low, high, start, end),
                            density(count, target, low, high, start, end),
                        );
                        if value > best_score(&best) {
                            best = Some((value, start, step, count));
                        }
                    }
                }
            }
        }
    }
    match best {
        None => vec![low, high],
        Some((_, start, step, count)) => (0..count as u32)
            .map(|i| {
                let value = start + f64::from(i) * step;
                if value.abs() < step * 1e-9 { 0.0 } else { value }
            })
            .collect(),
    }
}

/// Tick values of a logarithmic axis, ascending.
///
/// Three or more decades: about `target` powers of ten. Fewer: 1, 2 and 5 times powers of ten, or, if these
/// are fewer than three, round linear values.
pub(crate) fn logarithmic(low: f64, high: f64, target: usize) -> Vec<f64> {
    let (first, last) = (low.log10().ceil() as i32, high.log10().floor() as i32);
    let decades = last - first + 1;
    if decades >= 3 {
        let stride = usize::try_from(decades).unwrap_or(1).div_ceil(target.max(2) + 2);
        return (first..=last).step_by(stride).map(|p| 10f64.powi(p)).collect();
    }
    let dense: Vec<f64> = (first - 1..=last)
        .flat_map(|p| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(p)))
        .filter(|v| (low..=high).contains(v))
        .collect();
    if dense.len() >= 3 { dense } else { linear(low, high, target) }
}

/// Smallest number of decimals that shows all tick values without rounding, at most 9.
pub(crate) fn decimals(ticks: &[f64]) -> usize {
    (0..9)
        .find(|&d| {
            let scale = 10f64.powi(i32::try_from(d).unwrap_or(0));
            ticks.iter().all(|t| {
                let scaled = t * scale;
                (scaled - scaled.round()).abs() < 1e-6 * scaled.abs().max(1.0)
            })
        })
        .unwrap_or(9)
}

#[cfg(test)]
mod tests {
    //! Contract: ticks are inside the range, ascending and about as many as requested, for any finite range;
    //! common ranges have the expected ticks.
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn common_ranges_have_the_expected_ticks() {
        assert_eq!(linear(0.0, 100.0, 5), [0.0, 25.0, 50.0, 75.0, 100.0]);
        assert_eq!(linear(-0.02, 1.03, 5), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(linear(0.0, 6.65, 7), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(logarithmic(0.008, 1200.0, 5), [0.01, 0.1, 1.0, 10.0, 100.0, 1000.0]);
        assert_eq!(logarithmic(0.9, 30.0, 5), [1.0, 2.0, 5.0, 10.0, 20.0]);
    }

    #[test]
    fn a_range_without_extent_has_one_tick() {
        assert_eq!(linear(3.0, 3.0, 5), [3.0]);
        assert!(linear(f64::NAN, 3.0, 5).is_empty());
    }

    proptest! {
        #[test]
        fn ticks_are_inside_ascending_and_few(low in -1e6..1e6_f64, span in 1e-6..1e6_f64, target in 3..9_usize) {
            let high = low + span;
            prop_assume!(span > 1e-7 * low.abs());
            let ticks = linear(low, high, target);
            prop_assert!(ticks.len() >= 2 && ticks.len() <= 3 * target, "{ticks:?}");
            prop_assert!(ticks.windows(2).all(|w| w[0] < w[1]), "{ticks:?}");
            let slack = 1e-6 * span;
            prop_assert!(ticks.iter().all(|t| *t >= low - slack && *t <= high + slack), "{ticks:?}");
        }
    }
}
