//! The search loop: linearise at the best set, select in the linear problem, refit new sets, repeat; finally
//! fit the subsets of the best set.

use super::refit::{ALPHA, InitialValues, Penalty, Search};
use super::select::{LinearSet, select};
use crate::addition::{Addition, labels};
use crate::columns::{can_join, linearise};
use crate::fit::fit_nuisance;
use crate::linear_problem::{LinearProblem, probe};
use crate::score::{Evidence, Scored};
use rayon::prelude::*;

/// Maximum number of new sets per round that are refitted with one more effect than the best set, with and without
/// effects that depend on the past. In the first round all effects compete, and [`MAX_EQUAL_SETS`] more are refitted.
const MAX_LARGER_SETS: usize = 4;
/// Maximum number of new sets per round that are refitted with as many effects as the best set.
const MAX_EQUAL_SETS: usize = 4;
/// Maximum number of new sets per round that are refitted with any other number of effects.
const MAX_OTHER_SETS: usize = 3;
/// Maximum deficit of a set behind the present one in the linear problem for it to be refitted, nats (odds of
/// 100 to 1).
const MAX_DEFICIT: f64 = 4.6;
/// Number of sets of each class that are refitted even beyond [`MAX_DEFICIT`], because the linear problem is
/// approximate. The classes are one effect more than the best set, as many, and any other number, each with and
/// without effects that depend on the past.
const MIN_SETS_PER_CLASS: usize = 1;
/// Minimum improvement of a set for it to be refitted, as a share of the improvement of the best set.
const MIN_IMPROVEMENT_SHARE: f64 = 0.05;
/// Maximum number of search rounds. Each adds or exchanges an effect, and a set has at most five.
const MAX_ROUNDS: usize = 8;
/// Number of best sets among which the choice is repeated on cross-validation folds; the others are far behind.
const MAX_FOLD_SETS: usize = 8;
/// p-value of differences between records below which event offsets are fitted as a random effect. It only
/// saves fits, as the fit itself decides.
const MAX_P_EVENTS_VARY: f64 = 1e-3;

/// Result of a search: all fitted sets of effects, and the best one.
pub(crate) struct SearchResult {
    /// All fitted sets of effects; the first is the calibrated model without effects.
    pub sets: Vec<Scored>,
    /// Index of the set with the largest gain minus penalty.
    pub best: usize,
    pub penalty: Penalty,
}

impl SearchResult {
    /// A result that contains the calibrated model alone.
    pub fn calibrated_only(base: Scored, penalty: Penalty) -> Self {
        Self { sets: vec![base], best: 0, penalty }
    }

    pub fn base(&self) -> &Scored {
        &self.sets[0]
    }

    pub fn best(&self) -> &Scored {
        &self.sets[self.best]
    }

    /// The set with the largest gain minus penalty among those without effects that `is_left_out` selects.
    pub fn best_without(&self, is_left_out: &dyn Fn(&Addition) -> bool) -> &Scored {
        let remain = self.sets.iter().filter(|set| !set.additions().iter().any(is_left_out));
        let better = |best, set| if self.margin(set, best) > 0.0 { set } else { best };
        remain.fold(self.base(), better)
    }

    pub fn with_key(&self, key: &[String]) -> Option<&Scored> {
        self.sets.iter().find(|s| s.key() == key)
    }

    /// Gain of one set over another minus the difference of their penalties, nats. The independent share of
    /// the residuals is that of the set with more effects.
    pub fn margin(&self, one: &Scored, other: &Scored) -> f64 {
        let [a, b] = [one, other].map(|s| s.additions());
        let larger = if a.len() >= b.len() { one } else { other };
        one.gain_over(other, larger.evidence.independence.share) - self.penalty.of_set(a)
            + self.penalty.of_set(b)
    }
}

