//! The ground of a search: penalties, fits of sets of additions, and their judgement.

use crate::addition::Addition;
use crate::calibrate::calibration_start;
use crate::candidates::{Family, library, may_join};
use crate::cut::Clock;
use crate::evaluate::{Lanes, rough_event_value};
use crate::fit::{ChosenRecords, Fit, Reach, fit_nuisance, fit_within};
use crate::folded::{LeftOut, folded};
use crate::free_runs::{FreeRuns, NO_WORSE};
use crate::hypothesis::Hypothesis;
pub(crate) use crate::judged::Judged;
use crate::longer::{Length, at_length, best_joined, fit_joined, lengthened, ratio_at_best};
use crate::prepare::Prepared;
use crate::score::{heterogeneity, scores};
use crate::scored::Score;
use crate::statistics::{chi2_quantile, chi2_tail};
use crate::trapped::freed;
use augsim_physics::model::Per;
use augsim_physics::system::{ScatterPer, System};
use std::sync::Arc;

/// Probability of a false step.
const ALPHA: f64 = 0.01;
/// Most effects in a hypothesis.
pub(crate) const MOST_EFFECTS: usize = 4;
/// Largest rough offset of the events' parameter that a fit begins with, in units of the largest scatter.
const MOST_OF_AN_OFFSET: f64 = 0.6;
/// Displacement that is no effect, in units of the noise (root mean square): no forecast would be better by it, and laws that
/// are idealisations leave as much.
const NO_EFFECT: f64 = 0.1;

/// Gain, in -2 ln likelihood, of an effect too small to be one; 0 for a system whose laws are exact.
pub(crate) fn resolution(sample: &ChosenRecords<'_>) -> f64 {
    let system = &*sample.data.system;
    if !sample.data.is_idealised() {
        return 0.0;
    }
    let each = sample.records().map(|record| {
        let samples = record.seen.times.len() as f64;
        let ratio = |(channel, weights): (usize, &Vec<f64>)| {
            let most = weights.iter().copied().fold(0.0, f64::max);
            system.resolution(channel) * most
        };
        let least = record.weight.iter().enumerate().map(ratio).fold(NO_EFFECT, f64::max);
        samples * least * least
    });
    each.sum()
}

/// Ratio of two free runs' errors below which a set is preferred for its runs alone, as one that was chosen among many by such runs.
const CLEARLY: f64 = 0.8;

/// A draw of the events' parameter may belong to an event or to a record.
const BOTH_WAYS: &[ScatterPer] = &[ScatterPer::Event, ScatterPer::Record];

/// A search: its two samples, its library, and how many tests that amounts to.
pub(crate) struct Search<'a> {
    pub train: ChosenRecords<'a>,
    pub test: ChosenRecords<'a>,
    pub library: Vec<Addition>,
    /// Source of the library.
    pub family: Family,
    /// How many tests the library amounts to: an effect with a width or a threshold is tested at several.
    pub tests: usize,
    /// Whether a draw of the events' parameter may belong to an event, to a record, or to either; empty where it is constant.
    pub ways: &'static [ScatterPer],
    /// Free runs over the held-out part.
    pub free_runs: Option<FreeRuns>,
    /// The time that is left.
    pub clock: Clock,
    /// Whether it goes on from what another search came to, on a part of the same data.
    pub goes_on: bool,
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

impl<'a> Search<'a> {
    pub fn new(train: ChosenRecords<'a>, test: ChosenRecords<'a>, family: Family, clock: &Clock) -> Self {
        let library = library(train.data, family);
        let system = &train.data.system;
        let points = |a: &Addition| match a {
            Addition::Effect(listed, _) => {
                system.null_points(listed.index).len() + system.scan_points(listed.index).len()
            }
            _ => 1,
        };
        let tests = library.iter().map(points).sum();
        let (free_runs, clock) = (FreeRuns::new(&test), clock.clone());
        Self { train, test, library, family, tests, ways: BOTH_WAYS, free_runs, clock, goes_on: false }
    }

    /// The search on the training part of prepared data, judged on their held-out part.
    pub fn on(prepared: &'a Prepared, family: Family) -> Self {
        Self::new(prepared.sample(&prepared.train), prepared.sample(&prepared.test), family, &prepared.clock)
    }

