//! Random effects per record: whether the records support one, and its size.

use crate::addition::Addition;
use crate::fit::{ChosenRecords, Fit};
use crate::random_effect::{CommonFit, ScatterEstimate};
use crate::result::Estimate;
use crate::score::Scored;
use crate::search::{Penalty, Search, SearchResult, without};
use crate::statistics::chi2_tail;
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
    let (shared, found) = supported(&sample, drawn, &set.fit, penalty)?;
    let parts = shared.parts(&sample, &found.state.normals);
    Some(RandomEffectEstimate { gain: 0.5 * found.gain, is_declared: drawn.declared.is_some(), parts })
}

/// As [`estimated`], but `None` unless the gain exceeds the penalty or the model declares the random effect.
fn supported(
    sample: &ChosenRecords<'_>,
    drawn: &RecordRandomEffect,
    fit: &Fit,
    penalty: Penalty,
) -> Option<(CommonFit, ScatterEstimate)> {
    estimated(sample, drawn, fit)
        .filter(|(_, found)| 0.5 * found.gain > penalty.0 || drawn.declared.is_some())
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

/// Number of the addition of a set that is least significant beside the random effect per record; `None` if all are
/// significant, or the records support no random effect.
///
/// The search fits the effects without a random effect, and differences between a few records can look like an effect. The
/// test is that of the likelihood ratio, with the random effect in both models.
pub(crate) fn not_beside_random_effect(
    search: &Search<'_>,
    found: &mut SearchResult,
    named: usize,
) -> Option<usize> {
    let set = found.sets[named].clone();
    let sample = search.sample();
    let drawn = varying_parameters(&sample)?;
    if set.additions().is_empty() {
        return None;
    }
    let (shared, with_all) = supported(&sample, drawn, &set.fit, found.penalty)?;
    let deviance = shared.deviance(&sample, &with_all.state, with_all.dispersion);
    let mut worst: Option<(usize, f64)> = None;
    for (number, addition) in set.additions().iter().enumerate() {
        // Another random effect does not change predictions.
        if matches!(addition, Addition::Scatter(_)) {
            continue;
        }
        let is_mean = matches!(addition, Addition::Effect(listed, _) if listed.index == drawn.effect);
        let gain = if is_mean {
            // Both models have it, as the mean of the random effect.
            shared.wald_of_mean(&sample, &with_all)
        } else {
            let less = found.index_or_fit(search, &set, &without(set.additions(), number));
            let Some((shared, less)) = estimated(&sample, drawn, &found.sets[less].fit) else { continue };
            shared.deviance(&sample, &less.state, with_all.dispersion) - deviance
        };
        let parameters = set.fit.hypothesis.entries_of_addition(number).len();
        let excess = chi2_tail(gain.max(0.0), parameters as f64) / search.level(addition);
        if excess > 1.0 && worst.is_none_or(|(_, most)| excess > most) {
            worst = Some((number, excess));
        }
    }
    worst.map(|(number, _)| number)
}

/// Standard deviation of the random effect per record, estimated from `sample`; `None` if there is none.
pub(crate) fn size(sample: &ChosenRecords<'_>, fit: &Fit) -> Option<Estimate> {
    let drawn = varying_parameters(sample)?;
    let (_, found) = estimated(sample, drawn, fit)?;
    let unit = drawn.scatter.parameters.first().map_or_else(String::new, |p| p.unit.clone());
    Some(Estimate { value: found.sd, ci95: found.ci95, unit, ..Estimate::default() })
}
