//! Forward-backward search over sets of effects.

use super::fit::{BEND, Fit, Sample, fit, fit_starts};
use super::hypothesis::{Hypothesis, kind_per_group, probe, size_of};
use super::score::{Score, scores};
use crate::confirmation::holds;
use crate::statistics::{chi2_quantile, median, quantile};
use augsim_physics::effects::Needs;
use augsim_physics::model::{Per, PushModel};
use augsim_physics::push::effects::{all, spec_of};
use rayon::prelude::*;

/// Probability of a false step.
const ALPHA: f64 = 0.01;
/// Hypotheses kept from level to level.
const BEAM: usize = 2;
/// Most effects in a hypothesis.
const MOST_EFFECTS: usize = 4;
/// Best scores that are fitted whatever the dispersion.
const SURE: usize = 3;
/// Sets that a search on fewer pushes hands on.
const SEEDS: usize = 3;
/// Root mean square displacement that is no effect, in units of the noise of a pose: no forecast would be better by it, and the
/// first moments by which laws are approximated leave as much. At least, m: rods, outlines and integrators are not better.
const RESOLUTION: f64 = 0.1;
const RESOLUTION_M: f64 = 1e-5;
/// Hypotheses within this of the best on the training part go on to the held-out part.
const POOL: f64 = 30.0;
/// Most groups for which a parameter may have a value each: beyond, that is a description, not a law.
const MOST_GROUPS: usize = 20;

/// A fitted hypothesis.
#[derive(Clone, Debug)]
pub(crate) struct Judged {
    pub fit: Fit,
    /// Penalty on the cost, and what one unit of it is: the dispersion of what was added.
    pub penalty: f64,
    pub unit: f64,
    /// No kind whose 95 % region holds its null.
    pub clear: bool,
    /// The held-out windows at its parameters.
    pub held: Option<Fit>,
}

impl Judged {
    pub fn kinds(&self) -> &[&'static str] {
        &self.fit.hypothesis.kinds
    }
}

/// A search with what it has found so far.
#[derive(Clone)]
pub(crate) struct Search<'a> {
    pub model: &'a PushModel,
    pub train: Sample<'a>,
    pub test: Sample<'a>,
    /// Kinds that may be added.
    pub library: Vec<&'static str>,
    /// Everything that was fitted, the calibrated model first.
    pub tried: Vec<Judged>,
    /// Scores at the calibrated model.
    pub base_scores: Vec<Score>,
    /// The answer, where pushes scatter: not what is best by windows.
    answer: Option<usize>,
    /// Kinds that pay by windows but not by pushes.
    chance: Vec<&'static str>,
}

impl<'a> Search<'a> {
    /// Calibrates, from the nominal values or those of a search on fewer pushes.
    pub fn new(
        model: &'a PushModel,
        mut train: Sample<'a>,
        mut test: Sample<'a>,
        from: Option<&Search<'_>>,
    ) -> Self {
        let library = library(model, &train);
        let h = Hypothesis::new(model, &train.data.groups, &[]);
        let theta = from.map_or_else(|| h.start(), |s| s.base().fit.theta.clone());
        let nominal = fit_starts(&train, &h, &theta);
        train.bend = bend(&nominal);
        let mut base = fit(&train, &h, &nominal.theta, &nominal.starts);
        train.bend = bend(&base);
        base = fit(&train, &h, &base.theta, &base.starts);
        train.bend = bend(&base);
        test.bend = train.bend;
        let mut search = Self {
            model,
            train,
            test,
            library,
            tried: Vec::new(),
            base_scores: Vec::new(),
            answer: None,
            chance: Vec::new(),
        };
        search.tried.push(search.judged(base));
        if let Some(from) = from {
            search.sow(from);
        }
        search
    }

    /// Fits what a search on fewer pushes liked.
    fn sow(&mut self, from: &Search<'_>) {
        let order = from.ranked();
        let better = order.iter().take_while(|&&i| i != 0).take(SEEDS);
        let fitted: Vec<Judged> = better
            .map(|&i| {
                let f = &from.tried[i].fit;
                self.judged(fit(&self.train, &f.hypothesis, &f.theta, &[]))
            })
            .collect();
        self.tried.extend(fitted);
        self.rescale();
    }

