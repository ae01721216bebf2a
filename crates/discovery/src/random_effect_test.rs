//! Random effects per record: whether the records support one, and its size.

use crate::fit::{ChosenRecords, Fit};
use crate::random_effect::{CommonFit, ScatterEstimate};
use crate::result::Estimate;
use crate::score::Scored;
use crate::search::{Penalty, Search};
use augsim_system::RecordRandomEffect;

/// A random effect that the records support.
pub(crate) struct RandomEffectEstimate {
    /// Gain, nats.
    pub gain: f64,
    /// Whether the model already declares it.
    pub is_declared: bool,
    /// Evidence of each window on the entries of theta that do not vary: entry, curvature, gradient.
    pub parts: Vec<Vec<(usize, f64, f64)>>,
}

/// Parameters that may vary between records in the system of a sample.
fn varying_parameters<'s>(sample: &'s ChosenRecords<'_>) -> Option<&'s RecordRandomEffect> {
    sample.data.system.schema().record_random_effect.as_ref()
}

/// The random effect beside a set, if its gain exceeds the penalty or the model declares it; `None` with too
/// few records or windows.
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

/// Fits and estimates the random effect beside the additions of a fit.
fn estimated(
    sample: &ChosenRecords<'_>,
    drawn: &RecordRandomEffect,
    fit: &Fit,
) -> Option<(CommonFit, ScatterEstimate)> {
    let shared = CommonFit::with(drawn, sample, fit, &fit.hypothesis.additions)?;
    let found = shared.estimate(sample)?;
    Some((shared, found))
}

/// Gain of the random effect beside a set, nats; 0 where there is none.
pub(crate) fn gain(search: &Search<'_>, set: &Scored) -> f64 {
    let sample = search.sample();
    varying_parameters(&sample)
        .and_then(|drawn| estimated(&sample, drawn, &set.fit))
        .map_or(0.0, |(_, found)| 0.5 * found.gain)
}

/// Standard deviation of the random effect at a fit to `sample`.
pub(crate) fn size(sample: &ChosenRecords<'_>, fit: &Fit) -> Option<Estimate> {
    let drawn = varying_parameters(sample)?;
    let (_, found) = estimated(sample, drawn, fit)?;
    let unit = drawn.scatter.parameters.first().map_or_else(String::new, |p| p.unit.clone());
    Some(Estimate { value: found.sd, ci95: found.ci95, unit, ..Estimate::default() })
}
