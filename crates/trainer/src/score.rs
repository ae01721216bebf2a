//! Scores of sampled forecasts against measured trajectories, one value per measure.
//!
//! A measure is a run of neighbouring state columns with the same unit, such as x and y of a position. Its
//! error is the Euclidean norm over its columns; for a single column, the absolute error.
//! 1. Paper's metrics: mean error of a point estimate, absolute and as a percentage of the first measure.
//! 2. CRPS (continuous ranked probability score, fair estimator; Gneiting and Raftery 2007) of m samples x_i
//!    and the measured value y: mean_i |x_i - y| minus sum_{i<j} |x_i - x_j| / (m (m - 1)).
//! 3. Coverage: how often the measured value is in the central 50 and 90 % bands of the samples.
//!
//! States are compared in the frame of the data. Lengths and angles do not depend on the frame; percentages
//! of the distance from the origin do.

use crate::{Samples, Sequences};
use augsim_data::Column;
use std::ops::Range;

/// Number of samples that the paper averages into its point estimate.
pub const PAPER_SAMPLES: usize = 10;
/// Number of equal parts of a trajectory in [`Score::error_by_part`].
pub const PARTS: usize = 10;

/// Tolerance of the coverage bands for systems without actions, in the column's unit.
///
/// The data have six digits. Before the first impact and at rest all samples agree more closely than that, so
/// that rounding alone would put the measured value outside the band.
const RESOLUTION: f64 = 2e-5;

/// Which columns and samples are scored, and the tolerance of the coverage bands.
#[derive(Debug, Clone, PartialEq)]
pub struct Scoring {
    /// Range of state columns of each measure (neighbouring columns with the same unit).
    pub(crate) measures: Vec<Range<usize>>,
    /// Index of the first sample that is scored.
    ///
    /// As in the paper, the given initial state counts for a drop but not for a push.
    first: usize,
    /// Tolerance that widens the coverage bands on both sides, in the column's unit.
    resolution: f64,
}

impl Scoring {
    /// Groups the state columns of a set into measures by their units.
    pub fn for_columns(set: &Sequences) -> Self {
        let units: Vec<_> = set.columns.iter().map(|name| Column::new(name).ok().map(|c| c.unit())).collect();
        let mut measures: Vec<Range<usize>> = Vec::new();
        for (j, unit) in units.iter().enumerate() {
            match measures.last_mut() {
                Some(last) if units[last.start] == *unit => last.end = j + 1,
                _ => measures.push(j..j + 1),
            }
        }
        let has_actions = !set.action_columns.is_empty();
        let resolution = if has_actions { 0.0 } else { RESOLUTION };
        Scoring { measures, first: usize::from(has_actions), resolution }
    }
}

/// Errors of one point estimate: means over scored samples, then over trajectories.
///
/// One entry per measure, in the unit of its columns.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointError {
    /// Mean error over the scored samples, one entry per measure, in its unit.
    pub absolute: Vec<f64>,
    /// Mean error at the last sample, one entry per measure, in its unit.
    pub end: Vec<f64>,
    /// Error of the first measure in per cent of its size: sum of errors over sum of distances from zero.
    /// Mean over the trajectories.
    pub trans_percent: f64,
    /// Error of the first measure in per cent of its motion: sum of errors over sum of distances from the start.
    /// Both sums are over all trajectories.
    pub moved_percent: f64,
    /// Sum of the errors of the first measure over the scored samples, in its unit.
    sum: f64,
}

/// Scores of one trajectory, or their average over many.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Score {
    /// Number of trajectories that were averaged.
    pub trajectories: usize,
    /// Errors of the point estimate that is the mean of all samples.
    pub mean: PointError,
    /// Errors of the point estimate of the paper, the mean of the first [`PAPER_SAMPLES`] samples.
    pub mean_of_10: PointError,
    /// Errors of the point estimate that is the median of all samples, column by column.
    pub median: PointError,
    /// CRPS of each measure, averaged over its columns, in their unit; for one sample the absolute error.
    pub crps: Vec<f64>,
    /// Share of measured values in the central 50 % band, over all columns; `None` for one sample.
    pub coverage50: Option<f64>,
    /// Share of measured values in the central 90 % band, over all columns; `None` for one sample.
    pub coverage90: Option<f64>,
    /// Error of the paper's estimate at each scored sample: `[time][measure]`.
    pub error_by_sample: Vec<Vec<f64>>,
    /// Error of the mean of all samples in the first measure, for each of [`PARTS`] equal parts of the duration.
    ///
    /// NaN for a part without samples.
    pub error_by_part: Vec<f64>,
    /// Sum over samples of the distance of the first measure from its initial value, in its unit.
    moved: f64,
}