    /// The gain that an effect has which moves the poses by no more than the models are good to: none that would be found
    /// is below it.
    pub fn resolution(&self) -> f64 {
        let samples: usize = self.train.windows.iter().map(|w| w.last - w.first + 1).sum();
        samples as f64 * RESOLUTION.max(RESOLUTION_M / self.train.data.noise.sd[0]).powi(2)
    }

    /// What the kinds of the library that a fit lacks promise, best first.
    pub fn scores(&self, from: &Fit) -> Vec<Score> {
        scores(self.model, &self.train, &self.library, from)
    }

    /// Degrees of freedom of a kind.
    pub fn size(&self, kind: &str) -> usize {
        size_of(kind, self.train.data.groups.len())
    }

    pub fn base(&self) -> &Judged {
        &self.tried[0]
    }

    /// A fit with its penalty: for each kind the quantile at which chance alone would let one of the library in, in units of
    /// the dispersion that its own parameters have (so that the sum is Takeuchi's criterion with another weight: TIC; Varin and
    /// Vidoni 2005 for composite likelihoods), and what an effect gains that is below the resolution.
    pub fn judged(&self, fit: Fit) -> Judged {
        let (mut penalty, mut units) = (0.0, Vec::new());
        for kind in &fit.hypothesis.kinds {
            let own = fit.dispersion_of(&self.train, kind);
            penalty +=
                self.resolution() + own.factor * own.widened(self.quantile(kind), self.size(kind) as f64);
            units.push(own.factor);
        }
        let unit = match units.len() {
            0 => fit.dispersion(&self.train).factor,
            n => units.iter().sum::<f64>() / n as f64,
        };
        let clear = fit.clear(&self.train);
        Judged { fit, penalty, unit, clear, held: None }
    }

    /// What the gain by one kind under chance alone exceeds with probability [`ALPHA`] over the library, in units of its
    /// dispersion.
    pub fn quantile(&self, kind: &str) -> f64 {
        chi2_quantile(ALPHA / self.library.len().max(1) as f64, self.size(kind) as f64)
    }

    /// What a score must promise, in units of its dispersion.
    pub fn penalty(&self, s: &Score) -> f64 {
        self.resolution() / s.dispersion.factor
            + s.dispersion.widened(self.quantile(s.kind), self.size(s.kind) as f64)
    }

    pub fn criterion(&self, j: &Judged) -> f64 {
        j.fit.cost(&self.train) + j.penalty
    }

    /// By how much the calibrated model is worse than another, on the training part, in units of the other.
    pub fn lead(&self, j: &Judged) -> f64 {
        (self.criterion(self.base()) - self.criterion(j)) / j.unit
    }

    /// Gain in ln likelihood on the held-out part.
    pub fn heldout_gain(&self, j: &Judged) -> Option<f64> {
        let cost = |j: &Judged| j.held.as_ref().map(|f| f.cost(&self.test));
        cost(self.base()).zip(cost(j)).map(|(base, own)| 0.5 * (base - own) / j.unit)
    }

    /// Criterion and held-out part together.
    pub fn total(&self, j: &Judged) -> f64 {
        let held = j.held.as_ref().map_or(f64::INFINITY, |f| f.cost(&self.test));
        self.criterion(j) + held
    }

    /// Fits a set of kinds, parameters as another fit has them or as given for one kind.
    pub fn refit(&self, from: &Fit, kinds: &[&'static str], theta: Option<&[f64]>) -> Judged {
        let groups = &self.train.data.groups;
        let h = Hypothesis::new(self.model, groups, kinds);
        let mut start = h.start();
        if let Some(theta) = theta.filter(|t| t.len() == start.len()) {
            start.copy_from_slice(theta);
        } else {
            let declared = self.base().fit.theta.len();
            start[..declared].copy_from_slice(&from.theta[..declared]);
            for kind in kinds {
                let (to, of) = (h.range_of(kind), from.hypothesis.range_of(kind));
                if to.len() == of.len() {
                    start[to].copy_from_slice(&from.theta[of]);
                } else {
                    let first = probe(kind, groups.len());
                    start[to].copy_from_slice(&first);
                }
            }
        }
        self.judged(fit(&self.train, &h, &start, &from.starts))
    }

    /// The fit of a set, if it was tried.
    pub fn fitted(&self, kinds: &[&str]) -> Option<&Judged> {
        self.position(kinds).map(|i| &self.tried[i])
    }

    fn position(&self, kinds: &[&str]) -> Option<usize> {
        self.tried.iter().position(|j| same(j.kinds(), kinds))
    }

    fn known(&self, kinds: &[&str]) -> bool {
        self.position(kinds).is_some()
    }

    /// Kinds that were fitted beside the best set and did not pay.
    pub fn rejected(&self, best: usize) -> Vec<&'static str> {
        let now = self.tried[best].kinds();
        self.library
            .iter()
            .copied()
            .filter(|kind| {
                let mut with = now.to_vec();
                with.push(kind);
                self.known(&with) || self.chance.contains(kind)
            })
            .collect()
    }

