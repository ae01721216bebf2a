//! Discrete Fourier transform of a power of two of samples, and the periodogram.

use std::f64::consts::PI;

/// Transforms complex samples in place: `X_k = sum_n x_n exp(-2 pi i k n / N)`.
///
/// The algorithm is the one of Cooley and Tukey (1965), for powers of two.
///
/// `re` and `im` have the same length, a power of two.
fn transform(re: &mut [f64], im: &mut [f64]) {
    let n = re.len();
    debug_assert!(n.is_power_of_two() && im.len() == n);
    let bits = n.trailing_zeros();
    for i in 0..n {
        let j = if bits == 0 { 0 } else { i.reverse_bits() >> (usize::BITS - bits) };
        if i < j {
            re.swap(i, j);
            im.swap(i, j);
        }
    }
    let twiddles: Vec<(f64, f64)> =
        (0..n / 2).map(|k| (-2.0 * PI * k as f64 / n as f64).sin_cos()).map(|(s, c)| (c, s)).collect();
    let mut half = 1;
    while half < n {
        let stride = n / (2 * half);
        for start in (0..n).step_by(2 * half) {
            for k in 0..half {
                let (c, s) = twiddles[k * stride];
                let (a, b) = (start + k, start + k + half);
                let (x, y) = (re[b] * c - im[b] * s, re[b] * s + im[b] * c);
                (re[b], im[b]) = (re[a] - x, im[a] - y);
                (re[a], im[a]) = (re[a] + x, im[a] + y);
            }
        }
        half *= 2;
    }
}

/// One-sided power spectral density of real samples, unit^2/Hz.
///
/// The frequencies are `k / (size * interval_s)`, k = 0..=size/2.
///
/// A Hann window is applied, and zeros are appended up to `size`, a power of two that is at least the
/// number of samples. The sum of the densities times their spacing is the mean square of the samples, which are
/// without a mean.
pub fn periodogram(samples: &[f64], interval_s: f64, size: usize) -> Vec<f64> {
    let n = samples.len();
    let mut re = vec![0.0; size];
    let mut im = vec![0.0; size];
    let mut window_power = 0.0;
    for (i, (value, sample)) in re.iter_mut().zip(samples).enumerate() {
        let window = (PI * (i as f64 + 0.5) / n as f64).sin().powi(2);
        window_power += window * window;
        *value = window * sample;
    }
    transform(&mut re, &mut im);
    let scale = 2.0 * interval_s / window_power;
    (0..=size / 2).map(|k| scale * (re[k] * re[k] + im[k] * im[k])).collect()
}

#[cfg(test)]
mod tests {
    //! Contract: the transform equals its defining sum, and the density integrates to the variance.
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_transform_equals_its_defining_sum() {
        let x: Vec<f64> = (0..16).map(|i| ((i * 7 + 3) % 11) as f64 - 4.0).collect();
        let y: Vec<f64> = (0..16).map(|i| ((i * 5 + 1) % 13) as f64 - 6.0).collect();
        let (mut re, mut im) = (x.clone(), y.clone());
        transform(&mut re, &mut im);
        for k in 0..16 {
            let (mut a, mut b) = (0.0, 0.0);
            for n in 0..16 {
                let (s, c) = (-2.0 * PI * (k * n) as f64 / 16.0).sin_cos();
                a += x[n] * c - y[n] * s;
                b += x[n] * s + y[n] * c;
            }
            assert_relative_eq!(re[k], a, epsilon = 1e-12);
            assert_relative_eq!(im[k], b, epsilon = 1e-12);
        }
    }

    #[test]
    fn the_density_of_a_sine_has_its_frequency_and_its_variance() {
        let interval = 0.01;
        let x: Vec<f64> = (0..1000).map(|i| 3.0 * (2.0 * PI * 7.0 * i as f64 * interval).sin()).collect();
        let density = periodogram(&x, interval, 1024);
        let spacing = 1.0 / (1024.0 * interval);
        let peak = (0..density.len()).max_by(|a, b| density[*a].total_cmp(&density[*b])).expect("not empty");
        assert_relative_eq!(peak as f64 * spacing, 7.0, epsilon = spacing);
        assert_relative_eq!(density.iter().sum::<f64>() * spacing, 4.5, epsilon = 0.01);
    }
}