    pub fn system(&self) -> &dyn System {
        &*self.train.data.system
    }

    /// Index of the parameter of the events, where the system has events.
    pub fn event_parameter(&self) -> Option<usize> {
        self.system().schema().event.as_ref().map(|e| e.parameter)
    }

    /// Gain that chance alone exceeds with so many parameters, with probability [`ALPHA`] over the library.
    pub fn quantile(&self, size: f64) -> f64 {
        chi2_quantile(ALPHA / (self.tests.max(1) as f64 + 2.0), size)
    }

    /// Half-widths of a 95 % interval within which chance alone leaves an amount with probability 1 - [`ALPHA`] over the library.
    pub fn level(&self) -> f64 {
        (self.quantile(1.0) / chi2_quantile(0.05, 1.0)).sqrt()
    }

    /// Gain in -2 ln likelihood by an addition that chance alone exceeds with probability [`ALPHA`] over the library, where
    /// residuals are white.
    pub fn penalty(&self, addition: &Addition) -> f64 {
        match addition {
            Addition::Table(t) => chi2_quantile(ALPHA / 24.0, t.table.knots as f64) + 4.0,
            _ => self.quantile(self.size(addition)),
        }
    }

    /// Degrees of freedom of an addition.
    pub fn size(&self, addition: &Addition) -> f64 {
        match addition {
            Addition::Table(t) => t.table.knots as f64,
            Addition::Scatter(_) => 1.0,
            Addition::Effect(listed, per) => {
                let n = listed.effect.parameters.len() as f64;
                // A switch without parameters is one choice.
                if *per == Per::Group { n * self.train.data.groups.len() as f64 } else { n.max(1.0) }
            }
            Addition::Split(split) => (split.groups.max(2) - 1) as f64,
        }
    }

    /// Penalty of a set.
    pub fn penalty_of(&self, additions: &[Addition]) -> f64 {
        additions.iter().map(|a| self.penalty(a)).sum()
    }

    /// Gain of an effect that moves the channels by no more than the system's laws are good to: none that is found is below it.
    pub fn resolution(&self) -> f64 {
        resolution(&self.train)
    }

    /// Judges a fit on the training part.
    ///
    /// Where the system's laws are idealisations the penalty of each addition is in units of the dispersion in its own
    /// direction (Takeuchi's criterion with another weight; Varin and Vidoni 2005 for composite likelihoods): the level then
    /// stays where every model misses something. Elsewhere it is the plain quantile: by dispersion the first of two effects
    /// that are both needed no longer pays.
    pub fn judge(&self, fit: Fit) -> Judged {
        let additions = &fit.hypothesis.additions;
        let (mut penalty, mut unit) = (self.penalty_of(additions), 1.0);
        if self.train.data.is_idealised() {
            let least = self.train.data.white_share;
            let own = |(number, addition): (usize, &Addition)| {
                let own = fit.dispersion(fit.hypothesis.range_of(number), least);
                (own.factor, own.factor * own.widened(self.penalty(addition), self.size(addition)))
            };
            let each: Vec<(f64, f64)> = additions.iter().enumerate().map(own).collect();
            penalty = each.iter().map(|(_, penalty)| penalty + self.resolution()).sum();
            unit = match each.len() {
                0 => fit.dispersion(0..0, least).factor,
                n => each.iter().map(|(factor, _)| factor).sum::<f64>() / n as f64,
            };
        }
        let free_run = self.free_runs.as_ref().map(|runs| runs.error(&fit));
        let criterion = -2.0 * fit.ll + penalty;
        Judged { criterion, penalty, unit, fit, heldout_ll: None, free_run, memory: Arc::default() }
    }

    /// Fits `from` with other additions, as warm as possible: parameters that both have keep their values.
    pub fn refit(&self, from: &Fit, additions: &[Addition], starts: &[(Addition, Vec<f64>)]) -> Judged {
        self.refit_within(Reach::ANY, from, additions, starts)
    }

