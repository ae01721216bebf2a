//! Prediction errors before and after, on trajectories that no fit used.
//!
//! Each model estimates its own initial state from the first samples of a trajectory and predicts the
//! others.

use crate::evaluate::{Lanes, Point};
use crate::fit::{ChosenRecords, Fit, fit_nuisance};
use crate::hypothesis::Hypothesis;
use crate::record::{Measured, Record, RecordWindow};
use crate::replicate_noise::ReplicateNoise;
use crate::statistics::{median, quantile};
use augsim_data::random_stream;
use augsim_system::{
    ErrorFigure, InitialValue, Per, Record as SystemRecord, ScatterPer, Simulated, State, Window, channel_sd,
    shortest_difference, split_by_duration,
};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::ops::Range;

/// Number of bootstrap resamples of the trajectories.
const RESAMPLES: usize = 400;
/// Number of simulated replicates of each record for the noise floor.
const REPLICATES: u64 = 4;

/// Maximum error of a predicted sample, in standard deviations of its channel. It keeps the error of a
/// diverging prediction finite.
const MAX_ERROR: f64 = 1e6;

/// Minimum number of records that the bootstrap resamples as wholes; with fewer it resamples single
/// predictions.
const MIN_CLUSTERS: usize = 10;

/// Sum of squared errors of one prediction in one measure, in the squared unit of its channels, and their
/// number.
pub(crate) type Error = (f64, f64);

/// `errors[measure][prediction]`: errors of a list of predictions in each measure of the schema
/// (`error_figures`).
pub(crate) type Errors = Vec<Vec<Error>>;

/// Range of samples of a record that is predicted from its first samples.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ForecastSpan {
    /// Position of the record in the list of chosen records.
    pub chosen: usize,
    pub samples: Range<usize>,
    /// Whether only the error at the last sample of the range counts.
    pub ends: bool,
}

impl ForecastSpan {
    /// Name of the predicted range: that of the record, with the start time if it is a part of it.
    pub fn name(&self, record: &Record) -> String {
        if self.samples == (0..record.data.times.len()) {
            return record.data.id.clone();
        }
        format!("{} from {:.3} s", record.data.id, record.data.times[self.samples.start])
    }
}

/// Predicted ranges of the error tables: whole records, or the parts that the system defines.
pub(crate) fn whole_spans(sample: &ChosenRecords<'_>) -> Vec<ForecastSpan> {
    let spans = |(chosen, record): (usize, &Record)| {
        let whole = 0..record.data.times.len();
        let ranges =
            if record.data.forecasts.is_empty() { vec![whole] } else { record.data.forecasts.clone() };
        ranges.into_iter().map(move |samples| ForecastSpan { chosen, samples, ends: false })
    };
    sample.records().enumerate().flat_map(spans).collect()
}

/// Predicted ranges of duration `horizon_s`, of each of which only the last sample counts.
pub(crate) fn horizon(sample: &ChosenRecords<'_>, horizon_s: f64) -> Vec<ForecastSpan> {
    let spans = |(chosen, record): (usize, &Record)| {
        let ranges = split_by_duration(&record.data.times, horizon_s).into_iter();
        ranges.map(move |samples| ForecastSpan { chosen, samples, ends: true })
    };
    sample.records().enumerate().flat_map(spans).collect()
}

/// Root mean square of the pooled errors of predictions, in the unit of the channels; NaN without errors.
pub(crate) fn rmse(errors: &[Error]) -> f64 {
    let (s, n) = errors.iter().fold((0.0, 0.0), |a, e| (a.0 + e.0, a.1 + e.1));
    if n > 0.0 { (s / n).sqrt() } else { f64::NAN }
}

/// 95 % bootstrap interval of a statistic of root mean square errors, one for each list in `lists`. `records`
/// is the record of each prediction.
pub(crate) fn bootstrap(
    records: &[usize],
    lists: &[&[Error]],
    seed: u64,
    statistic: impl Fn(&[f64]) -> f64,
) -> [f64; 2] {
    let mut clusters: Vec<Vec<usize>> = Vec::new();
    for (i, record) in records.iter().enumerate() {
        match clusters.last_mut() {
            Some(cluster) if records[cluster[0]] == *record => cluster.push(i),
            _ => clusters.push(vec![i]),
        }
    }
    if clusters.len() < MIN_CLUSTERS {
        clusters = (0..records.len()).map(|i| vec![i]).collect();
    }
    let n = clusters.len();
    if n == 0 {
        return [f64::NAN; 2];
    }
    let mut rng = random_stream(seed, "bootstrap", 0);
    let mut values: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let picks: Vec<usize> =
                (0..n).flat_map(|_| clusters[rng.random_range(0..n)].iter().copied()).collect();
            let errors: Vec<f64> =
                lists.iter().map(|l| rmse(&picks.iter().map(|&i| l[i]).collect::<Vec<_>>())).collect();
            statistic(&errors)
        })
        .filter(|v| v.is_finite())
        .collect();
    values.sort_by(f64::total_cmp);
    [quantile(&values, 0.025), quantile(&values, 0.975)]
}

