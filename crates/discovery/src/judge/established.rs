//! Selection of the established findings, the alternatives and the leads.

use super::bootstrap::{FalsePositives, Resamples, false_positive_rate, resamples};
use super::memory::{exchange_memory, stand_in};
use super::repeats::within_scatter;
use crate::addition::{Addition, labels};
use crate::columns::linearise;
use crate::linear_problem::LinearProblem;
use crate::random_effect_test::not_beside_random_effect;
use crate::score::Scored;
use crate::search::{Search, SearchResult, p_values_given};

/// Minimum share of resamples in which a finding, or an equivalent one, must be selected to be established.
/// The penalty in resamples is reduced so that a finding at the limit of the search reaches this share.
const MIN_INCLUSION: f64 = 0.9;
/// Minimum share of resamples for a finding that is not established to be reported as a lead.
const MIN_LEAD_INCLUSION: f64 = 1.0 / 3.0;
/// Difference of two sets' scores, in standard errors (over blocks, paired), below which the sets are
/// equivalent.
const EQUIVALENT_ERRORS: f64 = 2.0;

/// Reason why a finding is only a lead and not established.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shortcoming {
    /// The finding is not significant, given the number of candidates that were tested.
    NotSignificant,
    /// The finding is selected in too few resamples.
    NotStable,
    /// The finding's gain in predictions of left-out blocks is below its penalty.
    DoesNotPay,
    /// The finding is not significant beside an effect that depends on the past.
    StandsForMemory,
    /// The finding does not stand out of the scatter between repeats.
    WithinScatter,
    /// The finding is not significant beside a random effect per record.
    BesideRandomEffect,
}

/// A finding that is not established, with the reason.
#[derive(Clone, Debug)]
pub(crate) struct Lead {
    pub addition: Addition,
    pub inclusion: f64,
    pub chance: Option<f64>,
    pub short: Shortcoming,
}

/// Findings of a search, judged by significance and stability.
pub(crate) struct Findings {
    /// Index, among the fitted sets, of the established set of effects.
    pub named: usize,
    /// p-value of each addition of the established set.
    pub p_values: Vec<f64>,
    /// q-value of each addition of the established set: expected share of false findings among those at least
    /// as significant (Benjamini and Yekutieli 2001).
    pub q_values: Vec<f64>,
    /// Share of resamples that select each addition of the established set, or an equivalent one.
    pub inclusion: Vec<f64>,
    /// Indices of other sets that explain the data equally well.
    pub alternatives: Vec<usize>,
    pub leads: Vec<Lead>,
    pub false_positives: FalsePositives,
}

impl Findings {
    /// Findings of a set of effects that was not judged; `named` is its index.
    pub fn untested(named: usize) -> Self {
        Self {
            named,
            p_values: Vec::new(),
            q_values: Vec::new(),
            inclusion: Vec::new(),
            alternatives: Vec::new(),
            leads: Vec::new(),
            false_positives: FalsePositives::default(),
        }
    }
}

