//! Starts of windows that are found over ever longer beginnings of them.
//!
//! A rough start may lead past an event, or round the wrong way, long before a window ends: the cost over the whole window then
//! has a minimum at a start that is far from the true one. Over the first samples it has none, and each doubling begins near its
//! end.

use crate::chosen_records::ChosenRecords;
use crate::evaluate::Lanes;
use crate::follow::{Settled, settled_from};
use crate::hypothesis::Hypothesis;
use crate::record::Excerpt;
use augsim_physics::system::Window;

/// Samples of the first beginning.
const FIRST: usize = 8;

/// Windows with their own nuisances fitted over 8 samples, 16 and so on up to all, from rough ones.
pub(crate) fn grown(
    sample: &ChosenRecords<'_>,
    h: &Hypothesis,
    theta: &[f64],
    windows: &[Excerpt<'_>],
    lanes: &[Lanes],
    rough: Vec<Vec<f64>>,
) -> Vec<Settled> {
    let longest = windows.iter().map(|at| at.window.samples.len()).max().unwrap_or(0);
    let lengths = std::iter::successors(Some(FIRST), |length: &usize| length.checked_mul(2));
    let mut nuisance = rough;
    let mut settled = Vec::new();
    for length in lengths.take_while(|length| *length < longest).chain([longest]) {
        let short = |at: &Excerpt<'_>| {
            let samples =
                at.window.samples.start..at.window.samples.end.min(at.window.samples.start + length);
            Window { samples, ..at.window.clone() }
        };
        let short: Vec<Window> = windows.iter().map(short).collect();
        let beginnings: Vec<Excerpt<'_>> =
            windows.iter().zip(&short).map(|(at, window)| Excerpt { record: at.record, window }).collect();
        settled = settled_from(sample, h, theta, &beginnings, lanes, nuisance);
        nuisance = settled.iter().map(|(_, nuisance)| nuisance.clone()).collect();
    }
    settled
}
