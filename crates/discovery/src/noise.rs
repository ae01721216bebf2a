//! Noise of the sensor, estimated from the data alone.
//!
//! Between events every effect of the motion is smooth: it lies in the space of polynomials of low degree over an arc, and the
//! orthogonal complement is pure noise. Its scale, its autocorrelation and its growth with speed (jitter of the time stamps)
//! are found by restricted maximum likelihood (Patterson and Thompson 1971).

use crate::arc::Arc;
use crate::record::Measured;
use crate::statistics::{chi2_tail, median};
use augsim_data::FrameClock;
use rayon::prelude::*;

/// Kind of the finding that time stamps scatter.
const JITTER: &str = "timing-jitter";
/// Reduction of -2 ln of the restricted likelihood that a further noise parameter must bring.
const ENOUGH: f64 = 16.0;
/// Residuals beyond this many standard deviations are masked.
const OUTLIER: f64 = 5.5;
/// Ratio of declared to estimated noise from which the declared one is a tolerance.
const TOLERANCE: f64 = 20.0;
/// Ratio of an arc's variance to the median one from which the arc is no measure of the noise: one in a million of those
/// with five degrees of freedom.
const ROUGH: f64 = 9.0;
/// Probability below which the records' noise is taken to differ.
const DIFFERS: f64 = 1e-6;
/// Degrees of freedom of the common noise that each record's own is mixed with.
const PULL: f64 = 6.0;
/// Samples that are enough to estimate the correlation: more cost time and change nothing.
const MOST_SAMPLES: usize = 8000;

/// The noise of a data set.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Noise {
    /// Standard deviation by channel, in the unit of each.
    pub sd: Vec<f64>,
    /// The same as neighbouring samples show it, where the declared accuracy of the instrument is far more.
    pub white: Vec<f64>,
    /// Correlation of neighbouring samples.
    pub correlation: f64,
    /// Standard deviation of the time stamps, s.
    pub jitter_s: f64,
    /// From one frame to the next, s, where samples were put on the frames that their stamps jitter about.
    pub frame_s: Option<f64>,
    /// Findings by kind.
    pub findings: Vec<&'static str>,
    /// Masked samples.
    pub outliers: usize,
    /// Degrees of freedom of the estimate.
    pub freedom: f64,
}

impl Noise {
    /// Tells of the clock whose frames the samples were put on.
    pub fn put_on_frames(&mut self, FrameClock { period_s, jitter_s }: FrameClock) {
        (self.frame_s, self.jitter_s) = (Some(period_s), jitter_s);
        if !self.findings.contains(&JITTER) {
            self.findings.push(JITTER);
        }
    }

    /// Share of the variance that fits use which is white: the least that residuals can have, at most 1.
    pub fn white_share(&self) -> f64 {
        let shares = self.white.iter().zip(&self.sd).map(|(white, sd)| (white / sd).powi(2));
        (shares.sum::<f64>() / self.sd.len().max(1) as f64).min(1.0)
    }
}

