//! Measurement noise, estimated from the data alone.
//!
//! Between events the motion is smooth and lies in the span of low-degree polynomials; the orthogonal
//! complement contains only noise. Restricted maximum likelihood (Patterson and Thompson 1971) estimates its
//! standard deviation, its autocorrelation, and its growth with speed, which jitter of the time stamps
//! causes.

use crate::arc::Arc;
use crate::difference_noise::rough_noise_of;
use crate::noise_estimate::{JITTER, Noise};
use crate::record::Measured;
use crate::statistics::{chi2_tail, median};
use rayon::prelude::*;

/// Decrease of -2 ln of the restricted likelihood that each further noise parameter must bring.
const MIN_LIKELIHOOD_GAIN: f64 = 16.0;
/// Size of a polynomial residual, in standard deviations, above which the sample is masked as an outlier.
const OUTLIER_SD: f64 = 5.5;
/// Ratio of declared to estimated noise above which the declared noise is treated as a tolerance.
const MIN_TOLERANCE_RATIO: f64 = 20.0;
/// Ratio of an arc's residual variance to the median above which the arc is disturbed and excluded. One in a
/// million arcs with five degrees of freedom exceeds it by chance.
const DISTURBED_VARIANCE_RATIO: f64 = 9.0;
/// p-value of Bartlett's test below which the records count as having different noise.
const MAX_P_NOISE_DIFFERS: f64 = 1e-6;
/// Degrees of freedom with which the common noise enters the noise estimate of each record.
const COMMON_NOISE_FREEDOM: f64 = 6.0;
/// Number of samples that suffices to estimate the noise correlation; more cost time without changing the
/// result.
const MAX_SAMPLES: usize = 8000;

/// Computes -2 ln of the restricted likelihood of the arcs, with the noise scale of each channel profiled
/// out. The noise has the correlation `rho` between neighbouring samples and the growth `growth` with speed.
fn restricted_deviance(arcs: &[&Arc], channels: usize, rho: f64, growth: f64) -> f64 {
    let parts: Vec<_> = arcs.par_iter().map(|a| a.restricted(rho, growth)).collect();
    let (mut rss, mut freedom, mut total) = (vec![0.0; channels], vec![0.0; channels], 0.0);
    for (arc, (r, logs, f)) in arcs.iter().zip(parts) {
        rss[arc.channel] += r;
        freedom[arc.channel] += f;
        total += logs;
    }
    total
        + rss
            .iter()
            .zip(&freedom)
            .filter(|(_, f)| **f > 0.0)
            .map(|(r, f)| f * ((r / f).max(1e-300).ln() + 1.0))
            .sum::<f64>()
}

/// Finds the minimum of a function on an interval by golden-section search; returns its argument and value.
fn golden_section(mut f: impl FnMut(f64) -> f64, mut low: f64, mut high: f64, rounds: usize) -> (f64, f64) {
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    let (mut a, mut b) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    for _ in 0..rounds {
        if fa < fb {
            high = b;
            (b, fb) = (a, fa);
            a = high - ratio * (high - low);
            fa = f(a);
        } else {
            low = a;
            (a, fa) = (b, fb);
            b = low + ratio * (high - low);
            fb = f(b);
        }
    }
    if fa < fb { (a, fa) } else { (b, fb) }
}

/// Smooth arcs of the samples that are not outliers, with the noise level found from them.
struct MaskedArcs {
    arcs: Vec<Arc>,
    /// Whether each sample is masked as an outlier or missing, `[record][channel][sample]`.
    masked: Vec<Vec<Vec<bool>>>,
    /// Standard deviation of the polynomial residuals by channel, in its unit.
    sd: Vec<f64>,
    outliers: usize,
}

