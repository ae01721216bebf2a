//! How often a finding comes back where blocks count more and less, and how often nothing is taken for something.
//!
//! Neither simulates anything. The first repeats the choice among all sets that were fitted, with weights of the Bayesian bootstrap (Rubin
//! 1981) over blocks. The second repeats the selection in the linear problem at the best set, on records in which nothing is missing: the
//! best set's residuals with the sign of whole blocks turned (the wild cluster bootstrap: Cameron, Gelbach and Miller 2008), so that their
//! correlation, their size and where they stand remain.

use crate::columns::LinearProblem;
use crate::search::{Found, Search, is_significant, select_of};
use augsim_data::random_stream;
use rand::RngExt;
use rand_distr::{Distribution, Exp1};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Resamples: the standard error of a frequency of 0.9 is 0.002. With a tenth as many the seed decides findings that come back about as often
/// as is asked.
const RESAMPLES: usize = 20_000;

/// Normal quantile of [`super::established::COMES_BACK`].
const QUANTILE: f64 = 1.281_551_565_544_6;

/// The price of an effect in a resample: so much less than in the search that an effect at the limit of what pays there, a nearly normal
/// number of standard errors from none, comes back in nine of ten resamples where nothing takes its place. Whether it is there was tested
/// before; resamples tell how firmly the data hold it against others.
fn eased(price: f64) -> f64 {
    let errors = ((2.0 * price).sqrt() - QUANTILE).max(0.0);
    0.5 * errors * errors
}

/// Sets that the resamples select.
pub(crate) struct Resamples {
    /// Labels of each set that one of them selects, and the share of those that do.
    sets: Vec<(Vec<String>, f64)>,
}

impl Resamples {
    /// Share of the resamples that select a set of which `holds` is true.
    pub fn share(&self, holds: impl Fn(&[String]) -> bool) -> f64 {
        self.sets.iter().filter(|(labels, _)| holds(labels)).map(|(_, share)| share).sum()
    }

    /// Share of the resamples that select an addition.
    pub fn share_of(&self, label: &str) -> f64 {
        self.share(|labels| labels.iter().any(|l| l == label))
    }

    /// Every addition that is selected, in order of its name.
    pub fn selected(&self) -> BTreeSet<&String> {
        self.sets.iter().flat_map(|(labels, _)| labels).collect()
    }
}

/// Records without a missing effect, and how many of them name one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct NullRate {
    pub named: usize,
    pub of: usize,
}

/// Sets chosen among all fitted sets under weights of the blocks.
pub(crate) fn resamples(found: &Found, seed: u64) -> Resamples {
    let (best, base) = (found.best(), found.base());
    let independent = best.evidence.memory.independent;
    let sets: Vec<(Vec<String>, Vec<f64>, f64)> = found
        .tried
        .iter()
        .map(|s| {
            let scale = independent / s.evidence.memory.independent;
            let gains = s.evidence.gains_over(&base.evidence).into_iter().map(|g| scale * g);
            let price = s.additions().iter().map(|addition| eased(found.price.of(addition))).sum();
            (s.key(), gains.collect(), price)
        })
        .collect();
    let chosen = |resample: usize| {
        let mut rng = random_stream(seed, "block bootstrap", resample as u64);
        let mut weights: Vec<f64> = (0..best.evidence.blocks).map(|_| Exp1.sample(&mut rng)).collect();
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w *= best.evidence.blocks as f64 / sum);
        let value = |(_, gains, price): &(Vec<String>, Vec<f64>, f64)| {
            let gain: f64 = gains.iter().zip(&weights).map(|(g, w)| g * w).sum();
            gain - price
        };
        let values: Vec<f64> = sets.iter().map(value).collect();
        (0..sets.len()).fold(0, |best, n| if values[n] > values[best] { n } else { best })
    };
    let first: Vec<usize> = (0..RESAMPLES).into_par_iter().map(chosen).collect();
    let mut counts = vec![0_usize; sets.len()];
    first.into_iter().for_each(|n| counts[n] += 1);
    let counted = sets.into_iter().zip(counts).filter(|(_, count)| *count > 0);
    Resamples {
        sets: counted.map(|((labels, ..), count)| (labels, count as f64 / RESAMPLES as f64)).collect(),
    }
}

/// How many of `runs` records in which nothing is missing name an effect.
pub(crate) fn null_rate(search: &Search<'_>, problem: &LinearProblem, runs: usize, seed: u64) -> NullRate {
    let fitted = problem.columns_of(&problem.fitted);
    let left = problem.left_by(&fitted);
    let names = |run: usize| {
        let mut rng = random_stream(seed, "record without effects", run as u64);
        let signs: Vec<f64> = left.iter().map(|_| if rng.random_bool(0.5) { 1.0 } else { -1.0 }).collect();
        let blocks = left.iter().zip(&signs).map(|(sums, sign)| sums.turned(*sign)).collect();
        let best = select_of(problem, blocks, search.price());
        !best.chosen.groups.is_empty() && is_significant(problem, &best, search)
    };
    let named = (0..runs).into_par_iter().filter(|run| names(*run)).count();
    NullRate { named, of: runs }
}
