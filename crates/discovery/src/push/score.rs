//! What an addition promises at a fit, before it is fitted.

use super::evaluate::Piece;
use super::fit::{Fit, Sample};
use super::hypothesis::{Hypothesis, polar, probe};
use crate::dispersion::{Dispersion, dispersion};
use crate::linear::Square;
use augsim_physics::model::PushModel;
use augsim_physics::push::effects::spec_of;
use rayon::prelude::*;
use std::ops::Range;

/// An addition tested at a fit, by one Gauss-Newton step from its probe.
#[derive(Clone, Debug)]
pub(crate) struct Score {
    pub kind: &'static str,
    /// Predicted gain in cost.
    pub gain: f64,
    pub dispersion: Dispersion,
    /// Where a fit with it begins.
    pub theta: Vec<f64>,
}

impl Score {
    /// The gain in units of its dispersion.
    pub fn evidence(&self) -> f64 {
        self.gain / self.dispersion.factor
    }
}

impl Sample<'_> {
    /// Dispersion of the globals in `range`, the others eliminated.
    pub fn dispersion(&self, pieces: &[Piece], p: usize, range: Range<usize>) -> Dispersion {
        let (s, u, each) = self.normal(pieces, p);
        dispersion(&s, &u, &each, range, self.data.noise.white_share())
    }
}

impl Fit {
    /// Dispersion of the parameters of one kind; of all, for a kind without parameters.
    pub fn dispersion_of(&self, sample: &Sample<'_>, kind: &str) -> Dispersion {
        let (p, range) = (self.theta.len(), self.hypothesis.range_of(kind));
        sample.dispersion(&self.pieces, p, if range.is_empty() { 0..p } else { range })
    }

    /// Dispersion of all parameters together.
    pub fn dispersion(&self, sample: &Sample<'_>) -> Dispersion {
        sample.dispersion(&self.pieces, self.theta.len(), 0..self.theta.len())
    }
}

fn may_join(kind: &str, kinds: &[&'static str]) -> bool {
    let excluded = spec_of(kind).map_or(&[][..], |s| s.excludes);
    !kinds.iter().any(|k| *k == kind || excluded.contains(k))
}

/// What the kinds of `library` that a fit to `train` lacks promise, best first.
pub(crate) fn scores(
    model: &PushModel,
    train: &Sample<'_>,
    library: &[&'static str],
    from: &Fit,
) -> Vec<Score> {
    let (kinds, groups) = (&from.hypothesis.kinds, train.data.groups.len());
    let candidates: Vec<(&'static str, Vec<f64>)> =
        library.iter().filter(|k| may_join(k, kinds)).map(|k| (*k, probe(k, groups))).collect();
    let mut list: Vec<Score> =
        candidates.into_par_iter().map(|(k, probe)| score(model, train, from, k, &probe)).collect();
    // Corners, where a start meets the rod, promise what no step keeps: to every kind alike, and to the fit itself.
    let common = train.promise(&from.pieces, from.theta.len());
    list.iter_mut().for_each(|s| s.gain -= common);
    list.sort_by(|a, b| b.evidence().total_cmp(&a.evidence()));
    list
}

fn score(model: &PushModel, train: &Sample<'_>, from: &Fit, kind: &'static str, probe: &[f64]) -> Score {
    train.data.tally.score();
    let mut kinds = from.hypothesis.kinds.clone();
    kinds.push(kind);
    let h = Hypothesis::new(model, &train.data.groups, &kinds);
    let theta = [&from.theta[..], probe].concat();
    let p = theta.len();
    let pieces = train.pieces(&h, &theta, &from.starts);
    let (s, u, _) = train.normal(&pieces, p);
    let mut step = u.clone();
    s.cholesky().solve(&mut step);
    let mut next: Vec<f64> = theta.iter().zip(&step).map(|(a, b)| a + b).collect();
    let polar = polar(kind);
    if let (Some(polar), [.., a, b]) = (polar, &step[..]) {
        let to = polar.step([probe[0], probe[1]], [*a, *b]);
        next[p - 2..].copy_from_slice(&to);
    }
    h.admit(&mut next);
    if polar.is_none() {
        // A step that the bounds stop gains less.
        step = next.iter().zip(&theta).map(|(a, b)| a - b).collect();
    }
    let mut gain = from.cost(train) - train.total(&pieces);
    gain += pieces.iter().map(|w| train.cost(w.q, w.m).1 * w.start_gain(p)).sum::<f64>();
    gain += quadratic(&s, &u, &step);
    let range = if probe.is_empty() { 0..p } else { p - probe.len()..p };
    Score { kind, gain, dispersion: train.dispersion(&pieces, p, range), theta: next }
}

/// Fall of the cost along a step, by gradient and curvature.
fn quadratic(s: &Square, u: &[f64], step: &[f64]) -> f64 {
    let along = |i: usize| 2.0 * u[i] - (0..step.len()).map(|j| s.at(i, j) * step[j]).sum::<f64>();
    (0..step.len()).map(|i| step[i] * along(i)).sum()
}