/// Masks outliers in two rounds, and estimates the standard deviation of each channel from the other samples.
fn mask_outliers(data: &Measured, channels: usize) -> MaskedArcs {
    let mut masked: Vec<Vec<Vec<bool>>> = data
        .records
        .iter()
        .map(|r| r.data.values.iter().map(|c| c.iter().map(|v| !v.is_finite()).collect()).collect())
        .collect();
    let mut sd = vec![0.0; channels];
    let mut outliers = 0;
    let mut arcs = Vec::new();
    for round in 0..3 {
        arcs = collect_arcs(data, &masked);
        let residuals: Vec<Vec<f64>> = arcs.iter().map(Arc::residuals).collect();
        for (channel, sd) in sd.iter_mut().enumerate() {
            // The median in the first round is robust against outliers; later rounds use the sum of
            // squares.
            let of_channel = || arcs.iter().zip(&residuals).filter(|(a, _)| a.channel == channel);
            let freedom: f64 = of_channel().map(|(a, _)| (a.y.len() - a.basis[0].len()) as f64).sum();
            let samples: f64 = of_channel().map(|(a, _)| a.y.len() as f64).sum();
            *sd = if round == 0 {
                let mut absolute: Vec<f64> =
                    of_channel().flat_map(|(_, r)| r.iter().map(|v| v.abs())).collect();
                1.4826 * median(&mut absolute) * (samples / freedom.max(1.0)).sqrt()
            } else {
                (of_channel().flat_map(|(_, r)| r.iter().map(|v| v * v)).sum::<f64>() / freedom.max(1.0))
                    .sqrt()
            };
        }
        if round == 2 {
            break;
        }
        for (arc, r) in arcs.iter().zip(&residuals) {
            let largest = r.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            for (i, v) in r.iter().enumerate() {
                // An outlier distorts its neighbours' residuals, so the first round masks only the largest
                // of each arc.
                let is_worst = largest.is_some_and(|w| w.0 == i);
                if v.abs() > OUTLIER_SD * sd[arc.channel] && (is_worst || round > 0) {
                    masked[arc.place.0][arc.channel][arc.place.1[i]] = true;
                    outliers += 1;
                }
            }
        }
    }
    MaskedArcs { arcs, masked, sd, outliers }
}

/// Estimates the correlation of neighbouring samples and the growth of the noise with speed. The growth is
/// jitter/sd, up to `max_growth`. Each is 0 unless it decreases the deviance significantly.
fn correlation_and_growth(arcs: &[&Arc], channels: usize, stride: usize, max_growth: f64) -> (f64, f64) {
    let subset: Vec<&Arc> = arcs.iter().step_by(stride).copied().collect();
    let deviance = |rho: f64, growth: f64| restricted_deviance(&subset, channels, rho, growth);
    let fit_rho = |growth: f64| golden_section(|rho| deviance(rho, growth), -0.4, 0.95, 14);
    let fit_growth = |rho: f64| golden_section(|growth| deviance(rho, growth), 0.0, max_growth, 14);
    let (best_rho, best_growth) = (fit_rho(0.0), fit_growth(0.0));
    let (mut rho, mut growth) = (0.0, 0.0);
    if !is_supported(deviance(0.0, 0.0) - best_rho.1.min(best_growth.1)) {
        return (rho, growth);
    }
    // The better single parameter enters first, the other one only if it is significant beside it.
    if best_rho.1 < best_growth.1 {
        rho = best_rho.0;
        let second = fit_growth(rho);
        if is_supported(best_rho.1 - second.1) {
            growth = second.0;
            rho = fit_rho(growth).0;
        }
    } else {
        growth = best_growth.0;
        let second = fit_rho(growth);
        if is_supported(best_growth.1 - second.1) {
            rho = second.0;
            growth = fit_growth(rho).0;
        }
    }
    if rho != 0.0 {
        // The correlation extrapolates to low frequencies, so its final estimate uses all samples.
        let (low, high) = ((rho - 0.06).max(-0.4), (rho + 0.06).min(0.95));
        rho = golden_section(|rho| restricted_deviance(arcs, channels, rho, growth), low, high, 10).0;
    }
    (rho, growth)
}

