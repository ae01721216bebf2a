//! Scores of forecasts after an observed prefix (the first rows of a trajectory).
//!
//! There are two definitions. *whole* divides by all samples of the trajectory, of which the observed ones
//! count as no error (comparable with forecasts from the first state). *rest* divides by the forecast samples
//! alone. Percentages of the rest are ratios of sums over the set, because a mean of ratios would be
//! dominated by objects at rest.

use crate::Samples;
use crate::score::{Scoring, crps_from_samples, length, quantile};
use augsim_system::statistics::median;
use std::ops::Range;

/// Minimum width of a 90 % band that counts for the coverage, in the column's unit.
/// The narrow bands of a resting object would raise the coverage.
const MIN_BAND_WIDTH: f64 = 1e-3;

/// Scores of forecasts after a prefix, over the trajectories of a set.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FilteredScore {
    /// Number of scored trajectories.
    pub trajectories: usize,
    /// State columns of each measure (neighbouring columns with the same unit).
    pub columns: Vec<Range<usize>>,
    /// Error of the median summed over the forecast rows, divided by the number of all rows.
    /// Mean over trajectories; one entry per measure, in its unit.
    pub all_rows: Vec<f64>,
    /// Standard error of [`all_rows`](Self::all_rows) over trajectories.
    pub all_rows_se: Vec<f64>,
    /// Errors of the first measure over forecast rows, relative to its distances from zero over all rows, per cent.
    /// A ratio of sums; mean over trajectories.
    pub all_rows_percent: f64,
    /// Mean error of the median over the forecast rows, one entry per measure, in its unit.
    pub forecast_rows: Vec<f64>,
    /// Median over trajectories of the mean error of the median over the forecast rows, per measure, in its unit.
    /// Robust to a few trajectories with very large errors.
    pub median_forecast_rows: Vec<f64>,
    /// Errors of the first measure relative to its distances from zero, both over the forecast rows, per cent.
    /// A ratio of sums over all trajectories.
    pub forecast_rows_percent: f64,
    /// Mean error of the median in the last 70 % of the samples, per measure, in its unit.
    /// These are the same rows for all prefixes up to 30 %.
    pub last_70_percent: Vec<f64>,
    /// Mean CRPS (fair continuous ranked probability score) over the forecast rows, per measure, in its unit.
    pub crps: Vec<f64>,
    /// Median over trajectories of the mean CRPS over the forecast rows, per measure, in its unit.
    pub median_crps: Vec<f64>,
    /// Share of true values in the central 50 % band where the 90 % band is wide enough.
    /// `None` for a point forecast.
    pub coverage50: Option<f64>,
    /// Share of true values in the central 90 % band where that band is wide enough; `None` for a point forecast.
    pub coverage90: Option<f64>,
}

/// Sums of errors and scores over the forecast rows of one trajectory.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Tally {
    columns: Vec<Range<usize>>,
    errors: Vec<f64>,
    common: Vec<f64>,
    common_rows: f64,
    crps: Vec<f64>,
    rows: f64,
    all_rows: f64,
    distance_rest: f64,
    distance_all: f64,
    wide_bands: f64,
    in_bands: [f64; 2],
    is_point_forecast: bool,
}

/// Scores a forecast, `samples [horizon, S, sample]`, against the rows from `n` on of `truth [time, S]`.
/// Rows with a missing measurement do not count.
pub(super) fn tally_forecast(samples: &Samples, truth: &[f64], n: usize, scoring: &Scoring) -> Tally {
    let measures = &scoring.measures;
    let s = measures.last().map_or(1, |last| last.end);
    let (count, time) = (samples.count, truth.len() / s);
    let zeros = vec![0.0; measures.len()];
    let mut out = Tally {
        columns: measures.clone(),
        errors: zeros.clone(),
        common: zeros.clone(),
        crps: zeros,
        is_point_forecast: count == 1,
        ..Tally::default()
    };
    let mut sorted = vec![0.0_f32; count];
    let mut medians = vec![0.0; s];
    for t in 0..time {
        let truth_row = &truth[t * s..(t + 1) * s];
        if truth_row.iter().any(|v| v.is_nan()) {
            continue;
        }
        let distance = length(measures[0].clone().map(|j| truth_row[j]));
        out.distance_all += distance;
        out.all_rows += 1.0;
        if t < n {
            continue;
        }
        out.rows += 1.0;
        out.distance_rest += distance;
        let is_common = 10 * t >= 3 * time;
        out.common_rows += f64::from(u8::from(is_common));
        for (k, columns) in measures.iter().enumerate() {
            for j in columns.clone() {
                let row = &samples.values[((t - n) * s + j) * count..][..count];
                sorted.copy_from_slice(row);
                sorted.sort_unstable_by(f32::total_cmp);
                medians[j] = quantile(&sorted, 0.5);
                out.crps[k] += crps_from_samples(&sorted, truth_row[j]) / columns.len() as f64;
                let band = |level: f64| [0.5 - level / 2.0, 0.5 + level / 2.0].map(|q| quantile(&sorted, q));
                let bands = [band(0.5), band(0.9)];
                if bands[1][1] - bands[1][0] > MIN_BAND_WIDTH {
                    out.wide_bands += 1.0;
                    for (in_bands, [low, high]) in out.in_bands.iter_mut().zip(bands) {
                        *in_bands += f64::from(u8::from((low..=high).contains(&truth_row[j])));
                    }
                }
            }
            let error = |estimate: &[f64]| length(columns.clone().map(|j| estimate[j] - truth_row[j]));
            out.errors[k] += error(&medians);
            if is_common {
                out.common[k] += error(&medians);
            }
        }
    }
    out
}