/// Hypothesis of a training fit as used for predictions on other records. It has no random effect of the
/// events. Parameters with one value per record get a prior from the training records, because the first
/// samples may not determine them.
pub(crate) fn predictor(training: &Fit) -> Hypothesis {
    let mut h = training.hypothesis.clone();
    let count = h.free.iter().filter(|f| f.per == Per::Trajectory).count();
    let first = h.system.schema().free_states().count();
    for k in 0..count {
        let mut values: Vec<f64> =
            training.nuisance.iter().filter_map(|n| n.get(first + k).copied()).collect();
        let centre = median(&mut values);
        let mut distances: Vec<f64> = values.iter().map(|v| (v - centre).abs()).collect();
        let sd = (1.4826 * median(&mut distances)).max(1e-6);
        if let Some(f) = h.free.iter_mut().filter(|f| f.per == Per::Trajectory).nth(k) {
            f.prior = Some((centre, sd));
        }
    }
    h.scatter = None;
    h
}

/// Measured part of the state at a sample, from which a prediction within a record starts; 0 for other
/// states.
fn measured_at(data: &Measured, record: &Record, sample: usize) -> Vec<f64> {
    let measured = |state: &State| match state.initial {
        InitialValue::Measured(channel) => {
            record.data.values[channel][sample..].iter().copied().find(|v| v.is_finite()).unwrap_or(0.0)
        }
        InitialValue::Fixed(value) | InitialValue::Prior(value, _) => value,
        InitialValue::Free
        | InitialValue::PriorAboutExpression(_)
        | InitialValue::FromRecord
        | InitialValue::PriorAboutRecord(_) => 0.0,
    };
    data.system.schema().states.iter().map(measured).collect()
}

/// The known first samples of a record, from which a prediction starts, as a record of one window.
pub(crate) fn beginning(record: &Record) -> Record {
    let start = record.data.windows.first().map_or_else(Vec::new, |w| w.start.clone());
    cut_to(record, 0..record.data.initial_sample_count, start)
}

/// The known samples from which a prediction beginning at sample `first` starts, as a record of one window.
fn prefix(data: &Measured, record: &Record, first: usize) -> Record {
    if first == 0 {
        return beginning(record);
    }
    cut_to(record, first..first + 1, measured_at(data, record, first))
}

/// The samples of a record up to the end of `known`, with `known` as its only window and `start` as initial
/// state.
fn cut_to(record: &Record, known: Range<usize>, start: Vec<f64>) -> Record {
    let Record { data, weight, is_tolerance, recording } = record;
    let until = |channel: &Vec<f64>| channel[..known.end].to_vec();
    Record {
        weight: weight.iter().map(until).collect(),
        data: SystemRecord {
            times: until(&data.times),
            values: data.values.iter().map(until).collect(),
            windows: vec![Window { samples: known, start }],
            forecasts: Vec::new(),
            smooth_segments: Vec::new(),
            events: Vec::new(),
            ..data.clone()
        },
        is_tolerance: *is_tolerance,
        recording: recording.clone(),
    }
}

/// Initial state of a prediction, estimated from the known samples of the record.
pub(crate) struct FittedInitialState {
    /// The known samples, as a data set of one record.
    pub observed_part: Measured,
    /// Order of the estimated initial states and record parameters in `nuisance`.
    pub lanes: Lanes,
    pub nuisance: Vec<f64>,
    /// Range of the predicted samples in the record.
    samples: Range<usize>,
}

/// Estimates the initial state of a prediction of `samples` from the known ones among them, at fixed
/// parameters.
pub(crate) fn estimate_initial_state(
    data: &Measured,
    record: &Record,
    samples: Range<usize>,
    h: &Hypothesis,
    theta: &[f64],
    correlation: f64,
) -> FittedInitialState {
    let known = data.with_records(vec![prefix(data, record, samples.start)]);
    let sample = ChosenRecords { data: &known, chosen: &[0], correlation };
    let start = fit_nuisance(&sample, h, theta, &[]);
    let nuisance = start.nuisance.into_iter().next().unwrap_or_default();
    let whole = Window { samples: samples.clone(), start: Vec::new() };
    let lanes = Lanes::new(h, RecordWindow { record: &known.records[0], window: &whole }, &[]);
    FittedInitialState { observed_part: known, lanes, nuisance, samples }
}

