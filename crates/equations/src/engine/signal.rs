//! A measured input between its samples: a piecewise cubic in time.

use crate::model::Hold;

/// An input as a function of time: a piecewise cubic.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal {
    times: Vec<f64>,
    /// Coefficients of each piece: powers 0 to 3 of the time since its knot.
    pieces: Vec<[f64; 4]>,
    hold: Hold,
}

impl Signal {
    /// Interpolates `values` at `times` (s, increasing) according to `hold`.
    ///
    /// Missing values (NaN) are left out. The signal is constant before the first knot and after the last;
    /// without any value it is 0.
    pub fn new(times: &[f64], values: &[f64], hold: Hold) -> Signal {
        let (times, values): (Vec<f64>, Vec<f64>) =
            times.iter().zip(values).filter(|(_, v)| v.is_finite()).unzip();
        let last = times.len().saturating_sub(1);
        let curvatures = if hold == Hold::Spline { curvatures(&times, &values) } else { Vec::new() };
        let piece = |i: usize| match hold {
            _ if i == last => [values[i], 0.0, 0.0, 0.0],
            Hold::Zero => [values[i], 0.0, 0.0, 0.0],
            Hold::Linear => [values[i], (values[i + 1] - values[i]) / (times[i + 1] - times[i]), 0.0, 0.0],
            Hold::Spline => {
                let h = times[i + 1] - times[i];
                cubic(h, [values[i], values[i + 1]], [curvatures[i], curvatures[i + 1]])
            }
        };
        let pieces = (0..times.len()).map(piece).collect();
        Signal { times, pieces, hold }
    }

    /// Builds the cubic between two samples of a spline, from the values and second derivatives there.
    pub fn spline_between(times: [f64; 2], values: [f64; 2], curvatures: [f64; 2]) -> Signal {
        let h = times[1] - times[0];
        let first = cubic(h, values, curvatures);
        Signal { times: times.to_vec(), pieces: vec![first, [values[1], 0.0, 0.0, 0.0]], hold: Hold::Spline }
    }

    /// Second derivative of the signal at a time, s; at a knot, that of the piece after it.
    pub fn curvature_at(&self, time: f64) -> f64 {
        2.0 * self.coefficients_around(time, time)[2]
    }

    /// Creates a signal from coefficients of the powers 0 to 3 of the time since each knot.
    ///
    /// The coefficients may be part of what [`coefficients`](Signal::coefficients) returns for a longer signal.
    pub(crate) fn from_coefficients(times: Vec<f64>, pieces: Vec<[f64; 4]>, hold: Hold) -> Signal {
        Signal { times, pieces, hold }
    }

    /// Times of the knots (s), and the coefficients of the piece after each.
    pub(crate) fn coefficients(&self) -> (&[f64], &[[f64; 4]]) {
        (&self.times, &self.pieces)
    }

    /// Interpolation of the signal between samples.
    pub fn hold(&self) -> Hold {
        self.hold
    }

    /// Times of the knots, at which the cubic changes, s.
    pub(crate) fn knots(&self) -> &[f64] {
        &self.times
    }

    /// Coefficients of the piece after knot number `knot`.
    pub(crate) fn piece(&self, knot: usize) -> [f64; 4] {
        self.pieces.get(knot).copied().unwrap_or([0.0; 4])
    }

    /// Coefficients of the piece that contains the time `inside`, in powers of the time since `begin`.
    pub(crate) fn coefficients_around(&self, inside: f64, begin: f64) -> [f64; 4] {
        let after = self.times.partition_point(|knot| *knot <= inside);
        let Some(index) = after.checked_sub(1) else {
            return [self.pieces.first().map_or(0.0, |p| p[0]), 0.0, 0.0, 0.0];
        };
        let [a, b, c, d] = self.pieces[index];
        let s = begin - self.times[index];
        if s == 0.0 || [b, c, d] == [0.0; 3] {
            return [a, b, c, d];
        }
        [a + s * (b + s * (c + s * d)), b + s * (2.0 * c + 3.0 * s * d), c + 3.0 * s * d, d]
    }

    /// Value of the signal at a time, s; at a knot, that of the piece after it.
    pub fn at(&self, time: f64) -> f64 {
        self.coefficients_around(time, time)[0]
    }

    /// Local averages of the signal, as values of a signal with knots only at `times` (s, increasing).
    ///
    /// With zero-order hold an average is the mean up to the next knot, otherwise the mean weighted by a
    /// triangle that ends at the neighbouring knots. A knot at an end without the neighbour that is needed
    /// keeps the value of the signal.
    pub fn averaged(&self, times: &[f64]) -> Vec<f64> {
        let mean = |k: usize| {
            let knot_time = times[k];
            let before = k.checked_sub(1).map(|k| times[k]);
            match (self.hold, before, times.get(k + 1).copied()) {
                (Hold::Zero, _, Some(after)) => {
                    self.integral((knot_time, after), |_| 1.0) / (after - knot_time)
                }
                (Hold::Linear | Hold::Spline, Some(before), Some(after)) => {
                    let ahead = self.integral((before, knot_time), |t| (t - before) / (knot_time - before));
                    let behind = self.integral((knot_time, after), |t| (after - t) / (after - knot_time));
                    (ahead + behind) / (0.5 * (after - before))
                }
                _ => self.at(knot_time),
            }
        };
        (0..times.len()).map(mean).collect()
    }

