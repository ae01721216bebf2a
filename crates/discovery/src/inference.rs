//! Inference on the parameters of a fit: covariance, intervals, dispersion, and whether an addition is away from its null.

use crate::addition::Addition;
use crate::cluster::Cluster;
use crate::covariance::{sandwich, undetermined};
use crate::dispersion::{Dispersion, Quadratic, dispersion};
use crate::fit::Fit;
use crate::interval::Intervals;
use crate::linear::Square;
use crate::statistics::chi2_quantile;
use augsim_physics::system::{Effect, EffectParameter};
use std::ops::Range;

/// Share of its usual size below which an amount is none.
const STILL: f64 = 1e-6;

impl Fit {
    /// Covariance of theta: the larger of the inverse information and the sandwich over records.
    pub fn covariance(&self) -> Square {
        let p = self.theta.len();
        let mut bread = self.information.clone();
        let mut gradients = Vec::with_capacity(self.clusters.len());
        for cluster in &self.clusters {
            cluster.soften(&mut bread);
            gradients.push(cluster.gradient(p));
        }
        sandwich(&self.information, &bread, &gradients)
    }

    /// Makes 95 % intervals of theta and of sums of its entries.
    pub fn intervals(&self) -> Intervals {
        let p = self.theta.len();
        let softened = |cluster: &Cluster| {
            let (mut curvature, gradient) = cluster.quadratic(p);
            cluster.soften(&mut curvature);
            (curvature, gradient)
        };
        Intervals::new(&self.information, self.clusters.iter().map(softened).collect())
    }

    /// 95 % intervals of theta, kept inside the bounds; the bounds themselves where the data do not determine an entry.
    pub fn ci95(&self) -> Vec<[f64; 2]> {
        let (p, intervals) = (self.theta.len(), self.intervals());
        let open = undetermined(&self.information);
        let bounds = self.hypothesis.limits();
        (0..p)
            .map(|i| {
                if open[i] {
                    return [bounds[i].0, bounds[i].1];
                }
                let half = intervals.half_width(&self.unit(i));
                [(self.theta[i] - half).max(bounds[i].0), (self.theta[i] + half).min(bounds[i].1)]
            })
            .collect()
    }

    /// 95 % interval of the scatter's standard deviation: one from so many draws is log-normal to good precision; a symmetric
    /// interval misses low ones.
    pub fn scatter_ci95(&self) -> Option<[f64; 2]> {
        let sd = self.hypothesis.scatter?.sd;
        let factor = (1.96 / (2.0 * self.spread.draws.max(1.0)).sqrt()).exp();
        Some([sd / factor, sd * factor])
    }

    /// Dispersion of the entries of theta in `range`, or of all of them where it is empty, at least `least`.
    pub fn dispersion(&self, range: Range<usize>, least: f64) -> Dispersion {
        let p = self.theta.len();
        let each: Vec<Quadratic> = self.clusters.iter().map(|c| c.quadratic(p)).collect();
        let mut sum = vec![0.0; p];
        each.iter().for_each(|(_, u)| sum.iter_mut().zip(u).for_each(|(a, b)| *a += b));
        let range = if range.is_empty() { 0..p } else { range };
        dispersion(&self.information, &sum, &each, range, least)
    }

    /// Whether every addition is away from its null by more than chance (Wald's test with the covariance of intervals): a gain
    /// that comes of corners of the cost leaves the parameters where they were.
    pub fn is_clear(&self) -> bool {
        self.unclear().is_empty()
    }

    /// The numbers of the additions that chance alone may have moved from their nulls, those nearest to them first.
    pub fn unclear(&self) -> Vec<usize> {
        let (covariance, open) = (self.covariance(), undetermined(&self.information));
        let additions = self.hypothesis.additions.iter().enumerate();
        let distances = additions.filter_map(|(n, a)| Some((n, self.distance(n, a, &covariance, &open)?)));
        let mut near: Vec<(usize, f64)> = distances.filter(|(_, d)| d.is_nan() || *d <= 1.0).collect();
        near.sort_by(|a, b| a.1.total_cmp(&b.1));
        near.into_iter().map(|(number, _)| number).collect()
    }

