//! Errors before and after, on trajectories that no fit has seen.
//!
//! The initial state is fitted to the first samples alone, each model with its own; the rest is predicted.

use crate::evaluate::{Lanes, Point};
use crate::fit::{ChosenRecords, Fit, fit_nuisance};
use crate::hypothesis::Hypothesis;
use crate::record::{Excerpt, Measured, Record};
use crate::statistics::{median, quantile};
use augsim_data::random_stream;
use augsim_physics::model::Per;
use augsim_physics::system::Record as Seen;
use augsim_physics::system::{Begin, Measure, ScatterPer, Simulated, State, Window, pieces_of, spread};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::ops::Range;

/// Resamplings of the trajectories.
const BOOTSTRAP: usize = 400;
/// Replicates of the noise floor.
const REPLICATES: u64 = 4;

/// Error of a sample, in what its channel scatters by, that a forecast which runs away counts with.
const RUNAWAY: f64 = 1e6;

/// Fewest records that the bootstrap draws as wholes; with fewer it draws their pieces.
const FEWEST_CLUSTERS: usize = 10;

/// Sum of squared errors of one forecast, in the squared unit of its channels, and their number.
pub(crate) type Error = (f64, f64);

/// Errors of forecasts, in their order, for each measure of the schema.
pub(crate) type Errors = Vec<Vec<Error>>;

/// Samples of a record that are forecast from the first of them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ForecastSpan {
    /// Which of the chosen records.
    pub chosen: usize,
    pub samples: Range<usize>,
    /// Whether only the last sample counts.
    pub ends: bool,
}

impl ForecastSpan {
    /// The name of what is forecast: that of the record, with the time at which a piece of a long one begins.
    pub fn name(&self, record: &Record) -> String {
        if self.samples == (0..record.seen.times.len()) {
            return record.seen.id.clone();
        }
        format!("{} from {:.3} s", record.seen.id, record.seen.times[self.samples.start])
    }
}

/// The pieces that tables of errors are made of: whole records, or what their system cuts them into.
pub(crate) fn whole(sample: &ChosenRecords<'_>) -> Vec<ForecastSpan> {
    let of = |(chosen, record): (usize, &Record)| {
        let all = 0..record.seen.times.len();
        let ranges = if record.seen.forecasts.is_empty() { vec![all] } else { record.seen.forecasts.clone() };
        ranges.into_iter().map(move |samples| ForecastSpan { chosen, samples, ends: false })
    };
    sample.records().enumerate().flat_map(of).collect()
}

/// Pieces of `horizon_s`, of which the last sample counts.
pub(crate) fn horizon(sample: &ChosenRecords<'_>, horizon_s: f64) -> Vec<ForecastSpan> {
    let of = |(chosen, record): (usize, &Record)| {
        let ranges = pieces_of(&record.seen.times, horizon_s).into_iter();
        ranges.map(move |samples| ForecastSpan { chosen, samples, ends: true })
    };
    sample.records().enumerate().flat_map(of).collect()
}

/// Root mean square of pooled errors, in the unit of the channels.
pub(crate) fn rmse(errors: &[Error]) -> f64 {
    let (s, n) = errors.iter().fold((0.0, 0.0), |a, e| (a.0 + e.0, a.1 + e.1));
    if n > 0.0 { (s / n).sqrt() } else { f64::NAN }
}

/// 95 % interval of a statistic of several error lists over bootstrap samples of the records that the forecasts are of.
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
    if clusters.len() < FEWEST_CLUSTERS {
        clusters = (0..records.len()).map(|i| vec![i]).collect();
    }
    let n = clusters.len();
    if n == 0 {
        return [f64::NAN; 2];
    }
    let mut rng = random_stream(seed, "bootstrap", 0);
    let mut values: Vec<f64> = (0..BOOTSTRAP)
        .map(|_| {
            let picks: Vec<usize> =
                (0..n).flat_map(|_| clusters[rng.random_range(0..n)].iter().copied()).collect();
            let each: Vec<f64> =
                lists.iter().map(|l| rmse(&picks.iter().map(|&i| l[i]).collect::<Vec<_>>())).collect();
            statistic(&each)
        })
        .filter(|v| v.is_finite())
        .collect();
    values.sort_by(f64::total_cmp);
    [quantile(&values, 0.025), quantile(&values, 0.975)]
}

