//! Forward-backward search over sets of library effects.

use crate::addition::{Addition, labels};
use crate::calibrate::calibration_start;
use crate::candidates::{Family, library, may_join};
use crate::evaluate::{Lanes, rough_event_value};
use crate::fit::{Fit, Sample, fit, fit_nuisance};
use crate::free_runs::{FreeRuns, fit_whole};
use crate::hypothesis::Hypothesis;
pub(crate) use crate::judged::Judged;
use crate::judged::is_inert;
use crate::pairs::pairs;
use crate::scan::scan;
use crate::score::{Score, heterogeneity, scores};
use crate::sound::{best_sound, is_sound};
use crate::statistics::{chi2_quantile, chi2_tail};
use augsim_physics::model::Per;
use augsim_physics::system::{ScatterPer, Start, System};
use rayon::prelude::*;

/// Probability of a false step.
const ALPHA: f64 = 0.01;
/// Hypotheses kept from level to level.
const BEAM: usize = 3;
/// Most effects in a hypothesis.
pub(crate) const MOST_EFFECTS: usize = 4;
/// Largest rough offset of the events' parameter that a fit begins with, in units of the largest scatter.
const MOST_OF_AN_OFFSET: f64 = 0.6;
/// Thresholds that are fitted from where a scan puts them.
const MOST_SCANNED: usize = 3;
/// Pairs that are fitted at once, and the statistic of a pair in that of its better half from which on it is.
const MOST_PAIRS: usize = 3;
const WORTH_A_PAIR: f64 = 1.1;
/// Hypotheses within this of the best on the training part go on to the held-out part.
const POOL: f64 = 30.0;

/// Additions with the values that their parameters begin at (empty: a share of the typical size).
type Move = Vec<(Addition, Vec<f64>)>;

/// A search: its two samples, its library, and how many tests that amounts to.
pub(crate) struct Search<'a> {
    pub train: Sample<'a>,
    pub test: Sample<'a>,
    pub library: Vec<Addition>,
    /// How many tests the library amounts to: an effect with a width or a threshold is tested at several.
    tests: usize,
    /// Whether the parameter of the events may scatter.
    pub scatter: bool,
    /// Free runs over the held-out part.
    free_runs: Option<FreeRuns>,
}

/// Ratio of two scores from which on they are the same law in two forms.
const ALIAS: f64 = 1e-7;

/// Scores without those that repeat an earlier one to the last digits: the same law under a name that comes later in the
/// library (quadratic damping, and damping that depends on the speed).
fn without_aliases(scores: Vec<Score>) -> Vec<Score> {
    let mut out: Vec<Score> = Vec::new();
    for score in scores {
        let same = |other: &Score| {
            let near = (score.statistic / other.statistic - 1.0).abs() < ALIAS;
            near && score.rank == other.rank && score.addition.kind() != other.addition.kind()
        };
        if score.statistic <= 0.0 || !out.iter().any(same) {
            out.push(score);
        }
    }
    out
}

/// The end of a search.
pub(crate) struct Found {
    /// Judged on both parts, best total first; the base among them.
    pub pool: Vec<Judged>,
    /// Everything that was fitted, by increasing criterion.
    pub tried: Vec<Judged>,
    /// Scores of all library effects at the base fit.
    pub base_scores: Vec<Score>,
}

impl<'a> Search<'a> {
    pub fn new(train: Sample<'a>, test: Sample<'a>, family: Family) -> Self {
        let library = library(train.data, family);
        let system = &train.data.system;
        let points = |a: &Addition| match a {
            Addition::Effect(listed, _) => {
                system.null_points(listed.index).len() + system.scan_points(listed.index).len()
            }
            _ => 1,
        };
        let tests = library.iter().map(points).sum();
        let free_runs = FreeRuns::new(&test);
        Self { train, test, library, tests, scatter: true, free_runs }
    }

    fn system(&self) -> &dyn System {
        &*self.train.data.system
    }

