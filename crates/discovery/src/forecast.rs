//! Errors before and after, on trajectories that no fit has seen.
//!
//! The initial state is fitted to the first samples alone, each model with its own; the rest is predicted.

use crate::evaluate::{Lanes, Point};
use crate::fit::{Fit, Sample, fit_nuisance};
use crate::hypothesis::Hypothesis;
use crate::record::{Excerpt, Measured, Record};
use crate::statistics::{median, quantile};
use augsim_data::random_stream;
use augsim_physics::model::Per;
use augsim_physics::system::{ScatterPer, Simulated, Window, spread};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Resamplings of the trajectories.
const BOOTSTRAP: usize = 400;
/// Replicates of the noise floor.
const REPLICATES: u64 = 4;

/// Error of a sample, in what its channel scatters by, that a forecast which runs away counts with.
const RUNAWAY: f64 = 1e6;

/// Sum of squared errors (m²) and their number, trajectory by trajectory.
pub(crate) type Errors = Vec<(f64, f64)>;

/// Root mean square of pooled errors, m.
pub(crate) fn rmse(errors: &[(f64, f64)]) -> f64 {
    let (s, n) = errors.iter().fold((0.0, 0.0), |a, e| (a.0 + e.0, a.1 + e.1));
    if n > 0.0 { (s / n).sqrt() } else { f64::NAN }
}

