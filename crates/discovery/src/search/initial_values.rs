//! Initial values of a fit of a set of additions, from the fit of another set and the linear problem there.

use super::refit::{InitialValues, Search};
use crate::addition::Addition;
use crate::calibrate::calibration_start;
use crate::evaluate::{Lanes, rough_event_value};
use crate::fit::{Fit, cost_at};
use crate::hypothesis::Hypothesis;
use crate::record::RecordWindow;
use augsim_system::ScatterPer;

/// Maximum initial offset of the events' parameter, in units of the largest standard deviation of its random
/// effect.
const MAX_INITIAL_OFFSET: f64 = 0.6;
/// Initial value of an addition without an estimate, as a fraction of its typical size.
const INITIAL_FRACTION: f64 = 0.2;

impl Search<'_> {
    /// Initial theta (shared parameters) of hypothesis `h`: of the points that `initial` gives, the one of least cost.
    ///
    /// New effects at their estimates alone fit badly if the other parameters were biased without them. The solution of the
    /// linear problem moves all parameters, but may go too far where the model is nonlinear. Without influence of the new
    /// effects the cost is that of the fit `from`, from which the first step of the fit is the linear solution, shortened
    /// where needed.
    pub(super) fn cheapest_start(&self, from: &Fit, h: &Hypothesis, initial: &InitialValues) -> Vec<f64> {
        let mut points = vec![self.initial_theta(from, h, &from.theta, &initial.new)];
        if !initial.shared.is_empty() {
            let mut shared = from.theta.clone();
            initial.shared.iter().for_each(|(i, value)| shared[*i] = *value);
            points.push(self.initial_theta(from, h, &shared, &initial.new));
        }
        if !initial.nulls.is_empty() {
            let new = [&initial.nulls[..], &initial.new[..]].concat();
            points.push(self.initial_theta(from, h, &from.theta, &new));
        }
        if points.len() == 1 {
            return points.remove(0);
        }
        let sample = self.sample();
        let cost = |theta: &Vec<f64>| cost_at(&sample, h, theta, &self.initial_nuisances(from, h, theta));
        let costs: Vec<f64> = points.iter().map(cost).collect();
        let least = (0..costs.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(0);
        points.swap_remove(least)
    }

    /// Theta (the shared parameters) of hypothesis `h` with the values `shared` of the theta of the fit `from`, and the
    /// values `new` of new additions.
    fn initial_theta(
        &self,
        from: &Fit,
        h: &Hypothesis,
        shared: &[f64],
        new: &[(Addition, Vec<f64>)],
    ) -> Vec<f64> {
        let previous = &from.hypothesis;
        let base = h.declared_entries();
        let mut theta = h.initial_theta(INITIAL_FRACTION);
        if h.scatter.map(|s| s.per) == previous.scatter.map(|s| s.per) {
            theta[..base].copy_from_slice(&h.declared_from(previous, shared));
        } else {
            // A fit without random effect can be far off if the scatter is large, so the declared
            // parameters restart as well.
            theta[..base].copy_from_slice(&calibration_start(&self.sample(), h)[..base]);
        }
        h.copy_additions(&mut theta, previous, shared);
        let bounds = h.fit_bounds();
        theta.iter_mut().zip(&bounds).for_each(|(value, (low, high))| *value = value.clamp(*low, *high));
        for (number, addition) in h.additions.iter().enumerate() {
            let entries = h.entries_of_addition(number);
            let start = new.iter().find(|(a, v)| a == addition && v.len() == entries.len());
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
    pub(super) fn initial_nuisances(&self, from: &Fit, h: &Hypothesis, theta: &[f64]) -> Vec<Vec<f64>> {
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
        let initial = |(window, n): (RecordWindow<'_>, &Vec<f64>)| {
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
}
