//! The Kalman filter and the disturbance smoother of one record whose motion is linear about a path.
//!
//! Deviations from the path move, and so do numbers that wander about 0 and push a rate or shift a reading. Readings are taken one by one (univariate treatment: Koopman and Durbin, Journal of Time Series Analysis 21, 2000),
//! so that a missing one is left out; the smoother runs back over sums of what was not foretold (de Jong, Journal of the American
//! Statistical Association 84, 1989) and inverts no covariance.

/// One sample: how it leads to the next, and how it is read. Matrices are in rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sample {
    /// Offset of the next deviation, `[D]`: where the motion from the path at this sample misses the path at the next.
    pub offset: Vec<f64>,
    /// Derivatives of the next deviation by this one, `[D][D]`; empty at the last sample.
    pub next: Vec<f64>,
    /// Readings.
    pub readings: Vec<Reading>,
}

/// A reading of one channel.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reading {
    pub channel: usize,
    /// The reading less that of the path, in the unit of the channel.
    pub missed: f64,
    /// Derivatives by the deviation, `[D]`.
    pub by: Vec<f64>,
}

/// Variances of everything that is random.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Noise {
    /// Of the deviation at the first sample, `[D]`.
    pub first: Vec<f64>,
    /// Added to the deviation from sample to sample, `[D]`; 0 where nothing is random.
    pub added: Vec<f64>,
    /// Of the readings of each channel.
    pub read: Vec<f64>,
}

/// Sums by which a variance is estimated: its likelihood is highest where they are equal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Balance {
    /// Sum of squares of what the smoother found.
    pub found: f64,
    /// Mean of that sum under the present variances.
    pub expected: f64,
}

/// The smoother's numbers of a record.
#[derive(Clone, Debug, Default)]
pub(crate) struct Smoothing {
    /// Ln likelihood of the readings.
    pub ll: f64,
    /// Deviation at every sample given all readings, `[sample][D]`.
    pub deviations: Vec<f64>,
    /// Balance of the first variance of each component, of what is added to it, and of each channel's readings.
    pub first: Vec<Balance>,
    pub added: Vec<Balance>,
    pub read: Vec<Balance>,
}

/// A reading as the filter took it.
struct Taken<'s> {
    reading: &'s Reading,
    unforeseen: f64,
    variance: f64,
}

/// The state of a filter.
pub(crate) struct Filter {
    pub mean: Vec<f64>,
    pub covariance: Vec<f64>,
    /// Gain of the reading that was taken last, `[D]`.
    pub gain: Vec<f64>,
    pub ll: f64,
    /// Room for a step: two vectors and a matrix.
    spread: Vec<f64>,
    moved: Vec<f64>,
    half: Vec<f64>,
}

impl Filter {
    /// Before the first sample, with a covariance `[D][D]`.
    pub fn new(covariance: Vec<f64>, mean: Vec<f64>) -> Self {
        let d = mean.len();
        let [gain, spread, moved] = [(); 3].map(|()| vec![0.0; d]);
        Self { mean, covariance, gain, ll: 0.0, spread, moved, half: vec![0.0; d * d] }
    }

    /// Takes a reading; what was unforeseen of it, and the variance of that.
    pub fn take(&mut self, reading: &Reading, noise: f64) -> (f64, f64) {
        self.take_in(self.mean.len(), reading, noise)
    }

    /// Moves on to the next sample.
    pub fn advance(&mut self, sample: &Sample, added: &[f64]) {
        self.advance_in(self.mean.len(), sample, added);
    }

    /// Takes a reading where deviations have `d` components.
    #[inline(always)]
    fn take_in(&mut self, d: usize, reading: &Reading, noise: f64) -> (f64, f64) {
        let (mean, covariance) = (&mut self.mean[..d], &mut self.covariance[..d * d]);
        let (by, gain, spread) = (&reading.by[..d], &mut self.gain[..d], &mut self.spread[..d]);
        times(covariance, by, spread);
        let variance = dot(by, spread) + noise;
        let unforeseen = reading.missed - dot(by, mean);
        for ((gain, mean), spread) in gain.iter_mut().zip(mean).zip(&*spread) {
            *gain = spread / variance;
            *mean += *gain * unforeseen;
        }
        // Joseph's form, which rounding cannot make negative: (I - K H) P (I - K H)' + K r K'.
        for (row, gain) in covariance.chunks_exact_mut(d.max(1)).zip(&*gain) {
            row.iter_mut().zip(&*spread).for_each(|(p, spread)| *p -= gain * spread);
        }
        times(covariance, by, spread);
        for ((row, read), own) in covariance.chunks_exact_mut(d.max(1)).zip(&*spread).zip(&*gain) {
            for (p, other) in row.iter_mut().zip(&*gain) {
                *p = *p - read * other + noise * own * other;
            }
        }
        self.ll -= 0.5 * (variance.ln() + unforeseen * unforeseen / variance);
        (unforeseen, variance)
    }