    /// Fits as [`refit`](Self::refit) does, and leaves off where the cost will not come within `reach`.
    pub fn refit_within(
        &self,
        reach: Reach,
        from: &Fit,
        additions: &[Addition],
        starts: &[(Addition, Vec<f64>)],
    ) -> Judged {
        let h = Hypothesis::new(self.train.data, additions);
        let old = &from.hypothesis;
        let base = h.range_of_declared();
        let mut theta = h.theta_start(0.2);
        if h.scatter.map(|s| s.per) == old.scatter.map(|s| s.per) {
            theta[..base].copy_from_slice(&h.declared_from(old, &from.theta));
        } else {
            // A fit without scatter can sit far off when the scatter is large: the declared part begins anew as well.
            theta[..base].copy_from_slice(&calibration_start(&self.train, &h)[..base]);
        }
        h.carry_additions(&mut theta, old, &from.theta);
        for (number, addition) in additions.iter().enumerate() {
            let place = h.range_of(number);
            let known = starts.iter().find(|(a, v)| a == addition && v.len() == place.len());
            if let Some((_, values)) = known.filter(|_| !old.additions.contains(addition)) {
                let bounds = h.bounds();
                // Values by group begin as differences from the common one.
                let differ = matches!(addition, Addition::Split(_));
                for (i, v) in place.zip(values) {
                    let from = if differ { theta[i] } else { 0.0 };
                    theta[i] = (from + v).clamp(bounds[i].0, bounds[i].1);
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
        let mut fitted =
            freed(&self.train, fit_within(&self.train, &h, &theta, &nuisance, reach), starts, reach);
        let mut theta = fitted.theta.clone();
        if h.bring_round(&mut theta) {
            fitted = fit_within(&self.train, &h, &theta, &fitted.nuisance, reach);
        }
        self.judge(fitted)
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

    /// A fit with more additions; it leaves off where the cost will not come within `reach`.
    pub fn plus(&self, reach: Reach, from: &Fit, extra: &[(Addition, Vec<f64>)]) -> Judged {
        let mut additions = from.hypothesis.additions.clone();
        additions.extend(extra.iter().map(|(a, _)| a.clone()));
        self.refit_within(reach, from, &additions, extra)
    }

    /// Largest standard deviation of the scatter of the events' parameter, in its unit.
    fn most_scatter(&self) -> f64 {
        let event = self.system().schema().event.as_ref();
        event.and_then(|e| e.scatter.parameters.first()).map_or(f64::INFINITY, |p| p.max)
    }

    /// The ways in which the events' parameter may scatter; none for a system without events.
    pub fn scatters(&self) -> impl Iterator<Item = Addition> + '_ {
        self.ways.iter().filter_map(|&per| Addition::scatter(self.system(), per))
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
    pub fn library_scores(&self, judged: &Judged) -> Vec<Score> {
        let fit = &judged.fit;
        let scored = || {
            let may_join = |a: &&Addition| may_join(a, &fit.hypothesis);
            let list: Vec<Addition> = self.library.iter().filter(may_join).cloned().collect();
            without_aliases(scores(&self.train, fit, &list))
        };
        judged.memory.scores.get_or_init(scored).clone()
    }

    /// The held-out part at the parameters of a fit, nuisances fitted.
    pub fn heldout<'j>(&self, judged: &'j Judged) -> &'j Fit {
        let fit = &judged.fit;
        let fitted = || fit_nuisance(&self.test, &fit.hypothesis, &fit.theta, &[]);
        judged.memory.heldout.get_or_init(fitted)
    }

    /// Errors of a set's free runs over each part of the data, fitted to the others over ever longer windows; `None` where fits see no
    /// recording in several windows, or nothing can be fitted.
    pub fn lengths<'j>(&self, judged: &'j Judged) -> Option<&'j [Length]> {
        let found = || {
            let lengths = lengthened(&self.train, &self.left_out(judged)?, &judged.fit, &self.clock);
            (!lengths.is_empty()).then_some(lengths)
        };
        judged.memory.lengths.get_or_init(found).as_deref()
    }

