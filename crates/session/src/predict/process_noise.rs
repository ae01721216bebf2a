//! Simulation of process noise as drawn inputs that are added to the rates.
//!
//! The noise is an Ornstein-Uhlenbeck process with standard deviation s and correlation time T, sampled
//! exactly at the times of the record (Gillespie, Physical Review E 54, 1996):
//!
//! 1. w(t + h) = a w(t) + s sqrt(1 - a^2) n, with a = exp(-h / T) and n standard normal; a = 0 for T = 0.

use augsim_equations::model::RateNoise;
use augsim_equations::{EquationSystem, ModelError};
use augsim_system::{Record, Stream};
use std::sync::Arc;

/// A system with additional inputs for process noise, and the noise processes of these inputs.
pub(super) struct ProcessNoise {
    pub system: EquationSystem,
    /// Standard deviation and correlation time of the noise of each additional input.
    processes: Vec<RateNoise>,
}

impl ProcessNoise {
    /// Adds inputs for process noise to a system; `None` if the model has no process noise.
    ///
    /// # Errors
    /// [`ModelError`]: the model does not compile.
    pub fn for_system(system: &EquationSystem) -> Result<Option<Self>, ModelError> {
        let processes = system.process_noise();
        if processes.is_empty() {
            return Ok(None);
        }
        Ok(Some(ProcessNoise { system: system.with_process_noise_inputs()?, processes }))
    }

    /// Copies a record and adds drawn noise inputs.
    ///
    /// The noise is 0 before the last of the first `known` samples, to which the initial state was fitted.
    pub fn draw_record(&self, record: &Record, known: usize, normal: &mut dyn FnMut() -> f64) -> Record {
        let first = known.saturating_sub(1);
        let draw = |process: &RateNoise| {
            let mut current = process.sd * normal();
            let mut values = vec![0.0; record.times.len()];
            for (k, value) in values.iter_mut().enumerate().skip(first) {
                *value = current;
                let step_s = record.times.get(k + 1).map_or(0.0, |next| next - record.times[k]);
                current = next_value(current, process.sd, process.correlation_time_s, step_s, normal);
            }
            Stream { times: record.times.clone(), values: vec![values] }
        };
        let noise = self.processes.iter().map(draw).collect::<Vec<_>>();
        let inputs: Arc<[Stream]> = record.inputs.iter().cloned().chain(noise).collect();
        Record { inputs, ..record.clone() }
    }
}

/// Draws the value of an Ornstein-Uhlenbeck process `step_s` seconds after `current`, equation 1.
pub(super) fn next_value(
    current: f64,
    sd: f64,
    correlation_time_s: f64,
    step_s: f64,
    normal: &mut dyn FnMut() -> f64,
) -> f64 {
    let decay = if correlation_time_s > 0.0 { (-step_s / correlation_time_s).exp() } else { 0.0 };
    decay * current + sd * (1.0 - decay * decay).sqrt() * normal()
}
