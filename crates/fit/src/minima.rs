//! Multistart search for a better local minimum than the one that the declared values lead to.

use crate::steps::{COARSE_TOLERANCE, Fit, StartingPoint};
use crate::windows::{Problem, ShootingWindow};
use augsim_system::Parameter;

/// Number of starting points of the multistart search, in addition to the declared values.
const MULTISTARTS: u32 = 6;
/// Maximum number of windows on which the starting points of the multistart search are compared.
const MAX_COMPARED_WINDOWS: usize = 48;
/// Maximum factor by which a starting value is above or below the declared value.
const MAX_START_FACTOR: f64 = 5.0;
/// Ratio of the RMSE to that of the fit from the declared values below which another minimum is preferred.
const MAX_RMSE_RATIO: f64 = 0.8;
/// Bases of the Halton sequence of starting points; parameter k uses number k, cyclically.
const HALTON_BASES: [u32; 8] = [2, 3, 5, 7, 11, 13, 17, 19];

/// Returns `declared`, the fit from the declared values, or a clearly better fit from a Halton starting
/// point.
///
/// The starting points (Halton, Numerische Mathematik 2, 1960) are compared on some of the windows. The best
/// one is then fitted to all windows, and returned if its RMSE is below [`MAX_RMSE_RATIO`] times that of
/// `declared`.
pub(crate) fn best_of_multistart(problem: &Problem<'_>, windows: &[ShootingWindow], declared: Fit) -> Fit {
    if problem.free_parameters.is_empty() || problem.is_over() {
        return declared;
    }
    let stride = windows.len().div_ceil(MAX_COMPARED_WINDOWS).max(1);
    let compared: Vec<ShootingWindow> = windows.iter().step_by(stride).cloned().collect();
    let nominal: Vec<f64> = problem.system.parameters().iter().map(|p| p.nominal).collect();
    let channel_sd = problem.channel_sd();
    // The first is the minimum of the declared values, on the same windows: the reference for the others.
    let mut start_values = vec![declared.values.clone()];
    for number in 1..=MULTISTARTS {
        let mut values = nominal.clone();
        for (k, parameter) in problem.free_parameters.iter().enumerate() {
            let share = van_der_corput(number, HALTON_BASES[k % HALTON_BASES.len()]);
            values[*parameter] = start_value(&problem.system.parameters()[*parameter], share);
        }
        start_values.push(values);
    }
    let starts: Vec<StartingPoint<'_>> = start_values
        .iter()
        .map(|values| StartingPoint { values, windows: &compared, scales: &channel_sd })
        .collect();
    let mut results = problem.fit_each(&starts, COARSE_TOLERANCE).into_iter().map(|fit| {
        let fit = fit.ok()?;
        Some((mean_rmse(problem, &fit), fit.values)).filter(|(rmse, _)| rmse.is_finite())
    });
    let Some(Some(reference)) = results.next() else { return declared };
    let mut best: Option<(f64, Vec<f64>)> = None;
    for result in results.flatten() {
        if result.0 < best.as_ref().map_or(MAX_RMSE_RATIO * reference.0, |b| b.0) {
            best = Some(result);
        }
    }
    if let Some((_, values)) = best
        && let Ok(other) =
            problem.fit(&StartingPoint { values: &values, windows, scales: &channel_sd }, COARSE_TOLERANCE)
        && mean_rmse(problem, &other) < MAX_RMSE_RATIO * mean_rmse(problem, &declared)
    {
        return other;
    }
    declared
}

/// Geometric mean of the RMSEs of all channels, which does not depend on the channels' units.
fn mean_rmse(problem: &Problem<'_>, fit: &Fit) -> f64 {
    let rms = fit.normal.rmse(problem.schema().channels.len());
    (rms.iter().map(|r| r.max(f64::MIN_POSITIVE).ln()).sum::<f64>() / rms.len().max(1) as f64).exp()
}

/// Starting value of a parameter: the point at the fraction `share`, from 0 to 1, of its range of starting
/// values.
///
/// The range is logarithmic around a declared value, linear and symmetric around a declared 0.
fn start_value(p: &Parameter, share: f64) -> f64 {
    let position = 2.0 * share - 1.0;
    let value = if p.nominal == 0.0 {
        position * p.max.min(-p.min).min(1.0)
    } else {
        p.nominal * MAX_START_FACTOR.powf(position)
    };
    value.clamp(p.min, p.max)
}

/// Element `index` of the van der Corput sequence: the index's digits in `base`, mirrored at the radix point.
fn van_der_corput(mut index: u32, base: u32) -> f64 {
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
    //! Contract: the sequence is van der Corput's; starting values stay within bounds and keep the declared
    //! sign.
    use super::*;

    #[test]
    fn sequence_reverses_the_digits_of_the_index() {
        let found: Vec<f64> = (1..=4).map(|k| van_der_corput(k, 2)).collect();
        assert_eq!(found, [0.5, 0.25, 0.75, 0.125]);
        assert!((van_der_corput(5, 3) - 7.0 / 9.0).abs() < 1e-15);
    }

    #[test]
    fn starting_values_stay_within_bounds() {
        let p = Parameter::free("k".into(), 2.0, 1.0, 4.0);
        assert_eq!([0.0, 0.5, 1.0].map(|share| start_value(&p, share)), [1.0, 2.0, 4.0]);
    }

    #[test]
    fn starting_values_reach_five_times_the_declared_value_in_both_directions() {
        let p = Parameter::free("k".into(), 2.0, 1e-3, 1e3);
        let [least, largest] = [0.0, 1.0].map(|share| start_value(&p, share));
        assert!((least - 0.4).abs() < 1e-12 && (largest - 10.0).abs() < 1e-12, "{least} to {largest}");
    }
}