/// Searches for effects, starting from the calibrated model `base` and the already fitted sets `known`.
pub(crate) fn run(
    search: &Search<'_>,
    base: Scored,
    known: Vec<Scored>,
    report_share: &mut dyn FnMut(f64),
) -> SearchResult {
    let mut found = SearchResult::calibrated_only(base, search.penalty());
    found.sets.extend(known.into_iter().filter(Scored::is_finite));
    update_best_within_bounds(&mut found);
    for round in 0..MAX_ROUNDS {
        report_share(round as f64 / MAX_ROUNDS as f64);
        if search.clock.is_over() {
            break;
        }
        let previous_key = found.best().key();
        let candidates = sets_to_refit(search, &found);
        let from = found.best().fit.clone();
        // Fits that the deadline cut short are dropped: their gains are only lower bounds.
        let refit = |(additions, starts): &(Vec<Addition>, InitialValues)| {
            if search.clock.is_over() {
                return None;
            }
            Some(search.refit(&from, additions, starts)).filter(|_| !search.clock.is_over())
        };
        let fitted: Vec<Scored> = candidates.par_iter().filter_map(refit).collect();
        let has_new = !fitted.is_empty();
        found.sets.extend(fitted.into_iter().filter(Scored::is_finite));
        update_best_within_bounds(&mut found);
        if !has_new || found.best().key() == previous_key {
            break;
        }
    }
    update_best(&mut found);
    if !search.clock.is_over() {
        complete(search, &mut found);
    }
    found
}

/// Fits the subsets of the best set with one effect less, which its significance is judged by.
pub(crate) fn complete(search: &Search<'_>, found: &mut SearchResult) {
    fit_subsets(search, found);
    update_best(found);
}

/// Repeats the choice on other data: refits the best sets of a search there, warm-started, and selects among
/// them.
pub(crate) fn repeat_choice(search: &Search<'_>, base: Scored, known: &SearchResult) -> SearchResult {
    let mut order: Vec<usize> = (1..known.sets.len()).collect();
    let margin = |n: usize| known.margin(&known.sets[n], known.base());
    order.sort_by(|a, b| margin(*b).total_cmp(&margin(*a)).then(a.cmp(b)));
    let mut keys: Vec<Vec<String>> = Vec::new();
    order.retain(|n| {
        let key = known.sets[*n].key();
        let is_new = !key.is_empty() && !keys.contains(&key);
        keys.push(key);
        is_new
    });
    order.truncate(MAX_FOLD_SETS);
    let refit = |n: &usize| {
        let from = &known.sets[*n].fit;
        let starts = fit_nuisance(&search.sample(), &from.hypothesis, &from.theta, &[]);
        search.refit(&starts, &from.hypothesis.additions, &Vec::new())
    };
    let mut found = SearchResult::calibrated_only(base, search.penalty());
    let fitted: Vec<Scored> = order.par_iter().map(refit).collect();
    found.sets.extend(fitted.into_iter().filter(Scored::is_finite));
    update_best(&mut found);
    fit_subsets(search, &mut found);
    update_best(&mut found);
    found
}

/// Updates the best of all fitted sets. Because the independent share differs between sets, three sets may
/// each be better than the next; visited sets are not revisited.
fn update_best(found: &mut SearchResult) {
    update_best_among(found, &|_| true);
}

/// As [`update_best`], among the sets that leave all declared parameters within their bounds.
///
/// Effects that only imitate the missing one often drive declared parameters to their bounds; the search goes on from a
/// set that does not. The final choice is among all sets.
fn update_best_within_bounds(found: &mut SearchResult) {
    let is_within = |set: &Scored| set.fit.hypothesis.declared_parameter_at_bound(&set.fit.theta).is_none();
    if is_within(found.base()) { update_best_among(found, &is_within) } else { update_best(found) }
}

fn update_best_among(found: &mut SearchResult, is_allowed: &dyn Fn(&Scored) -> bool) {
    let mut visited = vec![found.best];
    loop {
        let is_better = |n: &usize| {
            let (one, best) = (&found.sets[*n], found.best());
            let same = one.key() == best.key();
            if same { one.fit.ll > best.fit.ll + 1e-6 } else { found.margin(one, best) > 0.0 }
        };
        let better: Vec<usize> = (0..found.sets.len())
            .filter(|n| !visited.contains(n) && is_allowed(&found.sets[*n]) && is_better(n))
            .collect();
        let margin = |n: &&usize| found.margin(&found.sets[**n], found.best());
        match better.iter().max_by(|a, b| margin(a).total_cmp(&margin(b))) {
            Some(n) if !is_cyclic(found, *n) => found.best = *n,
            _ => return,
        }
        visited.push(found.best);
    }
}

