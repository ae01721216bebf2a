//! Which length of windows parameters are taken from.
//!
//! Laws that a model lacks, and noise of its motion, add up along a window. Parameters of long windows make up for them and miss short
//! stretches; those of short windows are put off by noise of the sensor and drift from long ones. Every length is a forecast that
//! somebody may ask for: parameters are taken from the windows whose parameters forecast all of them best.

use crate::steps::{Fit, ROUGHLY_SETTLED};
use crate::windows::{NEGLIGIBLE, Problem};

/// By how much (in ln likelihood) shorter windows have to be better before longer ones are given up.
const CLEARLY: f64 = 2.0;

/// The place in `fits`, over ever longer windows, of the longest whose parameters forecast windows of all these lengths about as
/// well as the best do. The start of each window is fitted; `spread` are the scales of the channels that fits begin with.
pub(crate) fn longest_that_forecasts_all(problem: &Problem<'_>, fits: &[Fit], spread: &[f64]) -> usize {
    let states = problem.states.clone();
    let mut starts_only = Problem { free: Vec::new(), sd: spread.to_vec(), states, ..*problem };
    let mut misfit = |from: &Fit, over: &Fit| {
        starts_only.sd.copy_from_slice(spread);
        let fit = starts_only.fit(&from.values, &over.shots, ROUGHLY_SETTLED).ok()?;
        let rms = fit.normal.rms(spread.len());
        let floors = spread.iter().map(|spread| (NEGLIGIBLE * spread).max(f64::MIN_POSITIVE));
        Some(rms.iter().zip(floors).map(|(rms, floor)| rms.max(floor).ln()).sum::<f64>())
    };
    // Lengths over which only some can be run tell nothing of the others.
    let lengths = fits.iter().filter_map(|over| {
        let misfits: Option<Vec<f64>> = fits.iter().map(|from| misfit(from, over)).collect();
        misfits.map(|misfits| (over.shots.len(), misfits))
    });
    longest_of_the_best(&lengths.collect::<Vec<_>>(), fits.len())
}

/// The longest of so many fits that are about the best by the sum, over lengths of windows, of the logarithms of their misfits,
/// each window a witness.
fn longest_of_the_best(lengths: &[(usize, Vec<f64>)], fits: usize) -> usize {
    let sum =
        |fit: usize| lengths.iter().map(|(windows, misfits)| *windows as f64 * misfits[fit]).sum::<f64>();
    let sums: Vec<f64> = (0..fits).map(sum).collect();
    let least = sums.iter().copied().fold(f64::INFINITY, f64::min);
    sums.iter().rposition(|sum| *sum <= least + CLEARLY).unwrap_or(fits.saturating_sub(1))
}

#[cfg(test)]
mod tests {
    //! Contract: parameters of long windows are preferred, unless they miss the many short ones by more than they gain.
    use super::*;

    /// Misfits of the parameters from windows of three lengths over 40, 20 and 10 windows.
    fn chosen(misfits: [[f64; 3]; 3]) -> usize {
        let of = |(windows, row): (usize, [f64; 3])| (windows, row.map(f64::ln).to_vec());
        longest_of_the_best(&[40, 20, 10].into_iter().zip(misfits).map(of).collect::<Vec<_>>(), 3)
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
}
