//! What an addition promises at a fit, before it is fitted.

use super::evaluate::Piece;
use super::fit::{BEND, Fit, Sample};
use super::hypothesis::{Hypothesis, polar, probe};
use crate::linear::Square;
use crate::statistics::median;
use augsim_physics::model::PushModel;
use augsim_physics::push::effects::spec_of;
use rayon::prelude::*;
use std::ops::Range;

/// By how much gains in cost by some parameters exceed those under white noise: the windows' gradients scatter more than their
/// curvature says, each direction by its own factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Dispersion {
    pub factor: f64,
    /// Number of windows (or pushes, where theirs are not independent) that it is estimated from, each by its information.
    pub windows: f64,
}

impl Dispersion {
    /// The quantile of gains in cost over `factor` that goes with the quantile `q` of chi-squared with `k` degrees of freedom:
    /// that of `k F(k, n - 1)`, in the expansion of first order (Abramowitz and Stegun 26.6.15 for large denominators).
    pub fn widened(&self, q: f64, k: f64) -> f64 {
        q * (1.0 + (q + 2.0 - k) / (2.0 * self.freedom()))
    }

    /// The inverse of [`widened`](Self::widened).
    pub fn narrowed(&self, x: f64, k: f64) -> f64 {
        let n = self.freedom();
        let b = 1.0 + (2.0 - k) / (2.0 * n);
        n * ((b * b + 2.0 * x / n).sqrt() - b)
    }

    fn freedom(&self) -> f64 {
        (self.windows - 1.0).max(1.0)
    }
}

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
    /// Dispersion of the globals in `range`, the others eliminated (after Rotnitzky and Jewell 1990): the mean over clusters of
    /// `u' S^-1 u / tr(S^-1 S_w)`, weighted by their information, each at most [`BEND`] times the median.
    pub fn dispersion(&self, pieces: &[Piece], p: usize, range: Range<usize>) -> Dispersion {
        let least = self.data.noise.white_share();
        let k = range.len();
        if k == 0 {
            return Dispersion { factor: f64::max(1.0, least), windows: self.clusters().len().max(1) as f64 };
        }
        let (s, u, each) = self.normal(pieces, p);
        let n = each.len().max(1) as f64;
        let inverse = s.cholesky().inverse();
        // Precision of the parameters asked for: the curvature that is left when the others follow.
        let keep: Vec<usize> = range.clone().collect();
        let precision = inverse.sub(&keep).cholesky().inverse();
        let (mut ratios, mut shares) = (Vec::new(), Vec::new());
        for (sw, uw) in &each {
            // Steps of the parameters asked for, and their covariance under white noise.
            let x: Vec<f64> =
                keep.iter().map(|&i| (0..p).map(|j| inverse.at(i, j) * (uw[j] - u[j] / n)).sum()).collect();
            let rows: Vec<Vec<f64>> = keep
                .iter()
                .map(|&i| (0..p).map(|h| (0..p).map(|g| inverse.at(i, g) * sw.at(g, h)).sum()).collect())
                .collect();
            let (mut share, mut square) = (0.0, 0.0);
            for a in 0..k {
                for b in 0..k {
                    let white: f64 = (0..p).map(|h| rows[a][h] * inverse.at(keep[b], h)).sum();
                    share += precision.at(a, b) * white;
                    square += precision.at(a, b) * x[a] * x[b];
                }
            }
            if share > 1e-9 {
                ratios.push(square / share);
                shares.push(share);
            }
        }
        let most = BEND * median(&mut ratios.clone());
        let total: f64 = shares.iter().sum();
        let mean = ratios.iter().zip(&shares).map(|(r, w)| r.min(most) * w).sum::<f64>() / total.max(1e-300);
        let squares: f64 = shares.iter().map(|w| w * w).sum();
        Dispersion { factor: mean.max(least), windows: total * total / squares.max(1e-300) }
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