/// Whether the present best set is also at least as good as `next`, so that replacing it would lead to a cycle.
fn is_cyclic(found: &SearchResult, next: usize) -> bool {
    found.sets[next].key() != found.best().key() && found.margin(found.best(), &found.sets[next]) >= 0.0
}

/// Selects the new sets to refit in a round, each with initial values of its new additions.
fn sets_to_refit(search: &Search<'_>, found: &SearchResult) -> Vec<(Vec<Addition>, InitialValues)> {
    let best = found.best();
    let sample = search.sample();
    let problem = linearise(&sample, &search.view.blocks, best, &search.library);
    let chosen = select(&problem, found.penalty);
    let mut known_keys: Vec<Vec<String>> = found.sets.iter().map(Scored::key).collect();
    let mut out: Vec<(Vec<Addition>, InitialValues)> = Vec::new();
    let present = chosen.iter().find(|c| c.groups == problem.fitted).map_or(0.0, |c| c.value);
    let largest = chosen.first().map_or(0.0, |c| c.value);
    let threshold = (present - MAX_DEFICIT).max(present + MIN_IMPROVEMENT_SHARE * (largest - present));
    let selected = chosen.iter().map(|c| (c.value, set_of(&problem, best, c)));
    let others = sets_without_columns(search, best, &problem, &chosen);
    let size = best.additions().len();
    let larger = if size == 0 { MAX_LARGER_SETS + MAX_EQUAL_SETS } else { MAX_LARGER_SETS };
    // Sets with states of effects fit much, and would leave no room for laws of present values.
    let mut room = [[larger, MAX_EQUAL_SETS, MAX_OTHER_SETS]; 2];
    let mut tried = [[0; 3]; 2];
    let sets =
        selected.map(|(value, set)| (Some(value), set)).chain(others.into_iter().map(|set| (None, set)));
    for (value, (additions, starts)) in sets {
        let key = labels(&additions);
        let memory = usize::from(additions.iter().any(Addition::depends_on_past));
        let size_class = match additions.len() {
            n if n == size + 1 => 0,
            n if n == size => 1,
            _ => 2,
        };
        let (room, tried) = (&mut room[memory][size_class], &mut tried[memory][size_class]);
        let is_refused = value.is_some_and(|v| *room == 0 || v < threshold && *tried >= MIN_SETS_PER_CLASS);
        if known_keys.contains(&key) || is_refused {
            continue;
        }
        if value.is_some() {
            *room -= 1;
            *tried += 1;
        }
        known_keys.push(key);
        out.push((additions, starts));
    }
    out
}

/// Converts a set of the linear problem to additions, with initial values of the new ones. Additions without
/// columns (random effects, groupwise values) are kept.
fn set_of(problem: &LinearProblem, best: &Scored, chosen: &LinearSet) -> (Vec<Addition>, InitialValues) {
    let has_column = |a: &&Addition| problem.fitted.iter().any(|g| problem.groups[*g].addition == **a);
    let mut additions: Vec<Addition> = best.additions().iter().filter(|a| !has_column(a)).cloned().collect();
    let mut starts = InitialValues::new();
    let mut next = problem.declared.len();
    for g in &chosen.groups {
        let group = &problem.groups[*g];
        let coefficients = &chosen.coefficients[next..next + group.columns.len()];
        next += coefficients.len();
        additions.push(group.addition.clone());
        if !problem.fitted.contains(g) {
            starts.push((group.addition.clone(), group.start(coefficients)));
            starts.extend(problem.other_cycles(*g));
        }
    }
    (additions, starts)
}

