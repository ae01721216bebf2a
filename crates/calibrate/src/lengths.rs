//! Which length of windows parameters are taken from.
//!
//! Laws that a model lacks, and noise of its motion, add up along a window. Parameters of long windows make up for them and miss short
//! stretches; those of short windows are put off by noise of the sensor and drift from long ones. Every length is a forecast that
//! somebody may ask for: parameters are taken from the windows whose parameters forecast all of them best.

use crate::steps::{Begin, Fit, ROUGHLY_SETTLED};
use crate::windows::{NEGLIGIBLE, Problem};

/// By how much (in ln likelihood) shorter windows have to be better before longer ones are given up.
const CLEARLY: f64 = 2.0;
/// Most that the logarithms of two misfits over one window differ by: between a run as good as no measurement could tell and one that
/// misses a thousand times what there is to follow.
const FARTHEST: f64 = 20.0;

/// The place in `fits`, over ever longer windows, of the longest whose parameters forecast windows of all these lengths about as
/// well as the best do. The start of each window is fitted; `spread` are the scales of the channels that fits begin with.
pub(crate) fn longest_that_forecasts_all(problem: &Problem<'_>, fits: &[Fit], spread: &[f64]) -> usize {
    let starts_only = Problem { free: Vec::new(), states: problem.states.clone(), ..*problem };
    let floors: Vec<f64> = spread.iter().map(|spread| (NEGLIGIBLE * spread).max(f64::MIN_POSITIVE)).collect();
    let misfit = |fit: &Fit| {
        let rms = fit.normal.rms(spread.len());
        rms.iter().zip(&floors).map(|(rms, floor)| rms.max(*floor).ln()).sum::<f64>()
    };
    let windows: Vec<usize> = fits.iter().map(|fit| fit.shots.len()).collect();
    longest_of_the_best(&windows, |length, rivals| {
        let shots = &fits[length].shots;
        let begins = rivals.iter().map(|&from| Begin { values: &fits[from].values, shots, sd: spread });
        let forecasts = starts_only.fit_each(&begins.collect::<Vec<_>>(), ROUGHLY_SETTLED).into_iter();
        // Lengths over which only some can be run tell nothing of the others.
        forecasts.map(|fit| Some(misfit(&fit.ok()?))).collect()
    })
}

/// The longest of the fits that are about the best by the sum, over lengths of windows, of the logarithms of their misfits, each
/// window a witness. `windows` has the number of windows of each length, which are ever fewer; `misfits` gives the logarithms
/// over a length of the fits that may still be the best, or nothing where one of them cannot be run. Few long windows change
/// nothing between fits that many short ones have told apart: they are not run for those.
fn longest_of_the_best(
    windows: &[usize],
    mut misfits: impl FnMut(usize, &[usize]) -> Option<Vec<f64>>,
) -> usize {
    let mut rivals: Vec<(usize, f64)> = (0..windows.len()).map(|fit| (fit, 0.0)).collect();
    for (length, count) in windows.iter().enumerate() {
        let places: Vec<usize> = rivals.iter().map(|(fit, _)| *fit).collect();
        if places.len() > 1
            && let Some(found) = misfits(length, &places)
        {
            rivals.iter_mut().zip(found).for_each(|((_, sum), misfit)| *sum += *count as f64 * misfit);
        }
        let least = rivals.iter().map(|(_, sum)| *sum).fold(f64::INFINITY, f64::min);
        let left = windows[length + 1..].iter().sum::<usize>() as f64;
        rivals.retain(|(_, sum)| *sum <= least + CLEARLY + FARTHEST * left);
    }
    rivals.last().map_or(windows.len().saturating_sub(1), |(fit, _)| *fit)
}

#[cfg(test)]
mod tests {
    //! Contract: parameters of long windows are preferred, unless they miss the many short ones by more than they gain.
    use super::*;

    /// Misfits of the parameters from windows of three lengths over 40, 20 and 10 windows.
    fn chosen(misfits: [[f64; 3]; 3]) -> usize {
        longest_of_the_best(&[40, 20, 10], |length, rivals| {
            Some(rivals.iter().map(|fit| misfits[length][*fit].ln()).collect())
        })
    }

    #[test]
    fn noise_of_the_sensor_alone_leaves_the_longest() {
        assert_eq!(chosen([[1.00, 1.01, 1.01], [1.3, 1.02, 1.02], [2.0, 1.2, 1.03]]), 2);
        assert_eq!(chosen([[1.0; 3], [1.0; 3], [1.0; 3]]), 2);
    }

    #[test]
    fn parameters_that_make_up_for_something_over_long_windows_are_left() {
        assert_eq!(chosen([[1.0, 1.0, 1.5], [2.0, 2.0, 2.6], [5.0, 4.9, 4.0]]), 1);
        assert_eq!(chosen([[1.0, 1.3, 2.0], [2.0, 2.0, 3.0], [5.0, 4.9, 4.0]]), 0);
    }

    #[test]
    fn odds_of_seven_to_one_are_needed_to_give_up_long_windows() {
        assert_eq!(chosen([[1.0, 1.0, 1.04], [1.0; 3], [1.0; 3]]), 2);
        assert_eq!(chosen([[1.0, 1.0, 1.08], [1.0; 3], [1.0; 3]]), 1);
    }

    #[test]
    fn long_windows_are_not_run_for_what_short_ones_decide() {
        let mut run = Vec::new();
        let best = longest_of_the_best(&[4000, 20, 1], |length, rivals| {
            run.push((length, rivals.to_vec()));
            Some(rivals.iter().map(|fit| if *fit == 1 { 1.0 } else { 2.0 }).collect())
        });
        assert_eq!((best, run), (1, vec![(0, vec![0, 1, 2])]));
        let best = longest_of_the_best(&[40, 20, 1], |_, rivals| {
            Some(rivals.iter().map(|fit| if *fit == 1 { 1.0 } else { 2.0 }).collect())
        });
        assert_eq!(best, 1);
    }

    #[test]
    fn a_length_that_cannot_be_run_tells_nothing() {
        let best = longest_of_the_best(&[40, 20, 10], |length, rivals| {
            (length != 1).then(|| rivals.iter().map(|fit| [0.0, 0.0, 0.01][*fit]).collect())
        });
        assert_eq!(best, 2);
    }
}
