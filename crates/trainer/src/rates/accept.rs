//! Chooses how much of a net's correction to apply, by free runs over held-out data.
//!
//! A net that predicts single intervals well may make a free run worse, and a net that was trained where
//! the model has no error has learned noise. Free runs therefore start from states of the held-out data and
//! are scored after 1, 10, 100 and all intervals. First the squared errors decide the shrinkage factor of
//! the mean corrections. Then the continuous ranked probability score decides how the random part of the
//! corrections is drawn, and whether each trajectory has its own latent.

use super::corrector::Corrector;
use super::features::{Trust, Units};
use super::roll::{Motions, roll};
use crate::TrainerError;
use crate::engine::WrittenMotion;
use crate::in_order;
use crate::latent::LatentLaw;
use crate::nets::Stepwise;
use crate::scales::Scales;
use crate::score::crps_of;
use crate::sequences::Sequence;
use augsim_data::random_stream;
use augsim_nn::Params;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Candidate shrinkage factors of the mean corrections; the first is the physics alone.
const GAINS: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Candidate factors of the predicted standard deviations.
const SPREADS: [f64; 7] = [0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// Candidate correlation times of the random corrections, in intervals.
const MEMORIES: [f64; 3] = [0.0, 10.0, 100.0];
/// Samples of each candidate.
const DRAWS: usize = 16;
/// Minimum decrease of the mean log error over all horizons for corrections to be accepted.
/// A smaller decrease may be due to noise.
const LEAST_FALL: f64 = 0.02;
/// Horizons of short runs, in intervals.
const HORIZONS: [usize; 3] = [1, 10, 100];
/// Number of short runs, number of long runs, and maximum number of intervals of a long run.
const SHORT_RUNS: usize = 48;
const LONG_RUNS: usize = 4;
const LONGEST: usize = 4000;
/// Minimum number of intervals of a run.
const LEAST: usize = 10;
/// Number of samples of a long run that are scored.
const SCORED: usize = 64;

/// A trained net with all that its acceptance test needs.
#[derive(Clone, Copy)]
pub(crate) struct Learned<'a> {
    pub motion: &'a WrittenMotion,
    pub net: &'a Stepwise,
    pub params: &'a Params<f32>,
    pub law: &'a LatentLaw,
    /// Scales with shrinkage factors of 1.
    pub scales: &'a Scales,
    pub seed: u64,
}

/// The chosen use of a net's corrections, and whether trajectories have different latents.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Accepted {
    pub trust: Trust,
    pub latents_differ: bool,
}

/// A free run over held-out data, with its scored samples as (sample, index of the horizon).
struct Trial<'a> {
    record: &'a Sequence,
    first: usize,
    time: usize,
    scored: Vec<(usize, usize)>,
}

/// One candidate way to apply a net's corrections.
#[derive(Clone, Copy)]
struct Way {
    trust: Trust,
    differs: bool,
}