/// Computes the Euclidean norm of a vector of values.
pub(crate) fn length(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::hypot)
}

/// Scores `samples` of one trajectory against the measured states `truth [time, S]`.
pub fn score(samples: &Samples, truth: &[f64], scoring: &Scoring) -> Score {
    let Scoring { measures, first, resolution } = scoring;
    let (m, s) = (measures.len(), measures.last().map_or(1, |last| last.end));
    let (count, time) = (samples.count, truth.len() / s);
    let (rows, empty) = ((time - first) as f64, PointError { absolute: vec![0.0; m], ..Default::default() });
    let mut points = [empty.clone(), empty.clone(), empty];
    let mut out =
        Score { trajectories: 1, crps: vec![0.0; m], error_by_part: vec![0.0; PARTS], ..Score::default() };
    let (mut part_counts, mut inside, mut distance_sum) = ([0.0; PARTS], [0.0; 2], 0.0);
    let mut sorted = vec![0.0_f32; count];
    let mut estimates = [vec![0.0; s], vec![0.0; s], vec![0.0; s]];
    for t in *first..time {
        let y = &truth[t * s..(t + 1) * s];
        for (k, columns) in measures.iter().enumerate() {
            for j in columns.clone() {
                let row = &samples.values[(t * s + j) * count..][..count];
                let mean = |n: usize| row[..n].iter().map(|v| f64::from(*v)).sum::<f64>() / n as f64;
                sorted.copy_from_slice(row);
                sorted.sort_unstable_by(f32::total_cmp);
                estimates[0][j] = mean(count);
                estimates[1][j] = mean(count.min(PAPER_SAMPLES));
                estimates[2][j] = quantile(&sorted, 0.5);
                out.crps[k] += crps_from_samples(&sorted, y[j]) / columns.len() as f64;
                for (inside, level) in inside.iter_mut().zip([0.5, 0.9]) {
                    let [low, high] = [0.5 - level / 2.0, 0.5 + level / 2.0].map(|q| quantile(&sorted, q));
                    let is_inside = (low - resolution..=high + resolution).contains(&y[j]);
                    *inside += f64::from(u8::from(is_inside));
                }
            }
        }
        for (point, estimate) in points.iter_mut().zip(&estimates) {
            point.end = measures.iter().map(|c| length(c.clone().map(|j| estimate[j] - y[j]))).collect();
            point.absolute.iter_mut().zip(&point.end).for_each(|(sum, error)| *sum += error);
        }
        out.error_by_sample.push(points[1].end.clone());
        let part = (t - first) * PARTS / (time - first);
        out.error_by_part[part] += points[0].end[0];
        part_counts[part] += 1.0;
        distance_sum += length(measures[0].clone().map(|j| y[j]));
        out.moved += length(measures[0].clone().map(|j| y[j] - truth[j]));
    }
    for point in &mut points {
        point.sum = point.absolute[0];
        point.trans_percent = 100.0 * point.sum / distance_sum;
        point.moved_percent = 100.0 * point.sum / out.moved;
        point.absolute.iter_mut().for_each(|v| *v /= rows);
    }
    [out.mean, out.mean_of_10, out.median] = points;
    out.crps.iter_mut().for_each(|v| *v /= rows);
    out.error_by_part.iter_mut().zip(part_counts).for_each(|(v, n)| *v /= n);
    if count > 1 {
        let [share50, share90] = inside.map(|n| n / (rows * s as f64));
        (out.coverage50, out.coverage90) = (Some(share50), Some(share90));
    }
    out
}