/// The hypothesis as a predictor: scatter off, and a trajectory's own parameters drawn towards those of the training
/// trajectories, because the first samples may say little about them.
pub(crate) fn predictor(training: &Fit) -> Hypothesis {
    let mut h = training.hypothesis.clone();
    let own = h.free.iter().filter(|f| f.per == Per::Trajectory).count();
    let first = h.system.schema().free_states().count();
    for k in 0..own {
        let mut values: Vec<f64> =
            training.nuisance.iter().filter_map(|n| n.get(first + k).copied()).collect();
        let middle = median(&mut values);
        let mut distances: Vec<f64> = values.iter().map(|v| (v - middle).abs()).collect();
        let sd = (1.4826 * median(&mut distances)).max(1e-6);
        if let Some(f) = h.free.iter_mut().filter(|f| f.per == Per::Trajectory).nth(k) {
            f.prior = Some((middle, sd));
        }
    }
    h.scatter = None;
    h
}

/// The state at a sample, as far as it is measured: what a forecast in the middle of a record begins from.
fn measured_at(data: &Measured, record: &Record, sample: usize) -> Vec<f64> {
    let measured = |state: &State| match state.begin {
        Begin::Measured(channel) => {
            record.seen.values[channel][sample..].iter().copied().find(|v| v.is_finite()).unwrap_or(0.0)
        }
        Begin::Fixed(value) | Begin::Prior(value, _) => value,
        Begin::Free => 0.0,
    };
    data.system.schema().states.iter().map(measured).collect()
}

/// The samples of a record that a forecast begins from, as a record of one window.
pub(crate) fn beginning(record: &Record) -> Record {
    let start = record.seen.windows.first().map_or_else(Vec::new, |w| w.start.clone());
    cut_to(record, 0..record.seen.known, start)
}

/// The samples of a record that a forecast from `first` on is made from.
fn prefix(data: &Measured, record: &Record, first: usize) -> Record {
    if first == 0 {
        return beginning(record);
    }
    cut_to(record, first..first + 1, measured_at(data, record, first))
}

/// A record that ends with the samples `known`, its one window, which begins at `start`.
fn cut_to(record: &Record, known: Range<usize>, start: Vec<f64>) -> Record {
    let Record { seen, weight, tolerated } = record;
    let until = |channel: &Vec<f64>| channel[..known.end].to_vec();
    Record {
        weight: weight.iter().map(until).collect(),
        seen: Seen {
            id: seen.id.clone(),
            group: seen.group,
            times: until(&seen.times),
            values: seen.values.iter().map(until).collect(),
            inputs: seen.inputs.clone(),
            covariates: seen.covariates.clone(),
            windows: vec![Window { samples: known, start }],
            forecasts: Vec::new(),
            pieces: Vec::new(),
            events: Vec::new(),
            memory_s: seen.memory_s,
            known: seen.known,
            under_way: seen.under_way,
        },
        tolerated: *tolerated,
    }
}

/// The start of a forecast, fitted to its known samples.
pub(crate) struct Begun {
    /// The record as far as it is known.
    pub known: Measured,
    /// Lanes of the start.
    pub lanes: Lanes,
    pub nuisance: Vec<f64>,
    /// The samples that are forecast.
    samples: Range<usize>,
}

/// Fits the start of a forecast of `samples` of a record to those of them that are known, at these parameters.
pub(crate) fn begun(
    data: &Measured,
    record: &Record,
    samples: Range<usize>,
    h: &Hypothesis,
    theta: &[f64],
    correlation: f64,
) -> Begun {
    let known = data.with_records(vec![prefix(data, record, samples.start)]);
    let sample = ChosenRecords { data: &known, chosen: &[0], correlation };
    let start = fit_nuisance(&sample, h, theta, &[]);
    let nuisance = start.nuisance.into_iter().next().unwrap_or_default();
    let whole = Window { samples: samples.clone(), start: Vec::new() };
    let lanes = Lanes::new(h, Excerpt { record: &known.records[0], window: &whole }, &[]);
    Begun { known, lanes, nuisance, samples }
}

