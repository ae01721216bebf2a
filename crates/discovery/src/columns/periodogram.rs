//! Periodograms of the residuals for effects with a period.
//!
//! A fit finds a period only if it starts within a fraction of a cycle over the range of the data. So the gain of a periodic
//! effect is computed at many periods, half a cycle apart (least-squares periodogram: Lomb 1976; Zechmeister and Kürster 2009),
//! with the sensitivities of the predictions in place of the sines.

use super::builder::{ProblemBuilder, batches};
use crate::addition::Addition;
use crate::fit::Fit;
use crate::score::{BEYOND_NOISE, FitWindows, Rows, Scored};
use augsim_system::Per;
use rayon::prelude::*;

/// Number of peaks of a periodogram from which an effect is fitted. The highest may be an alias of the true one while
/// another effect is still missing.
const PEAKS: usize = 5;
/// Number of samples to which windows are thinned out for periodograms, which need hundreds of simulations.
///
/// An effect with 1 % of the residual variance gains 20 nats in this many.
const MAX_SAMPLES: usize = 4096;

/// Periodic effects of `library` with the parameter values of the highest peaks of their periodograms at a fitted set.
///
/// Empty if the residuals are white and do not exceed the noise.
pub(super) fn strongest_cycles<'l>(
    places: &FitWindows<'_>,
    rows: &Rows,
    set: &Scored,
    library: &'l [Addition],
) -> Vec<(&'l Addition, Vec<f64>)> {
    if set.has_white_residuals() && !rows.exceed_noise(BEYOND_NOISE) {
        return Vec::new();
    }
    let thinning = rows.samples().div_ceil(MAX_SAMPLES).max(1);
    let nuisance = places.fit.nuisance.iter().step_by(thinning).cloned().collect();
    let fit = Fit { nuisance, ..places.fit.clone() };
    let (places, rows) = (places.at_every(thinning, &fit), rows.at_every(thinning));
    let builder = ProblemBuilder::new(&places, &rows, set);
    let declared = builder.declared_products();
    let (system, sample) = (&*set.fit.hypothesis.system, places.sample);
    let of_effect = |addition: &'l Addition| -> Vec<(&'l Addition, Vec<f64>)> {
        let Addition::Effect(listed, Per::All) = addition else { return Vec::new() };
        let points: Vec<_> =
            system.cycle_points(listed.index).into_iter().map(|point| (addition, point)).collect();
        let gains_of = |batch: &Vec<(&Addition, Vec<f64>)>| -> Vec<f64> {
            let columns = builder.slopes(batch);
            columns.iter().map(|(g, columns)| builder.gain(g.columns.len(), columns, &declared)).collect()
        };
        let find = || {
            let gains: Vec<f64> = batches(&points).par_iter().flat_map(gains_of).collect();
            let highest =
                peaks(&gains).into_iter().filter_map(|k| points.get(k)).map(|(_, point)| point.clone());
            highest.collect()
        };
        let peaks = set.cycle_peaks.of(addition.label(), find, || !sample.data.clock.is_over());
        peaks.into_iter().map(|point| (addition, point)).collect()
    };
    builder.candidates(library).flat_map(of_effect).collect()
}

/// Indices of the highest local maxima, highest first.
fn peaks(gains: &[f64]) -> Vec<usize> {
    let at = |k: Option<usize>| k.and_then(|k| gains.get(k)).copied().unwrap_or(0.0);
    let is_peak = |k: &usize| gains[*k] > at(k.checked_sub(1)) && gains[*k] >= at(Some(k + 1));
    let mut found: Vec<usize> = (0..gains.len()).filter(is_peak).collect();
    found.sort_by(|a, b| gains[*b].total_cmp(&gains[*a]).then(a.cmp(b)));
    found.truncate(PEAKS);
    found
}

#[cfg(test)]
mod tests {
    use super::peaks;

    #[test]
    fn the_highest_local_maxima_come_first() {
        assert_eq!(peaks(&[5.0, 1.0, 2.0, 9.0, 8.0, 3.0, 4.0, 6.0]), [3, 7, 0]);
        assert_eq!(peaks(&[1.0, f64::NAN, 0.0, 0.0]), [0; 0]);
    }
}
