//! Limits of an experiment: ranges of inputs, states and outputs, input rates, energy, duration.

use std::collections::BTreeMap;

/// Limits of an input.
#[derive(Clone, Debug, PartialEq)]
pub struct InputLimits {
    /// Name of the input.
    pub name: String,
    /// Smallest and largest value, in the input's unit.
    pub range: [f64; 2],
    /// Largest absolute rate of change, in the input's unit per second; `None` for no limit.
    ///
    /// With a limit the input begins at its rest value.
    pub rate_per_s: Option<f64>,
    /// Largest integral of the squared input over a run, in the squared unit times seconds; `None` for no limit.
    pub energy: Option<f64>,
}

/// Limits of an experiment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Limits {
    /// Limits of the inputs, in the order of the model.
    pub inputs: Vec<InputLimits>,
    /// Smallest and largest value of outputs and states, by name.
    pub ranges: BTreeMap<String, [f64; 2]>,
    /// Range from which the initial value of a state is chosen; two equal numbers give it. Other states start as the model says.
    pub starts: BTreeMap<String, [f64; 2]>,
    /// Duration of a run, s.
    pub duration_s: f64,
    /// Time between samples, s.
    pub step_s: f64,
}

impl Limits {
    /// Sample times of a run, s, from 0.
    pub fn times(&self) -> Vec<f64> {
        let count = (self.duration_s / self.step_s * (1.0 + 1e-9)).floor() as usize;
        (0..=count.max(1)).map(|k| k as f64 * self.step_s).collect()
    }
}

impl InputLimits {
    /// Value of the input at rest: the value within the range that is nearest to 0.
    pub fn rest(&self) -> f64 {
        0.0_f64.clamp(self.range[0], self.range[1])
    }

    /// Changes `values`, sampled every `step_s` seconds, by as little as the limits require.
    ///
    /// The deviation from rest is first multiplied by `scale`, from 0 to 1.
    pub fn apply(&self, values: &mut [f64], scale: f64, step_s: f64) {
        let rest = self.rest();
        values.iter_mut().for_each(|v| *v = (rest + scale * (*v - rest)).clamp(self.range[0], self.range[1]));
        if let Some(rate) = self.rate_per_s {
            let mut before = rest;
            for (k, value) in values.iter_mut().enumerate() {
                let most = if k == 0 { 0.0 } else { rate * step_s };
                *value = value.clamp(before - most, before + most);
                before = *value;
            }
        }
        if let Some(most) = self.energy {
            let energy = energy(values, step_s);
            if energy > most {
                // Only a smaller amplitude about 0 is sure to have less energy.
                let share = (most / energy).sqrt() * (1.0 - 1e-12);
                values.iter_mut().for_each(|v| *v = (*v * share).clamp(self.range[0], self.range[1]));
            }
        }
    }
}

/// Integral of the squared input by the trapezoidal rule, which bounds that of held and linear inputs closely.
pub(crate) fn energy(values: &[f64], step_s: f64) -> f64 {
    // Each sample counts for a whole interval: never less than the integral of a held input.
    values.iter().map(|v| v * v * step_s).sum()
}

#[cfg(test)]
mod tests {
    //! Contract: shaped inputs are within range, rate and energy, and unchanged where they were already.
    use super::*;

    #[test]
    fn shaped_inputs_are_within_all_limits() {
        let limits =
            InputLimits { name: "u_V".into(), range: [-1.0, 2.0], rate_per_s: Some(10.0), energy: Some(0.4) };
        let mut values: Vec<f64> = (0..100).map(|k| if k % 20 < 10 { 5.0 } else { -5.0 }).collect();
        limits.apply(&mut values, 1.0, 0.01);
        assert!(values.iter().all(|v| (-1.0..=2.0).contains(v)));
        assert!(values.windows(2).all(|w| (w[1] - w[0]).abs() <= 0.1 + 1e-12) && values[0] == 0.0);
        assert!(energy(&values, 0.01) <= 0.4);
        let mut inside = vec![0.0, 0.05, 0.1, 0.05];
        limits.apply(&mut inside, 1.0, 0.01);
        assert_eq!(inside, [0.0, 0.05, 0.1, 0.05]);
    }
}