    fn ranked(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.tried.len()).collect();
        let criteria: Vec<f64> = self.tried.iter().map(|j| self.criterion(j)).collect();
        order.sort_by(|&a, &b| criteria[a].total_cmp(&criteria[b]));
        order
    }

    /// From where costs are bent, by the closest fit so far, as of quasi-likelihood (Burnham and Anderson 2002): what it explains
    /// is no scatter.
    fn rescale(&mut self) {
        let cost = |j: &Judged| j.fit.cost(&self.train);
        let closest = self.tried.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
        let Some(Judged { fit, .. }) = closest.cloned() else { return };
        let fit = &fit;
        self.train.bend = self.train.bend.min(bend(fit));
        self.test.bend = self.train.bend;
        let tried = std::mem::take(&mut self.tried);
        self.tried = tried.into_iter().map(|j| Judged { held: j.held, ..self.judged(j.fit) }).collect();
    }

    /// From here on the pushes, not their windows, are what is independent, and the answer has the kinds `kept` of the best.
    pub fn by_push(&mut self, kept: &[&'static str]) {
        let best = self.best();
        let now = self.tried[best].kinds().to_vec();
        let answer = self.place_of(kept, best);
        (self.train.by_push, self.test.by_push) = (true, true);
        let tried = std::mem::take(&mut self.tried);
        self.tried = tried.into_iter().map(|j| Judged { held: j.held, ..self.judged(j.fit) }).collect();
        self.answer = Some(if self.confirmed(answer) { answer } else { 0 });
        self.chance = now.into_iter().filter(|k| !kept.contains(k)).collect();
        // What only chance speaks for is no rival either.
        let kept = self.answer.map(|i| self.tried[i].kinds().to_vec());
        let chance = self.chance.clone();
        self.tried.retain(|j| !j.kinds().iter().any(|k| chance.contains(k)));
        self.answer = kept.and_then(|k| (0..self.tried.len()).find(|&i| same(self.tried[i].kinds(), &k)));
        self.base_scores = self.scores(&self.tried[0].fit);
    }

    /// The search, until `told` says that the time is over; the tried sets are judged on the held-out part where they are close to the best.
    pub fn run(&mut self, told: &mut dyn FnMut() -> bool) {
        self.explore(told);
        self.refine(told);
        self.judge();
    }

    /// Adds effects to the best sets so far until none pays.
    pub fn explore(&mut self, told: &mut dyn FnMut() -> bool) {
        self.base_scores = self.scores(&self.tried[0].fit);
        if !told() {
            return;
        }
        let best = self.ranked()[0];
        let mut beam = vec![best];
        for level in self.tried[best].kinds().len() + 1..=MOST_EFFECTS {
            let mut jobs: Vec<(usize, Vec<&'static str>, Vec<f64>)> = Vec::new();
            for &i in &beam {
                let fit = &self.tried[i].fit;
                let scores = if i == 0 { self.base_scores.clone() } else { self.scores(fit) };
                let most = if level == 1 { 6 } else { 4 };
                for (rank, s) in scores.into_iter().take(most).enumerate() {
                    let mut kinds = self.tried[i].kinds().to_vec();
                    kinds.push(s.kind);
                    // The dispersion that a missing effect makes must not hide it: the first are fitted in any case.
                    let sure = rank < SURE && s.gain > self.resolution() + self.quantile(s.kind);
                    let worth = sure || s.evidence() > 0.5 * self.penalty(&s);
                    if worth && !self.known(&kinds) && !jobs.iter().any(|j| same(&j.1, &kinds)) {
                        jobs.push((i, kinds, s.theta));
                    }
                }
            }
            // No score forecasts these from afar: where the kind that foretells them promises much, they are fitted too.
            let twins: Vec<(usize, Vec<&'static str>, Vec<f64>)> = jobs
                .iter()
                .filter_map(|j| {
                    let mut kinds = j.1.clone();
                    let twin = foretold(kinds.pop()?)?;
                    kinds.push(twin);
                    Some((j.0, kinds, self.tried[j.0].fit.theta.clone()))
                })
                .filter(|t| !self.known(&t.1) && !jobs.iter().any(|j| same(&j.1, &t.1)))
                .collect();
            jobs.extend(twins);
            let before = self.ranked()[0];
            let fitted: Vec<Judged> = jobs
                .par_iter()
                .map(|(i, kinds, theta)| self.refit(&self.tried[*i].fit, kinds, Some(theta)))
                .collect();
            let count = self.tried.len();
            self.tried.extend(fitted);
            let goes_on = told();
            self.rescale();
            let order = self.ranked();
            if order[0] == before || self.tried.len() == count || !goes_on {
                break;
            }
            beam = order.into_iter().filter(|&i| i >= count).take(BEAM).collect();
        }
    }

    /// Drops and swaps around the best until nothing is better.
    fn refine(&mut self, told: &mut dyn FnMut() -> bool) {
        for _ in 0..3 {
            if !told() {
                return;
            }
            let best = self.ranked()[0];
            let now = self.tried[best].kinds().to_vec();
            let mut sets: Vec<(Vec<&'static str>, Option<Vec<f64>>)> = Vec::new();
            for i in 0..now.len() {
                let mut rest = now.clone();
                let gone = rest.remove(i);
                if !rest.is_empty() {
                    sets.push((rest.clone(), None));
                }
                if let Some(less) = contained(gone) {
                    sets.push(([&rest[..], &[less]].concat(), None));
                }
                let scores = if rest.is_empty() {
                    self.base_scores.clone()
                } else {
                    match self.fitted(&rest) {
                        Some(j) => self.scores(&j.fit),
                        None => self.scores(&self.refit(&self.tried[best].fit, &rest, None).fit),
                    }
                };
                for s in scores.into_iter().filter(|s| s.kind != gone).take(2) {
                    if s.evidence() > 0.5 * self.penalty(&s) {
                        let mut kinds = rest.clone();
                        kinds.push(s.kind);
                        sets.push((kinds, Some(s.theta)));
                    }
                }
            }
            sets.retain(|(kinds, _)| !self.known(kinds));
            let fitted: Vec<Judged> = sets
                .par_iter()
                .map(|(kinds, theta)| self.refit(&self.tried[best].fit, kinds, theta.as_deref()))
                .collect();
            self.tried.extend(fitted);
            if self.ranked()[0] == best {
                break;
            }
            self.rescale();
        }
    }

    /// The place of a set in what was tried, fitted and judged from the set at `from` if it was not.
    pub fn place_of(&mut self, kinds: &[&'static str], from: usize) -> usize {
        let place = self.position(kinds).unwrap_or_else(|| {
            let fitted = self.refit(&self.tried[from].fit, kinds, None);
            self.tried.push(fitted);
            self.tried.len() - 1
        });
        if self.tried[place].held.is_none() {
            let f = &self.tried[place].fit;
            self.tried[place].held = Some(fit_starts(&self.test, &f.hypothesis, &f.theta));
        }
        place
    }

    fn judge(&mut self) {
        let order = self.ranked();
        let (least, unit) = (self.criterion(&self.tried[order[0]]), self.tried[order[0]].unit);
        let mut pool: Vec<usize> = order
            .into_iter()
            .filter(|&i| self.criterion(&self.tried[i]) < least + POOL * unit)
            .take(8)
            .collect();
        let simpler: Vec<usize> =
            pool.iter().filter_map(|&i| self.position(&less(self.tried[i].kinds()))).chain([0]).collect();
        for i in simpler {
            if !pool.contains(&i) {
                pool.push(i);
            }
        }
        let held: Vec<Fit> = pool
            .par_iter()
            .map(|&i| fit_starts(&self.test, &self.tried[i].fit.hypothesis, &self.tried[i].fit.theta))
            .collect();
        for (i, f) in pool.into_iter().zip(held) {
            self.tried[i].held = Some(f);
        }
    }

    fn confirmed(&self, i: usize) -> bool {
        let (lead, gain) = (self.lead(&self.tried[i]), self.heldout_gain(&self.tried[i]));
        i == 0 || (self.tried[i].clear && lead > 0.0 && gain.is_some_and(|gain| holds(lead, gain)))
    }

    /// The answer: the best on both parts together, of those that pay their penalty on the training part and that the
    /// held-out part confirms.
    pub fn best(&self) -> usize {
        if let Some(answer) = self.answer {
            return answer;
        }
        let judged = (0..self.tried.len()).filter(|&i| self.tried[i].held.is_some());
        let judged = judged.filter(|&i| self.confirmed(i));
        let total = |i: usize| self.total(&self.tried[i]);
        let best = judged.min_by(|&a, &b| total(a).total_cmp(&total(b))).unwrap_or(0);
        // What a kind has beyond one that it contains is a further step, tested once.
        let kinds = self.tried[best].kinds();
        let simple = self.position(&less(kinds)).filter(|&i| i != best && self.confirmed(i));
        let beyond: f64 = kinds
            .iter()
            .filter_map(|k| Some(self.size(k) - self.size(contained(k)?)))
            .map(|k| chi2_quantile(ALPHA, k as f64))
            .sum();
        simple
            .filter(|&i| total(i) < total(best) + self.resolution() + beyond * self.tried[best].unit)
            .unwrap_or(best)
    }
}

/// What the data can speak about.
fn library(model: &PushModel, sample: &Sample<'_>) -> Vec<&'static str> {
    let effects = all::<f64>().into_iter().map(|e| e.spec()).filter(|s| {
        let clash = |kind: &str| s.kind == kind || s.excludes.contains(&kind);
        let slow = s.needs == Needs::Coasting && coasting_m(model, sample) < 3.0 * sample.data.noise.sd[0];
        !model.effects.iter().any(|b| clash(&b.kind)) && !slow
    });
    let (groups, pushes) = (sample.data.groups.len(), sample.data.records.len());
    let own = (2..=MOST_GROUPS).contains(&groups) && groups < pushes;
    let declared = model.parameters.iter().enumerate();
    let per_group = declared.filter(|(_, p)| own && !p.frozen && p.per == Per::All);
    effects.map(|s| s.kind).chain(per_group.map(|(i, _)| kind_per_group(i))).collect()
}

/// The kind that another turns into where some of its parameters are at their null.
fn contained(kind: &str) -> Option<&'static str> {
    spec_of(kind).and_then(|s| s.contains)
}

/// The kind whose promise another kind's test makes.
fn foretold(kind: &str) -> Option<&'static str> {
    all::<f64>().into_iter().map(|e| e.spec()).find(|s| s.foretold_by == Some(kind)).map(|s| s.kind)
}

/// A set with the kinds that its own contain.
fn less(kinds: &[&'static str]) -> Vec<&'static str> {
    kinds.iter().map(|k| contained(k).unwrap_or(k)).collect()
}

/// How far the object coasts from the speed that the rod reaches in a tenth of the time, m.
fn coasting_m(model: &PushModel, sample: &Sample<'_>) -> f64 {
    let mut speeds: Vec<f64> = sample
        .data
        .records
        .iter()
        .flat_map(|r| {
            // Not the recorded positions one by one: their noise is faster than the rod.
            let [t, x, y] = &r.corners;
            (1..t.len()).map(move |k| (x[k] - x[k - 1]).hypot(y[k] - y[k - 1]) / (t[k] - t[k - 1]))
        })
        .collect();
    speeds.sort_by(f64::total_cmp);
    let friction = model.parameters[augsim_physics::push::SUPPORT_FRICTION].nominal;
    quantile(&speeds, 0.9).powi(2) / (2.0 * friction * augsim_physics::push::GRAVITY_M_S2)
}

fn same(a: &[&str], b: &[&str]) -> bool {
    a.len() == b.len() && a.iter().all(|k| b.contains(k))
}

/// From which mean squared residual the cost of windows is bent, by what is typical of a fit.
fn bend(fit: &Fit) -> f64 {
    let mut all: Vec<f64> = fit.pieces.iter().map(|p| p.q / p.m.max(1) as f64).collect();
    BEND * median(&mut all).max(1.0)
}
