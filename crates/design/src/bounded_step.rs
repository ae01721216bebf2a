//! Step to the maximum of a quadratic log density within the bounds of the parameters.
//!
//! With the gradient g and the information H at the current point, and the rows R of the bounds at which parameters are
//! held,
//!
//! ```text
//! (1)  maximise  g'd - 1/2 d'H d   with  R d = c:    d = H⁻¹ (g + R'λ),   λ = (R H⁻¹ R')⁻¹ (c - R H⁻¹ g)
//! ```
//!
//! Active-set method (Nocedal and Wright 2006, section 16.5): the step goes towards the maximum on the face of the held bounds, is
//! held at the first bound in its way, and is released where the function grows inwards.

use augsim_linear::{Mat, PositiveInverse, invert_positive_definite};

/// Bounds low <= row · d <= high of a step d; both contain 0.
#[derive(Clone, Debug)]
pub(crate) struct Bound<'a> {
    /// Row of the factor, by which the coordinate of a parameter depends on the step.
    pub row: &'a [f64],
    /// Smallest change of the coordinate, 0 or less.
    pub low: f64,
    /// Largest change of the coordinate, 0 or more.
    pub high: f64,
}

/// A bound that holds a parameter: row · d = change.
struct Held {
    index: usize,
    change: f64,
    /// Whether it is the upper bound.
    is_upper: bool,
}

/// Maximum number of bounds that are taken up or released in one step, for each bound; few need more than one.
const MAX_CHANGES: usize = 10;

/// Square of the share of a way below which its part along a row is a rounding error.
const ROUNDING: f64 = 1e-24;

