//! Chooses how much of a net's correction to apply, by free runs over held-out data.
//!
//! A net that predicts single intervals well may make a free run worse, and a net that was trained where
//! the model has no error has learned noise. Free runs therefore start from states of the held-out data and
//! are scored after 1, 10, 100 and all intervals. First the squared errors decide the shrinkage factor of
//! the mean corrections. Then the continuous ranked probability score decides how the random part of the
//! corrections is drawn, and whether each trajectory has its own latent.

use super::corrector::Corrector;
use super::features::{CorrectionShrinkage, Units};
use super::roll_out::{RollOuts, roll_out};
use crate::TrainerError;
use crate::collect_in_order;
use crate::engine::EquationMotion;
use crate::latent::LatentDistribution;
use crate::nets::Stepwise;
use crate::scales::Scales;
use crate::score::crps_from_samples;
use crate::sequences::Sequence;
use augsim_data::random_stream;
use augsim_nn::Params;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Candidate shrinkage factors of the mean corrections; 0 means physics without corrections.
const CANDIDATE_GAINS: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Candidate factors that multiply the predicted standard deviations of the corrections.
const CANDIDATE_SPREADS: [f64; 7] = [0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// Candidate correlation times of the random part of the corrections, in sample intervals.
const CANDIDATE_MEMORIES: [f64; 3] = [0.0, 10.0, 100.0];
/// Number of trajectories simulated for each candidate.
const SAMPLES_PER_CANDIDATE: usize = 16;
/// Minimum decrease of the mean log error over all horizons at which corrections are accepted.
/// A smaller decrease may be due to noise.
const MIN_LOG_DECREASE: f64 = 0.02;
/// Horizons at which short runs are scored, in intervals.
const HORIZONS: [usize; 3] = [1, 10, 100];
/// Number of short free runs. The two constants below: number of long runs, and their maximum length in intervals.
const SHORT_RUNS: usize = 48;
const LONG_RUNS: usize = 4;
const MAX_LONG_RUN: usize = 4000;
/// Minimum number of intervals of a free run.
const MIN_INTERVALS: usize = 10;
/// Number of samples of a long run that are scored.
const SCORED_SAMPLES: usize = 64;

/// A trained net that corrects rates, with all that its acceptance test needs.
#[derive(Clone, Copy)]
pub(crate) struct TrainedRateNet<'a> {
    pub motion: &'a EquationMotion,
    pub net: &'a Stepwise,
    pub params: &'a Params<f32>,
    pub latent_distribution: &'a LatentDistribution,
    /// Normalisation scales, with shrinkage factors of 1.
    pub scales: &'a Scales,
    pub seed: u64,
}

/// The shrinkage factors chosen for a net's corrections, and whether trajectories have different latents.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AcceptedCorrection {
    pub shrinkage: CorrectionShrinkage,
    pub latents_differ: bool,
}

/// A free run over held-out data, and the samples at which it is scored, as (sample, index of the horizon).
struct FreeRun<'a> {
    record: &'a Sequence,
    first: usize,
    time: usize,
    scored: Vec<(usize, usize)>,
}

/// One candidate way to apply a net's corrections: shrinkage factors and the choice of latents.
#[derive(Clone, Copy)]
struct Candidate {
    shrinkage: CorrectionShrinkage,
    has_own_latents: bool,
}

