//! A fitted set of additions with everything that it is chosen by.

use super::blocks::Blocks;
use super::evidence::Evidence;
use super::rows::Places;
use crate::addition::{Addition, labels};
use crate::chosen_records::ChosenRecords;
use crate::fit::Fit;
use crate::interval::{FEWEST_FREEDOM, Intervals};
use crate::linear::Square;
use crate::statistics::hotelling_tail;
use crate::undetermined::undetermined;
use augsim_physics::system::Effect;

/// A fitted set of additions.
#[derive(Clone, Debug)]
pub(crate) struct Scored {
    pub fit: Fit,
    pub evidence: Evidence,
}

impl Scored {
    pub fn new(sample: &ChosenRecords<'_>, blocks: &Blocks, fit: Fit) -> Self {
        let rows = Places::new(sample, &fit).rows(blocks);
        let held = held(&fit);
        let evidence = Evidence::new(&rows, blocks, &held, &off_nulls(&fit));
        Self { fit, evidence }
    }

    pub fn additions(&self) -> &[Addition] {
        &self.fit.hypothesis.additions
    }

    /// Labels of the additions, sorted: the set's name.
    pub fn key(&self) -> Vec<String> {
        labels(self.additions())
    }

    /// Whether it could be fitted: every number is a number.
    pub fn is_finite(&self) -> bool {
        self.fit.cost.is_finite()
            && self.fit.theta.iter().all(|v| v.is_finite())
            && self.evidence.cost().is_finite()
    }

    /// Gain over another set on the same data, in nats, where residuals are independent to the share `independent`.
    pub fn gain_over(&self, other: &Self, independent: f64) -> f64 {
        0.5 * independent * (other.evidence.cost() - self.evidence.cost())
    }

