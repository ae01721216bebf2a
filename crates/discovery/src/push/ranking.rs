//! How the candidates of a search came out: shares, rivals, reasons.

use super::numbers::Numbers;
use super::search::{Judged, Search};
use crate::result::Candidate;
use std::collections::BTreeMap;

/// Sets within this of the best on both parts together are told as well: odds of 100 to 1.
const AMBIGUOUS: f64 = 9.2;
/// Sets within this of the best on the training part alone are told as well.
const AMBIGUOUS_TRAIN: f64 = 4.6;

/// How the candidates came out, on the windows of the search.
pub(crate) struct Ranking {
    /// Kinds of other sets that explain the data as well, best first.
    pub alternatives: Vec<Vec<String>>,
    /// Candidates, best first.
    pub candidates: Vec<Candidate>,
    /// Share of the gain of each kind of the answer.
    pub shares: Vec<(&'static str, f64)>,
}

impl Ranking {
    pub fn of(search: &Search<'_>, best: usize) -> Self {
        let alternatives = alternatives(search, best);
        let candidates = candidates(search, best, &alternatives);
        Self { candidates, alternatives, shares: shares(search, best) }
    }
}

/// Share of the gain in likelihood that each effect of a set is worth.
fn shares(search: &Search<'_>, best: usize) -> Vec<(&'static str, f64)> {
    let (base, best) = (search.base(), &search.tried[best]);
    let cost = |j: &Judged| j.fit.cost(&search.train);
    let whole = (cost(base) - cost(best)).max(1e-300);
    let kinds = best.kinds().to_vec();
    let share = |kind: &&'static str| {
        let rest: Vec<&'static str> = kinds.iter().copied().filter(|k| k != kind).collect();
        let without = match search.fitted(&rest) {
            Some(j) => cost(j),
            None => cost(&search.refit(&best.fit, &rest, None)),
        };
        (*kind, ((without - cost(best)) / whole).clamp(0.0, 1.0))
    };
    kinds.iter().map(share).collect()
}

/// Other sets that explain the data as well.
fn alternatives(search: &Search<'_>, chosen: usize) -> Vec<Vec<String>> {
    let best = &search.tried[chosen];
    if best.kinds().is_empty() {
        return Vec::new();
    }
    let mut list: Vec<(f64, Vec<String>)> = Vec::new();
    for (i, j) in search.tried.iter().enumerate() {
        // A set with the answer in it explains nothing that the answer does not.
        let wider = best.kinds().iter().all(|k| j.kinds().contains(k));
        if i == chosen || j.held.is_none() || wider || j.kinds().len() > best.kinds().len() + 1 {
            continue;
        }
        let behind = (search.total(j) - search.total(best)) / best.unit;
        let train = (search.criterion(j) - search.criterion(best)) / best.unit;
        if !j.kinds().is_empty() && (behind < AMBIGUOUS || train < AMBIGUOUS_TRAIN) {
            list.push((behind, j.kinds().iter().map(|k| k.to_string()).collect()));
        }
    }
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    list.into_iter().map(|(_, kinds)| kinds).collect()
}

fn candidates(search: &Search<'_>, answer: usize, rivals: &[Vec<String>]) -> Vec<Candidate> {
    let base = search.base();
    let best = &search.tried[answer];
    let heldout_gain = |j: &Judged| search.heldout_gain(j);
    // Only folds speak against a set that is better on both parts.
    let unstable =
        |j: &Judged| heldout_gain(j).is_some_and(|gain| gain > 0.0) && search.total(j) < search.total(best);
    let stable = search.tried.iter().any(unstable);
    let mut order: Vec<usize> = (1..search.tried.len()).collect();
    order.sort_by(|&a, &b| search.criterion(&search.tried[a]).total_cmp(&search.criterion(&search.tried[b])));
    let mut list: Vec<Candidate> = order
        .into_iter()
        .map(|i| {
            let j = &search.tried[i];
            let numbers = Numbers::of(&search.train, &j.fit);
            let mut parameters = BTreeMap::new();
            for kind in j.kinds() {
                for (name, e) in numbers.estimates(Some(kind)) {
                    parameters.insert(format!("{kind}.{name}"), e);
                }
            }
            let gain = (base.fit.cost(&search.train) - j.fit.cost(&search.train)) / j.unit;
            let penalty = j.penalty / j.unit;
            let kinds: Vec<String> = j.kinds().iter().map(|k| k.to_string()).collect();
            let chosen = i == answer;
            let behind = (search.criterion(j) - search.criterion(best)) / best.unit;
            let why = if chosen && stable {
                "of the best explanation what most folds find again".into()
            } else if chosen {
                "explains the training pushes best and holds on the others".into()
            } else if rivals.contains(&kinds) {
                "explains the data as well: cannot be told apart".into()
            } else if gain < penalty {
                format!("gains {gain:.1}, less than its penalty of {penalty:.1}")
            } else if behind > 0.0 {
                format!("{behind:.1} behind the answer")
            } else if unstable(j) {
                "explains more, but most folds do not find all of it again".into()
            } else {
                "does not hold on the held-out pushes".into()
            };
            Candidate {
                kinds,
                parameters,
                gain,
                penalty,
                heldout_gain: heldout_gain(j),
                fitted: true,
                chosen,
                why,
            }
        })
        .collect();
    for s in &search.base_scores {
        if list.iter().any(|c| c.kinds.len() == 1 && c.kinds[0] == s.kind) {
            continue;
        }
        let (gain, penalty) = (s.evidence().max(0.0), search.penalty(s));
        list.push(Candidate {
            kinds: vec![s.kind.into()],
            parameters: BTreeMap::new(),
            gain,
            penalty,
            heldout_gain: None,
            fitted: false,
            chosen: false,
            why: if gain < penalty {
                format!("would gain {gain:.1}, less than its penalty of {penalty:.1}")
            } else {
                format!("would gain {gain:.1} alone; others promise more")
            },
        });
    }
    list
}