/// Sets that the linear problem cannot evaluate, with initial values of their new additions. They contain
/// random effects, effects that act through another, effects that another promising effect indicates, or
/// simpler forms.
fn sets_without_columns(
    search: &Search<'_>,
    best: &Scored,
    problem: &LinearProblem,
    chosen: &[LinearSet],
) -> Vec<(Vec<Addition>, InitialValues)> {
    let present = best.additions().to_vec();
    let h = &best.fit.hypothesis;
    let extended = |new: InitialValues| {
        let additions = present.iter().cloned().chain(new.iter().map(|(a, _)| a.clone())).collect();
        (additions, new)
    };
    let mut out: Vec<(Vec<Addition>, InitialValues)> = Vec::new();
    if h.scatter.is_none() && search.do_events_vary(&best.fit, MAX_P_EVENTS_VARY) {
        out.extend(search.scatters().into_iter().map(|scatter| extended(vec![(scatter, Vec::new())])));
    }
    for (number, removed) in present.iter().enumerate() {
        let mut remaining = present.clone();
        remaining.remove(number);
        if let Some(simpler) = search.simpler_form(removed).filter(|simpler| !remaining.contains(simpler)) {
            let start = shared_values(best, number, &simpler);
            remaining.push(simpler.clone());
            out.push((remaining, vec![(simpler, start)]));
        } else if matches!(removed, Addition::Scatter(_)) {
            for other in search.scatters().into_iter().filter(|other| other != removed) {
                out.push(([&remaining[..], std::slice::from_ref(&other)].concat(), Vec::new()));
            }
        }
    }
    let groups = chosen.iter().take(MAX_LARGER_SETS).flat_map(|c| &c.groups);
    let promising: Vec<&str> = groups.map(|g| problem.groups[*g].addition.kind()).collect();
    for addition in search.library.iter() {
        let Some(effect) = addition.listed() else { continue };
        let is_indicated = effect.indicated_by.as_ref().is_some_and(|by| promising.contains(&by.as_str()));
        if is_indicated && !promising.contains(&addition.kind()) && can_join(addition, h) {
            out.push(extended(vec![(addition.clone(), probe(effect))]));
        }
        if let Some(join) = effect.joins.as_ref().filter(|_| !promising.is_empty())
            && let Some(first) = Addition::with_kind(search.system(), &join.kind)
            && can_join(&first, h)
        {
            let both = |own: &Vec<f64>| {
                vec![(first.clone(), join.carrier_start.clone()), (addition.clone(), own.clone())]
            };
            out.extend(join.effect_starts.iter().map(|own| extended(both(own))));
        }
    }
    out
}

/// Fitted values of addition number `number` for another addition that has a subset of its parameters. They
/// are matched by name; empty where a name is missing.
fn shared_values(best: &Scored, number: usize, other: &Addition) -> Vec<f64> {
    let h = &best.fit.hypothesis;
    let listed = h.additions[number].listed().zip(other.listed());
    let Some((from, to)) = listed.map(|(from, to)| (&from.parameters, &to.parameters)) else {
        return Vec::new();
    };
    let values = &best.fit.theta[h.entries_of_addition(number)];
    let value = |name: &str| from.iter().position(|p| p.name == name).and_then(|i| values.get(i)).copied();
    to.iter().map(|p| value(&p.name)).collect::<Option<Vec<f64>>>().unwrap_or_default()
}

/// Fits the best set without each of its additions, unless that subset was fitted before.
fn fit_subsets(search: &Search<'_>, found: &mut SearchResult) {
    let best = found.best();
    let subsets: Vec<Scored> = (0..best.additions().len())
        .into_par_iter()
        .map(|number| without(best.additions(), number))
        .filter(|subset| found.with_key(&labels(subset)).is_none())
        .map(|subset| search.refit(&best.fit, &subset, &Vec::new()))
        .collect();
    found.sets.extend(subsets.into_iter().filter(Scored::is_finite));
}

/// The additions without the one with this number, and without those that act through it.
pub(crate) fn without(additions: &[Addition], number: usize) -> Vec<Addition> {
    let removed = &additions[number];
    let remains =
        |(other, addition): &(usize, &Addition)| *other != number && !addition.acts_through(removed);
    additions.iter().enumerate().filter(remains).map(|(_, addition)| addition.clone()).collect()
}

impl SearchResult {
    /// Block information of the fit of a set without its addition number `number`; `None` if that subset was
    /// not fitted.
    pub fn evidence_without(&self, set: &Scored, number: usize) -> Option<&Evidence> {
        self.with_key(&labels(&without(set.additions(), number))).map(|s| &s.evidence)
    }

    /// p-value of each addition of a set, from the fitted subsets.
    pub fn p_values(&self, set: &Scored) -> Vec<f64> {
        set.p_values(&|number| self.evidence_without(set, number))
    }

