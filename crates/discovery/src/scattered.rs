//! The search's side of parameters that are drawn anew for each record: when to believe it, and what it leaves of an answer.

use crate::addition::Addition;
use crate::confirmation::holds;
use crate::dispersion::Dispersion;
use crate::drawn::{Estimated, Shared};
use crate::evaluate::Normal;
use crate::fit::{ChosenRecords, Fit};
use crate::judged::{DrawnAt, Judged};
use crate::result::Estimate;
use crate::search::Search;
use augsim_physics::system::Drawn;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A scatter that the records confirm.
pub(crate) struct Scattered {
    /// Gain on the training part in -2 ln likelihood.
    pub gain: f64,
    /// The model has it already.
    pub declared: bool,
    /// The training windows at the values of their records.
    pub normals: Vec<Normal>,
    /// Evidence of each training window on the entries of theta that are not drawn: entry, curvature, gradient.
    pub parts: Vec<Vec<(usize, f64, f64)>>,
}

/// Parameters that may be drawn anew for each record in the system of a search.
fn drawn<'s>(sample: &'s ChosenRecords<'_>) -> Option<&'s Drawn> {
    sample.data.system.schema().drawn.as_ref()
}

/// Gain that chance would bring to an addition of so many parameters.
fn penalty(found: &Estimated, search: &Search<'_>, size: f64) -> f64 {
    let dispersion = Dispersion { factor: found.phi, clusters: found.freedom + 1.0 };
    search.resolution() / found.phi + dispersion.widened(search.quantile(size), size)
}

/// The estimate of draws at a set that a search tried, from the training part; none where its records are few or short.
fn estimated<'j>(search: &Search<'_>, judged: &'j Judged) -> Option<&'j DrawnAt> {
    let looked_at = || {
        let shared = Shared::with(drawn(&search.train)?, &search.train, &judged.fit, judged.additions())?;
        let found = shared.estimate(&search.train, None).map(Arc::new);
        Some((shared, found))
    };
    judged.memory.drawn.get_or_init(looked_at).as_ref()
}

/// The scatter at one of what a search tried, if it pays on the training part and holds on the other.
pub(crate) fn scattered(search: &Search<'_>, judged: &Judged) -> Option<Scattered> {
    let (train, test) = (&search.train, &search.test);
    let drawn = drawn(train)?;
    let (shared, found) = estimated(search, judged)?;
    let found = found.as_ref()?;
    let (gain, penalty, declared) = (found.gain, penalty(found, search, 1.0), drawn.declared.is_some());
    if gain <= penalty && !declared {
        return None;
    }
    let confirmed = declared || holds(gain - penalty, 0.5 * shared.gain_on(test, found));
    let parts = shared.parts(train, found.normals());
    confirmed.then(|| Scattered { gain, declared, normals: found.normals().to_vec(), parts })
}

/// Gain in cost on the training part of who is told to look for scatter, and what it has to exceed.
pub(crate) fn promise(search: &Search<'_>, judged: &Judged) -> Option<[f64; 2]> {
    let found = estimated(search, judged)?.1.as_ref()?;
    Some([found.gain, penalty(found, search, 1.0)].map(|x| x * found.phi))
}

/// Of the additions of a fit, those that still pay when each record may have values of its own: under scatter, laws gain by
/// chance. None where there is no scatter.
pub(crate) fn surviving_additions(search: &Search<'_>, judged: &Judged) -> Option<Vec<Addition>> {
    let (train, from) = (&search.train, &judged.fit);
    let drawn = drawn(train)?;
    let through = &train.data.system.library().get(drawn.through)?.kind;
    let mut additions = judged.additions().to_vec();
    let mut found = estimated(search, judged)?.1.clone()?;
    if found.gain <= penalty(&found, search, 1.0) {
        return None;
    }
    loop {
        let tried = additions.par_iter().filter_map(|addition| {
            let rest: Vec<Addition> = additions.iter().filter(|a| *a != addition).cloned().collect();
            let mut without = Shared::with(drawn, train, from, &rest)?;
            if addition.kind() == through {
                without = without.centre(train, from);
            }
            let gain = without.value(train, found.phi) - found.value;
            Some((gain - penalty(&found, search, search.size(addition)), rest))
        });
        let tried: Vec<_> = tried.collect();
        match tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((lead, rest)) if lead <= 0.0 => additions = rest,
            _ => return Some(additions),
        }
        match Shared::with(drawn, train, from, &additions)?.estimate(train, None) {
            Some(next) => found = Arc::new(next),
            None => return Some(additions),
        }
    }
}

/// The standard deviation at a fit to `sample`.
pub(crate) fn size(sample: &ChosenRecords<'_>, fit: &Fit) -> Option<Estimate> {
    let drawn = drawn(sample)?;
    let found = Shared::with(drawn, sample, fit, &fit.hypothesis.additions)?.estimate(sample, None)?;
    let unit = drawn.scatter.parameters.first().map_or_else(String::new, |p| p.unit.clone());
    Some(Estimate { value: found.sd, ci95: found.ci95, unit, groups: BTreeMap::new() })
}
