//! Promise of a plan: the odds that its runs reach, and in what share of cases, by simulation.
//!
//! Each explanation in turn is the truth, with parameters drawn from its posterior sample, process noise and measurement noise. The simulated recordings
//! are judged as measured ones will be, with refits, so that the promise holds also where the predictions are not
//! linear in the parameters or the noise of the explanations differs.

use crate::candidate::Experiment;
use crate::draw::draw_recording;
use crate::evidence::Evidence;
use crate::explanation::Explanation;
use crate::posterior_sample::PosteriorSample;
use crate::verdict::{Tally, judge};
use augsim_data::random_stream;
use rand_xoshiro::Xoshiro256PlusPlus;
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
/// The true parameters are drawn from `samples`, one for each of `live`.
/// The promise is for reaching `odds`; each truth gets `sequences` sequences. Runs after the promised number are not simulated.
pub fn promise(
    live: &[Evidence],
    samples: &[PosteriorSample],
    experiments: &[&Experiment],
    budget: usize,
    odds: f64,
    sequences: u64,
    seed: u64,
) -> Promise {
    let explanations: Vec<Explanation> = live.iter().map(Evidence::updated).collect();
    let count = live.len() as u64;
    let mut all: Vec<Sequence> = (0..count * sequences)
        .into_par_iter()
        .map(|k| {
            let truth = k / sequences;
            let mut rng = random_stream(seed, "promise", (truth << 32) + k % sequences);
            let values = samples[truth as usize].draw(&mut rng);
            Sequence::new(live, truth as usize, values, rng)
        })
        .collect();
    let mut truths = vec![TruthPromise { reached: Vec::new(), log_odds: Vec::new() }; live.len()];
    for k in 0..budget {
        let experiment = experiments[k % experiments.len()];
        all.par_iter_mut().for_each(|sequence| sequence.add_run(&explanations, experiment));
        for (truth, part) in truths.iter_mut().zip(all.chunks(sequences as usize)) {
            let mut odds_after: Vec<f64> = part.iter().map(|s| s.most).collect();
            odds_after.sort_by(f64::total_cmp);
            let enough = odds_after.iter().filter(|o| **o >= odds.ln()).count();
            truth.reached.push(enough as f64 / odds_after.len() as f64);
            // Rounded down: the promised odds are reached in at least the promised share of the simulated cases.
            truth
                .log_odds
                .push(odds_after[((1.0 - PROMISED_SHARE) * odds_after.len() as f64).floor() as usize]);
        }
        if truths.iter().all(|t| t.reached[k] >= PROMISED_SHARE) {
            return Promise { runs: k + 1, is_enough: true, truths };
        }
    }
    Promise { runs: budget, is_enough: false, truths }
}

/// One simulated sequence of runs, judged as measured runs are.
struct Sequence {
    truth: usize,
    values: Vec<f64>,
    rng: Xoshiro256PlusPlus,
    evidence: Vec<Evidence>,
    /// Largest log odds, nats, of the truth against its strongest rival so far.
    most: f64,
    /// Whether a run could not be simulated or judged; the odds then stay as they were.
    has_failed: bool,
}

impl Sequence {
    /// No run yet; `values` are the parameters of the truth.
    fn new(live: &[Evidence], truth: usize, values: Vec<f64>, rng: Xoshiro256PlusPlus) -> Self {
        let mut evidence = live.to_vec();
        evidence[truth] = evidence[truth].density_only();
        Self { truth, values, rng, evidence, most: f64::NEG_INFINITY, has_failed: false }
    }

    /// Simulates and judges one more run.
    fn add_run(&mut self, explanations: &[Explanation], experiment: &Experiment) {
        if self.has_failed {
            return;
        }
        let truth = &explanations[self.truth];
        let Ok(record) = draw_recording(truth, &self.values, experiment, "promise", &mut self.rng) else {
            self.has_failed = true;
            return;
        };
        if self.evidence.iter_mut().any(|evidence| evidence.add(&record).is_err()) {
            self.has_failed = true;
            return;
        }
        let tallies: Vec<Tally> = self.evidence.iter().map(Evidence::tally).collect();
        let judgement = judge(&tallies, &vec![false; tallies.len()], f64::INFINITY);
        let rivals = judgement.log_e_values.iter().enumerate().filter(|(j, _)| *j != self.truth);
        self.most = self.most.max(rivals.map(|(_, e)| *e).fold(f64::INFINITY, f64::min));
    }
}