    /// Index of the parameter of the events, where the system has events.
    fn event_parameter(&self) -> Option<usize> {
        self.system().schema().event.as_ref().map(|e| e.parameter)
    }

    /// Gain in -2 ln likelihood by an addition that chance alone exceeds with probability [`ALPHA`] over the library, where
    /// residuals are white.
    pub fn penalty(&self, addition: &Addition) -> f64 {
        let m = self.tests.max(1) as f64 + 2.0;
        match addition {
            Addition::Table(t) => chi2_quantile(ALPHA / 24.0, t.table.knots as f64) + 4.0,
            _ => chi2_quantile(ALPHA / m, self.size(addition)),
        }
    }

    /// Degrees of freedom of an addition.
    fn size(&self, addition: &Addition) -> f64 {
        match addition {
            Addition::Table(t) => t.table.knots as f64,
            Addition::Scatter(_) => 1.0,
            Addition::Effect(listed, per) => {
                let n = listed.effect.parameters.len() as f64;
                if *per == Per::Group { n * self.train.data.groups.len() as f64 } else { n }
            }
        }
    }

    /// Penalty of a set.
    pub fn penalty_of(&self, additions: &[Addition]) -> f64 {
        additions.iter().map(|a| self.penalty(a)).sum()
    }

    /// Judges a fit on the training part.
    pub fn judge(&self, fit: Fit) -> Judged {
        // Penalties in units of the dispersion of the records' gradients would keep the level where every model misses
        // something; but then the first of two effects that are both needed no longer pays.
        let penalty = self.penalty_of(&fit.hypothesis.additions);
        let free_run = self.free_runs.as_ref().map(|runs| runs.error(&fit));
        Judged { criterion: -2.0 * fit.ll + penalty, fit, heldout_ll: None, free_run }
    }

    /// Fits `from` with other additions, as warm as possible: parameters that both have keep their values.
    pub fn refit(&self, from: &Fit, additions: &[Addition], starts: &[(Addition, Vec<f64>)]) -> Judged {
        let h = Hypothesis::new(self.train.data, additions);
        let old = &from.hypothesis;
        let base = old.range_of_declared();
        let mut theta = h.theta_start(0.2);
        if h.scatter.map(|s| s.per) == old.scatter.map(|s| s.per) {
            theta[..base].copy_from_slice(&from.theta[..base]);
        } else {
            // A fit without scatter can sit far off when the scatter is large: the declared part begins anew as well.
            theta[..base].copy_from_slice(&calibration_start(&self.train, &h)[..base]);
        }
        for (number, addition) in additions.iter().enumerate() {
            let place = h.range_of(number);
            if let Some(k) = old.additions.iter().position(|a| a == addition) {
                theta[place].copy_from_slice(&from.theta[old.range_of(k)]);
            } else if let Some((_, values)) =
                starts.iter().find(|(a, v)| a == addition && v.len() == place.len())
            {
                let bounds = h.bounds();
                for (i, v) in place.zip(values) {
                    theta[i] = v.clamp(bounds[i].0, bounds[i].1);
                }
            }
        }
        let mut h = h;
        if let (Some(new), Some(known)) = (h.scatter.as_mut(), old.scatter)
            && new.per == known.per
        {
            new.sd = known.sd;
        }
        let nuisance = self.warm_nuisance(from, &h, &theta);
        self.judge(fit(&self.train, &h, &theta, &nuisance))
    }

