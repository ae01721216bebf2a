//! A fitted set of additions with its scores.

use super::blocks::Blocks;
use super::evidence::Evidence;
use super::kept::Kept;
use super::rows::FitWindows;
use crate::addition::{Addition, labels};
use crate::fit::Fit;
use crate::identifiability::unidentifiable;
use crate::interval::{Intervals, MIN_FREEDOM};
use crate::linear::Square;
use crate::linear_problem::LinearProblem;
use crate::record::ChosenRecords;
use crate::statistics::{hotelling_tail, median};
use augsim_system::NORMAL_95;
use std::cell::LazyCell;
use std::sync::Arc;

/// Probability that a 95 % interval does not contain the true value.
pub(crate) const OUTSIDE_95: f64 = 0.05;
/// Ratio of residual standard deviation to noise, of a channel, above which further families of candidates are searched, and
/// periodograms computed; below it no prediction would improve.
pub(crate) const BEYOND_NOISE: f64 = 1.1;
/// Independent share of the residuals (formula 4) above which they count as white. A period with 1 % of their variance decreases
/// it to 0.7, by an autocorrelation of 0.01 over 1,000 lags.
const MIN_WHITE_SHARE: f64 = 0.8;

/// A fitted set of additions with the information of each block, from which its scores are computed.
#[derive(Clone, Debug)]
pub(crate) struct Scored {
    pub fit: Fit,
    pub evidence: Evidence,
    /// Parameter values of the highest peaks of the periodogram of each periodic effect, by the effect's label.
    pub cycle_peaks: Kept<String, Vec<Vec<f64>>>,
    /// Linear problems at the fit, by the labels of their candidates.
    pub problems: Kept<Vec<String>, Arc<LinearProblem>>,
}

impl Scored {
    /// Whether the residuals are white: hardly autocorrelated.
    pub fn has_white_residuals(&self) -> bool {
        self.evidence.independence.share > MIN_WHITE_SHARE
    }

    pub fn new(sample: &ChosenRecords<'_>, blocks: &Blocks, fit: Fit) -> Self {
        let rows = FitWindows::new(sample, &fit).rows(blocks);
        let held = entries_at_bounds(&fit);
        let evidence = Evidence::new(&rows, blocks, &held, &distances_from_nulls(&fit));
        Self { fit, evidence, cycle_peaks: Kept::default(), problems: Kept::default() }
    }

    pub fn additions(&self) -> &[Addition] {
        &self.fit.hypothesis.additions
    }

    /// Sorted labels of the additions, which identify the set.
    pub fn key(&self) -> Vec<String> {
        labels(self.additions())
    }

