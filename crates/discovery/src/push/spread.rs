//! The standard deviation that is most likely, with its interval.

use crate::statistics::chi2_quantile;
use augsim_physics::push::effects::SCATTER_SPEC;

/// Least standard deviation that is looked for, m: engines and outlines are not better.
const LEAST_M: f64 = 2e-5;
/// Values of the standard deviation that are tried, evenly in its logarithm.
const GRID: usize = 60;

/// Where a function of the standard deviation is least; none where that is at no scatter.
pub(crate) fn most_likely(of: impl Fn(f64) -> f64) -> Option<f64> {
    let values: Vec<(f64, f64)> = grid().map(|sd| (of(sd), sd)).collect();
    let best = (0..values.len()).min_by(|&a, &b| values[a].0.total_cmp(&values[b].0))?;
    if best == 0 {
        return None;
    }
    let (mut low, mut high) = (values[best - 1].1.ln(), values[(best + 1).min(GRID)].1.ln());
    for _ in 0..30 {
        let [a, b] = [(2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0];
        if of(a.exp()) < of(b.exp()) { high = b } else { low = a }
    }
    Some((0.5 * (low + high)).exp())
}

fn grid() -> impl Iterator<Item = f64> {
    let span = (SCATTER_SPEC.parameters[0].max / LEAST_M).ln();
    (0..=GRID).map(move |i| LEAST_M * (span * i as f64 / GRID as f64).exp())
}

/// 95 % interval by the profile.
pub(crate) fn interval(of: impl Fn(f64) -> f64, best: f64) -> [f64; 2] {
    let edge = of(best) + chi2_quantile(0.05, 1.0);
    let ends = [(LEAST_M, 0.0), (SCATTER_SPEC.parameters[0].max, SCATTER_SPEC.parameters[0].max)];
    ends.map(|(end, bound)| {
        if of(end) < edge {
            return bound;
        }
        let (mut inside, mut outside) = (best.ln(), end.ln());
        for _ in 0..40 {
            let middle = 0.5 * (inside + outside);
            if of(middle.exp()) < edge { inside = middle } else { outside = middle }
        }
        inside.exp()
    })
}
