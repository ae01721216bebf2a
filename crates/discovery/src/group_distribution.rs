//! The distribution of a parameter over groups of recordings: its spread, and groups that are outliers of it.
//!
//! The estimate of group `i` is `theta_i`, with a standard error `e_i`. If the values of the groups are drawn from a
//! normal distribution of mean `m` and variance `t^2`, the estimates have the variances `t^2 + e_i^2`:
//!
//! ```text
//! (1)  m = sum w_i theta_i / sum w_i                 w_i = 1 / (t^2 + e_i^2)
//! (2)  sum w_i (theta_i - m)^2 = n - 1               which determines t (Paule and Mandel 1982)
//! (3)  t is in the 95 % interval if the sum in (2) is between the 2.5 % and 97.5 % quantiles of chi^2 with n - 1
//!      degrees of freedom (Viechtbauer 2007)
//! (4)  (theta_i - m_i) / sqrt(s_i^2 (1 + 1/(n - 1)) + max(0, e_i^2 - mean of the others' e^2))
//!      follows Student's t with n - 2 degrees of freedom, where m_i and s_i are mean and standard deviation of the other
//!      estimates
//! ```

use crate::statistics::{chi2_quantile, f_tail};
use augsim_system::NORMAL_95;
use serde::{Deserialize, Serialize};

/// Minimum number of groups: a variance with fewer than four degrees of freedom is unreliable.
const MIN_GROUPS: usize = 5;
/// Number of bisections that determine a spread to the precision of `f64`.
const BISECTIONS: usize = 100;

/// How the values of a parameter are distributed over groups.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GroupDistribution {
    /// Mean of the distribution, in the unit of the parameter.
    pub mean: f64,
    /// Standard deviation of the distribution, in the unit of the parameter.
    pub sd: f64,
    /// 95 % interval of the standard deviation.
    pub sd_ci95: [f64; 2],
    /// Names of the groups that do not belong to the distribution of the others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outlying: Vec<String>,
}

impl GroupDistribution {
    /// Determines the distribution from estimates of groups: name, value and 95 % interval of each. A group is
    /// outlying at the level `level`, divided by the number of groups. `None` with fewer than five groups.
    pub(crate) fn of_estimates(estimates: &[(String, f64, [f64; 2])], level: f64) -> Option<Self> {
        let values = with_variances(estimates.iter().map(|(_, value, ci95)| (*value, *ci95)));
        let freedom = values.len().checked_sub(1).filter(|_| values.len() >= MIN_GROUPS)? as f64;
        let sd = spread(&values, freedom);
        let sd_ci95 = [0.025, 0.975].map(|tail| spread(&values, chi2_quantile(tail, freedom)));
        let outlying = (0..values.len()).filter(|i| p_outlying(&values, *i) * values.len() as f64 <= level);
        let outlying = outlying.map(|i| estimates[i].0.clone()).collect();
        Some(Self { mean: mean(&values, sd), sd, sd_ci95, outlying })
    }
}

/// Standard deviation over groups from their estimates, each a value with its 95 % interval. `None` with fewer than
/// five groups, and where the groups are equal within their intervals.
pub(crate) fn spread_of_groups(estimates: impl Iterator<Item = (f64, [f64; 2])>) -> Option<f64> {
    let values = with_variances(estimates);
    let sd = spread(&values, values.len().saturating_sub(1) as f64);
    (values.len() >= MIN_GROUPS && sd > 0.0).then_some(sd)
}

/// Values with the variances of their estimates, from their 95 % intervals.
fn with_variances(estimates: impl Iterator<Item = (f64, [f64; 2])>) -> Vec<(f64, f64)> {
    estimates.map(|(value, [low, high])| (value, ((high - low) / (2.0 * NORMAL_95)).powi(2))).collect()
}

/// Weighted mean (1) of values, each with the variance of its estimate.
fn mean(values: &[(f64, f64)], sd: f64) -> f64 {
    let weight = |variance: f64| 1.0 / (sd * sd + variance).max(f64::MIN_POSITIVE);
    let sum: f64 = values.iter().map(|(_, v)| weight(*v)).sum();
    values.iter().map(|(x, v)| weight(*v) * x).sum::<f64>() / sum
}

