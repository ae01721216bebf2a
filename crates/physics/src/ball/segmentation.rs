//! Model-free detection of impacts, and segmentation of a trajectory into arcs between them.
//!
//! An impact is a jump of the vertical velocity, and shows as a large positive second difference of the
//! height. The threshold depends on the noise. Bounces below the threshold are not detected; the record is
//! cut before them, because an arc with a hidden bounce would look like an arc with coloured noise.

use augsim_system::{CORRELATION_STEPS, DetectedEvent, Record, Window, typical_step};
use std::ops::Range;

/// Lag of the second difference of the height, s.
const LAG: f64 = 0.030;
/// Smallest second difference of the height that counts as an impact, m.
const MIN_JUMP_M: f64 = 0.025;
/// Duration of the free-fall fits before and after an impact, s.
const SIDE_DURATION: f64 = 0.120;
/// Time around an impact, s, whose samples belong to no arc.
const MARGIN: f64 = 0.015;
/// Shortest usable arc between two impacts: its duration, s, and its number of measured heights.
const MIN_ARC: (f64, usize) = (0.16, 9);
/// Minimum number of measured heights of any arc.
const MIN_HEIGHTS: usize = 5;
/// Maximum number of impacts per trajectory: later ones cost derivatives and add little information.
const MAX_IMPACTS: usize = 10;

/// Indices of the samples at which a channel was measured (finite values).
fn measured_samples(values: &[f64]) -> Vec<usize> {
    (0..values.len()).filter(|&k| values[k].is_finite()).collect()
}

/// Elements of `values` with the given indices.
fn select(indices: &[usize], values: &[f64]) -> Vec<f64> {
    indices.iter().map(|&k| values[k]).collect()
}

/// Height and velocity at `t0` of the least-squares parabola with acceleration `-g` through `samples`.
///
/// `None` with fewer than three finite samples.
pub(super) fn fit_free_fall(
    times: &[f64],
    y: &[f64],
    samples: impl Iterator<Item = usize>,
    t0: f64,
    g: f64,
) -> Option<(f64, f64)> {
    let (mut n, mut st, mut stt, mut sy, mut sty) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for k in samples {
        let t = times[k] - t0;
        let v = y[k] + 0.5 * g * t * t;
        if v.is_finite() {
            n += 1.0;
            st += t;
            stt += t * t;
            sy += v;
            sty += t * v;
        }
    }
    let det = n * stt - st * st;
    (n >= 3.0 && det > 0.0).then(|| ((stt * sy - st * sty) / det, (n * sty - st * sy) / det))
}

/// The measured heights of a record, without isolated outliers.
struct Heights {
    /// Sample index in the record of each measured height.
    samples: Vec<usize>,
    /// Times of the measured heights, s.
    times: Vec<f64>,
    /// Measured heights, m, without isolated outliers.
    z: Vec<f64>,
    /// Median time between measured heights, s.
    step: f64,
    /// Lag of the second difference of the height, in samples.
    lag_samples: usize,
    /// Lag of the second difference of the height, s.
    lag: f64,
}

/// An impact, located by the fits before and after it.
struct LocatedImpact {
    /// Time of the impact, s.
    time: f64,
    /// Approach speed of the ball, m/s.
    speed_in: f64,
    /// Departure speed of the ball, m/s.
    speed_out: f64,
}

impl Heights {
    fn new(record: &Record, sigma: f64) -> Self {
        let vertical = record.values.len() - 1;
        let samples = measured_samples(&record.values[vertical]);
        let times = select(&samples, &record.times);
        let z = without_spikes(&select(&samples, &record.values[vertical]), sigma);
        let step = typical_step(&times);
        let lag_samples = ((LAG / step).round() as usize).max(1);
        let lag = lag_samples as f64 * step;
        Self { samples, times, z, step, lag_samples, lag }
    }

    /// Number of measured heights in the sample range `arc` of the record.
    fn count(&self, arc: &Range<usize>) -> usize {
        self.samples.iter().filter(|k| arc.contains(k)).count()
    }

    /// Second difference of the height at the measured height with index `k`, m.
    fn jump(&self, k: usize) -> f64 {
        let (m, times, z) = (self.lag_samples, &self.times, &self.z);
        let (before, after) = (times[k] - times[k - m], times[k + m] - times[k]);
        ((z[k + m] - z[k]) / after - (z[k] - z[k - m]) / before) * self.lag
    }

