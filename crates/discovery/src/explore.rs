//! Forward-backward search over sets of additions.

use crate::Progress;
use crate::addition::{Addition, labels};
use crate::candidates::{Family, may_join};
use crate::fit::{ChosenRecords, Fit, Reach, fit};
use crate::grammar::is_formula;
use crate::judged::{Judged, Memory};
use crate::pairs::pairs;
use crate::part::{part, searches_some_windows};
use crate::scan::scan;
use crate::scored::Score;
use crate::search::{MOST_EFFECTS, Search};
use crate::sound::{best_sound, is_sound};
use crate::structural::probe;
use augsim_physics::system::Start;
use rayon::prelude::*;
use std::sync::Arc;

/// How many hypotheses a search fits.
struct Effort {
    /// Hypotheses that it begins with, and that are kept from level to level.
    starts: usize,
    beam: usize,
    /// Additions tried at the calibrated model, and at each later one.
    first: usize,
    later: usize,
    /// Additions tried in the place of one that is dropped, and beside the best set.
    swaps: usize,
    adds: usize,
    /// Rounds of drops and swaps.
    rounds: usize,
}

impl Effort {
    /// Laws that were searched on some windows of long data, or before the noise was known, are looked over once more. Idealised laws
    /// are searched with what the dispersion lets through, which is less: a fit is some hundred windows.
    fn of(search: &Search<'_>) -> Self {
        let sample = &search.train;
        if search.goes_on || searches_some_windows(sample, search.family) {
            return Self { starts: 1, beam: 2, first: 6, later: 3, swaps: 2, adds: 2, rounds: 3 };
        }
        if sample.data.is_idealised() {
            return Self { starts: 1, beam: 2, first: 6, later: 4, swaps: 2, adds: 1, rounds: 3 };
        }
        Self { starts: 3, beam: 3, first: 9, later: 5, swaps: 4, adds: 3, rounds: 4 }
    }
}

/// Best scores that are fitted whatever their dispersion: that which a missing effect makes must not hide it.
const SURE: usize = 3;

/// Hypotheses within this of the best on the training part go on to the held-out part.
const POOL: f64 = 30.0;

/// Share of the best set's gain that a set may be behind it, to be gone on from.
const FAR_BEHIND: f64 = 0.3;
/// Fits of a level that are begun together; what they come to bounds those after them.
const HEAT: usize = 4;

/// Thresholds that are fitted from where a scan puts them.
const MOST_SCANNED: usize = 3;
/// Pairs that are fitted at once.
const MOST_PAIRS: usize = 3;
/// Ratio of a pair's statistic to that of its better half from which on the pair is fitted.
const WORTH_A_PAIR: f64 = 1.1;
/// Sets that a first search hands on.
const SEEDS: usize = 3;

/// Share of the misfit that the score of a formula has to explain for it to be fitted.
const WORTH_TRYING: f64 = 0.02;

/// Additions with the values that their parameters begin at (empty: a share of the typical size).
type Move = Vec<(Addition, Vec<f64>)>;

/// A set without one of its additions.
struct Without {
    gone: Addition,
    rest: Vec<Addition>,
    fit: Judged,
    /// Scores of what may join it, best first.
    list: Vec<Score>,
}

/// The end of a search.
#[derive(Clone)]
pub(crate) struct Explored {
    /// Judged on both parts, best total first; the base among them.
    pub pool: Vec<Judged>,
    /// Everything that was fitted, by increasing criterion.
    pub tried: Vec<Judged>,
    /// Scores of all library effects at the base fit.
    pub base_scores: Vec<Score>,
}