/// Standard deviation over groups at which the weighted sum of squares (2) has the value `wanted`; 0 if it is smaller
/// without any.
fn spread(values: &[(f64, f64)], wanted: f64) -> f64 {
    let squares = |sd: f64| {
        let m = mean(values, sd);
        values.iter().map(|(x, v)| (x - m).powi(2) / (sd * sd + v).max(f64::MIN_POSITIVE)).sum::<f64>()
    };
    if squares(0.0) <= wanted {
        return 0.0;
    }
    let range =
        values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], (x, _)| [a.min(*x), b.max(*x)]);
    let mut high = range[1] - range[0];
    while squares(high) > wanted {
        high *= 2.0;
    }
    let mut low = 0.0;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if squares(middle) > wanted { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Probability that a group of the distribution of the others is as far from their mean as `group`, by (4).
fn p_outlying(values: &[(f64, f64)], group: usize) -> f64 {
    let others: Vec<(f64, f64)> =
        values.iter().enumerate().filter(|(i, _)| *i != group).map(|(_, v)| *v).collect();
    let n = others.len() as f64;
    let mean = others.iter().map(|(x, _)| x).sum::<f64>() / n;
    let variance = others.iter().map(|(x, _)| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let error = others.iter().map(|(_, e)| e).sum::<f64>() / n;
    let (value, own_error) = values[group];
    let t_squared = (value - mean).powi(2) / (variance * (1.0 + 1.0 / n) + (own_error - error).max(0.0));
    f_tail(t_squared, 1.0, n - 1.0)
}

#[cfg(test)]
mod tests {
    //! Contract: the spread of simulated groups is found with an interval that covers, whatever the errors of the
    //! estimates; an outlying group is found, and groups of one distribution are none.
    use super::*;
    use augsim_data::random_stream;
    use rand_distr::{Distribution, StandardNormal};

    /// Level of the search.
    const LEVEL: f64 = 0.01;

    fn interval(value: f64, error: f64) -> [f64; 2] {
        [value - NORMAL_95 * error, value + NORMAL_95 * error]
    }

    /// Estimates of `count` groups with spread 2 and standard errors between 0.5 and 1.5.
    fn draw(seed: u64, count: usize) -> Vec<(String, f64, [f64; 2])> {
        let mut rng = random_stream(seed, "groups", 0);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let group = |i: usize| {
            let error = 0.5 + (i % 3) as f64 * 0.5;
            let value = 10.0 + 2.0 * normal() + error * normal();
            (format!("unit {i}"), value, interval(value, error))
        };
        (0..count).map(group).collect()
    }

    #[test]
    fn intervals_of_the_spread_cover() {
        let (mut covered, mut outlying, mut sum) = (0, 0, 0.0);
        for seed in 0..400 {
            let found = GroupDistribution::of_estimates(&draw(seed, 8), LEVEL).expect("enough groups");
            covered += usize::from(found.sd_ci95[0] <= 2.0 && 2.0 <= found.sd_ci95[1]);
            outlying += usize::from(!found.outlying.is_empty());
            sum += found.sd * found.sd / 400.0;
        }
        // 400 repetitions of a probability of 0.95 have a standard error of 1.1 %.
        assert!((368..=392).contains(&covered), "{covered} of 400");
        assert!(outlying <= 12, "{outlying} of 400 at a level of 1 %");
        assert!((3.5..4.5).contains(&sum), "mean variance {sum}");
    }

    #[test]
    fn a_group_far_from_the_others_is_outlying() {
        let mut groups = draw(1, 8);
        groups[3].1 += 40.0;
        groups[3].2 = interval(groups[3].1, 0.5);
        let found = GroupDistribution::of_estimates(&groups, LEVEL).expect("enough groups");
        assert_eq!(found.outlying, ["unit 3"]);
        assert!(GroupDistribution::of_estimates(&groups[..4], LEVEL).is_none());
        assert!(GroupDistribution::of_estimates(&groups[..5], LEVEL).is_some());
    }

    #[test]
    fn equal_groups_have_no_spread() {
        let value = |i: u8| 3.0 + 0.01 * f64::from(i);
        let equal: Vec<_> = (0..6).map(|i| (format!("{i}"), value(i), interval(value(i), 1.0))).collect();
        let found = GroupDistribution::of_estimates(&equal, LEVEL).expect("enough groups");
        assert_eq!((found.sd, found.sd_ci95[0]), (0.0, 0.0));
        assert!((found.mean - 3.025).abs() < 1e-12);
        assert_eq!(spread_of_groups(equal.iter().map(|(_, value, ci95)| (*value, *ci95))), None);
    }
}