/// Computes the step within `bounds`, and the increase of twice the log density that the quadratic function promises.
///
/// `inverse` is H⁻¹. The increase is never negative: each part of the step goes uphill.
pub(crate) fn bounded_step(inverse: &Mat<f64>, gradient: &[f64], bounds: &[Bound<'_>]) -> (Vec<f64>, f64) {
    let mut held: Vec<Held> = Vec::new();
    let mut step = vec![0.0; gradient.len()];
    let mut gain = 0.0;
    for _ in 0..=MAX_CHANGES * bounds.len() {
        let Some((end, multipliers)) = maximum(inverse, gradient, bounds, &held) else { break };
        let way: Vec<f64> = end.iter().zip(&step).map(|(to, from)| to - from).collect();
        let first = first_crossed(&step, &way, bounds, &held);
        let share = first.as_ref().map_or(1.0, |(share, _)| *share);
        // On the face of the held bounds the function falls by the square of the distance from its maximum there.
        let at_end =
            dot(gradient, &end) - held.iter().zip(&multipliers).map(|(h, l)| h.change * l).sum::<f64>();
        gain = at_end - (1.0 - share) * (1.0 - share) * (at_end - gain);
        step.iter_mut().zip(&way).for_each(|(d, way)| *d += share * way);
        match (first, most_inwards(&held, &multipliers)) {
            (Some((_, bound)), _) => held.push(bound),
            (None, Some(released)) => drop(held.remove(released)),
            (None, None) => break,
        }
    }
    (step, gain)
}

/// The held bound, by its place in `held`, from which the function grows fastest inwards; `None` if it does from none.
fn most_inwards(held: &[Held], multipliers: &[f64]) -> Option<usize> {
    let inwards = held.iter().zip(multipliers).map(|(h, l)| if h.is_upper { *l } else { -l });
    let most = inwards.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    (most.1 > 0.0).then_some(most.0)
}

/// The maximum (1) with these bounds held, and its multipliers λ; `None` if the bounds depend on each other.
fn maximum(
    inverse: &Mat<f64>,
    gradient: &[f64],
    bounds: &[Bound<'_>],
    held: &[Held],
) -> Option<(Vec<f64>, Vec<f64>)> {
    let k = gradient.len();
    let solved = |right: &[f64]| -> Vec<f64> {
        (0..k).map(|i| (0..k).map(|j| inverse[(i, j)] * right[j]).sum()).collect()
    };
    let mut end = solved(gradient);
    let by_bound: Vec<Vec<f64>> = held.iter().map(|h| solved(bounds[h.index].row)).collect();
    let lower = |i: usize, j: usize| if i < j { 0.0 } else { dot(bounds[held[i].index].row, &by_bound[j]) };
    let PositiveInverse { inverse, .. } =
        invert_positive_definite(Mat::from_fn(held.len(), held.len(), lower))?;
    let missing: Vec<f64> = held.iter().map(|h| h.change - dot(bounds[h.index].row, &end)).collect();
    let multipliers: Vec<f64> =
        (0..held.len()).map(|i| (0..held.len()).map(|j| inverse[(i, j)] * missing[j]).sum()).collect();
    for (by_bound, multiplier) in by_bound.iter().zip(&multipliers) {
        end.iter_mut().zip(by_bound).for_each(|(d, b)| *d += b * multiplier);
    }
    Some((end, multipliers))
}

/// The bound that is reached first on the `way` from `step`, after this share of it; `None` if none is.
fn first_crossed(step: &[f64], way: &[f64], bounds: &[Bound<'_>], held: &[Held]) -> Option<(f64, Held)> {
    let crossed = |(index, bound): (usize, &Bound<'_>)| -> Option<(f64, Held)> {
        if held.iter().any(|h| h.index == index) {
            return None;
        }
        let (now, speed) = (dot(bound.row, step), dot(bound.row, way));
        if speed * speed <= ROUNDING * dot(bound.row, bound.row) * dot(way, way) {
            return None;
        }
        let is_upper = speed > 0.0;
        let change = if is_upper { bound.high } else { bound.low };
        let share = ((change - now) / speed).max(0.0);
        (share < 1.0).then_some((share, Held { index, change, is_upper }))
    };
    bounds.iter().enumerate().filter_map(crossed).min_by(|a, b| a.0.total_cmp(&b.0))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    //! Contract: no point within the bounds has a larger value than the step.
    use super::*;

    /// Twice the quadratic function at d, for H = [[2, 1], [1, 2]].
    fn value(gradient: &[f64], d: &[f64]) -> f64 {
        let bend = 2.0 * d[0] * d[0] + 2.0 * d[0] * d[1] + 2.0 * d[1] * d[1];
        2.0 * dot(gradient, d) - bend
    }

    fn inverse() -> Mat<f64> {
        Mat::from_fn(2, 2, |i, j| if i == j { 2.0 / 3.0 } else { -1.0 / 3.0 })
    }

    /// The largest value on a grid within the bounds.
    fn best_on_grid(gradient: &[f64], bounds: &[Bound<'_>]) -> f64 {
        let places = || (-300..=300).map(|k| 0.01 * f64::from(k));
        let points = places().flat_map(|x| places().map(move |y| [x, y]));
        let is_within =
            |d: &[f64; 2]| bounds.iter().all(|b| (b.low - 1e-9..=b.high + 1e-9).contains(&dot(b.row, d)));
        points.filter(is_within).map(|d| value(gradient, &d)).fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn the_step_is_the_maximum_within_the_bounds() {
        let (skew, own) = ([[1.0, 0.0], [0.5, 1.0]], [[1.0, 0.0], [0.0, 1.0]]);
        let cases = [
            (skew, [3.0, 1.0], [[-9.0, 9.0], [-9.0, 9.0]]),
            (skew, [3.0, 1.0], [[-1.0, 0.5], [-9.0, 9.0]]),
            (skew, [3.0, 1.0], [[0.0, 0.0], [-9.0, 9.0]]),
            (skew, [4.0, 4.0], [[-1.0, 0.5], [-1.0, 0.7]]),
            (skew, [-4.0, -3.0], [[-0.2, 1.0], [f64::NEG_INFINITY, 1.0]]),
            (skew, [-4.0, 1.0], [[-1.5, 1.0], [0.0, f64::INFINITY]]),
            // The first way is held at the upper bound of the first; beside the second bound it is released.
            (own, [-1.0, -3.0], [[-9.0, 0.0], [-0.5, 9.0]]),
            // A parameter without uncertainty at its bound does not move; rows that depend on each other hold once.
            ([[0.0, 0.0], [0.0, 1.0]], [3.0, 1.0], [[0.0, 0.0], [-0.5, 0.2]]),
            ([[1.0, 0.0], [2.0, 0.0]], [3.0, 1.0], [[-1.0, 0.5], [-2.0, 1.0]]),
        ];
        for (rows, gradient, limits) in cases {
            let bounds: Vec<Bound<'_>> =
                rows.iter().zip(limits).map(|(row, [low, high])| Bound { row, low, high }).collect();
            let (step, gain) = bounded_step(&inverse(), &gradient, &bounds);
            assert!((gain - value(&gradient, &step)).abs() < 1e-12, "{gradient:?} {step:?} {gain}");
            let best = best_on_grid(&gradient, &bounds);
            assert!(gain > best - 1e-9 && gain < best + 2e-3, "{gradient:?} {step:?} {gain} {best}");
            for b in &bounds {
                assert!((b.low - 1e-12..=b.high + 1e-12).contains(&dot(b.row, &step)), "{step:?}");
            }
        }
    }
}