    /// Index of each detected impact: the largest second difference in a run above the threshold.
    fn peaks(&self, sigma: f64) -> Vec<usize> {
        // The second difference of white noise has the standard deviation sqrt(6) sigma.
        let threshold = (4.5 * 6f64.sqrt() * sigma).max(MIN_JUMP_M);
        let (m, n) = (self.lag_samples, self.times.len());
        let mut peaks: Vec<usize> = Vec::new();
        let mut k = m;
        while k + m < n {
            if self.jump(k) > threshold {
                let mut best = k;
                while k + m < n && self.jump(k) > threshold {
                    if self.jump(k) > self.jump(best) {
                        best = k;
                    }
                    k += 1;
                }
                peaks.push(best);
            }
            k += 1;
        }
        peaks
    }

    /// Locates the impact of peak `i` by free-fall fits before and after it; `None` with too few samples.
    fn locate(&self, peaks: &[usize], i: usize, g: f64, margin: f64) -> Option<LocatedImpact> {
        let (times, z, p) = (&self.times, &self.z, peaks[i]);
        let side = SIDE_DURATION.max(4.5 * self.step);
        let t0 = times[p];
        let previous = peaks.get(i.wrapping_sub(1)).map_or(f64::NEG_INFINITY, |&q| times[q]);
        let next = peaks.get(i + 1).map_or(f64::INFINITY, |&q| times[q]);
        let left =
            (0..p).filter(|&k| times[k] > (t0 - side).max(previous + margin) && times[k] < t0 - margin);
        let right =
            (p..times.len()).filter(|&k| times[k] < (t0 + side).min(next - margin) && times[k] > t0 + margin);
        let ((zl, vl), (zr, vr)) =
            fit_free_fall(times, z, left, t0, g).zip(fit_free_fall(times, z, right, t0, g))?;
        // The second difference peaks at a sample next to the impact, so the impact is within the lag. Where
        // samples are missing, it can be farther away.
        let (max_before, max_after) = ((t0 - times[p - 1]).max(self.lag), (times[p + 1] - t0).max(self.lag));
        // The two parabolas have the same curvature: they intersect where their tangents at t0 do.
        let s = ((zl - zr) / (vr - vl)).clamp(-max_before, max_after);
        Some(LocatedImpact { time: t0 + s, speed_in: g * s - vl, speed_out: vr - g * s })
    }
}

/// Detects impacts and arcs, cuts the record after the last usable arc, sets the rough initial state.
///
/// `sigma` is the noise of the height, m; without `has_bounces` no impacts are searched for. Impacts are
/// detected in the samples with a measured height; arcs and the end of the record are ranges of all samples,
/// because other channels may have been measured there.
pub(super) fn segment(record: &mut Record, g: f64, sigma: f64, has_bounces: bool) {
    let heights = Heights::new(record, sigma);
    let peaks = if has_bounces { heights.peaks(sigma) } else { Vec::new() };
    let margin = heights.step.max(MARGIN);
    let end = find_arcs(record, &heights, &peaks, g, margin);
    record.noise_correlation_s = CORRELATION_STEPS * typical_step(&record.times);
    record.smooth_segments.retain(|a| heights.count(a) >= MIN_HEIGHTS && a.end <= end);
    record.times.truncate(end);
    record.values.iter_mut().for_each(|c| c.truncate(end));
    set_rough_start(record, g);
    record.initial_sample_count = match (record.events.first(), record.smooth_segments.first()) {
        (Some(_), Some(arc)) => arc.end,
        // The first part of a flight without impacts.
        _ => (record.times.len() * 2 / 5).max(6).min(record.times.len()),
    };
}

