//! Effective number of independent residuals.
//!
//! Model error and process noise make residuals autocorrelated. A column that varies in the same way is
//! affected by the peak of their spectrum, so that correspondingly fewer residuals count. For an
//! exponentially decaying autocorrelation `rho`, with or without oscillation, the peak is `1 + 4 sum
//! rho_k^2` times the mean of the spectrum: for `rho_k = exp(-k/T)` both are `1 + 2 T`, for `exp(-k/T)
//! cos(w k)` both are `1 + T`. So
//!
//! ```text
//! (4) share of the residuals that are independent   1 / (1 + 4 sum_k (1 - k/L) rho_k^2)
//! ```
//!
//! over the lags within windows of `L` samples, minus what white noise contributes. This is twice the sum
//! of Bartlett (1946) for squares of residuals, because the worst column counts.

use super::rows::Rows;
use std::collections::BTreeMap;

/// Maximum lag of the autocorrelation, in samples. Longer correlation shows in the scatter over blocks.
const MAX_LAGS: usize = 1000;

/// Share of the residuals that count as independent, in view of their autocorrelation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Independence {
    /// Share of the residuals that are independent, formula (4).
    pub share: f64,
    /// Share of independent residuals, formula (4), in the channel with the longest correlation.
    pub min_share: f64,
    /// Mean number of measured samples per channel.
    pub samples: f64,
}

impl Independence {
    /// Computes the shares from the autocorrelation of the residuals of a fit within its windows.
    pub fn from_rows(rows: &Rows) -> Self {
        let by_channel = products(rows);
        let mut total = Products::default();
        by_channel.values().for_each(|products| total.join(products));
        let share = total.independent();
        let shares = by_channel.values().map(Products::independent);
        Self {
            share,
            min_share: shares.fold(share, f64::min),
            samples: total.samples / by_channel.len().max(1) as f64,
        }
    }
}

/// Sums of products of residuals and their numbers, by lag.
#[derive(Clone, Debug, Default)]
struct Products {
    sums: Vec<f64>,
    counts: Vec<f64>,
    samples: f64,
}

impl Products {
    fn add(&mut self, series: &[f64]) {
        let lags = (series.len() / 2).clamp(1, MAX_LAGS);
        self.extend(lags);
        for lag in 0..lags {
            self.sums[lag] += series[lag..].iter().zip(series).map(|(a, b)| a * b).sum::<f64>();
            self.counts[lag] += (series.len() - lag) as f64;
        }
        self.samples += series.len() as f64;
    }

    fn extend(&mut self, lags: usize) {
        let lags = lags.max(self.sums.len());
        self.sums.resize(lags, 0.0);
        self.counts.resize(lags, 0.0);
    }

    fn join(&mut self, other: &Self) {
        self.extend(other.sums.len());
        self.sums.iter_mut().zip(&other.sums).for_each(|(a, b)| *a += b);
        self.counts.iter_mut().zip(&other.counts).for_each(|(a, b)| *a += b);
        self.samples += other.samples;
    }

    /// Share of independent residuals, formula (4).
    fn independent(&self) -> f64 {
        let power = self.sums.first().zip(self.counts.first()).map_or(0.0, |(s, n)| s / n);
        if !(power > 0.0 && power.is_finite()) {
            return 1.0;
        }
        let excess = self.sums.iter().zip(&self.counts).skip(1).map(|(s, n)| {
            let rho = s / n / power;
            (n / self.samples) * (rho * rho - 1.0 / n)
        });
        1.0 / (1.0 + 4.0 * excess.sum::<f64>().max(0.0))
    }
}

/// Sums of products of the residuals of each channel by lag, window by window.
fn products(rows: &Rows) -> BTreeMap<u16, Products> {
    let width = rows.width;
    let mut by_channel: BTreeMap<u16, Products> = BTreeMap::new();
    for window in &rows.windows {
        let measured = window.samples();
        let residual = |k: usize| window.values[k * width + width - 1] * window.weight.sqrt();
        let mut first = 0;
        while first < measured {
            let channel = window.block_and_channel[first].1;
            let end =
                (first..measured).find(|&k| window.block_and_channel[k].1 != channel).unwrap_or(measured);
            let series: Vec<f64> = (first..end).map(residual).collect();
            by_channel.entry(channel).or_default().add(&series);
            first = end;
        }
    }
    by_channel
}

#[cfg(test)]
mod tests {
    //! Contract: the independent share is one over the peak of the normalised spectrum for white, decaying
    //! and oscillating noise; products of channels add up.
    use super::*;
    use augsim_data::random_stream;
    use rand_distr::{Distribution, StandardNormal};

    const SAMPLES: usize = 40_000;

    /// Draws second-order autoregressive noise with the coefficients `a` (lag 1) and `b` (lag 2).
    fn noise(a: f64, b: f64, name: &str) -> Vec<f64> {
        let mut rng = random_stream(1, name, 0);
        let mut out = vec![0.0, 0.0];
        for k in 2..SAMPLES {
            let pushed: f64 = StandardNormal.sample(&mut rng);
            out.push(a * out[k - 1] + b * out[k - 2] + pushed);
        }
        out
    }

    fn share(series: &[f64]) -> f64 {
        let mut products = Products::default();
        series.chunks(4000).for_each(|window| products.add(window));
        products.independent()
    }

    #[test]
    fn the_independent_share_is_one_over_the_peak_of_the_spectrum() {
        let white = share(&noise(0.0, 0.0, "white"));
        assert!(white > 0.95, "{white}");
        // (1 - a) / (1 + a).
        let fading = share(&noise(0.8, 0.0, "fading")) * 9.0;
        assert!((fading - 1.0).abs() < 0.15, "{fading}");
        // Poles of modulus exp(-1/T) far from the axis: the peak is 1 + T.
        let (modulus, turn) = ((-0.05_f64).exp(), 1.0_f64.cos());
        let swinging = share(&noise(2.0 * modulus * turn, -modulus * modulus, "swinging")) * 21.0;
        assert!((swinging - 1.0).abs() < 0.2, "{swinging}");
    }

    #[test]
    fn products_of_channels_add_up() {
        let (mut one, mut both) = (Products::default(), Products::default());
        let (long, short) = (noise(0.5, 0.0, "long"), noise(0.5, 0.0, "short"));
        one.add(&long);
        one.add(&short[..100]);
        for series in [&long[..], &short[..100]] {
            let mut products = Products::default();
            products.add(series);
            both.join(&products);
        }
        assert_eq!(one.independent().to_bits(), both.independent().to_bits());
        assert_eq!(one.samples as usize, SAMPLES + 100);
    }
}