/// Judges the findings of a search: which are established, equivalent alternatives, or only leads.
pub(crate) fn judge_findings(
    search: &Search<'_>,
    found: &mut SearchResult,
    seed: u64,
    null_runs: usize,
) -> Findings {
    exchange_memory(search, found);
    let best = found.best().clone();
    let sample = search.sample();
    let problem = linearise(&sample, &search.view.blocks, &best, &search.library);
    let mut named = named_set(search, found);
    let resampled = resamples(found, seed);
    let mut dropped_for: Vec<(Addition, Shortcoming)> = Vec::new();
    // A finding that is selected in too few resamples, or else stands in for a dependence on the past, or else is within the
    // scatter between repeats, is dropped, and the remaining set is judged again.
    let (alternatives, inclusion) = loop {
        let alternatives = alternatives(search, found, named);
        let set = found.sets[named].clone();
        let inclusion: Vec<f64> = set
            .additions()
            .iter()
            .map(|a| inclusion_share(&resampled, a, found, named, &alternatives))
            .collect();
        let least = inclusion.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1));
        let unstable = least.filter(|(_, share)| **share < MIN_INCLUSION).map(|(number, _)| number);
        let because = |short: Shortcoming| move |number: usize| (number, short);
        let dropped = unstable
            .map(because(Shortcoming::NotStable))
            .or_else(|| stand_in(search, found, named).map(because(Shortcoming::StandsForMemory)))
            .or_else(|| within_scatter(search, found, named).map(because(Shortcoming::WithinScatter)))
            .or_else(|| {
                not_beside_random_effect(search, found, named).map(because(Shortcoming::BesideRandomEffect))
            });
        let Some((number, short)) = dropped else { break (alternatives, inclusion) };
        dropped_for.push((set.additions()[number].clone(), short));
        let remaining = crate::search::without(set.additions(), number);
        named = found.index_or_fit(search, &set, &remaining);
        named = found.drop_insignificant(search, named);
    };
    let p_values = found.p_values(&found.sets[named]);
    let q_values = q_values(&problem, found, named, &p_values, search.candidates);
    let mut leads = leads(found, named, &resampled, &alternatives);
    for lead in &mut leads {
        let of_lead = dropped_for.iter().find(|(addition, _)| *addition == lead.addition);
        lead.short = of_lead.map_or(lead.short, |(_, short)| *short);
    }
    let false_positives = false_positive_rate(search, &problem, null_runs, seed);
    Findings { named, p_values, q_values, inclusion, alternatives, leads, false_positives }
}

/// Index of the set of effects to name before resampling. It is the significant part of the best set, or a
/// simpler equivalent set.
pub(crate) fn named_set(search: &Search<'_>, found: &mut SearchResult) -> usize {
    let best = found.drop_insignificant(search, found.best);
    simplest(search, found, best)
}

/// Index of the simplest significant set that is equivalent to the set `best`; among equally simple ones the best.
///
/// A set is simpler if it has fewer effects, or as many with fewer that depend on the past. In the second case the residuals
/// that it leaves must not depend on the past. The rule is the one-standard-error rule of Breiman et al. 1984, with two
/// standard errors.
fn simplest(search: &Search<'_>, found: &SearchResult, best: usize) -> usize {
    let set = &found.sets[best];
    // Subsets were already rejected by the significance of what they lack.
    let is_part = |other: &Scored| other.additions().iter().all(|a| set.additions().contains(a));
    let is_eligible = |n: &usize| {
        let other = &found.sets[*n];
        size(other) < size(set)
            && !is_part(other)
            && is_equivalent(found, other, set)
            && found.is_significant(search, other)
            && found.margin(other, found.base()) >= 0.0
    };
    let mut eligible: Vec<usize> = (0..found.sets.len()).filter(is_eligible).collect();
    let margin = |n: usize| found.margin(&found.sets[n], set);
    eligible.sort_by(|a, b| {
        size(&found.sets[*a]).cmp(&size(&found.sets[*b])).then(margin(*b).total_cmp(&margin(*a)))
    });
    let is_as_good = |n: &usize| {
        found.sets[*n].additions().len() < set.additions().len() || stand_in(search, found, *n).is_none()
    };
    eligible.into_iter().find(is_as_good).unwrap_or(best)
}

/// Number of effects of a set, and of those that depend on the past.
fn size(set: &Scored) -> (usize, usize) {
    let additions = set.additions();
    (additions.len(), additions.iter().filter(|a| a.depends_on_past()).count())
}

/// Whether `other` predicts left-out blocks as well as `set`, within two standard errors. The standard error
/// is that of the gain over blocks, and at least sqrt(2 G) of a log likelihood ratio G, whose variance is
/// twice its mean.
fn is_equivalent(found: &SearchResult, other: &Scored, set: &Scored) -> bool {
    let margin = found.margin(set, other);
    let error = set.evidence.gain_standard_error(&other.evidence).max((2.0 * margin.max(0.0)).sqrt());
    margin < EQUIVALENT_ERRORS * error
}

