//! First guesses of start states from measured samples.

use super::Model;
use crate::text::{Meaning, Symbol};

/// Samples of which `slope` takes the least-squares line.
const SLOPE_SAMPLES: usize = 5;

/// Measured values from the begin of a window on.
#[derive(Debug, Clone, Copy)]
pub struct FirstSamples<'a> {
    /// Times in seconds.
    pub times: &'a [f64],
    /// Each output of the model at these times; what is missing is NaN.
    pub outputs: &'a [&'a [f64]],
    /// Inputs at the first of them, in the order of the model.
    pub inputs: &'a [f64],
    /// Values of all parameters of the model.
    pub parameters: &'a [f64],
}

impl Model {
    /// The states that `start` guesses, in order; NaN where an output that it needs is nowhere measured.
    pub fn guess_start(&self, samples: &FirstSamples<'_>) -> Vec<f64> {
        self.states.iter().map(|state| state.start.tree.value(samples)).collect()
    }
}

impl Meaning for FirstSamples<'_> {
    fn symbol(&self, symbol: Symbol) -> f64 {
        let found = match symbol {
            Symbol::Output(i) => return first(self, i),
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

/// Samples of an output that are there, with their times.
fn present<'a>(samples: &'a FirstSamples<'_>, output: usize) -> impl Iterator<Item = (f64, f64)> + 'a {
    let values = samples.outputs.get(output).copied().unwrap_or(&[]);
    samples.times.iter().copied().zip(values.iter().copied()).filter(|(_, value)| value.is_finite())
}

fn first(samples: &FirstSamples<'_>, output: usize) -> f64 {
    present(samples, output).next().map_or(f64::NAN, |(_, value)| value)
}

/// Slope of the least-squares line through the first five samples; 0 for a single one.
fn slope(samples: &FirstSamples<'_>, output: usize) -> f64 {
    let points: Vec<(f64, f64)> = present(samples, output).take(SLOPE_SAMPLES).collect();
    let count = points.len() as f64;
    let time = points.iter().map(|p| p.0).sum::<f64>() / count;
    let value = points.iter().map(|p| p.1).sum::<f64>() / count;
    let above: f64 = points.iter().map(|p| (p.0 - time) * (p.1 - value)).sum();
    let below: f64 = points.iter().map(|p| (p.0 - time) * (p.0 - time)).sum();
    match points.len() {
        0 => f64::NAN,
        1 => 0.0,
        _ => above / below,
    }
}

#[cfg(test)]
mod tests {
    //! Contract: a guess is what its expression says of the first samples that are there.
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
