//! Whitening: divides deviations of the outputs by the square root of their noise covariance.
//!
//! The noise is the output of a linear state-space model with the state d: deviations of the system's states that
//! process noise has caused, the process noise, and the autocorrelated measurement noise of each output.
//!
//! ```text
//! (1)  d_{k+1} = T_k d_k + w_k,    w_k ~ N(0, Q_k)
//! (2)  e = h d + white noise of variance r
//! ```
//!
//! A Kalman filter of this model turns any column c of deviations into R^{-1/2} c, where R is the covariance of all
//! readings, one reading after the other (Harvey 1989, section 3.4):
//!
//! ```text
//! (3)  F = h P hᵀ + r,   K = P hᵀ / F,   c <- (c - h m) / sqrt(F),   m <- m + K (c - h m),   P <- P - K F Kᵀ
//! (4)  ln |R| = Σ ln F
//! ```

use crate::explanation::{Noise, decay};

/// A reading of an output: index of its sample in the record, and of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reading {
    pub sample: usize,
    pub output: usize,
}

/// Derivatives over one sample interval along a simulated path, with S states. Matrices are stored by rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Interval {
    /// Derivatives of the state after the interval by the state before it, `[S][S]`; empty at the last sample.
    pub next_by_state: Vec<f64>,
    /// Derivatives of the outputs at the start of the interval by the state there, `[output][S]`.
    pub output_by_state: Vec<f64>,
}

/// Deviations of readings, one column each; rows are readings in the order of time.
#[derive(Clone, Debug)]
pub(crate) struct Columns {
    pub readings: Vec<Reading>,
    /// Values `[reading][column]`.
    pub values: Vec<f64>,
    pub count: usize,
}

/// Whitens `columns` in place; returns half the logarithm of the variance F of each reading.
///
/// `intervals` holds one interval for each sample where there is process noise, and is empty otherwise.
pub(crate) fn whiten(
    noise: &Noise,
    times: &[f64],
    columns: &mut Columns,
    intervals: &[Interval],
) -> Vec<f64> {
    let has_white_noise_only =
        intervals.is_empty() && noise.sensors.iter().all(|s| s.autocorrelated_sd <= 0.0);
    if has_white_noise_only {
        return whiten_white(noise, columns);
    }
    let mut filter = Filter::new(noise, columns.count, intervals);
    let mut half_logs = Vec::with_capacity(columns.readings.len());
    let mut sample = 0;
    let width = columns.count;
    for (reading, row) in columns.readings.iter().zip(columns.values.chunks_exact_mut(width.max(1))) {
        while sample < reading.sample {
            filter.advance(noise, intervals.get(sample), times[sample + 1] - times[sample]);
            sample += 1;
        }
        let output_by_state = intervals.get(sample).map_or(&[][..], |interval| {
            &interval.output_by_state[reading.output * filter.states..][..filter.states]
        });
        let variance =
            filter.read(noise.sensors[reading.output].white_sd, reading.output, output_by_state, row);
        half_logs.push(0.5 * variance.ln());
    }
    half_logs
}

/// Whitens columns whose noise is white: the filter without states.
fn whiten_white(noise: &Noise, columns: &mut Columns) -> Vec<f64> {
    let width = columns.count.max(1);
    let whitened = |(reading, row): (&Reading, &mut [f64])| {
        let sd = noise.sensors[reading.output].white_sd;
        row.iter_mut().for_each(|value| *value /= sd);
        sd.ln()
    };
    columns.readings.iter().zip(columns.values.chunks_exact_mut(width)).map(whitened).collect()
}

/// Kalman filter of the noise, with one mean for each column of deviations.
struct Filter {
    /// Number of states of the system whose deviations are in the filter; 0 without process noise.
    states: usize,
    /// Filter index of the autocorrelated noise of each output; `None` without one.
    sensors: Vec<Option<usize>>,
    /// Number D of filter states.
    size: usize,
    /// Covariance P, `[D][D]`.
    covariance: Vec<f64>,
    /// Mean m of each column, `[D][column]`.
    means: Vec<f64>,
    columns: usize,
}

