//! The search in five steps: linearise at the best set, select in the linear problem, refit what is new, repeat, drop what does not pay.

use super::refit::{ALPHA, Price, Search, Starts};
use super::select::{Chosen, select};
use crate::addition::{Addition, labels};
use crate::columns::{LinearProblem, may_join, probe};
use crate::fit::fit_nuisance;
use crate::score::{Evidence, Scored};
use rayon::prelude::*;

/// New sets that are refitted in a round: of one effect more, of as many, and of others. With nothing named yet all effects are rivals, and
/// as many are tried as with one.
const ONE_MORE: usize = 4;
const EXCHANGED: usize = 4;
const OTHERS: usize = 3;
/// Nats by which the linear problem may put a set behind the best for it to be refitted: odds of 100 to 1. The first of each kind are
/// refitted in any case: the simulator has the last word. So is what gains a good part of what the best set does, of which the linear problem
/// knows only the slope.
const BEHIND: f64 = 4.6;
const ANYHOW: usize = 1;
const GOOD_PART: f64 = 0.05;
/// Most rounds: each adds an effect or exchanges one, and a set has five.
const MOST_ROUNDS: usize = 8;
/// Sets among which the choice is repeated on folds: those that come after are far behind.
const RIVALS: usize = 8;
/// Probability below which events differ enough for their scatter to be fitted: the fit decides, this only saves it.
const VARIES: f64 = 1e-3;

/// Result of a search.
pub(crate) struct Found {
    /// Every set that was fitted, the calibrated model first.
    pub tried: Vec<Scored>,
    /// Number of the best set by gain less price.
    pub best: usize,
    pub price: Price,
}

impl Found {
    /// The calibrated model alone.
    pub fn of(base: Scored, price: Price) -> Self {
        Self { tried: vec![base], best: 0, price }
    }

    pub fn base(&self) -> &Scored {
        &self.tried[0]
    }

    pub fn best(&self) -> &Scored {
        &self.tried[self.best]
    }

    pub fn with_key(&self, key: &[String]) -> Option<&Scored> {
        self.tried.iter().find(|s| s.key() == key)
    }

    /// By how many nats, less the price of its additions, one set is better than another. Independence is that of what the larger leaves.
    pub fn margin(&self, one: &Scored, other: &Scored) -> f64 {
        let [a, b] = [one, other].map(|s| s.additions());
        let larger = if a.len() >= b.len() { one } else { other };
        one.gain_over(other, larger.evidence.memory.independent) - self.price.of_set(a) + self.price.of_set(b)
    }
}

/// Searches from the calibrated model `base` and sets that are known already.
pub(crate) fn run(search: &Search<'_>, base: Scored, known: Vec<Scored>, told: &mut dyn FnMut(f64)) -> Found {
    let mut found = Found::of(base, search.price());
    found.tried.extend(known.into_iter().filter(Scored::is_finite));
    settle(&mut found);
    for round in 0..MOST_ROUNDS {
        told(round as f64 / MOST_ROUNDS as f64);
        if search.clock.is_over() {
            break;
        }
        let before = found.best().key();
        let moves = moves(search, &found);
        let from = found.best().fit.clone();
        let fitted: Vec<Scored> =
            moves.par_iter().map(|(additions, starts)| search.refit(&from, additions, starts)).collect();
        let any = !fitted.is_empty();
        found.tried.extend(fitted.into_iter().filter(Scored::is_finite));
        settle(&mut found);
        if !any || found.best().key() == before {
            break;
        }
    }
    fit_parts(search, &mut found);
    settle(&mut found);
    found
}

/// Sets that are fitted again to other data and chosen from there, each from the values that it has here: the calibrated model first, then
/// those that came nearest to the best.
pub(crate) fn chosen_again(search: &Search<'_>, base: Scored, known: &Found) -> Found {
    let mut order: Vec<usize> = (1..known.tried.len()).collect();
    let margin = |n: usize| known.margin(&known.tried[n], known.base());
    order.sort_by(|a, b| margin(*b).total_cmp(&margin(*a)).then(a.cmp(b)));
    let mut keys: Vec<Vec<String>> = Vec::new();
    order.retain(|n| {
        let key = known.tried[*n].key();
        let fresh = !key.is_empty() && !keys.contains(&key);
        keys.push(key);
        fresh
    });
    order.truncate(RIVALS);
    let again = |n: &usize| {
        let from = &known.tried[*n].fit;
        let starts = fit_nuisance(&search.sample(), &from.hypothesis, &from.theta, &[]);
        search.refit(&starts, &from.hypothesis.additions, &Vec::new())
    };
    let mut found = Found::of(base, search.price());
    let fitted: Vec<Scored> = order.par_iter().map(again).collect();
    found.tried.extend(fitted.into_iter().filter(Scored::is_finite));
    settle(&mut found);
    fit_parts(search, &mut found);
    settle(&mut found);
    found
}

