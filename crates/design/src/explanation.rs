//! An explanation: a fitted system with its parameters' uncertainty, its noise and its weight.

use augsim_system::{InitialValue, Record, System};
use std::fmt;
use std::sync::Arc;

/// Measurement noise of an output: white noise plus an autocorrelated error (Ornstein-Uhlenbeck process).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorNoise {
    /// Standard deviation of the white part, in the output's unit.
    pub white_sd: f64,
    /// Standard deviation of the autocorrelated part, in the output's unit; 0 without one.
    pub autocorrelated_sd: f64,
    /// Correlation time of the autocorrelated part, s.
    pub correlation_time_s: f64,
}

/// Process noise on the rate of a state: an Ornstein-Uhlenbeck process that is constant over a sample interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateNoise {
    /// Index of the state among the states of the system.
    pub state: usize,
    /// Standard deviation of the noise, in the unit of the rate.
    pub sd: f64,
    /// Correlation time of the noise, s; 0 if its values at different samples are independent.
    pub correlation_time_s: f64,
}

/// Noise of an explanation: measurement noise of each output, and process noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Noise {
    /// Measurement noise of each output.
    pub sensors: Vec<SensorNoise>,
    /// Process noise of the states that have it.
    pub process: Vec<RateNoise>,
}

/// Correlation of an Ornstein-Uhlenbeck process with itself `step_s` seconds later.
pub(crate) fn decay(correlation_time_s: f64, step_s: f64) -> f64 {
    if correlation_time_s > 0.0 { (-step_s / correlation_time_s).exp() } else { 0.0 }
}

/// A fitted system that may explain the data: values with covariance, noise, and log weight.
#[derive(Clone)]
pub struct Explanation {
    /// Name of the explanation, unique among the live ones.
    pub name: String,
    /// The system; its channels are the measured outputs, then all states.
    pub system: Arc<dyn System>,
    /// The system with one more input for each process noise, in the order of `noise.process`; `None` without any.
    pub driven: Option<Arc<dyn System>>,
    /// Number of measured outputs, the first channels of the system.
    pub outputs: usize,
    /// Values of all parameters of the system.
    pub values: Vec<f64>,
    /// Indices of the parameters that are uncertain.
    pub uncertain: Vec<usize>,
    /// Lower factor L of the covariance L Lᵀ of the uncertain parameters' coordinates, `[uncertain][uncertain]`.
    ///
    /// The coordinate of a parameter with positive bounds is its logarithm, else the parameter.
    pub factor: Vec<Vec<f64>>,
    /// Noise of the outputs and of the states.
    pub noise: Noise,
    /// Logarithm of the prior weight, up to a constant common to all explanations.
    pub log_weight: f64,
}

impl fmt::Debug for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Explanation")
            .field("name", &self.name)
            .field("values", &self.values)
            .finish_non_exhaustive()
    }
}

impl Explanation {
    /// Names of the channels: measured outputs, then states.
    pub fn channels(&self) -> impl Iterator<Item = &str> {
        self.system.schema().channels.iter().map(|c| c.column.as_str())
    }

    /// Copies a record in the form that the system simulates: inputs interpolated, rough initial state.
    ///
    /// # Errors
    /// The system refuses the record.
    pub(crate) fn prepared(&self, record: &Record) -> Result<Record, augsim_system::Objection> {
        let mut own = record.clone();
        // The system has the states as channels after the outputs; nothing measures them.
        own.values.truncate(self.outputs);
        own.values.resize(self.system.schema().channels.len(), vec![f64::NAN; record.times.len()]);
        self.system.prepare(&mut own, &[])?;
        own.values.truncate(self.outputs);
        Ok(own)
    }

    /// Standard deviation of the prior of each of the first `count` initial states; `None` where it is known.
    ///
    /// States without a declared prior get `broad`, in units of their size; the first samples of a record replace it.
    pub(crate) fn start_sd(&self, count: usize, broad: f64) -> Vec<Option<f64>> {
        let sd = |state: &augsim_system::State| match state.initial {
            InitialValue::Fixed(_) | InitialValue::FromRecord => None,
            InitialValue::Free | InitialValue::Measured(_) => Some(broad),
            prior => prior.prior_sd(),
        };
        self.system.schema().states.iter().take(count).map(sd).collect()
    }

    /// Whether a parameter is positive by its bounds: the distribution of its logarithm is then taken as normal.
    ///
    /// Masses and friction coefficients that the data hardly determine have ratios that they determine well; these are
    /// straight lines between logarithms, and a positive parameter stays positive.
    fn is_logarithmic(&self, index: usize) -> bool {
        self.system.parameters()[index].min > 0.0 && self.values[index] > 0.0
    }

    /// Coordinate of a parameter in which its distribution is normal: its logarithm, or itself.
    pub(crate) fn coordinate(&self, index: usize, value: f64) -> f64 {
        if self.is_logarithmic(index) { value.ln() } else { value }
    }