impl Search<'_> {
    /// The search on the training part and the judgement on the held-out part. It begins at the best of `base` and of `known`,
    /// sets that another search came to.
    pub fn run(&self, base: Fit, known: &[Judged], progress: &mut dyn FnMut(Progress)) -> Explored {
        let mut seeds: Vec<Judged> =
            known.par_iter().map(|j| self.refit(&j.fit, j.additions(), &[])).collect();
        seeds.extend(self.seeds(&base, known));
        let (mut tried, base_scores) = self.explore(base, seeds, progress);
        self.refine(&mut tried, progress);
        tried.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
        let reach = best_sound(&tried).map_or(f64::INFINITY, |best| best.criterion + POOL * best.unit);
        let sound = tried.iter().filter(|j| j.criterion < reach && is_sound(j, &tried));
        let mut pool: Vec<Judged> = sound.take(12).cloned().collect();
        for simple in pool.iter().map(|j| labels(&self.simplified(j.additions()).0)).collect::<Vec<_>>() {
            if !pool.iter().any(|j| labels(j.additions()) == simple) {
                pool.extend(tried.iter().find(|j| labels(j.additions()) == simple).cloned());
            }
        }
        if !pool.iter().any(|j| j.additions().is_empty()) {
            pool.extend(tried.iter().find(|j| j.additions().is_empty()).cloned());
        }
        let heldout: Vec<f64> = pool.par_iter().map(|j| self.heldout(j).ll).collect();
        for (j, ll) in pool.iter_mut().zip(heldout) {
            j.heldout_ll = Some(ll);
        }
        pool.sort_by(|a, b| a.total().total_cmp(&b.total()));
        Explored { pool, tried, base_scores }
    }

    /// The best sets of a search on a part of the data, which begins at `base` and at `known`, fitted to all; none where there is
    /// no such part.
    fn seeds(&self, base: &Fit, known: &[Judged]) -> Vec<Judged> {
        let Some((data, chosen)) = part(&self.train, self.family) else { return Vec::new() };
        let train = ChosenRecords { data: &data, chosen: &chosen, ..self.train };
        let search = Search {
            train,
            test: ChosenRecords { chosen: &[], ..self.test },
            library: self.library.clone(),
            family: self.family,
            tests: self.tests,
            ways: self.ways,
            free_runs: None,
            clock: self.clock.clone(),
            goes_on: !known.is_empty(),
        };
        let start = fit(&search.train, &base.hypothesis, &base.theta, &[]);
        let on_part = |j: &Judged| search.judge(fit(&search.train, &j.fit.hypothesis, &j.fit.theta, &[]));
        let (mut tried, _) = search.explore(start, known.par_iter().map(on_part).collect(), &mut |_| {});
        search.refine(&mut tried, &mut |_| {});
        tried.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
        let better: Vec<&Judged> =
            tried.iter().take_while(|j| !j.additions().is_empty()).take(SEEDS).collect();
        let fitted = better.into_par_iter().map(|j| {
            let Fit { hypothesis, theta, .. } = &j.fit;
            self.judge(fit(&self.train, hypothesis, theta, &[]))
        });
        fitted.collect()
    }

    /// Adds effects to the best sets so far, the calibrated model and `seeds`, until none pays. All that was fitted, and the
    /// scores of the calibrated model.
    fn explore(
        &self,
        base: Fit,
        seeds: Vec<Judged>,
        progress: &mut dyn FnMut(Progress),
    ) -> (Vec<Judged>, Vec<Score>) {
        let effort = Effort::of(self);
        let base = self.judge(base);
        let base_scores = self.library_scores(&base);
        let (base_criterion, base_cost) = (base.criterion, base.fit.cost);
        let mut tried = vec![base];
        tried.extend(seeds.into_iter().filter(Judged::is_finite));
        let mut beam = foremost(&tried, &tried, effort.starts);
        let is_one = effort.starts == 1;
        let first = if is_one { beam.iter().map(|j| j.additions().len()).sum::<usize>() + 1 } else { 1 };
        for level in first..=MOST_EFFECTS {
            let jobs: Vec<(usize, Move)> = beam
                .par_iter()
                .enumerate()
                .map(|(i, j)| self.moves(j, level, i == 0).into_iter().map(|m| (i, m)).collect::<Vec<_>>())
                .flatten_iter()
                .collect();
            let jobs = self.without_repeats(jobs, &beam, &tried);
            // The swaps at the end are one more level.
            let of_all = |done: f64| 1000.0 * ((level - 1) as f64 + done) / (MOST_EFFECTS + 1) as f64;
            let told = &mut |done: f64| progress(Progress::Searched(of_all(done) as u16));
            let mut fitted = self.clock.worked_off_in(HEAT, &jobs, told, |before, (i, m)| {
                self.plus(reach_of(before, base_cost), &beam[*i].fit, m)
            });
            fitted.retain(Judged::is_finite);
            let before = beam.iter().chain(&tried).map(|j| j.criterion).fold(f64::INFINITY, f64::min);
            tried.extend(fitted.iter().cloned());
            let mut next = foremost(&fitted, &tried, effort.beam);
            // A set far behind the best cannot be the core of a better one that the swaps below would not find as well.
            let (top, gain) =
                next.first().map_or((0.0, 0.0), |j| (j.criterion, base_criterion - j.criterion));
            next.retain(|j| j.criterion < top + POOL + FAR_BEHIND * gain);
            let improved = next.first().is_some_and(|j| j.criterion < before);
            if !improved {
                break;
            }
            beam = next;
        }
        (tried, base_scores)
    }

    fn moves(&self, from: &Judged, level: usize, best: bool) -> Vec<Move> {
        let fit = &from.fit;
        let mut list = self.library_scores(from);
        list.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
        let effort = Effort::of(self);
        let (most, least) = if level == 1 { (effort.first, 4.0) } else { (effort.later, 6.0) };
        let least = least + self.resolution();
        let mut both = Vec::new();
        if best && self.system().side_by_side() > 1 {
            // Where many derivatives come at the price of few, pairs are foretold as well.
            both = pairs(&self.train, fit, &list);
            let strongest = list.first().map_or(0.0, |s| s.statistic);
            let least = least.max(self.least_of_a_formula(from));
            both.retain(|p| p.statistic > strongest && p.statistic > WORTH_A_PAIR * p.alone + least);
        }
        list.retain(|score| self.is_promising(score, from));
        let strong = list.first().map_or(0.0, |s| s.statistic);
        let mut moves: Vec<Move> = list
            .iter()
            .filter(|s| s.statistic > least)
            .take(most)
            .enumerate()
            .filter(|(rank, s)| *rank < SURE || self.is_worth_fitting(s))
            .map(|(_, s)| {
                let start = match s.addition.listed().map(|effect| &effect.start) {
                    Some(Start::At(values)) => values.clone(),
                    Some(Start::Within(bounds)) => {
                        s.estimate.iter().zip(bounds).map(|(v, [low, high])| v.clamp(*low, *high)).collect()
                    }
                    _ => s.estimate.clone(),
                };
                vec![(s.addition.clone(), start)]
            })
            .collect();
        // No test forecasts these from afar: where the kind that foretells them promises much, they are fitted too.
        let promising: Vec<String> = moves.iter().flatten().map(|(a, _)| a.kind().to_string()).collect();
        for addition in &self.library {
            let foretold = addition.listed().and_then(|effect| effect.foretold_by.as_ref());
            let is_new = !promising.iter().any(|kind| kind == addition.kind());
            if foretold.is_some_and(|by| promising.contains(by))
                && is_new
                && may_join(addition, &fit.hypothesis)
            {
                moves.push(vec![(addition.clone(), addition.listed().map_or_else(Vec::new, probe))]);
            }
        }
        moves.extend(both.into_iter().take(MOST_PAIRS).map(|p| p.members));
        if best {
            let scanned = scan(&self.train, fit, &self.library).into_iter().filter(|s| s.gain > least);
            moves.extend(scanned.take(MOST_SCANNED).map(|s| vec![(s.addition, s.start)]));
        }
        let may_scatter = best && !self.ways.is_empty() && fit.hypothesis.scatter.is_none();
        if may_scatter && self.events_vary(fit, 1e-3) {
            moves.extend(self.scatters().map(|scatter| vec![(scatter, vec![])]));
        }
        for addition in self.library.iter().filter(|_| best && strong > 9.0) {
            let Some(join) = addition.listed().and_then(|effect| effect.joins.as_ref()) else { continue };
            let Some(first) = Addition::of_kind(self.system(), &join.kind) else { continue };
            if may_join(&first, &fit.hypothesis) {
                let both =
                    |own: &[f64]| vec![(first.clone(), join.start.clone()), (addition.clone(), own.to_vec())];
                moves.extend(join.own.iter().map(|own| both(own)));
            }
        }
        moves
    }

    /// Scores of what may join a fit, best first, without formulas that promise too little to be fitted.
    fn promising(&self, judged: &Judged) -> Vec<Score> {
        let mut list = self.library_scores(judged);
        list.retain(|score| self.is_promising(score, judged));
        list.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
        list
    }

    fn is_promising(&self, score: &Score, at: &Judged) -> bool {
        !is_formula(&score.addition) || score.statistic > self.least_of_a_formula(at)
    }

    /// Gain that a formula has to promise to be fitted; 0 where no formulas are looked for.
    fn least_of_a_formula(&self, at: &Judged) -> f64 {
        if self.family == Family::Grammar { WORTH_TRYING * at.fit.weighted_misfit() } else { 0.0 }
    }

    /// Whether a score, in units of its dispersion, promises half of what the addition must gain; without a dispersion every
    /// score does.
    fn is_worth_fitting(&self, score: &Score) -> bool {
        score.dispersion.is_none_or(|d| {
            let needed = self.resolution() / d.factor
                + d.widened(self.penalty(&score.addition), self.size(&score.addition));
            score.statistic / d.factor > 0.5 * needed
        })
    }

    /// Whether an addition is a threshold, which fits begin at several places for.
    fn is_scanned(&self, addition: &Addition) -> bool {
        matches!(addition, Addition::Effect(e, _) if !self.system().scan_points(e.index).is_empty())
    }

    fn without_repeats(
        &self,
        jobs: Vec<(usize, Move)>,
        beam: &[Judged],
        tried: &[Judged],
    ) -> Vec<(usize, Move)> {
        let mut seen: Vec<Vec<String>> = tried.iter().map(|j| labels(j.additions())).collect();
        jobs.into_iter()
            .filter(|(i, m)| {
                let mut all = beam[*i].additions().to_vec();
                all.extend(m.iter().map(|(a, _)| a.clone()));
                let mut key = labels(&all);
                // The two starts of a pair are different attempts, and so are those of a threshold.
                if let Some((_, start)) = m.get(1).or(m.first().filter(|(a, _)| self.is_scanned(a))) {
                    key.push(format!("{start:?}"));
                }
                let fresh = !seen.contains(&key) && all.len() <= MOST_EFFECTS;
                seen.push(key);
                fresh
            })
            .collect()
    }

    /// The best set without one of its additions, and what would take that one's place: the best scores at the fit without it.
    /// Nothing where another addition acts through it.
    fn without(&self, best: &Judged, number: usize, are_guessed: bool, tried: &[Judged]) -> Option<Without> {
        let mut rest = best.additions().to_vec();
        let gone = rest.remove(number);
        if rest.iter().any(|a| a.acts_through(&gone)) {
            return None;
        }
        let base = || tried.iter().find(|j| j.additions().is_empty()).cloned();
        let known = if rest.is_empty() && !are_guessed { base() } else { None };
        let fit = known.unwrap_or_else(|| self.refit(&best.fit, &rest, &[]));
        let list = self.promising(&fit);
        Some(Without { gone, rest, fit, list })
    }

    /// Drops, swaps and adds around the best until nothing is better.
    fn refine(&self, tried: &mut Vec<Judged>, progress: &mut dyn FnMut(Progress)) {
        let effort = Effort::of(self);
        let mut before: Option<Arc<Memory>> = None;
        for round in 0..effort.rounds {
            if self.clock.is_over() {
                return;
            }
            let Some(best) = best_sound(tried).cloned() else { return };
            // Around the same set a round would come to the same fits.
            if before.is_some_and(|before| Arc::ptr_eq(&before, &best.memory)) {
                return;
            }
            before = Some(best.memory.clone());
            let now = best.additions().to_vec();
            if now.is_empty() {
                return;
            }
            // Where starts are guessed a fit may be lost, and a set with one law more found better by that alone: what is left of
            // the best set counts as it is fitted from here, even if it was fitted before.
            let are_guessed = self.system().begins_from_first_samples();
            let mut parts: Vec<Judged> = Vec::new();
            let (mut sets, mut anew): (Vec<Move>, Vec<Move>) = (Vec::new(), Vec::new());
            let each: Vec<Option<Without>> =
                (0..now.len()).into_par_iter().map(|i| self.without(&best, i, are_guessed, tried)).collect();
            for (i, without) in each.into_iter().enumerate() {
                let Some(Without { gone, rest, fit: without, list }) = without else { continue };
                let keep: Vec<_> = rest.iter().map(|a| (a.clone(), vec![])).collect();
                if now.len() > 1 && self.free_runs.is_some() && best.fit.is_inert(i) {
                    anew.push(keep.clone());
                } else if now.len() > 1 {
                    sets.push(keep.clone());
                }
                if let Some(less) = self.contained(&gone).filter(|less| !rest.contains(less)) {
                    let start = if are_guessed { values_shared(&best.fit, i, &less) } else { Vec::new() };
                    let list = if start.is_empty() { &mut sets } else { &mut anew };
                    list.push([keep.clone(), vec![(less, start)]].concat());
                }
                if are_guessed && without.is_finite() {
                    parts.push(without);
                }
                let least = 6.0 + self.resolution();
                for s in list
                    .into_iter()
                    .filter(|s| s.addition != gone && s.statistic > least && self.is_worth_fitting(s))
                    .take(effort.swaps)
                {
                    let mut set = keep.clone();
                    set.push((s.addition, s.estimate));
                    sets.push(set);
                }
                if matches!(gone, Addition::Scatter(_)) {
                    for other in self.scatters().filter(|other| *other != gone) {
                        let mut set = keep.clone();
                        set.push((other, vec![]));
                        sets.push(set);
                    }
                }
            }
            if now.len() < MOST_EFFECTS {
                let list = self.promising(&best);
                let least = 6.0 + self.resolution();
                for s in list
                    .into_iter()
                    .filter(|s| s.statistic > least && self.is_worth_fitting(s))
                    .take(effort.adds)
                {
                    let mut set: Vec<_> = now.iter().map(|a| (a.clone(), vec![])).collect();
                    set.push((s.addition, s.estimate));
                    sets.push(set);
                }
            }
            let mut seen: Vec<Vec<String>> = tried.iter().map(|j| labels(j.additions())).collect();
            sets.retain(|set| {
                let key = labels(&set.iter().map(|(a, _)| a.clone()).collect::<Vec<_>>());
                let fresh = !seen.contains(&key);
                seen.push(key);
                fresh
            });
            // Sets without what does nothing, and with simpler laws, are fitted from here even if they were before, from a worse start.
            sets.extend(anew);
            let of_all = |done: f64| {
                let rounds = (round as f64 + done) / effort.rounds as f64;
                1000.0 * (MOST_EFFECTS as f64 + rounds) / (MOST_EFFECTS + 1) as f64
            };
            let told = &mut |done: f64| progress(Progress::Searched(of_all(done) as u16));
            let mut fitted = self.clock.worked_off(&sets, told, |set| {
                let additions: Vec<Addition> = set.iter().map(|(a, _)| a.clone()).collect();
                // Parts of the best set and its simpler forms are judged beside it, however far behind.
                let simpler: Vec<Addition> = now.iter().filter_map(|a| self.contained(a)).collect();
                let is_part = additions.iter().all(|a| now.contains(a) || simpler.contains(a));
                let reach = if is_part { Reach::ANY } else { reach_beside(&best) };
                self.refit_within(reach, &best.fit, &additions, set)
            });
            fitted.retain(Judged::is_finite);
            fitted.extend(parts);
            let without = fitted.iter().any(|j| j.free_run < best.free_run);
            let improved = fitted.iter().any(|j| j.criterion < best.criterion - 1e-3);
            tried.extend(fitted);
            if !improved && !without {
                return;
            }
        }
    }
}

