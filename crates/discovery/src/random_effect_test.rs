//! Random effects per record: whether the records support one, and its size.

use crate::fit::{ChosenRecords, Fit};
use crate::random_effect::{CommonFit, ScatterEstimate};
use crate::result::Estimate;
use crate::score::Scored;
use crate::search::{Penalty, Search};
use augsim_system::RecordRandomEffect;

/// A random effect per record that the records support, with its gain.
pub(crate) struct RandomEffectEstimate {
    /// Gain in log likelihood over a model without the random effect, nats.
    pub gain: f64,
    /// Whether the model already declares the random effect.
    pub is_declared: bool,
    /// For each window, its contribution to the cost in the parameters that do not vary between records. Each
    /// entry is (index in the shared parameters, curvature, gradient).
    pub parts: Vec<Vec<(usize, f64, f64)>>,
}

/// Parameters that may vary between records, as the system of a sample declares them; `None` if it has none.
fn varying_parameters<'s>(sample: &'s ChosenRecords<'_>) -> Option<&'s RecordRandomEffect> {
    sample.data.system.schema().record_random_effect.as_ref()
}

/// Finds a random effect per record beside a set of effects, if its gain exceeds the penalty or the model
/// declares it. `None` otherwise, and with too few records or windows.
pub(crate) fn find_random_effect(
    search: &Search<'_>,
    set: &Scored,
    penalty: Penalty,
) -> Option<RandomEffectEstimate> {
    let sample = search.sample();
    let drawn = varying_parameters(&sample)?;
    let is_declared = drawn.declared.is_some();
    let (shared, found) = estimated(&sample, drawn, &set.fit)?;
    let gain = 0.5 * found.gain;
    if gain <= penalty.0 && !is_declared {
        return None;
    }
    let parts = shared.parts(&sample, &found.state.normals);
    Some(RandomEffectEstimate { gain, is_declared, parts })
}

/// Fits the model with the random effect per record beside the additions of `fit`, and estimates its size.
fn estimated(
    sample: &ChosenRecords<'_>,
    drawn: &RecordRandomEffect,
    fit: &Fit,
) -> Option<(CommonFit, ScatterEstimate)> {
    let shared = CommonFit::with(drawn, sample, fit, &fit.hypothesis.additions)?;
    let found = shared.estimate(sample)?;
    Some((shared, found))
}

/// Gain of a random effect per record beside a set of effects, nats; 0 if there is none.
pub(crate) fn gain(search: &Search<'_>, set: &Scored) -> f64 {
    let sample = search.sample();
    varying_parameters(&sample)
        .and_then(|drawn| estimated(&sample, drawn, &set.fit))
        .map_or(0.0, |(_, found)| 0.5 * found.gain)
}

/// Standard deviation of the random effect per record, estimated from `sample`; `None` if there is none.
pub(crate) fn size(sample: &ChosenRecords<'_>, fit: &Fit) -> Option<Estimate> {
    let drawn = varying_parameters(sample)?;
    let (_, found) = estimated(sample, drawn, fit)?;
    let unit = drawn.scatter.parameters.first().map_or_else(String::new, |p| p.unit.clone());
    Some(Estimate { value: found.sd, ci95: found.ci95, unit, ..Estimate::default() })
}
