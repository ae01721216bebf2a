//! Fits of sets of additions, each from the place of a fit that is near.

use crate::addition::Addition;
use crate::calibrate::calibration_start;
use crate::columns::{Family, library};
use crate::cut::Clock;
use crate::evaluate::{Lanes, rough_event_value};
use crate::fit::{ChosenRecords, Fit, fit};
use crate::hypothesis::Hypothesis;
use crate::records::View;
use crate::score::Scored;
use crate::search::heterogeneity::heterogeneity;
use crate::statistics::chi2_tail;
use augsim_physics::model::Per;
use augsim_physics::system::{ScatterPer, System};

/// Probability that data of a complete model name an effect.
pub(crate) const ALPHA: f64 = 0.01;
/// Largest rough offset of the events' parameter that a fit begins with, in units of the largest scatter.
const MOST_OF_AN_OFFSET: f64 = 0.6;
/// Share of its typical size that an addition begins with where nothing is known of it.
const BEGIN: f64 = 0.2;

/// Price of additions, in nats: that of one at a single point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Price(pub f64);

impl Price {
    /// Nats that an addition has to gain: one with shapes to choose from pays for each point that it is tried at.
    pub fn of(self, addition: &Addition) -> f64 {
        self.0 + addition.tries().ln()
    }

    /// Nats that a set has to gain.
    pub fn of_set(self, additions: &[Addition]) -> f64 {
        additions.iter().map(|addition| self.of(addition)).sum()
    }
}

/// Additions with the values that they begin at; none: at a share of the typical size.
pub(crate) type Starts = Vec<(Addition, Vec<f64>)>;

/// Ground of a search: data in windows of one length, and what may be added.
pub(crate) struct Search<'a> {
    pub view: &'a View,
    pub library: Vec<Addition>,
    /// How many candidates are tested: each addition of the library, and two kinds of scatter.
    pub candidates: f64,
    pub clock: Clock,
}

impl<'a> Search<'a> {
    pub fn new(view: &'a View, families: &[Family], clock: &Clock) -> Self {
        let data = view.sample().data;
        let library: Vec<Addition> = families.iter().flat_map(|family| library(data, *family)).collect();
        let candidates = library.len() as f64 + 2.0;
        Self { view, library, candidates, clock: clock.clone() }
    }

    /// Nats that an effect has to gain: odds against one of so many candidates by chance.
    pub fn price(&self) -> Price {
        Price((self.candidates / ALPHA).ln())
    }

    /// Probability below which the amount of an addition is significant: that of one of so many candidates, at the best of its points.
    pub fn level(&self, addition: &Addition) -> f64 {
        ALPHA / (self.candidates * addition.tries())
    }