impl TrainedRateNet<'_> {
    /// Chooses the candidate with the best free-run scores; `None` where too little data was held out.
    pub fn decide(self, held_out: &[Sequence]) -> Result<Option<AcceptedCorrection>, TrainerError> {
        let free_runs = free_runs(held_out);
        if free_runs.is_empty() {
            return Ok(None);
        }
        let fixed_gain = |gain| Candidate {
            shrinkage: CorrectionShrinkage { gain, spread: 0.0, correlation_intervals: 0.0 },
            has_own_latents: false,
        };
        let errors = self.scores(&free_runs, &CANDIDATE_GAINS.map(fixed_gain), 1, &|draws, truth| {
            (draws[0] - truth).powi(2)
        })?;
        // The errors are squares, so half their log ratio is the log ratio of the errors.
        let log_change = |candidate: usize| -> f64 { 0.5 * mean_log_ratio(&errors[candidate], &errors[0]) };
        // Candidates that worsen runs of 100 intervals or more are rejected, however much they improve short ones.
        let outputs = self.motion.output_periods().len();
        let longest_cells = (HORIZONS.len() - 1) * outputs;
        let worsens_long_runs = |candidate: &usize| {
            let cells = errors[*candidate][longest_cells..]
                .chunks(outputs)
                .zip(errors[0][longest_cells..].chunks(outputs));
            cells
                .map(|(with, without)| mean_log_ratio(with, without))
                .any(|ratio| ratio.is_finite() && ratio > 0.0)
        };
        let best = (1..CANDIDATE_GAINS.len())
            .filter(|candidate| !worsens_long_runs(candidate))
            .min_by(|a, b| log_change(*a).total_cmp(&log_change(*b)));
        let gain = best
            .filter(|candidate| log_change(*candidate) < -MIN_LOG_DECREASE)
            .map_or(0.0, |candidate| CANDIDATE_GAINS[candidate]);
        let mut candidates = Vec::new();
        // Different latents are only tried where the net's mean correction is used at all.
        for has_own_latents in
            [false, true].into_iter().filter(|has_own_latents| gain > 0.0 || !has_own_latents)
        {
            candidates.push(Candidate { has_own_latents, ..fixed_gain(gain) });
            for memory in CANDIDATE_MEMORIES {
                candidates.extend(CANDIDATE_SPREADS.map(|spread| Candidate {
                    shrinkage: CorrectionShrinkage { gain, spread, correlation_intervals: memory },
                    has_own_latents,
                }));
            }
        }
        let scores = self.scores(&free_runs, &candidates, SAMPLES_PER_CANDIDATE, &|draws, truth| {
            let mut sorted: Vec<f32> = draws.iter().map(|v| *v as f32).collect();
            sorted.sort_unstable_by(f32::total_cmp);
            crps_from_samples(&sorted, truth)
        })?;
        let log_crps_ratio = |candidate: usize| mean_log_ratio(&scores[candidate], &scores[0]);
        let best = (0..candidates.len()).min_by(|a, b| log_crps_ratio(*a).total_cmp(&log_crps_ratio(*b)));
        Ok(best.map(|candidate| AcceptedCorrection {
            shrinkage: candidates[candidate].shrinkage,
            latents_differ: candidates[candidate].has_own_latents,
        }))
    }

    /// Computes mean scores `[candidate][horizon, output]` of all free runs.
    /// `score` takes the samples of an output and its value in the held-out states.
    fn scores(
        self,
        free_runs: &[FreeRun<'_>],
        candidates: &[Candidate],
        draws: usize,
        score: &(dyn Fn(&[f64], f64) -> f64 + Sync),
    ) -> Result<Vec<Vec<f64>>, TrainerError> {
        let (s, periods) = (self.motion.periods().len(), self.motion.output_periods());
        let (outputs, lanes) = (periods.len(), candidates.len() * draws);
        let cell_count = (HORIZONS.len() + 1) * outputs;
        let score_run = |(i, free_run): (usize, &FreeRun<'_>)| -> Result<Vec<Vec<(f64, f64)>>, TrainerError> {
            let values = self.simulate(free_run, candidates, draws, i as u64);
            let mut sums = vec![vec![(0.0, 0.0); cell_count]; candidates.len()];
            let mut states = vec![0.0; lanes * s];
            for &(sample, horizon) in &free_run.scored {
                let (record_row, q) = (free_run.first + sample, free_run.record);
                let row = &values[sample * s * lanes..(sample + 1) * s * lanes];
                states.iter_mut().enumerate().for_each(|(i, x)| *x = f64::from(row[i % s * lanes + i / s]));
                let truth = self.motion.outputs(q.state(record_row), std::iter::once(q.action(record_row)));
                let predicted = self.motion.outputs(&states, std::iter::repeat(q.action(record_row)));
                for output in 0..outputs {
                    let unwrapped_values = |lane: usize| {
                        unwrapped(predicted[lane * outputs + output], truth[output], periods[output])
                    };
                    let unwrapped_values: Vec<f64> = (0..lanes).map(unwrapped_values).collect();
                    for (candidate, unwrapped_values) in unwrapped_values.chunks_exact(draws).enumerate() {
                        // A diverged run (non-finite score) gets the worst possible score.
                        let value = score(unwrapped_values, truth[output]);
                        let cell = &mut sums[candidate][horizon * outputs + output];
                        cell.0 += if value.is_finite() { value } else { f64::INFINITY };
                        cell.1 += 1.0;
                    }
                }
            }
            Ok(sums)
        };
        let run_sums = collect_in_order(free_runs.par_iter().enumerate().map(score_run))?;
        let mean = |candidate: usize, cell: usize| {
            let (sum, n) = run_sums
                .iter()
                .fold((0.0, 0.0), |a, t| (a.0 + t[candidate][cell].0, a.1 + t[candidate][cell].1));
            if n > 0.0 { sum / n } else { f64::NAN }
        };
        Ok((0..candidates.len())
            .map(|candidate| (0..cell_count).map(|cell| mean(candidate, cell)).collect())
            .collect())
    }

    /// Simulates a free run with all candidates; returns states `[time, S, candidate, sample]`, S state columns.
    fn simulate(
        self,
        free_run: &FreeRun<'_>,
        candidates: &[Candidate],
        draws: usize,
        stream: u64,
    ) -> Vec<f32> {
        let (q, lanes) = (free_run.record, candidates.len() * draws);
        let latent = self.net.sizes().latent;
        let mut rng = random_stream(self.seed, "acceptance", stream);
        // Sample i has the same latent in every candidate with different latents, so that they are
        // comparable.
        let drawn: Vec<f32> = (0..latent * draws).map(|_| StandardNormal.sample(&mut rng)).collect();
        let standard: Vec<f32> = (0..latent * lanes)
            .map(|i| {
                let (row, lane) = (i / lanes, i % lanes);
                if candidates[lane / draws].has_own_latents { drawn[row * draws + lane % draws] } else { 0.0 }
            })
            .collect();
        let latents = self.latent_distribution.draw(&standard, lanes);
        let shrinkage = (0..lanes).map(|lane| candidates[lane / draws].shrinkage).collect();
        let mut corrector =
            Corrector::new((self.net, self.params), latents, shrinkage, Units::from_scales(self.scales), rng);
        let a = q.actions.len() / q.time;
        let motions = RollOuts {
            starts: &q.state(free_run.first).repeat(lanes),
            actions: &q.actions[free_run.first * a..(free_run.first + free_run.time) * a],
            time: free_run.time,
        };
        roll_out(self.motion, self.scales, motions, &mut |u, rates| corrector.draw(u, rates)).values
    }
}