/// Finds the best of all that was tried. Independence differs from set to set, so that three may each be better than the next: none is
/// taken twice.
fn settle(found: &mut Found) {
    let mut passed = vec![found.best];
    loop {
        let better = |n: &usize| {
            let (one, best) = (&found.tried[*n], found.best());
            let same = one.key() == best.key();
            if same { one.fit.ll > best.fit.ll + 1e-6 } else { found.margin(one, best) > 0.0 }
        };
        let better: Vec<usize> =
            (0..found.tried.len()).filter(|n| !passed.contains(n) && better(n)).collect();
        let by = |n: &&usize| found.margin(&found.tried[**n], found.best());
        match better.iter().max_by(|a, b| by(a).total_cmp(&by(b))) {
            Some(n) if !is_circle(found, *n) => found.best = *n,
            _ => return,
        }
        passed.push(found.best);
    }
}

/// Whether the best set would be better than the one that is to take its place.
fn is_circle(found: &Found, next: usize) -> bool {
    found.tried[next].key() != found.best().key() && found.margin(found.best(), &found.tried[next]) >= 0.0
}

/// Sets that a round fits, each with what its new additions begin at.
fn moves(search: &Search<'_>, found: &Found) -> Vec<(Vec<Addition>, Starts)> {
    let best = found.best();
    let sample = search.sample();
    let problem = LinearProblem::new(&sample, &search.view.blocks, best, &search.library);
    let chosen = select(&problem, found.price);
    let mut seen: Vec<Vec<String>> = found.tried.iter().map(Scored::key).collect();
    let mut out: Vec<(Vec<Addition>, Starts)> = Vec::new();
    let now = chosen.iter().find(|c| c.groups == problem.fitted).map_or(0.0, |c| c.value);
    let most = chosen.first().map_or(0.0, |c| c.value);
    let level = (now - BEHIND).max(now + GOOD_PART * (most - now));
    let selected = chosen.iter().map(|c| (c.value, set_of(&problem, best, c)));
    let described = beyond_columns(search, best, &problem, &chosen);
    let now = best.additions().len();
    let mut room = [if now == 0 { ONE_MORE + EXCHANGED } else { ONE_MORE }, EXCHANGED, OTHERS];
    let mut tried = [0; 3];
    let own =
        selected.map(|(value, set)| (Some(value), set)).chain(described.into_iter().map(|set| (None, set)));
    for (value, (additions, starts)) in own {
        let key = labels(&additions);
        let kind = match additions.len() {
            n if n == now + 1 => 0,
            n if n == now => 1,
            _ => 2,
        };
        let is_refused = value.is_some_and(|v| room[kind] == 0 || v < level && tried[kind] >= ANYHOW);
        if seen.contains(&key) || is_refused {
            continue;
        }
        if value.is_some() {
            room[kind] -= 1;
            tried[kind] += 1;
        }
        seen.push(key);
        out.push((additions, starts));
    }
    out
}

/// The additions of a set of the linear problem, and the values from which those that are new begin. What no column stands for (a scatter,
/// values by group) stays.
fn set_of(problem: &LinearProblem, best: &Scored, chosen: &Chosen) -> (Vec<Addition>, Starts) {
    let has_column = |a: &&Addition| problem.fitted.iter().any(|g| problem.groups[*g].addition == **a);
    let mut additions: Vec<Addition> = best.additions().iter().filter(|a| !has_column(a)).cloned().collect();
    let mut starts = Starts::new();
    let mut at = problem.declared.len();
    for g in &chosen.groups {
        let group = &problem.groups[*g];
        let own = &chosen.coefficients[at..at + group.columns.len()];
        at += own.len();
        additions.push(group.addition.clone());
        if !problem.fitted.contains(g) {
            starts.push((group.addition.clone(), group.start(own)));
        }
    }
    (additions, starts)
}

/// Sets that no column foretells: a scatter, laws that act through another, a law whose kind another foretells, simpler forms.
fn beyond_columns(
    search: &Search<'_>,
    best: &Scored,
    problem: &LinearProblem,
    chosen: &[Chosen],
) -> Vec<(Vec<Addition>, Starts)> {
    let now = best.additions().to_vec();
    let h = &best.fit.hypothesis;
    let with = |new: Starts| {
        let additions = now.iter().cloned().chain(new.iter().map(|(a, _)| a.clone())).collect();
        (additions, new)
    };
    let mut out: Vec<(Vec<Addition>, Starts)> = Vec::new();
    if h.scatter.is_none() && search.events_vary(&best.fit, VARIES) {
        out.extend(search.scatters().into_iter().map(|scatter| with(vec![(scatter, Vec::new())])));
    }
    for (number, gone) in now.iter().enumerate() {
        let mut rest = now.clone();
        rest.remove(number);
        if let Some(less) = search.contained(gone).filter(|less| !rest.contains(less)) {
            let start = values_shared(best, number, &less);
            rest.push(less.clone());
            out.push((rest, vec![(less, start)]));
        } else if matches!(gone, Addition::Scatter(_)) {
            for other in search.scatters().into_iter().filter(|other| other != gone) {
                out.push(([&rest[..], std::slice::from_ref(&other)].concat(), Vec::new()));
            }
        }
    }
    let groups = chosen.iter().take(ONE_MORE).flat_map(|c| &c.groups);
    let promising: Vec<&str> = groups.map(|g| problem.groups[*g].addition.kind()).collect();
    for addition in search.library.iter() {
        let Some(effect) = addition.listed() else { continue };
        let is_foretold = effect.foretold_by.as_ref().is_some_and(|by| promising.contains(&by.as_str()));
        if is_foretold && !promising.contains(&addition.kind()) && may_join(addition, h) {
            out.push(with(vec![(addition.clone(), probe(effect))]));
        }
        if let Some(join) = effect.joins.as_ref().filter(|_| !promising.is_empty())
            && let Some(first) = Addition::of_kind(search.system(), &join.kind)
            && may_join(&first, h)
        {
            let both =
                |own: &Vec<f64>| vec![(first.clone(), join.start.clone()), (addition.clone(), own.clone())];
            out.extend(join.own.iter().map(|own| with(both(own))));
        }
    }
    out
}