    /// The numbers of the effects of which every amount lies within so many half-widths of its 95 % interval of its null, those nearest
    /// to them first.
    pub fn unsure(&self, half_widths: f64) -> Vec<usize> {
        let (intervals, open) = (self.intervals(), undetermined(&self.information));
        let farthest = |(number, addition): (usize, &Addition)| {
            let Addition::Effect(listed, _) = addition else { return None };
            if self.hypothesis.range_of(number).is_empty() || self.is_open(number, &open) {
                return None;
            }
            let distance =
                |(i, null): (usize, f64)| (self.theta[i] - null).abs() / intervals.half_width(&self.unit(i));
            let amounts = self.amounts(number, &listed.effect).into_iter();
            Some((number, amounts.map(distance).fold(0.0, f64::max)))
        };
        let additions = self.hypothesis.additions.iter().enumerate();
        let mut near: Vec<(usize, f64)> =
            additions.filter_map(farthest).filter(|(_, distance)| *distance <= half_widths).collect();
        near.sort_by(|a, b| a.1.total_cmp(&b.1));
        near.into_iter().map(|(number, _)| number).collect()
    }

    /// Places in theta of the amounts of an effect, with their nulls: a direction or a scale has no null of its own.
    fn amounts(&self, number: usize, effect: &Effect) -> Vec<(usize, f64)> {
        let range = self.hypothesis.range_of(number);
        let width = range.len() / effect.parameters.len().max(1);
        let amounts = effect.amounts.unwrap_or(usize::MAX).saturating_mul(width);
        let nulls = effect.parameters.iter().flat_map(|p| std::iter::repeat_n(p.null, width));
        range.zip(nulls).take(amounts).collect()
    }

    /// Whether the data leave an entry of the addition of that number open.
    fn is_open(&self, number: usize, open: &[bool]) -> bool {
        self.hypothesis.range_of(number).any(|i| open[i])
    }

    /// The direction of one entry of theta.
    fn unit(&self, entry: usize) -> Vec<f64> {
        (0..self.theta.len()).map(|j| f64::from(u8::from(entry == j))).collect()
    }

    /// Whether the addition of that number does nothing: it has amounts, and all of them are at their nulls. An effect without
    /// amounts (`inertia`) is there or not, and does something wherever it is.
    pub fn is_inert(&self, number: usize) -> bool {
        let Some(effect) = self.hypothesis.additions[number].listed() else { return false };
        let values = &self.theta[self.hypothesis.range_of(number)];
        let amounts = effect.parameters.iter().take(effect.amounts.unwrap_or(usize::MAX));
        let still = |(p, value): (&EffectParameter, &f64)| (value - p.null).abs() <= STILL * p.typical.abs();
        !values.is_empty() && values.len() == effect.parameters.len() && amounts.zip(values).all(still)
    }

    /// The additions that do something.
    pub fn moved(&self) -> Vec<Addition> {
        let additions = self.hypothesis.additions.iter().enumerate();
        additions.filter(|(number, _)| !self.is_inert(*number)).map(|(_, a)| a.clone()).collect()
    }

    /// Wald's statistic of an addition, in the quantile that chance exceeds with a probability of 5 %; `None` where the data say
    /// nothing of its null.
    fn distance(
        &self,
        number: usize,
        addition: &Addition,
        covariance: &Square,
        open: &[bool],
    ) -> Option<f64> {
        let range = self.hypothesis.range_of(number);
        // What the data tell only together with something else is not zero for that.
        if range.is_empty() || self.is_open(number, open) {
            return None;
        }
        let values = &self.theta[range.clone()];
        let own: Vec<usize> = range.collect();
        let (mut x, variance) = match addition {
            Addition::Scatter(_) | Addition::Table(_) => return None,
            Addition::Split(_) => {
                // Differences from the first group.
                let c = covariance.sub(&own);
                let mut variance = Square::zero(own.len() - 1);
                for i in 1..own.len() {
                    for j in 1..own.len() {
                        *variance.at_mut(i - 1, j - 1) = c.at(i, j) - c.at(0, j) - c.at(i, 0) + c.at(0, 0);
                    }
                }
                (values[1..].iter().map(|v| v - values[0]).collect::<Vec<_>>(), variance)
            }
            Addition::Effect(listed, _) => {
                let (own, x) = self
                    .amounts(number, &listed.effect)
                    .into_iter()
                    .map(|(i, null)| (i, self.theta[i] - null))
                    .unzip::<_, _, Vec<usize>, Vec<f64>>();
                (x, covariance.sub(&own))
            }
        };
        variance.cholesky().forward(&mut x);
        Some(x.iter().map(|v| v * v).sum::<f64>() / chi2_quantile(0.05, x.len() as f64))
    }
}