    pub fn sample(&self) -> ChosenRecords<'a> {
        self.view.sample()
    }

    pub fn system(&self) -> &'a dyn System {
        &*self.sample().data.system
    }

    /// Index of the parameter of the events, where the system has events.
    pub fn event_parameter(&self) -> Option<usize> {
        self.system().schema().event.as_ref().map(|e| e.parameter)
    }

    /// Fits `additions` as warm as possible from `from`: parameters that both have keep their values, others begin at `starts`.
    pub fn refit(&self, from: &Fit, additions: &[Addition], starts: &Starts) -> Scored {
        let sample = self.sample();
        let mut h = Hypothesis::new(sample.data, additions);
        let theta = self.starting_values(from, &h, starts);
        let old = &from.hypothesis;
        if let (Some(new), Some(known)) = (h.scatter.as_mut(), old.scatter)
            && new.per == known.per
        {
            new.sd = known.sd;
        }
        let own = self.starting_own(from, &h, &theta);
        let mut fitted = self.freed(fit(&sample, &h, &theta, &own), starts);
        let mut theta = fitted.theta.clone();
        if h.bring_round(&mut theta) {
            fitted = fit(&sample, &h, &theta, &fitted.nuisance);
        }
        Scored::new(&sample, &self.view.blocks, fitted)
    }

    /// The fit, or a better one that begins at another shape of a new effect whose shape ran into a bound: from a start that is far off, a
    /// jump looks as well the narrower it is, and the step that would widen it is not seen.
    fn freed(&self, found: Fit, starts: &Starts) -> Fit {
        let system = self.system();
        let mut best = found;
        for (addition, start) in starts {
            let Addition::Effect(listed, _) = addition else { continue };
            let Some(number) = best.hypothesis.additions.iter().position(|a| a == addition) else { continue };
            let own = best.hypothesis.range_of(number);
            let amounts = listed.effect.amounts.unwrap_or(own.len());
            let bounds = best.hypothesis.bounds();
            let is_trapped = own
                .clone()
                .skip(amounts)
                .any(|i| best.theta[i] <= bounds[i].0 || best.theta[i] >= bounds[i].1);
            if start.len() != own.len() || !is_trapped || !system.scan_points(listed.index).is_empty() {
                continue;
            }
            for point in system.null_points(listed.index) {
                let mut theta = best.theta.clone();
                for (k, i) in own.clone().enumerate() {
                    let value = if k < amounts { start[k] } else { point[k] };
                    theta[i] = value.clamp(bounds[i].0, bounds[i].1);
                }
                let other = fit(&self.sample(), &best.hypothesis, &theta, &best.nuisance);
                if other.cost < best.cost {
                    best = other;
                }
            }
        }
        best
    }

    /// Values of a hypothesis to begin a fit at.
    fn starting_values(&self, from: &Fit, h: &Hypothesis, starts: &Starts) -> Vec<f64> {
        let old = &from.hypothesis;
        let base = h.range_of_declared();
        let mut theta = h.theta_start(BEGIN);
        if h.scatter.map(|s| s.per) == old.scatter.map(|s| s.per) {
            theta[..base].copy_from_slice(&h.declared_from(old, &from.theta));
        } else {
            // A fit without scatter can sit far off when the scatter is large: the declared part begins anew as well.
            theta[..base].copy_from_slice(&calibration_start(&self.sample(), h)[..base]);
        }
        h.carry_additions(&mut theta, old, &from.theta);
        let bounds = h.bounds();
        for (number, addition) in h.additions.iter().enumerate() {
            let place = h.range_of(number);
            let known = starts.iter().find(|(a, v)| a == addition && v.len() == place.len());
            if let Some((_, values)) = known.filter(|_| !old.additions.contains(addition)) {
                // Values by group begin as differences from the common one.
                let differ = matches!(addition, Addition::Split(_));
                for (i, v) in place.zip(values) {
                    let from = if differ { theta[i] } else { 0.0 };
                    theta[i] = (from + v).clamp(bounds[i].0, bounds[i].1);
                }
            }
        }
        theta
    }

    /// Starts and offsets of the windows to begin a fit at: offsets of the events' parameter are cut, or begin at its rough values.
    fn starting_own(&self, from: &Fit, h: &Hypothesis, theta: &[f64]) -> Vec<Vec<f64>> {
        let same = from.hypothesis.scatter.map(|s| s.per) == h.scatter.map(|s| s.per);
        let Some(event) = self.event_parameter().filter(|_| !same) else { return from.nuisance.clone() };
        let place = h.entries_of(event);
        let bound = MOST_OF_AN_OFFSET * self.most_scatter();
        let sample = self.sample();
        let own = |(at, n): (crate::record::Excerpt<'_>, &Vec<f64>)| {
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
        };
        sample.excerpts().into_iter().zip(&from.nuisance).map(own).collect()
    }

    /// Largest standard deviation of the scatter of the events' parameter, in its unit.
    fn most_scatter(&self) -> f64 {
        let event = self.system().schema().event.as_ref();
        event.and_then(|e| e.scatter.parameters.first()).map_or(f64::INFINITY, |p| p.max)
    }

    /// The scatters that the events' parameter may have; none for a system without events.
    pub fn scatters(&self) -> Vec<Addition> {
        let ways = [ScatterPer::Event, ScatterPer::Record];
        ways.iter().filter_map(|&per| Addition::scatter(self.system(), per)).collect()
    }

    /// Whether the parameter of the events differs from record to record by more than chance does with probability `p`.
    pub fn events_vary(&self, fit: &Fit, p: f64) -> bool {
        let Some(place) = self.event_parameter().and_then(|i| fit.hypothesis.entries_of(i)) else {
            return false;
        };
        let entries = &heterogeneity(&self.sample(), fit)[place];
        let (q, df) = entries.iter().fold((0.0, 0.0), |a, e| (a.0 + e.0.max(0.0), a.1 + e.1.max(0.0)));
        df > 0.0 && chi2_tail(q, df) < p
    }

    /// The simpler effect that an addition turns into where some of its parameters have their nulls.
    pub fn contained(&self, addition: &Addition) -> Option<Addition> {
        let kind = addition.listed()?.contains.as_ref()?;
        self.library.iter().find(|a| a.kind() == kind && matches!(a, Addition::Effect(_, Per::All))).cloned()
    }
}