    /// Value of a parameter at such a coordinate.
    pub(crate) fn value_at(&self, index: usize, coordinate: f64) -> f64 {
        if self.is_logarithmic(index) { coordinate.exp() } else { coordinate }
    }

    /// Derivative of a parameter by its coordinate, at its value.
    pub(crate) fn slope_of_value(&self, index: usize, value: f64) -> f64 {
        if self.is_logarithmic(index) { value } else { 1.0 }
    }

    /// Changes of the coordinate of a parameter from its most probable value to its bounds; they contain 0.
    pub(crate) fn room(&self, index: usize) -> [f64; 2] {
        let (p, from) = (&self.system.parameters()[index], self.values[index]);
        [p.min.min(from), p.max.max(from)]
            .map(|bound| self.coordinate(index, bound) - self.coordinate(index, from))
    }

    /// Values with the coordinate of one parameter moved, clamped to its bounds.
    pub(crate) fn moved(&self, mut values: Vec<f64>, index: usize, change: f64) -> Vec<f64> {
        let from = values[index];
        let p = &self.system.parameters()[index];
        let to = self.value_at(index, self.coordinate(index, from) + change);
        values[index] = to.clamp(p.min.min(from), p.max.max(from));
        values
    }

    /// Values of the parameters at `xi`: coordinates η = η₀ + L ξ, clamped to their bounds.
    pub(crate) fn values_at(&self, xi: &[f64]) -> Vec<f64> {
        let rows = self.uncertain.iter().zip(&self.factor);
        rows.fold(self.values.clone(), |values, (index, row)| {
            self.moved(values, *index, row.iter().zip(xi).map(|(l, x)| l * x).sum())
        })
    }

    /// Whether no parameter has to be clamped to its bounds at `xi`.
    pub(crate) fn is_within_bounds(&self, xi: &[f64]) -> bool {
        self.uncertain.iter().zip(&self.factor).all(|(index, row)| {
            let (from, p) = (self.values[*index], &self.system.parameters()[*index]);
            let change = row.iter().zip(xi).map(|(l, x)| l * x).sum::<f64>();
            let value = self.value_at(*index, self.coordinate(*index, from) + change);
            (p.min.min(from)..=p.max.max(from)).contains(&value)
        })
    }

    /// Standard deviation of the coordinate of each uncertain parameter.
    pub(crate) fn coordinate_sds(&self) -> Vec<f64> {
        self.factor.iter().map(|row| row.iter().map(|l| l * l).sum::<f64>().sqrt()).collect()
    }

    /// The explanation with this covariance of the uncertain parameters, in their units.
    pub fn with_covariance(self, covariance: &[Vec<f64>]) -> Self {
        let slopes = self.slopes();
        let entry = |i: usize, j: usize| covariance[i][j] / (slopes[i] * slopes[j]);
        let n = covariance.len();
        let rows: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect();
        Self { factor: factor_of(&rows), ..self }
    }

    /// Derivatives of the uncertain parameters by their coordinates, at the most probable values.
    fn slopes(&self) -> Vec<f64> {
        self.uncertain.iter().map(|i| self.slope_of_value(*i, self.values[*i])).collect()
    }

    /// Covariance matrix of the uncertain parameters about their most probable values, `[uncertain][uncertain]`.
    pub fn covariance(&self) -> Vec<Vec<f64>> {
        let (n, slopes) = (self.factor.len(), self.slopes());
        let dot = |i: usize, j: usize| -> f64 {
            self.factor[i].iter().zip(&self.factor[j]).map(|(a, b)| a * b).sum()
        };
        (0..n).map(|i| (0..n).map(|j| slopes[i] * slopes[j] * dot(i, j)).collect()).collect()
    }

    /// Standard deviation of each uncertain parameter about its most probable value.
    pub fn standard_deviations(&self) -> Vec<f64> {
        self.coordinate_sds().iter().zip(self.slopes()).map(|(sd, slope)| sd * slope).collect()
    }
}

/// Lower Cholesky factor of a covariance matrix; columns of directions without variance are 0.
pub fn factor_of(covariance: &[Vec<f64>]) -> Vec<Vec<f64>> {
    /// Share of a variance below which its part that other parameters do not explain is a rounding error.
    const ROUNDING_RATIO: f64 = 1e-12;
    let n = covariance.len();
    let mut factor = vec![vec![0.0; n]; n];
    for j in 0..n {
        let remaining = covariance[j][j] - factor[j][..j].iter().map(|l| l * l).sum::<f64>();
        if remaining.is_nan() || remaining <= ROUNDING_RATIO * covariance[j][j] {
            continue;
        }
        let diagonal = remaining.sqrt();
        for i in j..n {
            let dot: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
            factor[i][j] = (covariance[i][j] - dot) / diagonal;
        }
    }
    factor
}
