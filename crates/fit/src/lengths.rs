//! Selection of the window length from which the parameters are taken.
//!
//! Missing effects and process noise accumulate along a window. Parameters from long windows compensate for
//! them and then have large residuals over short windows; parameters from short windows are disturbed by
//! measurement noise, and their predictions drift over long windows. A forecast may have any of these
//! lengths, so the parameters are chosen that predict windows of all lengths best.

use crate::steps::{COARSE_TOLERANCE, Fit, StartingPoint};
use crate::windows::{NEGLIGIBLE_RMSE, Problem};

/// Advantage in ln likelihood for which the parameters fitted to shorter windows replace those from longer
/// ones.
const MIN_LN_LIKELIHOOD_GAIN: f64 = 2.0;
/// Upper bound of the difference between the ln RMSEs that two parameter sets reach on one window.
///
/// It is the difference between the negligible RMSE, 10^-6 of a channel's standard deviation, and 1000 times
/// that standard deviation.
const MAX_LN_RMSE_DIFFERENCE: f64 = 20.0;

/// Chooses the fit to the longest windows whose predictions over all window lengths are close to the best.
///
/// Returns its index in `fits`, which are ordered by increasing window length. The initial state of each
/// predicted window is estimated; `channel_sd` are the residual scales that these estimates begin with.
pub(crate) fn select_window_length(problem: &Problem<'_>, fits: &[Fit], channel_sd: &[f64]) -> usize {
    let states_only =
        Problem { free_parameters: Vec::new(), free_states: problem.free_states.clone(), ..*problem };
    let floors: Vec<f64> =
        channel_sd.iter().map(|sd| (NEGLIGIBLE_RMSE * sd).max(f64::MIN_POSITIVE)).collect();
    let ln_rmse = |fit: &Fit| {
        let rms = fit.normal.rmse(channel_sd.len());
        rms.iter().zip(&floors).map(|(rms, floor)| rms.max(*floor).ln()).sum::<f64>()
    };
    let counts: Vec<usize> = fits.iter().map(|fit| fit.windows.len()).collect();
    longest_near_best(&counts, |length, candidates| {
        let windows = &fits[length].windows;
        let starts = candidates.iter().map(|&candidate| StartingPoint {
            values: &fits[candidate].values,
            windows,
            scales: channel_sd,
        });
        let predictions = states_only.fit_each(&starts.collect::<Vec<_>>(), COARSE_TOLERANCE).into_iter();
        // Where one of the candidates cannot be simulated, this length does not count for any of them.
        predictions.map(|fit| Some(ln_rmse(&fit.ok()?))).collect()
    })
}

/// Index of the last fit whose score is within [`MIN_LN_LIKELIHOOD_GAIN`] of the best score.
///
/// The score of a fit is the sum over all windows of all lengths of the ln RMSE of its parameters. `counts`
/// holds the number of windows of each length, in decreasing order; `ln_rmse` returns the values of the given
/// fits over one length, or `None` where one of them cannot be simulated. Fits that the remaining windows
/// cannot make the best any more are dropped early: the few long windows are not simulated where the many
/// short ones have decided.
fn longest_near_best(
    counts: &[usize],
    mut ln_rmse: impl FnMut(usize, &[usize]) -> Option<Vec<f64>>,
) -> usize {
    let mut candidates: Vec<(usize, f64)> = (0..counts.len()).map(|fit| (fit, 0.0)).collect();
    for (length, count) in counts.iter().enumerate() {
        let indices: Vec<usize> = candidates.iter().map(|(fit, _)| *fit).collect();
        if indices.len() > 1
            && let Some(values) = ln_rmse(length, &indices)
        {
            candidates.iter_mut().zip(values).for_each(|((_, sum), value)| *sum += *count as f64 * value);
        }
        let least = candidates.iter().map(|(_, sum)| *sum).fold(f64::INFINITY, f64::min);
        let remaining = counts[length + 1..].iter().sum::<usize>() as f64;
        candidates
            .retain(|(_, sum)| *sum <= least + MIN_LN_LIKELIHOOD_GAIN + MAX_LN_RMSE_DIFFERENCE * remaining);
    }
    candidates.last().map_or(counts.len().saturating_sub(1), |(fit, _)| *fit)
}

#[cfg(test)]
mod tests {
    //! Contract: parameters of long windows are preferred unless they lose more over the short windows than
    //! they gain.
    use super::*;

    /// Index of the selected one of three fits. `rmse[length][fit]` are their RMSEs over 40, 20 and 10 windows.
    fn selected(rmse: [[f64; 3]; 3]) -> usize {
        longest_near_best(&[40, 20, 10], |length, candidates| {
            Some(candidates.iter().map(|fit| rmse[length][*fit].ln()).collect())
        })
    }

    #[test]
    fn measurement_noise_alone_selects_the_longest_windows() {
        assert_eq!(selected([[1.00, 1.01, 1.01], [1.3, 1.02, 1.02], [2.0, 1.2, 1.03]]), 2);
        assert_eq!(selected([[1.0; 3], [1.0; 3], [1.0; 3]]), 2);
    }

    #[test]
    fn parameters_that_compensate_for_a_missing_effect_are_not_selected() {
        assert_eq!(selected([[1.0, 1.0, 1.5], [2.0, 2.0, 2.6], [5.0, 4.9, 4.0]]), 1);
        assert_eq!(selected([[1.0, 1.3, 2.0], [2.0, 2.0, 3.0], [5.0, 4.9, 4.0]]), 0);
    }

    #[test]
    fn long_windows_are_given_up_for_a_gain_of_two_in_ln_likelihood() {
        assert_eq!(selected([[1.0, 1.0, 1.04], [1.0; 3], [1.0; 3]]), 2);
        assert_eq!(selected([[1.0, 1.0, 1.08], [1.0; 3], [1.0; 3]]), 1);
    }

    #[test]
    fn long_windows_are_not_simulated_once_short_ones_have_decided() {
        let mut simulated = Vec::new();
        let best = longest_near_best(&[4000, 20, 1], |length, candidates| {
            simulated.push((length, candidates.to_vec()));
            Some(candidates.iter().map(|fit| if *fit == 1 { 1.0 } else { 2.0 }).collect())
        });
        assert_eq!((best, simulated), (1, vec![(0, vec![0, 1, 2])]));
        let best = longest_near_best(&[40, 20, 1], |_, candidates| {
            Some(candidates.iter().map(|fit| if *fit == 1 { 1.0 } else { 2.0 }).collect())
        });
        assert_eq!(best, 1);
    }

    #[test]
    fn a_length_that_cannot_be_simulated_does_not_count() {
        let best = longest_near_best(&[40, 20, 10], |length, candidates| {
            (length != 1).then(|| candidates.iter().map(|fit| [0.0, 0.0, 0.01][*fit]).collect())
        });
        assert_eq!(best, 2);
    }
}
