//! Errors of forecasts against the truth, one figure for each measure.
//!
//! A measure is a run of state columns with one unit: their error is its Euclidean length (x and y of a position), of a
//! single column the absolute error. Besides the paper's metrics (mean error; per cent of the first measure): the
//! continuous ranked probability score (Gneiting and Raftery 2007, fair estimator) and how often the truth lies in the
//! central 50 and 90 % bands of the samples. All errors are of states in the frame of the data: lengths and angles are the
//! same in every frame, per cent of the distance from the origin are not.

use crate::{Samples, Sequences};
use augsim_data::Column;
use std::ops::Range;

/// Samples that the paper averages.
pub const PAPER_SAMPLES: usize = 10;
/// Parts of a trajectory for [`Score::over_parts`].
pub const PARTS: usize = 10;

/// How far outside a band a value may lie and still count as inside where nobody acts, in the column's unit: the data carry
/// six digits, and before the first impact (or at rest) every sample agrees to better than that.
const RESOLUTION: f64 = 2e-5;

/// The part of a state that is scored.
#[derive(Debug, Clone, PartialEq)]
pub struct Scoring {
    /// State columns of each measure.
    pub(crate) measures: Vec<Range<usize>>,
    /// First sample that is scored. The paper counts the given start of a drop, and not that of a push.
    first: usize,
    resolution: f64,
}

impl Scoring {
    /// Chooses the scoring of a set of trajectories by its columns.
    pub fn of(set: &Sequences) -> Self {
        let units: Vec<_> = set.columns.iter().map(|name| Column::new(name).ok().map(|c| c.unit())).collect();
        let mut measures: Vec<Range<usize>> = Vec::new();
        for (j, unit) in units.iter().enumerate() {
            match measures.last_mut() {
                Some(last) if units[last.start] == *unit => last.end = j + 1,
                _ => measures.push(j..j + 1),
            }
        }
        let acted = !set.action_columns.is_empty();
        Scoring { measures, first: usize::from(acted), resolution: if acted { 0.0 } else { RESOLUTION } }
    }
}

/// Errors of one point estimate: means over the scored samples of each trajectory, then over the trajectories. One entry
/// per measure, in the unit of its columns.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointError {
    /// Error.
    pub absolute: Vec<f64>,
    /// Error at the last sample.
    pub end: Vec<f64>,
    /// Mean over trajectories of the sum of errors over the sum of distances from zero, of the first measure, per cent.
    pub trans_percent: f64,
    /// Sum of errors over sum of distances from the start, of the first measure over all trajectories, per cent.
    pub moved_percent: f64,
    /// Sum of errors of the first measure.
    sum: f64,
}

/// Scores of one or many trajectories.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Score {
    /// Trajectories.
    pub trajectories: usize,
    /// Mean of all samples.
    pub mean: PointError,
    /// Mean of the first [`PAPER_SAMPLES`]: the paper's estimate.
    pub mean_of_10: PointError,
    /// Median of all samples, column by column.
    pub median: PointError,
    /// Continuous ranked probability score of each measure, mean over its columns, in their unit; for a deterministic
    /// forecast the absolute error.
    pub crps: Vec<f64>,
    /// Share of true values in the central 50 % band, over all state columns; absent for a deterministic forecast.
    pub coverage50: Option<f64>,
    /// Share in the central 90 % band.
    pub coverage90: Option<f64>,
    /// Error of the mean of 10 at each scored sample: `[time][measure]`.
    pub over_time: Vec<Vec<f64>>,
    /// Error of the mean of all samples in the first measure, in [`PARTS`] equal parts of the duration; not a number where a
    /// part has no sample.
    pub over_parts: Vec<f64>,
    /// Sum of distances from the start, of the first measure.
    moved: f64,
}

pub(crate) fn length(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::hypot)
}

