//! Sets of additions at the parameters under which a filter finds readings likeliest.

use crate::addition::Addition;
use crate::fit::Fit;
use crate::free_runs::whole;
use crate::hypothesis::Hypothesis;
use crate::record::Measured;
use crate::search::Search;
use augsim_calibrate::{Cause, FitIfShaken, Fitted, Known, Pushed, Readings, fit_if_shaken, smooth};
use augsim_physics::model::Per;
use augsim_physics::system::Record;

/// Samples that are filtered: so many tell a law from noise.
const MOST_SAMPLES: usize = 4_000;

/// The beginnings of recordings, to be filtered.
pub(crate) struct Filtered {
    records: Vec<Record>,
    declared: Vec<Option<f64>>,
}

impl Filtered {
    /// The first samples of the recordings of data; nothing where fits see no recording in several windows, or where values differ
    /// from group to group.
    pub fn of(data: &Measured) -> Option<Self> {
        let mut left = MOST_SAMPLES;
        let mut records = Vec::new();
        for index in 0..data.recordings.len() {
            let whole = whole(data, index, |_| true);
            let mut seen = whole.seen;
            let samples = seen.times.len().min(left);
            if samples < 2 {
                break;
            }
            left -= samples;
            for (values, weights) in seen.values.iter_mut().zip(&whole.weight) {
                values.iter_mut().zip(weights).filter(|(_, w)| **w == 0.0).for_each(|(v, _)| *v = f64::NAN);
                values.truncate(samples);
            }
            seen.times.truncate(samples);
            seen.windows.iter_mut().for_each(|window| window.samples = 0..samples);
            records.push(seen);
        }
        let declared = data.system.schema().channels.iter().map(|c| c.sd).collect();
        (!records.is_empty() && data.groups.len() == 1).then_some(Self { records, declared })
    }

    fn readings(&self) -> Readings<'_> {
        Readings { outputs: self.declared.len(), records: &self.records, declared: &self.declared }
    }
}

/// A set at its likeliest parameters.
pub(crate) struct Likeliest {
    hypothesis: Hypothesis,
    fit: FitIfShaken,
}

impl Likeliest {
    /// From the parameters of a fit over windows; nothing where readings differ from its runs by no more than noise of the sensor.
    pub fn of(readings: &Filtered, fit: &Fit) -> Option<Self> {
        let hypothesis = fit.hypothesis.clone();
        let (shown, pushed) = hypothesis.system.with_states_shown()?;
        let values = hypothesis.values_at(&fit.theta, 0);
        let Readings { outputs, records, declared } = readings.readings();
        let found = smooth(&*shown, outputs, records, &values, &pushed, declared).ok()?;
        if found.cause != Cause::Motion {
            return None;
        }
        Self::from(readings, hypothesis, &fit.theta, Known::Smoothed(&found))
    }

    /// Another set, from the parameters of this one on.
    pub fn beside(&self, readings: &Filtered, search: &Search<'_>, additions: &[Addition]) -> Option<Self> {
        let hypothesis = Hypothesis::new(search.train.data, additions);
        let theta = self.carried(&hypothesis);
        Self::from(readings, hypothesis, &theta, Known::Other(&self.fit))
    }

    fn from(readings: &Filtered, hypothesis: Hypothesis, theta: &[f64], known: Known<'_>) -> Option<Self> {
        let (shown, pushed) = hypothesis.system.with_states_shown()?;
        let values = hypothesis.values_at(theta, 0);
        let model = Pushed { system: &*shown, states: &pushed, values: &values };
        let fit = fit_if_shaken(readings.readings(), model, &fitted(&hypothesis), known).ok()?;
        fit.ln_likelihood.is_finite().then_some(Self { hypothesis, fit })
    }

    pub fn additions(&self) -> &[Addition] {
        &self.hypothesis.additions
    }

    pub fn ln_likelihood(&self) -> f64 {
        self.fit.ln_likelihood
    }

    /// Parameters of another hypothesis as this set has them; of what it has not, where a fit begins.
    fn carried(&self, other: &Hypothesis) -> Vec<f64> {
        let own = theta_of(&self.hypothesis, &self.fit.values);
        let mut theta = other.theta_start(0.2);
        theta[..other.range_of_declared()].copy_from_slice(&other.declared_from(&self.hypothesis, &own));
        other.carry_additions(&mut theta, &self.hypothesis, &own);
        theta
    }
}

/// Parameters of a hypothesis that are fitted on data of one group.
fn fitted(hypothesis: &Hypothesis) -> Vec<Fitted> {
    let common = hypothesis.free.iter().filter(|f| f.per != Per::Trajectory);
    common.map(|f| (f.index, [f.min, f.max])).collect()
}

/// Entries of theta, on data of one group, from values of all parameters.
fn theta_of(hypothesis: &Hypothesis, values: &[f64]) -> Vec<f64> {
    fitted(hypothesis).iter().map(|(index, _)| values[*index]).collect()
}
