//! Other minima than the one that the declared values lead to.

use crate::steps::{Begin, Fit, ROUGHLY_SETTLED};
use crate::windows::{Problem, Shot};
use augsim_physics::model::Parameter;

/// Starts of the parameters beside the declared one.
const STARTS: u32 = 6;
/// Windows on which they are compared.
const COMPARED: usize = 48;
/// Factor by which a start may lie from the declared value, to each side.
const FARTHEST: f64 = 5.0;
/// Ratio of misfits below which another minimum is clearly the better one.
const CLEARLY: f64 = 0.8;
/// Bases of the sequence that starts come from, one for each parameter in turn.
const BASES: [u32; 8] = [2, 3, 5, 7, 11, 13, 17, 19];

/// The fit to `shots` that is given, or one from another start where that misses some of the windows clearly less. Starts are
/// those of Halton's sequence (Numerische Mathematik 2, 1960).
pub(crate) fn deepest(problem: &Problem<'_>, shots: &[Shot], declared: Fit) -> Fit {
    if problem.free.is_empty() {
        return declared;
    }
    let stride = shots.len().div_ceil(COMPARED).max(1);
    let some: Vec<Shot> = shots.iter().step_by(stride).cloned().collect();
    let nominal: Vec<f64> = problem.system.parameters().iter().map(|p| p.nominal).collect();
    let spread = problem.spread();
    // That of the declared values first.
    let mut starts = vec![declared.values.clone()];
    for number in 1..=STARTS {
        let mut values = nominal.clone();
        for (k, place) in problem.free.iter().enumerate() {
            let share = halton(number, BASES[k % BASES.len()]);
            values[*place] = start(&problem.system.parameters()[*place], share);
        }
        starts.push(values);
    }
    let begins: Vec<Begin<'_>> =
        starts.iter().map(|values| Begin { values, shots: &some, sd: &spread }).collect();
    let fits = problem.fit_each(&begins, ROUGHLY_SETTLED).into_iter();
    let mut levels = fits.map(|fit| {
        let fit = fit.ok()?;
        Some((level(problem, &fit), fit.values)).filter(|(level, _)| level.is_finite())
    });
    let Some(Some(reference)) = levels.next() else { return declared };
    let mut best: Option<(f64, Vec<f64>)> = None;
    for found in levels.flatten() {
        if found.0 < best.as_ref().map_or(CLEARLY * reference.0, |b| b.0) {
            best = Some(found);
        }
    }
    if let Some((_, values)) = best
        && let Ok(other) = problem.fit(&Begin { values: &values, shots, sd: &spread }, ROUGHLY_SETTLED)
        && level(problem, &other) < CLEARLY * level(problem, &declared)
    {
        return other;
    }
    declared
}

/// Geometric mean over channels of the root mean square misfits.
fn level(problem: &Problem<'_>, fit: &Fit) -> f64 {
    let rms = fit.normal.rms(problem.schema().channels.len());
    (rms.iter().map(|r| r.max(f64::MIN_POSITIVE).ln()).sum::<f64>() / rms.len().max(1) as f64).exp()
}

/// A start at a share of the way from the smallest to the largest: in proportion to the declared value where it has a sign.
fn start(p: &Parameter, share: f64) -> f64 {
    let turn = 2.0 * share - 1.0;
    let value =
        if p.nominal == 0.0 { turn * p.max.min(-p.min).min(1.0) } else { p.nominal * FARTHEST.powf(turn) };
    value.clamp(p.min, p.max)
}

/// Number `index` of the sequence of van der Corput in a base: the digits of the index behind the point, in reverse.
fn halton(mut index: u32, base: u32) -> f64 {
    let (mut share, mut value) = (1.0, 0.0);
    while index > 0 {
        share /= f64::from(base);
        value += share * f64::from(index % base);
        index /= base;
    }
    value
}

#[cfg(test)]
mod tests {
    //! Contract: the sequence is Halton's, and starts stay within bounds and on the side of the declared value.
    use super::*;

    #[test]
    fn digits_are_reversed() {
        let found: Vec<f64> = (1..=4).map(|k| halton(k, 2)).collect();
        assert_eq!(found, [0.5, 0.25, 0.75, 0.125]);
        assert!((halton(5, 3) - 7.0 / 9.0).abs() < 1e-15);
    }

    #[test]
    fn starts_stay_within_bounds() {
        let p = Parameter::free("k".into(), 2.0, 1.0, 4.0);
        assert_eq!([0.0, 0.5, 1.0].map(|share| start(&p, share)), [1.0, 2.0, 4.0]);
    }
    #[test]
    fn starts_reach_five_times_the_declared_value_to_each_side() {
        let p = Parameter::free("k".into(), 2.0, 1e-3, 1e3);
        let [least, largest] = [0.0, 1.0].map(|share| start(&p, share));
        assert!((least - 0.4).abs() < 1e-12 && (largest - 10.0).abs() < 1e-12, "{least} to {largest}");
    }
}
