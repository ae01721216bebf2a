//! Guesses the initial states of windows from the first measured samples.

use super::{Model, State};
use crate::text::{Bindings, Kind, Symbol};

/// Number of samples through which `slope` fits the least-squares line.
const SLOPE_SAMPLES: usize = 5;

/// Measured values from the first sample of a window on, with inputs and parameters.
#[derive(Debug, Clone, Copy)]
pub struct FirstSamples<'a> {
    /// Times of the samples, s.
    pub times: &'a [f64],
    /// Measured values of each output of the model, one per sample time; missing values are NaN.
    pub outputs: &'a [&'a [f64]],
    /// Values of the inputs at the first sample, in the order of the model.
    pub inputs: &'a [f64],
    /// Values of all parameters of the model.
    pub parameters: &'a [f64],
}

impl Model {
    /// Evaluates the `start` expression of each state; NaN if an output that it uses has no measured value.
    ///
    /// Those of effects may use the declared states.
    pub fn guess_start(&self, samples: &FirstSamples<'_>) -> Vec<f64> {
        let declared = &self.states[..self.declared_states()];
        let start = declared.iter().map(|state| state.start.tree.value(samples)).collect();
        self.with_starts_of_effects(samples, start)
    }

    /// Appends the initial values of the states of effects to those of the declared states.
    pub(crate) fn with_starts_of_effects(&self, samples: &FirstSamples<'_>, declared: Vec<f64>) -> Vec<f64> {
        let mut start = declared;
        for state in &self.states[self.declared_states()..] {
            let value = state.start.tree.value(&StartOfEffect { samples, start: &start });
            start.push(value);
        }
        start
    }

    /// States of effects that begin with the value of the declared state `state`, and have no distribution about it.
    pub(crate) fn states_that_start_as(&self, state: usize) -> impl Iterator<Item = usize> + '_ {
        let starts_as = move |other: &State| {
            let [node] = &other.start.tree.nodes[..] else { return false };
            other.sd.is_none() && node.kind == Kind::Symbol(Symbol::State(state))
        };
        (self.declared_states()..self.states.len()).filter(move |i| starts_as(&self.states[*i]))
    }
}

impl Model {
    /// Evaluates the `start` expression of a state, with initial states in place of noisy measurements.
    ///
    /// An output that equals a state has the value of that state in `start` instead of its first reading,
    /// which has measurement noise.
    pub(crate) fn start_mean(&self, state: usize, samples: &FirstSamples<'_>, start: &[f64]) -> f64 {
        self.states[state].start.tree.value(&StartMean { model: self, samples, start })
    }
}

/// Values for a `start` expression of an effect: first samples, and initial values of the states before it.
struct StartOfEffect<'a> {
    samples: &'a FirstSamples<'a>,
    start: &'a [f64],
}

impl Bindings for StartOfEffect<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        match symbol {
            Symbol::State(i) => self.start.get(i).copied().unwrap_or(f64::NAN),
            _ => self.samples.symbol(symbol),
        }
    }

    fn table(&self, table: usize, at: f64) -> f64 {
        self.samples.table(table, at)
    }

    fn slope(&self, output: usize) -> f64 {
        self.samples.slope(output)
    }
}

/// Values for a `start` expression: first samples, with initial states in place of the outputs that equal them.
struct StartMean<'a> {
    model: &'a Model,
    samples: &'a FirstSamples<'a>,
    start: &'a [f64],
}

impl Bindings for StartMean<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        let state = match symbol {
            Symbol::Output(output) => self.model.state_of_output(output),
            _ => None,
        };
        let known = state.and_then(|state| self.start.get(state));
        known.copied().unwrap_or_else(|| self.samples.symbol(symbol))
    }

    fn table(&self, table: usize, at: f64) -> f64 {
        self.samples.table(table, at)
    }

    fn slope(&self, output: usize) -> f64 {
        self.samples.slope(output)
    }
}

impl Bindings for FirstSamples<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        let found = match symbol {
            Symbol::Output(i) => return first_value(self, i),
            Symbol::Input(i) => self.inputs.get(i),
            Symbol::Parameter(i) => self.parameters.get(i),
            _ => None,
        };
        found.copied().unwrap_or(f64::NAN)
    }

    fn table(&self, _table: usize, _at: f64) -> f64 {
        f64::NAN
    }

    fn slope(&self, output: usize) -> f64 {
        slope(self, output)
    }
}

/// Lists the measured samples of an output, with their times (s); missing values are left out.
fn measured_samples<'a>(
    samples: &'a FirstSamples<'_>,
    output: usize,
) -> impl Iterator<Item = (f64, f64)> + 'a {
    let values = samples.outputs.get(output).copied().unwrap_or(&[]);
    samples.times.iter().copied().zip(values.iter().copied()).filter(|(_, value)| value.is_finite())
}

/// The first measured value of an output; NaN if there is none.
fn first_value(samples: &FirstSamples<'_>, output: usize) -> f64 {
    measured_samples(samples, output).next().map_or(f64::NAN, |(_, value)| value)
}

/// Slope of the least-squares line through the first measured values; 0 for a single value.
///
/// It uses up to [`SLOPE_SAMPLES`] values.
fn slope(samples: &FirstSamples<'_>, output: usize) -> f64 {
    let points: Vec<(f64, f64)> = measured_samples(samples, output).take(SLOPE_SAMPLES).collect();
    let count = points.len() as f64;
    let mean_time = points.iter().map(|p| p.0).sum::<f64>() / count;
    let mean_value = points.iter().map(|p| p.1).sum::<f64>() / count;
    let covariance: f64 = points.iter().map(|p| (p.0 - mean_time) * (p.1 - mean_value)).sum();
    let variance: f64 = points.iter().map(|p| (p.0 - mean_time) * (p.0 - mean_time)).sum();
    match points.len() {
        0 => f64::NAN,
        1 => 0.0,
        _ => covariance / variance,
    }
}

#[cfg(test)]
mod tests {
    //! Contract: a start value is its expression, evaluated on the first measured samples.
    use super::*;

    #[test]
    fn starts_are_guessed_from_the_first_samples() {
        let model = super::super::parse(crate::example("pendulum").unwrap(), "pendulum.toml").unwrap();
        let times = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5];
        let angle = [f64::NAN, 0.5, 0.7, 0.9, 1.1, 1.3];
        let guess = |angle: &[f64]| {
            let outputs = [angle];
            let samples = FirstSamples { times: &times, outputs: &outputs, inputs: &[], parameters: &[] };
            model.guess_start(&samples)
        };
        let start = guess(&angle);
        assert_eq!(start[0], 0.5);
        assert!((start[1] - 2.0).abs() < 1e-12, "{}", start[1]);
        assert!(guess(&[f64::NAN; 6]).iter().all(|x| x.is_nan()));
    }
}