    /// Makes `longer`, a fit of the training part with values that suit windows that join so many of the search's, what
    /// [`over_longer_windows`](Self::over_longer_windows) has for a set.
    pub fn know_longer(&self, judged: &Judged, joined: usize, longer: &Fit) {
        let known = || {
            let parts = self.left_out(judged)?;
            let both = [(1, &judged.fit), (joined, longer)];
            both.map(|(joined, from)| at_length(&self.train, &parts, from, joined)).into_iter().collect()
        };
        judged.memory.lengths.get_or_init(known);
        judged.memory.longer.get_or_init(|| longer.clone());
    }

    /// The parts of all data that are left out in turn for a set.
    fn left_out(&self, judged: &Judged) -> Option<Vec<LeftOut>> {
        self.free_runs.as_ref().filter(|_| !judged.fit.theta.is_empty())?;
        folded(&self.train, &self.test)
    }

    /// Whether a set runs worse than another, each over windows of its best length.
    pub fn runs_worse(&self, set: &Judged, other: &Judged) -> bool {
        self.ratio_of_runs(set, other).is_some_and(|ratio| ratio > NO_WORSE)
    }

    /// Whether a set runs better than another, each over windows of its best length, by so much that it is preferred for that alone.
    pub fn runs_clearly_better(&self, set: &Judged, other: &Judged) -> bool {
        self.ratio_of_runs(set, other).is_some_and(|ratio| ratio < CLEARLY)
    }

    /// The error of a set's free runs over that of another's, each over windows of its best length; `None` where one has no lengths.
    fn ratio_of_runs(&self, set: &Judged, other: &Judged) -> Option<f64> {
        let other = self.lengths(other)?;
        Some(ratio_at_best(self.lengths(set)?, other))
    }

    /// Whether a part of a set runs clearly worse than the set does, both over windows of the set's best length.
    pub fn part_runs_clearly_worse(&self, part: &Judged, set: &Judged) -> bool {
        let found = || {
            let of_set = self.lengths(set)?;
            let joined = best_joined(of_set);
            let of_part = at_length(&self.train, &self.left_out(set)?, &part.fit, joined)?;
            Some(ratio_at_best(of_set, &[of_part]) < CLEARLY)
        };
        found().unwrap_or(true)
    }

    /// A set with the parameters of a fit over longer windows, where each part of the data runs better for it with the values of
    /// the others, and how many of the search's windows each of them joins. Intervals stay those of the search's windows.
    pub fn over_longer_windows(&self, judged: &Judged) -> Option<(Judged, usize)> {
        let joined = best_joined(self.lengths(judged)?);
        if joined == 1 {
            return None;
        }
        Some((self.over_windows_joined(judged, joined)?, joined))
    }

    /// A set with parameters that are fitted over windows of which each joins so many of the search's; `None` where the fit is lost.
    pub fn over_windows_joined(&self, judged: &Judged, joined: usize) -> Option<Judged> {
        let over_longer = || fit_joined(&self.train, &judged.fit, joined);
        let again = self.judge(judged.memory.longer.get_or_init(over_longer).clone());
        let heldout_ll = Some(self.heldout(&again).ll);
        again.is_finite().then_some(Judged { heldout_ll, ..again })
    }

    /// The simpler effect that an addition turns into where some of its parameters have their nulls.
    pub fn contained(&self, addition: &Addition) -> Option<Addition> {
        let kind = addition.listed()?.contains.as_ref()?;
        self.library.iter().find(|a| a.kind() == kind && matches!(a, Addition::Effect(_, Per::All))).cloned()
    }

    /// A set in its simplest form: what contains a simpler effect replaced by that; and by how many parameters it is less.
    pub fn simplified(&self, additions: &[Addition]) -> (Vec<Addition>, Vec<f64>) {
        let mut fewer = Vec::new();
        let simple = additions.iter().map(|a| match self.contained(a) {
            Some(less) => {
                fewer.push(self.size(a) - self.size(&less));
                less
            }
            None => a.clone(),
        });
        (simple.collect(), fewer)
    }

    /// By how much, in units of the gain, a set must beat one that it contains with so many parameters less each: a further
    /// step, tested once.
    pub fn beyond(&self, fewer: &[f64], unit: f64) -> f64 {
        self.resolution() + unit * fewer.iter().map(|k| chi2_quantile(ALPHA, *k)).sum::<f64>()
    }
}
