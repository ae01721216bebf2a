//! Kalman filter and disturbance smoother of one record, for a motion that is linearised about a path.
//!
//! The state d is the deviation from the path, extended by disturbances. Between samples and at each reading
//!
//! ```text
//! (1)  d_{k+1} = T_k d_k + c_k + w_k,   w_k ~ N(0, diag q)
//! (2)  y = h d + e,                     e ~ N(0, r)
//! ```
//!
//! with y the reading less the output on the path. Readings are processed one by one (univariate treatment:
//! Koopman and Durbin, Journal of Time Series Analysis 21, 2000), so that a missing one is skipped:
//!
//! ```text
//! (3)  v = y - h m,   F = h P hᵀ + r,   K = P hᵀ / F
//! (4)  m <- m + K v,   P <- (I - K h) P (I - K h)ᵀ + K r Kᵀ
//! (5)  ln L = -1/2 Σ (ln F + v² / F)
//! ```
//!
//! The smoother runs backwards over the weighted sum s of later innovations and its variance N (de Jong,
//! Journal of the American Statistical Association 84, 1989); it inverts no covariance:
//!
//! ```text
//! (6)  reading:     s <- s + hᵀ u,  u = v / F - Kᵀ s;   N <- (I - K h)ᵀ N (I - K h) + hᵀ h / F
//! (7)  transition:  s <- Tᵀ s,  N <- Tᵀ N T
//! (8)  smoothed deviation:  m + P s, with m and P before the readings of the sample
//! (9)  d ln L / d q_i = 1/2 Σ (s_i² - N_ii),   d ln L / d r = 1/2 Σ (u² - 1/F - Kᵀ N K)
//! ```

/// Transition from one sample of a record to the next, and the readings at it. Matrices are stored by rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sample {
    /// Offset c of the transition (1), `[D]`, D the number of filter states: simulated next state minus that
    /// on the path.
    pub offset: Vec<f64>,
    /// Transition matrix T of (1), `[D][D]` with D filter states; empty at the last sample.
    pub transition: Vec<f64>,
    pub readings: Vec<Reading>,
}

/// Reading of one sensor channel at one sample, linearised about the path.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reading {
    pub channel: usize,
    /// Measured value minus the output on the path, y in formula (2), in the unit of the channel.
    pub residual: f64,
    /// Derivatives of the output with respect to the D filter states, h in formula (2), `[D]`.
    pub jacobian: Vec<f64>,
}

/// Variances of the initial state, the process noise and the measurement noise.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Noise {
    /// Variances of the D filter states at the first sample, `[D]`.
    pub initial: Vec<f64>,
    /// Process noise variances q of (1) per sample step, `[D]` with D filter states; 0 for states without
    /// process noise.
    pub process: Vec<f64>,
    /// Variances of the white measurement noise, r in formula (2), by channel.
    pub sensor: Vec<f64>,
}

/// The two sums whose difference is the likelihood's derivative (9) for one variance; equal at its maximum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct VarianceBalance {
    /// Observed sum of squares: Σ s² for state variances, Σ u² for measurement noise, in formula (9).
    pub observed: f64,
    /// Expected value of `observed` under the present variances.
    pub expected: f64,
}

/// Results of the Kalman smoother for one record.
#[derive(Clone, Debug, Default)]
pub(crate) struct Smoothing {
    /// Ln likelihood (5) of the readings, without its constant.
    pub ln_likelihood: f64,
    /// Smoothed deviations of the D filter states from the path (8), `[sample][D]`.
    pub deviations: Vec<f64>,
    /// Observed and expected sums of squares (9) for the variances of the initial state, `[D]` with D filter
    /// states.
    pub initial: Vec<VarianceBalance>,
    /// Observed and expected sums of squares (9) for the process noise variances, `[D]` with D filter states.
    pub process: Vec<VarianceBalance>,
    /// Observed and expected sums of squares (9) for the variances of the measurement noise, by channel.
    pub sensor: Vec<VarianceBalance>,
}

/// A reading with its innovation v (measured minus predicted value) and the variance F of the innovation (3).
struct FilteredReading<'s> {
    reading: &'s Reading,
    innovation: f64,
    variance: f64,
}

