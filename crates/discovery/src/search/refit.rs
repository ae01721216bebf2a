//! Fits of sets of additions, warm-started from a fit of a similar set.

use super::heterogeneity::heterogeneity;
use crate::addition::{Addition, labels};
use crate::columns::{Family, library_candidates};
use crate::fit::{ChosenRecords, Fit, fit, fit_below};
use crate::hypothesis::Hypothesis;
use crate::options::Clock;
use crate::records::View;
use crate::score::Scored;
use crate::statistics::chi2_tail;
use augsim_system::{Per, ScatterPer, System};

/// Level of the whole search: probability that an effect is named although the model is complete.
pub(crate) const ALPHA: f64 = 0.01;

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

/// Initial values of a fit. Additions without values start at a fraction of their typical size.
#[derive(Clone, Debug, Default)]
pub(crate) struct InitialValues {
    /// Estimates of new additions. Further entries of an addition are other starts, from each of which it is fitted.
    pub new: Vec<(Addition, Vec<f64>)>,
    /// Values of new additions at which they have no influence, for those that can be fitted from there.
    pub nulls: Vec<(Addition, Vec<f64>)>,
    /// Solution of the linear problem for parameters of the fit that it was formed at: index in its theta, and value.
    pub shared: Vec<(usize, f64)>,
}

impl InitialValues {
    /// Estimates of new additions only.
    pub fn of_new(new: Vec<(Addition, Vec<f64>)>) -> Self {
        Self { new, ..Self::default() }
    }
}

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

    /// Fits `additions`, starting near the fit `from` at the cheapest of the points that `initial` gives. A set that was
    /// fitted before is returned as it was.
    pub fn refit(&self, from: &Fit, additions: &[Addition], initial: &InitialValues) -> Scored {
        let key = labels(additions);
        if let Some(known) = self.fitted.iter().find(|set| set.key() == key) {
            return known.clone();
        }
        let sample = self.sample();
        let mut h = Hypothesis::new(sample.data, additions);
        let theta = self.cheapest_start(from, &h, initial);
        let previous = &from.hypothesis;
        if let (Some(new), Some(known)) = (h.scatter.as_mut(), previous.scatter)
            && new.per == known.per
        {
            new.sd = known.sd;
        }
        let nuisances = self.initial_nuisances(from, &h, &theta);
        let fitted = self.retry_starts(fit(&sample, &h, &theta, &nuisances), &theta, &initial.new);
        let mut fitted = self.retry_shapes(fitted, &initial.new);
        let mut theta = fitted.theta.clone();
        if h.normalise_directions(&mut theta) {
            fitted = fit(&sample, &h, &theta, &fitted.nuisance);
        }
        Scored::new(&sample, &self.view.blocks, fitted)
    }

    /// Fits from the further starts of each addition, and keeps the best fit. `theta` are the initial values of the first.
    fn retry_starts(&self, found: Fit, theta: &[f64], starts: &[(Addition, Vec<f64>)]) -> Fit {
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
    fn retry_shapes(&self, found: Fit, starts: &[(Addition, Vec<f64>)]) -> Fit {
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
fn is_first_start(starts: &[(Addition, Vec<f64>)], k: usize) -> bool {
    starts[..k].iter().all(|(earlier, _)| *earlier != starts[k].0)
}
