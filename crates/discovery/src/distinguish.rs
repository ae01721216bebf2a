//! Experiment that best distinguishes two models: the T-criterion (Atkinson and Fedorov 1975) over the
//! system's designs.

use crate::evaluate::{Lanes, Point, assemble_window};
use crate::fit::{ChosenRecords, Fit};
use crate::linear::Square;
use crate::record::Record;
use crate::statistics::median;
use augsim_system::Design;

/// Likelihood ratio, as twice its logarithm, that distinguishes two models: odds of 1000 to 1.
const LOG_ODDS: f64 = 13.8;
/// Maximum number of Gauss-Newton steps in the fit of one model to the predictions of the other.
const MAX_STEPS: usize = 8;

/// Experiment that best distinguishes two models, and how many records of it that takes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Separation {
    /// Description of the most informative experiment.
    pub design: String,
    /// Number of records of the experiment for odds of 1000 to 1; infinite if no experiment distinguishes the
    /// models.
    pub records: f64,
    /// Description of the experiments that were compared; empty if the system has no candidate experiments.
    pub among: String,
}

/// Finds the experiment that best distinguishes two fitted models, with the noise and sampling rate of
/// `sample`.
pub(crate) fn separation(sample: &ChosenRecords<'_>, noise: &[f64], a: &Fit, b: &Fit) -> Separation {
    let times = sample.records().map(|r| &r.data.times);
    let mut steps: Vec<f64> = times.flat_map(|t| t.windows(2).map(|w| w[1] - w[0])).collect();
    let step = median(&mut steps).max(1e-4);
    let records: Vec<_> = sample.records().map(|r| &r.data).collect();
    let designs = sample.data.system.candidate_experiments(&records, step);
    let mut best = Separation { design: String::new(), records: f64::INFINITY, among: designs.noun_phrase };
    for design in designs.list {
        let distance = |truth, other| distance(sample, noise, &design, truth, other);
        let (Some(forth), Some(back)) = (distance(a, b), distance(b, a)) else { continue };
        let records = LOG_ODDS / forth.min(back).max(1e-12);
        if records < best.records {
            (best.design, best.records) = (design.text.clone(), records);
        }
    }
    best
}

/// Squared residual norm of `other` on a record simulated by `truth`, after a refit of `other`. The refit
/// estimates the initial state and the parameters, with the data so far as their prior.
fn distance(
    sample: &ChosenRecords<'_>,
    noise: &[f64],
    design: &Design,
    truth: &Fit,
    other: &Fit,
) -> Option<f64> {
    let mut record = Record::unweighted(design.record.clone());
    let planned = record.windows().next()?;
    let h = &truth.hypothesis;
    let lanes = Lanes::new(h, planned, &[]);
    let start = lanes.initial_nuisance(h, planned);
    let point = Point::new(h, &*h.system, &lanes, &record, &truth.theta, &start);
    let run = point.simulate_plain(&lanes, planned);
    let end = run.event_times().get(design.max_events).copied().unwrap_or(f64::INFINITY);
    let n = record.data.times.iter().take_while(|t| **t < end).count();
    record.data.times.truncate(n);
    record.data.windows[0].samples = 0..n;
    for (c, noise) in noise.iter().enumerate().take(run.channels()) {
        record.data.values.push((0..n).map(|k| run.value(k, c)).collect());
        record.weight.push(vec![1.0 / noise; n]);
    }
    min_residual_norm(sample, &record, other)
}

/// Minimises the squared residual norm of a fitted model on one more record, in units of the noise. The
/// information of the data so far is the prior of its parameters; `None` if not finite.
fn min_residual_norm(sample: &ChosenRecords<'_>, record: &Record, fit: &Fit) -> Option<f64> {
    let h = &fit.hypothesis;
    let planned = record.windows().next()?;
    let lanes = Lanes::new(h, planned, &[]);
    let common = lanes.common();
    let prior = fit.information.sub(&lanes.theta);
    let evaluate = |theta: &[f64], nuisance: &[f64]| {
        sample.data.work.count_simulation();
        let point = Point::new(h, &*h.system, &lanes, record, theta, nuisance);
        let normal = assemble_window(&point, &lanes, planned, sample.correlation);
        let moved: Vec<f64> = lanes.theta.iter().map(|&t| theta[t] - fit.theta[t]).collect();
        let held: Vec<f64> =
            (0..common).map(|i| (0..common).map(|k| prior.at(i, k) * moved[k]).sum()).collect();
        let cost = normal.residual_norm_squared + moved.iter().zip(&held).map(|(a, b)| a * b).sum::<f64>();
        (normal, held, cost)
    };
    let (mut theta, mut nuisance) = (fit.theta.clone(), lanes.initial_nuisance(h, planned));
    let mut now = evaluate(&theta, &nuisance);
    for _ in 0..MAX_STEPS {
        let (normal, held, cost) = &now;
        let n = normal.h.n;
        let mut hessian = Square::zero(n);
        let mut step: Vec<f64> =
            (0..n).map(|i| normal.g[i] / normal.weight - held.get(i).copied().unwrap_or(0.0)).collect();
        for i in 0..n {
            for k in 0..n {
                let known = if i < common && k < common { prior.at(i, k) } else { 0.0 };
                *hessian.at_mut(i, k) = normal.h.at(i, k) / normal.weight + known;
            }
            *hessian.at_mut(i, i) *= 1.0 + 1e-9;
        }
        hessian.cholesky().solve(&mut step);
        let trials = [1.0, 0.3, 0.1].into_iter().map(|share| {
            let (mut t, mut m) = (theta.clone(), nuisance.clone());
            lanes.theta.iter().zip(&step).for_each(|(&place, d)| t[place] += share * d);
            m.iter_mut().zip(&step[common..]).for_each(|(x, d)| *x += share * d);
            let value = evaluate(&t, &m);
            (t, m, value)
        });
        let Some(better) = trials.into_iter().find(|(_, _, v)| v.2 < *cost) else { break };
        let gain = cost - better.2.2;
        (theta, nuisance, now) = better;
        if gain < 1e-3 {
            break;
        }
    }
    now.2.is_finite().then_some(now.2)
}