/// -2 ln restricted likelihood with the scale of each channel profiled out.
fn criterion(arcs: &[&Arc], channels: usize, rho: f64, growth: f64) -> f64 {
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

/// Smallest value of a function on an interval by golden sections.
fn golden(mut f: impl FnMut(f64) -> f64, mut low: f64, mut high: f64, rounds: usize) -> (f64, f64) {
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

/// Estimates the noise of segmented records, masks outliers, and sets the weights of every sample. Where the motion is not
/// smooth between samples, the noise is taken for white: what polynomials leave is motion, and looks correlated.
pub(crate) fn estimate(data: &mut Measured, smooth_motion: bool) -> Noise {
    let declared: Vec<Option<f64>> = data.system.schema().channels.iter().map(|c| c.sd).collect();
    let channels = declared.len();
    let mut masked: Vec<Vec<Vec<bool>>> = data
        .records
        .iter()
        .map(|r| r.seen.values.iter().map(|c| c.iter().map(|v| !v.is_finite()).collect()).collect())
        .collect();
    let mut sd = vec![0.0; channels];
    let mut outliers = 0;
    let mut arcs = Vec::new();
    for round in 0..3 {
        arcs = collect(data, &masked);
        let residuals: Vec<Vec<f64>> = arcs.iter().map(Arc::residuals).collect();
        for (channel, sd) in sd.iter_mut().enumerate() {
            // First by the median, which outliers do not move; then by the sum of squares of what is left.
            let mine = || arcs.iter().zip(&residuals).filter(|(a, _)| a.channel == channel);
            let freedom: f64 = mine().map(|(a, _)| (a.y.len() - a.basis[0].len()) as f64).sum();
            let samples: f64 = mine().map(|(a, _)| a.y.len() as f64).sum();
            *sd = if round == 0 {
                let mut all: Vec<f64> = mine().flat_map(|(_, r)| r.iter().map(|v| v.abs())).collect();
                1.4826 * median(&mut all) * (samples / freedom.max(1.0)).sqrt()
            } else {
                (mine().flat_map(|(_, r)| r.iter().map(|v| v * v)).sum::<f64>() / freedom.max(1.0)).sqrt()
            };
        }
        if round == 2 {
            break;
        }
        for (arc, r) in arcs.iter().zip(&residuals) {
            let worst = r.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            for (i, v) in r.iter().enumerate() {
                // An outlier pulls its neighbours' residuals: in the first round only the worst of an arc goes.
                let worst_here = worst.is_some_and(|w| w.0 == i);
                if v.abs() > OUTLIER * sd[arc.channel] && (worst_here || round > 0) {
                    masked[arc.place.0][arc.channel][arc.place.1[i]] = true;
                    outliers += 1;
                }
            }
        }
    }
    let total_samples: usize = arcs.iter().map(|a| a.y.len()).sum();
    let smooth = smooth_arcs(&arcs, channels);
    let stride = total_samples.div_ceil(MOST_SAMPLES).max(1);
    let some: Vec<&Arc> = smooth.iter().step_by(stride).copied().collect();
    let plain = criterion(&some, channels, 0.0, 0.0);
    let smallest = sd.iter().copied().filter(|s| *s > 0.0).fold(f64::INFINITY, f64::min);
    let top = 0.004 / smallest.max(1e-9);
    let (mut rho, mut growth) = (0.0, 0.0);
    let by_rho = golden(|r| criterion(&some, channels, r, 0.0), -0.4, 0.95, 14);
    let by_growth = golden(|g| criterion(&some, channels, 0.0, g), 0.0, top, 14);
    if smooth_motion && pays(plain - by_rho.1.min(by_growth.1)) {
        if by_rho.1 < by_growth.1 {
            rho = by_rho.0;
            let second = golden(|g| criterion(&some, channels, rho, g), 0.0, top, 14);
            if pays(by_rho.1 - second.1) {
                growth = second.0;
                rho = golden(|r| criterion(&some, channels, r, growth), -0.4, 0.95, 14).0;
            }
        } else {
            growth = by_growth.0;
            let second = golden(|r| criterion(&some, channels, r, growth), -0.4, 0.95, 14);
            if pays(by_growth.1 - second.1) {
                rho = second.0;
                growth = golden(|g| criterion(&some, channels, rho, g), 0.0, top, 14).0;
            }
        }
    }
    if rho != 0.0 {
        // What low frequencies hold is an extrapolation by the correlation: it is worth all samples.
        rho = golden(
            |r| criterion(&smooth, channels, r, growth),
            (rho - 0.06).max(-0.4),
            (rho + 0.06).min(0.95),
            10,
        )
        .0;
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
        *sd = if f > 0.0 { (rss / f).sqrt() } else { declared[channel].unwrap_or(1e-3) };
        if let Some(most) = data.system.schema().channels[channel].sd_at_most {
            *sd = sd.min(most);
        }
        // Data without noise: six printed digits of metres are the finest that anything is judged by.
        *sd = sd.max(1e-6);
    }
    // Data made by a program have next to no noise. A declared deviation far above what they show is a tolerance: how
    // closely the model is asked to agree.
    let declared: Option<Vec<f64>> = declared.into_iter().collect();
    let tolerance = declared.as_ref().filter(|d| sd.iter().zip(*d).all(|(s, d)| s * TOLERANCE < *d));
    if let Some(declared) = tolerance {
        sd.copy_from_slice(declared);
        (rho, growth) = (0.0, 0.0);
    }
    let mut findings = Vec::new();
    if let Some(declared) = declared.as_ref().filter(|_| tolerance.is_none()) {
        let squares = sd.iter().zip(declared).map(|(s, d)| (s / d).powi(2));
        let ratio = (squares.sum::<f64>() / channels as f64).sqrt();
        // Wrong samples that are too small to be told from right ones raise the estimate a little.
        let blurred = outliers > 0 && (0.9..1.3).contains(&ratio);
        if !blurred && ratio.ln().abs() > 0.03 && ratio.ln().abs() * (2.0 * freedom).sqrt() > 4.0 {
            findings.push("noise-scale");
        }
    }
    if rho != 0.0 {
        findings.push("noise-autocorrelated");
    }
    let jitter_s = growth * smallest;
    if growth > 0.0 {
        findings.push(JITTER);
    }
    let expected = 1e-4 * total_samples as f64;
    if outliers as f64 > expected + 3.0 * expected.sqrt().max(0.5) {
        findings.push("outliers");
    }
    weigh(data, &arcs, &masked, &sd, growth);
    if tolerance.is_none()
        && let Some(ratios) = spread(&arcs, &sd, data.records.len(), rho, growth)
    {
        findings.push("noise-differs");
        for (r, ratio) in data.records.iter_mut().zip(ratios) {
            r.weight.iter_mut().flatten().for_each(|w| *w /= ratio);
        }
    }
    Noise { white: sd.clone(), sd, correlation: rho, jitter_s, frame_s: None, findings, outliers, freedom }
}

/// Whether a further parameter of the noise pays, by the reduction of -2 ln of the restricted likelihood that it brings.
fn pays(reduction: f64) -> bool {
    reduction > ENOUGH
}

/// Arcs without those whose misfit is far beyond that of the others: there was a hand in the way, or an event in the arc.
/// They tell nothing about the sensor.
fn smooth_arcs(arcs: &[Arc], channels: usize) -> Vec<&Arc> {
    let level =
        |a: &Arc| a.residuals().iter().map(|r| r * r).sum::<f64>() / (a.y.len() - a.basis[0].len()) as f64;
    let levels: Vec<f64> = arcs.iter().map(level).collect();
    let limits: Vec<f64> = (0..channels)
        .map(|c| {
            let mine = arcs.iter().zip(&levels).filter(|(a, _)| a.channel == c);
            ROUGH * median(&mut mine.map(|(_, l)| *l).collect::<Vec<_>>())
        })
        .collect();
    arcs.iter().zip(levels).filter(|(a, l)| *l <= limits[a.channel]).map(|(a, _)| a).collect()
}

/// Noise of each record against the common one, where records differ by more than chance (Bartlett's test); a record of
/// few samples is drawn towards 1.
fn spread(arcs: &[Arc], sd: &[f64], records: usize, rho: f64, growth: f64) -> Option<Vec<f64>> {
    let (mut rss, mut freedom) = (vec![0.0; records], vec![0.0; records]);
    for arc in arcs {
        let (r, _, f) = arc.restricted(rho, growth);
        rss[arc.place.0] += r / (sd[arc.channel] * sd[arc.channel]);
        freedom[arc.place.0] += f;
    }
    let seen = || rss.iter().zip(&freedom).filter(|(_, f)| **f > 0.0);
    let all: f64 = freedom.iter().sum();
    let common = (rss.iter().sum::<f64>() / all.max(1.0)).max(1e-300);
    let statistic = all * common.ln() - seen().map(|(r, f)| f * (r / f).max(1e-300).ln()).sum::<f64>();
    let shrinkage = 1.0
        + (seen().map(|(_, f)| 1.0 / f).sum::<f64>() - 1.0 / all.max(1.0))
            / (3.0 * (seen().count() as f64 - 1.0).max(1.0));
    let p = chi2_tail(statistic / shrinkage, (seen().count() as f64 - 1.0).max(1.0));
    let ratio = |(r, f): (&f64, &f64)| ((r + PULL) / (f + PULL)).sqrt();
    (p < DIFFERS).then(|| rss.iter().zip(&freedom).map(ratio).collect())
}

/// Variance of each channel about polynomials over stretches of `length` samples: the median of up to a few hundred.
pub(crate) fn smooth_misfit(data: &Measured, length: usize) -> Vec<f64> {
    let channels = data.system.schema().channels.len();
    let total: usize = data.records.iter().map(|r| r.seen.times.len()).sum();
    let stride = (total / length.max(1)).div_ceil(MOST_STRETCHES).max(1) * length;
    (0..channels)
        .map(|c| {
            let mut levels = Vec::new();
            for (j, r) in data.records.iter().enumerate() {
                for first in (0..r.seen.times.len().saturating_sub(length)).step_by(stride) {
                    let used = (first..first + length).filter(|&k| r.seen.values[c][k].is_finite());
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

/// Stretches that are enough to tell how rough a channel is.
const MOST_STRETCHES: usize = 400;

fn collect(data: &Measured, masked: &[Vec<Vec<bool>>]) -> Vec<Arc> {
    let mut arcs = Vec::new();
    for (j, r) in data.records.iter().enumerate() {
        for range in &r.seen.pieces {
            for (channel, masked) in masked[j].iter().enumerate() {
                let samples: Vec<usize> = range.clone().filter(|&k| !masked[k]).collect();
                arcs.extend(Arc::new(r, samples, channel, j));
            }
        }
    }
    arcs
}

fn weigh(data: &mut Measured, arcs: &[Arc], masked: &[Vec<Vec<bool>>], sd: &[f64], growth: f64) {
    let mut speeds: Vec<Vec<Vec<f64>>> = data
        .records
        .iter()
        .map(|r| r.seen.values.iter().map(|c| vec![f64::NAN; c.len()]).collect())
        .collect();
    for arc in arcs {
        for (&k, v) in arc.place.1.iter().zip(&arc.speed) {
            speeds[arc.place.0][arc.channel][k] = *v;
        }
    }
    for (j, r) in data.records.iter_mut().enumerate() {
        r.weight = (0..r.seen.values.len())
            .map(|c| {
                let known = &speeds[j][c];
                // Samples near events have the speed of the nearest sample of an arc.
                let mut last = known.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
                (0..r.seen.times.len())
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
    //! Contract: chance does not give the noise a further parameter, and arcs that something disturbed are no measure of it.
    use super::*;
    use crate::statistics::chi2_quantile;

    #[test]
    fn a_noise_parameter_pays_beyond_chance_of_one_in_ten_thousand() {
        let reduction = |chance: f64| chi2_quantile(chance, 1.0);
        assert!(!pays(reduction(1e-3)) && pays(reduction(1e-7)));
    }

    /// Arcs about a constant with residuals that alternate, by their standard deviations.
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
    fn an_arc_of_three_and_a_half_times_the_noise_is_disturbed_and_one_of_two_and_a_half_is_not() {
        let arcs = arcs(&[1.0, 1.0, 1.0, 2.5, 3.5]);
        let smooth: Vec<usize> = smooth_arcs(&arcs, 1).iter().map(|arc| arc.place.0).collect();
        assert_eq!(smooth, [0, 1, 2, 3]);
    }
}