    /// Whether the fit succeeded, so that all its numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.fit.cost.is_finite()
            && self.fit.theta.iter().all(|v| v.is_finite())
            && self.evidence.cost.is_finite()
    }

    /// Gain in log predictive density over another set on the same data, nats. `independent` is the share of
    /// independent residuals, which alone count.
    pub fn gain_over(&self, other: &Self, independent: f64) -> f64 {
        0.5 * independent * (other.evidence.cost - self.evidence.cost)
    }

    /// p-value of each addition of the set.
    ///
    /// It is that of its coefficients, by their leave-one-out scatter (Hotelling's T squared), or that of its
    /// gain over blocks for additions without coefficients, and for tables and values of a declared parameter by group, which have more
    /// values than blocks can resolve. Coefficients whose 95 % intervals all contain their null values are not significant: an
    /// effect is never named with an interval that contradicts it. `without` returns the block information of the set without the addition of that number.
    pub fn p_values<'s>(&self, without: &dyn Fn(usize) -> Option<&'s Evidence>) -> Vec<f64> {
        // Most coefficients are not significant anyway, and need no intervals.
        let intervals = LazyCell::new(|| self.intervals());
        (0..self.additions().len())
            .map(|number| match self.free_coefficients(number) {
                Some((entries, off)) => {
                    let p_value = self.p_value_of_coefficients(&entries, &off, without(number));
                    let excludes_null =
                        |(i, off): (&usize, &f64)| off.abs() > intervals.half_width(&self.unit(*i));
                    let by_coefficients =
                        if p_value >= OUTSIDE_95 || entries.iter().zip(&off).any(excludes_null) {
                            p_value
                        } else {
                            OUTSIDE_95
                        };
                    match without(number).filter(|_| self.has_states(number)) {
                        Some(less) => by_coefficients.min(self.evidence.p_value_of_gain(less)),
                        None => by_coefficients,
                    }
                }
                None => without(number).map_or(1.0, |less| match &self.additions()[number] {
                    // A few groups that differ, or a few records, gain nearly everything, which Student's t test
                    // over blocks would take for chance.
                    addition if is_bounded_by_gain(addition) => self.evidence.p_value_bound(less),
                    _ => self.evidence.p_value_of_gain(less),
                }),
            })
            .collect()
    }

    /// Calculator of 95 % intervals for theta (the shared parameters) and linear combinations of its entries.
    pub fn intervals(&self) -> Intervals {
        Intervals::new(&self.fit.information, &self.evidence.clusters())
    }

    /// Factors of the linear combination that equals entry `i` of theta (the shared parameters).
    fn unit(&self, i: usize) -> Vec<f64> {
        (0..self.fit.theta.len()).map(|j| f64::from(u8::from(i == j))).collect()
    }

    /// 95 % intervals of theta (the shared parameters), clipped to the bounds. Entries that are not
    /// identifiable get their bounds.
    pub fn ci95(&self) -> Vec<[f64; 2]> {
        let (fit, intervals) = (&self.fit, self.intervals());
        let is_unidentifiable = unidentifiable(&fit.information);
        let bounds = fit.hypothesis.result_bounds();
        let one = |i: usize| {
            let (low, high) = bounds[i];
            if is_unidentifiable[i] {
                return [low, high];
            }
            let half = intervals.half_width(&self.unit(i));
            [(fit.theta[i] - half).max(low), (fit.theta[i] + half).min(high)]
        };
        (0..fit.theta.len()).map(one).collect()
    }

    /// For each entry of theta (the shared parameters): whether its interval fills its bounds, so that the
    /// data do not determine it.
    pub fn fills_bounds(&self, ci95: &[[f64; 2]]) -> Vec<bool> {
        let bounds = self.fit.hypothesis.result_bounds();
        ci95.iter().zip(bounds).map(|([low, high], bounds)| *low <= bounds.0 && *high >= bounds.1).collect()
    }

    /// The 95 % intervals of theta (the shared parameters), with width 0 where the data do not determine an
    /// entry.
    pub fn identified_ci95(&self) -> Vec<[f64; 2]> {
        let mut ci95 = self.ci95();
        let fills = self.fills_bounds(&ci95);
        ci95.iter_mut()
            .zip(fills)
            .zip(&self.fit.theta)
            .filter(|((_, fills), _)| *fills)
            .for_each(|((interval, _), value)| *interval = [*value; 2]);
        ci95
    }

    /// Covariance of theta (the shared parameters), with rows and columns of 0 for entries that the data do
    /// not determine.
    ///
    /// It is the covariance under white noise, widened by one factor, the median one of the intervals. A
    /// factor for each entry would give combinations that are known precisely the uncertainty of their parts.
    pub fn covariance(&self) -> Square {
        let (fit, intervals) = (&self.fit, self.intervals());
        let fills = self.fills_bounds(&self.ci95());
        let known: Vec<usize> = (0..fit.theta.len()).filter(|i| !fills[*i]).collect();
        let white = fit.information.sub(&known).cholesky().inverse();
        let mut factors: Vec<f64> = known
            .iter()
            .enumerate()
            .map(|(k, i)| (intervals.half_width(&self.unit(*i)) / NORMAL_95).powi(2) / white.at(k, k))
            .filter(|f| f.is_finite())
            .collect();
        let factor = if factors.is_empty() { 1.0 } else { median(&mut factors) };
        let mut covariance = Square::zero(fit.theta.len());
        for (k, i) in known.iter().enumerate() {
            for (l, j) in known.iter().enumerate() {
                let value = factor * white.at(k, l);
                *covariance.at_mut(*i, *j) = if value.is_finite() { value } else { 0.0 };
            }
        }
        covariance
    }

    /// 95 % interval of the standard deviation of the events' random effect; `None` without one. An estimate
    /// from n draws is close to log-normal, and a symmetric interval would cover less.
    pub fn scatter_ci95(&self) -> Option<[f64; 2]> {
        let sd = self.fit.hypothesis.scatter?.sd;
        let factor = (1.96 / (2.0 * self.fit.spread.draws.max(1.0)).sqrt()).exp();
        Some([sd / factor, sd * factor])
    }

    /// Correlation matrix of the estimates of theta (the shared parameters), from the information matrix.
    pub fn correlations(&self) -> Square {
        let mut covariance = self.fit.information.cholesky().inverse();
        let n = covariance.n;
        let sd: Vec<f64> = (0..n).map(|i| covariance.at(i, i).max(0.0).sqrt()).collect();
        for i in 0..n {
            for j in 0..n {
                let size = sd[i] * sd[j];
                let correlation =
                    if size > 0.0 && size.is_finite() { covariance.at(i, j) / size } else { f64::NAN };
                // Unidentifiable entries get correlation 0 with all others.
                *covariance.at_mut(i, j) =
                    if correlation.is_finite() { correlation } else { f64::from(u8::from(i == j)) };
            }
        }
        covariance
    }

    /// p-value of an addition's coefficients (`entries` of theta, the shared parameters) by their scatter
    /// over blocks. With fewer than four effective degrees of freedom this scatter is unreliable, so the gain
    /// of all blocks but the best must be significant as well.
    fn p_value_of_coefficients(&self, entries: &[usize], off: &[f64], without: Option<&Evidence>) -> f64 {
        let freedom = self.evidence.freedom(entries);
        let distance = self.evidence.distance(entries, off);
        let p_value = hotelling_tail(distance, entries.len(), freedom.max(MIN_FREEDOM));
        if freedom < MIN_FREEDOM {
            p_value.max(without.map_or(1.0, |less| self.evidence.p_value_bound(less)))
        } else {
            p_value
        }
    }

    /// Whether addition number `number` brings states of its own.
    ///
    /// Their initial values are not identifiable at the null value of its coefficients, so that the scatter of these
    /// is no valid test alone (Davies 1987). Then the gain over blocks also establishes the addition.
    pub fn has_states(&self, number: usize) -> bool {
        self.additions()[number].has_states()
    }

    /// Whether addition number `number` is judged by Student's t test of its gain over blocks. Its penalty then
    /// already accounts for the number of candidates.
    pub fn is_judged_by_gain(&self, number: usize) -> bool {
        self.coefficients(number).is_none() && !is_bounded_by_gain(&self.additions()[number])
    }

    /// The [`coefficients`](Self::coefficients) of an addition that are not at a bound; `None` if all are, so that only its
    /// gain can judge it.
    fn free_coefficients(&self, number: usize) -> Option<(Vec<usize>, Vec<f64>)> {
        let (entries, off) = self.coefficients(number)?;
        let held = entries_at_bounds(&self.fit);
        let free: Vec<(usize, f64)> = entries.into_iter().zip(off).filter(|(i, _)| !held[*i]).collect();
        (!free.is_empty()).then(|| free.into_iter().unzip())
    }

    /// Entries of theta (the shared parameters) of an addition's coefficients, and their distances from the
    /// null values. `None` for additions that are judged by their gain.
    fn coefficients(&self, number: usize) -> Option<(Vec<usize>, Vec<f64>)> {
        let h = &self.fit.hypothesis;
        let Addition::Effect(listed, _) = &h.additions[number] else { return None };
        let amounts = h.coefficients_of_addition(number);
        let is_structural = !listed.effect.first_simulated_at.is_empty();
        (!is_structural && !amounts.is_empty())
            .then(|| amounts.into_iter().map(|(i, null)| (i, self.fit.theta[i] - null)).unzip())
    }
}

/// Whether an addition is judged by the bound of Markov's inequality on its gain: a declared parameter with values by
/// group, or a random effect.
fn is_bounded_by_gain(addition: &Addition) -> bool {
    matches!(addition, Addition::Scatter(_) | Addition::Split(_))
}

/// Distance of each entry of theta (the shared parameters) from its null value; 0 for entries without null
/// value.
pub(crate) fn distances_from_nulls(fit: &Fit) -> Vec<f64> {
    let h = &fit.hypothesis;
    let mut off = vec![0.0; fit.theta.len()];
    let coefficients = (0..h.additions.len()).flat_map(|number| h.coefficients_of_addition(number));
    coefficients.for_each(|(i, null)| off[i] = fit.theta[i] - null);
    off
}

/// For each entry of theta (the shared parameters): whether it is at a bound of the fit.
pub(crate) fn entries_at_bounds(fit: &Fit) -> Vec<bool> {
    let bounds = fit.hypothesis.fit_bounds();
    fit.theta.iter().zip(bounds).map(|(t, (low, high))| *t <= low || *t >= high).collect()
}