    /// Integral of the signal from `begin` to a later `end`, times a weight that is linear in time.
    fn integral(&self, (begin, end): (f64, f64), weight: impl Fn(f64) -> f64) -> f64 {
        let from = self.times.partition_point(|knot| *knot <= begin);
        let inner = self.times[from..].iter().copied().take_while(|knot| *knot < end);
        let mut sum = 0.0;
        let mut left = begin;
        for right in inner.chain(std::iter::once(end)) {
            let (middle, half) = (0.5 * (left + right), 0.5 * (right - left));
            // Gauss's rule with three points is exact up to degree 5; a cubic times a line has degree 4.
            let weighted = |x: f64| {
                let time = middle + half * x;
                self.coefficients_around(middle, time)[0] * weight(time)
            };
            let off = 0.6_f64.sqrt();
            sum += half * (5.0 * weighted(-off) + 8.0 * weighted(0.0) + 5.0 * weighted(off)) / 9.0;
            left = right;
        }
        sum
    }
}

/// Coefficients of the cubic over `h` seconds with these values and second derivatives at its ends.
fn cubic(h: f64, [from, to]: [f64; 2], [m, n]: [f64; 2]) -> [f64; 4] {
    let slope = (to - from) / h - h * (2.0 * m + n) / 6.0;
    [from, slope, 0.5 * m, (n - m) / (6.0 * h)]
}

/// Second derivatives of the natural cubic spline at the knots, by the Thomas algorithm.
///
/// de Boor, A Practical Guide to Splines, 1978, chapter 4.
fn curvatures(times: &[f64], values: &[f64]) -> Vec<f64> {
    let n = times.len();
    let mut curvature = vec![0.0; n];
    let (mut upper, mut right) = (vec![0.0; n], vec![0.0; n]);
    for i in 1..n.saturating_sub(1) {
        let (before, after) = (times[i] - times[i - 1], times[i + 1] - times[i]);
        let jump = (values[i + 1] - values[i]) / after - (values[i] - values[i - 1]) / before;
        let pivot = 2.0 * (before + after) - before * upper[i - 1];
        upper[i] = after / pivot;
        right[i] = (6.0 * jump - before * right[i - 1]) / pivot;
    }
    for i in (1..n.saturating_sub(1)).rev() {
        curvature[i] = right[i] - upper[i] * curvature[i + 1];
    }
    curvature
}

#[cfg(test)]
mod tests {
    //! Contract: a signal with fewer knots keeps its integral, and a straight line stays the same.
    use super::*;

    fn swing(hold: Hold) -> Signal {
        let times: Vec<f64> = (0..33).map(|k| 0.1 * f64::from(k)).collect();
        let values: Vec<f64> = times.iter().map(|t| (7.0 * t).sin()).collect();
        Signal::new(&times, &values, hold)
    }

    fn area(signal: &Signal, to: f64) -> f64 {
        signal.integral((0.0, to), |_| 1.0)
    }

    #[test]
    fn zero_order_hold_keeps_the_integral_between_kept_knots() {
        let all = swing(Hold::Zero);
        let kept: Vec<f64> = all.times.iter().copied().step_by(4).collect();
        let fewer = Signal::new(&kept, &all.averaged(&kept), Hold::Zero);
        for at in &kept {
            assert!((area(&fewer, *at) - area(&all, *at)).abs() < 1e-12, "up to {at} s");
        }
    }

    #[test]
    fn a_straight_line_is_unchanged() {
        let times: Vec<f64> = (0..13).map(|k| 0.1 * f64::from(k)).collect();
        let values: Vec<f64> = times.iter().map(|t| 2.0 - 3.0 * t).collect();
        for hold in [Hold::Linear, Hold::Spline] {
            let kept: Vec<f64> = times.iter().copied().step_by(3).collect();
            let averaged = Signal::new(&times, &values, hold).averaged(&kept);
            for (t, v) in kept.iter().zip(&averaged) {
                assert!((v - (2.0 - 3.0 * t)).abs() < 1e-12, "{hold:?} at {t} s: {v}");
            }
        }
    }

    #[test]
    fn alternating_noise_between_the_kept_knots_is_averaged() {
        let times: Vec<f64> = (0..41).map(|k| 0.1 * f64::from(k)).collect();
        // The kept samples alone would all be +1.
        let values: Vec<f64> = (0..41).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        for hold in [Hold::Zero, Hold::Linear] {
            let kept: Vec<f64> = times.iter().copied().step_by(4).collect();
            let averaged = Signal::new(&times, &values, hold).averaged(&kept);
            let inner = &averaged[1..averaged.len() - 1];
            assert!(inner.iter().all(|v| v.abs() < 1e-12), "{hold:?}: {averaged:?}");
        }
    }
}
