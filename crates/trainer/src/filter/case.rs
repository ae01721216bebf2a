//! One trajectory behind a prefix as a problem of inference: what is unknown, what was seen, and what a guess costs.

use augsim_physics::system::{Offsets, Record, Seed, Simulated, System, Task};

/// A number that is not known of a trajectory before it is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unknown {
    /// Where it enters a simulation.
    pub seed: Seed,
    /// Mean and standard deviation of its law; none where nothing is known.
    pub law: Option<(f64, f64)>,
    /// Bounds.
    pub bounds: [f64; 2],
}

/// One trajectory, the rows seen of it, and how well they are seen.
pub(super) struct Case<'a> {
    pub system: &'a dyn System,
    pub unknowns: &'a [Unknown],
    /// Parameters of the system, in its order.
    pub values: &'a [f64],
    /// Whether one offset is that of all events.
    pub shared: bool,
    pub record: &'a Record,
    /// Rows `[n, C]`; not a number where not measured or not seen.
    pub rows: &'a [f64],
    /// Standard deviation of each channel.
    pub sd: Vec<f64>,
    /// The state that fits begin from, in the order of the schema.
    pub start: Vec<f64>,
}

impl Case<'_> {
    /// Rows seen.
    pub fn seen(&self) -> usize {
        self.rows.len() / self.sd.len()
    }

    /// Readings among the first `n` rows.
    pub fn readings(&self, n: usize) -> usize {
        self.rows[..n * self.sd.len()].iter().filter(|v| v.is_finite()).count()
    }

    /// Simulates the first `samples` of the record at values of the unknowns, with derivatives with respect to `seeds`; false
    /// where that cannot be done.
    pub fn simulate(&self, at: &[f64], samples: usize, seeds: &[Seed], out: &mut Simulated) -> bool {
        let (mut parameters, mut start) = (self.values.to_vec(), self.start.clone());
        let mut offsets = Vec::new();
        for (unknown, value) in self.unknowns.iter().zip(at) {
            match unknown.seed {
                Seed::Parameter(i) => parameters[i] = *value,
                Seed::Start(i) => start[i] = *value,
                Seed::Offset(_) => offsets.push(*value),
            }
        }
        let offsets = match (&offsets[..], self.shared) {
            ([], _) => Offsets::None,
            ([one, ..], true) => Offsets::Shared(*one),
            (each, false) => Offsets::Each(each),
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

    /// Negative log posterior density of the unknowns given the first `n` rows, less a constant; infinite where the system
    /// cannot be simulated or a bound is passed.
    pub fn cost(&self, at: &[f64], n: usize, out: &mut Simulated) -> f64 {
        let is_outside = |(u, v): (&Unknown, &f64)| !(u.bounds[0]..=u.bounds[1]).contains(v);
        if self.unknowns.iter().zip(at).any(is_outside) || !self.simulate(at, n, &[], out) {
            return f64::INFINITY;
        }
        self.misfit(n, out) + self.against_laws(at)
    }

    /// Half the sum of squared residuals of a simulation of the first `n` rows, in units of the sensor.
    pub fn misfit(&self, n: usize, out: &Simulated) -> f64 {
        let channels = self.sd.len();
        let residual =
            |i: usize| (self.rows[i] - out.value(i / channels, i % channels)) / self.sd[i % channels];
        (0..n * channels).map(residual).filter(|r| r.is_finite()).map(|r| 0.5 * r * r).sum()
    }

    /// Half the squared distances of the unknowns from their laws.
    pub fn against_laws(&self, at: &[f64]) -> f64 {
        let each = self.unknowns.iter().zip(at);
        each.filter_map(|(u, v)| u.law.map(|(mean, sd)| 0.5 * ((v - mean) / sd).powi(2))).sum()
    }
}
