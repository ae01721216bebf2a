//! Which findings are established, and which are leads.

use super::bootstrap::{NullRate, Resamples, null_rate, resamples};
use crate::addition::{Addition, labels};
use crate::columns::LinearProblem;
use crate::score::Scored;
use crate::search::{Found, Search, chances_beside};

/// Share of resamples in which a finding, or one that takes its place, has to come back. The price of a resample is eased so that a finding
/// at the limit of what pays in the search does as often, where nothing takes its place.
const COMES_BACK: f64 = 0.9;
/// Share of resamples from which on what is not established is told as a lead.
const LEADS: f64 = 1.0 / 3.0;
/// Standard errors (over blocks, paired) within which one set is as good as another.
const AS_GOOD: f64 = 2.0;

/// Why a finding is a lead only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Short {
    /// Chance alone moves its amount as far, among so many candidates.
    NotSignificant,
    /// It comes back in too few resamples.
    NotStable,
    /// It does not pay its price in predictions of left-out blocks.
    DoesNotPay,
}

/// A finding that is not established.
#[derive(Clone, Debug)]
pub(crate) struct Lead {
    pub addition: Addition,
    pub inclusion: f64,
    pub chance: Option<f64>,
    pub short: Short,
}

/// Findings of a search.
pub(crate) struct Judgement {
    /// Number of the established set among what was tried.
    pub named: usize,
    /// Of each of its additions: probability that chance alone moves it as far.
    pub chances: Vec<f64>,
    /// The same as the share of false findings among all that are as significant (Benjamini and Yekutieli 2001).
    pub q_values: Vec<f64>,
    /// Share of resamples with each of its additions, or with one that takes its place.
    pub inclusion: Vec<f64>,
    /// Other sets that are as good.
    pub alternatives: Vec<usize>,
    pub leads: Vec<Lead>,
    pub null: NullRate,
}

/// Judges what a search found.
pub(crate) fn judged(search: &Search<'_>, found: &mut Found, seed: u64, null_runs: usize) -> Judgement {
    let best = found.best().clone();
    let sample = search.sample();
    let problem = LinearProblem::new(&sample, &search.view.blocks, &best, &search.library);
    let mut named = named(search, found);
    let all = resamples(found, seed);
    // A finding that does not come back over resamples leaves, and what is left is judged again.
    let (alternatives, inclusion) = loop {
        let alternatives = alternatives(search, found, named);
        let set = &found.tried[named];
        let inclusion: Vec<f64> =
            set.additions().iter().map(|a| comes_back(&all, a, found, named, &alternatives)).collect();
        let least = inclusion.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1));
        match least.filter(|(_, share)| **share < COMES_BACK) {
            Some((number, _)) => {
                let (set, rest) = (set.clone(), crate::search::without(set.additions(), number));
                named = found.fitted(search, &set, &rest);
                named = found.significant(search, named);
            }
            None => break (alternatives, inclusion),
        }
    };
    let chances = found.chances(&found.tried[named]);
    let q_values = q_values(&problem, found, named, &chances, search.candidates);
    let leads = leads(found, named, &all, &alternatives);
    let null = null_rate(search, &problem, null_runs, seed);
    Judgement { named, chances, q_values, inclusion, alternatives, leads, null }
}

/// The number of the set that is named, as far as one fit of each set tells: the significant part of the best, in its simplest form.
pub(crate) fn named(search: &Search<'_>, found: &mut Found) -> usize {
    let best = found.significant(search, found.best);
    simplest(search, found, best)
}

/// The smallest significant set that is as good as `best` (the rule of one standard error: Breiman et al. 1984, with two); of equal ones
/// the best.
fn simplest(search: &Search<'_>, found: &Found, best: usize) -> usize {
    let set = &found.tried[best];
    // Parts of the set were judged by the significance of what they lack.
    let is_part = |other: &Scored| other.additions().iter().all(|a| set.additions().contains(a));
    let is_alive = |n: &usize| {
        let other = &found.tried[*n];
        other.additions().len() < set.additions().len()
            && !is_part(other)
            && is_as_good(found, other, set)
            && found.is_significant(search, other)
            && found.margin(other, found.base()) >= 0.0
    };
    let alive = (0..found.tried.len()).filter(is_alive);
    let by = |n: &usize| (found.tried[*n].additions().len(), -found.margin(&found.tried[*n], set));
    alive.min_by(|a, b| by(a).partial_cmp(&by(b)).unwrap_or(std::cmp::Ordering::Equal)).unwrap_or(best)
}