    /// Probability that chance alone moves the amounts of each addition as far from their nulls as they are, by the scatter of the
    /// parameters over blocks that are left out (Hotelling's T squared for several amounts). An addition without amounts, and a table,
    /// which has more knots than blocks tell apart, are judged by what they gain in each block.
    pub fn chances<'s>(&self, without: &dyn Fn(usize) -> Option<&'s Evidence>) -> Vec<f64> {
        (0..self.additions().len())
            .map(|number| match self.amounts(number) {
                Some((entries, off)) => self.chance_of_amounts(&entries, &off, without(number)),
                None => without(number).map_or(1.0, |less| match &self.additions()[number] {
                    Addition::Scatter(_) => self.evidence.bound_on_chance(less),
                    _ => self.evidence.chance_of_gain(less),
                }),
            })
            .collect()
    }

    /// Makes 95 % intervals of theta and of sums of its entries.
    pub fn intervals(&self) -> Intervals {
        Intervals::new(&self.fit.information, self.evidence.clusters())
    }

    /// 95 % intervals of theta, kept inside the bounds; the bounds themselves where the data do not determine an entry.
    pub fn ci95(&self) -> Vec<[f64; 2]> {
        let (fit, intervals) = (&self.fit, self.intervals());
        let open = undetermined(&fit.information);
        let bounds = fit.hypothesis.limits();
        let one = |i: usize| {
            let (low, high) = bounds[i];
            if open[i] {
                return [low, high];
            }
            let unit: Vec<f64> = (0..fit.theta.len()).map(|j| f64::from(u8::from(i == j))).collect();
            let half = intervals.half_width(&unit);
            [(fit.theta[i] - half).max(low), (fit.theta[i] + half).min(high)]
        };
        (0..fit.theta.len()).map(one).collect()
    }

    /// 95 % interval of the scatter's standard deviation: one from so many draws is log-normal to good precision; a symmetric interval
    /// misses low ones.
    pub fn scatter_ci95(&self) -> Option<[f64; 2]> {
        let sd = self.fit.hypothesis.scatter?.sd;
        let factor = (1.96 / (2.0 * self.fit.spread.draws.max(1.0)).sqrt()).exp();
        Some([sd / factor, sd * factor])
    }

    /// Correlations of theta: those of the information, as far as it has any.
    pub fn correlations(&self) -> Square {
        let mut covariance = self.fit.information.cholesky().inverse();
        let n = covariance.n;
        let sd: Vec<f64> = (0..n).map(|i| covariance.at(i, i).max(0.0).sqrt()).collect();
        for i in 0..n {
            for j in 0..n {
                let size = sd[i] * sd[j];
                let own = if size > 0.0 && size.is_finite() { covariance.at(i, j) / size } else { f64::NAN };
                // What the data do not tell is correlated with nothing.
                *covariance.at_mut(i, j) = if own.is_finite() { own } else { f64::from(u8::from(i == j)) };
            }
        }
        covariance
    }

    /// Where four blocks or fewer say something of the amounts, their scatter tells no variance: then the gain of all blocks but the best
    /// one has to speak for them as well.
    fn chance_of_amounts(&self, entries: &[usize], off: &[f64], without: Option<&Evidence>) -> f64 {
        let held = held(&self.fit);
        let moving: Vec<usize> = (0..entries.len()).filter(|k| !held[entries[*k]]).collect();
        let own: Vec<usize> = moving.iter().map(|&i| entries[i]).collect();
        let x: Vec<f64> = moving.iter().map(|&i| off[i]).collect();
        let freedom = self.evidence.freedom(&own);
        let chance = hotelling_tail(self.evidence.distance(&own, &x), own.len(), freedom.max(FEWEST_FREEDOM));
        if freedom < FEWEST_FREEDOM {
            chance.max(without.map_or(1.0, |less| self.evidence.bound_on_chance(less)))
        } else {
            chance
        }
    }

    /// Whether an addition is judged by what it gains in each block: its gain pays for the number of candidates already.
    pub fn is_judged_by_gain(&self, number: usize) -> bool {
        self.amounts(number).is_none() && !matches!(self.additions()[number], Addition::Scatter(_))
    }

    /// Entries of theta of an addition's amounts, and how far each is from its null; nothing for what is judged by its gain.
    fn amounts(&self, number: usize) -> Option<(Vec<usize>, Vec<f64>)> {
        let h = &self.fit.hypothesis;
        let range = h.range_of(number);
        match &h.additions[number] {
            Addition::Scatter(_) | Addition::Table(_) | Addition::Split(_) => None,
            Addition::Effect(listed, _) => {
                let all = amounts_of(&listed.effect, range.clone());
                let structural = range.is_empty() || !listed.effect.probe.is_empty();
                (!structural && !all.is_empty())
                    .then(|| all.into_iter().map(|(i, null)| (i, self.fit.theta[i] - null)).unzip())
            }
        }
    }
}

/// Places in theta of the amounts of an effect whose entries are `range`, with their nulls: a direction or a scale has no null of its own.
fn amounts_of(effect: &Effect, range: std::ops::Range<usize>) -> Vec<(usize, f64)> {
    let width = range.len() / effect.parameters.len().max(1);
    let amounts = effect.amounts.unwrap_or(usize::MAX).saturating_mul(width);
    let nulls = effect.parameters.iter().flat_map(|p| std::iter::repeat_n(p.null, width));
    range.zip(nulls).take(amounts).collect()
}

/// By how much each entry of theta is off the value where it changes nothing; 0 for what has no such value.
pub(crate) fn off_nulls(fit: &Fit) -> Vec<f64> {
    let h = &fit.hypothesis;
    let mut off = vec![0.0; fit.theta.len()];
    for (number, addition) in h.additions.iter().enumerate() {
        let amounts = match addition {
            Addition::Effect(listed, _) => amounts_of(&listed.effect, h.range_of(number)),
            Addition::Table(_) => h.range_of(number).map(|i| (i, 0.0)).collect(),
            Addition::Scatter(_) | Addition::Split(_) => Vec::new(),
        };
        amounts.into_iter().for_each(|(i, null)| off[i] = fit.theta[i] - null);
    }
    off
}

/// Entries of theta that stand at a bound of their fit.
pub(crate) fn held(fit: &Fit) -> Vec<bool> {
    let bounds = fit.hypothesis.bounds();
    fit.theta.iter().zip(bounds).map(|(t, (low, high))| *t <= low || *t >= high).collect()
}
