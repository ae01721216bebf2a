//! Segments of a log without long gaps, and interpolation to a uniform clock.

use std::ops::Range;

/// Gaps of more than this many typical intervals do not count in the mean interval.
///
/// A gap is a loss of samples, and jitter is not: the mean of 1 kHz data with jitter of several intervals is still 1 ms.
const GAP_INTERVALS: f64 = 10.0;

/// Mean interval between samples, s, without the gaps.
///
/// The mean and not the median, because rounded time stamps make the median an interval that the clock does not have.
/// At least two times are needed.
pub fn mean_interval(time_s: &[f64]) -> f64 {
    let mut intervals: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    intervals.sort_by(f64::total_cmp);
    let limit = GAP_INTERVALS * intervals[intervals.len() / 2];
    let regular = intervals.partition_point(|interval| *interval <= limit);
    intervals[..regular].iter().sum::<f64>() / regular as f64
}

/// Splits the rows where the interval between two samples exceeds `max_gap_s`.
pub fn split_at_gaps(time_s: &[f64], max_gap_s: f64) -> Vec<Range<usize>> {
    let mut segments = Vec::new();
    let mut start = 0;
    for i in 1..time_s.len() {
        if time_s[i] - time_s[i - 1] > max_gap_s {
            segments.push(start..i);
            start = i;
        }
    }
    segments.push(start..time_s.len());
    segments
}

/// Number of samples of the uniform clock between two times, both included.
///
/// The last sample may lie within a millionth of an interval after the end, so that rounding does not drop it.
pub fn uniform_count(start_s: f64, end_s: f64, interval_s: f64) -> usize {
    ((end_s - start_s) / interval_s + 1e-6).floor() as usize + 1
}

/// Interpolates samples at `time_s`, `[n]`, to the times `time_s[0] + i * interval_s`.
///
/// The interpolant is the cubic Hermite spline whose slope at a sample is that of the parabola through it and its two
/// neighbours. It is exact for quadratic motion at any jitter, and at a sample it has the value of the sample, so that
/// samples on a uniform clock stay as they are.
pub fn interpolate(time_s: &[f64], values: &[f64], interval_s: f64) -> Vec<f64> {
    let n = time_s.len();
    if n < 2 {
        return values.to_vec();
    }
    let slopes = slopes(time_s, values);
    let mut i = 0;
    let count = uniform_count(time_s[0], time_s[n - 1], interval_s);
    (0..count)
        .map(|k| {
            let t = time_s[0] + k as f64 * interval_s;
            while i + 2 < n && time_s[i + 1] <= t {
                i += 1;
            }
            let h = time_s[i + 1] - time_s[i];
            let s = (t - time_s[i]) / h;
            let r = 1.0 - s;
            let left = (1.0 + 2.0 * s) * values[i] + s * h * slopes[i];
            let right = (1.0 + 2.0 * r) * values[i + 1] - r * h * slopes[i + 1];
            r * r * left + s * s * right
        })
        .collect()
}

/// Slope at each sample of the parabola through it and its neighbours; at the ends through the next two samples.
fn slopes(time_s: &[f64], values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let chord = |i: usize| (values[i + 1] - values[i]) / (time_s[i + 1] - time_s[i]);
    if n == 2 {
        return vec![chord(0); 2];
    }
    let bend = |i: usize| (chord(i) - chord(i - 1)) / (time_s[i + 1] - time_s[i - 1]);
    (0..n)
        .map(|i| match i {
            0 => chord(0) - bend(1) * (time_s[1] - time_s[0]),
            i if i == n - 1 => chord(n - 2) + bend(n - 2) * (time_s[n - 1] - time_s[n - 2]),
            i => chord(i - 1) + bend(i) * (time_s[i] - time_s[i - 1]),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    //! Contract: gaps split a log, and interpolation is exact for parabolas and at the samples themselves.
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_parabola_is_interpolated_exactly_on_a_jittered_clock() {
        let time: Vec<f64> = [0.0, 0.7, 1.9, 2.0, 4.3, 5.0].to_vec();
        let parabola = |t: f64| 2.0 - 3.0 * t + 0.5 * t * t;
        let values: Vec<f64> = time.iter().map(|t| parabola(*t)).collect();
        let uniform = interpolate(&time, &values, 0.5);
        assert_eq!(uniform.len(), 11);
        for (k, value) in uniform.iter().enumerate() {
            assert_relative_eq!(*value, parabola(0.5 * k as f64), epsilon = 1e-12);
        }
    }

    #[test]
    fn samples_on_a_uniform_clock_stay_as_they_are() {
        let time: Vec<f64> = (0..1000).map(|i| 3.0 + i as f64 * 1e-3).collect();
        let values: Vec<f64> = (0..1000).map(|i| ((i * 37) % 101) as f64).collect();
        let uniform = interpolate(&time, &values, mean_interval(&time));
        assert_eq!(uniform.len(), 1000);
        for (found, value) in uniform.iter().zip(&values) {
            assert_relative_eq!(*found, *value, epsilon = 1e-7);
        }
    }

    #[test]
    fn a_gap_splits_the_log_and_does_not_count_in_the_interval() {
        let mut time: Vec<f64> = (0..50).map(|i| i as f64 * 0.01).collect();
        time.extend((0..50).map(|i| 7.0 + i as f64 * 0.01));
        assert_relative_eq!(mean_interval(&time), 0.01, epsilon = 1e-12);
        assert_eq!(split_at_gaps(&time, 0.05), [0..50, 50..100]);
        assert_eq!(split_at_gaps(&time, 10.0).len(), 1);
    }
}