impl FittedInitialState {
    /// Simulates the prediction from the estimated initial state.
    pub fn run(&self, h: &Hypothesis, theta: &[f64], record: &Record) -> Simulated {
        simulate_from(&self.observed_part.records[0], record, self.samples.clone(), h, theta, &self.nuisance)
    }

    /// Number of samples of the record up to and including the last known one.
    pub fn known_end(&self) -> usize {
        self.observed_part.records[0].data.times.len()
    }
}

/// Sum of squared errors and their number over the samples `counted`, for each measure. The simulation `run`
/// begins at sample `first`.
pub(crate) fn squares(
    data: &Measured,
    record: &Record,
    run: &Simulated,
    first: usize,
    counted: Range<usize>,
) -> Vec<Error> {
    let sums = |measure: &ErrorFigure| {
        let (mut s, mut n) = (0.0, 0.0);
        for &c in &measure.channels {
            let most = MAX_ERROR * channel_sd(std::slice::from_ref(&record.data), c);
            let period = data.system.schema().channels[c].period;
            for k in counted.clone().filter(|&k| record.weight[c][k] > 0.0) {
                let error = shortest_difference(record.data.values[c][k] - run.value(k - first, c), period);
                // `f64::min` returns the limit if the error is NaN.
                s += error.abs().min(most).powi(2);
                n += 1.0;
            }
        }
        // A length counts once per sample, other measures once per channel.
        if measure.is_euclidean { (s, n / measure.channels.len().max(1) as f64) } else { (s, n) }
    };
    data.system.schema().error_figures.iter().map(sums).collect()
}

/// Errors of one prediction, `[measure]`: sum of squares and number.
fn prediction_errors(
    data: &Measured,
    record: &Record,
    piece: &ForecastSpan,
    h: &Hypothesis,
    theta: &[f64],
    correlation: f64,
) -> Vec<Error> {
    let (first, end) = (piece.samples.start, piece.samples.end);
    let start = estimate_initial_state(data, record, piece.samples.clone(), h, theta, correlation);
    let counted = if piece.ends { end - 1..end } else { start.known_end()..end };
    squares(data, record, &start.run(h, theta, record), first, counted)
}

/// Predicted values `[channel][sample]` of a range of samples, by the hypothesis of a training fit.
pub(crate) fn predicted_channels(
    sample: &ChosenRecords<'_>,
    piece: &ForecastSpan,
    training: &Fit,
    theta: &[f64],
) -> Vec<Vec<f64>> {
    let (h, record) = (predictor(training), &sample.data.records[sample.chosen[piece.chosen]]);
    let start =
        estimate_initial_state(sample.data, record, piece.samples.clone(), &h, theta, sample.correlation);
    let run = start.run(&h, theta, record);
    (0..run.channels()).map(|c| (0..run.samples()).map(|k| run.value(k, c)).collect()).collect()
}

/// Simulates `samples` of a record from the initial state and record parameters in `start`.
pub(crate) fn simulate_from(
    beginning: &Record,
    record: &Record,
    samples: Range<usize>,
    h: &Hypothesis,
    theta: &[f64],
    start: &[f64],
) -> Simulated {
    let whole = Window { samples, start: Vec::new() };
    let lanes = Lanes::new(h, RecordWindow { record: beginning, window: &whole }, &[]);
    let point = Point::new(h, &*h.system, &lanes, record, theta, start);
    point.simulate_plain(&lanes, RecordWindow { record, window: &whole })
}

/// Transposes errors `[prediction][measure]` to `[measure][prediction]`.
fn lists_by_measure(data: &Measured, each: Vec<Vec<Error>>) -> Errors {
    let measures = data.system.schema().error_figures.len();
    (0..measures).map(|m| each.iter().map(|errors| errors[m]).collect()).collect()
}

/// Errors of predictions of the ranges `pieces` with the shared parameters `theta`, by the hypothesis of a
/// training fit.
pub(crate) fn errors(
    sample: &ChosenRecords<'_>,
    pieces: &[ForecastSpan],
    training: &Fit,
    theta: &[f64],
) -> Errors {
    let h = predictor(training);
    let one = |piece: &ForecastSpan| {
        let record = &sample.data.records[sample.chosen[piece.chosen]];
        prediction_errors(sample.data, record, piece, &h, theta, sample.correlation)
    };
    lists_by_measure(sample.data, pieces.par_iter().map(one).collect())
}