/// Whether the noise estimate, with `freedom` degrees of freedom, differs significantly from the declared
/// noise.
fn differs_from_declared(sd: &[f64], declared: &[f64], outliers: usize, freedom: f64) -> bool {
    let squares = sd.iter().zip(declared).map(|(s, d)| (s / d).powi(2));
    let ratio = (squares.sum::<f64>() / sd.len() as f64).sqrt();
    // Outliers too small to be detected raise the estimate a little.
    let is_raised_by_outliers = outliers > 0 && (0.9..1.3).contains(&ratio);
    let deviation = ratio.ln().abs();
    !is_raised_by_outliers && deviation > 0.03 && deviation * (2.0 * freedom).sqrt() > 4.0
}

/// Estimates the noise of records divided into smooth segments, masks outliers, and sets the weights of all
/// samples. Without `smooth_motion` the noise is assumed white: the polynomial residuals then contain motion
/// and would look correlated.
pub(crate) fn estimate_noise(data: &mut Measured, smooth_motion: bool) -> Noise {
    let declared: Vec<Option<f64>> = data.system.schema().channels.iter().map(|c| c.sd).collect();
    let channels = declared.len();
    let MaskedArcs { arcs, masked, mut sd, outliers } = mask_outliers(data, channels);
    let total_samples: usize = arcs.iter().map(|a| a.y.len()).sum();
    let smooth = undisturbed_arcs(&arcs, channels);
    let smallest = sd.iter().copied().filter(|s| *s > 0.0).fold(f64::INFINITY, f64::min);
    let (mut rho, mut growth) = (0.0, 0.0);
    if smooth_motion {
        let stride = total_samples.div_ceil(MAX_SAMPLES).max(1);
        (rho, growth) = correlation_and_growth(&smooth, channels, stride, 0.004 / smallest.max(1e-9));
    }
    let mut freedom = 0.0;
    for (channel, sd) in sd.iter_mut().enumerate() {
        let (mut rss, mut f) = (0.0, 0.0);
        for (r, _, free) in smooth.iter().filter(|a| a.channel == channel).map(|a| a.restricted(rho, growth))
        {
            rss += r;
            f += free;
        }
        freedom += f;
        let rough = || Some(rough_noise_of(data, channel)).filter(|sd| *sd > 0.0);
        // Records too short for polynomials leave the differences of neighbouring samples.
        let without_arcs = || declared[channel].or_else(rough).unwrap_or(1e-3);
        *sd = if f > 0.0 { (rss / f).sqrt() } else { without_arcs() };
        if let Some(max_sd) = data.system.schema().channels[channel].max_sd {
            *sd = sd.min(max_sd);
        }
        // Noise-free data: 1e-6 m, the sixth printed digit, is the finest scale for any decision.
        *sd = sd.max(1e-6);
    }
    // Data made by a program have almost no noise. A declared value far above the estimate is a tolerance:
    // how closely the model should agree.
    let declared: Option<Vec<f64>> = declared.into_iter().collect();
    let tolerance =
        declared.as_ref().filter(|d| sd.iter().zip(*d).all(|(s, d)| s * MIN_TOLERANCE_RATIO < *d));
    if let Some(declared) = tolerance {
        sd.copy_from_slice(declared);
        (rho, growth) = (0.0, 0.0);
    }
    let mut findings = Vec::new();
    if let Some(declared) = declared.as_ref().filter(|_| tolerance.is_none())
        && differs_from_declared(&sd, declared, outliers, freedom)
    {
        findings.push("noise-scale");
    }
    if rho != 0.0 {
        findings.push("noise-autocorrelated");
    }
    // Without any arc there is no smallest noise, and no growth either.
    let jitter_s = if growth > 0.0 { growth * smallest } else { 0.0 };
    if growth > 0.0 {
        findings.push(JITTER);
    }
    let expected = 1e-4 * total_samples as f64;
    if outliers as f64 > expected + 3.0 * expected.sqrt().max(0.5) {
        findings.push("outliers");
    }
    set_weights(data, &arcs, &masked, &sd, growth);
    if tolerance.is_none()
        && let Some(ratios) = record_noise_ratios(&arcs, &sd, data.records.len(), rho, growth)
    {
        findings.push("noise-differs");
        for (r, ratio) in data.records.iter_mut().zip(ratios) {
            r.weight.iter_mut().flatten().for_each(|w| *w /= ratio);
        }
    }
    Noise { white: sd.clone(), sd, correlation: rho, jitter_s, frame_s: None, findings, outliers }
}

