//! Initial states of windows, estimated over growing beginnings.
//!
//! From a rough initial state the cost over the whole window may have a local minimum far from the solution,
//! for example past an event. Over the first samples it has none, and each doubling starts near its minimum.

use crate::evaluate::Lanes;
use crate::hypothesis::Hypothesis;
use crate::nuisance_fit::{WindowState, fit_nuisances_from};
use crate::record::ChosenRecords;
use crate::record::RecordWindow;
use augsim_system::Window;

/// Number of samples in the shortest beginning of a window that is fitted.
const FIRST_SAMPLES: usize = 8;

/// Fits initial states, record parameters and event offsets of windows over their first 8 samples, then 16,
/// and so on up to all, from rough values.
pub(crate) fn fit_growing(
    sample: &ChosenRecords<'_>,
    h: &Hypothesis,
    theta: &[f64],
    windows: &[RecordWindow<'_>],
    lanes: &[Lanes],
    rough: Vec<Vec<f64>>,
) -> Vec<WindowState> {
    let longest = windows.iter().map(|at| at.window.samples.len()).max().unwrap_or(0);
    let lengths = std::iter::successors(Some(FIRST_SAMPLES), |length: &usize| length.checked_mul(2));
    let mut nuisance = rough;
    let mut converged = Vec::new();
    for length in lengths.take_while(|length| *length < longest).chain([longest]) {
        let short = |at: &RecordWindow<'_>| {
            let samples =
                at.window.samples.start..at.window.samples.end.min(at.window.samples.start + length);
            Window { samples, ..at.window.clone() }
        };
        let short: Vec<Window> = windows.iter().map(short).collect();
        let beginnings: Vec<RecordWindow<'_>> = windows
            .iter()
            .zip(&short)
            .map(|(at, window)| RecordWindow { record: at.record, window })
            .collect();
        converged = fit_nuisances_from(sample, h, theta, &beginnings, lanes, nuisance);
        nuisance = converged.iter().map(|(_, nuisance)| nuisance.clone()).collect();
    }
    converged
}