/// Kalman filter: mean and covariance of the state, and work space for one step.
pub(crate) struct Filter {
    pub mean: Vec<f64>,
    pub covariance: Vec<f64>,
    /// Kalman gain K of the last reading, `[D]` with D filter states.
    pub gain: Vec<f64>,
    pub ln_likelihood: f64,
    /// Covariance times the output derivatives, P hᵀ, `[D]` with D filter states.
    covariance_jacobian: Vec<f64>,
    predicted_mean: Vec<f64>,
    product: Vec<f64>,
}

impl Filter {
    /// Creates a filter before the first sample, with `covariance` `[D][D]` and `mean` `[D]` of the D filter
    /// states.
    pub fn new(covariance: Vec<f64>, mean: Vec<f64>) -> Self {
        let d = mean.len();
        let [gain, covariance_jacobian, predicted_mean] = [(); 3].map(|()| vec![0.0; d]);
        let product = vec![0.0; d * d];
        Self { mean, covariance, gain, ln_likelihood: 0.0, covariance_jacobian, predicted_mean, product }
    }

    /// Updates the state with a reading of noise variance `r`; returns the innovation and its variance.
    pub fn update(&mut self, reading: &Reading, r: f64) -> (f64, f64) {
        self.update_sized(self.mean.len(), reading, r)
    }

    /// Predicts the state at the next sample; `process` holds the process noise variances.
    pub fn predict(&mut self, sample: &Sample, process: &[f64]) {
        self.predict_sized(self.mean.len(), sample, process);
    }

    /// As [`update`](Self::update), for `d` filter states; inlined, so that a constant `d` lets the compiler
    /// unroll the loops.
    #[inline(always)]
    fn update_sized(&mut self, d: usize, reading: &Reading, r: f64) -> (f64, f64) {
        let (mean, covariance) = (&mut self.mean[..d], &mut self.covariance[..d * d]);
        let (jacobian, gain) = (&reading.jacobian[..d], &mut self.gain[..d]);
        let ph = &mut self.covariance_jacobian[..d];
        times(covariance, jacobian, ph);
        let variance = dot(jacobian, ph) + r;
        let innovation = reading.residual - dot(jacobian, mean);
        for ((gain, mean), ph) in gain.iter_mut().zip(mean).zip(&*ph) {
            *gain = ph / variance;
            *mean += *gain * innovation;
        }
        // Joseph's form (4) keeps the covariance positive under rounding: first (I - K h) P, then the rest.
        for (row, gain) in covariance.chunks_exact_mut(d.max(1)).zip(&*gain) {
            row.iter_mut().zip(&*ph).for_each(|(p, ph)| *p -= gain * ph);
        }
        times(covariance, jacobian, ph);
        for ((row, ph), row_gain) in covariance.chunks_exact_mut(d.max(1)).zip(&*ph).zip(&*gain) {
            for (p, column_gain) in row.iter_mut().zip(&*gain) {
                *p = *p - ph * column_gain + r * row_gain * column_gain;
            }
        }
        self.ln_likelihood -= 0.5 * (variance.ln() + innovation * innovation / variance);
        (innovation, variance)
    }

    /// As [`predict`](Self::predict), for `d` filter states; inlined, so that a constant `d` lets the
    /// compiler unroll the loops.
    #[inline(always)]
    fn predict_sized(&mut self, d: usize, sample: &Sample, process: &[f64]) {
        let transition = &sample.transition[..d * d];
        let (mean, predicted) = (&mut self.mean[..d], &mut self.predicted_mean[..d]);
        times(transition, mean, predicted);
        let components = mean.iter_mut().zip(predicted).zip(&sample.offset);
        components.for_each(|((mean, predicted), offset)| *mean = *predicted + offset);
        conjugate(transition, &mut self.covariance[..d * d], &mut self.product[..d * d], d);
        process.iter().enumerate().for_each(|(i, q)| self.covariance[i * d + i] += q);
    }
}

/// Runs the Kalman filter and the disturbance smoother over one record.
pub(crate) fn smooth_record(samples: &[Sample], noise: &Noise) -> Smoothing {
    // With a constant number of components the compiler unrolls the loops over matrices.
    match noise.initial.len() {
        1 => smooth_sized(1, samples, noise),
        2 => smooth_sized(2, samples, noise),
        3 => smooth_sized(3, samples, noise),
        4 => smooth_sized(4, samples, noise),
        5 => smooth_sized(5, samples, noise),
        6 => smooth_sized(6, samples, noise),
        d => smooth_sized(d, samples, noise),
    }
}

