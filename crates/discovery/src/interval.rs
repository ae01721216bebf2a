//! Half-widths of 95 % intervals that know how many records they come of.
//!
//! The sandwich of White (1982) is right for many records. With 30 to 80 it is too narrow twice over: a fit
//! bends towards the records that decide it, so their gradients at its minimum are smaller than at the truth; and a variance
//! from few of them is itself uncertain. Leaving every record out once (the jackknife, or CR3 of Bell and McCaffrey 2002, in one
//! Newton step each) errs to the other side by as much: where a record has a share `h` of the information, the sandwich
//! expects `1 - h` of its variance and the jackknife `1 / (1 - h)`. Their mean is right to first order, as CR2 of these authors
//! is. Student's quantile takes the place of the normal one, with as many degrees of freedom as there are records that say
//! something of the parameter.

use crate::linear::Square;
use crate::statistics::student_quantile;

/// Normal quantile of a two-sided interval of 95 %.
const NORMAL: f64 = 1.96;
/// Fewest degrees of freedom that Student's quantile is taken with: from four records or fewer no variance can be told, and
/// those of white noise are the better guide.
pub(crate) const FEWEST_FREEDOM: f64 = 4.0;

/// Curvature and gradient of the cost of one cluster.
pub(crate) type Quadratic = (Square, Vec<f64>);

/// Makes 95 % intervals of a fit's parameters and of sums of them.
pub(crate) struct Intervals {
    /// Covariance under white noise.
    white: Square,
    /// Curvature of the cost of each cluster.
    curvatures: Vec<Square>,
    /// How the parameters move when a cluster is left out: by the curvature of all clusters, and by that of the others.
    moves: Vec<[Vec<f64>; 2]>,
}

impl Intervals {
    /// `clusters` have the curvature, with the derivative of the weights in it, and the gradient of the cost of each cluster
    /// at its minimum; `information` is the sum of the curvatures without that derivative.
    pub fn new(information: &Square, clusters: Vec<Quadratic>) -> Self {
        let of_white = information.cholesky();
        let white = of_white.inverse();
        let minus = |from: &Square, by: &Square| {
            let a = from.a.iter().zip(&by.a).map(|(x, y)| x - y).collect();
            Square { n: from.n, a }
        };
        let mut bread = Square::zero(information.n);
        for (s, _) in &clusters {
            bread.a.iter_mut().zip(&s.a).for_each(|(a, b)| *a += b);
        }
        let of_all = bread.cholesky();
        let of_all = if of_all.is_definite() { of_all } else { of_white };
        let left_out = |(s, u): &Quadratic| {
            // What is left may have no minimum where one cluster alone knows a parameter.
            let of_others = minus(&bread, s).cholesky();
            let of_others = if of_others.is_definite() { &of_others } else { &of_all };
            [&of_all, of_others].map(|factor| {
                let mut step = u.clone();
                factor.solve(&mut step);
                step
            })
        };
        let moves = clusters.iter().map(left_out).collect();
        Self { white, moves, curvatures: clusters.into_iter().map(|(s, _)| s).collect() }
    }

    /// Half the width of the 95 % interval of a sum of parameters, each times its factor: the larger of that under white noise
    /// and that of the records.
    pub fn half_width(&self, factors: &[f64]) -> f64 {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let times = |m: &Square| -> Vec<f64> {
            (0..m.n).map(|i| dot(&m.a[i * m.n..(i + 1) * m.n], factors)).collect()
        };
        let spread = times(&self.white);
        let white = dot(&spread, factors).max(0.0);
        // Information of each cluster in the sum, up to a common factor.
        let shares = self.curvatures.iter().map(|s| {
            let rows = (0..s.n).map(|i| spread[i] * dot(&s.a[i * s.n..(i + 1) * s.n], &spread));
            rows.sum::<f64>().max(0.0)
        });
        let (sum, squares) = shares.fold((0.0, 0.0), |(sum, squares), v| (sum + v, squares + v * v));
        let records = if squares > 0.0 { sum * sum / squares } else { 0.0 };
        let moved = self.moves.iter().flatten().map(|m| dot(m, factors).powi(2)).sum::<f64>() / 2.0;
        let student = student_quantile((records - 1.0).max(FEWEST_FREEDOM));
        (NORMAL * white.sqrt()).max(student * moved.sqrt())
    }
}

#[cfg(test)]
mod tests {
    //! Contract: intervals from few records hold the truth in 95 % of all repetitions, with and without smooth misfit. 600
    //! repetitions of two parameters: one standard error is 0.6 %.
    use super::*;
    use crate::linear_toy::{Toy, ToyFit, sandwich};

    const REPETITIONS: u64 = 600;

    /// Share of the intervals of two parameters that hold the truth, 0.
    fn coverage(windows: usize, misfit: f64, half_widths: impl Fn(&ToyFit) -> [f64; 2]) -> f64 {
        let inside = (0..REPETITIONS).map(|seed| {
            let fit = Toy::of(windows, seed, misfit, 2).fit(2);
            let halves = half_widths(&fit);
            (0..2).filter(|&i| fit.theta[i].abs() < halves[i]).count()
        });
        inside.sum::<usize>() as f64 / (2 * REPETITIONS) as f64
    }

    fn of_records(fit: &ToyFit) -> [f64; 2] {
        let intervals = Intervals::new(&fit.information, fit.softened.clone());
        [intervals.half_width(&[1.0, 0.0]), intervals.half_width(&[0.0, 1.0])]
    }

    #[test]
    fn a_dozen_records_are_enough_for_intervals_that_cover() {
        let (clean, misfit) = (coverage(12, 0.0, of_records), coverage(12, 2.0, of_records));
        assert!((0.94..0.99).contains(&clean), "without misfit {clean}");
        assert!((0.92..0.98).contains(&misfit), "with misfit {misfit}");
    }

    #[test]
    fn the_number_of_records_is_what_makes_them_cover() {
        let normal = |fit: &ToyFit| {
            let gradients: Vec<Vec<f64>> = fit.windows.iter().map(|(_, u)| u.clone()).collect();
            let c = sandwich(&fit.information, &fit.bread, &gradients);
            [0, 1].map(|i| NORMAL * c.at(i, i).sqrt())
        };
        let without = coverage(12, 2.0, normal);
        assert!(without < 0.9, "{without}");
    }

    #[test]
    fn a_sum_of_parameters_has_the_interval_of_the_parameter_that_it_is() {
        let fit = Toy::of(20, 3, 2.0, 2).fit(2);
        let clusters = fit.softened.clone();
        // The same data in a + b and a - b: their halves sum to a.
        let turned = |s: &Square| {
            let (a, b, d) = (s.at(0, 0), s.at(0, 1), s.at(1, 1));
            Square { n: 2, a: [a + 2.0 * b + d, a - d, a - d, a - 2.0 * b + d].map(|v| 0.25 * v).to_vec() }
        };
        let other: Vec<Quadratic> = clusters
            .iter()
            .map(|(s, u)| (turned(s), vec![0.5 * (u[0] + u[1]), 0.5 * (u[0] - u[1])]))
            .collect();
        let direct = Intervals::new(&fit.information, clusters).half_width(&[1.0, 0.0]);
        let by_sum = Intervals::new(&turned(&fit.information), other).half_width(&[0.5, 0.5]);
        assert!((direct / by_sum - 1.0).abs() < 1e-9, "{direct} {by_sum}");
    }
}
