//! The standard deviation of a draw that is most likely, with its interval.

use crate::statistics::chi2_quantile;
use augsim_physics::system::Drawn;

/// Least standard deviation that is looked for, in units of the typical one: engines are not better.
const LEAST: f64 = 0.02;
/// Values of the standard deviation that are tried, evenly in its logarithm.
const GRID: usize = 60;

/// Least and largest standard deviation.
fn bounds(drawn: &Drawn) -> (f64, f64) {
    drawn.scatter.parameters.first().map_or((1e-6, 1.0), |p| (LEAST * p.typical, p.max))
}

/// Where a function of the standard deviation is least; none where that is at no scatter.
pub(crate) fn most_likely(drawn: &Drawn, of: impl Fn(f64) -> f64) -> Option<f64> {
    let (least, most) = bounds(drawn);
    let span = (most / least).ln();
    let grid = (0..=GRID).map(|i| least * (span * i as f64 / GRID as f64).exp());
    let values: Vec<(f64, f64)> = grid.map(|sd| (of(sd), sd)).collect();
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

/// 95 % interval by the profile.
pub(crate) fn interval(drawn: &Drawn, of: impl Fn(f64) -> f64, best: f64) -> [f64; 2] {
    let edge = of(best) + chi2_quantile(0.05, 1.0);
    let (least, most) = bounds(drawn);
    [(least, 0.0), (most, most)].map(|(end, bound)| {
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