impl Begun {
    /// The forecast.
    pub fn run(&self, h: &Hypothesis, theta: &[f64], record: &Record) -> Simulated {
        foretold(&self.known.records[0], record, self.samples.clone(), h, theta, &self.nuisance)
    }

    /// Samples of the record up to the last that the forecast begins from.
    pub fn end_of_known(&self) -> usize {
        self.known.records[0].seen.times.len()
    }
}

/// For each measure, the sum of squared errors in the samples `counted` of a record of a run that begins at its sample `first`,
/// and their number.
pub(crate) fn squares(
    data: &Measured,
    record: &Record,
    run: &Simulated,
    first: usize,
    counted: Range<usize>,
) -> Vec<Error> {
    let of = |measure: &Measure| {
        let (mut s, mut n) = (0.0, 0.0);
        for &c in &measure.channels {
            let most = RUNAWAY * spread(std::slice::from_ref(&record.seen), c);
            for k in counted.clone().filter(|&k| record.weight[c][k] > 0.0) {
                let error = record.seen.values[c][k] - run.value(k - first, c);
                // The smaller of a number and no number is the number.
                s += error.abs().min(most).powi(2);
                n += 1.0;
            }
        }
        // The error of a sample is one vector, or one number for each channel.
        if measure.length { (s, n / measure.channels.len().max(1) as f64) } else { (s, n) }
    };
    data.system.schema().measures.iter().map(of).collect()
}

/// Errors of one forecast, for each measure.
fn one_error(
    data: &Measured,
    record: &Record,
    piece: &ForecastSpan,
    h: &Hypothesis,
    theta: &[f64],
    correlation: f64,
) -> Vec<Error> {
    let (first, end) = (piece.samples.start, piece.samples.end);
    let start = begun(data, record, piece.samples.clone(), h, theta, correlation);
    let counted = if piece.ends { end - 1..end } else { start.end_of_known()..end };
    squares(data, record, &start.run(h, theta, record), first, counted)
}

/// Forecasts `[channel][sample]` of a piece of a sample by the hypothesis that was fitted to training trajectories.
pub(crate) fn path(
    sample: &ChosenRecords<'_>,
    piece: &ForecastSpan,
    training: &Fit,
    theta: &[f64],
) -> Vec<Vec<f64>> {
    let (h, record) = (predictor(training), &sample.data.records[sample.chosen[piece.chosen]]);
    let start = begun(sample.data, record, piece.samples.clone(), &h, theta, sample.correlation);
    let run = start.run(&h, theta, record);
    (0..run.channels()).map(|c| (0..run.samples()).map(|k| run.value(k, c)).collect()).collect()
}

/// The simulation of `samples` of a record from a start that was fitted to its beginning.
pub(crate) fn foretold(
    beginning: &Record,
    record: &Record,
    samples: Range<usize>,
    h: &Hypothesis,
    theta: &[f64],
    start: &[f64],
) -> Simulated {
    let whole = Window { samples, start: Vec::new() };
    let lanes = Lanes::new(h, Excerpt { record: beginning, window: &whole }, &[]);
    let point = Point::new(h, &*h.system, &lanes, record, theta, start);
    point.plain(&lanes, Excerpt { record, window: &whole })
}

/// The errors of each forecast by measure, as lists of forecasts.
fn by_measure(data: &Measured, each: Vec<Vec<Error>>) -> Errors {
    let measures = data.system.schema().measures.len();
    (0..measures).map(|m| each.iter().map(|errors| errors[m]).collect()).collect()
}