/// The values in a fit of one of its additions for another whose parameters are among those of the first, by their names; empty where they
/// are not.
fn values_shared(best: &Scored, number: usize, other: &Addition) -> Vec<f64> {
    let h = &best.fit.hypothesis;
    let listed = h.additions[number].listed().zip(other.listed());
    let Some((from, to)) = listed.map(|(from, to)| (&from.parameters, &to.parameters)) else {
        return Vec::new();
    };
    let values = &best.fit.theta[h.range_of(number)];
    let value = |name: &str| from.iter().position(|p| p.name == name).and_then(|i| values.get(i)).copied();
    to.iter().map(|p| value(&p.name)).collect::<Option<Vec<f64>>>().unwrap_or_default()
}

/// Fits the best set without each of its additions.
fn fit_parts(search: &Search<'_>, found: &mut Found) {
    let best = found.best();
    let parts: Vec<Scored> = (0..best.additions().len())
        .into_par_iter()
        .map(|number| without(best.additions(), number))
        .filter(|rest| found.with_key(&labels(rest)).is_none())
        .map(|rest| search.refit(&best.fit, &rest, &Vec::new()))
        .collect();
    found.tried.extend(parts.into_iter().filter(Scored::is_finite));
}

/// Additions without one of them, and without those that act through it.
pub(crate) fn without(additions: &[Addition], number: usize) -> Vec<Addition> {
    let gone = &additions[number];
    let stays = |(other, addition): &(usize, &Addition)| *other != number && !addition.acts_through(gone);
    additions.iter().enumerate().filter(stays).map(|(_, addition)| addition.clone()).collect()
}

impl Found {
    /// Evidence of a set without one of its additions, where that was fitted.
    pub fn evidence_without(&self, set: &Scored, number: usize) -> Option<&Evidence> {
        self.with_key(&labels(&without(set.additions(), number))).map(|s| &s.evidence)
    }

    /// Probability that chance alone moves each addition of a set as far from its null.
    pub fn chances(&self, set: &Scored) -> Vec<f64> {
        set.chances(&|number| self.evidence_without(set, number))
    }

    /// The part of a set of which every addition is significant among so many candidates: the least significant one leaves, and the rest is
    /// fitted again.
    pub fn significant(&mut self, search: &Search<'_>, from: usize) -> usize {
        let mut now = from;
        loop {
            let set = self.tried[now].clone();
            let chances = self.chances(&set);
            let excess = |n: &usize| chances[*n] / level(search, &set, *n);
            let worst = (0..chances.len()).max_by(|a, b| excess(a).total_cmp(&excess(b)));
            let Some(number) = worst.filter(|n| excess(n) > 1.0 || excess(n).is_nan()) else { return now };
            let rest = without(set.additions(), number);
            now = self.fitted(search, &set, &rest);
            // What is left is judged beside its own parts.
            let left = self.tried[now].clone();
            for number in 0..left.additions().len() {
                self.fitted(search, &left, &without(left.additions(), number));
            }
        }
    }

    /// Whether every addition of a set is significant.
    pub fn is_significant(&self, search: &Search<'_>, set: &Scored) -> bool {
        self.chances(set).iter().enumerate().all(|(n, p)| *p <= level(search, set, n))
    }

    /// The number of a set among what was tried; fitted from another where it was not.
    pub fn fitted(&mut self, search: &Search<'_>, from: &Scored, additions: &[Addition]) -> usize {
        let key = labels(additions);
        if let Some(known) = self.tried.iter().position(|s| s.key() == key) {
            return known;
        }
        self.tried.push(search.refit(&from.fit, additions, &Vec::new()));
        self.tried.len() - 1
    }
}

/// Probability below which an addition of a set is significant: as one of many candidates, unless its gain has paid for their number.
fn level(search: &Search<'_>, set: &Scored, number: usize) -> f64 {
    if set.is_judged_by_gain(number) { ALPHA } else { search.level(&set.additions()[number]) }
}