    /// Nuisances of a fit for another hypothesis: offsets of the events' parameter are cut, or begin at its rough values.
    fn warm_nuisance(&self, from: &Fit, h: &Hypothesis, theta: &[f64]) -> Vec<Vec<f64>> {
        let same = from.hypothesis.scatter.map(|s| s.per) == h.scatter.map(|s| s.per);
        if same {
            return from.nuisance.clone();
        }
        let Some(event) = self.event_parameter() else { return from.nuisance.clone() };
        let place = h.entries_of(event);
        let bound = MOST_OF_AN_OFFSET * self.most_scatter();
        self.train
            .excerpts()
            .into_iter()
            .zip(&from.nuisance)
            .map(|(at, n)| {
                let record = at.record;
                // A fit without scatter bends the starts to make up for it: they begin anew.
                let plain = Lanes::new(h, at, &[]);
                let mut n = if h.scatter.is_some() { plain.nuisance_start(h, at) } else { n.clone() };
                n.truncate(plain.fixed_nuisances());
                let common = match &place {
                    None => h.values[event],
                    Some(p) => theta[p.start + if p.len() > 1 { record.seen.group } else { 0 }],
                };
                let rough = |r: f64| (r - common).clamp(-bound, bound);
                match h.scatter.map(|s| s.per) {
                    None => {}
                    Some(ScatterPer::Event) => n.extend(record.seen.events.iter().map(|e| rough(e.value))),
                    Some(ScatterPer::Record) if record.seen.events.is_empty() => {}
                    Some(ScatterPer::Record) => n.push(rough(rough_event_value(record))),
                }
                n
            })
            .collect()
    }

    fn plus(&self, from: &Fit, extra: &[(Addition, Vec<f64>)]) -> Judged {
        let mut additions = from.hypothesis.additions.clone();
        additions.extend(extra.iter().map(|(a, _)| a.clone()));
        self.refit(from, &additions, extra)
    }

    /// Largest standard deviation of the scatter of the events' parameter, in its unit.
    fn most_scatter(&self) -> f64 {
        let event = self.system().schema().event.as_ref();
        event.and_then(|e| e.scatter.parameters.first()).map_or(f64::INFINITY, |p| p.max)
    }

