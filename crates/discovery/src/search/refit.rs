//! Fits of sets of additions, warm-started from a fit of a similar set.

use crate::addition::{Addition, labels};
use crate::calibrate::calibration_start;
use crate::columns::{Family, library_candidates};
use crate::evaluate::{Lanes, rough_event_value};
use crate::fit::{ChosenRecords, Fit, fit, fit_below};
use crate::hypothesis::Hypothesis;
use crate::options::Clock;
use crate::records::View;
use crate::score::Scored;
use crate::search::heterogeneity::heterogeneity;
use crate::statistics::chi2_tail;
use augsim_system::{Per, ScatterPer, System};

/// Level of the whole search: probability that an effect is named although the model is complete.
pub(crate) const ALPHA: f64 = 0.01;
/// Maximum initial offset of the events' parameter, in units of the largest standard deviation of its random
/// effect.
const MAX_INITIAL_OFFSET: f64 = 0.6;
/// Initial value of an addition without an estimate, as a fraction of its typical size.
const INITIAL_FRACTION: f64 = 0.2;

/// Penalty of an addition that is tried at a single grid point, nats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Penalty(pub f64);

impl Penalty {
    /// Penalty of an addition, nats. It grows with the number of grid points at which the addition is tried.
    pub fn of_addition(self, addition: &Addition) -> f64 {
        self.0 + addition.grid_points().ln()
    }

    /// Penalty of a set of additions, nats.
    pub fn of_set(self, additions: &[Addition]) -> f64 {
        additions.iter().map(|addition| self.of_addition(addition)).sum()
    }
}

/// Initial parameter values of additions. Additions without an entry start at a fraction of their typical
/// size; further entries of an addition are other starts, from each of which it is fitted.
pub(crate) type InitialValues = Vec<(Addition, Vec<f64>)>;

/// Context of a search: data in windows of one length, and the candidate effects.
pub(crate) struct Search<'a> {
    pub view: &'a View,
    pub library: Vec<Addition>,
    /// Families of the candidates in `library`.
    pub families: Vec<Family>,
    /// Number of tested candidates: those in `library`, and two kinds of random effects.
    pub candidates: f64,
    /// Sets that an earlier search fitted to the same data. They are not fitted again.
    pub fitted: &'a [Scored],
    pub clock: Clock,
}

impl<'a> Search<'a> {
    pub fn new(view: &'a View, families: &[Family], clock: &Clock) -> Self {
        let data = view.sample().data;
        let library: Vec<Addition> =
            families.iter().flat_map(|family| library_candidates(data, &view.blocks, *family)).collect();
        let candidates = library.len() as f64 + 2.0;
        Self { view, library, families: families.to_vec(), candidates, fitted: &[], clock: clock.clone() }
    }

    /// Penalty of an effect tried at one grid point: the log odds against one of this many candidates by
    /// chance.
    pub fn penalty(&self) -> Penalty {
        Penalty((self.candidates / ALPHA).ln())
    }

    /// Level at which the coefficients of an addition must be significant, corrected for the number of
    /// candidates and grid points.
    pub fn level(&self, addition: &Addition) -> f64 {
        ALPHA / (self.candidates * addition.grid_points())
    }