/// Whether a further noise parameter is significant, given its reduction of -2 ln of the restricted
/// likelihood.
fn is_supported(reduction: f64) -> bool {
    reduction > MIN_LIKELIHOOD_GAIN
}

/// The arcs without those whose residuals far exceed the median. These contain an undetected event or a
/// disturbance, not only sensor noise.
fn undisturbed_arcs(arcs: &[Arc], channels: usize) -> Vec<&Arc> {
    let level =
        |a: &Arc| a.residuals().iter().map(|r| r * r).sum::<f64>() / (a.y.len() - a.basis[0].len()) as f64;
    let levels: Vec<f64> = arcs.iter().map(level).collect();
    let limits: Vec<f64> = (0..channels)
        .map(|c| {
            let of_channel = arcs.iter().zip(&levels).filter(|(a, _)| a.channel == c);
            DISTURBED_VARIANCE_RATIO * median(&mut of_channel.map(|(_, l)| *l).collect::<Vec<_>>())
        })
        .collect();
    arcs.iter().zip(levels).filter(|(a, l)| *l <= limits[a.channel]).map(|(a, _)| a).collect()
}

/// Ratio of each record's noise to the common one; `None` unless records differ significantly (Bartlett's
/// test). The ratios of records with few samples are shrunk towards 1.
fn record_noise_ratios(arcs: &[Arc], sd: &[f64], records: usize, rho: f64, growth: f64) -> Option<Vec<f64>> {
    let (mut rss, mut freedom) = (vec![0.0; records], vec![0.0; records]);
    for arc in arcs {
        let (r, _, f) = arc.restricted(rho, growth);
        rss[arc.place.0] += r / (sd[arc.channel] * sd[arc.channel]);
        freedom[arc.place.0] += f;
    }
    let observed = || rss.iter().zip(&freedom).filter(|(_, f)| **f > 0.0);
    let total: f64 = freedom.iter().sum();
    let common = (rss.iter().sum::<f64>() / total.max(1.0)).max(1e-300);
    let statistic = total * common.ln() - observed().map(|(r, f)| f * (r / f).max(1e-300).ln()).sum::<f64>();
    let shrinkage = 1.0
        + (observed().map(|(_, f)| 1.0 / f).sum::<f64>() - 1.0 / total.max(1.0))
            / (3.0 * (observed().count() as f64 - 1.0).max(1.0));
    let p = chi2_tail(statistic / shrinkage, (observed().count() as f64 - 1.0).max(1.0));
    let ratio = |(r, f): (&f64, &f64)| ((r + COMMON_NOISE_FREEDOM) / (f + COMMON_NOISE_FREEDOM)).sqrt();
    (p < MAX_P_NOISE_DIFFERS).then(|| rss.iter().zip(&freedom).map(ratio).collect())
}

/// Variance of each channel about polynomials over segments of `length` samples, in its squared unit. It is
/// the median over up to 400 segments.
pub(crate) fn polynomial_variance(data: &Measured, length: usize) -> Vec<f64> {
    let channels = data.system.schema().channels.len();
    let total: usize = data.records.iter().map(|r| r.data.times.len()).sum();
    let stride = (total / length.max(1)).div_ceil(MAX_SEGMENTS).max(1) * length;
    (0..channels)
        .map(|c| {
            let mut levels = Vec::new();
            for (j, r) in data.records.iter().enumerate() {
                for first in (0..r.data.times.len().saturating_sub(length)).step_by(stride) {
                    let used = (first..first + length).filter(|&k| r.data.values[c][k].is_finite());
                    let arc = Arc::new(r, used.collect(), c, j);
                    levels.extend(arc.map(|a| {
                        let freedom = (a.y.len() - a.basis[0].len()) as f64;
                        a.residuals().iter().map(|v| v * v).sum::<f64>() / freedom
                    }));
                }
            }
            median(&mut levels)
        })
        .collect()
}

