//! Results of predictions with a fixed model: every record with the bands of its channels.

use crate::forecast::{bootstrap, rmse};
use std::collections::BTreeSet;

/// Levels of the quantiles in [`PredictedChannel::quantiles`].
pub const PREDICTION_LEVELS: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// Options of a prediction with a fixed model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PredictOptions {
    /// Seed of the random draws for the bands.
    pub seed: u64,
    /// Number of random draws per record from which the bands are computed.
    pub draws: usize,
    /// Names of the records to predict; `None` for all. The noise is estimated from all records in either
    /// case.
    pub only: Option<BTreeSet<String>>,
}

impl PredictOptions {
    /// Whether the record of this name is predicted.
    pub fn is_requested(&self, id: &str) -> bool {
        self.only.as_ref().is_none_or(|only| only.contains(id))
    }
}

/// Prediction of one channel of one record, in the unit of the column.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictedChannel {
    /// Name of the channel's column in the data.
    pub column: String,
    /// Measured values; NaN where nothing was measured or the sample was masked as an outlier.
    pub measured: Vec<f64>,
    /// Prediction with all parameters at their nominal values and without noise, sample by sample.
    pub forecast: Vec<f64>,
    /// Mean of the random draws, sample by sample.
    pub mean: Vec<f64>,
    /// Quantiles of the random draws at [`PREDICTION_LEVELS`], `[level][sample]`.
    pub quantiles: [Vec<f64>; 5],
}

impl PredictedChannel {
    /// Shifts predictions of a periodic quantity, such as an angle, by whole periods towards the measured
    /// values.
    ///
    /// At samples without a measured value they are shifted to within half a period of the middle of the
    /// measured range.
    pub fn move_to_measured_turn(&mut self, period: Option<f64>) {
        let Some(period) = period else { return };
        let finite = || self.measured.iter().copied().filter(|v| v.is_finite());
        let [low, high] =
            [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)];
        let middle = if low <= high { 0.5 * (low + high) } else { 0.0 };
        for k in 0..self.measured.len() {
            let target = if self.measured[k].is_finite() { self.measured[k] } else { middle };
            let turns = |value: f64| period * ((value - target) / period).round();
            // The band moves as a whole, with its median; the prediction without noise moves alone.
            let by = turns(self.quantiles[2][k]);
            self.mean[k] -= by;
            self.quantiles.iter_mut().for_each(|q| q[k] -= by);
            self.forecast[k] -= turns(self.forecast[k]);
        }
    }
}

/// Prediction of one record, or of a part of a long one.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictedRecord {
    /// Name of the record in the data.
    pub id: String,
    /// Times of the samples, s.
    pub times: Vec<f64>,
    /// Number of first samples from which the initial state was estimated; the other samples are predicted.
    pub initial_sample_count: usize,
    /// Predictions of the channels, in the order of the system.
    pub channels: Vec<PredictedChannel>,
}

/// Root mean square error of one measure over all records, with its 95 % interval from a bootstrap over
/// records.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictionError {
    /// Name of the error measure (`position`, `rotation`).
    pub measure: String,
    /// Unit of the error and its interval.
    pub unit: String,
    /// Root mean square error over the predicted samples of all records.
    pub rmse: f64,
    /// Lower and upper end of the 95 % interval of `rmse`.
    pub ci95: [f64; 2],
    /// Indices of the channels that the measure combines.
    pub channels: Vec<usize>,
}

/// Predictions of all requested records, with their errors.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictionSet {
    /// Records with predicted samples.
    pub records: Vec<PredictedRecord>,
    /// Errors in the predicted samples, by measure; the first is that of the deciding measure.
    pub errors: Vec<PredictionError>,
    /// Sum of squared errors and their number in the deciding measure, for each record.
    pub squares: Vec<(f64, f64)>,
    /// Estimated standard deviation of the measurement noise by channel, in the unit of each.
    pub noise_sd: Vec<f64>,
    /// Description in words of the samples from which the initial states were estimated.
    pub start: String,
}

