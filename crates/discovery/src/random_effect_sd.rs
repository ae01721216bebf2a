//! Most likely standard deviation of a random effect, with its interval.

use crate::statistics::chi2_quantile;
use augsim_physics::system::Drawn;

/// Minimum standard deviation, in units of the typical one; smaller scatters have no practical cause.
const MIN_SD: f64 = 0.02;
/// Number of standard deviations that are tried, evenly spaced in the logarithm.
const GRID_POINTS: usize = 60;

/// Minimum and maximum standard deviation.
fn bounds(drawn: &Drawn) -> (f64, f64) {
    drawn.scatter.parameters.first().map_or((1e-6, 1.0), |p| (MIN_SD * p.typical, p.max))
}

/// Minimum of a function of the standard deviation; `None` if it is at the smallest one.
pub(crate) fn most_likely_sd(drawn: &Drawn, criterion: impl Fn(f64) -> f64) -> Option<f64> {
    let (least, most) = bounds(drawn);
    let span = (most / least).ln();
    let grid = (0..=GRID_POINTS).map(|i| least * (span * i as f64 / GRID_POINTS as f64).exp());
    let values: Vec<(f64, f64)> = grid.map(|sd| (criterion(sd), sd)).collect();
    let best = (0..values.len()).min_by(|&a, &b| values[a].0.total_cmp(&values[b].0))?;
    if best == 0 {
        return None;
    }
    let (mut low, mut high) = (values[best - 1].1.ln(), values[(best + 1).min(GRID_POINTS)].1.ln());
    for _ in 0..30 {
        let [a, b] = [(2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0];
        if criterion(a.exp()) < criterion(b.exp()) { high = b } else { low = a }
    }
    Some((0.5 * (low + high)).exp())
}

/// 95 % interval by the profile likelihood.
pub(crate) fn interval(drawn: &Drawn, criterion: impl Fn(f64) -> f64, best: f64) -> [f64; 2] {
    let edge = criterion(best) + chi2_quantile(0.05, 1.0);
    let (least, most) = bounds(drawn);
    [(least, 0.0), (most, most)].map(|(end, bound)| {
        if criterion(end) < edge {
            return bound;
        }
        let (mut inside, mut outside) = (best.ln(), end.ln());
        for _ in 0..40 {
            let middle = 0.5 * (inside + outside);
            if criterion(middle.exp()) < edge { inside = middle } else { outside = middle }
        }
        inside.exp()
    })
}