/// Number of segments that suffices to estimate the variance of a channel about polynomials.
const MAX_SEGMENTS: usize = 400;

/// Collects the smooth arcs of all records, from the samples that are not masked.
fn collect_arcs(data: &Measured, masked: &[Vec<Vec<bool>>]) -> Vec<Arc> {
    let mut arcs = Vec::new();
    for (j, r) in data.records.iter().enumerate() {
        for range in &r.data.smooth_segments {
            for (channel, masked) in masked[j].iter().enumerate() {
                let samples: Vec<usize> = range.clone().filter(|&k| !masked[k]).collect();
                arcs.extend(Arc::new(r, samples, channel, j));
            }
        }
    }
    arcs
}

/// Sets the weights of all samples to 1/σ, with σ growing with the speed of the motion; masked samples get 0.
fn set_weights(data: &mut Measured, arcs: &[Arc], masked: &[Vec<Vec<bool>>], sd: &[f64], growth: f64) {
    let mut speeds: Vec<Vec<Vec<f64>>> = data
        .records
        .iter()
        .map(|r| r.data.values.iter().map(|c| vec![f64::NAN; c.len()]).collect())
        .collect();
    for arc in arcs {
        for (&k, v) in arc.place.1.iter().zip(&arc.speed) {
            speeds[arc.place.0][arc.channel][k] = *v;
        }
    }
    for (j, r) in data.records.iter_mut().enumerate() {
        r.weight = (0..r.data.values.len())
            .map(|c| {
                let known = &speeds[j][c];
                // Samples near events take the speed of the nearest sample of an arc.
                let mut last = known.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
                (0..r.data.times.len())
                    .map(|k| {
                        if known[k].is_finite() {
                            last = known[k];
                        }
                        if masked[j][c][k] {
                            0.0
                        } else {
                            1.0 / (sd[c] * (1.0 + (growth * last).powi(2)).sqrt())
                        }
                    })
                    .collect()
            })
            .collect();
    }
}

#[cfg(test)]
mod tests {
    //! Contract: chance does not add noise parameters, and disturbed arcs are excluded.
    use super::*;
    use crate::statistics::chi2_quantile;

    #[test]
    fn a_noise_parameter_needs_a_p_value_of_about_one_in_ten_thousand() {
        let reduction = |chance: f64| chi2_quantile(chance, 1.0);
        assert!(!is_supported(reduction(1e-3)) && is_supported(reduction(1e-7)));
    }

    /// One arc for each standard deviation in `sds`, with residuals about a constant that alternate in sign.
    fn arcs(sds: &[f64]) -> Vec<Arc> {
        let y = |sd: f64| (0..8).map(|k| if k % 2 == 0 { sd } else { -sd }).collect();
        let arc = |(record, sd): (usize, &f64)| Arc {
            channel: 0,
            y: y(*sd),
            basis: vec![vec![1.0]; 8],
            speed: vec![0.0; 8],
            linked: vec![false; 8],
            place: (record, (0..8).collect()),
        };
        sds.iter().enumerate().map(arc).collect()
    }

    #[test]
    fn arcs_with_three_and_a_half_times_the_noise_are_disturbed() {
        let arcs = arcs(&[1.0, 1.0, 1.0, 2.5, 3.5]);
        let smooth: Vec<usize> = undisturbed_arcs(&arcs, 1).iter().map(|arc| arc.place.0).collect();
        assert_eq!(smooth, [0, 1, 2, 3]);
    }
}