    /// Drops the least significant addition of the set with index `from` and refits, until all additions are
    /// significant. Returns the index of the remaining set.
    pub fn drop_insignificant(&mut self, search: &Search<'_>, from: usize) -> usize {
        self.drop_insignificant_among(search, from, &|_| true)
    }

    /// As [`drop_insignificant`](Self::drop_insignificant), but only for additions that `is_tested` selects;
    /// the others stay.
    pub fn drop_insignificant_among(
        &mut self,
        search: &Search<'_>,
        from: usize,
        is_tested: &dyn Fn(&Addition) -> bool,
    ) -> usize {
        let mut current = from;
        loop {
            let set = self.sets[current].clone();
            let p_values = self.p_values(&set);
            let excess = |n: &usize| p_values[*n] / self.significance_level(search, &set, *n);
            let tested = (0..p_values.len()).filter(|n| is_tested(&set.additions()[*n]));
            let worst = tested.max_by(|a, b| excess(a).total_cmp(&excess(b)));
            let Some(number) = worst.filter(|n| excess(n) > 1.0 || excess(n).is_nan()) else {
                return current;
            };
            let remaining = without(set.additions(), number);
            current = self.index_or_fit(search, &set, &remaining);
            // The p-values of the remaining set need fits of its own subsets.
            let remaining_set = self.sets[current].clone();
            for number in 0..remaining_set.additions().len() {
                self.index_or_fit(search, &remaining_set, &without(remaining_set.additions(), number));
            }
        }
    }

    /// Whether every addition of a set is significant.
    pub fn is_significant(&self, search: &Search<'_>, set: &Scored) -> bool {
        self.p_values(set).iter().enumerate().all(|(n, p)| *p <= self.significance_level(search, set, n))
    }

    /// Level at which an addition of a set must be significant. It is corrected for the number of candidates,
    /// unless the gain of the addition has exceeded a penalty that accounts for it.
    /// So it has for an addition with states whose gain over blocks is significant, corrected for the number of candidates
    /// with states.
    fn significance_level(&self, search: &Search<'_>, set: &Scored, number: usize) -> f64 {
        let corrected = || ALPHA / search.library.iter().filter(|a| a.has_states()).count().max(1) as f64;
        let gains_in_blocks =
            |less: &Evidence| set.has_states(number) && set.evidence.p_value_of_gain(less) <= corrected();
        if set.is_judged_by_gain(number) || self.evidence_without(set, number).is_some_and(gains_in_blocks) {
            ALPHA
        } else {
            search.level(&set.additions()[number])
        }
    }

    /// Fits the set `remaining` with each of the additions `others` that gain most in the linear problem, unless the set was
    /// fitted before; then the subsets of the best set.
    pub fn fit_exchanges(
        &mut self,
        search: &Search<'_>,
        from: &Scored,
        remaining: &[Addition],
        others: &[Addition],
    ) {
        let number = self.index_or_fit(search, from, remaining);
        let base = self.sets[number].clone();
        let problem = linearise(&search.sample(), &search.view.blocks, &base, others);
        let adds_one = |chosen: &&LinearSet| {
            chosen.groups.len() == problem.fitted.len() + 1
                && problem.fitted.iter().all(|g| chosen.groups.contains(g))
        };
        let chosen = select(&problem, self.penalty);
        let sets = chosen.iter().filter(adds_one).map(|chosen| set_of(&problem, &base, chosen));
        let new: Vec<_> = sets.filter(|(set, _)| self.with_key(&labels(set)).is_none()).collect();
        let fitted: Vec<Scored> =
            new.par_iter().map(|(set, starts)| search.refit(&base.fit, set, starts)).collect();
        self.sets.extend(fitted.into_iter().filter(Scored::is_finite));
        complete(search, self);
    }

    /// Index of the set with these additions among the fitted ones. Fits it, starting from `from`, if it is
    /// new.
    pub fn index_or_fit(&mut self, search: &Search<'_>, from: &Scored, additions: &[Addition]) -> usize {
        let key = labels(additions);
        if let Some(known) = self.sets.iter().position(|s| s.key() == key) {
            return known;
        }
        self.sets.push(search.refit(&from.fit, additions, &Vec::new()));
        self.sets.len() - 1
    }
}
