//! Resampling: how often a finding is selected under random block weights, and how often an effect is named
//! where none is missing.
//!
//! Neither needs simulations. Resamples repeat the choice among all fitted sets with Bayesian bootstrap
//! weights over blocks (Rubin 1981). Null records repeat the selection in the linear problem with the signs
//! of whole blocks of the best set's residuals flipped at random (wild cluster bootstrap: Cameron, Gelbach
//! and Miller 2008), which preserves their size and autocorrelation.

use crate::linear_problem::LinearProblem;
use crate::search::{Search, SearchResult, is_significant, select_for};
use augsim_data::random_stream;
use rand::RngExt;
use rand_distr::{Distribution, Exp1};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Number of resamples: the standard error of a share of 0.9 is then 0.002. With a tenth as many, the seed
/// would decide findings near the limit.
const RESAMPLES: usize = 20_000;

/// Standard normal quantile of the required inclusion share of 0.9, `MIN_INCLUSION` in `established.rs`.
const INCLUSION_QUANTILE: f64 = 1.281_551_565_544_6;

/// Penalty of an effect in a resample, nats, from its penalty in the search. It is reduced so that an effect
/// at the limit of the search penalty is selected in nine of ten resamples if nothing replaces it.
/// Significance was tested before; resamples test how well the data distinguish the effect from others.
fn resample_penalty(penalty: f64) -> f64 {
    let errors = ((2.0 * penalty).sqrt() - INCLUSION_QUANTILE).max(0.0);
    0.5 * errors * errors
}

/// Sets of effects that were selected in the bootstrap resamples.
pub(crate) struct Resamples {
    /// Labels of the additions in each selected set, and the share of the resamples that selected it.
    sets: Vec<(Vec<String>, f64)>,
}

impl Resamples {
    /// Share of the resamples whose selected set has labels that satisfy `holds`.
    pub fn share(&self, holds: impl Fn(&[String]) -> bool) -> f64 {
        self.sets.iter().filter(|(labels, _)| holds(labels)).map(|(_, share)| share).sum()
    }

    /// Share of the resamples whose selected set contains the addition with this label.
    pub fn share_of(&self, label: &str) -> f64 {
        self.share(|labels| labels.iter().any(|l| l == label))
    }

    /// Labels of all additions that were selected in any resample.
    pub fn selected(&self) -> BTreeSet<&String> {
        self.sets.iter().flat_map(|(labels, _)| labels).collect()
    }
}

/// Number of simulated records without a missing effect in which an effect is named, of `runs`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FalsePositives {
    pub named: usize,
    pub runs: usize,
}

/// Repeats the choice among all fitted sets of effects under random weights of the blocks.
pub(crate) fn resamples(found: &SearchResult, seed: u64) -> Resamples {
    let (best, base) = (found.best(), found.base());
    let independent = best.evidence.independence.share;
    let sets: Vec<(Vec<String>, Vec<f64>, f64)> = found
        .sets
        .iter()
        .map(|s| {
            let scale = independent / s.evidence.independence.share;
            let gains = s.evidence.gains_over(&base.evidence).into_iter().map(|g| scale * g);
            let penalty = s
                .additions()
                .iter()
                .map(|addition| resample_penalty(found.penalty.of_addition(addition)))
                .sum();
            (s.key(), gains.collect(), penalty)
        })
        .collect();
    let chosen = |resample: usize| {
        let mut rng = random_stream(seed, "block bootstrap", resample as u64);
        let mut weights: Vec<f64> = (0..best.evidence.blocks).map(|_| Exp1.sample(&mut rng)).collect();
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w *= best.evidence.blocks as f64 / sum);
        let value = |(_, gains, penalty): &(Vec<String>, Vec<f64>, f64)| {
            let gain: f64 = gains.iter().zip(&weights).map(|(g, w)| g * w).sum();
            gain - penalty
        };
        let values: Vec<f64> = sets.iter().map(value).collect();
        (0..sets.len()).fold(0, |best, n| if values[n] > values[best] { n } else { best })
    };
    let selections: Vec<usize> = (0..RESAMPLES).into_par_iter().map(chosen).collect();
    let mut counts = vec![0_usize; sets.len()];
    selections.into_iter().for_each(|n| counts[n] += 1);
    let counted = sets.into_iter().zip(counts).filter(|(_, count)| *count > 0);
    Resamples {
        sets: counted.map(|((labels, ..), count)| (labels, count as f64 / RESAMPLES as f64)).collect(),
    }
}

/// Counts in how many of `runs` simulated records without a missing effect an effect is named.
pub(crate) fn false_positive_rate(
    search: &Search<'_>,
    problem: &LinearProblem,
    runs: usize,
    seed: u64,
) -> FalsePositives {
    let fitted = problem.columns_of(&problem.fitted);
    let residual_sums = problem.residual_sums(&fitted);
    let has_false_finding = |run: usize| {
        let mut rng = random_stream(seed, "record without effects", run as u64);
        let signs: Vec<f64> =
            residual_sums.iter().map(|_| if rng.random_bool(0.5) { 1.0 } else { -1.0 }).collect();
        let blocks = residual_sums.iter().zip(&signs).map(|(sums, sign)| sums.with_sign(*sign)).collect();
        let best = select_for(problem, blocks, search.penalty());
        !best.chosen.groups.is_empty() && is_significant(problem, &best, search)
    };
    let named = (0..runs).into_par_iter().filter(|run| has_false_finding(*run)).count();
    FalsePositives { named, runs }
}