    /// Moves on to the next sample where deviations have `d` components.
    #[inline(always)]
    fn advance_in(&mut self, d: usize, sample: &Sample, added: &[f64]) {
        let (next, mean, moved) = (&sample.next[..d * d], &mut self.mean[..d], &mut self.moved[..d]);
        times(next, mean, moved);
        let each = mean.iter_mut().zip(moved).zip(&sample.offset);
        each.for_each(|((to, moved), offset)| *to = *moved + offset);
        conjugate(next, &mut self.covariance[..d * d], &mut self.half[..d * d], d);
        added.iter().enumerate().for_each(|(i, a)| self.covariance[i * d + i] += a);
    }
}

/// Filters and smooths a record.
pub(crate) fn smoothed(samples: &[Sample], noise: &Noise) -> Smoothing {
    // Loops whose length is known when they are compiled are unrolled.
    match noise.first.len() {
        1 => smoothed_in(1, samples, noise),
        2 => smoothed_in(2, samples, noise),
        3 => smoothed_in(3, samples, noise),
        4 => smoothed_in(4, samples, noise),
        5 => smoothed_in(5, samples, noise),
        6 => smoothed_in(6, samples, noise),
        d => smoothed_in(d, samples, noise),
    }
}

/// Filters and smooths a record whose deviations have `d` components.
#[inline(always)]
fn smoothed_in(d: usize, samples: &[Sample], noise: &Noise) -> Smoothing {
    let channels = noise.read.len();
    let mut filter = Filter::new(diagonal(&noise.first), vec![0.0; d]);
    // Of each sample: what was foretold, and the readings with their gains.
    let mut means: Vec<f64> = Vec::with_capacity(samples.len() * d);
    let mut covariances: Vec<f64> = Vec::with_capacity(samples.len() * d * d);
    let mut taken: Vec<Taken<'_>> = Vec::with_capacity(samples.len() * channels);
    let mut gains: Vec<f64> = Vec::with_capacity(samples.len() * channels * d);
    for (k, sample) in samples.iter().enumerate() {
        means.extend_from_slice(&filter.mean);
        covariances.extend_from_slice(&filter.covariance);
        for reading in &sample.readings {
            let (unforeseen, variance) = filter.take_in(d, reading, noise.read[reading.channel]);
            taken.push(Taken { reading, unforeseen, variance });
            gains.extend_from_slice(&filter.gain);
        }
        if k + 1 < samples.len() {
            filter.advance_in(d, sample, &noise.added);
        }
    }
    let mut out = Smoothing {
        ll: filter.ll,
        deviations: vec![0.0; samples.len() * d],
        first: vec![Balance::default(); d],
        added: vec![Balance::default(); d],
        read: vec![Balance::default(); channels],
    };
    // Sums over everything behind the present sample: of what was unforeseen, and of how much that varies.
    let (mut pull, mut curve) = (vec![0.0; d], vec![0.0; d * d]);
    let (mut moved, mut half, mut back) = (vec![0.0; d], vec![0.0; d * d], vec![0.0; d * d]);
    let mut last = taken.len();
    for (k, sample) in samples.iter().enumerate().rev() {
        if k + 1 < samples.len() {
            for (i, added) in out.added.iter_mut().enumerate() {
                added.found += pull[i] * pull[i];
                added.expected += curve[i * d + i];
            }
            transpose(&sample.next[..d * d], &mut back, d);
            times(&back, &pull, &mut moved);
            std::mem::swap(&mut pull, &mut moved);
            conjugate(&back, &mut curve, &mut half, d);
        }
        for _ in &sample.readings {
            last -= 1;
            let (t, gain) = (&taken[last], &gains[last * d..(last + 1) * d]);
            let by = &t.reading.by[..d];
            let along = dot(gain, &pull);
            let bent = &mut moved[..];
            times(&curve, gain, bent);
            let balance = &mut out.read[t.reading.channel];
            balance.found += (t.unforeseen / t.variance - along).powi(2);
            let curved = dot(gain, bent);
            balance.expected += 1.0 / t.variance + curved;
            // Through I - K H, transposed.
            let through = t.unforeseen / t.variance - along;
            pull.iter_mut().zip(by).for_each(|(p, h)| *p += h * through);
            for (i, row) in curve.chunks_exact_mut(d.max(1)).enumerate() {
                for (j, to) in row.iter_mut().enumerate() {
                    let change =
                        by[i] * by[j] * (1.0 / t.variance + curved) - by[i] * bent[j] - bent[i] * by[j];
                    *to += change;
                }
            }
        }
        times(&covariances[k * d * d..(k + 1) * d * d], &pull, &mut moved);
        let at = out.deviations[k * d..(k + 1) * d].iter_mut().zip(&means[k * d..(k + 1) * d]);
        at.zip(&moved).for_each(|((to, mean), by)| *to = mean + by);
    }
    for i in 0..d {
        out.first[i] = Balance { found: pull[i] * pull[i], expected: curve[i * d + i] };
    }
    out
}