impl PredictionSet {
    /// As [`coverage`](Self::coverage), over all channels together.
    pub fn total_coverage(&self, level: f64) -> (f64, usize) {
        let channels = self.records.first().map_or(0, |r| r.channels.len());
        self.coverage(level, &(0..channels).collect::<Vec<_>>())
    }

    /// Coefficient of determination of the predictions of the channels with these indices. It is 1 minus the
    /// ratio of the squared errors to the squared deviations from the mean of each channel; not finite if
    /// these are 0.
    pub fn r2(&self, channels: &[usize]) -> f64 {
        let (mut errors, mut deviations) = (0.0, 0.0);
        for index in channels {
            let list = self.records.iter().filter_map(|r| Some((r, r.channels.get(*index)?)));
            let pairs: Vec<(f64, f64)> = list
                .flat_map(|(r, c)| c.measured.iter().zip(&c.forecast).skip(r.initial_sample_count))
                .map(|(measured, forecast)| (*measured, *forecast))
                .filter(|(measured, _)| measured.is_finite())
                .collect();
            let mean = pairs.iter().map(|(y, _)| y).sum::<f64>() / pairs.len() as f64;
            errors += pairs.iter().map(|(y, f)| (y - f) * (y - f)).sum::<f64>();
            deviations += pairs.iter().map(|(y, _)| (y - mean) * (y - mean)).sum::<f64>();
        }
        1.0 - errors / deviations
    }

    /// Share of the predicted samples that lie within the central band of probability 0.5 or 0.9, and their
    /// number. `level` below 0.7 selects 0.5; the samples are those of the channels with these indices.
    pub fn coverage(&self, level: f64, channels: &[usize]) -> (f64, usize) {
        let [low, high] = if level < 0.7 { [1, 3] } else { [0, 4] };
        let (mut inside, mut count) = (0_usize, 0_usize);
        for r in &self.records {
            for c in channels.iter().filter_map(|c| r.channels.get(*c)) {
                for k in (r.initial_sample_count..r.times.len()).filter(|&k| c.measured[k].is_finite()) {
                    count += 1;
                    let band = c.quantiles[low][k]..=c.quantiles[high][k];
                    inside += usize::from(band.contains(&c.measured[k]));
                }
            }
        }
        (inside as f64 / count.max(1) as f64, count)
    }
}

/// 95 % interval of the root mean square error over records, from each record's sum of squared errors and
/// their number.
pub fn rmse_interval(squares: &[(f64, f64)], seed: u64) -> [f64; 2] {
    let records: Vec<usize> = (0..squares.len()).collect();
    bootstrap(&records, &[squares], seed, |r| r[0])
}

/// Root mean square error of `before` minus that of `after`, with its 95 % interval over records. Both lists
/// hold the sum of squared errors and their number for the same records, in the same order.
pub fn rmse_reduction(before: &[(f64, f64)], after: &[(f64, f64)], seed: u64) -> (f64, [f64; 2]) {
    let records: Vec<usize> = (0..before.len()).collect();
    let ci95 = bootstrap(&records, &[before, after], seed, |r| r[0] - r[1]);
    (rmse(before) - rmse(after), ci95)
}

/// Random draws of the prediction of one record, by channel and sample.
pub(crate) struct Draws {
    /// `values[channel][sample]` is the list of draws at one sample.
    values: Vec<Vec<Vec<f64>>>,
}

impl Draws {
    pub fn new(channels: usize, samples: usize, draws: usize) -> Self {
        Self { values: vec![vec![Vec::with_capacity(draws); samples]; channels] }
    }

    /// Adds one drawn value of a channel at a sample; ignores NaN and infinity.
    pub fn push(&mut self, channel: usize, sample: usize, value: f64) {
        if value.is_finite() {
            self.values[channel][sample].push(value);
        }
    }