/// As [`smooth_record`], for `d` filter states; inlined, so that a constant `d` lets the compiler unroll the
/// loops.
#[inline(always)]
fn smooth_sized(d: usize, samples: &[Sample], noise: &Noise) -> Smoothing {
    let channels = noise.sensor.len();
    let mut filter = Filter::new(diagonal(&noise.initial), vec![0.0; d]);
    // Predicted state of each sample, and each reading with its gain: the backward pass needs them.
    let mut means: Vec<f64> = Vec::with_capacity(samples.len() * d);
    let mut covariances: Vec<f64> = Vec::with_capacity(samples.len() * d * d);
    let mut filtered: Vec<FilteredReading<'_>> = Vec::with_capacity(samples.len() * channels);
    let mut gains: Vec<f64> = Vec::with_capacity(samples.len() * channels * d);
    for (k, sample) in samples.iter().enumerate() {
        means.extend_from_slice(&filter.mean);
        covariances.extend_from_slice(&filter.covariance);
        for reading in &sample.readings {
            let (innovation, variance) = filter.update_sized(d, reading, noise.sensor[reading.channel]);
            filtered.push(FilteredReading { reading, innovation, variance });
            gains.extend_from_slice(&filter.gain);
        }
        if k + 1 < samples.len() {
            filter.predict_sized(d, sample, &noise.process);
        }
    }
    let mut out = Smoothing {
        ln_likelihood: filter.ln_likelihood,
        deviations: vec![0.0; samples.len() * d],
        initial: vec![VarianceBalance::default(); d],
        process: vec![VarianceBalance::default(); d],
        sensor: vec![VarianceBalance::default(); channels],
    };
    let mut backward = BackwardSums::new(d);
    let mut last = filtered.len();
    for (k, sample) in samples.iter().enumerate().rev() {
        if k + 1 < samples.len() {
            for (i, balance) in out.process.iter_mut().enumerate() {
                balance.observed += backward.sum[i] * backward.sum[i];
                balance.expected += backward.variance[i * d + i];
            }
            backward.pass_transition(d, &sample.transition);
        }
        for _ in &sample.readings {
            last -= 1;
            let reading = &filtered[last];
            let balance = &mut out.sensor[reading.reading.channel];
            backward.pass_reading(d, reading, &gains[last * d..(last + 1) * d], balance);
        }
        let correction = &mut backward.vector;
        times(&covariances[k * d * d..(k + 1) * d * d], &backward.sum, correction);
        let smoothed = out.deviations[k * d..(k + 1) * d].iter_mut().zip(&means[k * d..(k + 1) * d]);
        smoothed.zip(&*correction).for_each(|((to, mean), by)| *to = mean + by);
    }
    for (i, balance) in out.initial.iter_mut().enumerate() {
        let (sum, variance) = (backward.sum[i], backward.variance[i * d + i]);
        *balance = VarianceBalance { observed: sum * sum, expected: variance };
    }
    out
}

/// Sums of the backward pass of the smoother over all readings and transitions after the present sample.
struct BackwardSums {
    /// Weighted sum of later innovations, s in formula (6), `[D]` with D filter states.
    sum: Vec<f64>,
    /// Variance of the weighted sum of later innovations, N in formula (6), `[D][D]`.
    variance: Vec<f64>,
    /// Work space: this vector and the following two matrices.
    vector: Vec<f64>,
    product: Vec<f64>,
    transposed: Vec<f64>,
}

impl BackwardSums {
    fn new(d: usize) -> Self {
        let [sum, vector] = [(); 2].map(|()| vec![0.0; d]);
        let [variance, product, transposed] = [(); 3].map(|()| vec![0.0; d * d]);
        Self { sum, variance, vector, product, transposed }
    }

    /// Passes the sums backwards over a transition to the sample before, formula (7).
    #[inline(always)]
    fn pass_transition(&mut self, d: usize, transition: &[f64]) {
        transpose(&transition[..d * d], &mut self.transposed, d);
        times(&self.transposed, &self.sum, &mut self.vector);
        std::mem::swap(&mut self.sum, &mut self.vector);
        conjugate(&self.transposed, &mut self.variance, &mut self.product, d);
    }

