//! Forward-backward search over sets of additions.

use crate::addition::{Addition, labels};
use crate::candidates::may_join;
use crate::fit::{Fit, Sample, fit};
use crate::scan::scan;
use crate::score::Score;
use crate::search::{Judged, MOST_EFFECTS, Search};
use crate::structural::probe;
use augsim_physics::system::Start;
use rayon::prelude::*;

/// How many hypotheses a search fits.
struct Effort {
    /// Hypotheses kept from level to level.
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
    /// Idealised laws are searched with what the dispersion lets through, which is less: a fit is some hundred windows.
    fn of(sample: &Sample<'_>) -> Self {
        if sample.data.is_idealised() {
            return Self { beam: 2, first: 6, later: 4, swaps: 2, adds: 1, rounds: 3 };
        }
        Self { beam: 3, first: 9, later: 5, swaps: 4, adds: 3, rounds: 4 }
    }
}

/// Best scores that are fitted whatever their dispersion: that which a missing effect makes must not hide it.
const SURE: usize = 3;

/// Hypotheses within this of the best on the training part go on to the held-out part.
const POOL: f64 = 30.0;

/// Thresholds that are fitted from where a scan puts them.
const MOST_SCANNED: usize = 3;
/// Records of a first search, at least, and windows of all from which on there is one.
const FEW: usize = 30;
const MANY_WINDOWS: usize = 200;
/// Sets that a first search hands on.
const SEEDS: usize = 3;

/// Additions with the values that their parameters begin at (empty: a share of the typical size).
type Move = Vec<(Addition, Vec<f64>)>;

/// What a search ends with.
pub(crate) struct Found {
    /// Judged on both parts, best total first; the base among them.
    pub pool: Vec<Judged>,
    /// Everything that was fitted, by increasing criterion.
    pub tried: Vec<Judged>,
    /// Scores of all library effects at the base fit.
    pub base_scores: Vec<Score>,
}