/// The values in a fit of one of its additions for another whose parameters are among those of the first, by their names; empty
/// where they are not.
fn values_shared(fit: &Fit, number: usize, other: &Addition) -> Vec<f64> {
    let listed = fit.hypothesis.additions[number].listed().zip(other.listed());
    let Some((from, to)) = listed.map(|(from, to)| (&from.parameters, &to.parameters)) else {
        return Vec::new();
    };
    let values = &fit.theta[fit.hypothesis.range_of(number)];
    let value = |name: &str| from.iter().position(|p| p.name == name).and_then(|i| values.get(i)).copied();
    to.iter().map(|p| value(&p.name)).collect::<Option<Vec<f64>>>().unwrap_or_default()
}

/// The cost that the next fits of a level have to come down to, so that they are not far behind the best of those before: a set far
/// behind is kept for nothing. Costs beside a scatter leave out what it takes to draw its offsets, and bound nothing.
fn reach_of(before: &[Judged], base: f64) -> Reach {
    let plain = before.iter().filter(|j| j.fit.hypothesis.scatter.is_none());
    let best = plain.map(|j| j.fit.cost).fold(f64::INFINITY, f64::min);
    if best < base { Reach(best + POOL + FAR_BEHIND * (base - best)) } else { Reach::ANY }
}