/// Selects the free runs: short ones from starts spread over all records, long ones from the beginning.
fn free_runs(held_out: &[Sequence]) -> Vec<FreeRun<'_>> {
    let longest_horizon = HORIZONS[HORIZONS.len() - 1];
    let total_samples: usize = held_out.iter().map(|q| q.time).sum();
    let stride = (total_samples / SHORT_RUNS).max(longest_horizon);
    let mut runs = Vec::new();
    for record in held_out {
        for first in (0..record.time).step_by(stride) {
            let time = (record.time - first).min(longest_horizon + 1);
            let scored = HORIZONS.iter().enumerate().filter(|(_, sample)| **sample < time);
            if time > MIN_INTERVALS {
                runs.push(FreeRun {
                    record,
                    first,
                    time,
                    scored: scored.map(|(h, sample)| (*sample, h)).collect(),
                });
            }
        }
    }
    let mut longest: Vec<&Sequence> = held_out.iter().filter(|q| q.time > MIN_INTERVALS).collect();
    longest.sort_by_key(|q| std::cmp::Reverse(q.time));
    for record in longest.into_iter().take(LONG_RUNS) {
        let time = record.time.min(MAX_LONG_RUN + 1);
        let scored = (1..=SCORED_SAMPLES)
            .map(|k| (k * (time - 1) / SCORED_SAMPLES).max(1))
            .map(|sample| (sample, HORIZONS.len()));
        runs.push(FreeRun { record, first: 0, time, scored: scored.collect() });
    }
    runs
}

/// Shifts `value` by multiples of `period` so that it is nearest to `truth`; unchanged without a period.
fn unwrapped(value: f64, truth: f64, period: Option<f64>) -> f64 {
    match period {
        Some(period) => value - period * ((value - truth) / period).round(),
        None => value,
    }
}

/// Mean log ratio of `scores` to `reference` over the entries that both have.
fn mean_log_ratio(scores: &[f64], reference: &[f64]) -> f64 {
    // Errors at rounding level count as equal; the floor also avoids the logarithm of zero.
    let floor = |v: f64| v.max(1e-300);
    let cells = scores.iter().zip(reference).filter(|(a, b)| !a.is_nan() && !b.is_nan());
    let (sum, n) = cells.fold((0.0, 0.0), |(sum, n), (a, b)| (sum + (floor(*a) / floor(*b)).ln(), n + 1.0));
    if n > 0.0 && !f64::is_nan(sum) { sum / n } else { f64::INFINITY }
}
