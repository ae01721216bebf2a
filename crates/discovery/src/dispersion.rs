//! Over-dispersion: how much more the gradients of clusters scatter than white noise would make them.
//!
//! A cluster is a trajectory, or a window of one. Where the model is wrong, or the noise is not white, gains in cost by
//! parameters that mean nothing are larger than chi-squared by a factor of its own in each direction; penalties and tests are
//! made in units of that factor (Rotnitzky and Jewell 1990; Takeuchi's criterion; Varin and Vidoni 2005).

use crate::linear::Square;
use crate::statistics::median;
use std::ops::Range;

/// Largest ratio of one cluster, in units of the median ratio, that enters the factor: three standard deviations. One cluster
/// that no model follows must not hide an effect that all others show.
const MOST_OF_A_CLUSTER: f64 = 9.0;

/// Curvature and gradient of the cost of one cluster.
pub(crate) type Quadratic = (Square, Vec<f64>);

/// Factor by which gains in cost by some parameters exceed those under white noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Dispersion {
    pub factor: f64,
    /// Number of clusters that the factor is estimated from, each by its information.
    pub clusters: f64,
}

impl Dispersion {
    /// Quantile of gains in cost over `factor` that belongs to the quantile `q` of chi-squared with `k` degrees of freedom:
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
        (self.clusters - 1.0).max(1.0)
    }
}

/// Dispersion of the parameters in `range`, the others eliminated: the mean over clusters of `u' S^-1 u / tr(S^-1 S_w)`,
/// weighted by their information; at least `least`. `s` and `u` are the sums over the clusters `each`.
pub(crate) fn dispersion(
    s: &Square,
    u: &[f64],
    each: &[Quadratic],
    range: Range<usize>,
    least: f64,
) -> Dispersion {
    let (p, k) = (u.len(), range.len());
    let n = each.len().max(1) as f64;
    if k == 0 {
        return Dispersion { factor: f64::max(1.0, least), clusters: n };
    }
    let inverse = s.cholesky().inverse();
    // Precision of the parameters asked for: the curvature that is left when the others follow.
    let keep: Vec<usize> = range.collect();
    let precision = inverse.sub(&keep).cholesky().inverse();
    let (mut ratios, mut shares) = (Vec::new(), Vec::new());
    for (sw, uw) in each {
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
    let most = MOST_OF_A_CLUSTER * median(&mut ratios.clone());
    let total: f64 = shares.iter().sum();
    let mean = ratios.iter().zip(&shares).map(|(r, w)| r.min(most) * w).sum::<f64>() / total.max(1e-300);
    let squares: f64 = shares.iter().map(|w| w * w).sum();
    Dispersion { factor: mean.max(least), clusters: total * total / squares.max(1e-300) }
}

#[cfg(test)]
mod tests {
    //! Contract: a parameter that means nothing pays its penalty in one of a hundred repetitions, and in less than five where
    //! the model misses something smooth (the plain quantile: in every second). 1,000 repetitions: one standard error is
    //! 0.3 % and 0.6 %.
    use super::*;
    use crate::linear_toy::Toy;
    use crate::statistics::chi2_quantile;

    const REPETITIONS: u64 = 1000;

    /// Shares of false alarms by the plain quantile and by that in units of the dispersion.
    fn false_alarms(misfit: f64) -> [f64; 2] {
        let quantile = chi2_quantile(0.01, 1.0);
        let mut count = [0usize; 2];
        for seed in 0..REPETITIONS {
            let toy = Toy::draw(seed, misfit, 3);
            let (without, with) = (toy.fit(2), toy.fit(3));
            let gain = without.cost - with.cost;
            let sum: Vec<f64> = (0..3).map(|i| with.windows.iter().map(|(_, u)| u[i]).sum()).collect();
            let own = dispersion(&with.information, &sum, &with.windows, 2..3, 1.0);
            count[0] += usize::from(gain > quantile);
            count[1] += usize::from(gain > own.factor * own.widened(quantile, 1.0));
        }
        count.map(|c| c as f64 / REPETITIONS as f64)
    }

    #[test]
    fn a_meaningless_parameter_seldom_pays() {
        let [_, clean] = false_alarms(0.0);
        assert!(clean <= 0.018, "without misfit {clean}");
        let [plain, misfit] = false_alarms(2.0);
        // 3.5 in a hundred: the ratios of single clusters are cut, which takes the largest misfits out of the factor.
        assert!(misfit <= 0.05, "with misfit {misfit}");
        assert!(plain > 0.2, "the plain quantile would raise {plain}");
    }

    #[test]
    fn narrowing_undoes_widening() {
        let d = Dispersion { factor: 1.0, clusters: 42.0 };
        for k in [1.0, 3.0, 8.0] {
            let wide = d.widened(11.8, k);
            assert!(wide > 11.8 && (d.narrowed(wide, k) - 11.8).abs() < 1e-9, "{k}");
        }
    }
}