    /// Passes the sums backwards over a reading, formula (6), and adds its terms (9) to `balance`.
    #[inline(always)]
    fn pass_reading(
        &mut self,
        d: usize,
        filtered: &FilteredReading<'_>,
        gain: &[f64],
        balance: &mut VarianceBalance,
    ) {
        let jacobian = &filtered.reading.jacobian[..d];
        let error = filtered.innovation / filtered.variance - dot(gain, &self.sum);
        let variance_gain = &mut self.vector[..];
        times(&self.variance, gain, variance_gain);
        let error_variance = 1.0 / filtered.variance + dot(gain, variance_gain);
        balance.observed += error.powi(2);
        balance.expected += error_variance;
        self.sum.iter_mut().zip(jacobian).for_each(|(sum, h)| *sum += h * error);
        for (i, row) in self.variance.chunks_exact_mut(d.max(1)).enumerate() {
            for (j, to) in row.iter_mut().enumerate() {
                let change = jacobian[i] * jacobian[j] * error_variance
                    - jacobian[i] * variance_gain[j]
                    - variance_gain[i] * jacobian[j];
                *to += change;
            }
        }
    }
}

/// Builds the diagonal matrix with these values on its diagonal, stored by rows.
pub(crate) fn diagonal(values: &[f64]) -> Vec<f64> {
    let d = values.len();
    (0..d * d).map(|i| if i / d == i % d { values[i % d] } else { 0.0 }).collect()
}

/// Inner product of two vectors.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Sets `out` to the product of the matrix `m`, by rows, and the vector `v`.
#[inline(always)]
fn times(m: &[f64], v: &[f64], out: &mut [f64]) {
    m.chunks_exact(v.len().max(1)).zip(out).for_each(|(row, to)| *to = dot(row, v));
}

/// Sets `out` to the transpose of the `d` by `d` matrix `m`.
#[inline(always)]
fn transpose(m: &[f64], out: &mut [f64], d: usize) {
    for (i, row) in out.chunks_exact_mut(d.max(1)).enumerate() {
        row.iter_mut().enumerate().for_each(|(k, to)| *to = m[k * d + i]);
    }
}

/// Replaces the symmetric matrix `p` by M P Mᵀ; `product` is work space for M P.
#[inline(always)]
fn conjugate(m: &[f64], p: &mut [f64], product: &mut [f64], d: usize) {
    product.fill(0.0);
    for (to, row) in product.chunks_exact_mut(d.max(1)).zip(m.chunks_exact(d.max(1))) {
        for (factor, p) in row.iter().zip(p.chunks_exact(d.max(1))).filter(|(factor, _)| **factor != 0.0) {
            to.iter_mut().zip(p).for_each(|(to, p)| *to += factor * p);
        }
    }
    for i in 0..d {
        for j in 0..=i {
            let value = dot(&product[i * d..(i + 1) * d], &m[j * d..(j + 1) * d]);
            (p[i * d + j], p[j * d + i]) = (value, value);
        }
    }
}

#[cfg(test)]
mod tests {
    //! Contract: smoothed deviations and likelihood equal those of the joint Gaussian distribution,
    //! conditioned on all readings at once; a balance gives the derivative of the likelihood with respect to
    //! its variance.
    use super::*;
    use augsim_linear::{Mat, invert_positive_definite, solve_positive_definite};

    const D: usize = 3;

    /// A pseudo-random number in [-0.5, 0.5).
    fn pseudo_random(k: usize) -> f64 {
        let x = (k as f64 * 12.9898 + 4.1).sin() * 43758.5453;
        x - x.floor() - 0.5
    }

    fn example() -> (Vec<Sample>, Noise) {
        let reading = |channel: usize, seed: usize| Reading {
            channel,
            residual: pseudo_random(seed),
            jacobian: (0..D).map(|i| pseudo_random(seed + 100 + i)).collect(),
        };
        let samples = (0..6).map(|k| Sample {
            offset: (0..D).map(|i| 0.3 * pseudo_random(1000 + 10 * k + i)).collect(),
            transition: (0..D * D).map(|i| pseudo_random(2000 + 10 * k + i)).collect(),
            // The second channel is not measured at the third sample.
            readings: (0..2).filter(|c| k != 2 || *c == 0).map(|c| reading(c, 3000 + 7 * k + c)).collect(),
        });
        let noise =
            Noise { initial: vec![0.5, 0.8, 0.3], process: vec![0.2, 0.0, 0.4], sensor: vec![0.05, 0.1] };
        (samples.collect(), noise)
    }