    /// The two ways in which the events' parameter may scatter; none for a system without events.
    fn scatters(&self) -> impl Iterator<Item = Addition> + '_ {
        let ways = [ScatterPer::Event, ScatterPer::Record];
        ways.into_iter().filter_map(|per| Addition::scatter(self.system(), per))
    }

    /// Whether the parameter of the events differs from record to record by more than noise.
    pub fn events_vary(&self, fit: &Fit, p: f64) -> bool {
        let Some(place) = self.event_parameter().and_then(|i| fit.hypothesis.entries_of(i)) else {
            return false;
        };
        let entries = &heterogeneity(&self.train, fit)[place];
        let (q, df) = entries.iter().fold((0.0, 0.0), |a, e| (a.0 + e.0.max(0.0), a.1 + e.1.max(0.0)));
        df > 0.0 && chi2_tail(q, df) < p
    }

    /// Candidates that may join a fit, with their scores.
    pub fn library_scores(&self, fit: &Fit) -> Vec<Score> {
        let list: Vec<Addition> =
            self.library.iter().filter(|a| may_join(a, &fit.hypothesis)).cloned().collect();
        without_aliases(scores(&self.train, fit, &list))
    }

    fn moves(&self, fit: &Fit, level: usize, best: bool) -> Vec<Move> {
        let mut list = self.library_scores(fit);
        list.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
        let (most, least) = if level == 1 { (9, 4.0) } else { (5, 6.0) };
        let mut both = Vec::new();
        if best && self.system().side_by_side() > 1 {
            // Where many derivatives come at the price of few, pairs are foretold as well.
            both = pairs(&self.train, fit, &list);
            let strongest = list.first().map_or(0.0, |s| s.statistic);
            both.retain(|p| p.statistic > strongest && p.statistic > WORTH_A_PAIR * p.alone + least);
        }
        let strong = list.first().map_or(0.0, |s| s.statistic);
        let mut moves: Vec<Move> = list
            .iter()
            .filter(|s| s.statistic > least)
            .take(most)
            .map(|s| {
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
        moves.extend(both.into_iter().take(MOST_PAIRS).map(|p| p.members));
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

    /// The search on the training part and the judgement on the held-out part. It begins at the best of `base` and of `known`,
    /// sets that another search came to.
    pub fn run(&self, base: Fit, known: &[Judged]) -> Found {
        let base_scores = self.library_scores(&base);
        let base = self.judge(base);
        let base_criterion = base.criterion;
        let mut tried = vec![base];
        tried.par_extend(known.par_iter().map(|j| self.refit(&j.fit, j.additions(), &[])));
        tried.retain(|j| j.additions().is_empty() || j.is_finite());
        let mut beam = self.foremost(&tried, &tried);
        for level in 1..=MOST_EFFECTS {
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
            let mut next = self.foremost(&fitted, &tried);
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
        self.refine(&mut tried);
        tried.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
        let best = best_sound(&tried).map_or(base_criterion, |j| j.criterion);
        let sound = tried.iter().filter(|j| j.criterion < best + POOL && is_sound(j, &tried));
        let mut pool: Vec<Judged> = sound.take(12).cloned().collect();
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

    /// The foremost of `list` by criterion, those first that are no worse in free runs than their parts among `tried`.
    fn foremost(&self, list: &[Judged], tried: &[Judged]) -> Vec<Judged> {
        let mut list: Vec<(bool, &Judged)> = list.iter().map(|j| (!is_sound(j, tried), j)).collect();
        list.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.criterion.total_cmp(&b.1.criterion)));
        list.into_iter().take(BEAM).map(|(_, j)| j.clone()).collect()
    }

    /// The held-out part at the parameters of a fit, nuisances fitted.
    pub fn heldout(&self, f: &Fit) -> Fit {
        fit_nuisance(&self.test, &f.hypothesis, &f.theta, &[])
    }

    /// A set with the parameters of a fit over whole recordings, where its free runs are better for it. Intervals stay those of
    /// windows.
    pub fn over_whole_recordings(&self, judged: &Judged) -> Option<Judged> {
        if self.free_runs.is_none() || judged.fit.theta.is_empty() {
            return None;
        }
        let again = self.judge(fit_whole(&self.train, &judged.fit));
        let better = again.is_finite() && again.free_run < judged.free_run;
        better.then(|| Judged { heldout_ll: Some(self.heldout(&again.fit).ll), ..again })
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
        for _ in 0..4 {
            let Some(best) = best_sound(tried).cloned() else { return };
            let now = best.additions().to_vec();
            if now.is_empty() {
                return;
            }
            let (mut sets, mut idle): (Vec<Move>, Vec<Move>) = (Vec::new(), Vec::new());
            for i in 0..now.len() {
                let mut rest = now.clone();
                let gone = rest.remove(i);
                let keep: Vec<_> = rest.iter().map(|a| (a.clone(), vec![])).collect();
                if rest.iter().any(|a| a.acts_through(&gone)) {
                    continue;
                }
                if now.len() > 1 && self.free_runs.is_some() && is_inert(&best.fit, i) {
                    idle.push(keep.clone());
                } else if now.len() > 1 {
                    sets.push(keep.clone());
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
                for s in list.into_iter().filter(|s| s.addition != gone && s.statistic > 6.0).take(4) {
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
                for s in list.into_iter().filter(|s| s.statistic > 6.0).take(3) {
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
            // A set without what does nothing is fitted from here even if it was fitted before, from a worse start.
            sets.extend(idle);
            let fitted: Vec<Judged> = sets
                .par_iter()
                .map(|set| {
                    let additions: Vec<Addition> = set.iter().map(|(a, _)| a.clone()).collect();
                    self.refit(&best.fit, &additions, set)
                })
                .filter(Judged::is_finite)
                .collect();
            let without = fitted.iter().any(|j| j.free_run < best.free_run);
            let improved = fitted.iter().any(|j| j.criterion < best.criterion - 1e-3);
            tried.extend(fitted);
            if !improved && !without {
                return;
            }
        }
    }
}
