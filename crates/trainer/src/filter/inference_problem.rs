//! Bayesian estimation of the unknowns of one trajectory from its observed rows.

use augsim_system::{Offsets, Record, Seed, Simulate, Simulated, Task};

/// A scalar quantity that is estimated for each trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unknown {
    /// What is unknown: a parameter, an initial state, or the random deviation (offset) of an event.
    pub seed: Seed,
    /// Mean and standard deviation of the unknown's normal prior; `None` for a flat prior.
    pub prior: Option<(f64, f64)>,
    /// Lower and upper bound of the unknown.
    pub bounds: [f64; 2],
}

/// The estimation problem of one trajectory: its unknowns, observed rows and noise levels.
pub(super) struct InferenceProblem<'a> {
    pub system: &'a dyn Simulate,
    pub unknowns: &'a [Unknown],
    /// Parameter values of the system, in the order of its parameters.
    pub parameters: &'a [f64],
    /// Whether all events share one random deviation (offset) of the event parameter.
    pub has_shared_offset: bool,
    pub record: &'a Record,
    /// Observed rows `[n, C]` of C channels; NaN where not measured.
    pub rows: &'a [f64],
    /// Standard deviation of the measurement noise of each channel.
    pub sd: Vec<f64>,
    /// Rough initial state from which fits start, in the order of the system's states.
    pub start: Vec<f64>,
}

impl InferenceProblem<'_> {
    /// Number of observed rows.
    pub fn observed_rows(&self) -> usize {
        self.rows.len() / self.sd.len()
    }

    /// Number of measured values in the first `n` rows.
    pub fn measured_values(&self, n: usize) -> usize {
        self.rows[..n * self.sd.len()].iter().filter(|v| v.is_finite()).count()
    }

    /// Simulates the first `samples` samples of the record with given values of the unknowns, into `out`.
    /// Derivatives are computed with respect to `seeds`. Returns false if the simulation fails or any output
    /// is not finite.
    pub fn simulate(&self, values: &[f64], samples: usize, seeds: &[Seed], out: &mut Simulated) -> bool {
        let (mut parameters, mut start) = (self.parameters.to_vec(), self.start.clone());
        let mut offsets = Vec::new();
        for (unknown, value) in self.unknowns.iter().zip(values) {
            match unknown.seed {
                Seed::Parameter(i) => parameters[i] = *value,
                Seed::Start(i) => start[i] = *value,
                Seed::Offset(_) => offsets.push(*value),
            }
        }
        let offsets = match (&offsets[..], self.has_shared_offset) {
            ([], _) => Offsets::None,
            ([offset, ..], true) => Offsets::Shared(*offset),
            (offsets, false) => Offsets::PerEvent(offsets),
        };
        let window = 0..samples;
        let task =
            Task { parameters: &parameters, record: self.record, window, start: &start, offsets, seeds };
        let channels = self.sd.len();
        let finite = |out: &Simulated| {
            out.samples() == samples
                && (0..samples).all(|k| (0..channels).all(|c| out.value(k, c).is_finite()))
        };
        self.system.simulate(&task, out).is_ok() && finite(out)
    }

    /// Negative log posterior density of the unknowns given the first `n` rows, up to a constant.
    /// Infinite where the simulation fails or a value lies outside its bounds.
    pub fn negative_log_posterior(&self, values: &[f64], n: usize, out: &mut Simulated) -> f64 {
        let is_outside = |(u, v): (&Unknown, &f64)| !(u.bounds[0]..=u.bounds[1]).contains(v);
        if self.unknowns.iter().zip(values).any(is_outside) || !self.simulate(values, n, &[], out) {
            return f64::INFINITY;
        }
        self.half_squared_residuals(n, out) + self.negative_log_prior(values)
    }

    /// Half the sum of squared residuals in the first `n` rows, each divided by its noise standard deviation.
    pub fn half_squared_residuals(&self, n: usize, out: &Simulated) -> f64 {
        let channels = self.sd.len();
        let residual =
            |i: usize| (self.rows[i] - out.value(i / channels, i % channels)) / self.sd[i % channels];
        (0..n * channels).map(residual).filter(|r| r.is_finite()).map(|r| 0.5 * r * r).sum()
    }

    /// Negative log prior density of the unknowns, up to a constant.
    pub fn negative_log_prior(&self, values: &[f64]) -> f64 {
        let pairs = self.unknowns.iter().zip(values);
        pairs.filter_map(|(u, value)| u.prior.map(|(mean, sd)| 0.5 * ((value - mean) / sd).powi(2))).sum()
    }
}
