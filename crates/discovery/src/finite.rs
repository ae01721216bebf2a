//! Check that all numbers of a result are finite.

use crate::DiscoveryError;
use crate::result::{Anatomy, Discovery, ErrorTable, Estimate, Rmse};
use std::collections::BTreeMap;

/// Returns the result if every number in it is finite.
///
/// # Errors
/// [`DiscoveryError::NotFinite`].
pub(crate) fn all_finite(found: Discovery, data: &str) -> Result<Discovery, DiscoveryError> {
    match numbers(&found).into_iter().find(|(_, value)| !value.is_finite()) {
        Some((place, value)) => Err(DiscoveryError::NotFinite { data: data.into(), place, value }),
        None => Ok(found),
    }
}

/// Every number of a result, with the name of the entry that contains it.
fn numbers(d: &Discovery) -> Vec<(&'static str, f64)> {
    let mut numbers = Vec::new();
    let mut put = |place: &'static str, values: &[f64]| numbers.extend(values.iter().map(|v| (place, *v)));
    put("calibrated", &estimates(&d.calibrated));
    put("parameters", &estimates(&d.parameters));
    for e in &d.effects {
        put("effects", &estimates(&e.parameters));
        put("effects", &[e.share]);
    }
    put("error", &table(&d.error));
    let n = &d.noise;
    put("noise", &n.by_channel);
    put("noise", &[n.sd, n.correlation.unwrap_or(0.0), n.jitter_s.unwrap_or(0.0)]);
    let t = &d.tests;
    let optional = [t.tables.unwrap_or(1.0), t.periodicity.unwrap_or(1.0)];
    put("tests", &[t.library, t.heterogeneity]);
    put("tests", &optional);
    put("anatomy", &anatomy(&d.anatomy));
    for row in &d.correlations.1 {
        put("correlations", row);
    }
    for row in d.unexplained.iter().flat_map(|u| &u.table) {
        put("unexplained", row);
    }
    for c in &d.candidates {
        put("candidates", &estimates(&c.parameters));
        put("candidates", &[c.gain, c.penalty]);
    }
    d.errors.values().for_each(|t| put("errors", &table(t)));
    put("independent", &[d.independent.unwrap_or(1.0)]);
    for e in d.horizons.iter().flat_map(|h| h.errors.values()) {
        let rows = [&e.declared, &e.calibrated, &e.augmented, &e.reduction];
        put("horizons", &rows.into_iter().flat_map(rmse).collect::<Vec<_>>());
    }
    numbers
}

fn rmse(r: &Rmse) -> [f64; 3] {
    [r.rmse, r.ci95[0], r.ci95[1]]
}

fn estimates(numbers: &BTreeMap<String, Estimate>) -> Vec<f64> {
    numbers
        .values()
        .flat_map(|e| [vec![e.value, e.ci95[0], e.ci95[1]], estimates(&e.groups)].concat())
        .collect()
}

fn table(t: &ErrorTable) -> Vec<f64> {
    let rows = [&t.declared, &t.calibrated, &t.augmented, &t.noise_floor, &t.reduction];
    let shares = [t.explained_share.unwrap_or(0.0), t.heldout_gain];
    rows.into_iter().flat_map(rmse).chain(shares).collect()
}

fn anatomy(a: &Anatomy) -> Vec<f64> {
    let bins = a.before.values().chain(a.after.values()).flatten().flat_map(|b| [b.x, b.mean, b.rms]);
    let lists =
        [&a.autocorrelation_before, &a.autocorrelation_after, &a.quantiles_before, &a.quantiles_after];
    bins.chain(lists.into_iter().flatten().copied()).collect()
}