/// Computes the median of the finite values.
fn finite_median(values: impl Iterator<Item = f64>) -> f64 {
    let mut finite: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    if finite.is_empty() { f64::NAN } else { median(&mut finite) }
}

impl FilteredScore {
    /// Averages the sums of all trajectories of a set.
    pub(super) fn from_tallies(tallies: &[Tally]) -> Self {
        let n = tallies.len() as f64;
        let measures = 0..tallies.first().map_or(0, |t| t.errors.len());
        let sum = |f: &dyn Fn(&Tally) -> f64| tallies.iter().map(f).sum::<f64>();
        let sums = |f: &dyn Fn(&Tally, usize) -> f64| {
            measures.clone().map(|k| sum(&|t| f(t, k))).collect::<Vec<_>>()
        };
        let (rows, common) = (sum(&|t| t.rows), sum(&|t| t.common_rows));
        let divided = |total: Vec<f64>, by: f64| total.into_iter().map(|v| v / by).collect::<Vec<_>>();
        let medians = |f: &dyn Fn(&Tally, usize) -> f64| -> Vec<f64> {
            measures.clone().map(|k| finite_median(tallies.iter().map(|t| f(t, k) / t.rows))).collect()
        };
        let whole = divided(sums(&|t, k| t.errors[k] / t.all_rows), n);
        let squares = sums(&|t, k| (t.errors[k] / t.all_rows - whole[k]).powi(2));
        let coverage = |level: usize| {
            let wide_bands = sum(&|t| t.wide_bands);
            let has_bands = tallies.iter().any(|t| !t.is_point_forecast) && wide_bands > 0.0;
            has_bands.then(|| sum(&|t| t.in_bands[level]) / wide_bands)
        };
        FilteredScore {
            trajectories: tallies.len(),
            columns: tallies.first().map_or_else(Vec::new, |t| t.columns.clone()),
            all_rows_se: squares.into_iter().map(|v| (v / (n * (n - 1.0).max(1.0))).sqrt()).collect(),
            all_rows: whole,
            all_rows_percent: 100.0 * sum(&|t| t.errors[0] / t.distance_all) / n,
            forecast_rows: divided(sums(&|t, k| t.errors[k]), rows),
            median_forecast_rows: medians(&|t, k| t.errors[k]),
            median_crps: medians(&|t, k| t.crps[k]),
            forecast_rows_percent: 100.0 * sum(&|t| t.errors[0]) / sum(&|t| t.distance_rest),
            last_70_percent: divided(sums(&|t, k| t.common[k]), common),
            crps: divided(sums(&|t, k| t.crps[k]), rows),
            coverage50: coverage(0),
            coverage90: coverage(1),
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: both definitions agree with values computed by hand.
    use super::*;
    use crate::Sequences;

    #[test]
    fn observed_rows_count_as_zero_error_in_whole_and_not_in_rest() {
        let columns = vec!["height_m".to_owned()];
        let scoring =
            Scoring::for_columns(&Sequences { columns, action_columns: Vec::new(), items: Vec::new() });
        let truth = [4.0, 3.0, 2.0, 1.0];
        let forecast = Samples { count: 1, values: vec![2.5, 2.0] };
        let score = FilteredScore::from_tallies(&[tally_forecast(&forecast, &truth, 2, &scoring)]);
        assert_eq!(score.all_rows, [1.5 / 4.0]);
        assert_eq!(score.all_rows_percent, 100.0 * 1.5 / 10.0);
        assert_eq!((score.forecast_rows, score.forecast_rows_percent), (vec![0.75], 100.0 * 1.5 / 3.0));
        assert_eq!((score.last_70_percent, score.crps), (vec![0.75], vec![0.75]));
        assert_eq!(score.coverage90, None);
    }

    #[test]
    fn unmeasured_rows_are_ignored() {
        let columns = vec!["height_m".to_owned()];
        let scoring =
            Scoring::for_columns(&Sequences { columns, action_columns: Vec::new(), items: Vec::new() });
        let forecast = Samples { count: 1, values: vec![9.0, 2.0] };
        let score = FilteredScore::from_tallies(&[tally_forecast(
            &forecast,
            &[4.0, 3.0, f64::NAN, 1.0],
            2,
            &scoring,
        )]);
        assert_eq!((score.all_rows, score.forecast_rows), (vec![1.0 / 3.0], vec![1.0]));
    }

    #[test]
    fn narrow_bands_are_left_out_of_the_coverage() {
        let columns = vec!["height_m".to_owned()];
        let scoring =
            Scoring::for_columns(&Sequences { columns, action_columns: Vec::new(), items: Vec::new() });
        // The first forecast row has a band of a tenth of a millimetre, the second one of a metre that
        // misses the true value.
        let narrow = (0..11).map(|i| 1e-5 * i as f32);
        let wide = (0..11).map(|i| 1.0 + 0.1 * i as f32);
        let forecast = Samples { count: 11, values: narrow.chain(wide).collect() };
        let score = FilteredScore::from_tallies(&[tally_forecast(&forecast, &[0.0, 0.0, 0.5], 1, &scoring)]);
        assert_eq!(score.coverage90, Some(0.0));
    }
}
