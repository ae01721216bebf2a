//! Thresholds, which no score test sees: they have no slope at their null.
//!
//! The overflow of a tank changes nothing until it is reached. Each threshold is put at a few places of the range that it
//! watches; one Gauss-Newton step from there foretells what a fit from there would gain.

use crate::addition::Addition;
use crate::candidates::may_join;
use crate::evaluate::Lanes;
use crate::fit::{ChosenRecords, Fit, assembled, reduce};
use crate::hypothesis::Hypothesis;

/// An addition with the place from which a fit of it begins, and the gain in cost that is foretold.
#[derive(Clone, Debug)]
pub(crate) struct Scanned {
    pub addition: Addition,
    pub start: Vec<f64>,
    pub gain: f64,
}

/// The best place of every threshold of `library` that may join a fit, best gain first.
pub(crate) fn scan(sample: &ChosenRecords<'_>, fit: &Fit, library: &[Addition]) -> Vec<Scanned> {
    let mut out: Vec<Scanned> = Vec::new();
    for addition in library.iter().filter(|a| may_join(a, &fit.hypothesis)) {
        let Addition::Effect(listed, _) = addition else { continue };
        let places = fit.hypothesis.system.scan_points(listed.index);
        let each = places.into_iter().filter_map(|start| {
            let gain = foretold(sample, fit, addition, &start)?;
            Some(Scanned { addition: addition.clone(), start, gain })
        });
        out.extend(each.max_by(|a, b| a.gain.total_cmp(&b.gain)));
    }
    out.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    out
}

/// The decrease in cost that a Gauss-Newton step from `start` leads to; `None` where nothing can be simulated there.
fn foretold(sample: &ChosenRecords<'_>, fit: &Fit, addition: &Addition, start: &[f64]) -> Option<f64> {
    sample.data.tally.score();
    let (h, theta) = with_one_more(sample, fit, addition, start);
    let lanes: Vec<Lanes> = sample.excerpts().into_iter().map(|at| Lanes::new(&h, at, &[])).collect();
    let there = assembled(sample, &h, &lanes, &theta, &fit.nuisance);
    let (s, u, starts) = reduce(&h, &lanes, &there, 0.0);
    let mut step = u.clone();
    s.cholesky().solve(&mut step);
    let promised = starts + u.iter().zip(&step).map(|(u, d)| u * d).sum::<f64>();
    let gain = fit.cost - there.iter().map(|n| n.q).sum::<f64>() + promised;
    gain.is_finite().then_some(gain)
}

/// The hypothesis of a fit with one addition more, and the values of the fit with those that this one starts from.
pub(crate) fn with_one_more(
    sample: &ChosenRecords<'_>,
    fit: &Fit,
    addition: &Addition,
    start: &[f64],
) -> (Hypothesis, Vec<f64>) {
    let mut additions = fit.hypothesis.additions.clone();
    additions.push(addition.clone());
    let h = Hypothesis::new(sample.data, &additions);
    let mut theta = h.theta_start(0.0);
    theta[..fit.theta.len()].copy_from_slice(&fit.theta);
    theta[h.range_of(additions.len() - 1)].copy_from_slice(start);
    (h, theta)
}