    /// Mean of a channel's draws at each sample, and their quantiles at [`PREDICTION_LEVELS`] (5, 25, 50, 75,
    /// 95 %).
    pub fn summary(&mut self, channel: usize) -> (Vec<f64>, [Vec<f64>; 5]) {
        let mut mean = Vec::new();
        let mut quantiles: [Vec<f64>; 5] = Default::default();
        for values in &mut self.values[channel] {
            values.sort_by(f64::total_cmp);
            mean.push(values.iter().sum::<f64>() / values.len() as f64);
            for (list, level) in quantiles.iter_mut().zip(PREDICTION_LEVELS) {
                list.push(quantile_of_draws(values, level));
            }
        }
        (mean, quantiles)
    }
}

/// Quantile at `level` of the distribution from which the sorted draws come. Order statistics are at
/// `k / (n + 1)` (type 6 of Hyndman and Fan), so that a new draw is below it with probability `level`. The usual
/// interpolation between smallest and largest draw would be too narrow.
pub fn quantile_of_draws(sorted: &[f64], level: f64) -> f64 {
    let n = sorted.len();
    if n == 0 {
        return f64::NAN;
    }
    let position = (level * (n + 1) as f64 - 1.0).clamp(0.0, (n - 1) as f64);
    let low = position.floor() as usize;
    let high = (low + 1).min(n - 1);
    sorted[low] + (sorted[high] - sorted[low]) * (position - low as f64)
}

#[cfg(test)]
mod tests {
    //! Contract: quantiles of draws are unbiased for a further draw, and draws that are not finite are
    //! ignored.
    use super::*;

    #[test]
    fn quantiles_are_those_of_a_further_draw() {
        let nine: Vec<f64> = (1..=9).map(f64::from).collect();
        assert_eq!(quantile_of_draws(&nine, 0.5), 5.0);
        assert_eq!(quantile_of_draws(&nine, 0.25), 2.5);
        assert_eq!(quantile_of_draws(&nine, 0.05), 1.0);
        assert!(quantile_of_draws(&[], 0.5).is_nan());
    }

    #[test]
    fn failed_simulations_do_not_reach_the_bands() {
        let mut draws = Draws::new(1, 1, 3);
        [1.0, f64::NAN, 3.0].into_iter().for_each(|v| draws.push(0, 0, v));
        let (mean, quantiles) = draws.summary(0);
        assert_eq!((mean[0], quantiles[2][0]), (2.0, 2.0));
    }

    #[test]
    fn bands_of_an_angle_follow_the_turn_of_the_measured_values() {
        let tau = std::f64::consts::TAU;
        let quantiles = [-0.2, -0.1, 0.0, 0.1, 0.2].map(|d| vec![3.2 + d, 9.5 + d, 0.1 + d]);
        let mut channel = PredictedChannel {
            column: "angle_rad".into(),
            measured: vec![-3.1, 3.1, f64::NAN],
            forecast: vec![3.2, 9.5, 0.1 - tau],
            mean: vec![3.2, 9.5, 0.1],
            quantiles,
        };
        channel.move_to_measured_turn(Some(tau));
        for (k, expected) in [3.2 - tau, 9.5 - tau, 0.1].into_iter().enumerate() {
            assert!(
                (channel.mean[k] - expected).abs() < 1e-12 && (channel.forecast[k] - expected).abs() < 1e-12
            );
        }
        let (times, channels) = (vec![0.0, 1.0, 2.0], vec![channel]);
        let record = PredictedRecord { id: "1".into(), times, initial_sample_count: 0, channels };
        let set = PredictionSet {
            records: vec![record],
            errors: Vec::new(),
            squares: Vec::new(),
            noise_sd: Vec::new(),
            start: String::new(),
        };
        assert_eq!(set.coverage(0.9, &[0]), (1.0, 2));
        assert_eq!(set.coverage(0.5, &[0]), (0.5, 2));
        // Errors of 0.017 and 0.117 rad; deviations of 3.1 rad from the mean of 0.
        let [first, second] = [3.2 - tau + 3.1, 9.5 - tau - 3.1];
        let expected = 1.0 - (first * first + second * second) / (2.0 * 3.1 * 3.1);
        assert!((set.r2(&[0]) - expected).abs() < 1e-12, "{} and {expected}", set.r2(&[0]));
    }
}
