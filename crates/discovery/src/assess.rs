//! Assessment of a given set of effects: the attainable result if the effects are known beforehand.

use crate::addition::Addition;
use crate::columns::Family;
use crate::prepare::prepare;
use crate::random_effect_test;
use crate::search::{InitialValues, Search, calibrate_windows};
use crate::{DiscoveryError, Options, forecast};
use augsim_data::Dataset;
use augsim_system::{Declaration, ScatterPer, System};

/// Comparison of a given set of effects with the calibrated model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assessment {
    /// Gain over the calibrated model in the log predictive density of left-out blocks, nats.
    pub gain: f64,
    /// Penalty that the gain must exceed for the set to be selected, nats.
    pub penalty: f64,
    /// Root mean square prediction error of the set, in the unit of the channels, on the held-out records (on
    /// all records if none are held out).
    pub rmse: f64,
}

impl Assessment {
    /// Whether the gain exceeds the penalty, so that a search could find the effects.
    pub fn is_visible(&self) -> bool {
        self.gain > self.penalty
    }
}

/// Fits the calibrated model with the effects named `kinds` added, and scores it.
///
/// Their parameters start from half their typical sizes, with both signs where both are allowed. Unknown names
/// are ignored; a random effect varies as `per`.
///
/// # Errors
/// As [`discover`](fn@crate::discover).
pub fn assess(
    model: &dyn Declaration,
    data: &Dataset,
    kinds: &[&str],
    per: ScatterPer,
    options: &Options,
) -> Result<Assessment, DiscoveryError> {
    let prepared = prepare(model, data, options)?;
    let (view, base) = calibrate_windows(&prepared, &prepared.searched);
    let search = Search::new(&view, &[Family::Library, Family::Memory], &prepared.clock);
    let system: &dyn System = &*prepared.data.system;
    let additions: Vec<Addition> = kinds
        .iter()
        .filter_map(|kind| {
            let scatter = Addition::scatter(system, per).filter(|scatter| scatter.kind() == *kind);
            scatter.or_else(|| Addition::with_kind(system, kind))
        })
        .collect();
    let fits = (0..1usize << additions.len()).map(|bits| {
        let initial = |(i, a): (usize, &Addition)| {
            let p = a.parameters().first()?;
            let sign = if bits >> i & 1 == 1 && p.min < 0.0 { -1.0 } else { 1.0 };
            let further = a.parameters().iter().skip(1).map(|p| p.typical);
            Some((a.clone(), std::iter::once(0.5 * sign * p.typical).chain(further).collect()))
        };
        let starts: InitialValues = additions.iter().enumerate().filter_map(initial).collect();
        search.refit(&base.fit, &additions, &starts)
    });
    let best = fits
        .filter(|s| s.is_finite())
        .min_by(|a, b| a.evidence.cost.total_cmp(&b.evidence.cost))
        .unwrap_or_else(|| base.clone());
    let has_scatter = system
        .schema()
        .record_random_effect
        .as_ref()
        .is_some_and(|d| kinds.contains(&d.scatter.kind.as_str()));
    let scatter_gain = if has_scatter { random_effect_test::gain(&search, &best) } else { 0.0 };
    let shown_records = if prepared.held_out.is_empty() { &prepared.searched } else { &prepared.held_out };
    Ok(Assessment {
        gain: best.gain_over(&base, best.evidence.independence.share) + scatter_gain,
        penalty: search.penalty().of_set(&additions) + f64::from(u8::from(has_scatter)) * search.penalty().0,
        rmse: forecast::first_rmse(&prepared.sample(shown_records), &best.fit),
    })
}