impl Search<'_> {
    /// The search on the training part and the judgement on the held-out part.
    pub fn run(&self, base: Fit) -> Found {
        let seeds = self.seeds(&base);
        let (mut tried, base_scores) = self.explore(base, seeds);
        self.refine(&mut tried);
        tried.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
        let best = tried[0].criterion;
        let mut pool: Vec<Judged> =
            tried.iter().filter(|j| j.criterion < best + POOL * tried[0].unit).take(12).cloned().collect();
        for simple in pool.iter().map(|j| labels(&self.simplified(j.additions()).0)).collect::<Vec<_>>() {
            if !pool.iter().any(|j| labels(j.additions()) == simple) {
                pool.extend(tried.iter().find(|j| labels(j.additions()) == simple).cloned());
            }
        }
        if !pool.iter().any(|j| j.additions().is_empty()) {
            pool.extend(tried.iter().find(|j| j.additions().is_empty()).cloned());
        }
        let heldout: Vec<f64> = pool.par_iter().map(|j| self.heldout(&j.fit).ll).collect();
        for (j, ll) in pool.iter_mut().zip(heldout) {
            j.heldout_ll = Some(ll);
        }
        pool.sort_by(|a, b| a.total().total_cmp(&b.total()));
        Found { pool, tried, base_scores }
    }

    /// The best sets of a search on some of the records, fitted to all: such a search finds what is large at a fraction of the
    /// cost. None where the windows are not many.
    fn seeds(&self, base: &Fit) -> Vec<Judged> {
        let stride = self.train.chosen.len() / FEW;
        if stride < 2 || self.train.excerpts().len() < MANY_WINDOWS {
            return Vec::new();
        }
        let few: Vec<usize> = self.train.chosen.iter().copied().step_by(stride).collect();
        let search = Search {
            train: Sample { chosen: &few, ..self.train },
            test: Sample { chosen: &[], ..self.test },
            library: self.library.clone(),
            tests: self.tests,
            scatter: self.scatter,
        };
        let (mut tried, _) =
            search.explore(fit(&search.train, &base.hypothesis, &base.theta, &[]), Vec::new());
        search.refine(&mut tried);
        tried.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
        let better: Vec<&Judged> =
            tried.iter().take_while(|j| !j.additions().is_empty()).take(SEEDS).collect();
        let fitted = better.into_par_iter().map(|j| {
            let Fit { hypothesis, theta, .. } = &j.fit;
            self.judge(fit(&self.train, hypothesis, theta, &[]))
        });
        fitted.filter(Judged::is_finite).collect()
    }

    /// Adds effects to the best sets so far, the calibrated model and `seeds`, until none pays. All that was fitted, and the
    /// scores of the calibrated model.
    fn explore(&self, base: Fit, seeds: Vec<Judged>) -> (Vec<Judged>, Vec<Score>) {
        let effort = Effort::of(&self.train);
        let base_scores = self.library_scores(&base);
        let base = self.judge(base);
        let base_criterion = base.criterion;
        let mut tried = vec![base];
        tried.extend(seeds);
        let best = tried.iter().min_by(|a, b| a.criterion.total_cmp(&b.criterion)).cloned();
        let mut beam: Vec<Judged> = best.into_iter().collect();
        let first = beam.iter().map(|j| j.additions().len()).sum::<usize>() + 1;
        for level in first..=MOST_EFFECTS {
            let jobs: Vec<(usize, Move)> = beam
                .par_iter()
                .enumerate()
                .map(|(i, j)| {
                    self.moves(&j.fit, level, i == 0).into_iter().map(|m| (i, m)).collect::<Vec<_>>()
                })
                .flatten_iter()
                .collect();
            let jobs = self.without_repeats(jobs, &beam, &tried);
            let fitted = jobs.par_iter().map(|(i, m)| self.plus(&beam[*i].fit, m));
            let fitted: Vec<Judged> = fitted.filter(Judged::is_finite).collect();
            let before = beam.iter().chain(&tried).map(|j| j.criterion).fold(f64::INFINITY, f64::min);
            tried.extend(fitted.iter().cloned());
            let mut next = fitted;
            next.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
            next.truncate(effort.beam);
            // A set far behind the best cannot be the core of a better one that the swaps below would not find as well.
            let (top, gain) =
                next.first().map_or((0.0, 0.0), |j| (j.criterion, base_criterion - j.criterion));
            next.retain(|j| j.criterion < top + POOL + 0.3 * gain);
            let improved = next.first().is_some_and(|j| j.criterion < before);
            if !improved {
                break;
            }
            beam = next;
        }
        (tried, base_scores)
    }

    fn moves(&self, fit: &Fit, level: usize, best: bool) -> Vec<Move> {
        let mut list = self.library_scores(fit);
        list.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
        let effort = Effort::of(&self.train);
        let (most, least) = if level == 1 { (effort.first, 4.0) } else { (effort.later, 6.0) };
        let least = least + self.resolution();
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
        if best {
            let scanned = scan(&self.train, fit, &self.library).into_iter().filter(|s| s.gain > least);
            moves.extend(scanned.take(MOST_SCANNED).map(|s| vec![(s.addition, s.start)]));
        }
        if self.scatter && best && fit.hypothesis.scatter.is_none() && self.events_vary(fit, 1e-3) {
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

    /// Drops, swaps and adds around the best until nothing is better.
    fn refine(&self, tried: &mut Vec<Judged>) {
        let effort = Effort::of(&self.train);
        for _ in 0..effort.rounds {
            let Some(best) = tried.iter().min_by(|a, b| a.criterion.total_cmp(&b.criterion)).cloned() else {
                return;
            };
            let now = best.additions().to_vec();
            if now.is_empty() {
                return;
            }
            let mut sets: Vec<Move> = Vec::new();
            for i in 0..now.len() {
                let mut rest = now.clone();
                let gone = rest.remove(i);
                let keep: Vec<_> = rest.iter().map(|a| (a.clone(), vec![])).collect();
                if rest.iter().any(|a| a.acts_through(&gone)) {
                    continue;
                }
                if now.len() > 1 {
                    sets.push(keep.clone());
                }
                if let Some(less) = self.contained(&gone) {
                    let mut set = keep.clone();
                    set.push((less, vec![]));
                    sets.push(set);
                }
                // What would take its place: the best scores at the fit without it.
                let without = if rest.is_empty() {
                    tried.iter().find(|j| j.additions().is_empty()).cloned()
                } else {
                    None
                };
                let without = without.unwrap_or_else(|| self.refit(&best.fit, &rest, &[]));
                let mut list = self.library_scores(&without.fit);
                list.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
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
                let mut list = self.library_scores(&best.fit);
                list.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
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
            let fitted: Vec<Judged> = sets
                .par_iter()
                .map(|set| {
                    let additions: Vec<Addition> = set.iter().map(|(a, _)| a.clone()).collect();
                    self.refit(&best.fit, &additions, set)
                })
                .filter(Judged::is_finite)
                .collect();
            let improved = fitted.iter().any(|j| j.criterion < best.criterion - 1e-3);
            tried.extend(fitted);
            if !improved {
                return;
            }
        }
    }
}