/// Indices of other significant sets that are equivalent to the named one and have no more additions.
fn alternatives(search: &Search<'_>, found: &SearchResult, named: usize) -> Vec<usize> {
    let set = &found.sets[named];
    let named_key = labels(set.additions());
    let mut keys = vec![named_key.clone()];
    let mut out: Vec<usize> = Vec::new();
    for (n, other) in found.sets.iter().enumerate() {
        let key = other.key();
        let is_other = !key.is_empty()
            && key.len() <= named_key.len()
            && !keys.contains(&key)
            && !key.iter().all(|k| named_key.contains(k));
        if is_other && is_equivalent(found, other, set) && found.is_significant(search, other) {
            keys.push(key);
            out.push(n);
        }
    }
    out.sort_by(|a, b| {
        found.margin(&found.sets[*b], set).total_cmp(&found.margin(&found.sets[*a], set)).then(a.cmp(b))
    });
    out
}

/// Share of the resamples that select an addition of the named set or an equivalent one. Equivalent are
/// additions of alternative sets, and other forms of the same effect.
fn inclusion_share(
    resampled: &Resamples,
    addition: &Addition,
    found: &SearchResult,
    named: usize,
    alternatives: &[usize],
) -> f64 {
    let named_key = labels(found.sets[named].additions());
    let others = alternatives.iter().flat_map(|n| found.sets[*n].key()).filter(|k| !named_key.contains(k));
    let tried = found.sets.iter().flat_map(|set| set.additions());
    let forms = tried.filter(|other| addition.is_variant_of(other)).map(Addition::label);
    let equivalent: Vec<String> = others.chain(forms).chain([addition.label()]).collect();
    resampled.share(|labels| labels.iter().any(|l| equivalent.contains(l)))
}

/// q-values of the additions of the named set among all candidates (expected share of false findings).
fn q_values(
    problem: &LinearProblem,
    found: &SearchResult,
    named: usize,
    named_p: &[f64],
    candidates: f64,
) -> Vec<f64> {
    let set = found.sets[named].additions();
    let fitted: Vec<usize> =
        problem.fitted.iter().copied().filter(|g| set.contains(&problem.groups[*g].addition)).collect();
    let mut p_values = p_values_given(problem, &fitted);
    p_values.extend(named_p);
    p_values.sort_by(f64::total_cmp);
    let count = candidates.max(p_values.len() as f64);
    let harmonic: f64 = (1..=count as usize).map(|i| 1.0 / i as f64).sum();
    let q = |p: f64| {
        let first = p_values.partition_point(|other| *other < p);
        let from_rank = p_values.iter().enumerate().skip(first);
        from_rank.map(|(rank, p)| p * count * harmonic / (rank + 1) as f64).fold(1.0, f64::min)
    };
    named_p.iter().map(|p| q(*p)).collect()
}

/// Leads (findings that are not established): additions of the best set that neither the named set nor an alternative
/// contains, and others that a third of the resamples select.
fn leads(found: &SearchResult, named: usize, resampled: &Resamples, alternatives: &[usize]) -> Vec<Lead> {
    let (set, best) = (&found.sets[named], found.best());
    let of_alternatives: Vec<String> = alternatives.iter().flat_map(|n| found.sets[*n].key()).collect();
    let mut out: Vec<Lead> = Vec::new();
    let p_values = found.p_values(best);
    for (addition, chance) in best.additions().iter().zip(p_values) {
        if !set.additions().contains(addition) && !of_alternatives.contains(&addition.label()) {
            let inclusion = resampled.share_of(&addition.label());
            let short =
                if inclusion < MIN_INCLUSION { Shortcoming::NotStable } else { Shortcoming::NotSignificant };
            out.push(Lead { addition: addition.clone(), inclusion, chance: Some(chance), short });
        }
    }
    let listed = found.sets.iter().flat_map(|s| s.additions()).collect::<Vec<_>>();
    let shares = resampled.selected().into_iter().map(|label| (label, resampled.share_of(label)));
    for (label, inclusion) in shares.filter(|(_, share)| *share >= MIN_LEAD_INCLUSION) {
        let is_known = set.key().contains(label)
            || of_alternatives.contains(label)
            || out.iter().any(|lead| lead.addition.label() == *label);
        if let Some(addition) = listed.iter().find(|a| a.label() == *label).filter(|_| !is_known) {
            out.push(Lead {
                addition: (*addition).clone(),
                inclusion,
                chance: None,
                short: Shortcoming::DoesNotPay,
            });
        }
    }
    out.sort_by(|a, b| b.inclusion.total_cmp(&a.inclusion).then(a.addition.label().cmp(&b.addition.label())));
    out
}