impl Filter {
    fn new(noise: &Noise, columns: usize, intervals: &[Interval]) -> Self {
        let outputs = noise.sensors.len().max(1);
        let states = intervals.first().map_or(0, |interval| interval.output_by_state.len() / outputs);
        let mut size = states + if states > 0 { noise.process.len() } else { 0 };
        let mut sensors = Vec::new();
        for sensor in &noise.sensors {
            let has_state = sensor.autocorrelated_sd > 0.0;
            sensors.push(has_state.then_some(size));
            size += usize::from(has_state);
        }
        let mut covariance = vec![0.0; size * size];
        if states > 0 {
            for (j, process) in noise.process.iter().enumerate() {
                covariance[(states + j) * (size + 1)] = process.sd * process.sd;
            }
        }
        for (place, sensor) in sensors.iter().zip(&noise.sensors) {
            place.iter().for_each(|i| covariance[i * (size + 1)] = sensor.autocorrelated_sd.powi(2));
        }
        Self { states, sensors, size, covariance, means: vec![0.0; size * columns], columns }
    }

    /// Whitens one reading of all columns by (3) and returns the variance F.
    fn read(&mut self, white_sd: f64, output: usize, output_by_state: &[f64], row: &mut [f64]) -> f64 {
        let d = self.size;
        let mut h = vec![0.0; d];
        h[..output_by_state.len()].copy_from_slice(output_by_state);
        self.sensors[output].into_iter().for_each(|i| h[i] = 1.0);
        let ph: Vec<f64> = self.covariance.chunks_exact(d.max(1)).map(|row| dot(row, &h)).collect();
        let variance = dot(&ph, &h) + white_sd * white_sd;
        for (column, value) in row.iter_mut().enumerate() {
            let mean: f64 = (0..d).map(|i| h[i] * self.means[i * self.columns + column]).sum();
            let innovation = *value - mean;
            for (i, gain) in ph.iter().enumerate() {
                self.means[i * self.columns + column] += gain / variance * innovation;
            }
            *value = innovation / variance.sqrt();
        }
        for (i, one) in ph.iter().enumerate() {
            for (j, other) in ph.iter().enumerate() {
                self.covariance[i * d + j] -= one * other / variance;
            }
        }
        variance
    }

    /// Moves the filter over a sample interval of `step_s` seconds, formula (1).
    fn advance(&mut self, noise: &Noise, interval: Option<&Interval>, step_s: f64) {
        let (d, n) = (self.size, self.states);
        if d == 0 {
            return;
        }
        let mut transition = vec![0.0; d * d];
        let mut added = vec![0.0; d];
        if let Some(interval) = interval.filter(|i| !i.next_by_state.is_empty() && n > 0) {
            for i in 0..n {
                transition[i * d..i * d + n].copy_from_slice(&interval.next_by_state[i * n..(i + 1) * n]);
                for (j, process) in noise.process.iter().enumerate() {
                    // The noise is constant over the interval; its effect by the trapezoidal rule.
                    let at_end = if i == process.state { 1.0 } else { 0.0 };
                    let at_start = interval.next_by_state[i * n + process.state];
                    transition[i * d + n + j] = 0.5 * step_s * (at_end + at_start);
                }
            }
        }
        if n > 0 {
            for (j, process) in noise.process.iter().enumerate() {
                let keep = decay(process.correlation_time_s, step_s);
                transition[(n + j) * (d + 1)] = keep;
                added[n + j] = process.sd * process.sd * (1.0 - keep * keep);
            }
        }
        for (place, sensor) in self.sensors.iter().zip(&noise.sensors) {
            let keep = decay(sensor.correlation_time_s, step_s);
            for i in place.iter().copied() {
                transition[i * (d + 1)] = keep;
                added[i] = sensor.autocorrelated_sd.powi(2) * (1.0 - keep * keep);
            }
        }
        self.means = product(&transition, &self.means, d, self.columns);
        let left = product(&transition, &self.covariance, d, d);
        for i in 0..d {
            for j in 0..d {
                self.covariance[i * d + j] = dot(&left[i * d..(i + 1) * d], &transition[j * d..(j + 1) * d]);
            }
            self.covariance[i * (d + 1)] += added[i];
        }
    }
}