/// Whether a set predicts left-out blocks as well as another, within what the gain of one over the other is uncertain by: by what blocks
/// show, and at least as a logarithm of a ratio of likelihoods is, whose variance is twice its mean.
fn is_as_good(found: &Found, other: &Scored, set: &Scored) -> bool {
    let margin = found.margin(set, other);
    let error = set.evidence.error_of_gain(&other.evidence).max((2.0 * margin.max(0.0)).sqrt());
    margin < AS_GOOD * error
}

/// Other significant sets of no more additions that are as good.
fn alternatives(search: &Search<'_>, found: &Found, named: usize) -> Vec<usize> {
    let set = &found.tried[named];
    let mine = labels(set.additions());
    let mut keys = vec![mine.clone()];
    let mut out: Vec<usize> = Vec::new();
    for (n, other) in found.tried.iter().enumerate() {
        let key = other.key();
        let is_other = !key.is_empty()
            && key.len() <= mine.len()
            && !keys.contains(&key)
            && !key.iter().all(|k| mine.contains(k));
        if is_other && is_as_good(found, other, set) && found.is_significant(search, other) {
            keys.push(key);
            out.push(n);
        }
    }
    out.sort_by(|a, b| {
        found.margin(&found.tried[*b], set).total_cmp(&found.margin(&found.tried[*a], set)).then(a.cmp(b))
    });
    out
}

/// Share of the resamples in which an addition of the named set comes back, or one that takes its place: an addition of an alternative, or
/// another form of the same law.
fn comes_back(
    all: &Resamples,
    addition: &Addition,
    found: &Found,
    named: usize,
    alternatives: &[usize],
) -> f64 {
    let mine = labels(found.tried[named].additions());
    let others = alternatives.iter().flat_map(|n| found.tried[*n].key()).filter(|k| !mine.contains(k));
    let tried = found.tried.iter().flat_map(|set| set.additions());
    let forms = tried.filter(|other| addition.is_form_of(other)).map(Addition::label);
    let readings: Vec<String> = others.chain(forms).chain([addition.label()]).collect();
    all.share(|labels| labels.iter().any(|l| readings.contains(l)))
}

/// Share of false findings among those at least as significant as each addition of the named set, among all candidates.
fn q_values(problem: &LinearProblem, found: &Found, named: usize, own: &[f64], candidates: f64) -> Vec<f64> {
    let set = found.tried[named].additions();
    let fitted: Vec<usize> =
        problem.fitted.iter().copied().filter(|g| set.contains(&problem.groups[*g].addition)).collect();
    let mut all = chances_beside(problem, &fitted);
    all.extend(own);
    all.sort_by(f64::total_cmp);
    let count = candidates.max(all.len() as f64);
    let harmonic: f64 = (1..=count as usize).map(|i| 1.0 / i as f64).sum();
    let q = |p: f64| {
        let from = all.partition_point(|other| *other < p);
        let each = all.iter().enumerate().skip(from);
        each.map(|(rank, p)| p * count * harmonic / (rank + 1) as f64).fold(1.0, f64::min)
    };
    own.iter().map(|p| q(*p)).collect()
}

/// Additions that the best set has and the named one has not, and what a third of the resamples select.
fn leads(found: &Found, named: usize, all: &Resamples, alternatives: &[usize]) -> Vec<Lead> {
    let (set, best) = (&found.tried[named], found.best());
    let of_alternatives: Vec<String> = alternatives.iter().flat_map(|n| found.tried[*n].key()).collect();
    let mut out: Vec<Lead> = Vec::new();
    let chances = found.chances(best);
    for (addition, chance) in best.additions().iter().zip(chances) {
        if !set.additions().contains(addition) {
            let inclusion = all.share_of(&addition.label());
            let short = if inclusion < COMES_BACK { Short::NotStable } else { Short::NotSignificant };
            out.push(Lead { addition: addition.clone(), inclusion, chance: Some(chance), short });
        }
    }
    let listed = found.tried.iter().flat_map(|s| s.additions()).collect::<Vec<_>>();
    let shares = all.selected().into_iter().map(|label| (label, all.share_of(label)));
    for (label, inclusion) in shares.filter(|(_, share)| *share >= LEADS) {
        let is_known = set.key().contains(label)
            || of_alternatives.contains(label)
            || out.iter().any(|lead| lead.addition.label() == *label);
        if let Some(addition) = listed.iter().find(|a| a.label() == *label).filter(|_| !is_known) {
            out.push(Lead {
                addition: (*addition).clone(),
                inclusion,
                chance: None,
                short: Short::DoesNotPay,
            });
        }
    }
    out.sort_by(|a, b| b.inclusion.total_cmp(&a.inclusion).then(a.addition.label().cmp(&b.addition.label())));
    out
}