/// The cost that a set has to come down to, to be looked at beside the best.
fn reach_beside(best: &Judged) -> Reach {
    if best.fit.hypothesis.scatter.is_some() { Reach::ANY } else { Reach(best.fit.cost + POOL * best.unit) }
}

/// The foremost of `list` by criterion, those first that are no worse in free runs than their parts among `tried`.
fn foremost(list: &[Judged], tried: &[Judged], most: usize) -> Vec<Judged> {
    let mut list: Vec<(bool, &Judged)> = list.iter().map(|j| (!is_sound(j, tried), j)).collect();
    list.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.criterion.total_cmp(&b.1.criterion)));
    list.into_iter().take(most).map(|(_, j)| j.clone()).collect()
}

/// The hypothesis with some of the additions of another, judged on both parts; fitted if it was not tried.
pub(crate) fn place_of(
    search: &Search<'_>,
    found: &mut Explored,
    from: &Judged,
    additions: &[Addition],
) -> Judged {
    let key = labels(additions);
    if let Some(judged) = found.pool.iter().find(|j| labels(j.additions()) == key) {
        return judged.clone();
    }
    let tried = found.tried.iter().find(|j| labels(j.additions()) == key).cloned();
    let mut judged = tried.unwrap_or_else(|| search.refit(&from.fit, additions, &[]));
    judged.heldout_ll = Some(search.heldout(&judged).ll);
    found.pool.push(judged.clone());
    judged
}