/// Scores `samples` of one trajectory against `truth [time, S]`.
pub fn score(samples: &Samples, truth: &[f64], scoring: &Scoring) -> Score {
    let Scoring { measures, first, resolution } = scoring;
    let (m, s) = (measures.len(), measures.last().map_or(1, |last| last.end));
    let (count, time) = (samples.count, truth.len() / s);
    let (rows, empty) = ((time - first) as f64, PointError { absolute: vec![0.0; m], ..Default::default() });
    let mut points = [empty.clone(), empty.clone(), empty];
    let mut out =
        Score { trajectories: 1, crps: vec![0.0; m], over_parts: vec![0.0; PARTS], ..Score::default() };
    let (mut parts, mut inside, mut size) = ([0.0; PARTS], [0.0; 2], 0.0);
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
                out.crps[k] += crps_of(&sorted, y[j]) / columns.len() as f64;
                for (inside, level) in inside.iter_mut().zip([0.5, 0.9]) {
                    let [low, high] = [0.5 - level / 2.0, 0.5 + level / 2.0].map(|q| quantile(&sorted, q));
                    let hit = (low - resolution..=high + resolution).contains(&y[j]);
                    *inside += f64::from(u8::from(hit));
                }
            }
        }
        for (point, estimate) in points.iter_mut().zip(&estimates) {
            point.end = measures.iter().map(|c| length(c.clone().map(|j| estimate[j] - y[j]))).collect();
            point.absolute.iter_mut().zip(&point.end).for_each(|(sum, error)| *sum += error);
        }
        out.over_time.push(points[1].end.clone());
        let part = (t - first) * PARTS / (time - first);
        out.over_parts[part] += points[0].end[0];
        parts[part] += 1.0;
        size += length(measures[0].clone().map(|j| y[j]));
        out.moved += length(measures[0].clone().map(|j| y[j] - truth[j]));
    }
    for point in &mut points {
        point.sum = point.absolute[0];
        point.trans_percent = 100.0 * point.sum / size;
        point.moved_percent = 100.0 * point.sum / out.moved;
        point.absolute.iter_mut().for_each(|v| *v /= rows);
    }
    [out.mean, out.mean_of_10, out.median] = points;
    out.crps.iter_mut().for_each(|v| *v /= rows);
    out.over_parts.iter_mut().zip(parts).for_each(|(v, n)| *v /= n);
    if count > 1 {
        let [half, most] = inside.map(|n| n / (rows * s as f64));
        (out.coverage50, out.coverage90) = (Some(half), Some(most));
    }
    out
}

/// Mean of the scores of several trajectories.
pub fn average(scores: &[Score]) -> Score {
    let n = scores.len() as f64;
    let mean = |f: &dyn Fn(&Score) -> f64| scores.iter().map(f).sum::<f64>() / n;
    let each = |f: &dyn Fn(&Score) -> &Vec<f64>| -> Vec<f64> {
        (0..scores.first().map_or(0, |s| f(s).len())).map(|k| mean(&|s| f(s)[k])).collect()
    };
    let moved = scores.iter().map(|s| s.moved).sum();
    let point = |of: &dyn Fn(&Score) -> &PointError| {
        let sum = scores.iter().map(|s| of(s).sum).sum();
        PointError {
            absolute: each(&|s| &of(s).absolute),
            end: each(&|s| &of(s).end),
            trans_percent: mean(&|s| of(s).trans_percent),
            moved_percent: 100.0 * sum / moved,
            sum,
        }
    };
    let share = |f: &dyn Fn(&Score) -> Option<f64>| -> Option<f64> {
        scores.iter().map(f).sum::<Option<f64>>().map(|total| total / n)
    };
    // Shorter trajectories have nothing at late times, and none in parts of theirs that have no sample.
    let present = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.filter(|v| !v.is_nan()).fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
        sum / count
    };
    let longest = scores.iter().map(|s| s.over_time.len()).max().unwrap_or(0);
    let at_time =
        |t: usize, k: usize| present(&mut scores.iter().filter_map(|s| Some(s.over_time.get(t)?[k])));
    let measures = scores.first().map_or(0, |s| s.crps.len());
    Score {
        trajectories: scores.iter().map(|s| s.trajectories).sum(),
        mean: point(&|s| &s.mean),
        mean_of_10: point(&|s| &s.mean_of_10),
        median: point(&|s| &s.median),
        crps: each(&|s| &s.crps),
        coverage50: share(&|s| s.coverage50),
        coverage90: share(&|s| s.coverage90),
        over_time: (0..longest).map(|t| (0..measures).map(|k| at_time(t, k)).collect()).collect(),
        over_parts: (0..PARTS).map(|i| present(&mut scores.iter().map(|s| s.over_parts[i]))).collect(),
        moved,
    }
}

