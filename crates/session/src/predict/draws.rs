//! Draws of the outputs of a record from a model or a net, and the prediction bands computed from them.

use augsim_discovery::{
    PREDICTION_LEVELS, PredictedChannel, PredictedRecord, PredictionError, PredictionSet,
};
use augsim_equations::Model;
use augsim_equations::model::Output;
use augsim_system::Record;

/// Predictive draws of a record's outputs, from an initial state fitted to its first samples.
#[derive(Debug)]
pub struct RecordDraws {
    /// Name of the record in the data.
    pub id: String,
    /// Times of the record's samples, s.
    pub times: Vec<f64>,
    /// Measured values of the outputs, `[output][sample]`; NaN at gaps.
    pub measured: Vec<Vec<f64>>,
    /// Number of first samples that the initial state was fitted to.
    pub initial_sample_count: usize,
    /// Prediction of the outputs without noise, `[output][sample]`.
    pub forecast: Vec<Vec<f64>>,
    /// Draws of the outputs with measurement noise, `[output][sample][draw]`, sorted; non-finite draws are dropped.
    pub draws: Vec<Vec<Vec<f64>>>,
    /// Standard deviation of the measurement noise of each output, in the unit of the output.
    pub noise: Vec<f64>,
}

impl RecordDraws {
    /// Collects the draws of a record and sorts them.
    pub fn new(
        record: &Record,
        known: usize,
        forecast: Vec<Vec<f64>>,
        mut draws: Vec<Vec<Vec<f64>>>,
        noise: Vec<f64>,
    ) -> Self {
        draws.iter_mut().flatten().for_each(|list| list.sort_by(f64::total_cmp));
        let (id, times, measured) = (record.id.clone(), record.times.clone(), record.values.clone());
        RecordDraws { id, times, measured, initial_sample_count: known, forecast, draws, noise }
    }

    /// Summarises the draws as mean and quantiles of every output.
    pub(super) fn predicted(&self, model: &Model) -> PredictedRecord {
        let channel = |(o, output): (usize, &Output)| {
            Bands::of_draws(&self.draws[o]).channel(output, &self.measured[o], &self.forecast[o])
        };
        PredictedRecord {
            id: self.id.clone(),
            times: self.times.clone(),
            initial_sample_count: self.initial_sample_count,
            channels: model.outputs.iter().enumerate().map(channel).collect(),
        }
    }
}

/// Mean and quantiles of the draws of an output at successive samples.
#[derive(Debug, Default)]
pub(super) struct Bands {
    mean: Vec<f64>,
    quantiles: [Vec<f64>; PREDICTION_LEVELS.len()],
}

impl Bands {
    /// Computes mean and quantiles from the sorted draws of each sample.
    pub fn of_draws(lists: &[Vec<f64>]) -> Self {
        let mut bands = Bands::default();
        for list in lists {
            bands.mean.push(list.iter().sum::<f64>() / list.len() as f64);
            for (quantile, level) in bands.quantiles.iter_mut().zip(PREDICTION_LEVELS) {
                quantile.push(augsim_discovery::quantile_of_draws(list, level));
            }
        }
        bands
    }

    /// Joins the bands of successive ranges of samples.
    pub fn joined<'a>(parts: impl Iterator<Item = &'a Bands>) -> Self {
        let mut joined = Bands::default();
        for part in parts {
            joined.mean.extend(&part.mean);
            joined.quantiles.iter_mut().zip(&part.quantiles).for_each(|(to, from)| to.extend(from));
        }
        joined
    }

    /// The bands of an output with its measured values and its noise-free prediction.
    ///
    /// Predictions of a periodic quantity are moved by whole periods to the measured values.
    pub fn channel(self, output: &Output, measured: &[f64], forecast: &[f64]) -> PredictedChannel {
        let mut predicted = PredictedChannel {
            column: output.name.clone(),
            measured: measured.to_vec(),
            forecast: forecast.to_vec(),
            mean: self.mean,
            quantiles: self.quantiles,
        };
        predicted.move_to_measured_turn(output.period);
        predicted
    }
}

/// Collects the predictions with bands of all records, and computes the errors of each output.
///
/// `noise` is the standard deviation of the measurement noise of each output of each record, `seed` is the
/// seed of the bootstrap of the errors.
pub(super) fn prediction_set(
    model: &Model,
    records: Vec<PredictedRecord>,
    noise: Vec<Vec<f64>>,
    seed: u64,
) -> PredictionSet {
    let outputs = model.outputs.iter().enumerate();
    let (errors, mut squares): (Vec<_>, Vec<_>) =
        outputs.map(|(o, _)| error(model, o, &records, seed)).unzip();
    let squares = if squares.is_empty() { Vec::new() } else { squares.swap_remove(0) };
    let mean_noise = |o: usize| noise.iter().map(|noise| noise[o]).sum::<f64>() / noise.len().max(1) as f64;
    let noise_sd = (0..model.outputs.len()).map(mean_noise).collect();
    let start = "the first samples of each trajectory (--burn-in)".to_owned();
    PredictionSet { records, errors, squares, noise_sd, start }
}

/// Computes the RMSE of output `o` after the burn-in (NaN without a sample).
///
/// Also returns the sum and the number of the squared errors of each record.
fn error(
    model: &Model,
    o: usize,
    records: &[PredictedRecord],
    seed: u64,
) -> (PredictionError, Vec<(f64, f64)>) {
    let output = &model.outputs[o];
    let mut squares = Vec::new();
    for r in records {
        let c = &r.channels[o];
        let (mut sum, mut count) = (0.0, 0.0);
        for k in (r.initial_sample_count..r.times.len()).filter(|&k| c.measured[k].is_finite()) {
            let error = output.error(c.measured[k], c.forecast[k]);
            sum += error * error;
            count += 1.0;
        }
        squares.push((sum, count));
    }
    let ci95 = augsim_discovery::rmse_interval(&squares, seed);
    let (sum, count) = squares.iter().fold((0.0, 0.0), |a, s| (a.0 + s.0, a.1 + s.1));
    let unit = output.unit.map_or_else(String::new, |u| u.symbol());
    // NaN where nothing was measured after the burn-in.
    let rmse = (sum / count).sqrt();
    (PredictionError { measure: output.name.clone(), unit, rmse, ci95, channels: vec![o] }, squares)
}