/// A diagonal matrix.
pub(crate) fn diagonal(values: &[f64]) -> Vec<f64> {
    let d = values.len();
    (0..d * d).map(|i| if i / d == i % d { values[i % d] } else { 0.0 }).collect()
}

#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `M v`.
#[inline(always)]
fn times(m: &[f64], v: &[f64], out: &mut [f64]) {
    m.chunks_exact(v.len().max(1)).zip(out).for_each(|(row, to)| *to = dot(row, v));
}

/// `M'`.
#[inline(always)]
fn transpose(m: &[f64], out: &mut [f64], d: usize) {
    for (i, row) in out.chunks_exact_mut(d.max(1)).enumerate() {
        row.iter_mut().enumerate().for_each(|(k, to)| *to = m[k * d + i]);
    }
}

/// `M P M'` in the place of `P`; `half` has room for a matrix.
#[inline(always)]
fn conjugate(m: &[f64], p: &mut [f64], half: &mut [f64], d: usize) {
    half.fill(0.0);
    for (to, row) in half.chunks_exact_mut(d.max(1)).zip(m.chunks_exact(d.max(1))) {
        for (factor, p) in row.iter().zip(p.chunks_exact(d.max(1))).filter(|(factor, _)| **factor != 0.0) {
            to.iter_mut().zip(p).for_each(|(to, p)| *to += factor * p);
        }
    }
    for i in 0..d {
        for j in 0..=i {
            let value = dot(&half[i * d..(i + 1) * d], &m[j * d..(j + 1) * d]);
            (p[i * d + j], p[j * d + i]) = (value, value);
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: smoothed deviations and the likelihood are those of the joint Gaussian of all numbers, conditioned at once; the
    //! balance of a variance is the slope of the likelihood by it.
    use super::*;
    use augsim_linear::{Mat, invert_positive_definite, solve_positive_definite};

    const D: usize = 3;

    /// A small number without a pattern.
    fn drawn(k: usize) -> f64 {
        let x = (k as f64 * 12.9898 + 4.1).sin() * 43758.5453;
        x - x.floor() - 0.5
    }

    fn scene() -> (Vec<Sample>, Noise) {
        let reading = |channel: usize, seed: usize| Reading {
            channel,
            missed: drawn(seed),
            by: (0..D).map(|i| drawn(seed + 100 + i)).collect(),
        };
        let samples = (0..6).map(|k| Sample {
            offset: (0..D).map(|i| 0.3 * drawn(1000 + 10 * k + i)).collect(),
            next: (0..D * D).map(|i| drawn(2000 + 10 * k + i)).collect(),
            // The second channel is not measured at the third sample.
            readings: (0..2).filter(|c| k != 2 || *c == 0).map(|c| reading(c, 3000 + 7 * k + c)).collect(),
        });
        let noise = Noise { first: vec![0.5, 0.8, 0.3], added: vec![0.2, 0.0, 0.4], read: vec![0.05, 0.1] };
        (samples.collect(), noise)
    }

    /// Mean and covariance of all deviations before any reading.
    fn joint(samples: &[Sample], noise: &Noise) -> (Vec<f64>, Mat<f64>) {
        let n = samples.len();
        let mut mean = vec![0.0; n * D];
        // Deviations as sums of what is random: the first sample, and what each step adds.
        let mut by = Mat::<f64>::zeros(n * D, n * D);
        (0..D).for_each(|i| by[(i, i)] = noise.first[i].sqrt());
        for k in 0..n - 1 {
            for i in 0..D {
                let to = (k + 1) * D + i;
                mean[to] = samples[k].offset[i];
                for j in 0..D {
                    mean[to] += samples[k].next[i * D + j] * mean[k * D + j];
                    for s in 0..n * D {
                        by[(to, s)] += samples[k].next[i * D + j] * by[(k * D + j, s)];
                    }
                }
                by[(to, to)] += noise.added[i].sqrt();
            }
        }
        let covariance = &by * by.transpose();
        (mean, covariance)
    }

    /// Deviations given all readings, and the ln likelihood of these, both at once.
    fn conditioned(samples: &[Sample], noise: &Noise) -> (Vec<f64>, f64) {
        let (mean, covariance) = joint(samples, noise);
        let all: Vec<(usize, &Reading)> =
            samples.iter().enumerate().flat_map(|(k, s)| s.readings.iter().map(move |r| (k, r))).collect();
        let rows = Mat::from_fn(all.len(), mean.len(), |r, i| {
            let (k, reading) = all[r];
            if i / D == k { reading.by[i % D] } else { 0.0 }
        });
        let mut read = &rows * &covariance * rows.transpose();
        all.iter().enumerate().for_each(|(r, (_, reading))| read[(r, r)] += noise.read[reading.channel]);
        let off = Mat::from_fn(all.len(), 1, |r, _| {
            let foretold: f64 = (0..mean.len()).map(|i| rows[(r, i)] * mean[i]).sum();
            all[r].1.missed - foretold
        });
        let solved = solve_positive_definite(&read, &off).expect("positive definite");
        let moved = &covariance * rows.transpose() * &solved;
        let lower = Mat::from_fn(all.len(), all.len(), |r, c| if r >= c { read[(r, c)] } else { 0.0 });
        let half = invert_positive_definite(lower).expect("positive definite").half_log_determinant;
        let square: f64 = (0..all.len()).map(|r| off[(r, 0)] * solved[(r, 0)]).sum();
        let deviations = (0..mean.len()).map(|i| mean[i] + moved[(i, 0)]).collect();
        (deviations, -half - 0.5 * square)
    }

    #[test]
    fn deviations_and_likelihood_are_those_of_the_joint_gaussian() {
        let (samples, noise) = scene();
        let found = smoothed(&samples, &noise);
        let (deviations, ll) = conditioned(&samples, &noise);
        for (a, b) in found.deviations.iter().zip(&deviations) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        assert!((found.ll - ll).abs() < 1e-12, "{} {ll}", found.ll);
    }

    #[test]
    fn the_balance_of_a_variance_is_the_slope_of_the_likelihood() {
        let (samples, noise) = scene();
        let found = smoothed(&samples, &noise);
        let slope = |change: &dyn Fn(&mut Noise, f64)| {
            let at = |by: f64| {
                let mut noise = noise.clone();
                change(&mut noise, by);
                conditioned(&samples, &noise).1
            };
            (at(1e-5) - at(-1e-5)) / 2e-5
        };
        let half = |b: Balance| 0.5 * (b.found - b.expected);
        let pairs = [
            (slope(&|n, by| n.first[1] += by), half(found.first[1])),
            (slope(&|n, by| n.added[0] += by), half(found.added[0])),
            (slope(&|n, by| n.added[2] += by), half(found.added[2])),
            (slope(&|n, by| n.read[0] += by), half(found.read[0])),
            (slope(&|n, by| n.read[1] += by), half(found.read[1])),
        ];
        for (expected, found) in pairs {
            assert!((expected - found).abs() < 1e-6 * expected.abs().max(1.0), "{expected} {found}");
        }
    }
}