impl Learned<'_> {
    /// Chooses the best candidate; `None` where too little data was held out.
    pub fn decide(self, held_out: &[Sequence]) -> Result<Option<Accepted>, TrainerError> {
        let trials = trials(held_out);
        if trials.is_empty() {
            return Ok(None);
        }
        let still = |gain| Way { trust: Trust { gain, spread: 0.0, memory: 0.0 }, differs: false };
        let errors =
            self.scores(&trials, &GAINS.map(still), 1, &|draws, truth| (draws[0] - truth).powi(2))?;
        // The errors are squares, so half their log ratio is the log ratio of the errors.
        let fall = |way: usize| -> f64 { 0.5 * mean_log(&errors[way], &errors[0]) };
        // Candidates that improve short horizons but worsen the longest runs are rejected.
        let outputs = self.motion.output_periods().len();
        let far = (HORIZONS.len() - 1) * outputs;
        let leads_astray = |way: &usize| {
            let horizons = errors[*way][far..].chunks(outputs).zip(errors[0][far..].chunks(outputs));
            horizons.map(|(with, without)| mean_log(with, without)).any(|log| log.is_finite() && log > 0.0)
        };
        let best =
            (1..GAINS.len()).filter(|way| !leads_astray(way)).min_by(|a, b| fall(*a).total_cmp(&fall(*b)));
        let gain = best.filter(|way| fall(*way) < -LEAST_FALL).map_or(0.0, |way| GAINS[way]);
        let mut ways = Vec::new();
        // Different latents are only tried where the net's mean correction is used at all.
        for differs in [false, true].into_iter().filter(|differs| gain > 0.0 || !differs) {
            ways.push(Way { differs, ..still(gain) });
            for memory in MEMORIES {
                ways.extend(SPREADS.map(|spread| Way { trust: Trust { gain, spread, memory }, differs }));
            }
        }
        let scores = self.scores(&trials, &ways, DRAWS, &|draws, truth| {
            let mut sorted: Vec<f32> = draws.iter().map(|v| *v as f32).collect();
            sorted.sort_unstable_by(f32::total_cmp);
            crps_of(&sorted, truth)
        })?;
        let total = |way: usize| mean_log(&scores[way], &scores[0]);
        let best = (0..ways.len()).min_by(|a, b| total(*a).total_cmp(&total(*b)));
        Ok(best.map(|way| Accepted { trust: ways[way].trust, latents_differ: ways[way].differs }))
    }

    /// Mean scores `[candidate][horizon, output]` of all runs.
    /// `score` takes the samples of an output and its value in the held-out states.
    fn scores(
        self,
        trials: &[Trial<'_>],
        ways: &[Way],
        draws: usize,
        score: &(dyn Fn(&[f64], f64) -> f64 + Sync),
    ) -> Result<Vec<Vec<f64>>, TrainerError> {
        let (s, periods) = (self.motion.periods().len(), self.motion.output_periods());
        let (outputs, lanes) = (periods.len(), ways.len() * draws);
        let cells = (HORIZONS.len() + 1) * outputs;
        let one = |(i, trial): (usize, &Trial<'_>)| -> Result<Vec<Vec<(f64, f64)>>, TrainerError> {
            let values = self.run(trial, ways, draws, i as u64);
            let mut sums = vec![vec![(0.0, 0.0); cells]; ways.len()];
            let mut states = vec![0.0; lanes * s];
            for &(at, horizon) in &trial.scored {
                let (k, q) = (trial.first + at, trial.record);
                let row = &values[at * s * lanes..(at + 1) * s * lanes];
                states.iter_mut().enumerate().for_each(|(i, x)| *x = f64::from(row[i % s * lanes + i / s]));
                let truth = self.motion.outputs(q.state(k), std::iter::once(q.action(k)));
                let shown = self.motion.outputs(&states, std::iter::repeat(q.action(k)));
                for o in 0..outputs {
                    let near = |lane: usize| unwrapped(shown[lane * outputs + o], truth[o], periods[o]);
                    let near: Vec<f64> = (0..lanes).map(near).collect();
                    for (way, near) in near.chunks_exact(draws).enumerate() {
                        // A diverged run (non-finite score) gets the worst possible score.
                        let value = score(near, truth[o]);
                        let cell = &mut sums[way][horizon * outputs + o];
                        cell.0 += if value.is_finite() { value } else { f64::INFINITY };
                        cell.1 += 1.0;
                    }
                }
            }
            Ok(sums)
        };
        let all = in_order(trials.par_iter().enumerate().map(one))?;
        let mean = |way: usize, cell: usize| {
            let (sum, n) = all.iter().fold((0.0, 0.0), |a, t| (a.0 + t[way][cell].0, a.1 + t[way][cell].1));
            if n > 0.0 { sum / n } else { f64::NAN }
        };
        Ok((0..ways.len()).map(|way| (0..cells).map(|cell| mean(way, cell)).collect()).collect())
    }

    /// Values `[time, S, candidate, sample]` of a run.
    fn run(self, trial: &Trial<'_>, ways: &[Way], draws: usize, stream: u64) -> Vec<f32> {
        let (q, lanes) = (trial.record, ways.len() * draws);
        let latent = self.net.sizes().latent;
        let mut rng = random_stream(self.seed, "acceptance", stream);
        // Sample i has the same latent in every candidate with different latents, so that they are
        // comparable.
        let drawn: Vec<f32> = (0..latent * draws).map(|_| StandardNormal.sample(&mut rng)).collect();
        let standard: Vec<f32> = (0..latent * lanes)
            .map(|i| {
                let (row, lane) = (i / lanes, i % lanes);
                if ways[lane / draws].differs { drawn[row * draws + lane % draws] } else { 0.0 }
            })
            .collect();
        let latents = self.law.draw(&standard, lanes);
        let trust = (0..lanes).map(|lane| ways[lane / draws].trust).collect();
        let mut corrector =
            Corrector::new((self.net, self.params), latents, trust, Units::of(self.scales), rng);
        let a = q.actions.len() / q.time;
        let motions = Motions {
            starts: &q.state(trial.first).repeat(lanes),
            actions: &q.actions[trial.first * a..(trial.first + trial.time) * a],
            time: trial.time,
        };
        roll(self.motion, self.scales, motions, &mut |u, rates| corrector.draw(u, rates)).values
    }
}

/// Selects the runs: short ones from starts spread over all records, and long ones from the beginning.
fn trials(held_out: &[Sequence]) -> Vec<Trial<'_>> {
    let furthest = HORIZONS[HORIZONS.len() - 1];
    let total: usize = held_out.iter().map(|q| q.time).sum();
    let stride = (total / SHORT_RUNS).max(furthest);
    let mut all = Vec::new();
    for record in held_out {
        for first in (0..record.time).step_by(stride) {
            let time = (record.time - first).min(furthest + 1);
            let scored = HORIZONS.iter().enumerate().filter(|(_, at)| **at < time);
            if time > LEAST {
                all.push(Trial { record, first, time, scored: scored.map(|(h, at)| (*at, h)).collect() });
            }
        }
    }
    let mut longest: Vec<&Sequence> = held_out.iter().filter(|q| q.time > LEAST).collect();
    longest.sort_by_key(|q| std::cmp::Reverse(q.time));
    for record in longest.into_iter().take(LONG_RUNS) {
        let time = record.time.min(LONGEST + 1);
        let scored = (1..=SCORED).map(|k| (k * (time - 1) / SCORED).max(1)).map(|at| (at, HORIZONS.len()));
        all.push(Trial { record, first: 0, time, scored: scored.collect() });
    }
    all
}

/// The value equivalent to `value` modulo `period` that is nearest to `truth`.
fn unwrapped(value: f64, truth: f64, period: Option<f64>) -> f64 {
    match period {
        Some(period) => value - period * ((value - truth) / period).round(),
        None => value,
    }
}

/// Mean log ratio of scores to those of `reference`, over the cells that have both.
fn mean_log(scores: &[f64], reference: &[f64]) -> f64 {
    // Errors at rounding level count as equal; the floor also avoids the logarithm of zero.
    let floor = |v: f64| v.max(1e-300);
    let cells = scores.iter().zip(reference).filter(|(a, b)| !a.is_nan() && !b.is_nan());
    let (sum, n) = cells.fold((0.0, 0.0), |(sum, n), (a, b)| (sum + (floor(*a) / floor(*b)).ln(), n + 1.0));
    if n > 0.0 && !f64::is_nan(sum) { sum / n } else { f64::INFINITY }
}
