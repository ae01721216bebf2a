//! Forward-backward search over sets of effects.

use super::evaluate::MOST_FREE;
use super::fit::{Fit, Sample, fit, fit_starts};
use super::hypothesis::{Hypothesis, Polar, probes};
use crate::decide::holds;
use crate::statistics::{chi2_quantile, median, quantile};
use augsim_physics::effects::EffectSpec;
use augsim_physics::model::PushModel;
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
/// Root mean square displacement, m, that is no effect: rods, outlines and integrators are not better.
const RESOLUTION_M: f64 = 1e-5;
/// Hypotheses within this of the best on the training part go on to the held-out part.
const POOL: f64 = 30.0;
/// A window's mean squared residual from which its cost is bent, in units of the typical one: three standard deviations.
pub(crate) const BEND: f64 = 9.0;

/// A kind tested at a fit, by one Gauss-Newton step from its probe.
#[derive(Clone, Debug)]
pub(crate) struct Score {
    pub kind: &'static str,
    /// Predicted gain in cost.
    pub gain: f64,
    /// Where a fit with it begins.
    pub theta: Vec<f64>,
}

/// A fitted hypothesis.
#[derive(Clone, Debug)]
pub(crate) struct Judged {
    pub fit: Fit,
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
    /// By which gains in cost are divided.
    pub dispersion: f64,
    pub library: Vec<&'static EffectSpec>,
    /// Everything that was fitted, the calibrated model first.
    pub tried: Vec<Judged>,
    /// Scores at the calibrated model.
    pub base_scores: Vec<Score>,
}