/// Averages the scores of several trajectories.
pub fn average(scores: &[Score]) -> Score {
    let n = scores.len() as f64;
    let mean = |f: &dyn Fn(&Score) -> f64| scores.iter().map(f).sum::<f64>() / n;
    let mean_per_measure = |f: &dyn Fn(&Score) -> &Vec<f64>| -> Vec<f64> {
        (0..scores.first().map_or(0, |s| f(s).len())).map(|k| mean(&|s| f(s)[k])).collect()
    };
    let moved = scores.iter().map(|s| s.moved).sum();
    let point = |estimate: &dyn Fn(&Score) -> &PointError| {
        let sum = scores.iter().map(|s| estimate(s).sum).sum();
        PointError {
            absolute: mean_per_measure(&|s| &estimate(s).absolute),
            end: mean_per_measure(&|s| &estimate(s).end),
            trans_percent: mean(&|s| estimate(s).trans_percent),
            moved_percent: 100.0 * sum / moved,
            sum,
        }
    };
    let share = |f: &dyn Fn(&Score) -> Option<f64>| -> Option<f64> {
        scores.iter().map(f).sum::<Option<f64>>().map(|total| total / n)
    };
    // Averages run over the trajectories that have a value: shorter ones end earlier, and a part may have no
    // sample.
    let mean_present = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.filter(|v| !v.is_nan()).fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
        sum / count
    };
    let longest = scores.iter().map(|s| s.error_by_sample.len()).max().unwrap_or(0);
    let at_time = |t: usize, k: usize| {
        mean_present(&mut scores.iter().filter_map(|s| Some(s.error_by_sample.get(t)?[k])))
    };
    let measures = scores.first().map_or(0, |s| s.crps.len());
    Score {
        trajectories: scores.iter().map(|s| s.trajectories).sum(),
        mean: point(&|s| &s.mean),
        mean_of_10: point(&|s| &s.mean_of_10),
        median: point(&|s| &s.median),
        crps: mean_per_measure(&|s| &s.crps),
        coverage50: share(&|s| s.coverage50),
        coverage90: share(&|s| s.coverage90),
        error_by_sample: (0..longest).map(|t| (0..measures).map(|k| at_time(t, k)).collect()).collect(),
        error_by_part: (0..PARTS)
            .map(|i| mean_present(&mut scores.iter().map(|s| s.error_by_part[i])))
            .collect(),
        moved,
    }
}

/// Computes quantile `q` of sorted values by linear interpolation (Hyndman and Fan 1996, type 7).
pub fn quantile(sorted: &[f32], q: f64) -> f64 {
    let position = q * (sorted.len() - 1) as f64;
    let low = position.floor() as usize;
    let high = (low + 1).min(sorted.len() - 1);
    let (a, b) = (f64::from(sorted[low]), f64::from(sorted[high]));
    a + (b - a) * (position - low as f64)
}

/// Computes the median of samples; `sorted` is scratch of the same length.
pub(crate) fn median_of(samples: &[f32], sorted: &mut [f32]) -> f64 {
    sorted.copy_from_slice(samples);
    sorted.sort_unstable_by(f32::total_cmp);
    quantile(sorted, 0.5)
}

/// Estimates the CRPS (continuous ranked probability score) of sorted samples against the true value `y` (formula 2).
pub fn crps_from_samples(sorted: &[f32], y: f64) -> f64 {
    let m = sorted.len() as f64;
    // For sorted values the sum of |x_i - x_j| over all pairs i < j is the sum of (2 i + 1 - m) x_i, because
    // x_i is added once per smaller value and subtracted once per larger one. So no loop over pairs is
    // needed.
    let (mut error, mut spread) = (0.0, 0.0);
    for (i, x) in sorted.iter().enumerate() {
        let x = f64::from(*x);
        error += (x - y).abs();
        spread += (2.0 * i as f64 + 1.0 - m) * x;
    }
    let spread = if sorted.len() > 1 { spread / (m * (m - 1.0)) } else { 0.0 };
    error / m - spread
}

#[cfg(test)]
mod tests {
    //! Contract: the scores agree with values computed by hand on small cases.
    use super::*;