/// Errors of forecasts on a sample with the parameters `theta`, by the hypothesis that was fitted to training trajectories.
pub(crate) fn errors(
    sample: &ChosenRecords<'_>,
    pieces: &[ForecastSpan],
    training: &Fit,
    theta: &[f64],
) -> Errors {
    let h = predictor(training);
    let one = |piece: &ForecastSpan| {
        let record = &sample.data.records[sample.chosen[piece.chosen]];
        one_error(sample.data, record, piece, &h, theta, sample.correlation)
    };
    by_measure(sample.data, pieces.par_iter().map(one).collect())
}

/// Root mean square error on whole records of a sample in the first measure, in the unit of its channels.
pub(crate) fn first_rmse(sample: &ChosenRecords<'_>, training: &Fit) -> f64 {
    rmse(errors(sample, &whole(sample), training, &training.theta).first().map_or(&[][..], Vec::as_slice))
}

/// Errors of the same forecasts on replicates that the fit's own model makes, with its noise and its scatter: the least
/// that any model can reach. `fit` holds the nuisances of the sample.
pub(crate) fn floor(
    sample: &ChosenRecords<'_>,
    pieces: &[ForecastSpan],
    training: &Fit,
    fit: &Fit,
    seed: u64,
) -> Errors {
    let h = predictor(training);
    let windows = sample.of_records();
    let one = |(i, piece): (usize, &ForecastSpan)| {
        let record = &sample.data.records[sample.chosen[piece.chosen]];
        let nuisance = &fit.nuisance[windows[piece.chosen].clone()];
        let mut sum = vec![(0.0, 0.0); sample.data.system.schema().measures.len()];
        for replicate in 0..REPLICATES {
            let rng = random_stream(seed, "floor", i as u64 * REPLICATES + replicate);
            let copy = replicated(sample, fit, record, piece, nuisance, rng);
            let errors = one_error(sample.data, &copy, piece, &h, &fit.theta, sample.correlation);
            sum.iter_mut().zip(errors).for_each(|(a, b)| *a = (a.0 + b.0, a.1 + b.1));
        }
        sum
    };
    by_measure(sample.data, pieces.par_iter().enumerate().map(one).collect())
}

/// The record as the fit's own model would have made it from the start of its first window, or in the middle from what was
/// measured there, with noise and scatter.
fn replicated(
    sample: &ChosenRecords<'_>,
    fit: &Fit,
    record: &Record,
    piece: &ForecastSpan,
    nuisance: &[Vec<f64>],
    mut rng: impl Rng,
) -> Record {
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut copy = record.clone();
    let (Some(first), Some(start)) = (record.excerpts().next(), nuisance.first()) else { return copy };
    let lanes = Lanes::new(&fit.hypothesis, first, &[]);
    let mut nuisance = start.clone();
    let begin = piece.samples.start;
    if begin > 0 {
        let window =
            Window { samples: piece.samples.clone(), start: measured_at(sample.data, record, begin) };
        nuisance = lanes.nuisance_start(&fit.hypothesis, Excerpt { record, window: &window });
    }
    if let Some(scatter) = fit.hypothesis.scatter {
        let shared = scatter.per == ScatterPer::Record;
        let draw = normal();
        for x in &mut nuisance[lanes.fixed_nuisances()..] {
            *x = scatter.sd * if shared { draw } else { normal() };
        }
    }
    let h = &fit.hypothesis;
    let whole = Window { samples: piece.samples.clone(), start: Vec::new() };
    let point = Point::new(h, &*h.system, &lanes, record, &fit.theta, &nuisance);
    let run = point.plain(&lanes, Excerpt { record, window: &whole });
    for c in 0..run.channels() {
        // The noise of the measured sample before, and its place.
        let (mut last, mut before) = (0.0, None);
        for k in piece.samples.clone() {
            let w = record.weight[c][k];
            if w == 0.0 {
                continue;
            }
            let linked = before.is_some_and(|b| record.seen.follows(b, k));
            let rho = if linked { sample.correlation } else { 0.0 };
            last = rho * last + (1.0 - rho * rho).sqrt() * normal();
            before = Some(k);
            copy.seen.values[c][k] = run.value(k - begin, c) + last / w;
        }
    }
    copy
}