    /// Joint prior mean and covariance of the deviations from the path at all samples.
    fn joint(samples: &[Sample], noise: &Noise) -> (Vec<f64>, Mat<f64>) {
        let n = samples.len();
        let mut mean = vec![0.0; n * D];
        // Deviations as linear combinations of independent noises: the initial state and the process noise.
        let mut loadings = Mat::<f64>::zeros(n * D, n * D);
        (0..D).for_each(|i| loadings[(i, i)] = noise.initial[i].sqrt());
        for k in 0..n - 1 {
            for i in 0..D {
                let to = (k + 1) * D + i;
                mean[to] = samples[k].offset[i];
                for j in 0..D {
                    mean[to] += samples[k].transition[i * D + j] * mean[k * D + j];
                    for s in 0..n * D {
                        loadings[(to, s)] += samples[k].transition[i * D + j] * loadings[(k * D + j, s)];
                    }
                }
                loadings[(to, to)] += noise.process[i].sqrt();
            }
        }
        let covariance = &loadings * loadings.transpose();
        (mean, covariance)
    }

    /// Posterior mean of the deviations at all samples, and ln likelihood of the readings, from the joint
    /// distribution.
    fn conditioned(samples: &[Sample], noise: &Noise) -> (Vec<f64>, f64) {
        let (mean, covariance) = joint(samples, noise);
        let readings: Vec<(usize, &Reading)> =
            samples.iter().enumerate().flat_map(|(k, s)| s.readings.iter().map(move |r| (k, r))).collect();
        let rows = Mat::from_fn(readings.len(), mean.len(), |r, i| {
            let (k, reading) = readings[r];
            if i / D == k { reading.jacobian[i % D] } else { 0.0 }
        });
        let mut read = &rows * &covariance * rows.transpose();
        readings
            .iter()
            .enumerate()
            .for_each(|(r, (_, reading))| read[(r, r)] += noise.sensor[reading.channel]);
        let innovations = Mat::from_fn(readings.len(), 1, |r, _| {
            let predicted: f64 = (0..mean.len()).map(|i| rows[(r, i)] * mean[i]).sum();
            readings[r].1.residual - predicted
        });
        let solved = solve_positive_definite(&read, &innovations).expect("positive definite");
        let moved = &covariance * rows.transpose() * &solved;
        let lower =
            Mat::from_fn(readings.len(), readings.len(), |r, c| if r >= c { read[(r, c)] } else { 0.0 });
        let half = invert_positive_definite(lower).expect("positive definite").half_log_determinant;
        let square: f64 = (0..readings.len()).map(|r| innovations[(r, 0)] * solved[(r, 0)]).sum();
        let deviations = (0..mean.len()).map(|i| mean[i] + moved[(i, 0)]).collect();
        (deviations, -half - 0.5 * square)
    }

    #[test]
    fn smoother_equals_the_conditioned_joint_gaussian() {
        let (samples, noise) = example();
        let found = smooth_record(&samples, &noise);
        let (deviations, ll) = conditioned(&samples, &noise);
        for (a, b) in found.deviations.iter().zip(&deviations) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        assert!((found.ln_likelihood - ll).abs() < 1e-12, "{} {ll}", found.ln_likelihood);
    }

    #[test]
    fn balance_is_the_derivative_of_the_likelihood() {
        let (samples, noise) = example();
        let found = smooth_record(&samples, &noise);
        let slope = |change: &dyn Fn(&mut Noise, f64)| {
            let ln_likelihood_at = |by: f64| {
                let mut noise = noise.clone();
                change(&mut noise, by);
                conditioned(&samples, &noise).1
            };
            (ln_likelihood_at(1e-5) - ln_likelihood_at(-1e-5)) / 2e-5
        };
        let half = |b: VarianceBalance| 0.5 * (b.observed - b.expected);
        let pairs = [
            (slope(&|n, by| n.initial[1] += by), half(found.initial[1])),
            (slope(&|n, by| n.process[0] += by), half(found.process[0])),
            (slope(&|n, by| n.process[2] += by), half(found.process[2])),
            (slope(&|n, by| n.sensor[0] += by), half(found.sensor[0])),
            (slope(&|n, by| n.sensor[1] += by), half(found.sensor[1])),
        ];
        for (expected, found) in pairs {
            assert!((expected - found).abs() < 1e-6 * expected.abs().max(1.0), "{expected} {found}");
        }
    }
}