/// 95 % interval of a statistic of several error lists over bootstrap samples of the trajectories.
pub(crate) fn bootstrap(lists: &[&Errors], seed: u64, statistic: impl Fn(&[f64]) -> f64) -> [f64; 2] {
    let n = lists.first().map_or(0, |l| l.len());
    if n == 0 {
        return [f64::NAN; 2];
    }
    let mut rng = random_stream(seed, "bootstrap", 0);
    let mut values: Vec<f64> = (0..BOOTSTRAP)
        .map(|_| {
            let picks: Vec<usize> = (0..n).map(|_| rng.random_range(0..n)).collect();
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

/// The samples of a record that a forecast begins from, as a record of one window.
pub(crate) fn beginning(record: &Record) -> Record {
    let n = record.seen.known;
    let mut r = record.clone();
    r.seen.times.truncate(n);
    r.seen.values.iter_mut().chain(&mut r.weight).for_each(|c| c.truncate(n));
    r.seen.events.clear();
    let start = r.seen.windows.first().map_or_else(Vec::new, |w| w.start.clone());
    r.seen.windows = vec![Window { samples: 0..n, start }];
    r
}

/// A record's start, fitted to its known samples.
pub(crate) struct Begun {
    /// The record as far as it is known.
    pub known: Measured,
    /// Lanes of the start.
    pub lanes: Lanes,
    pub nuisance: Vec<f64>,
}

/// Fits the start of a record to its known samples at these parameters.
pub(crate) fn begun(
    data: &Measured,
    record: &Record,
    h: &Hypothesis,
    theta: &[f64],
    correlation: f64,
) -> Begun {
    let known = data.with_records(vec![beginning(record)]);
    let sample = Sample { data: &known, chosen: &[0], correlation };
    let start = fit_nuisance(&sample, h, theta, &[]);
    let nuisance = start.nuisance.into_iter().next().unwrap_or_default();
    let whole = Window { samples: 0..record.seen.times.len(), start: Vec::new() };
    let lanes = Lanes::new(h, Excerpt { record: &known.records[0], window: &whole }, &[]);
    Begun { known, lanes, nuisance }
}

impl Begun {
    /// The forecast of the whole record.
    pub fn run(&self, h: &Hypothesis, theta: &[f64], record: &Record) -> Simulated {
        foretold(&self.known.records[0], record, h, theta, &self.nuisance)
    }
}

/// Sum of squared errors behind the known samples of a record, and their number.
pub(crate) fn squares(record: &Record, run: &Simulated) -> (f64, f64) {
    let (mut s, mut n) = (0.0, 0.0);
    for c in 0..run.channels() {
        let most = RUNAWAY * spread(std::slice::from_ref(&record.seen), c);
        for k in record.seen.known..record.seen.times.len() {
            if record.weight[c][k] > 0.0 {
                let error = record.seen.values[c][k] - run.value(k, c);
                // The smaller of a number and no number is the number.
                s += error.abs().min(most).powi(2);
                n += 1.0;
            }
        }
    }
    (s, n)
}

fn one_error(
    data: &Measured,
    record: &Record,
    h: &Hypothesis,
    theta: &[f64],
    correlation: f64,
) -> (f64, f64) {
    squares(record, &begun(data, record, h, theta, correlation).run(h, theta, record))
}

/// Forecasts `[channel][sample]` of the record `j` of a sample by the hypothesis that was fitted to training trajectories.
pub(crate) fn path(sample: &Sample<'_>, j: usize, training: &Fit, theta: &[f64]) -> Vec<Vec<f64>> {
    let (h, record) = (predictor(training), &sample.data.records[j]);
    let run = begun(sample.data, record, &h, theta, sample.correlation).run(&h, theta, record);
    (0..run.channels()).map(|c| (0..run.samples()).map(|k| run.value(k, c)).collect()).collect()
}

/// The simulation of all of a record from a start that was fitted to its beginning.
pub(crate) fn foretold(
    beginning: &Record,
    record: &Record,
    h: &Hypothesis,
    theta: &[f64],
    start: &[f64],
) -> Simulated {
    let whole = Window { samples: 0..record.seen.times.len(), start: Vec::new() };
    let lanes = Lanes::new(h, Excerpt { record: beginning, window: &whole }, &[]);
    let point = Point::new(h, &*h.system, &lanes, record, theta, start);
    point.plain(&lanes, Excerpt { record, window: &whole })
}

/// Errors on a sample of forecasts with the parameters `theta`, by the hypothesis that was fitted to training trajectories.
pub(crate) fn errors(sample: &Sample<'_>, training: &Fit, theta: &[f64]) -> Errors {
    let h = predictor(training);
    sample
        .chosen
        .par_iter()
        .map(|&j| one_error(sample.data, &sample.data.records[j], &h, theta, sample.correlation))
        .collect()
}

/// Errors of the same forecasts on replicates that the fit's own model makes, with its noise and its scatter: the least
/// that any model can reach. `fit` holds the nuisances of the sample.
pub(crate) fn floor(sample: &Sample<'_>, training: &Fit, fit: &Fit, seed: u64) -> Errors {
    let h = predictor(training);
    let windows = sample.of_records();
    windows
        .into_par_iter()
        .enumerate()
        .map(|(i, windows)| {
            let record = &sample.data.records[sample.chosen[i]];
            let (mut s, mut n) = (0.0, 0.0);
            for replicate in 0..REPLICATES {
                let rng = random_stream(seed, "floor", i as u64 * REPLICATES + replicate);
                let copy = replicated(sample, fit, record, &fit.nuisance[windows.clone()], rng);
                let (a, b) = one_error(sample.data, &copy, &h, &fit.theta, sample.correlation);
                s += a;
                n += b;
            }
            (s, n)
        })
        .collect()
}

/// The record as the fit's own model would have made it from the start of its first window, with noise and scatter.
fn replicated(
    sample: &Sample<'_>,
    fit: &Fit,
    record: &Record,
    nuisance: &[Vec<f64>],
    mut rng: impl Rng,
) -> Record {
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut copy = record.clone();
    let (Some(first), Some(start)) = (record.excerpts().next(), nuisance.first()) else { return copy };
    let lanes = Lanes::new(&fit.hypothesis, first, &[]);
    let mut nuisance = start.clone();
    if let Some(scatter) = fit.hypothesis.scatter {
        let shared = scatter.per == ScatterPer::Record;
        let draw = normal();
        for x in &mut nuisance[lanes.fixed_nuisances()..] {
            *x = scatter.sd * if shared { draw } else { normal() };
        }
    }
    let h = &fit.hypothesis;
    let whole = Window { samples: 0..record.seen.times.len(), start: Vec::new() };
    let point = Point::new(h, &*h.system, &lanes, record, &fit.theta, &nuisance);
    let run = point.plain(&lanes, Excerpt { record, window: &whole });
    for c in 0..run.channels() {
        // The noise of the measured sample before, and its place.
        let (mut last, mut before) = (0.0, None);
        for k in 0..run.samples() {
            let w = record.weight[c][k];
            if w == 0.0 {
                continue;
            }
            let linked = before.is_some_and(|b| record.seen.follows(b, k));
            let rho = if linked { sample.correlation } else { 0.0 };
            last = rho * last + (1.0 - rho * rho).sqrt() * normal();
            before = Some(k);
            copy.seen.values[c][k] = run.value(k, c) + last / w;
        }
    }
    copy
}