impl<'a> Search<'a> {
    /// Calibrates, from the nominal values or those of a search on fewer pushes.
    pub fn new(
        model: &'a PushModel,
        mut train: Sample<'a>,
        mut test: Sample<'a>,
        from: Option<&Search<'_>>,
    ) -> Self {
        let library = all::<f64>()
            .into_iter()
            .map(|e| e.spec())
            .filter(|s| {
                let clash = |kind: &str| s.kind == kind || s.excludes.contains(&kind);
                let slow = s.kind == "inertia" && coasting_m(model, &train) < 3.0 * train.data.noise.sd[0];
                !model.effects.iter().any(|b| clash(&b.kind)) && !slow
            })
            .collect();
        let h = Hypothesis::new(model, &[]);
        let theta = from.map_or_else(|| h.start(), |s| s.base().fit.theta.clone());
        let nominal = fit_starts(&train, &h, &theta);
        train.bend = bend(&nominal);
        let mut base = fit(&train, &h, &nominal.theta, &nominal.starts);
        train.bend = bend(&base);
        base = fit(&train, &h, &base.theta, &base.starts);
        train.bend = bend(&base);
        test.bend = train.bend;
        let dispersion = base.dispersion(&train);
        let tried = vec![Judged { fit: base, held: None }];
        let mut search = Self { model, train, test, dispersion, library, tried, base_scores: Vec::new() };
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
                Judged { fit: fit(&self.train, &f.hypothesis, &f.theta, &[]), held: None }
            })
            .collect();
        self.tried.extend(fitted);
        self.rescale();
    }

    /// The gain that an effect has which moves the poses by no more than the models are good to: none that would be found
    /// is below it.
    pub fn resolution(&self) -> f64 {
        let samples: usize = self.train.windows.iter().map(|w| w.last - w.first + 1).sum();
        samples as f64 * (RESOLUTION_M / self.train.data.noise.sd[0]).powi(2)
    }

    pub fn base(&self) -> &Judged {
        &self.tried[0]
    }

    /// Penalty of a set of kinds on the cost, in units of the dispersion.
    pub fn penalty(&self, kinds: &[&str]) -> f64 {
        let m = self.library.len().max(1) as f64;
        let least = self.resolution() / self.dispersion;
        kinds
            .iter()
            .map(|k| {
                least + chi2_quantile(ALPHA / m, spec_of(k).map_or(1, |s| s.parameters.len().max(1)) as f64)
            })
            .sum()
    }

    pub fn criterion(&self, j: &Judged) -> f64 {
        j.fit.cost(&self.train) / self.dispersion + self.penalty(j.kinds())
    }

    /// Criterion and held-out part together.
    pub fn total(&self, j: &Judged) -> f64 {
        let held = j.held.as_ref().map_or(f64::INFINITY, |f| f.cost(&self.test));
        self.criterion(j) + held / self.dispersion
    }

    fn may_join(&self, spec: &EffectSpec, kinds: &[&'static str]) -> bool {
        !kinds.iter().any(|k| *k == spec.kind || spec.excludes.contains(k))
    }

    /// What the kinds that a fit lacks promise, best first.
    pub fn scores(&self, from: &Fit) -> Vec<Score> {
        let kinds = &from.hypothesis.kinds;
        let candidates: Vec<(&'static EffectSpec, Vec<f64>)> = self
            .library
            .iter()
            .filter(|s| self.may_join(s, kinds) && from.theta.len() + s.parameters.len() <= MOST_FREE)
            .flat_map(|s| probes(s).into_iter().map(|p| (*s, p)))
            .collect();
        let mut list: Vec<Score> =
            candidates.into_par_iter().map(|(s, probe)| self.score(from, s, &probe)).collect();
        // Corners, where a start meets the rod, promise what no step keeps: to every kind alike, and to the fit itself.
        let common = self.train.promise(&from.pieces, from.theta.len());
        list.iter_mut().for_each(|s| s.gain -= common);
        list.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let mut seen: Vec<&str> = Vec::new();
        list.retain(|s| {
            let fresh = !seen.contains(&s.kind);
            seen.push(s.kind);
            fresh
        });
        list
    }

    fn score(&self, from: &Fit, spec: &'static EffectSpec, probe: &[f64]) -> Score {
        let mut kinds = from.hypothesis.kinds.clone();
        kinds.push(spec.kind);
        let h = Hypothesis::new(self.model, &kinds);
        let theta = [&from.theta[..], probe].concat();
        let p = theta.len();
        let pieces = self.train.pieces(&h, &theta, &from.starts);
        let (s, u, _) = self.train.normal(&pieces, p);
        let mut step = u.clone();
        s.cholesky().solve(&mut step);
        let mut next: Vec<f64> = theta.iter().zip(&step).map(|(a, b)| a + b).collect();
        let polar = Polar::of(spec.kind);
        if let (Some(polar), [.., a, b]) = (polar, &step[..]) {
            let to = polar.step([probe[0], probe[1]], [*a, *b]);
            next[p - 2..].copy_from_slice(&to);
        }
        h.admit(&mut next);
        if polar.is_none() {
            // A step that the bounds stop gains less.
            step = next.iter().zip(&theta).map(|(a, b)| a - b).collect();
        }
        let mut gain = from.cost(&self.train) - self.train.total(&pieces);
        gain += pieces.iter().map(|w| self.train.cost(w.q, w.m).1 * w.start_gain(p)).sum::<f64>();
        for i in 0..p {
            gain += 2.0 * u[i] * step[i];
            gain -= (0..p).map(|j| step[i] * s.at(i, j) * step[j]).sum::<f64>();
        }
        Score { kind: spec.kind, gain, theta: next }
    }

    /// Fits a set of kinds, parameters as another fit has them or as given for one kind.
    pub fn refit(&self, from: &Fit, kinds: &[&'static str], theta: Option<&[f64]>) -> Judged {
        let h = Hypothesis::new(self.model, kinds);
        let mut start = h.start();
        if let Some(theta) = theta.filter(|t| t.len() == start.len()) {
            start.copy_from_slice(theta);
        } else {
            let declared = start.len().min(from.theta.len()).min(Hypothesis::new(self.model, &[]).free.len());
            start[..declared].copy_from_slice(&from.theta[..declared]);
            for kind in kinds {
                let (to, of) = (h.range_of(kind), from.hypothesis.range_of(kind));
                if to.len() == of.len() {
                    start[to].copy_from_slice(&from.theta[of]);
                } else if let Some(spec) = spec_of(kind)
                    && to.len() == spec.parameters.len()
                {
                    let first = probes(spec).into_iter().next().unwrap_or_default();
                    start[to].copy_from_slice(&first);
                }
            }
        }
        Judged { fit: fit(&self.train, &h, &start, &from.starts), held: None }
    }

    /// The fit of a set, if it was tried.
    pub fn fitted(&self, kinds: &[&str]) -> Option<&Judged> {
        self.tried.iter().find(|j| same(j.kinds(), kinds))
    }

    fn known(&self, kinds: &[&str]) -> bool {
        self.fitted(kinds).is_some()
    }

    /// Kinds that were fitted beside the best set and did not pay.
    pub fn rejected(&self, best: usize) -> Vec<&'static str> {
        let now = self.tried[best].kinds();
        self.library
            .iter()
            .map(|s| s.kind)
            .filter(|kind| {
                let mut with = now.to_vec();
                with.push(kind);
                self.known(&with)
            })
            .collect()
    }

    fn ranked(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.tried.len()).collect();
        let criteria: Vec<f64> = self.tried.iter().map(|j| self.criterion(j)).collect();
        order.sort_by(|&a, &b| criteria[a].total_cmp(&criteria[b]));
        order
    }

    /// Scale and dispersion by the closest fit so far, as of quasi-likelihood (Burnham and Anderson 2002): what it explains is
    /// no scatter.
    fn rescale(&mut self) {
        let cost = |j: &Judged| j.fit.cost(&self.train);
        let closest = self.tried.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
        let Some(Judged { fit, .. }) = closest.cloned() else { return };
        let fit = &fit;
        self.train.bend = self.train.bend.min(bend(fit));
        self.test.bend = self.train.bend;
        self.dispersion = self.dispersion.min(fit.dispersion(&self.train));
    }

    /// The search; the tried sets are judged on the held-out part where they are close to the best.
    pub fn run(&mut self, told: &mut dyn FnMut()) {
        self.explore(told);
        self.refine(told);
        self.judge();
    }

    /// Adds effects to the best sets so far until none pays.
    pub fn explore(&mut self, told: &mut dyn FnMut()) {
        self.base_scores = self.scores(&self.tried[0].fit);
        told();
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
                    let sure = rank < SURE && s.gain > self.penalty(&[s.kind]);
                    let worth = sure || s.gain > 0.5 * self.dispersion * self.penalty(&[s.kind]);
                    if worth && !self.known(&kinds) && !jobs.iter().any(|j| same(&j.1, &kinds)) {
                        jobs.push((i, kinds, s.theta));
                    }
                }
            }
            // A score cannot forecast the exact surface from afar: where the superellipsoid promises much, it is fitted too.
            let twins: Vec<(usize, Vec<&'static str>, Vec<f64>)> = jobs
                .iter()
                .filter(|j| j.1.last() == Some(&"superelliptic-surface"))
                .map(|j| {
                    let mut kinds = j.1.clone();
                    kinds.pop();
                    kinds.push("exact-surface");
                    (j.0, kinds, self.tried[j.0].fit.theta.clone())
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
            told();
            self.rescale();
            let order = self.ranked();
            if order[0] == before || self.tried.len() == count {
                break;
            }
            beam = order.into_iter().filter(|&i| i >= count).take(BEAM).collect();
        }
    }

    /// Drops and swaps around the best until nothing is better.
    fn refine(&mut self, told: &mut dyn FnMut()) {
        for _ in 0..3 {
            let best = self.ranked()[0];
            let now = self.tried[best].kinds().to_vec();
            let mut sets: Vec<(Vec<&'static str>, Option<Vec<f64>>)> = Vec::new();
            for i in 0..now.len() {
                let mut rest = now.clone();
                let gone = rest.remove(i);
                if !rest.is_empty() {
                    sets.push((rest.clone(), None));
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
                    if s.gain > 0.5 * self.dispersion * self.penalty(&[s.kind]) {
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
            told();
            if self.ranked()[0] == best {
                break;
            }
            self.rescale();
        }
    }

    /// The place of a set in what was tried, fitted and judged from the set at `from` if it was not.
    pub fn place_of(&mut self, kinds: &[&'static str], from: usize) -> usize {
        let known = (0..self.tried.len()).find(|&i| same(self.tried[i].kinds(), kinds));
        let place = known.unwrap_or_else(|| {
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
        let least = self.criterion(&self.tried[order[0]]);
        let mut pool: Vec<usize> =
            order.into_iter().filter(|&i| self.criterion(&self.tried[i]) < least + POOL).take(8).collect();
        if !pool.contains(&0) {
            pool.push(0);
        }
        let held: Vec<Fit> = pool
            .par_iter()
            .map(|&i| fit_starts(&self.test, &self.tried[i].fit.hypothesis, &self.tried[i].fit.theta))
            .collect();
        for (i, f) in pool.into_iter().zip(held) {
            self.tried[i].held = Some(f);
        }
    }

    /// The answer: the best on both parts together, of those that pay their penalty on the training part and that the
    /// held-out part confirms.
    pub fn best(&self) -> usize {
        let held = |i: usize| self.tried[i].held.as_ref().map(|f| f.cost(&self.test));
        let confirmed = |i: &usize| {
            let trained = self.criterion(&self.tried[0]) - self.criterion(&self.tried[*i]);
            let gain = held(0).zip(held(*i)).map(|(base, own)| 0.5 * (base - own) / self.dispersion);
            *i == 0 || (trained > 0.0 && gain.is_some_and(|gain| holds(trained, gain)))
        };
        let judged = (0..self.tried.len()).filter(|&i| held(i).is_some()).filter(confirmed);
        judged.min_by(|&a, &b| self.total(&self.tried[a]).total_cmp(&self.total(&self.tried[b]))).unwrap_or(0)
    }
}

/// How far the object coasts from the speed that the rod reaches in a tenth of the time, m.
fn coasting_m(model: &PushModel, sample: &Sample<'_>) -> f64 {
    let mut speeds: Vec<f64> = sample
        .data
        .records
        .iter()
        .flat_map(|r| {
            (1..r.rod_time.len()).map(move |k| {
                (r.rod_x[k] - r.rod_x[k - 1]).hypot(r.rod_y[k] - r.rod_y[k - 1])
                    / (r.rod_time[k] - r.rod_time[k - 1])
            })
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
