//! Parameters that are drawn anew for each record: whether the records show that, and how widely.

use crate::drawn::{Estimated, Shared};
use crate::fit::{ChosenRecords, Fit};
use crate::result::Estimate;
use crate::score::Scored;
use crate::search::{Price, Search};
use augsim_physics::system::Drawn;
use std::collections::BTreeMap;

/// A scatter that the records show.
pub(crate) struct Scattered {
    /// Gain in nats.
    pub gain: f64,
    /// The model has it already.
    pub declared: bool,
    /// Evidence of each window on the entries of theta that are not drawn: entry, curvature, gradient.
    pub parts: Vec<Vec<(usize, f64, f64)>>,
}

/// Parameters that may be drawn anew for each record in the system of a sample.
fn drawn<'s>(sample: &'s ChosenRecords<'_>) -> Option<&'s Drawn> {
    sample.data.system.schema().drawn.as_ref()
}

/// The scatter beside a set, if it pays `price` nats or is declared; none where records are few or short.
pub(crate) fn scattered(search: &Search<'_>, set: &Scored, price: Price) -> Option<Scattered> {
    let sample = search.sample();
    let drawn = drawn(&sample)?;
    let declared = drawn.declared.is_some();
    let (shared, found) = estimated(&sample, drawn, &set.fit)?;
    let gain = 0.5 * found.gain;
    if gain <= price.0 && !declared {
        return None;
    }
    let parts = shared.parts(&sample, found.normals());
    Some(Scattered { gain, declared, parts })
}

fn estimated(sample: &ChosenRecords<'_>, drawn: &Drawn, fit: &Fit) -> Option<(Shared, Estimated)> {
    let shared = Shared::with(drawn, sample, fit, &fit.hypothesis.additions)?;
    let found = shared.estimate(sample)?;
    Some((shared, found))
}

/// Gain of the scatter beside a set, in nats; 0 where there is none.
pub(crate) fn gain(search: &Search<'_>, set: &Scored) -> f64 {
    let sample = search.sample();
    drawn(&sample)
        .and_then(|drawn| estimated(&sample, drawn, &set.fit))
        .map_or(0.0, |(_, found)| 0.5 * found.gain)
}

/// The standard deviation at a fit to `sample`.
pub(crate) fn size(sample: &ChosenRecords<'_>, fit: &Fit) -> Option<Estimate> {
    let drawn = drawn(sample)?;
    let (_, found) = estimated(sample, drawn, fit)?;
    let unit = drawn.scatter.parameters.first().map_or_else(String::new, |p| p.unit.clone());
    Some(Estimate { value: found.sd, ci95: found.ci95, unit, groups: BTreeMap::new() })
}
