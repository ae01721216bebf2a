//! Distribution functions and quantiles of the tests.

use augsim_system::NORMAL_95;
pub(crate) use augsim_system::statistics::{median, quantile};

/// Natural logarithm of the gamma function (Lanczos approximation, g = 7).
fn ln_gamma(x: f64) -> f64 {
    const C: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    let x = x - 1.0;
    let t = x + 7.5;
    let sum = C[0] + C[1..].iter().enumerate().map(|(i, c)| c / (x + 1.0 + i as f64)).sum::<f64>();
    0.5 * (2.0 * std::f64::consts::PI).ln() + (x + 0.5) * t.ln() - t + sum.ln()
}

/// Upper tail probability of the chi-squared distribution with `df` degrees of freedom.
///
/// Incomplete gamma function by series or continued fraction (Abramowitz and Stegun 6.5.29, 6.5.31).
pub(crate) fn chi2_tail(x: f64, df: f64) -> f64 {
    if df <= 0.0 || !x.is_finite() || x <= 0.0 {
        return if x > 0.0 && df > 0.0 { 0.0 } else { 1.0 };
    }
    let (a, z) = (0.5 * df, 0.5 * x);
    let front = (a * z.ln() - z - ln_gamma(a)).exp();
    if z < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-16 {
            n += 1.0;
            term *= z / n;
            sum += term;
        }
        (1.0 - front * sum).clamp(0.0, 1.0)
    } else {
        let (mut b, mut c) = (z + 1.0 - a, 1e300);
        let mut d = 1.0 / b;
        let mut h = d;
        for i in 1..500 {
            let an = -f64::from(i) * (f64::from(i) - a);
            b += 2.0;
            d = 1.0 / (an * d + b);
            c = b + an / c;
            h *= d * c;
            if (d * c - 1.0).abs() < 1e-15 {
                break;
            }
        }
        (front * h).clamp(0.0, 1.0)
    }
}

/// Value that a chi-squared variable with `df` degrees of freedom exceeds with probability `tail`. Computed
/// by bisection.
pub(crate) fn chi2_quantile(tail: f64, df: f64) -> f64 {
    let (mut low, mut high) = (0.0, 10.0 * df + 200.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if chi2_tail(middle, df) > tail { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Upper tail probability of Fisher's F distribution with `a` and `b` degrees of freedom.
///
/// Incomplete beta function by continued fraction (Abramowitz and Stegun 26.5.8, 26.6.2).
pub(crate) fn f_tail(x: f64, a: f64, b: f64) -> f64 {
    if x.is_nan() || x <= 0.0 {
        return 1.0;
    }
    if x.is_infinite() {
        return 0.0;
    }
    let z = b / (b + a * x);
    incomplete_beta(z, 0.5 * b, 0.5 * a)
}

/// Regularised incomplete beta function I_x(a, b), for `x` from 0 to 1.
fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(1.0 - x, b, a);
    }
    if x <= 0.0 {
        return 0.0;
    }
    let front = a * x.ln() + b * (-x).ln_1p() + ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b);
    let (mut c, mut d, mut sum) = (1.0, 1.0 / (1.0 - (a + b) * x / (a + 1.0)), 0.0);
    let mut h = d;
    for m in 1..200 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        for term in [even, odd] {
            d = 1.0 / (1.0 + term * d);
            c = 1.0 + term / c;
            h *= c * d;
        }
        if (h - sum).abs() < 1e-14 * h {
            break;
        }
        sum = h;
    }
    (front.exp() * h / a).clamp(0.0, 1.0)
}

/// Upper tail probability of Hotelling's T squared (Hotelling 1931). `t2` is the squared distance of `k`
/// means in their covariance, which has `freedom` degrees of freedom; 1 where these are too few.
pub(crate) fn hotelling_tail(t2: f64, k: usize, freedom: f64) -> f64 {
    let (k, rest) = (k as f64, freedom + 1.0 - k as f64);
    if k > 0.0 && rest > 0.0 { f_tail(t2 * rest / (k * freedom), k, rest) } else { 1.0 }
}

/// Mean of values over its standard error: Student's t, with one degree of freedom less than there are values.
pub(crate) fn t_of_mean(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    mean / (variance / n).sqrt()
}

/// Two-sided 95 % quantile of Student's t with `df` degrees of freedom. Computed by the third-order expansion
/// of Abramowitz and Stegun 26.7.5, accurate to 0.3 % from four degrees of freedom on.
pub(crate) fn student_quantile(df: f64) -> f64 {
    let z = NORMAL_95;
    let odd = |powers: [f64; 4]| powers.iter().rev().fold(0.0, |sum, c| sum * z * z + c) * z;
    let first = odd([1.0, 1.0, 0.0, 0.0]) / 4.0;
    let second = odd([3.0, 16.0, 5.0, 0.0]) / 96.0;
    let third = odd([-15.0, 17.0, 19.0, 3.0]) / 384.0;
    z + first / df + second / (df * df) + third / (df * df * df)
}

#[cfg(test)]
mod tests {
    //! Contract: tails agree with printed tables to three or four digits.
    use super::*;

    #[test]
    fn fisher_tails_are_those_of_tables() {
        // Abramowitz and Stegun, table 26.9: 5 and 1 percent.
        for (x, a, b, p) in [
            (4.543, 1.0, 15.0, 0.05),
            (3.478, 4.0, 10.0, 0.05),
            (8.683, 1.0, 15.0, 0.01),
            (3.805, 4.0, 15.0, 0.0249),
        ] {
            let found = f_tail(x, a, b);
            assert!((found / p - 1.0).abs() < 0.01, "{x}: {found}");
        }
        assert_eq!((f_tail(0.0, 2.0, 5.0), f_tail(f64::INFINITY, 2.0, 5.0)), (1.0, 0.0));
    }

    #[test]
    fn one_normal_number_in_twenty_lies_outside_its_interval() {
        assert!((chi2_tail(NORMAL_95 * NORMAL_95, 1.0) - 0.05).abs() < 1e-12);
    }

    #[test]
    fn tails_match_tables() {
        for (x, df, p) in [
            (3.841, 1.0, 0.05),
            (18.307, 10.0, 0.05),
            (124.342, 100.0, 0.05),
            (11.8, 1.0, 5.92e-4),
            (6.635, 1.0, 0.01),
        ] {
            assert!((chi2_tail(x, df) / p - 1.0).abs() < 2e-3, "{x} {df} {}", chi2_tail(x, df));
            assert!((chi2_quantile(p, df) / x - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn students_quantiles_match_tables() {
        for (df, t) in [(4.0, 2.7764), (5.0, 2.5706), (10.0, 2.2281), (30.0, 2.0423), (1e9, 1.9600)] {
            assert!((student_quantile(df) / t - 1.0).abs() < 3e-3, "{df} {}", student_quantile(df));
        }
    }
}
