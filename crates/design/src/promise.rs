//! Promise of a plan: the odds that its runs reach, and in what share of cases, by simulation.
//!
//! Each explanation in turn is the truth, with drawn parameters, process noise and measurement noise. The simulated recordings
//! are judged as measured ones will be, with refits, so that the promise holds also where the predictions are not
//! linear in the parameters or the noise of the explanations differs.

use crate::candidate::Experiment;
use crate::draw::{draw_recording, draw_values};
use crate::evidence::hear;
use crate::explanation::Explanation;
use crate::verdict::{Tally, judge};
use augsim_data::random_stream;
use rayon::prelude::*;

/// Share of cases in which a promise holds.
pub const PROMISED_SHARE: f64 = 0.9;

/// Promise of a plan for one explanation, if it is the true one.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthPromise {
    /// Share of simulated sequences in which the required odds are reached by each run, `[run]`.
    pub reached: Vec<f64>,
    /// Log odds, nats, against the strongest rival that nine of ten sequences reach by each run, `[run]`.
    pub log_odds: Vec<f64>,
}

/// Promise of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Promise {
    /// Number of runs after which nine of ten sequences reach the required odds, or else the budget.
    pub runs: usize,
    /// Whether that number of runs is enough.
    pub is_enough: bool,
    /// Promise for each explanation as the truth.
    pub truths: Vec<TruthPromise>,
}

impl Promise {
    /// Smallest share of sequences, over all truths, that reach the required odds by the promised number of runs.
    pub fn share(&self) -> f64 {
        let last = self.runs.max(1) - 1;
        self.truths.iter().map(|t| t.reached[last]).fold(1.0, f64::min)
    }

    /// Log odds that are promised, nats: the smallest over all truths.
    pub fn log_odds(&self) -> f64 {
        let last = self.runs.max(1) - 1;
        self.truths.iter().map(|t| t.log_odds[last]).fold(f64::INFINITY, f64::min)
    }
}

/// Simulates sequences of recordings of the experiments, repeated in turn up to `budget` runs.
///
/// The promise is for reaching `odds`; each truth gets `sequences` sequences.
pub fn promise(
    explanations: &[Explanation],
    experiments: &[&Experiment],
    budget: usize,
    odds: f64,
    sequences: u64,
    seed: u64,
) -> Promise {
    let truth = |i: usize| {
        let simulate = |s: u64| {
            let index = ((i as u64) << 32) + s;
            let mut rng = random_stream(seed, "promise", index);
            let values = draw_values(&explanations[i], &mut rng);
            odds_after_runs(explanations, experiments, (i, &values), budget, &mut rng)
        };
        let paths: Vec<Vec<f64>> = (0..sequences).into_par_iter().map(simulate).collect();
        let at_run = |k: usize| -> Vec<f64> {
            let mut list: Vec<f64> = paths.iter().map(|path| path[k]).collect();
            list.sort_by(f64::total_cmp);
            list
        };
        let share = |k: usize| {
            paths.iter().filter(|path| path[k] >= odds.ln()).count() as f64 / sequences.max(1) as f64
        };
        let quantile = |k: usize| {
            let list = at_run(k);
            // Rounded down: the promised odds are reached in at least the promised share of the simulated cases.
            list[((1.0 - PROMISED_SHARE) * list.len() as f64).floor() as usize]
        };
        TruthPromise {
            reached: (0..budget).map(share).collect(),
            log_odds: (0..budget).map(quantile).collect(),
        }
    };
    let truths: Vec<TruthPromise> = (0..explanations.len()).map(truth).collect();
    let is_enough = |k: &usize| truths.iter().all(|t| t.reached[*k] >= PROMISED_SHARE);
    let enough = (0..budget).find(is_enough);
    Promise { runs: enough.map_or(budget, |k| k + 1), is_enough: enough.is_some(), truths }
}

/// Largest log odds, nats, of the truth against its strongest rival so far, after each run of one sequence.
///
/// The truth has the index and the parameter values of `truth`. A sequence that cannot be judged stays at minus infinity.
fn odds_after_runs(
    explanations: &[Explanation],
    experiments: &[&Experiment],
    (truth, values): (usize, &[f64]),
    budget: usize,
    rng: &mut impl rand::Rng,
) -> Vec<f64> {
    let mut current = explanations.to_vec();
    let mut tallies: Vec<Tally> =
        explanations.iter().map(|e| Tally { log_weight: e.log_weight, ..Tally::default() }).collect();
    let mut most = f64::NEG_INFINITY;
    let mut path = Vec::with_capacity(budget);
    for k in 0..budget {
        let experiment = experiments[k % experiments.len()];
        let Ok(record) = draw_recording(&explanations[truth], values, experiment, "promise", rng) else {
            path.resize(budget, f64::NEG_INFINITY);
            return path;
        };
        for (e, tally) in current.iter_mut().zip(&mut tallies) {
            let Ok(heard) = hear(e, &record) else {
                path.resize(budget, f64::NEG_INFINITY);
                return path;
            };
            tally.log_evidence += heard.log_evidence;
            tally.squares += heard.squares;
            tally.count += heard.count;
            *e = heard.updated;
        }
        let judgement = judge(&tallies, &vec![false; tallies.len()], f64::INFINITY);
        let rivals = judgement.log_e_values.iter().enumerate().filter(|(j, _)| *j != truth);
        most = most.max(rivals.map(|(_, e)| *e).fold(f64::INFINITY, f64::min));
        path.push(most);
    }
    path
}