/// Appends the impacts and arcs of a record; returns the end of the usable samples.
fn find_arcs(record: &mut Record, heights: &Heights, peaks: &[usize], g: f64, margin: f64) -> usize {
    let times = record.times.clone();
    let mut end = times.len();
    let mut out_speed = None;
    let mut arc_start = 0;
    for i in 0..peaks.len() {
        let Some(LocatedImpact { time, speed_in, speed_out }) = heights.locate(peaks, i, g, margin) else {
            end = arc_end(&times, heights.times[peaks[i]], margin);
            break;
        };
        let arc = arc_start..arc_end(&times, time, margin);
        let begin = times.get(arc_start).copied().unwrap_or(time);
        // A hop that is much longer than its departure speed allows contains an undetected bounce.
        let is_overlong = out_speed.is_some_and(|v: f64| time - begin > 2.0 * v / g * 1.15 + 0.05);
        let is_short = heights.count(&arc) < MIN_ARC.1 || time - begin < MIN_ARC.0;
        // The first arc may be short, since the release can be low. A later short or overlong arc ends the
        // record.
        if i > 0 && (is_short || is_overlong) || i >= MAX_IMPACTS || speed_in <= 0.0 {
            end = if is_overlong && out_speed.is_some() {
                end_of_hop(&times, begin, out_speed, g, margin)
            } else {
                arc_start
            };
            if i > 0 && is_short && !is_overlong {
                // The impact before the short arc has a usable arc on one side only: drop it as well.
                end = record.events.last().map_or(end, |e| arc_end(&times, e.time, margin));
                record.events.pop();
                record.smooth_segments.retain(|a| a.end <= end);
            }
            break;
        }
        record.smooth_segments.push(arc);
        record.events.push(DetectedEvent { time, value: (speed_out / speed_in).clamp(0.02, 1.1) });
        out_speed = Some(speed_out);
        arc_start = (0..times.len()).find(|&k| times[k] > time + margin).unwrap_or(times.len());
        end = times.len();
    }
    if end == times.len() && arc_start < times.len() {
        // The last arc has no impact at its end: cut it at the end of its hop.
        let begin = times[arc_start];
        if !record.events.is_empty() {
            end = end_of_hop(&times, begin, out_speed, g, margin);
        }
        if heights.count(&(arc_start..end)) >= MIN_HEIGHTS {
            record.smooth_segments.push(arc_start..end);
        } else if !record.events.is_empty() {
            end = record.events.last().map_or(end, |e| arc_end(&times, e.time, margin));
            record.events.pop();
        }
    }
    end
}

/// Replaces isolated outliers by the mean of their neighbours, for impact detection only.
///
/// An outlier gives second differences of alternating sign, an impact gives no negative ones.
fn without_spikes(y: &[f64], sigma: f64) -> Vec<f64> {
    let mut z = y.to_vec();
    let limit = (7.0 * 6f64.sqrt() * sigma).max(1e-3);
    let second = |z: &[f64], k: usize| z[k + 1] - 2.0 * z[k] + z[k - 1];
    for k in 2..z.len().saturating_sub(2) {
        let (d, left, right) = (second(&z, k), second(&z, k - 1), second(&z, k + 1));
        let is_opposite = |e: f64| e * d < 0.0 && e.abs() > 0.3 * d.abs();
        if d.abs() > limit && is_opposite(left) && is_opposite(right) {
            z[k] = 0.5 * (z[k - 1] + z[k + 1]);
        }
    }
    z
}

/// Index of the end of the samples before an impact at time `impact`, less the margin (both s).
fn arc_end(times: &[f64], impact: f64, margin: f64) -> usize {
    times.iter().position(|&t| t >= impact - margin).unwrap_or(times.len())
}

/// Index of the end of the samples of a flight between two impacts that began at `begin`, s.
///
/// The last 7 % of the ballistic duration of the flight are left out.
fn end_of_hop(times: &[f64], begin: f64, out_speed: Option<f64>, g: f64, margin: f64) -> usize {
    let duration = out_speed.map_or(f64::INFINITY, |v| 2.0 * v / g);
    arc_end(times, begin + 0.93 * duration, margin)
}

/// Makes the record one window whose initial state is that of a free-fall fit to the first arc.
fn set_rough_start(record: &mut Record, g: f64) {
    let channels = record.values.len();
    let mut start = vec![0.0; 2 * channels];
    if let (Some(first), Some(&t0)) = (record.smooth_segments.first(), record.times.first()) {
        for (channel, values) in record.values.iter().enumerate() {
            let gravity = if channel + 1 == channels { g } else { 0.0 };
            if let Some((p, v)) = fit_free_fall(&record.times, values, first.clone(), t0, gravity) {
                (start[channel], start[channels + channel]) = (p, v);
            }
        }
    }
    record.windows = vec![Window { samples: 0..record.times.len(), start }];
}