/// Root mean square errors of predictions of whole records in each measure, in the unit of its channels.
pub(crate) fn rmse_by_measure(sample: &ChosenRecords<'_>, training: &Fit) -> Vec<f64> {
    errors(sample, &whole_spans(sample), training, &training.theta).iter().map(|list| rmse(list)).collect()
}

/// Root mean square error of predictions of whole records in the first measure, in the unit of its channels.
pub(crate) fn first_rmse(sample: &ChosenRecords<'_>, training: &Fit) -> f64 {
    rmse_by_measure(sample, training).first().copied().unwrap_or(f64::NAN)
}

/// Estimates the noise floor: errors of the same predictions on records simulated with noise and random
/// effects.
///
/// The replicates come from the fitted model. The floor includes the error of the initial states, which are
/// estimated from equally noisy first samples. `fit` has the nuisances of the records in `sample`.
pub(crate) fn noise_floor(
    sample: &ChosenRecords<'_>,
    pieces: &[ForecastSpan],
    training: &Fit,
    fit: &Fit,
    seed: u64,
) -> Errors {
    let h = predictor(training);
    let noise = ReplicateNoise::of_residuals(sample, fit);
    let windows = sample.windows_by_record();
    let one = |(i, piece): (usize, &ForecastSpan)| {
        let record = &sample.data.records[sample.chosen[piece.chosen]];
        let nuisance = &fit.nuisance[windows[piece.chosen].clone()];
        let mut sum = vec![(0.0, 0.0); sample.data.system.schema().error_figures.len()];
        for replicate in 0..REPLICATES {
            let rng = random_stream(seed, "floor", i as u64 * REPLICATES + replicate);
            let copy = replicated(sample, fit, record, piece, (nuisance, &noise), rng);
            let errors = prediction_errors(sample.data, &copy, piece, &h, &fit.theta, sample.correlation);
            sum.iter_mut().zip(errors).for_each(|(a, b)| *a = (a.0 + b.0, a.1 + b.1));
        }
        sum
    };
    lists_by_measure(sample.data, pieces.par_iter().enumerate().map(one).collect())
}

/// Simulates a replicate of a record with noise and random effects. It starts from the fitted initial state
/// of the first window, or within a record from the measured state.
fn replicated(
    sample: &ChosenRecords<'_>,
    fit: &Fit,
    record: &Record,
    piece: &ForecastSpan,
    (nuisance, noise): (&[Vec<f64>], &ReplicateNoise),
    mut rng: impl Rng,
) -> Record {
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut copy = record.clone();
    let (Some(first), Some(start)) = (record.windows().next(), nuisance.first()) else { return copy };
    let lanes = Lanes::new(&fit.hypothesis, first, &[]);
    let mut nuisance = start.clone();
    let begin = piece.samples.start;
    if begin > 0 {
        let window =
            Window { samples: piece.samples.clone(), start: measured_at(sample.data, record, begin) };
        nuisance = lanes.initial_nuisance(&fit.hypothesis, RecordWindow { record, window: &window });
    }
    if let Some(scatter) = fit.hypothesis.scatter {
        let shared = scatter.per == ScatterPer::Record;
        let draw = normal();
        for x in &mut nuisance[lanes.state_nuisances()..] {
            *x = scatter.sd * if shared { draw } else { normal() };
        }
    }
    let h = &fit.hypothesis;
    let whole = Window { samples: piece.samples.clone(), start: Vec::new() };
    let point = Point::new(h, &*h.system, &lanes, record, &fit.theta, &nuisance);
    let run = point.simulate_plain(&lanes, RecordWindow { record, window: &whole });
    for c in 0..run.channels() {
        // The noise of the preceding measured sample, and its index.
        let (mut last, mut before) = (0.0, None);
        for k in piece.samples.clone() {
            let w = record.weight[c][k];
            if w == 0.0 {
                continue;
            }
            let linked = before.is_some_and(|b| record.data.is_correlated_with(b, k));
            let rho = if linked { noise.correlation } else { 0.0 };
            last = rho * last + (1.0 - rho * rho).sqrt() * normal();
            before = Some(k);
            copy.data.values[c][k] = run.value(k - begin, c) + noise.factors[c] * last / w;
        }
    }
    copy
}