/// Quantile `q` of sorted values, linear between order statistics (Hyndman and Fan's type 7).
pub fn quantile(sorted: &[f32], q: f64) -> f64 {
    let at = q * (sorted.len() - 1) as f64;
    let low = at.floor() as usize;
    let high = (low + 1).min(sorted.len() - 1);
    let (a, b) = (f64::from(sorted[low]), f64::from(sorted[high]));
    a + (b - a) * (at - low as f64)
}

/// Median of samples; `sorted` is scratch of their number.
pub(crate) fn median_of(samples: &[f32], sorted: &mut [f32]) -> f64 {
    sorted.copy_from_slice(samples);
    sorted.sort_unstable_by(f32::total_cmp);
    quantile(sorted, 0.5)
}

/// Fair estimate of the CRPS from sorted samples: mean |X - y| minus half the mean |X - X'| over distinct
/// pairs.
pub fn crps_of(sorted: &[f32], y: f64) -> f64 {
    let m = sorted.len() as f64;
    // In sorted order the sum of |x_i - x_j| over all pairs is the sum of (2 i + 1 - m) x_i: each value is added once for
    // every smaller one and taken off once for every larger one. No loop over pairs is needed.
    let (mut misfit, mut spread) = (0.0, 0.0);
    for (i, x) in sorted.iter().enumerate() {
        let x = f64::from(*x);
        misfit += (x - y).abs();
        spread += (2.0 * i as f64 + 1.0 - m) * x;
    }
    let spread = if sorted.len() > 1 { spread / (m * (m - 1.0)) } else { 0.0 };
    misfit / m - spread
}

#[cfg(test)]
mod tests {
    //! Contract: the scores by hand on cases small enough to do so.
    use super::*;

    #[test]
    fn crps_of_two_samples_by_hand() {
        // E|X - y| = (1 + 3) / 2, half of E|X - X'| over distinct pairs = 2 / 2.
        assert!((crps_of(&[1.0, 3.0], 0.0) - (2.0 - 1.0)).abs() < 1e-12);
        assert!((crps_of(&[2.0], 0.5) - 1.5).abs() < 1e-12);
    }

    #[test]
    fn fair_crps_does_not_depend_on_the_number_of_samples() {
        // Samples and truth from one uniform law: the CRPS is 1/6 on average whatever the ensemble.
        for m in [2_usize, 5, 50] {
            let mut rng = augsim_data::random_stream(1, "crps", m as u64);
            let mut uniform = || (rand::Rng::next_u64(&mut rng) >> 40) as f32 / (1 << 24) as f32;
            let n = 40_000;
            let total: f64 = (0..n)
                .map(|_| {
                    let mut x: Vec<f32> = (0..m).map(|_| uniform()).collect();
                    x.sort_unstable_by(f32::total_cmp);
                    crps_of(&x, f64::from(uniform()))
                })
                .sum();
            // The standard error of the mean is below 0.0015 for each m.
            assert!((total / f64::from(n) - 1.0 / 6.0).abs() < 6e-3, "m = {m}: {}", total / f64::from(n));
        }
    }

    fn scoring(columns: &[&str], actions: &[&str]) -> Scoring {
        let owned = |names: &[&str]| names.iter().map(|c| (*c).to_owned()).collect();
        Scoring::of(&Sequences { columns: owned(columns), action_columns: owned(actions), items: Vec::new() })
    }

    #[test]
    fn a_point_forecast_scores_its_absolute_error() {
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
    fn errors_of_a_push_by_hand() {
        let truth = [3.0, 4.0, 0.0, 3.0, 4.0, 0.1, 6.0, 8.0, 0.2];
        // Predicts the start for ever: errors 0 and 5 m, 0.1 and 0.2 rad.
        let values = [3.0, 4.0, 0.0].repeat(3);
        let scoring = scoring(&["x_m", "y_m", "theta_rad"], &["pusher_x_m"]);
        let s = average(&[score(&Samples { count: 1, values }, &truth, &scoring)]);
        assert!((s.mean.absolute[0] - 2.5).abs() < 1e-6);
        assert!((s.mean.absolute[1] - 0.15).abs() < 1e-6);
        assert!((s.mean.trans_percent - 100.0 * 5.0 / 15.0).abs() < 1e-6);
        assert!((s.mean.moved_percent - 100.0).abs() < 1e-6);
        assert!((s.mean.end[0] - 5.0).abs() < 1e-6);
        assert_eq!((s.over_parts[0], s.over_parts[5], s.coverage50), (0.0, 5.0, None));
        assert!(s.over_parts[1].is_nan(), "two samples are in two parts");
    }
}