    #[test]
    fn crps_of_two_samples_agrees_with_hand_calculation() {
        // E|X - y| = (1 + 3) / 2, half of E|X - X'| over distinct pairs = 2 / 2.
        assert!((crps_from_samples(&[1.0, 3.0], 0.0) - (2.0 - 1.0)).abs() < 1e-12);
        assert!((crps_from_samples(&[2.0], 0.5) - 1.5).abs() < 1e-12);
    }

    #[test]
    fn fair_crps_does_not_depend_on_the_number_of_samples() {
        // Samples and truth from the same uniform distribution: the expected CRPS is 1/6 for any number of
        // samples.
        for m in [2_usize, 5, 50] {
            let mut rng = augsim_data::random_stream(1, "crps", m as u64);
            let mut uniform = || (rand::Rng::next_u64(&mut rng) >> 40) as f32 / (1 << 24) as f32;
            let n = 40_000;
            let total: f64 = (0..n)
                .map(|_| {
                    let mut x: Vec<f32> = (0..m).map(|_| uniform()).collect();
                    x.sort_unstable_by(f32::total_cmp);
                    crps_from_samples(&x, f64::from(uniform()))
                })
                .sum();
            // The standard error of the mean is below 0.0015 for each m.
            assert!((total / f64::from(n) - 1.0 / 6.0).abs() < 6e-3, "m = {m}: {}", total / f64::from(n));
        }
    }

    fn scoring(columns: &[&str], actions: &[&str]) -> Scoring {
        let owned = |names: &[&str]| names.iter().map(|c| (*c).to_owned()).collect();
        Scoring::for_columns(&Sequences {
            columns: owned(columns),
            action_columns: owned(actions),
            items: Vec::new(),
        })
    }

    #[test]
    fn a_single_sample_scores_its_absolute_error() {
        let samples = Samples { count: 1, values: vec![1.0, 0.0, 2.0, 0.0] };
        let s = score(&samples, &[2.0, 1.0, 2.0, -1.0], &scoring(&["height_m", "velocity_m_s"], &[]));
        assert_eq!(s.mean.absolute, [0.5, 1.0]);
        assert_eq!(s.mean.trans_percent, 25.0);
        assert_eq!(s.crps, [0.5, 1.0]);
        assert_eq!((s.coverage50, &s.mean, &s.mean), (None, &s.mean_of_10, &s.median));
    }

    #[test]
    fn coverage_counts_the_central_band() {
        let values: Vec<f32> = (0..=100).map(|i| i as f32).collect();
        let height = scoring(&["height_m"], &[]);
        let inside = |y: f64| score(&Samples { count: 101, values: values.clone() }, &[y], &height);
        assert_eq!([inside(25.0).coverage50, inside(24.0).coverage50], [Some(1.0), Some(0.0)]);
        assert_eq!([inside(5.0).coverage90, inside(96.0).coverage90], [Some(1.0), Some(0.0)]);
    }

    #[test]
    fn errors_of_a_push_agree_with_hand_calculation() {
        let truth = [3.0, 4.0, 0.0, 3.0, 4.0, 0.1, 6.0, 8.0, 0.2];
        // Predicts the initial pose at all times: errors 0 and 5 m, 0.1 and 0.2 rad.
        let values = [3.0, 4.0, 0.0].repeat(3);
        let scoring = scoring(&["x_m", "y_m", "theta_rad"], &["pusher_x_m"]);
        let s = average(&[score(&Samples { count: 1, values }, &truth, &scoring)]);
        assert!((s.mean.absolute[0] - 2.5).abs() < 1e-6);
        assert!((s.mean.absolute[1] - 0.15).abs() < 1e-6);
        assert!((s.mean.trans_percent - 100.0 * 5.0 / 15.0).abs() < 1e-6);
        assert!((s.mean.moved_percent - 100.0).abs() < 1e-6);
        assert!((s.mean.end[0] - 5.0).abs() < 1e-6);
        assert_eq!((s.error_by_part[0], s.error_by_part[5], s.coverage50), (0.0, 5.0, None));
        assert!(s.error_by_part[1].is_nan(), "two samples are in two parts");
    }
}
