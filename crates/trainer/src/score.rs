//! Errors of a forecast against the truth.
//!
//! Besides the paper's metrics (mean absolute error; per cent of the sum of the first column): the
//! continuous ranked probability score (Gneiting and Raftery 2007, fair estimator) and how often the truth
//! lies in the central 50 and 90 % bands of the samples.

use crate::Samples;
use serde::{Deserialize, Serialize};

/// Samples that the paper averages.
pub const PAPER_SAMPLES: usize = 10;

/// How far outside a band a value may lie and still count as inside, in the column's unit: the data carry
/// six digits, and before the first impact (or at rest) every sample agrees to better than that.
const RESOLUTION: f64 = 2e-5;

/// Errors of one point estimate; one entry per state column, in the column's unit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PointError {
    /// Mean absolute error.
    pub absolute: Vec<f64>,
    /// Mean over trajectories of sum |error| / sum |truth| of the first column, per cent.
    pub trans_percent: f64,
}

/// Scores of one or many trajectories.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Score {
    /// Trajectories.
    pub trajectories: usize,
    /// Mean of the first [`PAPER_SAMPLES`] samples: the paper's estimate.
    pub mean: PointError,
    /// Median of all samples.
    pub median: PointError,
    /// Continuous ranked probability score per state column, in the column's unit; for a deterministic
    /// forecast the absolute error.
    pub crps: Vec<f64>,
    /// Share of samples in the central 50 % band, over all state columns; absent for a deterministic
    /// forecast.
    pub coverage50: Option<f64>,
    /// Share in the central 90 % band.
    pub coverage90: Option<f64>,
    /// Mean absolute error of the mean estimate at each time step, per state column: `[time][S]`.
    pub over_time: Vec<Vec<f64>>,
}

/// Scores `samples` of one trajectory against `truth [time, S]` with `s` columns.
pub fn score(samples: &Samples, truth: &[f64], s: usize) -> Score {
    let (count, time) = (samples.count, truth.len() / s);
    let mut out = Score {
        trajectories: 1,
        mean: PointError { absolute: vec![0.0; s], trans_percent: 0.0 },
        median: PointError { absolute: vec![0.0; s], trans_percent: 0.0 },
        crps: vec![0.0; s],
        over_time: vec![vec![0.0; s]; time],
        ..Score::default()
    };
    let mut inside = [0.0; 2];
    let mut sorted = vec![0.0_f32; count];
    let averaged = count.min(PAPER_SAMPLES);
    for t in 0..time {
        for j in 0..s {
            let y = truth[t * s + j];
            let row = &samples.values[(t * s + j) * count..][..count];
            let mean = row[..averaged].iter().map(|v| f64::from(*v)).sum::<f64>() / averaged as f64;
            out.over_time[t][j] = (mean - y).abs();
            out.mean.absolute[j] += (mean - y).abs();
            sorted.copy_from_slice(row);
            sorted.sort_unstable_by(f32::total_cmp);
            out.median.absolute[j] += (quantile(&sorted, 0.5) - y).abs();
            out.crps[j] += crps_of(&sorted, y);
            for (inside, level) in inside.iter_mut().zip([0.5, 0.9]) {
                let (low, high) =
                    (quantile(&sorted, 0.5 - level / 2.0), quantile(&sorted, 0.5 + level / 2.0));
                let hit = (low - RESOLUTION..=high + RESOLUTION).contains(&y);
                *inside += f64::from(u8::from(hit));
            }
        }
    }
    let size: f64 = truth.iter().step_by(s).map(|y| y.abs()).sum();
    for point in [&mut out.mean, &mut out.median] {
        point.trans_percent = 100.0 * point.absolute[0] / size;
        point.absolute.iter_mut().for_each(|v| *v /= time as f64);
    }
    out.crps.iter_mut().for_each(|v| *v /= time as f64);
    if count > 1 {
        let [half, most] = inside.map(|n| n / (time * s) as f64);
        (out.coverage50, out.coverage90) = (Some(half), Some(most));
    }
    out
}

/// Mean of the scores of several trajectories.
pub fn average(scores: &[Score]) -> Score {
    let n = scores.len() as f64;
    let mean = |f: &dyn Fn(&Score) -> f64| scores.iter().map(f).sum::<f64>() / n;
    let columns = scores.first().map_or(0, |s| s.crps.len());
    let vector =
        |f: &dyn Fn(&Score) -> &Vec<f64>| -> Vec<f64> { (0..columns).map(|j| mean(&|s| f(s)[j])).collect() };
    let share = |f: &dyn Fn(&Score) -> Option<f64>| -> Option<f64> {
        scores.iter().map(f).sum::<Option<f64>>().map(|total| total / n)
    };
    let longest = scores.iter().map(|s| s.over_time.len()).max().unwrap_or(0);
    let at_time = |t: usize, j: usize| {
        let (sum, count) = scores
            .iter()
            .filter_map(|s| s.over_time.get(t))
            .fold((0.0, 0.0), |(sum, count), row| (sum + row[j], count + 1.0));
        sum / count
    };
    Score {
        trajectories: scores.iter().map(|s| s.trajectories).sum(),
        mean: PointError {
            absolute: vector(&|s| &s.mean.absolute),
            trans_percent: mean(&|s| s.mean.trans_percent),
        },
        median: PointError {
            absolute: vector(&|s| &s.median.absolute),
            trans_percent: mean(&|s| s.median.trans_percent),
        },
        crps: vector(&|s| &s.crps),
        coverage50: share(&|s| s.coverage50),
        coverage90: share(&|s| s.coverage90),
        over_time: (0..longest).map(|t| (0..columns).map(|j| at_time(t, j)).collect()).collect(),
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

/// Fair estimate of the CRPS from sorted samples: mean |X - y| minus half the mean |X - X'| over distinct
/// pairs.
pub(crate) fn crps_of(sorted: &[f32], y: f64) -> f64 {
    let m = sorted.len() as f64;
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

    #[test]
    fn a_point_forecast_scores_its_absolute_error() {
        let samples = Samples { count: 1, values: vec![1.0, 0.0, 2.0, 0.0] };
        let s = score(&samples, &[2.0, 1.0, 2.0, -1.0], 2);
        assert_eq!(s.mean.absolute, [0.5, 1.0]);
        assert_eq!(s.mean.trans_percent, 25.0);
        assert_eq!(s.crps, [0.5, 1.0]);
        assert_eq!(s.coverage50, None);
    }

    #[test]
    fn coverage_counts_the_central_band() {
        let values: Vec<f32> = (0..=100).map(|i| i as f32).collect();
        let inside = |y: f64| score(&Samples { count: 101, values: values.clone() }, &[y], 1);
        assert_eq!([inside(25.0).coverage50, inside(24.0).coverage50], [Some(1.0), Some(0.0)]);
        assert_eq!([inside(5.0).coverage90, inside(96.0).coverage90], [Some(1.0), Some(0.0)]);
    }
}