/// Inner product of two vectors.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Product of a matrix `[d][d]` and a matrix `[d][columns]`, stored by rows.
fn product(a: &[f64], b: &[f64], d: usize, columns: usize) -> Vec<f64> {
    let mut out = vec![0.0; d * columns];
    for i in 0..d {
        for k in (0..d).filter(|k| a[i * d + k] != 0.0) {
            let factor = a[i * d + k];
            for c in 0..columns {
                out[i * columns + c] += factor * b[k * columns + c];
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    //! Contract: whitening by the filter equals whitening by the Cholesky factor of the joint covariance.
    use super::*;
    use crate::explanation::{RateNoise, SensorNoise, factor_of};

    #[test]
    fn whitened_columns_have_the_norm_of_the_joint_covariance() {
        // x' = -x + w, y = 2 x + b + white: the joint covariance of the readings from impulse responses.
        let times = [0.0, 0.3, 0.5, 1.0, 1.1];
        let sensor = SensorNoise { white_sd: 0.3, autocorrelated_sd: 0.7, correlation_time_s: 0.8 };
        let process = RateNoise { state: 0, sd: 0.9, correlation_time_s: 0.4 };
        let noise = Noise { sensors: vec![sensor], process: vec![process] };
        let keep = |k: usize| f64::exp(times[k] - times[k + 1]);
        let interval = |k: usize| Interval {
            next_by_state: if k < 4 { vec![keep(k)] } else { Vec::new() },
            output_by_state: vec![2.0],
        };
        let intervals: Vec<Interval> = (0..5).map(interval).collect();
        let response = |k: usize, j: usize| -> f64 {
            // Output at sample k by the noise over interval j.
            if j >= k {
                return 0.0;
            }
            2.0 * 0.5 * (times[j + 1] - times[j]) * (1.0 + keep(j)) * (j + 1..k).map(keep).product::<f64>()
        };
        let joint: Vec<Vec<f64>> = (0..5)
            .map(|i| {
                (0..5)
                    .map(|j| {
                        let lag = (times[i] - times[j]).abs();
                        let mut sum = 0.49 * (-lag / 0.8).exp() + if i == j { 0.09 } else { 0.0 };
                        for a in 0..4 {
                            for b in 0..4 {
                                let lag = (times[a] - times[b]).abs();
                                sum += response(i, a) * response(j, b) * 0.81 * (-lag / 0.4).exp();
                            }
                        }
                        sum
                    })
                    .collect()
            })
            .collect();
        let factor = factor_of(&joint);
        let deviations = [1.0, -0.5, 0.25, 2.0, -1.0];
        let readings = (0..5).map(|sample| Reading { sample, output: 0 }).collect();
        let mut columns = Columns { readings, values: deviations.to_vec(), count: 1 };
        let half_logs = whiten(&noise, &times, &mut columns, &intervals);
        let mut solved = deviations.to_vec();
        for i in 0..5 {
            let known: f64 = (0..i).map(|k| factor[i][k] * solved[k]).sum();
            solved[i] = (solved[i] - known) / factor[i][i];
        }
        for (filtered, direct) in columns.values.iter().zip(&solved) {
            assert!((filtered - direct).abs() < 1e-12, "{filtered} {direct}");
        }
        let log_determinant: f64 = (0..5).map(|i| factor[i][i].ln()).sum();
        assert!((half_logs.iter().sum::<f64>() - log_determinant).abs() < 1e-12);
    }
}