    pub fn sample(&self) -> ChosenRecords<'a> {
        self.view.sample()
    }

    pub fn system(&self) -> &'a dyn System {
        &*self.sample().data.system
    }

    /// Index of the events' parameter in the system's parameters; `None` if the system has no events.
    pub fn event_parameter(&self) -> Option<usize> {
        self.system().schema().event.as_ref().map(|e| e.parameter)
    }

    /// Fits `additions`, starting from the fit `from`. Shared parameters keep their values; new additions
    /// start at `starts`. A set that was fitted before is returned as it was.
    pub fn refit(&self, from: &Fit, additions: &[Addition], starts: &InitialValues) -> Scored {
        let key = labels(additions);
        if let Some(known) = self.fitted.iter().find(|set| set.key() == key) {
            return known.clone();
        }
        let sample = self.sample();
        let mut h = Hypothesis::new(sample.data, additions);
        let theta = self.initial_theta_for(from, &h, starts);
        let previous = &from.hypothesis;
        if let (Some(new), Some(known)) = (h.scatter.as_mut(), previous.scatter)
            && new.per == known.per
        {
            new.sd = known.sd;
        }
        let nuisances = self.initial_nuisances(from, &h, &theta);
        let fitted = self.retry_starts(fit(&sample, &h, &theta, &nuisances), &theta, starts);
        let mut fitted = self.retry_shapes(fitted, starts);
        let mut theta = fitted.theta.clone();
        if h.normalise_directions(&mut theta) {
            fitted = fit(&sample, &h, &theta, &fitted.nuisance);
        }
        Scored::new(&sample, &self.view.blocks, fitted)
    }

    /// Fits from the further starts of each addition, and keeps the best fit. `theta` are the initial values of the first.
    fn retry_starts(&self, found: Fit, theta: &[f64], starts: &InitialValues) -> Fit {
        let mut best = found;
        for (k, (addition, values)) in starts.iter().enumerate() {
            let number = best.hypothesis.additions.iter().position(|a| a == addition);
            let Some(number) = number.filter(|_| !is_first_start(starts, k) && !self.clock.is_over()) else {
                continue;
            };
            let entries = best.hypothesis.entries_of_addition(number);
            if entries.len() != values.len() {
                continue;
            }
            let mut start = theta.to_vec();
            start[entries].copy_from_slice(values);
            best = self.better_from(best, &start);
        }
        best
    }

    /// The better one of a fit and another of the same set that starts from `theta`.
    fn better_from(&self, best: Fit, theta: &[f64]) -> Fit {
        let other = fit_below(&self.sample(), &best.hypothesis, theta, &best.nuisance, best.cost);
        if other.cost < best.cost { other } else { best }
    }

    /// Refits from other grid points if a shape parameter of a new effect reached a bound, and keeps the
    /// better fit. Far from the solution, a jump fits better the narrower it is, so that its width shrinks to
    /// the bound.
    fn retry_shapes(&self, found: Fit, starts: &InitialValues) -> Fit {
        let system = self.system();
        let mut best = found;
        for (k, (addition, start)) in starts.iter().enumerate() {
            // With values by group the shape was fitted before, with one value.
            let Addition::Effect(listed, Per::All) = addition else { continue };
            if !is_first_start(starts, k) {
                continue;
            }
            let Some(number) = best.hypothesis.additions.iter().position(|a| a == addition) else { continue };
            let entries = best.hypothesis.entries_of_addition(number);
            let amplitudes = listed.effect.amplitude_count.unwrap_or(entries.len());
            let bounds = best.hypothesis.fit_bounds();
            let is_trapped = entries
                .clone()
                .skip(amplitudes)
                .any(|i| best.theta[i] <= bounds[i].0 || best.theta[i] >= bounds[i].1);
            if start.len() != entries.len() || !is_trapped || !system.scan_points(listed.index).is_empty() {
                continue;
            }
            for point in system.null_points(listed.index) {
                let mut theta = best.theta.clone();
                for (k, i) in entries.clone().enumerate() {
                    let value = if k < amplitudes { start[k] } else { point[k] };
                    theta[i] = value.clamp(bounds[i].0, bounds[i].1);
                }
                best = self.better_from(best, &theta);
            }
        }
        best
    }

    /// Initial theta (shared parameters) of hypothesis `h`, from the fit `from` and the values `starts` of
    /// new additions.
    fn initial_theta_for(&self, from: &Fit, h: &Hypothesis, starts: &InitialValues) -> Vec<f64> {
        let previous = &from.hypothesis;
        let base = h.declared_entries();
        let mut theta = h.initial_theta(INITIAL_FRACTION);
        if h.scatter.map(|s| s.per) == previous.scatter.map(|s| s.per) {
            theta[..base].copy_from_slice(&h.declared_from(previous, &from.theta));
        } else {
            // A fit without random effect can be far off if the scatter is large, so the declared
            // parameters restart as well.
            theta[..base].copy_from_slice(&calibration_start(&self.sample(), h)[..base]);
        }
        h.copy_additions(&mut theta, previous, &from.theta);
        let bounds = h.fit_bounds();
        for (number, addition) in h.additions.iter().enumerate() {
            let entries = h.entries_of_addition(number);
            let start = starts.iter().find(|(a, v)| a == addition && v.len() == entries.len());
            if let Some((_, values)) = start.filter(|_| !previous.additions.contains(addition)) {
                // Groupwise values are given as differences from the common value.
                let is_difference = matches!(addition, Addition::Split(_));
                for (i, v) in entries.zip(values) {
                    let base = if is_difference { theta[i] } else { 0.0 };
                    theta[i] = (base + v).clamp(bounds[i].0, bounds[i].1);
                }
            }
        }
        theta
    }

    /// Initial nuisances (initial state, record parameters, event offsets) of the windows, from those of the
    /// fit `from`. If the random effect of the events changes, their offsets are dropped or start at rough
    /// values.
    fn initial_nuisances(&self, from: &Fit, h: &Hypothesis, theta: &[f64]) -> Vec<Vec<f64>> {
        let added = |h: &Hypothesis| -> Vec<Addition> {
            h.additions.iter().filter(|a| a.has_states()).cloned().collect()
        };
        if added(&from.hypothesis) != added(h) {
            // The states of effects differ: their initial values are computed from the records again.
            let declared = self.system().schema().free_states().count();
            return from.nuisance.iter().map(|n| n.iter().take(declared).copied().collect()).collect();
        }
        let is_same_scatter = from.hypothesis.scatter.map(|s| s.per) == h.scatter.map(|s| s.per);
        let Some(event) = self.event_parameter().filter(|_| !is_same_scatter) else {
            return from.nuisance.clone();
        };
        let entries = h.entries_of_parameter(event);
        let bound = MAX_INITIAL_OFFSET * self.max_scatter_sd();
        let sample = self.sample();
        let initial = |(window, n): (crate::record::RecordWindow<'_>, &Vec<f64>)| {
            let record = window.record;
            // A fit without random effect compensates with wrong initial states, so these restart.
            let plain = Lanes::new(h, window, &[]);
            let mut n = if h.scatter.is_some() { plain.initial_nuisance(h, window) } else { n.clone() };
            n.truncate(plain.state_nuisances());
            let common = match &entries {
                None => h.values[event],
                Some(p) => theta[p.start + if p.len() > 1 { record.data.group } else { 0 }],
            };
            let rough = |r: f64| (r - common).clamp(-bound, bound);
            match h.scatter.map(|s| s.per) {
                None => {}
                Some(ScatterPer::Event) => n.extend(record.data.events.iter().map(|e| rough(e.value))),
                Some(ScatterPer::Record) if record.data.events.is_empty() => {}
                Some(ScatterPer::Record) => n.push(rough(rough_event_value(record))),
            }
            n
        };
        sample.windows().into_iter().zip(&from.nuisance).map(initial).collect()
    }

    /// Largest allowed standard deviation of the events' random effect, in the unit of the parameter.
    fn max_scatter_sd(&self) -> f64 {
        let event = self.system().schema().event.as_ref();
        event.and_then(|e| e.scatter.parameters.first()).map_or(f64::INFINITY, |p| p.max)
    }

    /// Candidate random effects of the events' parameter: per event and per record. None for a system without
    /// events.
    pub fn scatters(&self) -> Vec<Addition> {
        let ways = [ScatterPer::Event, ScatterPer::Record];
        let random_effects = ways.iter().filter_map(|&per| Addition::scatter(self.system(), per));
        random_effects.filter(|a| self.view.sample().data.effects.allows(a.kind())).collect()
    }

    /// Whether the events' parameter differs between records, with a p-value below `p`.
    pub fn do_events_vary(&self, fit: &Fit, p: f64) -> bool {
        let Some(range) = self.event_parameter().and_then(|i| fit.hypothesis.entries_of_parameter(i)) else {
            return false;
        };
        let entries = &heterogeneity(&self.sample(), fit)[range];
        let (q, df) = entries.iter().fold((0.0, 0.0), |a, e| (a.0 + e.0.max(0.0), a.1 + e.1.max(0.0)));
        df > 0.0 && chi2_tail(q, df) < p
    }

    /// The simpler effect that an addition becomes at null values of some of its parameters; `None` if there
    /// is none.
    pub fn simpler_form(&self, addition: &Addition) -> Option<Addition> {
        let kind = addition.listed()?.reduces_to.as_ref()?;
        self.library.iter().find(|a| a.kind() == kind && matches!(a, Addition::Effect(_, Per::All))).cloned()
    }
}

/// Whether entry `k` of the initial values is the first of its addition.
fn is_first_start(starts: &InitialValues, k: usize) -> bool {
    starts[..k].iter().all(|(earlier, _)| *earlier != starts[k].0)
}
